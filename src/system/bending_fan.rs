//! The bending operator that both bending models share: moments on the fans around vertices.
//!
//! The Hessian of a piecewise linear surface is concentrated on its edges: slope jump `theta_e`
//! times `n_e n_e^T` along edge `e` of length `l_e`. Tested with the hat function of vertex `v` it
//! gives the bend `r_v = sum_{e at v} c_e theta_e`, `c_e = l_e/2 n_e n_e^T`, and with symmetric tensors
//! written as `(11, sqrt2 12, 22)` in the (weft, warp) frame the energy is
//!
//! ```text
//! V = sum_v 1/2 r_v . W_v r_v
//! inside:   W = M = S^-1/2 D S^-1/2,  S = sym sum_e c_e q_e^T,  D = diag(weft, (weft + warp)/2, warp)
//! border:   W = M - M nu nu^T M / (nu . M nu),              nu = n n^T of the border's normal
//! ```
//!
//! where `q_e` is the slope jump that a unit quadratic surface has at `e`, so that `S` is the area of the
//! vertex as each component of curvature sees it (eigenvalues below a quarter of the barycentric
//! area are raised to it). A cylinder that curves at an angle `phi` from
//! the weft costs `B(phi) k^2 / 2` per area with `B = bending_weft cos^2 + bending_warp sin^2`; Poisson
//! coupling is zero.
//!
//! This is a mixed plate method of lowest order with lumped mass (moments continuous and piecewise
//! linear; compare Ciarlet and Raviart 1974 for the Laplacian, and the averaged shape operator of
//! Grinspun et al. 2006). Two properties hold the stiffness of the mesh at that of the material:
//! a constant moment has no nodal forces in the interior, which with `sum S = area` bounds it from
//! below; and a quadratic surface has the right energy in the sum over vertices to first order in
//! the irregularity of `S`, which bounds it from above. At a free border the moment across the edge
//! vanishes, so that the bend across it is relaxed.
//!
//! Why not one spring per edge (discrete shells, `theta_e^2` alone): on a mesh of squares with one
//! diagonal the three angles of a triangle are `(a + b, b + c, b)` times the curvatures `a, b, c`;
//! no positive weights of their squares give the energy of cylinders along the axes and along both
//! diagonals, so that the stiffness depends on the mesh whatever its fineness. Summing before
//! squaring removes the cross terms.
//!
//! A border vertex has the area that its hinges give it, as those inside: with its part of the dual
//! mesh instead, strips cut out of squares at 45 degrees with alternating diagonals are too stiff by half
//! an edge over the width, 5.9 % for a strip of eight squares.
//!
//! Limits, measured on clamped strips: second order on lattices, at 45 degrees to the fold and with
//! alternating diagonals as well; on irregular meshes a stiffness error stays, 0.2 % for a grid jittered by
//! 15 % of an edge, 0.7 % for 30 %. Where warp and weft differ fourfold and the mesh has alternating
//! diagonals at 45 degrees to them, stiffness along them is off by a fifth.
//!
//! A fan with more neighbours than a stencil holds is cut into shorter ones with `W = D / A`, `A` the
//! circumcentric area.

use super::membrane::material_rotation;
use super::term::{MAX_ARITY, RestChange};
use crate::cloth::Cloth;
use crate::math::geometry::{HingeFloor, cross2, fans, jump, jump_rate};
use crate::math::{Mat2, Mat3, Vec2, Vec3};
use crate::pattern::{BendingModel, Fabric};
use std::collections::BTreeMap;

/// Largest number of hinges of a fan.
pub(super) const MAX_HINGES: usize = MAX_ARITY - 1;
/// Smallest area that a component sees, as a part of the barycentric area.
const SMALLEST_AREA: f64 = 0.25;

/// Rest data of one fan.
pub(super) struct FanRest {
    pub(super) kind: FanKind,
    pub(super) fabric: usize,
    pub(super) rotation: Mat2,
    /// Material coordinates of the stencil's vertices [m].
    pub(super) uv: Vec<Vec2>,
    pub(super) measure: Measure,
    /// Rigidity of the components `(weft, twist, warp)` of a moment [N m].
    pub(super) rigidity: Vec3,
    /// Curvature at rest, its components as those of the bend [1/m].
    curvature: Vec3,
    /// `W` [N/m]: energy by the bend squared.
    pub(super) stiffness: Mat3,
    pub(super) damping: f64,
    pub(super) floor: HingeFloor,
}

/// How the triangles lie around the vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum FanKind {
    /// All around.
    Closed,
    /// On one side of a free border.
    Border,
    /// A piece of a longer fan.
    Part,
}

/// What a fan's energy needs of its flat shape, or the rate of it.
pub(super) struct Measure {
    /// `c_e` of each hinge [m].
    pub(super) weights: Vec<Vec3>,
    /// Angle of each hinge by the components `(11, sqrt2 12, 22)` of a uniform curvature [m].
    angles: Vec<Vec3>,
    /// Coefficients `b_j` of the bend of a surface `z`: `r = sum_j b_j z_j`.
    pub(super) operator: Vec<Vec3>,
    /// One over the root of the area, for each component [1/m].
    root: Mat3,
    /// `nu` at a border.
    normal: Vec3,
}

/// Fans of equal arity, the first vertex of each stencil being the centre.
pub(super) struct FanGroup {
    pub(super) arity: usize,
    pub(super) vertices: Vec<u32>,
    pub(super) fans: Vec<FanRest>,
}

impl FanGroup {
    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.fans[..])
    }
}

/// Rigidity of the three components of a moment: `tr(r M r) = d . (r11^2, 2 r12^2, r22^2)`.
pub(super) fn rigidity(f: &Fabric) -> Vec3 {
    Vec3::new(
        f.bending_weft,
        0.5 * (f.bending_weft + f.bending_warp),
        f.bending_warp,
    )
}

/// Curvature at rest.
fn curvature(f: &Fabric) -> Vec3 {
    Vec3::new(f.curvature_weft, 0.0, f.curvature_warp)
}

/// Local vertices `[centre, neighbour, next, previous]` of hinge `k` of a fan with `ring`
/// neighbours: a hinge as in [`crate::math::geometry`].
#[inline]
fn local_hinge(k: usize, ring: usize, kind: FanKind) -> [usize; 4] {
    let at = if kind == FanKind::Closed { k } else { k + 1 };
    let next = if at + 1 == ring { 0 } else { at + 1 };
    let previous = if at == 0 { ring - 1 } else { at - 1 };
    [0, 1 + at, 1 + next, 1 + previous]
}

/// `W` of a fan: without the moment across a border.
fn stiffness(m: &Measure, d: &Vec3, kind: FanKind) -> Mat3 {
    let full = m.root * Mat3::from_diagonal(d) * m.root;
    let p = full * m.normal;
    let s = p.dot(&m.normal);
    if kind == FanKind::Border && s > 0.0 {
        full - p * p.transpose() / s
    } else {
        full
    }
}

/// Rate of `W` when the measure changes at the rate `dm` and the rigidity at the rate `dd`.
fn stiffness_rate(m: &Measure, dm: &Measure, d: &Vec3, dd: &Vec3, kind: FanKind) -> Mat3 {
    let full = m.root * Mat3::from_diagonal(d) * m.root;
    let half = dm.root * Mat3::from_diagonal(d) * m.root;
    let dfull = half + half.transpose() + m.root * Mat3::from_diagonal(dd) * m.root;
    let p = full * m.normal;
    let s = p.dot(&m.normal);
    if kind != FanKind::Border || s <= 0.0 {
        return dfull;
    }
    let dp = dfull * m.normal + full * dm.normal;
    let ds = dp.dot(&m.normal) + p.dot(&dm.normal);
    dfull + p * p.transpose() * (ds / (s * s)) - (dp * p.transpose() + p * dp.transpose()) / s
}

impl FanRest {
    #[inline]
    pub(super) fn hinge_count(&self) -> usize {
        self.measure.weights.len()
    }

    #[inline]
    pub(super) fn local_hinge(&self, k: usize) -> [usize; 4] {
        local_hinge(k, self.uv.len() - 1, self.kind)
    }

    /// Angle at rest of hinge `k` [rad].
    #[inline]
    pub(super) fn rest_angle(&self, k: usize) -> f64 {
        self.measure.angles[k].dot(&self.curvature)
    }

    /// Its rate at these rates of the measure and of the fabric.
    pub(super) fn rest_angle_rate(&self, k: usize, rates: &Measure, fabric: &Fabric) -> f64 {
        rates.angles[k].dot(&self.curvature) + self.measure.angles[k].dot(&curvature(fabric))
    }

    /// Rates of the measure and of `W` along a change of the vertices' flat positions (panel
    /// coordinates) and of the fabric.
    pub(super) fn rates(&self, vertices: &[u32], change: &RestChange<'_>) -> (Measure, Mat3) {
        let duv: Vec<Vec2> = vertices
            .iter()
            .map(|&v| self.rotation * change.uv[v as usize])
            .collect();
        let (_, rates) = measure_with_rate(&self.uv, &duv, self.kind);
        let dd = rigidity(&change.fabrics[self.fabric]);
        let w = stiffness_rate(&self.measure, &rates, &self.rigidity, &dd, self.kind);
        (rates, w)
    }
}

/// Triangles of a fan as pairs of local vertices beside the centre.
fn fan_triangles(ring: usize, kind: FanKind) -> impl Iterator<Item = (usize, usize)> {
    let count = if kind == FanKind::Closed {
        ring
    } else {
        ring - 1
    };
    (0..count).map(move |k| (1 + k, 1 + (k + 1) % ring))
}

/// Circumcentric and barycentric area of a fan's centre, with their rates.
fn areas(uv: &[Vec2], duv: &[Vec2], kind: FanKind) -> [(f64, f64); 2] {
    let (mut dual, mut ddual, mut third, mut dthird) = (0.0, 0.0, 0.0, 0.0);
    for (i, j) in fan_triangles(uv.len() - 1, kind) {
        let (b, c) = (uv[i] - uv[0], uv[j] - uv[0]);
        let (db, dc) = (duv[i] - duv[0], duv[j] - duv[0]);
        let signed = cross2(&b, &c);
        let (d, dd) = (
            signed.abs(),
            signed.signum() * (cross2(&db, &c) + cross2(&b, &dc)),
        );
        // (|b|^2 cot(c) + |c|^2 cot(b)) / 8
        let (bb, cc, bc) = (b.norm_squared(), c.norm_squared(), b.dot(&c));
        let (dbb, dcc, dbc) = (2.0 * b.dot(&db), 2.0 * c.dot(&dc), db.dot(&c) + b.dot(&dc));
        let part = (2.0 * bb * cc - bc * (bb + cc)) / (8.0 * d);
        let dpart = (2.0 * (dbb * cc + bb * dcc) - dbc * (bb + cc) - bc * (dbb + dcc)) / (8.0 * d);
        dual += part;
        ddual += dpart - part * dd / d;
        third += d / 6.0;
        dthird += dd / 6.0;
    }
    [(dual, ddual), (third, dthird)]
}

/// `S^-1/2` with the eigenvalues of `S` not below `floor`, and its rate (Daleckii-Krein).
fn inverse_root(s: &Mat3, ds: &Mat3, floor: f64, dfloor: f64) -> (Mat3, Mat3) {
    let eigen = s.symmetric_eigen();
    let (l, v) = (eigen.eigenvalues, eigen.eigenvectors);
    let f = l.map(|l| 1.0 / l.max(floor).sqrt());
    let slope = |l: f64| {
        if l > floor {
            -0.5 / (l * l.sqrt())
        } else {
            0.0
        }
    };
    let mut inner = v.transpose() * ds * v;
    for i in 0..3 {
        for j in 0..3 {
            let gap = l[i] - l[j];
            inner[(i, j)] *= if gap.abs() < 1e-6 * floor {
                slope(0.5 * (l[i] + l[j]))
            } else {
                (f[i] - f[j]) / gap
            };
        }
        if l[i] <= floor {
            inner[(i, i)] -= 0.5 * f[i] / floor * dfloor;
        }
    }
    let root = v * Mat3::from_diagonal(&f) * v.transpose();
    (root, v * inner * v.transpose())
}

/// A symmetric tensor `n n^T` of a vector turned by a right angle, `(11, sqrt2 12, 22)`, and its rate.
fn turned_square(e: &Vec2, de: &Vec2) -> (Vec3, Vec3) {
    let r2 = std::f64::consts::SQRT_2;
    (
        Vec3::new(e.y * e.y, -r2 * e.x * e.y, e.x * e.x),
        Vec3::new(
            2.0 * e.y * de.y,
            -r2 * (de.x * e.y + e.x * de.y),
            2.0 * e.x * de.x,
        ),
    )
}

/// Values of the unit quadratics at a point and their rate.
fn quadratics(p: &Vec2, dp: &Vec2) -> (Vec3, Vec3) {
    let r = std::f64::consts::FRAC_1_SQRT_2;
    (
        Vec3::new(0.5 * p.x * p.x, r * p.x * p.y, 0.5 * p.y * p.y),
        Vec3::new(p.x * dp.x, r * (dp.x * p.y + p.x * dp.y), p.y * dp.y),
    )
}

/// Measure of a fan and its rate when the vertices move at rates `duv`.
fn measure_with_rate(uv: &[Vec2], duv: &[Vec2], kind: FanKind) -> (Measure, Measure) {
    let ring = uv.len() - 1;
    let hinges = if kind == FanKind::Closed {
        ring
    } else {
        ring - 2
    };
    let mut m = Measure {
        weights: Vec::with_capacity(hinges),
        angles: Vec::with_capacity(hinges),
        operator: vec![Vec3::zeros(); ring + 1],
        root: Mat3::zeros(),
        normal: Vec3::zeros(),
    };
    let mut dm = Measure {
        weights: Vec::with_capacity(hinges),
        angles: Vec::with_capacity(hinges),
        operator: vec![Vec3::zeros(); ring + 1],
        root: Mat3::zeros(),
        normal: Vec3::zeros(),
    };
    let (mut s, mut ds) = (Mat3::zeros(), Mat3::zeros());
    for k in 0..hinges {
        let local = local_hinge(k, ring, kind);
        let (e, de) = (uv[local[1]] - uv[0], duv[local[1]] - duv[0]);
        let l = e.norm();
        let (square, dsquare) = turned_square(&e, &de);
        let c = square / (2.0 * l);
        let dc = dsquare / (2.0 * l) - c * (e.dot(&de) / (l * l));
        let (p, dp) = (local.map(|i| uv[i]), local.map(|i| duv[i]));
        let (w, dw) = (jump(&p), jump_rate(&p, &dp));
        let (mut q, mut dq) = (Vec3::zeros(), Vec3::zeros());
        for (n, i) in local.into_iter().enumerate() {
            m.operator[i] += c * w[n];
            dm.operator[i] += dc * w[n] + c * dw[n];
            let (z, dz) = quadratics(&(uv[i] - uv[0]), &(duv[i] - duv[0]));
            q += z * w[n];
            dq += dz * w[n] + z * dw[n];
        }
        s += c * q.transpose();
        ds += dc * q.transpose() + c * dq.transpose();
        m.weights.push(c);
        dm.weights.push(dc);
        m.angles.push(q);
        dm.angles.push(dq);
    }
    let [(dual, ddual), (third, dthird)] = areas(uv, duv, kind);
    let (floor, dfloor) = (SMALLEST_AREA * third, SMALLEST_AREA * dthird);
    if kind != FanKind::Part {
        (s, ds) = ((s + s.transpose()) * 0.5, (ds + ds.transpose()) * 0.5);
    } else {
        (s, ds) = (
            Mat3::from_diagonal_element(dual),
            Mat3::from_diagonal_element(ddual),
        );
    }
    (m.root, dm.root) = inverse_root(&s, &ds, floor, dfloor);
    // the border runs from the first to the last neighbour
    let (t, dt) = (uv[ring] - uv[1], duv[ring] - duv[1]);
    let tt = t.norm_squared();
    if kind == FanKind::Border && tt > 0.0 {
        let (square, dsquare) = turned_square(&t, &dt);
        m.normal = square / tt;
        dm.normal = dsquare / tt - m.normal * (2.0 * t.dot(&dt) / tt);
    }
    (m, dm)
}

/// Part of the bending at each vertex that is its own: the mean over the triangles around it.
fn parts(cloth: &Cloth) -> Vec<f64> {
    let mut areas = vec![0.0; cloth.mesh.uv.len()];
    let triangles = cloth.mesh.triangles.iter().zip(&cloth.areas);
    for v in triangles.flat_map(|(tri, area)| tri.map(|v| (v, area / 3.0))) {
        areas[v.0 as usize] += v.1;
    }
    let parts = cloth.vertex_areas.iter().zip(areas);
    parts
        .map(|(own, all)| if all > 0.0 { own / all } else { 1.0 })
        .collect()
}

/// Fans of all panels whose fabric asks for `model`, grouped by arity.
pub(super) fn fan_groups(cloth: &Cloth, model: BendingModel) -> Vec<FanGroup> {
    let mesh = &cloth.mesh;
    let part = parts(cloth);
    let part = |v: u32| part[v as usize];
    let mut groups: BTreeMap<usize, FanGroup> = BTreeMap::new();
    let mut add = |center: u32, ring: &[u32], kind: FanKind| {
        let panel = mesh.vertex_panel[center as usize] as usize;
        let fabric = &cloth.fabrics[cloth.panel_fabric[panel]];
        if fabric.bending_model != model || (kind != FanKind::Closed && ring.len() < 3) {
            return;
        }
        let rotation = material_rotation(cloth.panel_grain[panel]);
        let arity = ring.len() + 1;
        let group = groups.entry(arity).or_insert_with(|| FanGroup {
            arity,
            vertices: Vec::new(),
            fans: Vec::new(),
        });
        let from = group.vertices.len();
        group.vertices.push(center);
        group.vertices.extend_from_slice(ring);
        let uv: Vec<Vec2> = group.vertices[from..]
            .iter()
            .map(|&v| rotation * mesh.uv[v as usize])
            .collect();
        let smallest = fan_triangles(ring.len(), kind)
            .map(|(i, j)| cross2(&(uv[i] - uv[0]), &(uv[j] - uv[0])).abs())
            .fold(f64::INFINITY, f64::min);
        let (measure, _) = measure_with_rate(&uv, &vec![Vec2::zeros(); uv.len()], kind);
        let rigidity = rigidity(fabric) * part(center);
        group.fans.push(FanRest {
            kind,
            fabric: cloth.panel_fabric[panel],
            rotation,
            stiffness: stiffness(&measure, &rigidity, kind),
            measure,
            rigidity,
            curvature: curvature(fabric),
            damping: fabric.damping_stiffness,
            floor: HingeFloor {
                length: 1e-4 * smallest.sqrt(),
                area: 1e-4 * smallest,
            },
            uv,
        });
    };
    for fan in fans(&mesh.triangles) {
        if fan.ring.len() <= MAX_HINGES {
            let kind = if fan.closed {
                FanKind::Closed
            } else {
                FanKind::Border
            };
            add(fan.center, &fan.ring, kind);
            continue;
        }
        // hinges `from .. from + MAX_HINGES - 2` of a long fan, with one neighbour on each side
        let ring = fan.ring.len();
        let hinges = if fan.closed { ring } else { ring - 2 };
        for from in (0..hinges).step_by(MAX_HINGES - 2) {
            let count = (MAX_HINGES - 2).min(hinges - from);
            let first = if fan.closed { ring - 1 } else { 0 };
            let part: Vec<u32> = (0..count + 2)
                .map(|k| fan.ring[(first + from + k) % ring])
                .collect();
            add(fan.center, &part, FanKind::Part);
        }
    }
    groups.into_values().collect()
}
