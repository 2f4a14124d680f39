//! Sewing: pulls the seams of placed panels together, harder where they stay open, and around the core
//! of bodies that stand in their way.
//!
//! Sewing knows no weight and no friction. A limb that stands in the way of a seam (a sleeve that is
//! placed beside an arm, not around it) holds it open however hard it is pulled: the pull presses against the
//! limb from both sides. What is left of a body [`CORE`] below its surface is thin where the body is, so
//! that the seam slides off it, to the side on which it has less far to go; the body then grows back and
//! pushes the sewn cloth out.

use super::drape::{Plan, Watch, stage};
use super::engine::Engine;
use super::relax::{RelaxOptions, Relaxed};
use crate::error::Result;
use crate::math::Vec3;
use crate::system::state::State;

/// Part of the progress bar that sewing fills.
const SEW: (f64, f64) = (0.0, 0.25);

/// Seams with a larger gap than this are pulled harder [m]; below it they are sewn.
pub(super) const NEARLY_CLOSED: f64 = 8e-3;
/// How often the pull is doubled.
const DOUBLINGS: usize = 5;

/// How far below the surface the core of a body begins that seams are closed around [m], in how many
/// pieces that grows back, and steps for each.
const CORE: f64 = 0.03;
const GROWTHS: u32 = 12;
const GROWTH_STEPS: u64 = 20;
/// Depth in a body beyond which cloth is on the wrong side of a limb [m].
const SUNK: f64 = 1e-3;

/// A gap at which the seams count as closed [m].
const CLOSED: f64 = 1e-3;

/// Pulls the seams together without weight and friction. False if the drape is to end there.
pub(super) fn sew(
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
        disturbed: false,
    };
    let gravity = std::mem::replace(&mut state.gravity, Vec3::zeros());
    let smooth = engine.system.bodies.with_friction(0.0);
    let rough = std::mem::replace(&mut engine.system.bodies, smooth);
    let settings = engine.settings.clone();
    let placed = state.positions.clone();
    let done = close(engine, state, &options, all, watch)
        .and_then(|()| close_around(engine, state, placed, &options, all, watch));
    engine.system.bodies = rough;
    state.gravity = gravity;
    state.body_anchors.clear();
    let restored = engine.set_settings(&settings);
    done?;
    restored?;
    Ok(!all.is_over())
}

/// Sews a garment that stayed open from its placement again, around bodies of which only the core is
/// left, and lets these grow while the seams hold: a limb that stands in the way of a seam, as where
/// sleeves are placed beside an arm, is passed on the side on which its axis lies.
fn close_around(
    engine: &mut Engine,
    state: &mut State,
    placed: Vec<Vec3>,
    options: &RelaxOptions,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<()> {
    let gap = engine.system.largest_seam_gap(&state.positions);
    if all.is_over() || state.bodies.is_empty() || gap < NEARLY_CLOSED {
        return Ok(());
    }
    let stuck = state.positions.clone();
    let whole = engine.system.bodies.clone();
    state.positions = placed;
    state.body_anchors.clear();
    state.pair_anchors.clear();
    for k in 0..=GROWTHS {
        let inset = CORE * f64::from(GROWTHS - k) / f64::from(GROWTHS);
        engine.system.bodies = whole.shrunk(inset);
        if k == 0 {
            close(engine, state, options, all, watch)?;
        } else {
            let options = RelaxOptions {
                seam_gap: 0.0,
                max_steps: options.max_steps.min(GROWTH_STEPS),
                ..*options
            };
            stage(engine, state, &options, SEW, "sew", all, watch)?;
        }
        if all.is_over() {
            break;
        }
    }
    engine.system.bodies = whole;
    let system = &engine.system;
    let sunk = system.smallest_gap(&state.positions) < (-SUNK).min(system.smallest_gap(&stuck));
    if sunk || system.largest_seam_gap(&state.positions) > gap {
        state.positions = stuck;
    }
    Ok(())
}

/// Sews with the pull of the settings; a seam that stays open under it, because the garment is
/// tight there, is pulled twice as hard, and so on.
fn close(
    engine: &mut Engine,
    state: &mut State,
    options: &RelaxOptions,
    all: &mut Relaxed,
    watch: &mut Watch<'_>,
) -> Result<()> {
    let mut settings = engine.settings.clone();
    stage(engine, state, options, SEW, "sew", all, watch)?;
    for _ in 0..DOUBLINGS {
        if all.is_over() || engine.system.largest_seam_gap(&state.positions) < NEARLY_CLOSED {
            break;
        }
        settings.seam_pull *= 2.0;
        engine.set_settings(&settings)?;
        stage(engine, state, options, SEW, "sew", all, watch)?;
    }
    Ok(())
}
