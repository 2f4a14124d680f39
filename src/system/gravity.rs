//! Gravity: `V = -rho A/3 sum_i g . x_i` over triangles of rest area `A`, the same forces as lumped
//! masses. Per triangle rather than per vertex, so that the derivative by the rest shape and the
//! density has the triangle's stencil. No Hessian. SI units.

use super::term::{Configuration, HessianKind, RestChange, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::geometry::cross2;
use crate::math::{Mat3, Vec2, Vec3};

/// The weight of every triangle.
pub struct Gravity {
    vertices: Vec<u32>,
    elements: Vec<Element>,
}

struct Element {
    density: f64,
    area: f64,
    fabric: usize,
    /// Flat edges from the first vertex [m].
    edges: [Vec2; 2],
}

impl Gravity {
    /// Weight of a cloth.
    pub fn new(cloth: &Cloth) -> Self {
        let mesh = &cloth.mesh;
        let elements = mesh
            .triangles
            .iter()
            .enumerate()
            .map(|(t, tri)| {
                let [a, b, c] = tri.map(|v| mesh.uv[v as usize]);
                Element {
                    density: cloth.densities[t],
                    area: cloth.areas[t],
                    fabric: cloth.panel_fabric[mesh.triangle_panel[t] as usize],
                    edges: [b - a, c - a],
                }
            })
            .collect();
        Self {
            vertices: mesh.triangles.iter().flatten().copied().collect(),
            elements,
        }
    }
}

impl Term for Gravity {
    fn name(&self) -> &'static str {
        "gravity"
    }

    fn has_hessian(&self, _: HessianKind) -> bool {
        false
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 3,
            vertices: &self.vertices,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.vertices[..]) + size_of_val(&self.elements[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let element = &self.elements[e];
        let v = &self.vertices[3 * e..3 * e + 3];
        let sum: Vec3 = v.iter().map(|&v| at.x[v as usize]).sum();
        -element.density * element.area / 3.0 * at.world.gravity.dot(&sum)
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let element = &self.elements[e];
        out.fill(at.world.gravity * (-element.density * element.area / 3.0));
    }

    fn hessian(&self, _: usize, _: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        out.fill(Mat3::zeros());
    }

    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let element = &self.elements[e];
        let v = &self.vertices[3 * e..3 * e + 3];
        let [p, q] = element.edges;
        let dp = change.uv[v[1] as usize] - change.uv[v[0] as usize];
        let dq = change.uv[v[2] as usize] - change.uv[v[0] as usize];
        let darea = 0.5 * cross2(&p, &q).signum() * (cross2(&dp, &q) + cross2(&p, &dq));
        let dmass = change.fabrics[element.fabric].density * element.area + element.density * darea;
        out.fill(at.world.gravity * (-dmass / 3.0));
    }

    fn is_internal(&self) -> bool {
        false
    }
}
