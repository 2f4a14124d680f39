//! Time and rest: the step, the drape, and the report of either.

use super::{DrapeOptions, Outcome, Progress, Sim, StepReport, finite};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::solve::drape;
use crate::solve::engine::Engine;
use crate::solve::relax::End;
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
        self.step_watched(dt, &mut |_| true)
    }

    /// [`Sim::step`] that tells how far it has come before every substep. The callback returns false
    /// to stop, which leaves the state as it was before the step and is no error.
    pub fn step_watched(
        &mut self,
        dt: f64,
        progress: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<StepReport> {
        if !(dt.is_finite() && dt > 0.0 && dt <= 1e6) {
            return Err(Error::argument(format!(
                "dt = {dt} s must be positive and at most 1e6"
            )));
        }
        // the memory that hosts look at is kept for the state that a failure leaves
        let now = self.state.clone();
        let saved = std::mem::replace(&mut self.state, now);
        let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let mut watch = |fraction, residual| {
            progress(&Progress {
                fraction,
                stage: "step",
                residual,
            })
        };
        let done = step::step(&mut engine, &mut self.state, dt, &mut watch).and_then(|totals| {
            let (outcome, advanced) = match &totals {
                None => (Outcome::Cancelled, 0.0),
                Some(totals) if totals.cut => (Outcome::Substepped, dt),
                Some(_) => (Outcome::Converged, dt),
            };
            let totals = match totals {
                Some(totals) => totals,
                None => Totals {
                    residual: engine.residual(&self.state)?,
                    ..Totals::default()
                },
            };
            let reason = String::new();
            describe(
                &mut engine,
                &self.state,
                &totals,
                (outcome, reason),
                advanced,
            )
        });
        drop(engine);
        match done.and_then(|report| self.take_yarns().map(|()| report)) {
            Ok(report) => {
                self.carry_vertices();
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
        let now = self.state.clone();
        let saved = std::mem::replace(&mut self.state, now);
        let flat = *self.positions() == *self.mesh.placed;
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
            let ended = self.ended(relaxed.end);
            describe(&mut engine, &self.state, &relaxed.totals, ended, 0.0)
        });
        drop(engine);
        match done.and_then(|report| self.take_yarns().map(|()| report)) {
            Ok(report) => {
                self.end_placement();
                self.carry_vertices();
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
        // yarns begin on the whole mesh of triangles
        let finest = i32::from(self.yarns.is_none());
        for k in (finest..=self.settings.drape_levels as i32).rev() {
            let scale = COARSENING.powi(k);
            if k > 0 && (self.mesh.uv.len() as f64) / (scale * scale) < SMALLEST_LEVEL {
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
        let ended = (outcome, String::new());
        describe(&mut engine, &self.state, &totals, ended, 0.0)
    }

    /// How a drape ended, for hosts.
    fn ended(&self, end: End) -> (Outcome, String) {
        match end {
            End::Rest => (Outcome::Converged, String::new()),
            End::Limit => (Outcome::IterationLimit, String::new()),
            End::Cancelled => (Outcome::Cancelled, String::new()),
            End::Stalled(reason) => (Outcome::Stalled, reason),
            End::Falling(panel) => {
                let name = self.garment.panels.get(panel as usize).map(|p| &p.name);
                let reason = format!(
                    "panel '{}' and what is sewn to it fall for ever: no pin holds them, and nothing on \
                     their way will stop them",
                    name.map_or("", String::as_str)
                );
                (Outcome::Falling, reason)
            }
        }
    }
}

fn describe(
    engine: &mut Engine,
    state: &State,
    totals: &Totals,
    (outcome, reason): (Outcome, String),
    advanced: f64,
) -> Result<StepReport> {
    let potential_energy = engine.potential_energy(state)?;
    let system = &engine.system;
    Ok(StepReport {
        outcome,
        reason,
        newton_iterations: totals.newton_iterations,
        linear_iterations: totals.linear_iterations,
        substeps: totals.substeps,
        advanced,
        residual: totals.residual,
        max_edge_strain: system.largest_strain(state),
        min_gap: system.smallest_gap(&state.positions),
        kinetic_energy: kinetic_energy(state, &system.points.masses),
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
