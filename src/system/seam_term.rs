//! Seams: springs from a vertex of one side to a point of the other, and the angle between the
//! two sides.
//!
//! **Springs.** `gap = x_v - (1-t) x_a - t x_b`, stiffness `k = stiffness * length` of seam. A link that is
//! open pulls with a bounded force (Huber): `k g^2/2` up to `g = d0`, `k d0 (g - d0/2)` beyond,
//! with `d0 = pull / stiffness`, so that sewing from half a metre does not tear the cloth. A link whose gap
//! is below 1 cm (or `2 d0`) when a step starts is sewn and pulls without bound during that step: a
//! seam under load stays shut. Value and gradient are continuous; the Hessian is that of a convex function,
//! `Psd` and `Exact` agree. Zero rest length, so that there is no force at rest and no torque. A link
//! whose vertex is an end of its own receiving edge (the tip of a dart) has nothing to tie.
//!
//! **Angle.** `k (theta - theta0)^2 / 2`, `k = B l^2 / (A_a + A_b)`, between the triangle of side `a` at an edge of the
//! seam and the triangle of side `b` that is tied to it: stencil edge of `a`, opposite vertex of `a`,
//! opposite vertex of `b`, as a hinge of [`crate::math::geometry`]. `B` is the mean of both sides'
//! rigidity for bending about the seam, `B_side = bending_weft n1^2 + bending_warp n2^2` with the normal `n` of the seam
//! in the (weft, warp) frame; `l` the edge, `A` the rest areas: the curvature is spread over half a
//! triangle on either side. An open seam has no angle: it acts in a step only if both its links
//! are closer than the length of the edge when the step starts. SI units.

use super::membrane::material_rotation;
use super::state::State;
use super::term::{Configuration, HessianKind, RestChange, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::geometry::{
    HingeFloor, cross2, dihedral, dihedral_gradient, dihedral_hessian, edge_sides, sides_of,
    wrap_angle,
};
use crate::math::{Mat2, Mat3, Vec2, Vec3};
use crate::pattern::Fabric;
use crate::tri::SeamLink;

/// Gap below which a link is sewn [m].
const SEWN: f64 = 0.01;

/// Springs that close the seams.
pub struct SeamSprings {
    vertices: Vec<u32>,
    links: Vec<Spring>,
    /// Gap up to which an open link is elastic [m].
    elastic: f64,
}

struct Spring {
    t: f64,
    stiffness: f64,
    sewn: bool,
}

fn gap(link: [u32; 3], t: f64, x: &[Vec3]) -> Vec3 {
    let [v, a, b] = link.map(|v| x[v as usize]);
    v - a * (1.0 - t) - b * t
}

impl SeamSprings {
    /// Springs of all links of all seams: `stiffness` per length of seam [N/m^2], largest force
    /// `pull` of an open link per length of seam [N/m].
    pub fn new(cloth: &Cloth, stiffness: f64, pull: f64) -> Self {
        let mut vertices = Vec::new();
        let mut links = Vec::new();
        for link in cloth.mesh.seams.iter().flat_map(|s| &s.links) {
            if link.edge.contains(&link.vertex) {
                continue;
            }
            vertices.extend([link.vertex, link.edge[0], link.edge[1]]);
            links.push(Spring {
                t: link.t,
                stiffness: stiffness * link.length,
                sewn: false,
            });
        }
        Self {
            vertices,
            links,
            elastic: pull / stiffness,
        }
    }

    /// Largest gap over all links [m].
    pub fn largest_gap(&self, x: &[Vec3]) -> f64 {
        (0..self.links.len())
            .map(|e| gap(self.link(e), self.links[e].t, x).norm())
            .fold(0.0, f64::max)
    }

    fn link(&self, e: usize) -> [u32; 3] {
        [0, 1, 2].map(|k| self.vertices[3 * e + k])
    }

    fn coefficients(&self, e: usize) -> [f64; 3] {
        let t = self.links[e].t;
        [1.0, t - 1.0, -t]
    }

    /// Whether the link pulls with its full spring at this gap.
    fn is_elastic(&self, e: usize, g: f64) -> bool {
        self.links[e].sewn || g <= self.elastic
    }
}

impl Term for SeamSprings {
    fn name(&self) -> &'static str {
        "seam"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 3,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.links[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let k = self.links[e].stiffness;
        let g = gap(self.link(e), self.links[e].t, at.x).norm();
        if self.is_elastic(e, g) {
            0.5 * k * g * g
        } else {
            k * self.elastic * (g - 0.5 * self.elastic)
        }
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let d = gap(self.link(e), self.links[e].t, at.x);
        let g = d.norm();
        let k = self.links[e].stiffness;
        let force = if self.is_elastic(e, g) {
            d * k
        } else {
            d * (k * self.elastic / g)
        };
        for (o, c) in out.iter_mut().zip(self.coefficients(e)) {
            *o = force * c;
        }
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        let d = gap(self.link(e), self.links[e].t, at.x);
        let g = d.norm();
        let k = self.links[e].stiffness;
        let block = if self.is_elastic(e, g) {
            Mat3::from_diagonal_element(k)
        } else {
            (Mat3::identity() - d * d.transpose() / (g * g)) * (k * self.elastic / g)
        };
        let c = self.coefficients(e);
        for i in 0..3 {
            for j in 0..=i {
                out[i * (i + 1) / 2 + j] = block * (c[i] * c[j]);
            }
        }
    }

    fn begin_step(&mut self, state: &State, _: &Configuration<'_>) -> bool {
        for e in 0..self.links.len() {
            let g = gap(self.link(e), self.links[e].t, &state.positions).norm();
            self.links[e].sewn = g < SEWN.max(2.0 * self.elastic);
        }
        false
    }
}

/// Bending across the seams.
pub struct SeamHinge {
    vertices: Vec<u32>,
    hinges: Vec<Angle>,
}

/// Rest data of one side of a hinge.
struct Side {
    /// Ends of the edge and the opposite vertex.
    vertices: [u32; 3],
    /// Material coordinates of them.
    uv: [Vec2; 3],
    rotation: Mat2,
    fabric: usize,
    bending: [f64; 2],
    damping: f64,
}

struct Angle {
    sides: [Side; 2],
    links: [SeamLink; 2],
    rest_angle: f64,
    stiffness: f64,
    damping: f64,
    floor: HingeFloor,
    /// Rest length of the edge [m].
    length: f64,
    active: bool,
}

/// Rigidity for bending about the edge and area of a side, and their rates.
fn side_rates(side: &Side, duv: &[Vec2; 3], change: &Fabric) -> ([f64; 2], [f64; 2]) {
    let (e, de) = (side.uv[1] - side.uv[0], duv[1] - duv[0]);
    let (u, du) = (side.uv[2] - side.uv[0], duv[2] - duv[0]);
    let ee = e.norm_squared();
    let weft = e.y * e.y / ee;
    let dweft = (2.0 * e.y * de.y - weft * 2.0 * e.dot(&de)) / ee;
    let [b1, b2] = side.bending;
    let signed = cross2(&e, &u);
    (
        [b1 * weft + b2 * (1.0 - weft), 0.5 * signed.abs()],
        [
            change.bending_weft * weft + change.bending_warp * (1.0 - weft) + (b1 - b2) * dweft,
            0.5 * signed.signum() * (cross2(&de, &u) + cross2(&e, &du)),
        ],
    )
}

impl SeamHinge {
    /// Hinges between consecutive links of every seam whose vertices span a border edge.
    pub fn new(cloth: &Cloth) -> Self {
        let mesh = &cloth.mesh;
        let sides = edge_sides(&mesh.triangles);
        let side_at = |a: u32, b: u32| -> Option<Side> {
            let [one] = sides_of(&sides, a, b) else {
                return None;
            };
            let (from, to) = if one.reversed {
                (one.high, one.low)
            } else {
                (one.low, one.high)
            };
            let panel = mesh.triangle_panel[one.triangle as usize] as usize;
            let rotation = material_rotation(cloth.panel_grain[panel]);
            let vertices = [from, to, one.opposite];
            let fabric = cloth.fabric_of(one.triangle as usize);
            Some(Side {
                vertices,
                uv: vertices.map(|v| rotation * mesh.uv[v as usize]),
                rotation,
                fabric: cloth.panel_fabric[panel],
                bending: [fabric.bending_weft, fabric.bending_warp],
                damping: fabric.damping_stiffness,
            })
        };
        let (mut vertices, mut hinges) = (Vec::new(), Vec::new());
        for seam in &mesh.seams {
            for pair in seam.links.windows(2) {
                let Some(a) = side_at(pair[0].vertex, pair[1].vertex) else {
                    continue;
                };
                let Some(b) = side_at(pair[0].edge[0], pair[0].edge[1]) else {
                    continue;
                };
                if a.vertices.contains(&b.vertices[2]) {
                    continue;
                }
                let length = (a.uv[1] - a.uv[0]).norm();
                let area = |s: &Side| cross2(&(s.uv[1] - s.uv[0]), &(s.uv[2] - s.uv[0])).abs();
                let smallest = area(&a).min(area(&b));
                vertices.extend([a.vertices[0], a.vertices[1], a.vertices[2], b.vertices[2]]);
                let mut angle = Angle {
                    damping: 0.5 * (a.damping + b.damping),
                    sides: [a, b],
                    links: [pair[0], pair[1]],
                    rest_angle: seam.rest_angle,
                    stiffness: 0.0,
                    floor: HingeFloor {
                        length: 1e-4 * length,
                        area: 1e-4 * smallest,
                    },
                    length,
                    active: true,
                };
                angle.stiffness = angle.stiffness_rate(None).0;
                hinges.push(angle);
            }
        }
        Self { vertices, hinges }
    }

    fn points(&self, e: usize, x: &[Vec3]) -> [Vec3; 4] {
        [0, 1, 2, 3].map(|k| x[self.vertices[4 * e + k] as usize])
    }

    /// Bend from the rest angle and its change since the start of the step.
    fn bend(&self, e: usize, at: &Configuration<'_>) -> (f64, f64) {
        let hinge = &self.hinges[e];
        let now = dihedral(&self.points(e, at.x));
        let since = if at.inv_dt > 0.0 {
            wrap_angle(now - dihedral(&self.points(e, at.x0)))
        } else {
            0.0
        };
        (wrap_angle(now - hinge.rest_angle), since)
    }

    fn moment(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let hinge = &self.hinges[e];
        let (now, since) = self.bend(e, at);
        hinge.stiffness * (now + since * hinge.damping * at.inv_dt)
    }
}

impl Angle {
    /// Stiffness [N m] and its rate.
    fn stiffness_rate(&self, change: Option<&RestChange<'_>>) -> (f64, f64) {
        let none = Fabric {
            bending_warp: 0.0,
            bending_weft: 0.0,
            ..Fabric::default()
        };
        let rates = |side: &Side| match change {
            Some(c) => side_rates(
                side,
                &side.vertices.map(|v| side.rotation * c.uv[v as usize]),
                &c.fabrics[side.fabric],
            ),
            None => side_rates(side, &[Vec2::zeros(); 3], &none),
        };
        let [(a, da), (b, db)] = [rates(&self.sides[0]), rates(&self.sides[1])];
        let uv = &self.sides[0].uv;
        let e = uv[1] - uv[0];
        let dll = change.map_or(0.0, |c| {
            let [from, to, _] = self.sides[0].vertices;
            let de = self.sides[0].rotation * (c.uv[to as usize] - c.uv[from as usize]);
            2.0 * e.dot(&de)
        });
        let (bending, dbending) = (0.5 * (a[0] + b[0]), 0.5 * (da[0] + db[0]));
        let (area, darea) = (a[1] + b[1], da[1] + db[1]);
        let ll = e.norm_squared();
        let k = bending * ll / area;
        (k, (dbending * ll + bending * dll - k * darea) / area)
    }
}

impl Term for SeamHinge {
    fn name(&self) -> &'static str {
        "seam_hinge"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 4,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.hinges[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let hinge = &self.hinges[e];
        if !hinge.active {
            return 0.0;
        }
        let (now, since) = self.bend(e, at);
        0.5 * hinge.stiffness * (now * now + hinge.damping * at.inv_dt * since * since)
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let hinge = &self.hinges[e];
        if !hinge.active {
            out.fill(Vec3::zeros());
            return;
        }
        let moment = self.moment(e, at);
        let g = dihedral_gradient(&self.points(e, at.x), hinge.floor);
        for (o, g) in out.iter_mut().zip(g) {
            *o = g * moment;
        }
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let hinge = &self.hinges[e];
        if !hinge.active {
            out.fill(Mat3::zeros());
            return;
        }
        let x = self.points(e, at.x);
        let g = dihedral_gradient(&x, hinge.floor);
        let k = hinge.stiffness * (1.0 + hinge.damping * at.inv_dt);
        for i in 0..4 {
            for j in 0..=i {
                out[i * (i + 1) / 2 + j] = g[i] * g[j].transpose() * k;
            }
        }
        let exactness = kind.exactness();
        if exactness > 0.0 {
            let moment = self.moment(e, at) * exactness;
            let h = dihedral_hessian(&x, hinge.floor);
            for i in 0..4 {
                for j in 0..=i {
                    out[i * (i + 1) / 2 + j] += h[i][j] * moment;
                }
            }
        }
    }

    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let hinge = &self.hinges[e];
        if !hinge.active {
            out.fill(Vec3::zeros());
            return;
        }
        let (_, dk) = hinge.stiffness_rate(Some(change));
        let ddamping = 0.5
            * (change.fabrics[hinge.sides[0].fabric].damping_stiffness
                + change.fabrics[hinge.sides[1].fabric].damping_stiffness);
        let (now, since) = self.bend(e, at);
        let dmoment = dk * (now + since * hinge.damping * at.inv_dt)
            + hinge.stiffness * since * ddamping * at.inv_dt;
        let g = dihedral_gradient(&self.points(e, at.x), hinge.floor);
        for (o, g) in out.iter_mut().zip(g) {
            *o = g * dmoment;
        }
    }

    fn begin_step(&mut self, state: &State, _: &Configuration<'_>) -> bool {
        for hinge in &mut self.hinges {
            hinge.active = hinge.links.iter().all(|l| {
                let g = gap([l.vertex, l.edge[0], l.edge[1]], l.t, &state.positions);
                g.norm() < hinge.length
            });
        }
        false
    }
}
