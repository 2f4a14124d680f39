//! Sparse signed distance field of a closed mesh: nested levels of bricks, read as one C1 function.
//!
//! Level `l` has spacing `h_l = 4^l h` and nodes at `(i + 1/2) h_l`, in bricks of 4 x 4 x 4 nodes.
//! A brick is stored where its centre is within `BAND` spacings of the surface; the top level is
//! stored in the whole box. So the fine level spans the cloth's neighbourhood, the next one (4 h)
//! everything inside a person and some decimetres around it, all sampled with exact distances.
//!
//! A coefficient that a level does not store is the one by which the next level's spline is written
//! in the finer basis (the spaces are nested, see `spline`). The field is thus a single C1 function
//! across all levels without any blending weight: where no coefficient of a level is stored, it is
//! the next level's spline exactly.
//!
//! The lattice is fixed in the body's frame (multiples of `h`) and every stored number is a function
//! of the positions alone, so that a field updated near moved triangles has the same bits as one
//! built anew. Outside the box (the mesh's bounds and two top-level spacings) see
//! `spline::beyond_box`. Coefficients are f32: 6e-8 of the distance, far below the sampling error;
//! the function built on them is C1 all the same.

use super::bvh::{Bvh, Near};
use super::sign::{self, Rows};
use super::{Distance, spline};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::parallel::Workers;

/// Largest memory of a field while it is built [bytes].
const MAX_BYTES: f64 = 1e9;
/// Distance from a stored brick's centre to the surface, in spacings, on the finest level and on
/// the others: there it only has to pass the finest one's.
const BAND: f64 = 6.2;
const COARSE_BAND: f64 = 4.5;
/// Half diagonal of a brick's nodes, in spacings: 1.5 sqrt(3), rounded up.
const RADIUS: f64 = 2.6;
/// A level with at most this many bricks in its box is the top and stored whole.
const TOP_BRICKS: f64 = 600.0;
/// Spacings of the top level between the mesh and the border of the box.
const MARGIN: f64 = 2.0;
/// Candidates above which a brick asks the tree node by node.
const MANY: usize = 768;

const NONE: u32 = u32::MAX;

/// Coefficients or distances of a brick's nodes, `[(4 x + y) 4 + z]`.
type Brick = [f32; 64];

/// One spacing of the field.
#[derive(Clone, Debug)]
struct Level {
    h: f64,
    /// Brick coordinates of the box's first brick, and bricks per axis.
    lo: [i64; 3],
    n: [usize; 3],
    /// Slot of every brick of the box, `NONE` where it is not stored.
    slots: Vec<u32>,
    /// Place of every stored brick, ascending in `slots`.
    bricks: Vec<[i64; 3]>,
    coefficients: Vec<Brick>,
}

/// What a stored brick was made from, kept for updates.
#[derive(Debug)]
struct Samples {
    /// Signed distances of the nodes.
    distances: Vec<Brick>,
    /// Nodes inside, one bit each.
    inside: Vec<u64>,
}

/// The field.
#[derive(Clone, Debug)]
pub(super) struct Field {
    levels: Vec<Level>,
    lo: Vec3,
    hi: Vec3,
}

/// The field of the mesh as created and what updates need of it.
#[derive(Debug)]
pub(super) struct Origin {
    pub(super) field: std::sync::Arc<Field>,
    samples: Vec<Samples>,
}

/// A mesh at given positions.
#[derive(Clone, Copy)]
pub(super) struct Source<'a> {
    pub(super) positions: &'a [Vec3],
    pub(super) triangles: &'a [[u32; 3]],
    pub(super) tree: &'a Bvh,
}

/// Boxes swept by what moved since the origin: before and after, one per triangle.
type Boxes = [(Vec3, Vec3)];

impl Level {
    #[inline]
    fn slot(&self, brick: [i64; 3]) -> u32 {
        let x = brick[0].wrapping_sub(self.lo[0]) as u64;
        let y = brick[1].wrapping_sub(self.lo[1]) as u64;
        let z = brick[2].wrapping_sub(self.lo[2]) as u64;
        if x >= self.n[0] as u64 || y >= self.n[1] as u64 || z >= self.n[2] as u64 {
            return NONE;
        }
        self.slots[(x as usize * self.n[1] + y as usize) * self.n[2] + z as usize]
    }

    fn index(&self, brick: [i64; 3]) -> usize {
        let [x, y, z] = [0, 1, 2].map(|d| (brick[d] - self.lo[d]) as usize);
        (x * self.n[1] + y) * self.n[2] + z
    }

    fn node(&self, brick: [i64; 3], n: usize) -> ([i64; 3], Vec3) {
        let node = [
            4 * brick[0] + (n >> 4) as i64,
            4 * brick[1] + ((n >> 2) & 3) as i64,
            4 * brick[2] + (n & 3) as i64,
        ];
        (node, Vec3::from_fn(|d, _| (node[d] as f64 + 0.5) * self.h))
    }

    fn center(&self, brick: [i64; 3]) -> Vec3 {
        Vec3::from_fn(|d, _| (brick[d] as f64 + 0.5) * 4.0 * self.h)
    }

    /// The 27 stored coefficients around a cell and how many of them are missing.
    #[inline]
    fn gather(&self, cell: [i64; 3], c: &mut [f64; 27], missing: &mut u32) -> usize {
        *missing = 0;
        let lo = cell.map(|i| (i - 1) >> 2);
        let hi = cell.map(|i| (i + 1) >> 2);
        if lo == hi {
            let slot = self.slot(lo);
            if slot == NONE {
                *missing = (1 << 27) - 1;
                return 27;
            }
            let brick = &self.coefficients[slot as usize];
            let base = cell.map(|i| ((i - 1) & 3) as usize);
            for i in 0..3 {
                for j in 0..3 {
                    let row = (base[0] + i) * 16 + (base[1] + j) * 4 + base[2];
                    for k in 0..3 {
                        c[(3 * i + j) * 3 + k] = f64::from(brick[row + k]);
                    }
                }
            }
            return 0;
        }
        let mut slots = [NONE; 8];
        for (s, slot) in slots.iter_mut().enumerate() {
            let pick = |d: usize| if s >> (2 - d) & 1 == 0 { lo[d] } else { hi[d] };
            // an axis that stays within one brick repeats the first half
            if (0..3).any(|d| lo[d] == hi[d] && s >> (2 - d) & 1 == 1) {
                continue;
            }
            *slot = self.slot([pick(0), pick(1), pick(2)]);
        }
        let mut count = 0;
        let side = |d: usize, i: usize| {
            let node = cell[d] + i as i64 - 1;
            (usize::from(node >> 2 != lo[d]), (node & 3) as usize)
        };
        let axes: [[(usize, usize); 3]; 3] =
            std::array::from_fn(|d| std::array::from_fn(|i| side(d, i)));
        for i in 0..3 {
            for j in 0..3 {
                for k in 0..3 {
                    let (x, y, z) = (axes[0][i], axes[1][j], axes[2][k]);
                    let slot = slots[x.0 * 4 + y.0 * 2 + z.0];
                    let at = (3 * i + j) * 3 + k;
                    if slot == NONE {
                        *missing |= 1 << at;
                        count += 1;
                    } else {
                        let brick = &self.coefficients[slot as usize];
                        c[at] = f64::from(brick[x.1 * 16 + y.1 * 4 + z.1]);
                    }
                }
            }
        }
        count
    }
}

impl Field {
    /// Coefficient of a node, from the first level that stores it.
    fn coefficient(&self, level: usize, node: [i64; 3]) -> f64 {
        let here = &self.levels[level];
        let slot = here.slot(node.map(|i| i >> 2));
        if slot != NONE {
            let [x, y, z] = node.map(|i| (i & 3) as usize);
            return f64::from(here.coefficients[slot as usize][x * 16 + y * 4 + z]);
        }
        if level + 1 == self.levels.len() {
            // not reached from within the box
            return 0.0;
        }
        let cell = node.map(|i| i >> 2);
        let w = node.map(|i| spline::refined_weights((i & 3) as usize));
        let mut c = [0.0; 27];
        self.fill(level + 1, cell, &mut c);
        let mut sum = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                let r = &c[(3 * i + j) * 3..(3 * i + j) * 3 + 3];
                sum += w[0][i] * w[1][j] * (r[0] * w[2][0] + r[1] * w[2][1] + r[2] * w[2][2]);
            }
        }
        sum
    }

    /// The 27 coefficients around a cell; true if the level stores none of them.
    fn fill(&self, level: usize, cell: [i64; 3], c: &mut [f64; 27]) -> bool {
        let mut missing = 0;
        let count = self.levels[level].gather(cell, c, &mut missing);
        if count == 27 && level + 1 < self.levels.len() {
            return true;
        }
        while missing != 0 {
            let at = missing.trailing_zeros() as usize;
            missing &= missing - 1;
            let node = [
                cell[0] + (at / 9) as i64 - 1,
                cell[1] + (at / 3 % 3) as i64 - 1,
                cell[2] + (at % 3) as i64 - 1,
            ];
            c[at] = self.coefficient(level, node);
        }
        false
    }

    /// Coefficients, place in the knot interval and one over the spacing at a point of the box.
    #[inline]
    fn locate(&self, q: &Vec3) -> ([f64; 27], [f64; 3], f64) {
        let mut c = [0.0; 27];
        for level in 0..self.levels.len() {
            let inv = 1.0 / self.levels[level].h;
            let u = [q.x * inv, q.y * inv, q.z * inv];
            let cell = u.map(|x| x.floor() as i64);
            if self.fill(level, cell, &mut c) {
                continue;
            }
            let t = [0, 1, 2].map(|d| u[d] - cell[d] as f64 - 0.5);
            return (c, t, inv);
        }
        (c, [0.0; 3], 1.0)
    }

    pub(super) fn distance(&self, p: &Vec3) -> Distance {
        let q = p.sup(&self.lo).inf(&self.hi);
        let (c, t, inv) = self.locate(&q);
        let at = spline::evaluate(&c, &t, inv);
        if q == *p {
            at
        } else {
            spline::beyond_box(&at, &(p - q))
        }
    }

    pub(super) fn value(&self, p: &Vec3) -> f64 {
        let q = p.sup(&self.lo).inf(&self.hi);
        let (c, t, _) = self.locate(&q);
        let at = spline::value(&c, &t);
        if q == *p {
            at
        } else {
            at.signum() * (at * at + (p - q).norm_squared()).sqrt()
        }
    }

    /// Spacing of the finest level [m].
    pub(super) fn cell_size(&self) -> f64 {
        self.levels[0].h
    }

    /// Memory held [bytes].
    pub(super) fn bytes(&self) -> usize {
        self.levels
            .iter()
            .map(|l| l.slots.len() * 4 + l.bricks.len() * (24 + 256))
            .sum()
    }

    /// Bricks stored per level, finest first.
    pub(super) fn bricks(&self) -> Vec<usize> {
        self.levels.iter().map(|l| l.bricks.len()).collect()
    }
}

/// Levels' spacings and boxes for a mesh within `bounds`, after checking what they cost.
fn plan(bounds: (Vec3, Vec3), h: f64, triangles: usize) -> Result<(Vec<Level>, Vec3, Vec3)> {
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
            .map(|a| 4.0 * Rows::count(&bounds.0, &bounds.1, s, a))
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

fn check_bytes(bytes: f64, what: &str, h: f64, size: &Vec3, triangles: usize) -> Result<()> {
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
fn mark(level: &Level, boxes: impl Iterator<Item = (Vec3, Vec3)>, reach: f64) -> Vec<bool> {
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

/// One brick on its way.
#[derive(Clone, Default)]
struct Draft {
    brick: [i64; 3],
    /// Distance of the centre to the surface; not a number where it is to be found.
    center: f64,
    /// Slot in the origin whose numbers hold, or `NONE`.
    kept: u32,
    stored: bool,
    inside: u64,
    distances: Vec<f32>,
}

/// Builds a field; with `before`, takes over what the moved boxes do not reach.
fn assemble(
    source: Source<'_>,
    h: f64,
    workers: &Workers,
    before: Option<(&Origin, &Boxes)>,
) -> Result<(Field, Vec<Samples>)> {
    let bounds = source.tree.bounds();
    let (mut levels, lo, hi) = plan(bounds, h, source.triangles.len())?;
    let mut all = Vec::new();
    let mut taken = 0.0;
    let top = levels.len() - 1;
    for l in 0..levels.len() {
        let s = levels[l].h;
        let band = if l == top {
            f64::INFINITY
        } else if l == 0 {
            BAND * s
        } else {
            COARSE_BAND * s
        };
        // bricks that may be stored, and those whose numbers may have changed
        let near = if l == top {
            vec![true; levels[l].slots.len()]
        } else {
            let boxes = source.triangles.iter().map(|t| box_of(source.positions, t));
            mark(&levels[l], boxes, band)
        };
        let old = before.and_then(|(origin, moved)| {
            let level = origin.field.levels.get(l)?;
            (l < top && l + 1 < origin.field.levels.len()).then_some((
                level,
                &origin.samples[l],
                moved,
            ))
        });
        let changed = old.map(|(_, _, moved)| {
            mark(&levels[l], moved.iter().copied(), (BAND + 2.0 * RADIUS) * s)
        });
        let count = near.iter().filter(|&&m| m).count() as f64;
        taken += count * (3.0 * 256.0 + 160.0);
        check_bytes(
            taken,
            "its bricks",
            h,
            &(bounds.1 - bounds.0),
            source.triangles.len(),
        )?;
        let mut drafts = Vec::with_capacity(count as usize);
        for (i, _) in near.iter().enumerate().filter(|n| *n.1) {
            let n = levels[l].n;
            let brick = [i / (n[1] * n[2]), i / n[2] % n[1], i % n[2]];
            let brick = [0, 1, 2].map(|d| brick[d] as i64 + levels[l].lo[d]);
            let mut draft = Draft {
                brick,
                center: f64::NAN,
                kept: NONE,
                ..Draft::default()
            };
            if let (Some((level, _, _)), Some(changed)) = (&old, &changed)
                && !changed[i]
            {
                draft.kept = level.slot(brick);
                if draft.kept == NONE {
                    continue;
                }
            }
            drafts.push(draft);
        }
        let level = &levels[l];
        let rows: [Rows; 3] = std::array::from_fn(|axis| {
            Rows::new(source.positions, source.triangles, bounds, s, axis)
        });
        workers.chunks(&mut drafts, 32, |_, part| {
            let mut hint = 0;
            let mut scratch = Vec::new();
            for draft in part {
                let kept = old.as_ref().filter(|_| draft.kept != NONE);
                if kept.is_none() {
                    let c = level.center(draft.brick);
                    draft.center = source.tree.distance(&c, &mut hint);
                    draft.stored = draft.center <= band;
                } else {
                    draft.stored = true;
                }
                if !draft.stored {
                    continue;
                }
                draft.inside = inside(level, &rows, source, draft.brick);
                if let Some((_, samples, _)) = kept {
                    if samples.inside[draft.kept as usize] == draft.inside {
                        continue;
                    }
                    // a part of the mesh that swept over the brick turned its sign
                    draft.kept = NONE;
                    let c = level.center(draft.brick);
                    draft.center = source.tree.distance(&c, &mut hint);
                }
                sample(level, source.tree, draft, hint, l == 0, &mut scratch);
            }
        });
        drafts.retain(|d| d.stored);
        let samples = finish(&mut levels[l], drafts, old.map(|o| (o.0, o.1)), workers);
        all.push(samples);
    }
    Ok((Field { levels, lo, hi }, all))
}

fn box_of(positions: &[Vec3], t: &[u32; 3]) -> (Vec3, Vec3) {
    let [a, b, c] = t.map(|v| positions[v as usize]);
    (a.inf(&b).inf(&c), a.sup(&b).sup(&c))
}

/// Which nodes of a brick are inside.
fn inside(level: &Level, rows: &[Rows; 3], source: Source<'_>, brick: [i64; 3]) -> u64 {
    let mut bits = 0;
    for n in 0..64 {
        let (node, at) = level.node(brick, n);
        let vote = sign::vote(rows, node, level.h)
            .unwrap_or_else(|| sign::winding_number(source.positions, source.triangles, &at) > 0.5);
        bits |= u64::from(vote) << n;
    }
    bits
}

/// Signed distances of a brick's nodes, exact. Neighbouring nodes follow each other, and each begins
/// with the triangle that was nearest to the one before. A `fine` brick first lists the triangles
/// that can be nearest to any of its nodes; a coarse one has too many of them.
fn sample<'a>(
    level: &Level,
    tree: &'a Bvh,
    draft: &mut Draft,
    hint: usize,
    fine: bool,
    scratch: &mut Vec<Near<'a>>,
) {
    let center = level.center(draft.brick);
    let radius = RADIUS * level.h;
    // the nearest triangle of any node is within center distance + 2 radii of the centre
    let few = fine && tree.within(&center, draft.center + 2.0 * radius, MANY, scratch);
    let mut hint = if few { 0 } else { hint };
    draft.distances = vec![0.0; 64];
    for step in 0..64 {
        // boustrophedon: y and z run back and forth
        let x = step >> 4;
        let y = (step >> 2 & 3) ^ (3 * (x & 1));
        let z = (step & 3) ^ (3 * (step >> 2 & 1));
        let n = 16 * x + 4 * y + z;
        let (_, p) = level.node(draft.brick, n);
        let d = if few {
            let slack = tree.slack(&p);
            let off = (p - center).norm() + slack;
            let mut best = scratch[hint].tri.distance2(&p);
            let mut reach = best.sqrt() + slack;
            for (i, near) in scratch.iter().enumerate() {
                if near.far - off > reach {
                    break;
                }
                if near.beyond(&p, reach) {
                    continue;
                }
                let d2 = near.tri.distance2(&p);
                if d2 < best {
                    best = d2;
                    reach = d2.sqrt() + slack;
                    hint = i;
                }
            }
            best.sqrt()
        } else {
            tree.distance(&p, &mut hint)
        };
        let signed = if draft.inside >> n & 1 == 1 { -d } else { d };
        draft.distances[n] = signed as f32;
    }
}

/// Numbers the bricks, gathers samples, computes coefficients.
fn finish(
    level: &mut Level,
    drafts: Vec<Draft>,
    old: Option<(&Level, &Samples)>,
    workers: &Workers,
) -> Samples {
    let mut samples = Samples {
        distances: Vec::with_capacity(drafts.len()),
        inside: Vec::with_capacity(drafts.len()),
    };
    let mut kept = Vec::with_capacity(drafts.len());
    for (slot, draft) in drafts.into_iter().enumerate() {
        let index = level.index(draft.brick);
        level.slots[index] = slot as u32;
        level.bricks.push(draft.brick);
        samples.inside.push(draft.inside);
        let mut brick = [0.0; 64];
        match old.filter(|_| draft.kept != NONE) {
            Some((_, samples)) => brick = samples.distances[draft.kept as usize],
            None => brick.copy_from_slice(&draft.distances),
        }
        samples.distances.push(brick);
        kept.push(draft.kept);
    }
    let mut coefficients = vec![[0.0f32; 64]; level.bricks.len()];
    {
        let (level, samples, kept) = (&*level, &samples, &kept);
        workers.chunks(&mut coefficients, 256, |chunk, part| {
            for (i, out) in part.iter_mut().enumerate() {
                let slot = chunk * 256 + i;
                let brick = level.bricks[slot];
                let around: [u32; 6] = std::array::from_fn(|f| {
                    let mut b = brick;
                    b[f / 2] += if f % 2 == 0 { -1 } else { 1 };
                    level.slot(b)
                });
                // a kept brick among kept neighbours keeps its coefficients
                if let Some((before, _)) = old.filter(|_| kept[slot] != NONE) {
                    let same = (0..6).all(|f| {
                        let mut b = brick;
                        b[f / 2] += if f % 2 == 0 { -1 } else { 1 };
                        let then = before.slot(b);
                        match around[f] {
                            NONE => then == NONE,
                            now => kept[now as usize] != NONE && kept[now as usize] == then,
                        }
                    });
                    if same {
                        *out = before.coefficients[kept[slot] as usize];
                        continue;
                    }
                }
                correct(slot, &around, &samples.distances, out);
            }
        });
    }
    level.coefficients = coefficients;
    samples
}

/// Coefficients `f - 1/8 sum_d delta_d^2 f`; where a neighbour is not stored the second difference
/// of the next node inside the brick serves.
fn correct(slot: usize, around: &[u32; 6], f: &[Brick], out: &mut Brick) {
    let own = &f[slot];
    for n in 0..64usize {
        let mut sum = 0.0;
        for d in 0..3 {
            let stride = 1usize << (4 - 2 * d);
            let i = (n / stride) & 3;
            let base = n - i * stride;
            let at = |m: usize| f64::from(own[base + m * stride]);
            sum += match (i, around[2 * d], around[2 * d + 1]) {
                (0, NONE, _) => at(0) - 2.0 * at(1) + at(2),
                (0, left, _) => {
                    f64::from(f[left as usize][base + 3 * stride]) - 2.0 * at(0) + at(1)
                }
                (3, _, NONE) => at(1) - 2.0 * at(2) + at(3),
                (3, _, right) => at(2) - 2.0 * at(3) + f64::from(f[right as usize][base]),
                _ => at(i - 1) - 2.0 * at(i) + at(i + 1),
            };
        }
        out[n] = (f64::from(own[n]) - 0.125 * sum) as f32;
    }
}

impl Origin {
    /// Field of a mesh as created, with finest spacing `h` [m].
    pub(super) fn new(source: Source<'_>, h: f64, workers: &Workers) -> Result<Self> {
        let (field, samples) = assemble(source, h, workers, None)?;
        Ok(Self {
            field: std::sync::Arc::new(field),
            samples,
        })
    }

    /// Field of the mesh at other positions: the bits that `new` would give there.
    pub(super) fn updated(
        &self,
        origin: &[Vec3],
        source: Source<'_>,
        workers: &Workers,
    ) -> Result<Field> {
        let moved: Vec<(Vec3, Vec3)> = source
            .triangles
            .iter()
            .filter(|t| {
                t.iter()
                    .any(|&v| origin[v as usize] != source.positions[v as usize])
            })
            .flat_map(|t| [box_of(origin, t), box_of(source.positions, t)])
            .collect();
        let h = self.field.cell_size();
        Ok(assemble(source, h, workers, Some((self, &moved)))?.0)
    }
}
