//! Yarns as people see them: smooth curves beside each other at contacts, and tubes around them.
//!
//! At a contact the strands of a stack lie `2R` apart along the node's normal, from the back to the
//! front of the cloth: strand `k` of `n` at `(2k - n - 1) R` (Cirio et al. 2017, section 6). Through these
//! places runs a centripetal Catmull-Rom spline (Catmull and Rom 1974; Yuksel et al. 2011), which
//! neither loops nor overshoots. A tube's cross-section is carried along its curve without twist
//! (double reflection; Wang et al. 2008).

use super::{Part, palette};
use crate::math::Vec3;
use crate::yarn::YarnMesh;

/// A yarn's smooth centre line.
#[derive(Clone, Debug, PartialEq)]
pub struct Curve {
    /// Points along it [m].
    pub points: Vec<Vec3>,
    /// Radius [m].
    pub radius: f64,
    /// Panel where it begins.
    pub panel: u32,
}

/// Triangles that all tubes of a picture or model file together may have.
const MOST_TRIANGLES: usize = 3_000_000;

/// Centre lines of all yarns, `samples` pieces to a segment. `nodes` are positions [m], `normals` unit
/// vectors from the back to the front of the cloth (zero: no offset), `radius` by yarn [m].
pub fn curves(
    mesh: &YarnMesh,
    nodes: &[Vec3],
    normals: &[Vec3],
    radius: impl Fn(usize) -> f64,
    samples: usize,
) -> Vec<Curve> {
    let mut offset = vec![0.0; mesh.incidences.len()];
    for node in 0..mesh.uv.len() {
        let stack = mesh.stack(node);
        for (k, strand) in stack.iter().enumerate() {
            offset[strand.incidence as usize] = (2 * k) as f64 - (stack.len() as f64 - 1.0);
        }
    }
    (0..mesh.yarn_count())
        .map(|y| {
            let radius = radius(y);
            let first = mesh.starts[y] as usize;
            let places: Vec<Vec3> = (mesh.yarn(y).iter().zip(&offset[first..]))
                .map(|(i, o)| nodes[i.node as usize] + normals[i.node as usize] * (o * radius))
                .collect();
            Curve {
                points: spline(&places, samples),
                radius,
                panel: mesh.node_panel[mesh.yarn(y)[0].node as usize],
            }
        })
        .collect()
}

/// A spline through points, `samples` pieces between two of them.
fn spline(places: &[Vec3], samples: usize) -> Vec<Vec3> {
    let n = places.len();
    let mut out = Vec::with_capacity(n * samples);
    for k in 0..n.saturating_sub(1) {
        let (p1, p2) = (places[k], places[k + 1]);
        let p0 = if k > 0 { places[k - 1] } else { 2.0 * p1 - p2 };
        let p3 = if k + 2 < n {
            places[k + 2]
        } else {
            2.0 * p2 - p1
        };
        for s in 0..samples {
            out.push(catmull_rom([p0, p1, p2, p3], s as f64 / samples as f64));
        }
    }
    out.extend(places.last());
    out
}

/// The piece between the middle two of four points, knots at the root of the distances.
fn catmull_rom(p: [Vec3; 4], s: f64) -> Vec3 {
    let mut t = [0.0; 4];
    for k in 1..4 {
        t[k] = t[k - 1] + (p[k] - p[k - 1]).norm().sqrt().max(1e-12);
    }
    let at = t[1] + s * (t[2] - t[1]);
    let mix = |a: Vec3, b: Vec3, from: f64, to: f64| {
        a * ((to - at) / (to - from)) + b * ((at - from) / (to - from))
    };
    let a = [0, 1, 2].map(|k| mix(p[k], p[k + 1], t[k], t[k + 1]));
    let b = [0, 1].map(|k| mix(a[k], a[k + 1], t[k], t[k + 2]));
    mix(b[0], b[1], t[1], t[2])
}

/// Pieces of a segment and sides of a tube, so that all tubes of a mesh stay below the limit.
pub fn detail(mesh: &YarnMesh) -> (usize, usize) {
    let segments = mesh.incidences.len().max(1);
    [(5, 8), (4, 6), (2, 5), (1, 4)]
        .into_iter()
        .find(|(samples, sides)| segments * samples * sides * 2 <= MOST_TRIANGLES)
        .unwrap_or((1, 3))
}

/// Tubes around curves, each of `sides` sides, as a part of a picture or a model file.
pub fn tubes(name: &str, curves: &[Curve], sides: usize) -> Part {
    let mut part = Part {
        name: name.into(),
        cloth: true,
        ..Part::default()
    };
    for curve in curves.iter().filter(|c| c.points.len() > 1) {
        let first = part.positions.len() as u32;
        let n = curve.points.len();
        let tangent = |k: usize| {
            let (a, b) = (k.saturating_sub(1), (k + 1).min(n - 1));
            (curve.points[b] - curve.points[a])
                .try_normalize(0.0)
                .unwrap_or_else(Vec3::x)
        };
        let mut along = tangent(0);
        let mut side = across(&along);
        for k in 0..n {
            if k > 0 {
                let next = tangent(k);
                side = carry(&side, &along, &next, &curve.points[k - 1], &curve.points[k]);
                along = next;
            }
            let other = along.cross(&side);
            for j in 0..sides {
                let angle = std::f64::consts::TAU * j as f64 / sides as f64;
                let spoke = side * angle.cos() + other * angle.sin();
                part.positions.push(curve.points[k] + spoke * curve.radius);
            }
        }
        let at = |k: usize, j: usize| first + (k * sides + j % sides) as u32;
        for k in 0..n - 1 {
            for j in 0..sides {
                let (a, b, c, d) = (at(k, j), at(k, j + 1), at(k + 1, j), at(k + 1, j + 1));
                part.triangles.push([a, b, c]);
                part.triangles.push([b, d, c]);
            }
        }
        let colour = palette::panel(curve.panel);
        part.colours.resize(part.positions.len(), colour);
    }
    part
}

/// A unit vector at right angles to another.
fn across(v: &Vec3) -> Vec3 {
    let axis = if v.x.abs() < 0.6 {
        Vec3::x()
    } else {
        Vec3::y()
    };
    (axis - v * v.dot(&axis)).normalize()
}

/// Carries `side` from one cross-section to the next without twist.
fn carry(side: &Vec3, along: &Vec3, next: &Vec3, from: &Vec3, to: &Vec3) -> Vec3 {
    let mirror = |v: Vec3, n: &Vec3| {
        let square = n.norm_squared();
        if square > 0.0 {
            v - n * (2.0 * n.dot(&v) / square)
        } else {
            v
        }
    };
    let step = to - from;
    let half = mirror(*side, &step);
    let turned = mirror(*along, &step);
    let carried = mirror(half, &(next - turned));
    (carried - next * next.dot(&carried))
        .try_normalize(1e-12)
        .unwrap_or_else(|| across(next))
}
