//! Static drape: semi-implicit steps with kinetic damping towards rest, then Newton.
//!
//! The equations of motion without damping are integrated by steps of one Newton correction each
//! (Baraff and Witkin 1998); the velocities are set to zero whenever the kinetic energy has passed a
//! maximum (Umetani et al. 2011, section 7). The step size grows while the corrections are taken in
//! full, so that near rest the inertia fades and the iteration becomes Newton's method for the
//! static problem.

use super::engine::{Attempt, Engine, Motion};
use super::step::{Totals, step};
use crate::error::{Error, Result, Status};
use crate::math::Vec3;
use crate::system::state::{Pin, State};
use crate::tri::Transfer;

/// When a relaxation stops.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RelaxOptions {
    /// Largest static force on a free vertex [N].
    pub force_tolerance: f64,
    /// A gap of the seams below which sewing is done [m]; 0 to go on to the force tolerance.
    pub seam_gap: f64,
    /// Steps allowed.
    pub max_steps: u64,
    /// First step size [s].
    pub first_step: f64,
    /// Largest step size [s].
    pub largest_step: f64,
}

/// How a relaxation ended.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Relaxed {
    /// Sums.
    pub totals: Totals,
    /// A tolerance was met.
    pub converged: bool,
    /// The host asked to stop.
    pub cancelled: bool,
}

/// Smallest step of a relaxation before it gives up [s].
const SMALLEST_STEP: f64 = 1e-6;

/// A correction below this part of the mean edge length counts as near rest.
const NEAR: f64 = 0.05;
/// Disturbance of the start over the mean edge length.
const IMPERFECTION: f64 = 1e-5;
/// Friction is frozen below this many force tolerances.
const FREEZE: f64 = 300.0;
/// Steps after which friction follows only every tenth step.
const SETTLED: u64 = 30;

/// Relaxes the state towards rest. `watch(step, residual)` returns false to stop.
pub fn relax(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    watch: &mut dyn FnMut(u64, f64) -> bool,
) -> Result<Relaxed> {
    let mut out = Relaxed {
        totals: Totals::default(),
        converged: false,
        cancelled: false,
    };
    out.totals.residual = f64::INFINITY;
    let mut h = options.first_step;
    let mut kinetic = [0.0; 2];
    // the exact Hessian pays near rest, far from it the way of steepest instability leads astray: it
    // is tried where little moves, after full steps, less often where it failed
    let mut moved = f64::INFINITY;
    let (mut wait, mut patience) = (4_u32, 4_u32);
    state.velocities.fill(Vec3::zeros());
    disturb(state, IMPERFECTION * engine.system.mean_edge());
    while out.totals.substeps < options.max_steps {
        let exact = wait == 0 && moved < NEAR * engine.system.mean_edge();
        // near rest friction is frozen while Newton's method converges: anchors that move after
        // every correction would creep
        let follow = out.totals.residual > FREEZE * options.force_tolerance
            && (out.totals.substeps < SETTLED || out.totals.substeps.is_multiple_of(10));
        let (summary, reason) = match engine.attempt(state, h, 1.0, Motion::Relax { exact, follow })
        {
            Ok(Attempt::Accepted(summary)) => (summary, None),
            Ok(Attempt::Rejected(reason, summary)) => (summary, Some(reason.to_owned())),
            Err(e) if matches!(e.status, Status::NoAdmissibleState | Status::LinearSolve) => {
                (super::newton::Summary::default(), Some(e.message))
            }
            Err(e) => return Err(e),
        };
        out.totals.newton_iterations += u64::from(summary.iterations);
        out.totals.linear_iterations += summary.linear_iterations;
        if exact && summary.exactness < 1.0 {
            patience = (2 * patience).min(64);
        } else if exact {
            patience = 1;
        }
        wait = if summary.last_length < 1.0 {
            patience
        } else if summary.exactness == 1.0 {
            0
        } else if exact {
            patience
        } else {
            wait.saturating_sub(1)
        };
        if let Some(reason) = reason {
            out.totals.cut = true;
            state.velocities.fill(Vec3::zeros());
            kinetic = [0.0; 2];
            h *= 0.25;
            if h < SMALLEST_STEP {
                // nothing lower can be found: rest up to rounding, or a dead end that is reported
                out.totals.residual = engine.residual(state)?;
                if !out.totals.residual.is_finite() {
                    return Err(Error::new(Status::NoAdmissibleState, reason));
                }
                out.converged = out.totals.residual <= options.force_tolerance;
                return Ok(out);
            }
            continue;
        }
        out.totals.substeps += 1;
        moved = summary.moved;
        out.totals.residual = summary.static_residual;
        if h < SMALLEST_STEP {
            return Ok(out);
        }
        let energy = kinetic_energy(engine, state);
        if energy < kinetic[0] && kinetic[0] >= kinetic[1] {
            state.velocities.fill(Vec3::zeros());
            kinetic = [0.0; 2];
        } else {
            kinetic = [energy, kinetic[0]];
        }
        if summary.last_length >= 1.0 {
            h = (h * 1.3).min(options.largest_step);
        } else if summary.last_length < 0.3 {
            h *= 0.6;
        }
        if options.seam_gap > 0.0
            && engine.system.largest_seam_gap(&state.positions) <= options.seam_gap
        {
            out.converged = true;
            return Ok(out);
        }
        if summary.static_residual <= options.force_tolerance {
            engine.follow(state)?;
            out.totals.residual = engine.residual(state)?;
            if out.totals.residual <= options.force_tolerance {
                out.converged = true;
                return Ok(out);
            }
        }
        if !watch(out.totals.substeps, summary.static_residual) {
            out.cancelled = true;
            return Ok(out);
        }
    }
    Ok(out)
}

/// Moves every free vertex a little, each in its own direction: a sheet that hangs exactly in its
/// plane has no force across it, however unstable it is, and would fold within the plane.
fn disturb(state: &mut State, size: f64) {
    let mut pins = state.pins.iter().map(|p| p.vertex as usize).peekable();
    let mut bits = 0x9E37_79B9_7F4A_7C15_u64;
    for (i, x) in state.positions.iter_mut().enumerate() {
        let offset = Vec3::from_fn(|_, _| {
            // xorshift (Marsaglia 2003)
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        });
        if pins.next_if_eq(&i).is_none() {
            *x += offset * size;
        }
    }
}

fn kinetic_energy(engine: &Engine, state: &State) -> f64 {
    state
        .velocities
        .iter()
        .zip(&engine.system.cloth.masses)
        .map(|(v, m)| 0.5 * m * v.norm_squared())
        .sum()
}

/// A coarser version of the garment.
pub struct Level {
    /// Its system and solver.
    pub engine: Engine,
}

/// What a drape aims at.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Plan {
    /// Largest static force on a free vertex [N].
    pub force_tolerance: f64,
    /// Steps allowed in each stage.
    pub max_steps: u64,
}

/// Part of the progress bar that each stage fills.
const SEW: (f64, f64) = (0.0, 0.25);
const SETTLE: (f64, f64) = (0.25, 0.6);
const REST: (f64, f64) = (0.6, 1.0);

/// Rounds of Newton's method and a moment of motion that a drape may take.
const ROUNDS: usize = 4;
/// Largest motion of a garment at rest [m].
const STILL: f64 = 1e-4;
/// Step of the moment of motion [s], its largest number, and how many quiet ones end it.
const PROBE_STEP: f64 = 1.0 / 30.0;
const PROBE_STEPS: usize = 30;
const QUIET_STEPS: usize = 4;

/// Seams with a larger gap than this are pulled harder [m]; below it they are sewn.
const NEARLY_CLOSED: f64 = 8e-3;
/// How often the pull is doubled.
const DOUBLINGS: usize = 5;

/// A gap at which the seams count as closed [m].
const CLOSED: f64 = 1e-3;

/// Watches progress: fraction done, stage, residual; false stops.
pub type Watch<'a> = dyn FnMut(f64, &'static str, f64) -> bool + 'a;

/// Sews (if the garment is `flat`, as placed) and drapes, coarse levels first.
pub fn drape(
    engine: &mut Engine,
    state: &mut State,
    levels: Vec<Level>,
    flat: bool,
    plan: &Plan,
    watch: &mut Watch<'_>,
) -> Result<Relaxed> {
    engine.begin();
    let mut all = Relaxed {
        totals: Totals::default(),
        converged: false,
        cancelled: false,
    };
    let mut carried: Option<(Engine, State)> = None;
    for level in levels {
        let mut coarse = level.engine;
        let mut coarse_state = coarse_state(&coarse, engine, state);
        match &carried {
            Some((from, positions)) => transfer(from, positions, &coarse, &mut coarse_state)?,
            None => {
                if !sew(&mut coarse, &mut coarse_state, plan, &mut all, watch)? {
                    return Ok(all);
                }
            }
        }
        let options = settle_options(plan, 100.0 * plan.force_tolerance);
        let done = stage(
            &mut coarse,
            &mut coarse_state,
            &options,
            SETTLE,
            "settle",
            &mut all,
            watch,
        )?;
        if done.cancelled {
            return Ok(all);
        }
        carried = Some((coarse, coarse_state));
    }
    match &carried {
        Some((from, positions)) => transfer(from, positions, engine, state)?,
        None if flat && !sew(engine, state, plan, &mut all, watch)? => return Ok(all),
        None => {}
    }
    let options = settle_options(plan, plan.force_tolerance);
    for round in 0..ROUNDS {
        let done = stage(engine, state, &options, REST, "rest", &mut all, watch)?;
        all.converged = done.converged;
        if !done.converged || done.cancelled || round + 1 == ROUNDS {
            break;
        }
        // Newton's method may stop at an equilibrium that the least motion leaves
        let rested = state.positions.clone();
        let probed = probe(engine, state, &mut all)?;
        let moved = state
            .positions
            .iter()
            .zip(&rested)
            .map(|(p, q)| (p - q).norm());
        if !probed || moved.fold(0.0, f64::max) < STILL {
            break;
        }
    }
    state.velocities.fill(Vec3::zeros());
    Ok(all)
}

/// Lets the garment move for a moment, without advancing time. False if no step could be taken.
fn probe(engine: &mut Engine, state: &mut State, all: &mut Relaxed) -> Result<bool> {
    let before = state.clone();
    state.velocities.fill(Vec3::zeros());
    let mut quiet = 0;
    for _ in 0..PROBE_STEPS {
        let start = state.positions.clone();
        match step(engine, state, PROBE_STEP) {
            Ok(totals) => {
                all.totals.newton_iterations += totals.newton_iterations;
                all.totals.linear_iterations += totals.linear_iterations;
                all.totals.substeps += totals.substeps;
            }
            Err(e) if e.status == Status::NoAdmissibleState => {
                *state = before;
                return Ok(false);
            }
            Err(e) => return Err(e),
        }
        let moved = state
            .positions
            .iter()
            .zip(&start)
            .map(|(p, q)| (p - q).norm());
        quiet = if moved.fold(0.0, f64::max) < 0.1 * STILL {
            quiet + 1
        } else {
            0
        };
        if quiet >= QUIET_STEPS {
            break;
        }
    }
    state.velocities.fill(Vec3::zeros());
    state.time = before.time;
    state.step_size = before.step_size;
    for (body, old) in state.bodies.iter_mut().zip(&before.bodies) {
        body.moved_with_time = old.moved_with_time;
    }
    Ok(true)
}

fn settle_options(plan: &Plan, force_tolerance: f64) -> RelaxOptions {
    RelaxOptions {
        force_tolerance,
        seam_gap: 0.0,
        max_steps: plan.max_steps,
        first_step: 0.01,
        largest_step: 10.0,
    }
}

/// Pulls the seams together without weight and friction. False if the host stopped it.
fn sew(
    engine: &mut Engine,
    state: &mut State,
    plan: &Plan,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<bool> {
    if engine.system.cloth.mesh.seams.is_empty() {
        return Ok(true);
    }
    let options = RelaxOptions {
        force_tolerance: plan.force_tolerance,
        seam_gap: CLOSED,
        max_steps: plan.max_steps,
        first_step: 0.01,
        largest_step: 0.05,
    };
    let gravity = std::mem::replace(&mut state.gravity, Vec3::zeros());
    let smooth = engine.system.bodies.with_friction(0.0);
    let rough = std::mem::replace(&mut engine.system.bodies, smooth);
    let settings = engine.settings.clone();
    let done = close(engine, state, &options, all, watch);
    engine.system.bodies = rough;
    state.gravity = gravity;
    state.body_anchors.clear();
    let restored = engine.set_settings(&settings);
    let done = done?;
    restored?;
    Ok(!done.cancelled)
}

/// Sews with the pull of the settings; a seam that stays open under it, because the garment is
/// tight there, is pulled twice as hard, and so on.
fn close(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<Relaxed> {
    let mut settings = engine.settings.clone();
    let mut done = stage(engine, state, options, SEW, "sew", all, watch)?;
    for _ in 0..DOUBLINGS {
        if done.cancelled || engine.system.largest_seam_gap(&state.positions) < NEARLY_CLOSED {
            break;
        }
        settings.seam_pull *= 2.0;
        engine.set_settings(&settings)?;
        done = stage(engine, state, options, SEW, "sew", all, watch)?;
    }
    Ok(done)
}

fn stage(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    range: (f64, f64),
    name: &'static str,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<Relaxed> {
    let mut first = 0.0_f64;
    let mut best = 0.0_f64;
    let done = relax(engine, state, options, &mut |step, residual| {
        first = first.max(residual);
        // the residual falls by orders of magnitude: its logarithm is what advances evenly
        let fall = (first / residual).ln() / (first / options.force_tolerance).ln().max(1e-3);
        let count = step as f64 / options.max_steps as f64;
        best = best.max(fall.max(count).clamp(0.0, 1.0));
        watch(range.0 + (range.1 - range.0) * best, name, residual)
    })?;
    all.totals.substeps += done.totals.substeps;
    all.totals.newton_iterations += done.totals.newton_iterations;
    all.totals.linear_iterations += done.totals.linear_iterations;
    all.totals.residual = done.totals.residual;
    all.cancelled |= done.cancelled;
    Ok(done)
}

/// The state of a coarse level: as placed, in the same world, held at the vertices nearest to the
/// pins of the fine one.
fn coarse_state(coarse: &Engine, fine: &Engine, state: &State) -> State {
    let mesh = &coarse.system.cloth.mesh;
    let fine_mesh = &fine.system.cloth.mesh;
    let mut out = State {
        positions: mesh.placed.clone(),
        velocities: vec![Vec3::zeros(); mesh.placed.len()],
        pins: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        ..state.clone()
    };
    for pin in &state.pins {
        let panel = fine_mesh.vertex_panel[pin.vertex as usize] as usize;
        let uv = fine_mesh.uv[pin.vertex as usize];
        let nearest = (mesh.panel_starts[panel]..mesh.panel_starts[panel + 1]).min_by(|a, b| {
            let d = |v: &u32| (mesh.uv[*v as usize] - uv).norm_squared();
            d(a).total_cmp(&d(b))
        });
        if let Some(vertex) = nearest {
            // the vertex may stand a little beside the pin: it keeps that offset
            let offset = mesh.placed[vertex as usize] - fine_mesh.placed[pin.vertex as usize];
            let target = pin.target + offset;
            if let Err(i) = out.pins.binary_search_by_key(&vertex, |p| p.vertex) {
                out.pins.insert(i, Pin { vertex, target });
            }
        }
    }
    out
}

/// Carries positions to a finer level.
fn transfer(from: &Engine, positions: &State, to: &Engine, state: &mut State) -> Result<()> {
    let (coarse, fine) = (&from.system.cloth.mesh, &to.system.cloth.mesh);
    let map = Transfer::new(coarse, fine)?;
    state.positions = map.apply(&coarse.triangles, &positions.positions);
    state.velocities.fill(Vec3::zeros());
    state.body_anchors.clear();
    state.pair_anchors.clear();
    Ok(())
}
