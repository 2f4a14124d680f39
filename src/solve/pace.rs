//! How a relaxation chooses its steps.
//!
//! **Kinetic damping** (Umetani et al. 2011, section 7), for triangles: momentum carries the cloth along, and is
//! taken away whenever the kinetic energy has passed a maximum. The step grows while corrections are taken in full,
//! so that near rest the inertia fades.
//!
//! **Damped Newton** (Levenberg 1944, Marquardt 1963), where yarns are: no momentum, and lumped masses over the square of
//! the step as the metric. Segments of yarn are so stiff that a node follows a curved path; momentum across it is
//! lost in the line search. The step follows how well the quadratic model foretold the energy.

use super::engine::Engine;
use super::newton::Summary;
use crate::math::Vec3;
use crate::system::state::State;

/// Corrections below this part of the mean edge length are near rest, those of yarns below a
/// smaller one: friction holds only within micrometres.
const NEAR: f64 = 0.05;
const NEAR_YARNS: f64 = 1e-3;
/// Part of the exact Hessian that is taken where yarns are and not near rest: short of all of it, what
/// has kinks keeps its majorant.
pub(super) const ALMOST: f64 = 0.999;
/// Agreement of energy and model above which the step grows, and below which it shrinks.
const GOOD: f64 = 0.6;
const POOR: f64 = 0.3;
/// Factors on the step.
const GROW: f64 = 3.0;
const SHRINK: f64 = 0.7;
/// Least factor on the step after a shortened correction.
const CUT: f64 = 0.5;

/// The choice of steps and what it remembers.
pub(super) enum Pace {
    /// Kinetic damping.
    Kinetic {
        /// The last two kinetic energies [J].
        energies: [f64; 2],
        /// Largest displacement in the last correction [m].
        moved: f64,
        /// Steps until the exact Hessian is tried again, and how many after a failure. It pays near
        /// rest, far from it the way of steepest instability leads astray: it is tried where little
        /// moves, after full steps, less often where it failed.
        wait: u32,
        patience: u32,
    },
    /// Damped Newton.
    Damped {
        /// Part of the exact Hessian that may be positive definite.
        exactness: f64,
    },
}

impl Pace {
    /// The way that suits a system.
    pub(super) fn new(engine: &Engine) -> Self {
        if engine.system.has_yarns() {
            Self::Damped { exactness: ALMOST }
        } else {
            Self::Kinetic {
                energies: [0.0; 2],
                moved: f64::INFINITY,
                wait: 4,
                patience: 4,
            }
        }
    }

    /// How much of the exact Hessian the next correction tries.
    pub(super) fn exactness(&self, engine: &Engine) -> f64 {
        match self {
            Self::Kinetic { moved, wait, .. } => {
                let near = *moved < NEAR * engine.system.mean_edge();
                f64::from(u8::from(*wait == 0 && near))
            }
            Self::Damped { exactness } => *exactness,
        }
    }

    /// After a correction that was refused.
    pub(super) fn refused(&mut self, state: &mut State) {
        halt(state);
        if let Self::Kinetic { energies, .. } = self {
            *energies = [0.0; 2];
        }
    }

    /// Learns from a correction, taken or refused, that tried `exactness`.
    pub(super) fn learn(&mut self, engine: &Engine, summary: &Summary, exactness: f64) {
        match self {
            Self::Kinetic { wait, patience, .. } => {
                let exact = exactness == 1.0;
                if exact && summary.exactness < 1.0 {
                    *patience = (2 * *patience).min(64);
                } else if exact {
                    *patience = 1;
                }
                *wait = if summary.last_length < 1.0 {
                    *patience
                } else if summary.exactness == 1.0 {
                    0
                } else if exact {
                    *patience
                } else {
                    wait.saturating_sub(1)
                };
            }
            Self::Damped { exactness } => {
                let near = summary.moved < NEAR_YARNS * engine.system.mean_edge();
                let most = if near && summary.last_length == 1.0 {
                    1.0
                } else {
                    ALMOST
                };
                *exactness = if summary.indefinite {
                    summary.exactness.min(ALMOST)
                } else {
                    (2.0 * summary.exactness).clamp(0.25, most)
                };
            }
        }
    }

    /// Goes on from a correction that was taken with the step `h` [s]; returns the next step.
    pub(super) fn taken(
        &mut self,
        engine: &Engine,
        state: &mut State,
        summary: &Summary,
        h: f64,
    ) -> f64 {
        match self {
            Self::Kinetic {
                energies, moved, ..
            } => {
                *moved = summary.moved;
                let energy = kinetic_energy(engine, state);
                if energy < energies[0] && energies[0] >= energies[1] {
                    halt(state);
                    *energies = [0.0; 2];
                } else {
                    *energies = [energy, energies[0]];
                }
                if summary.last_length >= 1.0 {
                    1.3 * h
                } else if summary.last_length < 0.3 {
                    0.6 * h
                } else {
                    h
                }
            }
            Self::Damped { .. } => {
                halt(state);
                if summary.last_length < 1.0 {
                    h * summary.last_length.sqrt().max(CUT)
                } else if summary.agreement > GOOD {
                    GROW * h
                } else if summary.agreement < POOR {
                    SHRINK * h
                } else {
                    h
                }
            }
        }
    }
}

/// Takes all momentum away.
fn halt(state: &mut State) {
    state.velocities.fill(Vec3::zeros());
    state.u_rates.fill(0.0);
}

fn kinetic_energy(engine: &Engine, state: &State) -> f64 {
    state
        .velocities
        .iter()
        .zip(&engine.system.points.masses)
        .map(|(v, m)| 0.5 * m * v.norm_squared())
        .sum()
}
