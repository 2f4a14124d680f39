//! Weight of a segment: `V = -rho du g . (x0 + x1)/2` with the mass per length `rho` [kg/m] (Cirio et al. 2014).
//!
//! Material that slides takes its weight along, `dV/du1 = -rho g . (x0 + x1)/2`. The Hessian has only mixed
//! blocks of positions and material coordinates; they are indefinite and `Psd` has none. SI units.

use super::kernel::{Kernel, Local, Lower, point, set_point};
use crate::math::Vec3;

/// Weight of one segment; scalars `(x0, x1, u0, u1)`.
pub struct Weight {
    /// Mass per length [kg/m].
    pub density: f64,
}

impl Weight {
    fn middle(q: &[f64; 8]) -> Vec3 {
        (point(q, 0) + point(q, 1)) * 0.5
    }
}

impl Kernel<8> for Weight {
    const NAME: &'static str = "yarn_gravity";
    const POSITIONS: usize = 2;
    const LINEAR: bool = true;
    const INTERNAL: bool = false;

    fn value(&self, at: &Local<'_, 8>) -> f64 {
        -self.density * (at.q[7] - at.q[6]) * at.gravity.dot(&Self::middle(at.q))
    }

    fn gradient(&self, at: &Local<'_, 8>, out: &mut [f64; 8]) {
        let half = at.gravity * (-0.5 * self.density * (at.q[7] - at.q[6]));
        set_point(out, 0, &half);
        set_point(out, 1, &half);
        out[6] = self.density * at.gravity.dot(&Self::middle(at.q));
        out[7] = -out[6];
    }

    fn derivatives(
        &self,
        at: &Local<'_, 8>,
        exactness: f64,
        gradient: &mut [f64; 8],
        out: &mut Lower<8>,
    ) {
        self.gradient(at, gradient);
        let half = at.gravity * (0.5 * self.density * exactness);
        for c in 0..6 {
            out[6][c] = half[c % 3];
            out[7][c] = -half[c % 3];
        }
    }
}
