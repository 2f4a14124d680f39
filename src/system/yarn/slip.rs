//! Which contacts need sliding unknowns.
//!
//! A contact whose coordinate is fixed carries whatever force holds it there. It gains an unknown when the elastic force
//! along the yarn exceeds what friction can hold, `mu lambda` of its crossings and of the strands beside it, and
//! loses it again when it has come to rest with the force below a part of that. A pure function of the State and of
//! the forces of the last accepted step. SI units.

use super::friction::bound;
use super::springs::StrandFriction;
use crate::system::state::State;
use crate::yarn::YarnMesh;

/// When coordinates come and go.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SlipRule {
    /// Part of the holding force below which a coordinate at rest is fixed again, below 1.
    pub hold: f64,
    /// Rate below which a coordinate is at rest [m/s].
    pub rest: f64,
    /// Force that no coordinate is freed for [N].
    pub least: f64,
}

impl Default for SlipRule {
    fn default() -> Self {
        Self {
            hold: 0.8,
            rest: 1e-5,
            least: 1e-9,
        }
    }
}

/// What friction can hold at a strand [N]: at its crossings, and with strands beside it.
fn holds(frictions: &[StrandFriction], strand: usize, state: &State) -> [f64; 2] {
    let crossing = bound(strand, frictions[strand].crossing, state);
    let mut beside = frictions[strand].beside * state.strands[strand].contact;
    if strand > 0 {
        // 0 where the strand before is of another stack
        beside += frictions[strand - 1].beside * state.strands[strand - 1].contact;
    }
    [crossing, beside]
}

/// Which incidences slide in the next step. `forces` are those along the yarns, of
/// [`Compression`](super::compression::Compression); `present` says which slide now.
pub fn sliding(
    mesh: &YarnMesh,
    frictions: &[StrandFriction],
    state: &State,
    forces: &[f64],
    present: &[bool],
    rule: &SlipRule,
) -> Vec<bool> {
    let mut out = vec![false; present.len()];
    for (s, strand) in mesh.stacks.iter().enumerate() {
        let i = strand.incidence as usize;
        if !mesh.incidences[i].slides {
            continue;
        }
        let limit: f64 = holds(frictions, s, state).iter().sum();
        let force = forces[i].abs();
        out[i] = if present[i] {
            state.u_rates[i].abs() > rule.rest || force > rule.hold * limit + rule.hold * rule.least
        } else {
            force > limit + rule.least
        };
    }
    out
}

/// Sets the anchors of coordinates that begin to slide so that friction goes on with the force that held
/// them, as far as it can.
pub fn set_anchors(
    mesh: &YarnMesh,
    frictions: &[StrandFriction],
    forces: &[f64],
    before: &[bool],
    after: &[bool],
    state: &mut State,
) {
    for (s, strand) in mesh.stacks.iter().enumerate() {
        let i = strand.incidence as usize;
        let gained = |i: usize| after[i] && !before[i];
        if gained(i) {
            let [crossing, _] = holds(frictions, s, state);
            let held = forces[i].clamp(-crossing, crossing);
            state.strands[s].anchor = state.u[i] - held / frictions[s].anchor;
        }
        if frictions[s].beside > 0.0 {
            let j = mesh.stacks[s + 1].incidence as usize;
            if gained(i) || gained(j) {
                state.strands[s].beside = state.u[i] - state.u[j];
            }
        }
    }
}
