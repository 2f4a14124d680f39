//! Cloth against bodies: penalty on the signed distance, Coulomb friction by moving anchors.
//!
//! With `d(x)` the signed distance, `t` the thickness (or the yarn's radius, if that is larger), `A`
//! the point's area and `c` the contact stiffness [Pa/m], `k = c A` [N/m]:
//!
//! ```text
//! V = k/2 (t - d)^2   where d < t
//! ```
//!
//! Friction is that of [`friction`](super::friction); its anchor rides on the body, its plane is the
//! tangent plane at the start of the step.

use super::super::state::{BodyAnchor, State};
use super::super::term::{Configuration, ContactSettings, HessianKind, Stencils, Term};
use super::clearance::Clearance;
use super::friction::{Friction, kept};
use crate::math::{Mat3, Vec3};
use crate::system::points::Points;

/// Friction of one vertex on one body.
#[derive(Clone, Copy, Debug)]
struct Rub {
    body: u32,
    anchor: Vec3,
    friction: Friction,
}

impl Rub {
    fn slip(&self, x: &Vec3) -> Vec3 {
        self.friction.slip(&(x - self.anchor))
    }
}

/// Contact of every vertex and node with every body.
#[derive(Debug, Default)]
pub struct BodyContact {
    vertices: Vec<u32>,
    areas: Vec<f64>,
    radii: Vec<f64>,
    clearance: Clearance,
    /// CSR by vertex.
    rub_starts: Vec<u32>,
    rubs: Vec<Rub>,
}

impl BodyContact {
    /// Contact for points; one that does not move by itself touches nothing.
    pub fn new(points: &Points) -> Self {
        let n = points.count();
        Self {
            vertices: (0..n as u32).collect(),
            areas: points.areas.clone(),
            radii: points.radii.clone(),
            clearance: Clearance::default(),
            rub_starts: vec![0; n + 1],
            rubs: Vec::new(),
        }
    }

    fn touching<'a>(
        &'a self,
        e: usize,
        at: &'a Configuration<'_>,
    ) -> impl Iterator<Item = usize> + 'a {
        self.clearance.touching(e, (at.x[e] - at.x0[e]).norm())
    }

    /// Distance from a body below which the point presses on it [m].
    fn thickness(&self, e: usize, contact: &ContactSettings) -> f64 {
        contact.thickness.max(self.radii[e])
    }

    fn rubs(&self, e: usize) -> &[Rub] {
        &self.rubs[self.rub_starts[e] as usize..self.rub_starts[e + 1] as usize]
    }
}

impl Term for BodyContact {
    fn name(&self) -> &'static str {
        "body_contact"
    }

    fn is_internal(&self) -> bool {
        false
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 1,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + 16 * self.areas.len() + size_of_val(&self.rubs[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let bodies = at.world.bodies;
        let x = &at.x[e];
        let mut sum = 0.0;
        for b in self.touching(e, at) {
            let contact = bodies.contact(b);
            let depth = self.thickness(e, contact) - bodies.value(b, x);
            if depth > 0.0 {
                sum += 0.5 * contact.stiffness * self.areas[e] * depth * depth;
            }
        }
        for rub in self.rubs(e) {
            sum += rub.friction.energy(&rub.slip(x));
        }
        sum
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let bodies = at.world.bodies;
        let x = &at.x[e];
        let mut g = Vec3::zeros();
        for b in self.touching(e, at) {
            let contact = bodies.contact(b);
            let d = bodies.distance(b, x);
            let depth = self.thickness(e, contact) - d.value;
            if depth > 0.0 {
                g -= d.gradient * (contact.stiffness * self.areas[e] * depth);
            }
        }
        for rub in self.rubs(e) {
            g += rub.friction.force(&rub.slip(x));
        }
        out[0] = g;
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let bodies = at.world.bodies;
        let x = &at.x[e];
        let mut h = Mat3::zeros();
        for b in self.touching(e, at) {
            let contact = bodies.contact(b);
            let d = bodies.distance(b, x);
            let depth = self.thickness(e, contact) - d.value;
            if depth > 0.0 {
                let k = contact.stiffness * self.areas[e];
                h += d.gradient * d.gradient.transpose() * k;
                let exactness = kind.exactness();
                if exactness > 0.0 {
                    h -= d.hessian * (k * depth * exactness);
                }
            }
        }
        for rub in self.rubs(e) {
            h += rub.friction.hessian(&rub.slip(x));
        }
        out[0] = h;
    }

    fn begin_step(&mut self, state: &State, at: &Configuration<'_>) -> bool {
        let bodies = at.world.bodies;
        let points = at.x0[..self.vertices.len()].iter().copied();
        self.clearance.update(bodies, points, |e, contact| {
            if self.areas[e] > 0.0 {
                contact.thickness.max(self.radii[e])
            } else {
                f64::NEG_INFINITY
            }
        });
        self.rubs.clear();
        self.rub_starts.fill(0);
        for anchor in &state.body_anchors {
            let (vertex, body) = (anchor.vertex as usize, anchor.body as usize);
            let contact = bodies.contact(body);
            let d = bodies.distance(body, &at.x0[vertex]);
            let Some(normal) = d.gradient.try_normalize(1e-12) else {
                continue;
            };
            let bound = contact.friction * anchor.normal_force;
            let Some(friction) =
                Friction::new(normal, bound, contact.stiffness * self.areas[vertex])
            else {
                continue;
            };
            self.rub_starts[vertex + 1] += 1;
            self.rubs.push(Rub {
                body: anchor.body,
                anchor: bodies.carried(body, &anchor.point),
                friction,
            });
        }
        for v in 0..self.vertices.len() {
            self.rub_starts[v + 1] += self.rub_starts[v];
        }
        false
    }

    fn add_wrench(
        &self,
        body: usize,
        at: &Configuration<'_>,
        origin: &Vec3,
        force: &mut Vec3,
        torque: &mut Vec3,
    ) {
        let contact = at.world.bodies.contact(body);
        for e in 0..self.vertices.len() {
            let x = &at.x[e];
            let k = contact.stiffness * self.areas[e];
            let mut f = Vec3::zeros();
            if self.touching(e, at).any(|b| b == body) {
                let d = at.world.bodies.distance(body, x);
                f -= d.gradient * (k * (self.thickness(e, contact) - d.value).max(0.0));
            }
            for rub in self.rubs(e).iter().filter(|r| r.body as usize == body) {
                f += rub.friction.force(&rub.slip(x));
            }
            *force += f;
            *torque += (x - origin).cross(&f);
        }
    }

    fn accept(&mut self, at: &Configuration<'_>, state: &mut State) {
        let bodies = at.world.bodies;
        state.body_anchors.clear();
        for e in 0..self.vertices.len() {
            let x = at.x[e];
            for b in self.touching(e, at) {
                let contact = bodies.contact(b);
                let d = bodies.distance(b, &x);
                let depth = self.thickness(e, contact) - d.value;
                if depth <= 0.0 {
                    continue;
                }
                let k = contact.stiffness * self.areas[e];
                let normal_force = k * depth * d.gradient.norm();
                let point = match self.rubs(e).iter().find(|r| r.body as usize == b) {
                    Some(rub) => {
                        let offset = x - rub.anchor;
                        let slip = match d.gradient.try_normalize(1e-12) {
                            Some(normal) => offset - normal * normal.dot(&offset),
                            None => rub.slip(&x),
                        };
                        x - kept(&slip, contact.friction * normal_force, k)
                    }
                    None => x,
                };
                state.body_anchors.push(BodyAnchor {
                    vertex: e as u32,
                    body: b as u32,
                    point,
                    normal_force,
                });
            }
        }
    }
}
