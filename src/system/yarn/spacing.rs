//! Least length of yarn between two neighbouring crossings: `V = k_c/2 L (du - d)^2` where `du < d` (Cirio
//! et al. 2014, contact between adjacent parallel yarns).
//!
//! Acts on material coordinates alone; `L` is the length at rest. Damping acts on `min(du - d, 0)`, which is continuous
//! where contact begins. `Psd` and `Exact` agree, but for the kink of the damping at `du = d`. SI units; `k_c` in N/m^2.

use super::kernel::{Kernel, Local, Lower};

/// Least length of one segment; scalars `(u0, u1)`.
pub struct Spacing {
    /// `k_c L` [N/m].
    pub stiffness: f64,
    /// Least length `d` [m].
    pub least: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

impl Spacing {
    /// How far the length falls short (negative), now and since the start of the step.
    fn gap(&self, at: &Local<'_, 2>) -> (f64, f64) {
        let gap = |q: &[f64; 2]| (q[1] - q[0] - self.least).min(0.0);
        let now = gap(at.q);
        (now, now - gap(at.q0))
    }
}

impl Kernel<2> for Spacing {
    const NAME: &'static str = "yarn_spacing";
    const POSITIONS: usize = 0;

    fn value(&self, at: &Local<'_, 2>) -> f64 {
        let (now, since) = self.gap(at);
        0.5 * self.stiffness * (now * now + self.damping * at.inv_dt * since * since)
    }

    fn gradient(&self, at: &Local<'_, 2>, out: &mut [f64; 2]) {
        let (now, since) = self.gap(at);
        let force = if now < 0.0 {
            self.stiffness * (now + self.damping * at.inv_dt * since)
        } else {
            0.0
        };
        *out = [-force, force];
    }

    fn hessian(&self, at: &Local<'_, 2>, _: f64, out: &mut Lower<2>) {
        if self.gap(at).0 < 0.0 {
            let k = self.stiffness * (1.0 + self.damping * at.inv_dt);
            out[0][0] = k;
            out[1][0] = -k;
            out[1][1] = k;
        }
    }
}
