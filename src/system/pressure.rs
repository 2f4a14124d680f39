//! Pressure along the cloth's normal: `V = -p a0 . (x_0 + x_1 + x_2) / 3` with the area vector `a0` of
//! the triangle at the start of the step.
//!
//! The force on a triangle is `p a`, a third on each vertex, whatever the surface. It has a
//! potential (`-p` times the volume) only for closed surfaces; garments are open, and the energy
//! `-p/6 x_0 . (x_1 x x_2)` would put forces on their borders that depend on the origin. The normal is
//! therefore lagged by one step, which is exact where steps repeat until nothing moves. SI units.

use super::term::{Configuration, HessianKind, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::{Mat3, Vec3};

/// Pressure of the inside on the outside on every triangle.
pub struct Pressure {
    vertices: Vec<u32>,
    /// Part of each triangle that is its own.
    own: Vec<f64>,
}

impl Pressure {
    /// Pressure on a cloth; its size is the world's.
    pub fn new(cloth: &Cloth) -> Self {
        Self {
            vertices: cloth.mesh.triangles.iter().flatten().copied().collect(),
            own: cloth.own.clone(),
        }
    }

    /// Force on each vertex of a triangle.
    fn force(&self, e: usize, at: &Configuration<'_>) -> Vec3 {
        let [a, b, c] = [0, 1, 2].map(|k| at.x0[self.vertices[3 * e + k] as usize]);
        (b - a).cross(&(c - a)) * (at.world.pressure * self.own[e] / 6.0)
    }
}

impl Term for Pressure {
    fn name(&self) -> &'static str {
        "pressure"
    }

    fn is_idle(&self, at: &Configuration<'_>) -> bool {
        at.world.pressure == 0.0
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
        size_of_val(&self.vertices[..]) + size_of_val(&self.own[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let moved: Vec3 = self.vertices[3 * e..3 * e + 3]
            .iter()
            .map(|&v| at.x[v as usize] - at.x0[v as usize])
            .sum();
        -self.force(e, at).dot(&moved)
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        out.fill(-self.force(e, at));
    }

    fn hessian(&self, _: usize, _: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        out.fill(Mat3::zeros());
    }

    fn is_internal(&self) -> bool {
        false
    }
}
