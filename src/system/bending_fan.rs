//! The bending operator that both bending models share: moments on the fans around vertices.
//!
//! The Hessian of a piecewise linear surface is concentrated on its edges: slope jump `theta_e`
//! times `n_e n_e^T` along edge `e` of length `l_e`. Tested with the hat function of vertex `v` it
//! gives
//!
//! ```text
//! r_v = sum_{e at v} l_e/2 theta_e n_e n_e^T,   curvature at v: r_v / A_v
//! V   = sum_v 1/(2 A_v) tr(r_v M r_v),          M = diag(bending_weft, bending_warp)
//! ```
//!
//! in the (weft, warp) frame, `A_v` the circumcentric area of the vertex (exact for
//! `theta` of `|x|^2/2`, never below a quarter of its barycentric area, which slivers at a border
//! would undercut). This is the lowest-order mixed plate method (moments continuous and piecewise
//! linear, mass lumped; compare Ciarlet and Raviart 1974 for the Laplacian, and the averaged shape
//! operator of Grinspun et al. 2006). A cylinder of curvature `k` whose axis is at any angle costs
//! `B(phi) k^2 / 2` per area with `B(phi) = bending_weft cos^2 + bending_warp sin^2`, `phi` the angle
//! from the weft to the direction that curves; Poisson coupling is zero.
//!
//! Why not one spring per edge (discrete shells, `theta_e^2` alone): on a mesh of squares with one
//! diagonal the three angles of a triangle are `(a + b, b + c, b)` times the curvatures `a, b, c`;
//! no positive weights of their squares give the energy of cylinders along the axes and along both
//! diagonals, so that the stiffness depends on the mesh whatever its fineness. Summing before
//! squaring removes the cross terms. The operator reproduces a constant moment state (its nodal
//! forces vanish in the interior), which bounds the stiffness from below by the material's; it is
//! exact on lattices and a few percent too stiff on badly shaped irregular meshes.
//!
//! A fan with more neighbours than a stencil holds is cut into shorter ones.

use super::membrane::material_rotation;
use super::term::MAX_ARITY;
use crate::cloth::Cloth;
use crate::math::geometry::{HingeFloor, cross2, fans};
use crate::math::{Mat2, Vec2, Vec3};
use crate::pattern::{BendingModel, Fabric};
use std::collections::BTreeMap;

/// Largest number of hinges of a fan.
pub(super) const MAX_HINGES: usize = MAX_ARITY - 1;
/// Smallest area of a vertex, as a part of its barycentric area.
const SMALLEST_AREA: f64 = 0.25;

/// Rest data of one fan.
pub(super) struct FanRest {
    pub(super) closed: bool,
    pub(super) fabric: usize,
    pub(super) rotation: Mat2,
    /// Material coordinates of the stencil's vertices [m].
    pub(super) uv: Vec<Vec2>,
    pub(super) measure: Measure,
    /// Rigidity of the components `(weft, twist, warp)` of a moment [N m].
    pub(super) rigidity: Vec3,
    pub(super) damping: f64,
    pub(super) floor: HingeFloor,
}

/// What a fan's energy needs of its flat shape, and the rate of it.
pub(super) struct Measure {
    /// `l/2 (n1^2, sqrt2 n1 n2, n2^2)` of each hinge [m].
    pub(super) weights: Vec<Vec3>,
    /// Area of the vertex [m^2].
    pub(super) area: f64,
}

/// Fans of equal arity, the first vertex of each stencil being the centre.
pub(super) struct FanGroup {
    pub(super) arity: usize,
    pub(super) vertices: Vec<u32>,
    pub(super) fans: Vec<FanRest>,
}

/// Rigidity of the three components of a moment: `tr(r M r) = d . (r11^2, 2 r12^2, r22^2)`.
pub(super) fn rigidity(f: &Fabric) -> Vec3 {
    Vec3::new(
        f.bending_weft,
        0.5 * (f.bending_weft + f.bending_warp),
        f.bending_warp,
    )
}

/// Local vertices `[centre, neighbour, next, previous]` of hinge `k` of a fan with `ring`
/// neighbours: a hinge as in [`crate::math::geometry`].
pub(super) fn local_hinge(k: usize, ring: usize, closed: bool) -> [usize; 4] {
    let at = if closed { k } else { k + 1 };
    [0, 1 + at, 1 + (at + 1) % ring, 1 + (at + ring - 1) % ring]
}

impl FanRest {
    pub(super) fn hinge_count(&self) -> usize {
        let ring = self.uv.len() - 1;
        if self.closed { ring } else { ring - 2 }
    }

    pub(super) fn local_hinge(&self, k: usize) -> [usize; 4] {
        local_hinge(k, self.uv.len() - 1, self.closed)
    }
}

/// Triangles of a fan as pairs of local vertices beside the centre.
fn fan_triangles(ring: usize, closed: bool) -> impl Iterator<Item = (usize, usize)> {
    let count = if closed { ring } else { ring - 1 };
    (0..count).map(move |k| (1 + k, 1 + (k + 1) % ring))
}

pub(super) fn measure(uv: &[Vec2], closed: bool) -> Measure {
    let zero = vec![Vec2::zeros(); uv.len()];
    measure_with_rate(uv, &zero, closed).0
}

/// Measure of a fan and its rate when the vertices move at rates `duv`.
pub(super) fn measure_with_rate(uv: &[Vec2], duv: &[Vec2], closed: bool) -> (Measure, Measure) {
    let ring = uv.len() - 1;
    let hinges = if closed { ring } else { ring - 2 };
    let (mut weights, mut rates) = (Vec::new(), Vec::new());
    for k in 0..hinges {
        let i = local_hinge(k, ring, closed)[1];
        let (e, de) = (uv[i] - uv[0], duv[i] - duv[0]);
        let l = e.norm();
        let r2 = std::f64::consts::SQRT_2;
        let w = Vec3::new(e.y * e.y, -r2 * e.x * e.y, e.x * e.x) / (2.0 * l);
        let dw = Vec3::new(
            2.0 * e.y * de.y,
            -r2 * (de.x * e.y + e.x * de.y),
            2.0 * e.x * de.x,
        ) / (2.0 * l);
        weights.push(w);
        rates.push(dw - w * (e.dot(&de) / (l * l)));
    }
    let (mut dual, mut ddual, mut third, mut dthird) = (0.0, 0.0, 0.0, 0.0);
    for (i, j) in fan_triangles(ring, closed) {
        let (b, c) = (uv[i] - uv[0], uv[j] - uv[0]);
        let (db, dc) = (duv[i] - duv[0], duv[j] - duv[0]);
        let signed = cross2(&b, &c);
        let (d, dd) = (
            signed.abs(),
            signed.signum() * (cross2(&db, &c) + cross2(&b, &dc)),
        );
        // circumcentric part of the corner: (|b|^2 cot(c) + |c|^2 cot(b)) / 8
        let (bb, cc, bc) = (b.norm_squared(), c.norm_squared(), b.dot(&c));
        let (dbb, dcc, dbc) = (2.0 * b.dot(&db), 2.0 * c.dot(&dc), db.dot(&c) + b.dot(&dc));
        let part = (2.0 * bb * cc - bc * (bb + cc)) / (8.0 * d);
        let dpart = (2.0 * (dbb * cc + bb * dcc) - dbc * (bb + cc) - bc * (dbb + dcc)) / (8.0 * d);
        dual += part;
        ddual += dpart - part * dd / d;
        third += d / 6.0;
        dthird += dd / 6.0;
    }
    let (area, darea) = if dual >= SMALLEST_AREA * third {
        (dual, ddual)
    } else {
        (SMALLEST_AREA * third, SMALLEST_AREA * dthird)
    };
    (
        Measure { weights, area },
        Measure {
            weights: rates,
            area: darea,
        },
    )
}

/// Fans of all panels whose fabric asks for `model`, grouped by arity.
pub(super) fn fan_groups(cloth: &Cloth, model: BendingModel) -> Vec<FanGroup> {
    let mesh = &cloth.mesh;
    let mut groups: BTreeMap<usize, FanGroup> = BTreeMap::new();
    let mut add = |center: u32, ring: &[u32], closed: bool| {
        let panel = mesh.vertex_panel[center as usize] as usize;
        let fabric = &cloth.fabrics[cloth.panel_fabric[panel]];
        if fabric.bending_model != model || (!closed && ring.len() < 3) {
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
        let smallest = fan_triangles(ring.len(), closed)
            .map(|(i, j)| cross2(&(uv[i] - uv[0]), &(uv[j] - uv[0])).abs())
            .fold(f64::INFINITY, f64::min);
        group.fans.push(FanRest {
            closed,
            fabric: cloth.panel_fabric[panel],
            rotation,
            measure: measure(&uv, closed),
            rigidity: rigidity(fabric),
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
            add(fan.center, &fan.ring, fan.closed);
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
            add(fan.center, &part, false);
        }
    }
    groups.into_values().collect()
}
