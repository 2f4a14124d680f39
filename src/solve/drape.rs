//! Static drape: coarse levels, the unfolding of a tangle, and rest; sewing is in `sew`.

use super::engine::Engine;
use super::relax::{End, FAR, RelaxOptions, Relaxed, holds, pin_part, relax};
use super::rest::{self, Rest};
use super::sew::{NEARLY_CLOSED, sew};
use super::step::{Totals, step};
use crate::blend::embed::carried;
use crate::error::{Result, Status};
use crate::math::Vec3;
use crate::system::build::System;
use crate::system::contact::crossing::SewnSurface;
use crate::system::state::{Pin, State};
use crate::tri::Transfer;

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
const SETTLE: (f64, f64) = (0.25, 0.6);
const UNFOLD: (f64, f64) = (0.0, 0.6);
const REST: (f64, f64) = (0.6, 1.0);

/// Root mean square of the edges' strain above which positions are a tangle.
const TANGLED: f64 = 1.0;
/// Weight over the size of the cloth, over the stiffness of the softest membrane; its least part of
/// the true one, for scenes without gravity.
const SOFTEST: f64 = 0.15;
const LEAST_FACTOR: f64 = 1e-4;
/// Steps with the softest membrane, factor between two membranes, steps with each of them.
const UNFOLD_STEPS: u64 = 20;
const STIFFEN: f64 = 5.0;
const STIFFEN_STEPS: u64 = 8;

/// Rounds of Newton's method and a moment of motion that a drape may take.
const ROUNDS: usize = 4;
/// Largest motion of a garment at rest [m].
const STILL: f64 = 1e-4;
/// Step of the moment of motion [s], its largest number, and how many quiet ones end it.
const PROBE_STEP: f64 = 1.0 / 30.0;
const PROBE_STEPS: usize = 30;
const QUIET_STEPS: usize = 4;

/// Watches progress: fraction done, stage, residual; false stops.
pub type Watch<'a> = dyn FnMut(f64, &'static str, f64) -> bool + 'a;

/// Sews (if the garment is `flat`, as placed, or its seams are open) and drapes, coarse levels first.
pub fn drape(
    engine: &mut Engine,
    state: &mut State,
    levels: Vec<Level>,
    flat: bool,
    plan: &Plan,
    watch: &mut Watch<'_>,
) -> Result<Relaxed> {
    engine.begin();
    if flat {
        place_bodies(state);
    }
    let mut all = Relaxed {
        totals: Totals::default(),
        end: End::Limit,
    };
    let mut carried: Option<(Engine, State)> = None;
    for level in levels {
        let mut coarse = level.engine;
        let mut coarse_state = coarse_state(&coarse, engine, state);
        let sewn = match &carried {
            Some((from, positions)) => {
                transfer(from, positions, &coarse, &mut coarse_state)?;
                true
            }
            None => sew(&mut coarse, &mut coarse_state, plan, &mut all, watch)?,
        };
        if sewn {
            let options = settle_options(plan, 100.0 * plan.force_tolerance);
            stage(
                &mut coarse,
                &mut coarse_state,
                &options,
                SETTLE,
                "settle",
                &mut all,
                watch,
            )?;
        }
        if all.is_over() {
            carried = Some((coarse, coarse_state));
            break;
        }
        carried = may_go_on(&coarse, &coarse_state)?.then_some((coarse, coarse_state));
    }
    // a drape that was stopped while it sewed goes on with that
    let open = engine.system.largest_seam_gap(&state.positions) > NEARLY_CLOSED;
    if !flat && !open && is_settled(state) && engine.residual(state)? <= plan.force_tolerance {
        // at rest already: left there, not disturbed to be brought back
        all.end = End::Rest;
        return stopped(engine, state, all);
    }
    if open {
        place_bodies(state);
    }
    match &carried {
        Some((from, positions)) => transfer(from, positions, engine, state)?,
        None if flat || open => {
            sew(engine, state, plan, &mut all, watch)?;
        }
        None => {}
    }
    if all.is_over() {
        return stopped(engine, state, all);
    }
    let crumpled = !flat && tangled(&engine.system, state);
    if crumpled {
        place_bodies(state);
        let done = unfold(engine, state, plan, &mut all, watch);
        let restored = engine.soften(1.0);
        done?;
        restored?;
        if all.is_over() {
            return stopped(engine, state, all);
        }
    }
    let small = engine.has_matrix() && engine.system.block_count() <= rest::LARGEST;
    let near = pin_part(engine, state, FAR) == 1.0;
    let mut reached = Rest::None;
    if small && near && !flat && !open && !crumpled {
        let mut watch = |residual| watch(REST.0, "rest", residual);
        reached = rest::settle(engine, state, plan, &mut all.totals, &mut watch)?;
    }
    place_bodies(state);
    if reached == Rest::Cancelled {
        all.end = End::Cancelled;
        return stopped(engine, state, all);
    }
    let mut options = settle_options(plan, plan.force_tolerance);
    for round in 0..ROUNDS {
        if reached == Rest::None {
            stage(engine, state, &options, REST, "rest", &mut all, watch)?;
            if all.end != End::Rest {
                break;
            }
        }
        all.end = End::Rest;
        if reached == Rest::Minimum
            || round + 1 == ROUNDS
            || small && engine.is_minimum(state, rest::LONGEST)?
        {
            break;
        }
        reached = Rest::None;
        // the least motion may leave an equilibrium that is no minimum
        let rested = state.clone();
        let probed = probe(engine, state, &mut all)?;
        let moved = state
            .positions
            .iter()
            .zip(&rested.positions)
            .map(|(p, q)| (p - q).norm());
        if !probed || moved.fold(0.0, f64::max) < STILL {
            *state = rested;
            break;
        }
        options.disturbed = false;
    }
    stopped(engine, state, all)
}

/// Puts bodies where they are to be, without carrying the cloth along.
fn place_bodies(state: &mut State) {
    for body in &mut state.bodies {
        body.pose = body.target;
        if !body.target_vertices.is_empty() {
            body.vertices = std::mem::take(&mut body.target_vertices);
        }
    }
}

/// Whether a coarse level may be carried on: a seam that a limb keeps open, or a fold that passes
/// through the cloth would stay for good, since contact does not undo it. The next level is sewn from
/// where the panels are placed then.
fn may_go_on(coarse: &Engine, state: &State) -> Result<bool> {
    if coarse.system.largest_seam_gap(&state.positions) > NEARLY_CLOSED {
        return Ok(false);
    }
    if coarse.settings.self_contact < 0.5 {
        return Ok(true);
    }
    let sewn = SewnSurface::new(&coarse.system.cloth.mesh, &state.positions);
    Ok(sewn.crossings(1)?.is_empty())
}

/// Whether pins and bodies are where they are to be.
fn is_settled(state: &State) -> bool {
    holds(state)
        && (state.bodies.iter()).all(|b| b.pose == b.target && b.target_vertices.is_empty())
}

/// The end of a drape, with the residual of the state that it leaves.
fn stopped(engine: &mut Engine, state: &mut State, mut all: Relaxed) -> Result<Relaxed> {
    state.velocities.fill(Vec3::zeros());
    all.totals.residual = engine.residual(state)?;
    Ok(all)
}

/// Whether the positions say little of the shape: the edges are far from their lengths.
fn tangled(system: &System, state: &State) -> bool {
    system.rms_stretch(&state.positions) > TANGLED
}

/// Unfolds a tangle under a membrane so soft that the weight stretches the cloth several times
/// over, then stiffens it step by step.
///
/// A linear step may turn a triangle by an angle `a` only as far as the stretch `a^2/2` that this
/// brings costs less than the weight gives: a stiff membrane rolls off a fold by a few degrees in
/// each correction, a soft one at once.
fn unfold(
    engine: &mut Engine,
    state: &mut State,
    plan: &Plan,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<()> {
    let cloth = &engine.system.cloth;
    let weight = state.gravity.norm() * cloth.masses.iter().sum::<f64>() / cloth.area().sqrt();
    let mut factor = (SOFTEST * weight / cloth.mean_stiffness()).clamp(LEAST_FACTOR, 1.0);
    let mut options = RelaxOptions {
        force_tolerance: 100.0 * plan.force_tolerance,
        seam_gap: 0.0,
        max_steps: plan.max_steps.min(UNFOLD_STEPS),
        first_step: 0.1,
        largest_step: 10.0,
        disturbed: true,
    };
    loop {
        engine.soften(factor)?;
        stage(engine, state, &options, UNFOLD, "unfold", all, watch)?;
        factor *= STIFFEN;
        if all.is_over() || factor >= 1.0 {
            return Ok(());
        }
        options.max_steps = plan.max_steps.min(STIFFEN_STEPS);
        options.disturbed = false;
    }
}

/// Lets the garment move for a moment, without advancing time. False if no step could be taken.
fn probe(engine: &mut Engine, state: &mut State, all: &mut Relaxed) -> Result<bool> {
    let before = state.clone();
    state.velocities.fill(Vec3::zeros());
    let mut quiet = 0;
    for _ in 0..PROBE_STEPS {
        let start = state.positions.clone();
        match step(engine, state, PROBE_STEP, &mut |_, _| true) {
            Ok(totals) => {
                let totals = totals.unwrap_or_default();
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
        disturbed: true,
    }
}

/// Relaxes as one stage of a drape, which fills a `range` of the progress bar.
pub(super) fn stage(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    range: (f64, f64),
    name: &'static str,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<()> {
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
    all.end = done.end;
    Ok(())
}

impl Relaxed {
    /// Whether what ended a stage ends the whole drape.
    pub(super) fn is_over(&self) -> bool {
        matches!(self.end, End::Cancelled | End::Falling(_))
    }
}

/// The state of a coarse level: as placed, like the fine one, in the same world, held at the
/// vertices nearest to the pins of the fine one, which may be vertices or nodes.
fn coarse_state(coarse: &Engine, fine: &Engine, state: &State) -> State {
    let mesh = &coarse.system.cloth.mesh;
    let mut out = State {
        positions: mesh.placed.clone(),
        velocities: vec![Vec3::zeros(); mesh.placed.len()],
        pins: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        ..state.clone()
    };
    for pin in &state.pins {
        let panel = fine.system.panel_of(pin.vertex) as usize;
        let uv = fine.system.flat_place(pin.vertex);
        let nearest = (mesh.panel_starts[panel]..mesh.panel_starts[panel + 1]).min_by(|a, b| {
            let d = |v: &u32| (mesh.uv[*v as usize] - uv).norm_squared();
            d(a).total_cmp(&d(b))
        });
        if let Some(vertex) = nearest {
            // the vertex may stand a little beside the pin: it keeps that offset
            let offset = mesh.placed[vertex as usize] - state.positions[pin.vertex as usize];
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
    if let Some(yarns) = &to.system.yarns {
        let nodes = carried(coarse, &positions.positions, &yarns.mesh)?;
        state.positions.extend(nodes);
    }
    state.velocities.fill(Vec3::zeros());
    state.body_anchors.clear();
    state.pair_anchors.clear();
    Ok(())
}
