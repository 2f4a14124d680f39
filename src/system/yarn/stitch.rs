//! Length of yarn inside of a stitch contact: `V = k_l/2 L (l/L - 1)^2`, `l = u1 - u0` (Cirio et al. 2017,
//! equation 6).
//!
//! Acts on material coordinates alone: where one node of the contact slides the other follows. Quadratic, so that
//! `Psd` and `Exact` agree. Damping acts on `l/L`. SI units; `k_l` in N.

use super::kernel::{Kernel, Local, Lower};

/// Length of one yarn between the nodes of a contact; scalars `(u0, u1)`.
pub struct StitchLength {
    /// `k_l` [N].
    pub stiffness: f64,
    /// Length at rest [m].
    pub length: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

impl Kernel<2> for StitchLength {
    const NAME: &'static str = "stitch_length";
    const POSITIONS: usize = 0;
    const LOOKS_BACK: bool = true;

    fn value(&self, at: &Local<'_, 2>) -> f64 {
        let l = at.q[1] - at.q[0];
        let strain = l / self.length - 1.0;
        let since = (l - (at.q0[1] - at.q0[0])) / self.length;
        let rate = self.damping * at.inv_dt;
        0.5 * self.stiffness * self.length * (strain * strain + rate * since * since)
    }

    fn gradient(&self, at: &Local<'_, 2>, out: &mut [f64; 2]) {
        let l = at.q[1] - at.q[0];
        let strain = l / self.length - 1.0;
        let since = (l - (at.q0[1] - at.q0[0])) / self.length;
        let force = self.stiffness * (strain + self.damping * at.inv_dt * since);
        *out = [-force, force];
    }

    fn derivatives(&self, at: &Local<'_, 2>, _: f64, gradient: &mut [f64; 2], out: &mut Lower<2>) {
        self.gradient(at, gradient);
        let k = self.stiffness / self.length * (1.0 + self.damping * at.inv_dt);
        out[0][0] = k;
        out[1][0] = -k;
        out[1][1] = k;
    }
}
