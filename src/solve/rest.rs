//! Newton's method at rest: from a state that is nearly an equilibrium to the stable one beside it.
//!
//! Pins and bodies that have moved take the cloth along by the linear answer to their motion. Then
//! the exact Hessian is factored as it is. Where it is not positive definite the quadratic model has
//! no minimum, and inertia is added until it has one (Levenberg and Marquardt; the inertia of a step
//! `h` is `m / h^2`). A factor that exists without inertia worth mentioning proves that an
//! equilibrium is a minimum of the energy, so that no motion leaves it by itself.

use super::drape::Plan;
use super::engine::{Attempt, Engine, Motion};
use super::newton::Summary;
use super::step::Totals;
use crate::error::{Result, Status};
use crate::math::Vec3;
use crate::system::state::State;

/// Step whose inertia counts as none [s]: what it hides takes longer than this to grow.
pub const LONGEST: f64 = 10.0;
/// Steps below which the way to rest is not one of Newton's method [s].
const SHORTEST: f64 = 3e-3;
/// Attempts before the rest is left to others.
const ATTEMPTS: u64 = 10;
/// A last correction below this shows the Hessian at the end by that before it [m].
const SHOWN: f64 = 1e-4;
/// Vertices above which the memory of a complete factor in f64 is not taken.
pub const LARGEST: usize = 20_000;

/// How near to rest a state has come.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Rest {
    /// A minimum of the energy.
    Minimum,
    /// An equilibrium that may be unstable.
    Equilibrium,
    /// Neither; the energy has not grown.
    None,
    /// The host asked to stop.
    Cancelled,
}

/// Brings a state to rest. `watch(residual)` returns false to stop.
pub fn settle(
    engine: &mut Engine,
    state: &mut State,
    plan: &Plan,
    totals: &mut Totals,
    watch: &mut dyn FnMut(f64) -> bool,
) -> Result<Rest> {
    let force = plan.force_tolerance;
    let mut h = LONGEST;
    totals.residual = engine.residual(state)?;
    for _ in 0..ATTEMPTS.min(plan.max_steps) {
        if !watch(totals.residual) {
            return Ok(Rest::Cancelled);
        }
        state.velocities.fill(Vec3::zeros());
        state.u_rates.fill(0.0);
        let mut count = |summary: &Summary| {
            totals.newton_iterations += u64::from(summary.iterations);
            totals.linear_iterations += summary.linear_iterations;
            totals.residual = summary.residual;
        };
        let attempt = engine.attempt(state, h, 1.0, Motion::Rest { force });
        match attempt {
            Ok(Attempt::Accepted(summary)) => {
                count(&summary);
                totals.substeps += 1;
                if summary.converged {
                    totals.residual = engine.residual(state)?;
                    if totals.residual <= force {
                        let shown =
                            h == LONGEST && summary.corrections > 0 && summary.moved < SHOWN;
                        return Ok(if shown || engine.is_minimum(state, LONGEST)? {
                            Rest::Minimum
                        } else {
                            Rest::Equilibrium
                        });
                    }
                    h = LONGEST;
                } else if summary.indefinite {
                    h *= 0.1;
                } else {
                    h = (3.0 * h).min(LONGEST);
                }
            }
            Ok(Attempt::Rejected(_, summary)) => {
                count(&summary);
                h *= 0.1;
            }
            Err(e) if matches!(e.status, Status::NoAdmissibleState | Status::LinearSolve) => {
                h *= 0.1;
            }
            Err(e) => return Err(e),
        }
        if h < SHORTEST {
            break;
        }
    }
    Ok(Rest::None)
}
