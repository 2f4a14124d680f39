//! Cloth against bodies: penalty on the signed distance, Coulomb friction by moving anchors.
//!
//! With `d(x)` the signed distance, `t` the thickness, `A` the vertex's area and `c` the contact
//! stiffness [Pa/m], `k = c A` [N/m]:
//!
//! ```text
//! normal     k/2 (t - d)^2                         where d < t
//! friction   k/2 |u|^2          where k |u| <= mu lambda     (stick)
//!            mu lambda |u| - (mu lambda)^2 / 2k    beyond    (slip)
//! ```
//!
//! `u = P (x - a)` is the tangential distance to the anchor `a`, `P` projects on the tangent plane
//! at the start of the step, `lambda` is the normal force of the last accepted step (Hasegawa et
//! al. 2003; Umetani et al. 2011, section 7). The anchor rides on the body. After an accepted step
//! a slipping anchor is drawn along to the distance `mu lambda / k`.

use super::super::state::{BodyAnchor, State};
use super::super::term::{Configuration, HessianKind, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::{Mat3, Vec3};

/// Lagged friction of one vertex on one body.
#[derive(Clone, Copy, Debug)]
struct Friction {
    body: u32,
    anchor: Vec3,
    normal: Vec3,
    limit: f64,
}

/// Contact of every vertex with every body.
#[derive(Debug, Default)]
pub struct BodyContact {
    vertices: Vec<u32>,
    areas: Vec<f64>,
    /// Per vertex and body: how far the vertex may move before it can touch.
    clearance: Vec<f64>,
    body_count: usize,
    /// CSR by vertex.
    friction_starts: Vec<u32>,
    friction: Vec<Friction>,
}

impl BodyContact {
    /// Contact for the vertices of a cloth.
    pub fn new(cloth: &Cloth) -> Self {
        let n = cloth.mesh.uv.len();
        Self {
            vertices: (0..n as u32).collect(),
            areas: cloth.vertex_areas.clone(),
            clearance: Vec::new(),
            body_count: 0,
            friction_starts: vec![0; n + 1],
            friction: Vec::new(),
        }
    }

    fn touching<'a>(
        &'a self,
        e: usize,
        at: &'a Configuration<'_>,
    ) -> impl Iterator<Item = usize> + 'a {
        let moved = (at.x[e] - at.x0[e]).norm();
        (0..self.body_count).filter(move |b| moved >= self.clearance[e * self.body_count + b])
    }

    fn frictions(&self, e: usize) -> &[Friction] {
        &self.friction[self.friction_starts[e] as usize..self.friction_starts[e + 1] as usize]
    }
}

/// Tangential part of a vector.
fn tangential(normal: &Vec3, v: &Vec3) -> Vec3 {
    v - normal * normal.dot(v)
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

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let bodies = at.world.bodies;
        let x = &at.x[e];
        let mut sum = 0.0;
        for b in self.touching(e, at) {
            let contact = bodies.contact(b);
            let depth = contact.thickness - bodies.value(b, x);
            if depth > 0.0 {
                sum += 0.5 * contact.stiffness * self.areas[e] * depth * depth;
            }
        }
        for f in self.frictions(e) {
            let k = bodies.contact(f.body as usize).stiffness * self.areas[e];
            let u = tangential(&f.normal, &(x - f.anchor)).norm();
            sum += if k * u <= f.limit {
                0.5 * k * u * u
            } else {
                f.limit * u - 0.5 * f.limit * f.limit / k
            };
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
            let depth = contact.thickness - d.value;
            if depth > 0.0 {
                g -= d.gradient * (contact.stiffness * self.areas[e] * depth);
            }
        }
        for f in self.frictions(e) {
            let k = bodies.contact(f.body as usize).stiffness * self.areas[e];
            let u = tangential(&f.normal, &(x - f.anchor));
            let length = u.norm();
            g += if k * length <= f.limit {
                u * k
            } else {
                u * (f.limit / length)
            };
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
            let depth = contact.thickness - d.value;
            if depth > 0.0 {
                let k = contact.stiffness * self.areas[e];
                h += d.gradient * d.gradient.transpose() * k;
                if kind == HessianKind::Exact {
                    h -= d.hessian * (k * depth);
                }
            }
        }
        for f in self.frictions(e) {
            let k = bodies.contact(f.body as usize).stiffness * self.areas[e];
            let u = tangential(&f.normal, &(x - f.anchor));
            let length = u.norm();
            let plane = Mat3::identity() - f.normal * f.normal.transpose();
            if k * length <= f.limit {
                h += plane * k;
            } else {
                let t = u / length;
                h += (plane - t * t.transpose()) * (f.limit / length);
            }
        }
        out[0] = h;
    }

    fn begin_step(&mut self, state: &State, at: &Configuration<'_>) -> bool {
        let bodies = at.world.bodies;
        self.body_count = bodies.count();
        self.clearance.clear();
        for x in at.x0 {
            for b in 0..self.body_count {
                self.clearance
                    .push(bodies.value(b, x) - bodies.contact(b).thickness);
            }
        }
        self.friction.clear();
        self.friction_starts.fill(0);
        for anchor in &state.body_anchors {
            let mu = bodies.contact(anchor.body as usize).friction;
            if mu <= 0.0 || anchor.normal_force <= 0.0 {
                continue;
            }
            let d = bodies.distance(anchor.body as usize, &at.x0[anchor.vertex as usize]);
            let Some(normal) = d.gradient.try_normalize(1e-12) else {
                continue;
            };
            self.friction_starts[anchor.vertex as usize + 1] += 1;
            self.friction.push(Friction {
                body: anchor.body,
                anchor: bodies.carried(anchor.body as usize, &anchor.point),
                normal,
                limit: mu * anchor.normal_force,
            });
        }
        for v in 0..self.vertices.len() {
            self.friction_starts[v + 1] += self.friction_starts[v];
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
                f -= d.gradient * (k * (contact.thickness - d.value).max(0.0));
            }
            for friction in self.frictions(e).iter().filter(|f| f.body as usize == body) {
                let u = tangential(&friction.normal, &(x - friction.anchor));
                let length = u.norm();
                f += if k * length <= friction.limit {
                    u * k
                } else {
                    u * (friction.limit / length)
                };
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
                let depth = contact.thickness - d.value;
                if depth <= 0.0 {
                    continue;
                }
                let k = contact.stiffness * self.areas[e];
                let normal_force = k * depth * d.gradient.norm();
                let point = match self.frictions(e).iter().find(|f| f.body as usize == b) {
                    Some(f) => {
                        let normal = d.gradient.try_normalize(1e-12).unwrap_or(f.normal);
                        let u = tangential(&normal, &(x - f.anchor));
                        let reach = contact.friction * normal_force / k;
                        let length = u.norm();
                        if length <= reach {
                            x - u
                        } else {
                            x - u * (reach / length)
                        }
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
