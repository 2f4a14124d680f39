//! Geometry of triangle meshes with derivatives: hinges, fans, the dihedral angle, the jump of a
//! piecewise linear function.
//!
//! A hinge is `[v0, v1, v2, v3]`: edge `v0 v1`, `v2` opposite in triangle `(v0, v1, v2)`, `v3`
//! opposite in `(v1, v0, v3)`. Its angle is 0 when flat and positive when the opposite vertices
//! lie on the side that the normals point to (a valley seen from the outside). It comes from
//! `atan2`, so that its derivative exists at every angle; it jumps from pi to -pi where the two
//! triangles fold through each other.

use super::{Mat3, Vec2, Vec3};
use nalgebra::Matrix3;

/// Cross product in the plane.
pub fn cross2(a: &Vec2, b: &Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// The matrix of `y -> a x y`.
pub fn skew(a: &Vec3) -> Mat3 {
    Matrix3::new(0.0, -a.z, a.y, a.z, 0.0, -a.x, -a.y, a.x, 0.0)
}

/// The angle brought into `[-pi, pi]`.
pub fn wrap_angle(angle: f64) -> f64 {
    use std::f64::consts::{PI, TAU};
    if angle.abs() <= PI {
        angle
    } else {
        angle - TAU * (angle / TAU).round()
    }
}

/// One side of an edge: the edge's vertices as the triangle runs through them.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct EdgeSide {
    /// Smaller vertex of the edge.
    pub low: u32,
    /// Larger vertex of the edge.
    pub high: u32,
    /// Triangle.
    pub triangle: u32,
    /// Vertex of the triangle that is not on the edge.
    pub opposite: u32,
    /// Whether the triangle runs from `high` to `low`.
    pub reversed: bool,
}

/// All sides of all edges, sorted by edge and then by triangle.
pub fn edge_sides(triangles: &[[u32; 3]]) -> Vec<EdgeSide> {
    let mut sides = Vec::with_capacity(3 * triangles.len());
    for (t, tri) in triangles.iter().enumerate() {
        for k in 0..3 {
            let (a, b, opposite) = (tri[k], tri[(k + 1) % 3], tri[(k + 2) % 3]);
            sides.push(EdgeSide {
                low: a.min(b),
                high: a.max(b),
                triangle: t as u32,
                opposite,
                reversed: a > b,
            });
        }
    }
    sides.sort_unstable();
    sides
}

/// Sides of one edge in what [`edge_sides`] returned.
pub fn sides_of(sides: &[EdgeSide], a: u32, b: u32) -> &[EdgeSide] {
    let key = (a.min(b), a.max(b));
    let from = sides.partition_point(|s| (s.low, s.high) < key);
    let to = sides.partition_point(|s| (s.low, s.high) <= key);
    &sides[from..to]
}

/// Hinges of all edges between exactly two triangles of agreeing orientation, sorted by edge
/// (smaller vertex first).
pub fn hinges(triangles: &[[u32; 3]]) -> Vec<[u32; 4]> {
    edge_sides(triangles)
        .chunk_by(|a, b| (a.low, a.high) == (b.low, b.high))
        .filter_map(|s| match s {
            [a, b] if a.reversed != b.reversed => {
                let (left, right) = if a.reversed { (b, a) } else { (a, b) };
                Some([left.low, left.high, left.opposite, right.opposite])
            }
            _ => None,
        })
        .collect()
}

/// Triangles around a vertex that follow each other across shared edges.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fan {
    /// The vertex.
    pub center: u32,
    /// Neighbours in the order in which the triangles `(center, ring[k], ring[k + 1])` run.
    pub ring: Vec<u32>,
    /// Whether the last neighbour is followed by the first.
    pub closed: bool,
}

/// Fans of every vertex, by vertex. A vertex where two pieces of cloth touch has several.
pub fn fans(triangles: &[[u32; 3]]) -> Vec<Fan> {
    let mut spokes: Vec<[u32; 3]> = triangles
        .iter()
        .flat_map(|&[a, b, c]| [[a, b, c], [b, c, a], [c, a, b]])
        .collect();
    spokes.sort_unstable();
    let mut fans = Vec::new();
    for around in spokes.chunk_by(|a, b| a[0] == b[0]) {
        let mut used = vec![false; around.len()];
        let next = |from: u32, used: &[bool]| {
            (0..around.len()).find(|&k| !used[k] && around[k][1] == from)
        };
        // open chains start at a neighbour that no triangle ends at; what is left is closed
        let starts = (0..around.len()).filter(|&k| around.iter().all(|s| s[2] != around[k][1]));
        for start in starts.chain(0..around.len()) {
            if used[start] {
                continue;
            }
            let mut ring = vec![around[start][1]];
            let mut closed = false;
            let mut at = Some(start);
            while let Some(k) = at {
                used[k] = true;
                let to = around[k][2];
                closed = to == ring[0];
                if closed || ring.contains(&to) {
                    break;
                }
                ring.push(to);
                at = next(to, &used);
            }
            fans.push(Fan {
                center: around[start][0],
                ring,
                closed,
            });
        }
    }
    fans
}

/// Sizes below which a hinge counts as degenerate: its derivatives are then those of a triangle
/// of this size, and stay finite.
#[derive(Clone, Copy, Debug)]
pub struct HingeFloor {
    /// Edge length [m].
    pub length: f64,
    /// Twice the triangle's area [m^2].
    pub area: f64,
}

struct HingeFrame {
    e: Vec3,
    u: [Vec3; 2],
    /// Normals, both to the outside, of length twice the area.
    n: [Vec3; 2],
    /// Squared length of the edge and of the normals, not below the floor.
    ee: f64,
    nn: [f64; 2],
    length: f64,
    /// Foot of the opposite vertices on the edge, 0 at `v0`, 1 at `v1`.
    s: [f64; 2],
    /// Derivative of the angle by the opposite vertices.
    g: [Vec3; 2],
}

#[inline]
fn hinge_frame(x: &[Vec3; 4], floor: HingeFloor) -> HingeFrame {
    let (e, u) = (x[1] - x[0], [x[2] - x[0], x[3] - x[0]]);
    let n = [e.cross(&u[0]), u[1].cross(&e)];
    let ee = e.norm_squared().max(floor.length * floor.length);
    let nn = n.map(|n| n.norm_squared().max(floor.area * floor.area));
    let length = ee.sqrt();
    HingeFrame {
        e,
        u,
        n,
        ee,
        nn,
        length,
        s: u.map(|u| u.dot(&e) / ee),
        g: [n[0] * (length / nn[0]), n[1] * (length / nn[1])],
    }
}

/// Signed angle of a hinge [rad].
#[inline]
pub fn dihedral(x: &[Vec3; 4]) -> f64 {
    let (e, u2, u3) = (x[1] - x[0], x[2] - x[0], x[3] - x[0]);
    let (n1, n2) = (e.cross(&u2), u3.cross(&e));
    let length = e.norm();
    if length == 0.0 {
        return 0.0;
    }
    (n2.cross(&n1).dot(&e) / length).atan2(n1.dot(&n2))
}

/// Derivative of [`dihedral`] by the four points [1/m].
#[inline]
pub fn dihedral_gradient(x: &[Vec3; 4], floor: HingeFloor) -> [Vec3; 4] {
    let f = hinge_frame(x, floor);
    [
        f.g[0] * (f.s[0] - 1.0) + f.g[1] * (f.s[1] - 1.0),
        -(f.g[0] * f.s[0] + f.g[1] * f.s[1]),
        f.g[0],
        f.g[1],
    ]
}

/// Second derivative of [`dihedral`], all 16 blocks [1/m^2].
///
/// With `g_k = |e| n_k / |n_k|^2` the derivative by the edge vector is `-(s_2 g_2 + s_3 g_3)`; the
/// blocks are the derivatives of these closed forms (the result agrees with Tamstorf and Grinspun
/// 2013, section 5). Made symmetric, which changes it only inside the floor.
pub fn dihedral_hessian(x: &[Vec3; 4], floor: HingeFloor) -> [[Mat3; 4]; 4] {
    let f = hinge_frame(x, floor);
    // derivatives of the normals by the edge vector and by the opposite vertex
    let dn_de = [-skew(&f.u[0]), skew(&f.u[1])];
    let dn_du = [skew(&f.e), -skew(&f.e)];
    let mut ee = Mat3::zeros();
    let mut ge = [Mat3::zeros(); 2];
    let mut gu = [Mat3::zeros(); 2];
    for k in 0..2 {
        let scale = f.length / f.nn[k];
        let reflect = Mat3::identity() - f.n[k] * f.n[k].transpose() * (2.0 / f.nn[k]);
        ge[k] = f.n[k] * f.e.transpose() / (f.length * f.nn[k]) + reflect * dn_de[k] * scale;
        gu[k] = reflect * dn_du[k] * scale;
        let ds_de = f.u[k] / f.ee - f.e * (2.0 * f.s[k] / f.ee);
        ee -= f.g[k] * ds_de.transpose() + ge[k] * f.s[k];
    }
    let mut h = [[Mat3::zeros(); 4]; 4];
    let symmetric = |m: Mat3| (m + m.transpose()) * 0.5;
    h[1][1] = symmetric(ee);
    for k in 0..2 {
        h[k + 2][k + 2] = symmetric(gu[k]);
        h[k + 2][1] = ge[k];
        h[1][k + 2] = ge[k].transpose();
    }
    // translation invariance gives the first row and column
    for j in 1..4 {
        h[0][j] = -(h[1][j] + h[2][j] + h[3][j]);
        h[j][0] = h[0][j].transpose();
    }
    h[0][0] = symmetric(-(h[1][0] + h[2][0] + h[3][0]));
    h
}

/// Weights `w` such that `sum w_i z_i` is the jump of slope across a flat hinge of the piecewise
/// linear function with values `z_i` [1/m]: the hinge's angle to first order. The triangles may
/// run either way round.
pub fn jump(p: &[Vec2; 4]) -> [f64; 4] {
    let e = p[1] - p[0];
    let l = e.norm();
    let mut w = [0.0; 4];
    for k in [2, 3] {
        let u = p[k] - p[0];
        let d = cross2(&e, &u).abs();
        let along = u.dot(&e) / (d * l);
        w[k] = l / d;
        w[1] -= along;
        w[0] += along - l / d;
    }
    w
}

/// Rate of [`jump`] when the points move at rates `dp`.
pub fn jump_rate(p: &[Vec2; 4], dp: &[Vec2; 4]) -> [f64; 4] {
    let (e, de) = (p[1] - p[0], dp[1] - dp[0]);
    let l = e.norm();
    let dl = e.dot(&de) / l;
    let mut dw = [0.0; 4];
    for k in [2, 3] {
        let (u, du) = (p[k] - p[0], dp[k] - dp[0]);
        let signed = cross2(&e, &u);
        let d = signed.abs();
        let dd = signed.signum() * (cross2(&de, &u) + cross2(&e, &du));
        let along = u.dot(&e) / (d * l);
        let dalong = (du.dot(&e) + u.dot(&de)) / (d * l) - along * (dd / d + dl / l);
        let dheight = dl / d - l * dd / (d * d);
        dw[k] = dheight;
        dw[1] -= dalong;
        dw[0] += dalong - dheight;
    }
    dw
}

#[cfg(test)]
mod tests {
    use super::*;

    const NO_FLOOR: HingeFloor = HingeFloor {
        length: 0.0,
        area: 0.0,
    };

    fn bent(angle: f64) -> [Vec3; 4] {
        let (s, c) = (0.5 * angle).sin_cos();
        [
            Vec3::new(0.0, 0.0, 0.0),
            Vec3::new(2.0, 0.0, 0.0),
            Vec3::new(0.3, 1.5 * c, 1.5 * s),
            Vec3::new(1.1, -0.7 * c, 0.7 * s),
        ]
    }

    #[test]
    fn the_angle_is_signed_and_covers_the_full_turn() {
        for k in -31..=31 {
            let angle = 0.1 * f64::from(k);
            assert!((dihedral(&bent(angle)) - angle).abs() < 1e-14, "{angle}");
        }
    }

    #[test]
    fn angle_derivatives_agree_with_differences() {
        for k in -15..=15 {
            let x = bent(0.2 * f64::from(k) + 0.05);
            let g = dihedral_gradient(&x, NO_FLOOR);
            let h = dihedral_hessian(&x, NO_FLOOR);
            let step = 1e-5;
            for j in 0..4 {
                for c in 0..3 {
                    let moved = |s: f64| {
                        let mut y = x;
                        y[j][c] += s;
                        y
                    };
                    let (p, m) = (moved(step), moved(-step));
                    let d = wrap_angle(dihedral(&p) - dihedral(&m)) / (2.0 * step);
                    assert!((d - g[j][c]).abs() < 1e-8);
                    let (gp, gm) = (
                        dihedral_gradient(&p, NO_FLOOR),
                        dihedral_gradient(&m, NO_FLOOR),
                    );
                    for i in 0..4 {
                        let column = (gp[i] - gm[i]) / (2.0 * step);
                        let error = (column - h[i][j].column(c)).norm();
                        assert!(error < 1e-7, "block {i} {j}: {error}");
                    }
                }
            }
        }
    }

    #[test]
    fn a_degenerate_hinge_has_finite_derivatives() {
        let floor = HingeFloor {
            length: 1e-6,
            area: 1e-8,
        };
        let point = [Vec3::zeros(); 4];
        let line = [0.0, 1.0, 0.5, 2.0].map(|s| Vec3::new(s, 0.0, 0.0));
        for x in [point, line] {
            assert!(dihedral(&x).is_finite());
            let h = dihedral_hessian(&x, floor);
            assert!(h.iter().flatten().all(|b| b.iter().all(|v| v.is_finite())));
            assert!(
                dihedral_gradient(&x, floor)
                    .iter()
                    .all(|g| g.iter().all(|v| v.is_finite()))
            );
        }
    }

    #[test]
    fn fans_follow_the_triangles() {
        // a square cut by both diagonals, and a triangle that touches one corner only
        let t = [[0, 1, 4], [1, 2, 4], [2, 3, 4], [3, 0, 4], [0, 5, 6]];
        let all = fans(&t);
        let Some(center) = all.iter().find(|f| f.center == 4) else {
            panic!("vertex 4 has no fan");
        };
        assert!(center.closed && center.ring.len() == 4);
        let corner: Vec<_> = all.iter().filter(|f| f.center == 0).collect();
        assert_eq!(corner.len(), 2);
        assert!(corner.iter().all(|f| !f.closed));
        assert_eq!(corner.iter().map(|f| f.ring.len()).sum::<usize>(), 5);
        assert_eq!(hinges(&t).len(), 4);
    }

    #[test]
    fn the_jump_sees_bends_only_and_its_rate_is_exact() {
        let p = [
            Vec2::new(0.1, 0.2),
            Vec2::new(1.2, 0.5),
            Vec2::new(0.4, 1.3),
            Vec2::new(0.9, -0.8),
        ];
        let w = jump(&p);
        let apply = |f: &dyn Fn(&Vec2) -> f64| (0..4).map(|i| w[i] * f(&p[i])).sum::<f64>();
        assert!(apply(&|_| 1.0).abs() < 1e-14);
        assert!(apply(&|q| q.x).abs() < 1e-14);
        assert!(apply(&|q| q.y).abs() < 1e-14);
        let dp = [0.3, -0.2, 0.7, 0.1].map(|a| Vec2::new(a, 0.5 - a * a));
        let at = |s: f64| jump(&std::array::from_fn(|i| p[i] + dp[i] * s));
        let (a, b, rate) = (at(1e-5), at(-1e-5), jump_rate(&p, &dp));
        for i in 0..4 {
            assert!((rate[i] - (a[i] - b[i]) / 2e-5).abs() < 1e-8);
        }
    }
}
