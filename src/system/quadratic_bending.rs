//! Quadratic (isometric) bending: a constant, positive semi-definite Hessian.
//!
//! The operator of [`bending_fan`](super::bending_fan) with the slope jumps of the flat mesh instead
//! of angles, applied to the three coordinates of the surface (the idea of Bergou et al. 2006):
//! `R = sum_j b_j x_j^T` (3 moment components x 3 coordinates), `b_j = sum_e c_e w_ej` with the weights
//! `w` of [`jump`](crate::math::geometry::jump), and
//!
//! ```text
//! V = 1/2 tr(R^T W R) = 1/2 sum_ij K_ij x_i . x_j,   K_ij = b_i . W b_j
//! ```
//!
//! For isometric deformation the rows of `R` are along the normal and their lengths the bend, so that a cylinder costs what the
//! material says, orthotropic fabrics included. Flat rest shape only. Damping is `beta/(2 dt)` of the
//! same form in `x - x0`: the Hessian stays constant, at the price of a small drag on the rotation of
//! curved cloth (of the order of beta times the bending force). SI units.

use super::bending_fan::{FanGroup, fan_groups};
use super::term::{Configuration, HessianKind, RestChange, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::{Mat3, Vec3};
use crate::pattern::BendingModel;

/// Quadratic bending of all vertices with the same number of neighbours.
pub struct QuadraticBending {
    group: FanGroup,
    /// Lower triangle of `K` of each fan, row by row [N/m].
    stiffness: Vec<f64>,
}

fn blocks(arity: usize) -> usize {
    arity * (arity + 1) / 2
}

impl QuadraticBending {
    /// Bending of all panels with a fabric of [`BendingModel::Quadratic`]: one term for each number
    /// of neighbours that occurs.
    pub fn terms(cloth: &Cloth) -> Vec<Self> {
        fan_groups(cloth, BendingModel::Quadratic)
            .into_iter()
            .map(|group| {
                let mut stiffness = Vec::with_capacity(blocks(group.arity) * group.fans.len());
                for fan in &group.fans {
                    let b = &fan.measure.operator;
                    for i in 0..b.len() {
                        for j in 0..=i {
                            stiffness.push(b[i].dot(&(fan.stiffness * b[j])));
                        }
                    }
                }
                Self { group, stiffness }
            })
            .collect()
    }

    fn stiffness(&self, e: usize) -> &[f64] {
        let n = blocks(self.group.arity);
        &self.stiffness[n * e..][..n]
    }

    /// `R` of the field `y`, relative to the centre so that it does not cancel far from the origin.
    fn bend(&self, e: usize, y: impl Fn(usize) -> Vec3) -> Mat3 {
        let v = self.vertices(e);
        let origin = y(v[0] as usize);
        let mut r = Mat3::zeros();
        for (b, &v) in self.group.fans[e].measure.operator.iter().zip(v).skip(1) {
            r += b * (y(v as usize) - origin).transpose();
        }
        r
    }

    fn vertices(&self, e: usize) -> &[u32] {
        &self.group.vertices[self.group.arity * e..][..self.group.arity]
    }
}

impl Term for QuadraticBending {
    fn name(&self) -> &'static str {
        "quadratic_bending"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: self.group.arity,
            vertices: &self.group.vertices,
        }
    }

    fn bytes(&self) -> usize {
        self.group.bytes() + size_of_val(&self.stiffness[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let fan = &self.group.fans[e];
        let energy = |r: &Mat3| 0.5 * r.dot(&(fan.stiffness * r));
        let rate = fan.damping * at.inv_dt;
        let mut sum = energy(&self.bend(e, |v| at.x[v]));
        if rate > 0.0 {
            sum += rate * energy(&self.bend(e, |v| at.x[v] - at.x0[v]));
        }
        sum
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let fan = &self.group.fans[e];
        let rate = fan.damping * at.inv_dt;
        let mut r = self.bend(e, |v| at.x[v]);
        if rate > 0.0 {
            r += self.bend(e, |v| at.x[v] - at.x0[v]) * rate;
        }
        let moment = fan.stiffness * r;
        for (o, b) in out.iter_mut().zip(&fan.measure.operator) {
            *o = moment.tr_mul(b);
        }
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        let scale = 1.0 + self.group.fans[e].damping * at.inv_dt;
        for (o, k) in out.iter_mut().zip(self.stiffness(e)) {
            *o = Mat3::from_diagonal_element(k * scale);
        }
    }

    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let (fan, v) = (&self.group.fans[e], self.vertices(e));
        let fabric = &change.fabrics[fan.fabric];
        let (rates, dw) = fan.rates(v, change);
        let (b, db) = (&fan.measure.operator, &rates.operator);
        let rate = fan.damping * at.inv_dt;
        let drate = fabric.damping_stiffness * at.inv_dt;
        // R and its rate, one column for each coordinate; with damping of the argument below
        let y = |i: usize| {
            let (x, x0) = (at.x[v[i] as usize], at.x0[v[i] as usize]);
            (x - at.x[v[0] as usize]) + (x - x0) * rate
        };
        let dy = |i: usize| (at.x[v[i] as usize] - at.x0[v[i] as usize]) * drate;
        let (mut r, mut dr) = (Mat3::zeros(), Mat3::zeros());
        for i in 0..v.len() {
            r += b[i] * y(i).transpose();
            dr += db[i] * y(i).transpose() + b[i] * dy(i).transpose();
        }
        let (moment, dmoment) = (fan.stiffness * r, dw * r + fan.stiffness * dr);
        for i in 0..v.len() {
            out[i] = moment.tr_mul(&db[i]) + dmoment.tr_mul(&b[i]);
        }
    }
}
