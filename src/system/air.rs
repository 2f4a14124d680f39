//! Wind and air resistance: drag along the normal and friction along the surface of each triangle.
//!
//! With the velocity `v` of the centroid relative to the air, its normal part `v_n` and tangential
//! part `v_t`, and the area `A` and normal of the triangle at the start of the step, the force is
//! `-A (normal |v_n| v_n + tangent |v_t| v_t)`: quadratic in the speed, `normal` of the order of half
//! the density of air times the drag coefficient of a plate (0.6 kg/m^3 times 1 to 2). The normal
//! part is drag and lift in one: for cloth at an angle to the stream it is not parallel to it. As
//! a lagged dissipation potential `dt A/3 (normal |v_n|^3 + tangent |v_t|^3)`, convex in `x`, so that the
//! Hessian is exact and positive. In statics the wind exerts the constant force of air that moves
//! past resting cloth of the shape `x0`. SI units. No shielding of one layer by another.

use super::term::{Configuration, HessianKind, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::{Mat3, Vec3};

/// Air on every triangle.
pub struct Air {
    vertices: Vec<u32>,
    /// Part of each triangle that is its own.
    own: Vec<f64>,
    normal: f64,
    tangent: f64,
}

/// What is lagged, and the velocity relative to the air split by it.
struct Flow {
    area: f64,
    normal: Vec3,
    along_normal: f64,
    tangential: Vec3,
}

impl Air {
    /// Air on a cloth with the coefficients `normal` and `tangent` [kg/m^3].
    pub fn new(cloth: &Cloth, normal: f64, tangent: f64) -> Self {
        Self {
            vertices: cloth.mesh.triangles.iter().flatten().copied().collect(),
            own: cloth.own.clone(),
            normal,
            tangent,
        }
    }

    fn flow(&self, e: usize, at: &Configuration<'_>) -> Option<Flow> {
        let v = [0, 1, 2].map(|k| self.vertices[3 * e + k] as usize);
        let twice = (at.x0[v[1]] - at.x0[v[0]]).cross(&(at.x0[v[2]] - at.x0[v[0]]));
        let length = twice.norm();
        if length <= f64::MIN_POSITIVE {
            return None;
        }
        let normal = twice / length;
        let moved: Vec3 = v.iter().map(|&v| at.x[v] - at.x0[v]).sum();
        let velocity = moved * (at.inv_dt / 3.0) - at.world.wind;
        let along_normal = velocity.dot(&normal);
        Some(Flow {
            area: 0.5 * length * self.own[e],
            normal,
            along_normal,
            tangential: velocity - normal * along_normal,
        })
    }

    /// Derivative of the potential by the displacement of the centroid.
    fn resistance(&self, f: &Flow) -> Vec3 {
        (f.normal * (self.normal * f.along_normal.abs() * f.along_normal)
            + f.tangential * (self.tangent * f.tangential.norm()))
            * f.area
    }
}

impl Term for Air {
    fn name(&self) -> &'static str {
        "air"
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
        let Some(f) = self.flow(e, at) else {
            return 0.0;
        };
        if at.inv_dt > 0.0 {
            let cubes = self.normal * f.along_normal.abs().powi(3)
                + self.tangent * f.tangential.norm().powi(3);
            return f.area * cubes / (3.0 * at.inv_dt);
        }
        let moved: Vec3 = self.vertices[3 * e..3 * e + 3]
            .iter()
            .map(|&v| at.x[v as usize] - at.x0[v as usize])
            .sum();
        self.resistance(&f).dot(&moved) / 3.0
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let third = self
            .flow(e, at)
            .map_or_else(Vec3::zeros, |f| self.resistance(&f) / 3.0);
        out.fill(third);
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        let block = self.flow(e, at).map_or_else(Mat3::zeros, |f| {
            let nn = f.normal * f.normal.transpose();
            let speed = f.tangential.norm();
            let mut h = nn * (2.0 * self.normal * f.along_normal.abs());
            if speed > f64::MIN_POSITIVE {
                h += ((Mat3::identity() - nn) * speed
                    + f.tangential * f.tangential.transpose() / speed)
                    * self.tangent;
            }
            h * (f.area * at.inv_dt / 9.0)
        });
        out.fill(block);
    }

    fn is_idle(&self, at: &Configuration<'_>) -> bool {
        at.inv_dt == 0.0 && at.world.wind == Vec3::zeros()
    }

    fn is_internal(&self) -> bool {
        false
    }
}
