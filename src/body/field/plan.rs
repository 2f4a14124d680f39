//! What a field is made of before it is sampled: spacings, boxes, the bricks that may be stored, and
//! the limit on memory.

use super::{Level, NONE};
use crate::body::sign::Rows;
use crate::error::{Error, Result};
use crate::math::Vec3;

/// Largest memory of a field while it is built [bytes].
const MAX_BYTES: f64 = 1e9;
/// Distance from a stored brick's centre to the surface, in spacings, on the finest level and on
/// the others: there it only has to pass the finest one's.
const BAND: f64 = 6.2;
const COARSE_BAND: f64 = 4.5;
/// Half diagonal of a brick's nodes, in spacings: 1.5 sqrt(3), rounded up.
pub(super) const RADIUS: f64 = 2.6;
/// A level with at most this many bricks in its box is the top and stored whole.
const TOP_BRICKS: f64 = 600.0;
/// Spacings of the top level between the mesh and the border of the box.
const MARGIN: f64 = 2.0;

/// Largest distance [m] from a stored brick's centre to the surface.
pub(super) fn band(level: usize, levels: usize, h: f64) -> f64 {
    if level + 1 == levels {
        f64::INFINITY
    } else if level == 0 {
        BAND * h
    } else {
        COARSE_BAND * h
    }
}

/// Levels' spacings and boxes for a mesh within `bounds`, after checking what they cost.
pub(super) fn plan(
    bounds: (Vec3, Vec3),
    h: f64,
    triangles: usize,
) -> Result<(Vec<Level>, Vec3, Vec3)> {
    let size = bounds.1 - bounds.0;
    let mut total = 0.0;
    let mut spacings = vec![h];
    loop {
        let s = spacings[spacings.len() - 1];
        let top = size.iter().map(|e| e / (4.0 * s) + 3.0).product::<f64>() <= TOP_BRICKS;
        if top && spacings.len() > 1 {
            break;
        }
        spacings.push(4.0 * s);
    }
    let top = spacings[spacings.len() - 1];
    let margin = Vec3::repeat(MARGIN * top);
    let (lo, hi) = (bounds.0 - margin, bounds.1 + margin);
    let far = lo.amax().max(hi.amax());
    if far / h > 1e12 {
        return Err(Error::limit(format!(
            "cell size {h} m is too small beside coordinates of {far} m; the ratio's limit is 1e12"
        )));
    }
    let mut boxes = Vec::new();
    for (l, &s) in spacings.iter().enumerate() {
        // the top level reaches two nodes further than the box, the others as far as their band
        let pad = if l + 1 == spacings.len() {
            margin + Vec3::repeat(2.0 * s)
        } else {
            Vec3::repeat((BAND + RADIUS) * s)
        };
        let cells: Vec<(f64, f64)> = (0..3)
            .map(|d| {
                let b = 4.0 * s;
                (
                    ((bounds.0[d] - pad[d]) / b).floor(),
                    ((bounds.1[d] + pad[d]) / b).floor() + 1.0,
                )
            })
            .collect();
        // slots, two masks and two passes of them; rows of crossings
        total += cells.iter().map(|c| c.1 - c.0).product::<f64>() * 8.0;
        total += (0..3)
            .map(|a| 8.0 * Rows::count(&bounds.0, &bounds.1, s, a))
            .sum::<f64>();
        boxes.push((s, cells));
    }
    check_bytes(total, "its index", h, &size, triangles)?;
    let levels = boxes
        .into_iter()
        .map(|(h, c)| {
            let n = [0, 1, 2].map(|d| (c[d].1 - c[d].0) as usize);
            Level {
                h,
                lo: [0, 1, 2].map(|d| c[d].0 as i64),
                n,
                slots: vec![NONE; n[0] * n[1] * n[2]],
                bricks: Vec::new(),
                coefficients: Vec::new(),
            }
        })
        .collect();
    Ok((levels, lo, hi))
}

pub(super) fn check_bytes(
    bytes: f64,
    what: &str,
    h: f64,
    size: &Vec3,
    triangles: usize,
) -> Result<()> {
    if bytes > MAX_BYTES {
        return Err(Error::limit(format!(
            "a distance field of cell size {h} m on a body of {:.3} x {:.3} x {:.3} m with \
             {triangles} triangles needs {:.0} MB for {what}, limit {:.0} MB; take a larger cell",
            size.x,
            size.y,
            size.z,
            bytes / 1e6,
            MAX_BYTES / 1e6
        )));
    }
    Ok(())
}

/// Marks the bricks within `reach` [m] (or somewhat more) of any of the boxes.
pub(super) fn mark(
    level: &Level,
    boxes: impl Iterator<Item = (Vec3, Vec3)>,
    reach: f64,
) -> Vec<bool> {
    let brick = 4.0 * level.h;
    let mut mask = vec![false; level.slots.len()];
    let clamp = |x: f64, d: usize| {
        let i = (x / brick).floor() - level.lo[d] as f64;
        i.clamp(0.0, (level.n[d] - 1) as f64) as usize
    };
    for (lo, hi) in boxes {
        let (a, b) = (
            [0, 1, 2].map(|d| clamp(lo[d], d)),
            [0, 1, 2].map(|d| clamp(hi[d], d)),
        );
        for x in a[0]..=b[0] {
            for y in a[1]..=b[1] {
                let row = (x * level.n[1] + y) * level.n[2];
                mask[row + a[2]..=row + b[2]].fill(true);
            }
        }
    }
    // spread along one axis after the other
    let steps = (reach / brick).ceil() as usize;
    let strides = [level.n[1] * level.n[2], level.n[2], 1];
    let mut line = Vec::new();
    for d in 0..3 {
        let (a, b) = ((d + 1) % 3, (d + 2) % 3);
        for i in 0..level.n[a] {
            for j in 0..level.n[b] {
                let start = i * strides[a] + j * strides[b];
                line.clear();
                line.extend((0..level.n[d]).map(|m| mask[start + m * strides[d]]));
                for m in 0..level.n[d] {
                    if line[m] {
                        for s in m.saturating_sub(steps)..(m + steps + 1).min(level.n[d]) {
                            mask[start + s * strides[d]] = true;
                        }
                    }
                }
            }
        }
    }
    mask
}
