//! Relaxation: semi-implicit steps towards rest, which end as Newton's method.
//!
//! The equations of motion without damping are integrated by steps of one Newton correction each (Baraff and
//! Witkin 1998); [`pace`](super::pace) chooses their size and what becomes of the momentum. As the step grows the
//! inertia fades and the iteration becomes Newton's method for the static problem.

use super::drift::Drift;
use super::engine::{Attempt, Engine, Motion};
use super::pace::Pace;
use super::step::Totals;
use crate::error::{Error, Result, Status};
use crate::math::Vec3;
use crate::math::boxtree::{Aabb, BoxTree};
use crate::system::state::{Pin, State};

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
    /// Whether the start is disturbed a little, as a plane sheet needs it.
    pub disturbed: bool,
}

/// Why a relaxation ended.
#[derive(Clone, Debug, PartialEq)]
pub enum End {
    /// A tolerance was met.
    Rest,
    /// All steps allowed were taken.
    Limit,
    /// The host asked to stop.
    Cancelled,
    /// No step, however short, leads lower, for this reason.
    Stalled(String),
    /// A part of the cloth, which has this panel, falls and will meet nothing.
    Falling(u32),
}

/// How a relaxation ended.
#[derive(Clone, Debug, PartialEq)]
pub struct Relaxed {
    /// Sums.
    pub totals: Totals,
    /// Why.
    pub end: End,
}

/// Smallest step of a relaxation before it gives up [s].
const SMALLEST_STEP: f64 = 1e-6;

/// Disturbance of the start over the mean edge length.
const IMPERFECTION: f64 = 1e-5;
/// Friction is frozen below this many force tolerances.
const FREEZE: f64 = 300.0;
/// Steps after which friction follows only every tenth step.
const SETTLED: u64 = 30;

/// Least part of their way by which pins are moved at once.
const LEAST_PART: f64 = 1e-3;
/// Way of pins, over the length of a segment of yarn, from which they go in parts and wait.
pub(super) const FAR: f64 = 2.0;
/// Way of pins in one correction over the length of a segment of yarn: what is beside them is left behind.
const PIN_WAY: f64 = 0.5;
/// Residual over the stiffness of yarn, as a strain, below which pins go on.
const PIN_STRAIN: f64 = 1e-2;

/// Whether pins are where they are to be.
pub(super) fn holds(state: &State) -> bool {
    let there = |p: &Pin| state.positions[p.vertex as usize] == p.target;
    state.pins.iter().all(there)
}

/// Part of their way that pins may go at once where segments of yarn bear `most` times their length.
pub(super) fn pin_part(engine: &Engine, state: &State, most: f64) -> f64 {
    let Some(segment) = engine.system.mean_segment() else {
        return 1.0;
    };
    let way = |p: &Pin| (p.target - state.positions[p.vertex as usize]).norm();
    let longest = state.pins.iter().map(way).fold(0.0, f64::max);
    (most * segment / longest).min(1.0)
}

/// Relaxes the state towards rest. `watch(step, residual)` returns false to stop.
pub fn relax(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    watch: &mut dyn FnMut(u64, f64) -> bool,
) -> Result<Relaxed> {
    let mut out = Relaxed {
        totals: Totals::default(),
        end: End::Limit,
    };
    let mut drift = Drift::new(&engine.system, state);
    out.totals.residual = f64::INFINITY;
    let mut h = options.first_step;
    let mut pace = Pace::new(engine);
    state.velocities.fill(Vec3::zeros());
    if options.disturbed {
        disturb(state, IMPERFECTION * engine.system.mean_edge());
    }
    // what is held may have to be moved in parts, so that nothing passes through what is near it
    let mut part = 1.0_f64;
    let mut waits = false;
    let near = PIN_STRAIN * engine.system.yarn_stiffness();
    let far = pin_part(engine, state, FAR) < 1.0;
    while out.totals.substeps < options.max_steps {
        if far {
            part = part.min(pin_part(engine, state, PIN_WAY));
        }
        // pins wait for the yarns beside them
        let fraction = if waits { 0.0 } else { part };
        let exact = pace.exactness(engine);
        // near rest friction is frozen while Newton's method converges: anchors that move after
        // every correction would creep
        let follow = out.totals.residual > FREEZE * options.force_tolerance
            && (out.totals.substeps < SETTLED || out.totals.substeps.is_multiple_of(10));
        let motion = Motion::Relax { exact, follow };
        let (summary, reason) = match engine.attempt(state, h, fraction, motion) {
            Ok(Attempt::Accepted(summary)) => (summary, None),
            Ok(Attempt::Rejected(reason, summary)) => (summary, Some(reason)),
            Err(e) if matches!(e.status, Status::NoAdmissibleState | Status::LinearSolve) => {
                (super::newton::Summary::default(), Some(e.message))
            }
            Err(e) => return Err(e),
        };
        out.totals.newton_iterations += u64::from(summary.iterations);
        out.totals.linear_iterations += summary.linear_iterations;
        pace.learn(engine, &summary, exact);
        if let Some(reason) = reason {
            out.totals.cut = true;
            pace.refused(state);
            if !waits && !holds(state) && part > LEAST_PART {
                part *= 0.5;
                continue;
            }
            h *= 0.25;
            if h < SMALLEST_STEP {
                // nothing lower can be found: rest up to rounding, or a dead end that is reported
                out.totals.residual = engine.residual(state)?;
                if !out.totals.residual.is_finite() {
                    return Err(Error::new(Status::NoAdmissibleState, reason));
                }
                out.end = if out.totals.residual <= options.force_tolerance {
                    End::Rest
                } else {
                    End::Stalled(reason)
                };
                return Ok(out);
            }
            continue;
        }
        out.totals.substeps += 1;
        out.totals.residual = summary.static_residual;
        part = (2.0 * part).min(1.0);
        waits = far && summary.static_residual > near;
        // short steps that are taken do lead on: only refused ones may end the relaxation
        h = pace.taken(engine, state, &summary, h);
        h = h.clamp(SMALLEST_STEP, options.largest_step);
        if options.seam_gap > 0.0
            && engine.system.largest_seam_gap(&state.positions) <= options.seam_gap
        {
            out.end = End::Rest;
            return Ok(out);
        }
        if summary.static_residual <= options.force_tolerance && holds(state) {
            engine.follow(state)?;
            out.totals.residual = engine.residual(state)?;
            if out.totals.residual <= options.force_tolerance {
                out.end = End::Rest;
                return Ok(out);
            }
        }
        if let Some(vertex) = drift.lost(engine, state, options.force_tolerance)? {
            out.end = End::Falling(engine.system.panel_of(vertex));
            return Ok(out);
        }
        if !watch(out.totals.substeps, summary.static_residual) {
            out.end = End::Cancelled;
            return Ok(out);
        }
    }
    Ok(out)
}

/// Moves every free vertex a little, each in its own direction: a sheet that hangs exactly in its
/// plane has no force across it, however unstable it is, and would fold within the plane. Vertices that
/// lie on others stay, for each of a layer to leave the other layer on the same side.
fn disturb(state: &mut State, size: f64) {
    let mut stays = lie_on_others(&state.positions, size);
    for pin in &state.pins {
        stays[pin.vertex as usize] = true;
    }
    let mut bits = 0x9E37_79B9_7F4A_7C15_u64;
    for (i, x) in state.positions.iter_mut().enumerate() {
        let offset = Vec3::from_fn(|_, _| {
            // xorshift (Marsaglia 2003)
            bits ^= bits << 13;
            bits ^= bits >> 7;
            bits ^= bits << 17;
            (bits >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
        });
        if !stays[i] {
            *x += offset * size;
        }
    }
}

/// Which points have another one within a distance along every axis.
fn lie_on_others(x: &[Vec3], distance: f64) -> Vec<bool> {
    let tree = BoxTree::new(x);
    let boxes = tree.fit(|i| Aabb::of(&[x[i as usize]]));
    let reach = Vec3::repeat(distance);
    (0..)
        .zip(x)
        .map(|(i, p)| {
            let mut found = false;
            let around = Aabb::of(&[p - reach, p + reach]);
            tree.query(&boxes, &around, |j| {
                found |= j != i && (x[j as usize] - p).amax() <= distance;
            });
            found
        })
        .collect()
}
