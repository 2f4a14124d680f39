//! Ties of nodes to points of other yarns' segments: `V = k/2 |x - (1 - t) a - t b|^2`.
//!
//! A spring without length, `k` the stiffness per length of seam times the length that the tie stands for; it
//! holds yarn ends at the rod of a seam. Quadratic, so that `Psd` and `Exact` agree. Not damped. SI units.

use super::kernel::{Kernel, Local, Lower, add_weighted, point, set_point};
use crate::math::{Mat3, Vec3};

/// One tie; scalars `(node, a, b)`.
pub struct TieSpring {
    /// Stiffness [N/m].
    pub stiffness: f64,
    /// Position on the segment, 0 at `a`, 1 at `b`.
    pub t: f64,
}

impl TieSpring {
    fn weights(&self) -> [f64; 3] {
        [1.0, self.t - 1.0, -self.t]
    }

    fn gap(&self, q: &[f64; 9]) -> Vec3 {
        let w = self.weights();
        point(q, 0) + point(q, 1) * w[1] + point(q, 2) * w[2]
    }
}

impl Kernel<9> for TieSpring {
    const NAME: &'static str = "yarn_tie";
    const POSITIONS: usize = 3;

    fn value(&self, at: &Local<'_, 9>) -> f64 {
        0.5 * self.stiffness * self.gap(at.q).norm_squared()
    }

    fn gradient(&self, at: &Local<'_, 9>, out: &mut [f64; 9]) {
        let force = self.gap(at.q) * self.stiffness;
        for (p, w) in self.weights().into_iter().enumerate() {
            set_point(out, p, &(force * w));
        }
    }

    fn derivatives(&self, at: &Local<'_, 9>, _: f64, gradient: &mut [f64; 9], out: &mut Lower<9>) {
        self.gradient(at, gradient);
        let k = Mat3::from_diagonal_element(self.stiffness);
        add_weighted(out, &self.weights(), &k);
    }
}
