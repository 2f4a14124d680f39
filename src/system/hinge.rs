//! Bending by dihedral angles with a rest angle, summed over the fan of each vertex.
//!
//! With the operator of [`bending_fan`](super::bending_fan) and the angles `theta_e` of the hinges
//! at a vertex (discrete shells, Grinspun et al. 2003; angles by `atan2`, never `acos`)
//!
//! ```text
//! r = sum_e c_e (theta_e - theta0_e),   V = 1/2 r . W r,   c_e = l_e/2 (n1^2, sqrt2 n1 n2, n2^2)
//! ```
//!
//! The angles `theta0_e = q_e . kappa0` are those of a surface with the fabric's curvature at rest; they may be beyond a half turn,
//! and are then a moment that the cloth cannot follow. `Psd` is the Gauss-Newton part `J^T W J`, `J = sum_e c_e dtheta_e/dx`; `Exact` adds
//! `sum_e (c_e . W r) d^2 theta_e / dx^2`. Damping replaces `r` by the change of `r` since the
//! start of the step, times `beta/dt`; rigid motion is not damped. SI units. Limits: an angle jumps
//! by a full turn where two triangles fold through each other; below 1e-4 of its rest size a
//! triangle counts as degenerate and the derivatives are bounded, no longer exact.

use super::bending_fan::{FanGroup, FanRest, MAX_HINGES, fan_groups};
use super::term::{Configuration, HessianKind, MAX_ARITY, RestChange, Stencils, Term};
use crate::cloth::Cloth;
use crate::math::geometry::{dihedral, dihedral_gradient, dihedral_hessian, wrap_angle};
use crate::math::{Mat3, Vec3};
use crate::pattern::BendingModel;

/// Bending of all vertices with the same number of neighbours.
pub struct Hinge {
    group: FanGroup,
}

#[inline]
fn gather(fan: &FanRest, k: usize, vertices: &[u32], x: &[Vec3]) -> ([usize; 4], [Vec3; 4]) {
    let local = fan.local_hinge(k);
    let at = |i: usize| x[vertices[local[i]] as usize];
    (local, [at(0), at(1), at(2), at(3)])
}

impl Hinge {
    /// Bending of all panels with a fabric of [`BendingModel::Hinge`]: one term for each number of neighbours that occurs.
    pub fn terms(cloth: &Cloth) -> Vec<Self> {
        fan_groups(cloth, BendingModel::Hinge)
            .into_iter()
            .map(|group| Self { group })
            .collect()
    }

    fn vertices(&self, e: usize) -> &[u32] {
        &self.group.vertices[self.group.arity * e..][..self.group.arity]
    }

    /// Bend `r` from the rest angles, and its change since the start of the step.
    fn bend(&self, e: usize, at: &Configuration<'_>, weights: &[Vec3], rate: bool) -> (Vec3, Vec3) {
        let (fan, vertices) = (&self.group.fans[e], self.vertices(e));
        let (mut now, mut since) = (Vec3::zeros(), Vec3::zeros());
        for (k, c) in weights.iter().enumerate() {
            let angle = dihedral(&gather(fan, k, vertices, at.x).1);
            now += c * (angle - fan.rest_angle(k));
            if rate {
                let before = dihedral(&gather(fan, k, vertices, at.x0).1);
                since += c * wrap_angle(angle - before);
            }
        }
        (now, since)
    }

    /// The derivative of the energy by `r`.
    fn moment(&self, e: usize, at: &Configuration<'_>) -> Vec3 {
        let fan = &self.group.fans[e];
        let rate = fan.damping * at.inv_dt;
        let (now, since) = self.bend(e, at, &fan.measure.weights, rate > 0.0);
        fan.stiffness * (now + since * rate)
    }

    /// `out = sum_e factor_e dtheta_e/dx`.
    fn spread(
        &self,
        e: usize,
        at: &Configuration<'_>,
        factor: impl Fn(usize) -> f64,
        out: &mut [Vec3],
    ) {
        let (fan, vertices) = (&self.group.fans[e], self.vertices(e));
        out.fill(Vec3::zeros());
        for k in 0..fan.hinge_count() {
            let (local, x) = gather(fan, k, vertices, at.x);
            let f = factor(k);
            for (i, g) in local.into_iter().zip(dihedral_gradient(&x, fan.floor)) {
                out[i] += g * f;
            }
        }
    }
}

/// Derivatives of the angles of a fan's hinges by their four vertices [1/m].
type AngleGradients = [[Vec3; 4]; MAX_HINGES];

impl Hinge {
    fn angle_gradients(&self, e: usize, at: &Configuration<'_>) -> AngleGradients {
        let (fan, vertices) = (&self.group.fans[e], self.vertices(e));
        let mut out = [[Vec3::zeros(); 4]; MAX_HINGES];
        for (k, angle) in out.iter_mut().enumerate().take(fan.hinge_count()) {
            *angle = dihedral_gradient(&gather(fan, k, vertices, at.x).1, fan.floor);
        }
        out
    }

    /// Hessian of fan `e` with the derivative `moment` of its energy by `r`.
    fn curvature(
        &self,
        e: usize,
        at: &Configuration<'_>,
        kind: HessianKind,
        angles: &AngleGradients,
        moment: &Vec3,
        out: &mut [Mat3],
    ) {
        let (fan, vertices) = (&self.group.fans[e], self.vertices(e));
        let arity = self.group.arity;
        let weights = &fan.measure.weights;
        // rows: components of r
        let mut b = [Mat3::zeros(); MAX_ARITY];
        for (k, weight) in weights.iter().enumerate() {
            for (i, g) in fan.local_hinge(k).into_iter().zip(&angles[k]) {
                b[i] += weight * g.transpose();
            }
        }
        let d = fan.stiffness * (1.0 + fan.damping * at.inv_dt);
        for i in 0..arity {
            let left = b[i].transpose() * d;
            for j in 0..=i {
                out[i * (i + 1) / 2 + j] = left * b[j];
            }
        }
        let exactness = kind.exactness();
        if exactness == 0.0 {
            return;
        }
        let moment = moment * exactness;
        for (k, weight) in weights.iter().enumerate() {
            let (local, x) = gather(fan, k, vertices, at.x);
            let f = weight.dot(&moment);
            let h = dihedral_hessian(&x, fan.floor);
            for (p, &i) in local.iter().enumerate() {
                for (q, &j) in local.iter().enumerate() {
                    if j <= i {
                        out[i * (i + 1) / 2 + j] += h[p][q] * f;
                    }
                }
            }
        }
    }
}

impl Term for Hinge {
    fn name(&self) -> &'static str {
        "hinge"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: self.group.arity,
            vertices: &self.group.vertices,
        }
    }

    fn bytes(&self) -> usize {
        self.group.bytes()
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let fan = &self.group.fans[e];
        let rate = fan.damping * at.inv_dt;
        let (now, since) = self.bend(e, at, &fan.measure.weights, rate > 0.0);
        let quadratic = |r: &Vec3| r.dot(&(fan.stiffness * r));
        0.5 * (quadratic(&now) + rate * quadratic(&since))
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let moment = self.moment(e, at);
        let weights = &self.group.fans[e].measure.weights;
        self.spread(e, at, |k| weights[k].dot(&moment), out);
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let moment = if kind.exactness() > 0.0 {
            self.moment(e, at)
        } else {
            Vec3::zeros()
        };
        self.curvature(e, at, kind, &self.angle_gradients(e, at), &moment, out);
    }

    fn derivatives(
        &self,
        e: usize,
        at: &Configuration<'_>,
        kind: HessianKind,
        gradient: &mut [Vec3],
        hessian: &mut [Mat3],
    ) {
        let moment = self.moment(e, at);
        let angles = self.angle_gradients(e, at);
        let fan = &self.group.fans[e];
        gradient.fill(Vec3::zeros());
        for (k, angle) in angles.iter().enumerate().take(fan.hinge_count()) {
            let f = fan.measure.weights[k].dot(&moment);
            for (i, g) in fan.local_hinge(k).into_iter().zip(angle) {
                gradient[i] += g * f;
            }
        }
        self.curvature(e, at, kind, &angles, &moment, hessian);
    }

    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let (fan, vertices) = (&self.group.fans[e], self.vertices(e));
        let fabric = &change.fabrics[fan.fabric];
        let (rates, dstiffness) = fan.rates(vertices, change);
        let (rate, drate) = (
            fan.damping * at.inv_dt,
            fabric.damping_stiffness * at.inv_dt,
        );
        let damped = rate > 0.0 || drate != 0.0;
        let (now, since) = self.bend(e, at, &fan.measure.weights, damped);
        let (mut dnow, dsince) = self.bend(e, at, &rates.weights, damped);
        for (k, c) in fan.measure.weights.iter().enumerate() {
            dnow -= c * fan.rest_angle_rate(k, &rates, fabric);
        }
        let (total, dtotal) = (now + since * rate, dnow + dsince * rate + since * drate);
        let moment = fan.stiffness * total;
        let dmoment = dstiffness * total + fan.stiffness * dtotal;
        self.spread(
            e,
            at,
            |k| fan.measure.weights[k].dot(&dmoment) + rates.weights[k].dot(&moment),
            out,
        );
    }
}
