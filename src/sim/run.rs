//! Time and rest: the step, the drape, and the report of either.

use super::{DrapeOptions, Outcome, Progress, Sim, StepReport, finite};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::solve::drape;
use crate::solve::engine::Engine;
use crate::solve::step::{self, Totals};
use crate::system::build::{BuildOptions, System};
use crate::system::state::State;
use std::sync::PoisonError;

/// Ratio of edge lengths between two levels of a drape.
const COARSENING: f64 = 2.5;
/// No level with fewer vertices is made.
const SMALLEST_LEVEL: f64 = 200.0;

impl Sim {
    /// Advances by exactly `dt` [s], or returns the state untouched.
    pub fn step(&mut self, dt: f64) -> Result<StepReport> {
        if !(dt.is_finite() && dt > 0.0 && dt <= 1e6) {
            return Err(Error::argument(format!(
                "dt = {dt} s must be positive and at most 1e6"
            )));
        }
        let saved = self.state.clone();
        let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let done = step::step(&mut engine, &mut self.state, dt).and_then(|totals| {
            let outcome = if totals.cut {
                Outcome::Substepped
            } else {
                Outcome::Converged
            };
            describe(&mut engine, &self.state, &totals, outcome, dt)
        });
        drop(engine);
        match done {
            Ok(report) => {
                self.epoch += 1;
                Ok(report)
            }
            Err(error) => {
                self.state = saved;
                Err(error)
            }
        }
    }

    /// Sews and drapes to rest; time does not advance. The callback returns false to stop, which
    /// leaves the state reached so far and is no error.
    pub fn drape(
        &mut self,
        options: &DrapeOptions,
        progress: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<StepReport> {
        finite("force_tolerance", &[options.force_tolerance])?;
        if options.force_tolerance < 0.0 {
            return Err(Error::argument(format!(
                "force_tolerance = {} N must not be negative",
                options.force_tolerance
            )));
        }
        let plan = drape::Plan {
            force_tolerance: if options.force_tolerance > 0.0 {
                options.force_tolerance
            } else {
                self.settings.drape_force_tolerance
            },
            max_steps: if options.max_steps > 0 {
                options.max_steps
            } else {
                self.settings.drape_max_steps as u64
            },
        };
        let saved = self.state.clone();
        let flat = self.state.positions == self.mesh.placed;
        // a coarse sheet that nothing sews or carries finds folds that the fine one does not have
        let levels = if flat && !self.mesh.seams.is_empty() {
            self.coarse_levels()?
        } else {
            Vec::new()
        };
        let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let mut furthest = 0.0_f64;
        let done = drape::drape(
            &mut engine,
            &mut self.state,
            levels,
            flat,
            &plan,
            &mut |f, s, r| {
                furthest = furthest.max(f);
                progress(&Progress {
                    fraction: furthest,
                    stage: s,
                    residual: r,
                })
            },
        )
        .and_then(|relaxed| {
            let outcome = if relaxed.cancelled {
                Outcome::Cancelled
            } else if relaxed.converged {
                Outcome::Converged
            } else {
                Outcome::IterationLimit
            };
            describe(&mut engine, &self.state, &relaxed.totals, outcome, 0.0)
        });
        drop(engine);
        match done {
            Ok(report) => {
                self.end_placement();
                self.epoch += 1;
                Ok(report)
            }
            Err(error) => {
                self.state = saved;
                Err(error)
            }
        }
    }

    /// Coarse versions of the garment, coarsest first, each at least a few hundred vertices.
    fn coarse_levels(&self) -> Result<Vec<drape::Level>> {
        let mut levels = Vec::new();
        if self.garment.panels.is_empty() {
            return Ok(levels);
        }
        for k in (1..=self.settings.drape_levels as i32).rev() {
            let scale = COARSENING.powi(k);
            if (self.mesh.uv.len() as f64) / (scale * scale) < SMALLEST_LEVEL {
                continue;
            }
            let mesh =
                crate::tri::triangulate(&self.garment, scale, self.settings.max_vertices as usize)?;
            let cloth = Cloth::new(&self.garment, mesh)?;
            let mut system = System::new(cloth, &BuildOptions::from(&self.settings))?;
            for (body, contact) in &self.bodies {
                let _ = system.bodies.add(body, contact);
            }
            levels.push(drape::Level {
                engine: Engine::new(system, &self.settings),
            });
        }
        Ok(levels)
    }

    /// Numbers of the present state without advancing it (counts are zero). The outcome tells
    /// whether it is at rest to the force tolerance of a drape.
    pub fn report(&self) -> Result<StepReport> {
        let mut engine = self.engine();
        let totals = Totals {
            residual: engine.residual(&self.state)?,
            ..Totals::default()
        };
        let outcome = if totals.residual <= self.settings.drape_force_tolerance {
            Outcome::Converged
        } else {
            Outcome::IterationLimit
        };
        describe(&mut engine, &self.state, &totals, outcome, 0.0)
    }
}

fn describe(
    engine: &mut Engine,
    state: &State,
    totals: &Totals,
    outcome: Outcome,
    advanced: f64,
) -> Result<StepReport> {
    let potential_energy = engine.potential_energy(state)?;
    let system = &engine.system;
    Ok(StepReport {
        outcome,
        newton_iterations: totals.newton_iterations,
        linear_iterations: totals.linear_iterations,
        substeps: totals.substeps,
        advanced,
        residual: totals.residual,
        max_edge_strain: system.largest_strain(&state.positions),
        min_gap: system.smallest_gap(&state.positions),
        kinetic_energy: kinetic_energy(state, &system.cloth.masses),
        potential_energy,
        max_seam_gap: system.largest_seam_gap(&state.positions),
    })
}

pub(super) fn kinetic_energy(state: &State, masses: &[f64]) -> f64 {
    state
        .velocities
        .iter()
        .zip(masses)
        .map(|(v, m)| 0.5 * m * v.norm_squared())
        .sum()
}
