//! `step(dt)`: substeps of backward Euler whose size follows contact, strain and Newton's method.

use super::admissible::named;
use super::engine::{Attempt, Engine, Motion};
use crate::error::{Error, Result, Status};
use crate::system::build::System;
use crate::system::state::{Pin, State};

/// Sums over the substeps of one step or drape.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Totals {
    /// Accepted substeps.
    pub substeps: u64,
    /// Newton iterations, rejected substeps included.
    pub newton_iterations: u64,
    /// Linear iterations.
    pub linear_iterations: u64,
    /// Residual of the last solve [N].
    pub residual: f64,
    /// Whether substeps were shorter than the settings ask, or a relaxation had to cut one.
    pub cut: bool,
}

/// Asked before every substep: fraction of the step that is done, residual; false stops.
pub type Watch<'a> = dyn FnMut(f64, f64) -> bool + 'a;

/// Advances the state by exactly `dt` [s] and returns what it took. The state is untouched after an
/// error, and after a stop by the host, which is `None`.
pub fn step(
    engine: &mut Engine,
    state: &mut State,
    dt: f64,
    watch: &mut Watch<'_>,
) -> Result<Option<Totals>> {
    let saved = state.clone();
    engine.begin();
    let done = advance(engine, state, dt, watch);
    if !matches!(done, Ok(Some(_))) {
        state.clone_from(&saved);
    }
    done.map_err(|mut error| {
        if error.status == Status::NoAdmissibleState
            && let Some(held) = farthest(&engine.system, state)
        {
            error.message += &held;
        }
        error
    })
}

/// What is held and is to go farthest, if anything is to go.
fn farthest(system: &System, state: &State) -> Option<String> {
    let way = |p: &Pin| (p.target - state.positions[p.vertex as usize]).norm();
    let pin = (state.pins.iter()).max_by(|a, b| way(a).total_cmp(&way(b)))?;
    (way(pin) > 0.0).then(|| {
        let name = named(system, pin.vertex as usize);
        format!(
            "; of what is held {name} is to go farthest, by {:.3e} m",
            way(pin)
        )
    })
}

fn advance(
    engine: &mut Engine,
    state: &mut State,
    dt: f64,
    watch: &mut Watch<'_>,
) -> Result<Option<Totals>> {
    let end = state.time + dt;
    let start = state.time;
    let (min, max) = (engine.settings.min_step, engine.settings.max_step);
    let mut totals = Totals::default();
    let mut remaining = dt;
    while remaining > 0.0 {
        if !watch(1.0 - remaining / dt, totals.residual) {
            return Ok(None);
        }
        let slices = (remaining / state.step_size.min(max)).ceil().max(1.0);
        let h = remaining / slices;
        let attempt = engine.attempt(state, h, 1.0 / slices, Motion::Dynamic);
        let reason = match attempt {
            Ok(Attempt::Accepted(summary)) => {
                add(&mut totals, &summary);
                totals.substeps += 1;
                remaining = if slices <= 1.0 { 0.0 } else { remaining - h };
                state.time = end - remaining;
                if summary.iterations <= 8 {
                    state.step_size = state.step_size.max(1.5 * h);
                }
                continue;
            }
            Ok(Attempt::Rejected(reason, summary)) => {
                add(&mut totals, &summary);
                reason
            }
            Err(error)
                if matches!(
                    error.status,
                    Status::NoAdmissibleState | Status::LinearSolve
                ) =>
            {
                error.message
            }
            Err(error) => return Err(error),
        };
        state.step_size = 0.5 * h;
        if state.step_size < min {
            return Err(Error::new(
                Status::NoAdmissibleState,
                format!(
                    "no admissible state at time {:.9} s (step from {start:.9} s by {dt} s): {reason}, \
                     even with a substep of {h:.3e} s (solver.step.min = {min:.3e} s)",
                    state.time
                ),
            ));
        }
    }
    // a step also takes many substeps where an earlier one had to
    totals.cut = totals.substeps as f64 > (dt / max).ceil().max(1.0);
    state.time = end;
    for body in &mut state.bodies {
        body.moved_with_time = true;
    }
    Ok(Some(totals))
}

fn add(totals: &mut Totals, summary: &super::newton::Summary) {
    totals.newton_iterations += u64::from(summary.iterations);
    totals.linear_iterations += summary.linear_iterations;
    totals.residual = summary.residual;
}
