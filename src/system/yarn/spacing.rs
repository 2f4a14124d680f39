//! Least length of yarn between two neighbouring crossings: `V = k_c L R(d - du)` where `du < d` (Cirio et al. 2014,
//! contact between adjacent parallel yarns).
//!
//! Acts on material coordinates alone; `L` is the length at rest. Fibres pack before they resist (van Wyk 1946): the
//! stiffness grows from zero over a quarter of `d` to `k_c L`, `R''(t) = t/w` up to `w = d/4` and 1 beyond, so that
//! there is no kink where contact begins. Fibres do not vanish: below `h = d/4` a barrier keeps two crossings from becoming one point,
//! at which yarn has no direction,
//!
//! ```text
//! V = k_c L h^2/3 (1 - s)^3/s,   s = du/h < 1
//! ```
//!
//! Where contacts may come off, which they do in time alone and not at
//! pins, `d` is smaller in time than in relaxations. Damping acts on `min(du - d, 0)`. `Psd` and `Exact` agree, but
//! for the kink of the damping at `du = d`. SI units; `k_c` in N/m^2.

use super::super::state::State;
use super::angle::Jam;
use super::kernel::{Kernel, Local, Lower};

/// Part of the least length over which the stiffness grows.
const SOFT: f64 = 0.25;

/// Part of the least length below which the barrier acts.
const BARRIER: f64 = 0.25;
/// Part of that below which the barrier's derivatives grow no more.
const FLOOR: f64 = 1e-6;

/// Least length of one segment; scalars `(u0, u1)`.
pub struct Spacing {
    /// `k_c L` [N/m].
    pub stiffness: f64,
    /// Least length `d` [m].
    pub least: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
    /// Least length in steps in time [m], smaller where one contact may pass the other.
    pub least_in_time: f64,
    /// Nodes at both ends.
    pub nodes: [u32; 2],
    /// Whether one of them is pinned: nothing passes there.
    pub held: bool,
}

impl Spacing {
    fn least(&self, at: &Local<'_, 2>) -> f64 {
        if at.inv_dt > 0.0 && !self.held {
            self.least_in_time
        } else {
            self.least
        }
    }

    /// How far the length falls short (negative), now and since the start of the step.
    fn gap(&self, at: &Local<'_, 2>) -> (f64, f64) {
        let least = self.least(at);
        let gap = |q: &[f64; 2]| (q[1] - q[0] - least).min(0.0);
        let now = gap(at.q);
        (now, now - gap(at.q0))
    }

    /// Energy over `k_c L` and its derivatives by the gap, below zero.
    fn packing(&self, at: &Local<'_, 2>, gap: f64) -> [f64; 3] {
        let least = self.least(at);
        let jam = Jam {
            factor: 2.0,
            from: 0.0,
            width: SOFT * least,
        };
        let [energy, slope, curvature] = jam.at(-gap);
        let mut out = [energy, -slope, curvature];
        let reach = BARRIER * least;
        let s = (least + gap) / reach;
        if s < 1.0 {
            let (value, s) = if s > 0.0 {
                ((1.0 - s).powi(3) / s, s.max(FLOOR))
            } else {
                (f64::INFINITY, FLOOR)
            };
            out[0] += reach * reach / 3.0 * value;
            out[1] -= reach / 3.0 * (1.0 / (s * s) - 3.0 + 2.0 * s);
            out[2] += 2.0 / 3.0 * (1.0 / (s * s * s) - 1.0);
        }
        out
    }
}

impl Kernel<2> for Spacing {
    const NAME: &'static str = "yarn_spacing";
    const POSITIONS: usize = 0;
    const LOOKS_BACK: bool = true;
    const LAGGED: bool = true;

    fn value(&self, at: &Local<'_, 2>) -> f64 {
        let (now, since) = self.gap(at);
        let rate = self.damping * at.inv_dt;
        self.stiffness * (self.packing(at, now)[0] + 0.5 * rate * since * since)
    }

    fn gradient(&self, at: &Local<'_, 2>, out: &mut [f64; 2]) {
        let (now, since) = self.gap(at);
        let force = if now < 0.0 {
            self.stiffness * (self.damping * at.inv_dt * since + self.packing(at, now)[1])
        } else {
            0.0
        };
        *out = [-force, force];
    }

    fn derivatives(&self, at: &Local<'_, 2>, _: f64, gradient: &mut [f64; 2], out: &mut Lower<2>) {
        self.gradient(at, gradient);
        let now = self.gap(at).0;
        if now < 0.0 {
            let k = self.stiffness * (self.packing(at, now)[2] + self.damping * at.inv_dt);
            out[0][0] = k;
            out[1][0] = -k;
            out[1][1] = k;
        }
    }

    fn begin(&mut self, _: &Local<'_, 2>, _: &[f64; 2], state: &State) {
        if self.least_in_time < self.least {
            let first = (state.positions.len() - state.yarn_normals.len()) as u32;
            let pinned = |node: u32| {
                let point = first + node;
                state
                    .pins
                    .binary_search_by_key(&point, |p| p.vertex)
                    .is_ok()
            };
            self.held = self.nodes.into_iter().any(pinned);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::kernel::Damped;
    use super::*;
    use crate::math::Vec3;

    #[test]
    fn the_barrier_has_its_derivatives_and_no_end() {
        let spacing = Spacing {
            stiffness: 300.0,
            least: 1e-3,
            damping: 0.0,
            least_in_time: 1e-3,
            nodes: [0, 1],
            held: false,
        };
        let q0 = [0.0; 2];
        let at = |q: &[f64; 2], f: &mut dyn FnMut(&Local<'_, 2>)| {
            f(&Local {
                q,
                q0: &q0,
                start: Damped::default(),
                inv_dt: 0.0,
                gravity: Vec3::zeros(),
            });
        };
        let derivatives = |du: f64| {
            let (mut value, mut gradient, mut hessian) = (0.0, [0.0; 2], [[0.0; 2]; 2]);
            at(&[0.0, du], &mut |local| {
                value = spacing.value(local);
                spacing.derivatives(local, 0.0, &mut gradient, &mut hessian);
            });
            (value, gradient[1], hessian[1][1])
        };
        for part in [0.02, 0.05, 0.1, 0.2, 0.24, 0.26, 0.6, 0.9, 1.1] {
            let (du, step) = (1e-3 * part, 1e-7 * part);
            let [(low, slope_low, _), (high, slope_high, _)] =
                [derivatives(du - step), derivatives(du + step)];
            let (_, slope, curvature) = derivatives(du);
            let differences = [(high - low), (slope_high - slope_low)].map(|d| d / (2.0 * step));
            for (exact, difference) in [slope, curvature].into_iter().zip(differences) {
                let error = (exact - difference).abs();
                assert!(
                    error <= 1e-5 * exact.abs() + 1e-12,
                    "{part}: {exact} {difference}"
                );
            }
        }
        assert!(derivatives(1e-9).1 < 1e4 * derivatives(1e-6).1);
        assert_eq!(derivatives(0.0).0, f64::INFINITY);
    }
}
