//! Mid-points of cloth edges against bodies.
//!
//! Vertices alone let the chord of an edge dip into a curved body: by `l^2 / 8R` for an edge `l` on a
//! radius `R`. A sample at the middle divides that by four. With `m` the mid-point, `A` a third of
//! the area beside the edge and `c` the contact stiffness [Pa/m]
//!
//! ```text
//! V = c A / 2 (t/2 - d(m))^2   where d(m) < t/2
//! ```
//!
//! `t/2` is half of the thickness that vertices keep, so that the mid-points of cloth that rests on
//! a body carry nothing unless the surface bulges between the vertices. No friction: the vertices
//! have it.

use super::super::state::State;
use super::super::term::{Configuration, HessianKind, Stencils, Term};
use super::clearance::Clearance;
use crate::cloth::Cloth;
use crate::math::{Mat3, Vec3, topology};

/// Contact of every edge's mid-point with every body.
#[derive(Debug, Default)]
pub struct EdgeContact {
    vertices: Vec<u32>,
    areas: Vec<f64>,
    clearance: Clearance,
}

impl EdgeContact {
    /// Contact for the edges of a cloth.
    pub fn new(cloth: &Cloth) -> Self {
        let edges = topology::edges(&cloth.mesh.triangles);
        let mut areas = vec![0.0; edges.len()];
        let own = cloth.areas.iter().zip(&cloth.own).map(|(a, own)| a * own);
        for (tri, area) in cloth.mesh.triangles.iter().zip(own) {
            for k in 0..3 {
                let (a, b) = (tri[k], tri[(k + 1) % 3]);
                if let Ok(e) = edges.binary_search(&[a.min(b), a.max(b)]) {
                    areas[e] += area / 3.0;
                }
            }
        }
        Self {
            vertices: edges.into_flattened(),
            areas,
            clearance: Clearance::default(),
        }
    }

    fn middle(&self, e: usize, x: &[Vec3]) -> Vec3 {
        middle(&self.vertices, e, x)
    }

    /// Bodies that the mid-point may touch.
    fn touching<'a>(
        &'a self,
        e: usize,
        at: &'a Configuration<'_>,
        middle: &Vec3,
    ) -> impl Iterator<Item = usize> + 'a {
        let moved = (middle - self.middle(e, at.x0)).norm();
        self.clearance.touching(e, moved)
    }

    /// Stiffness and depth below half the thickness.
    fn depth(&self, e: usize, b: usize, at: &Configuration<'_>, distance: f64) -> (f64, f64) {
        let contact = at.world.bodies.contact(b);
        (
            contact.stiffness * self.areas[e],
            0.5 * contact.thickness - distance,
        )
    }
}

fn middle(vertices: &[u32], e: usize, x: &[Vec3]) -> Vec3 {
    0.5 * (x[vertices[2 * e] as usize] + x[vertices[2 * e + 1] as usize])
}

impl Term for EdgeContact {
    fn name(&self) -> &'static str {
        "edge_contact"
    }

    fn is_internal(&self) -> bool {
        false
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 2,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.areas[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let m = self.middle(e, at.x);
        self.touching(e, at, &m)
            .map(|b| {
                let (k, depth) = self.depth(e, b, at, at.world.bodies.value(b, &m));
                0.5 * k * depth.max(0.0).powi(2)
            })
            .sum()
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let m = self.middle(e, at.x);
        let mut g = Vec3::zeros();
        for b in self.touching(e, at, &m) {
            let d = at.world.bodies.distance(b, &m);
            let (k, depth) = self.depth(e, b, at, d.value);
            g -= d.gradient * (k * depth.max(0.0));
        }
        out.fill(0.5 * g);
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let m = self.middle(e, at.x);
        let mut h = Mat3::zeros();
        for b in self.touching(e, at, &m) {
            let d = at.world.bodies.distance(b, &m);
            let (k, depth) = self.depth(e, b, at, d.value);
            if depth > 0.0 {
                h += d.gradient * d.gradient.transpose() * k;
                let exactness = kind.exactness();
                if exactness > 0.0 {
                    h -= d.hessian * (k * depth * exactness);
                }
            }
        }
        out.fill(0.25 * h);
    }

    fn begin_step(&mut self, _: &State, at: &Configuration<'_>) -> bool {
        let vertices = &self.vertices;
        let middles = (0..self.areas.len()).map(|e| middle(vertices, e, at.x0));
        self.clearance
            .update(at.world.bodies, middles, |_, contact| {
                0.5 * contact.thickness
            });
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
        for e in 0..self.areas.len() {
            let m = self.middle(e, at.x);
            if self.touching(e, at, &m).any(|b| b == body) {
                let d = at.world.bodies.distance(body, &m);
                let (k, depth) = self.depth(e, body, at, d.value);
                let f = -d.gradient * (k * depth.max(0.0));
                *force += f;
                *torque += (m - origin).cross(&f);
            }
        }
    }
}
