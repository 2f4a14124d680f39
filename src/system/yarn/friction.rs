//! Coulomb friction and viscous resistance of yarns that slide through contacts.
//!
//! With a measure `m` of sliding, its anchor `m_a`, the stiffness `k_f` and the bound `f = mu lambda`:
//!
//! ```text
//! stick   k_f/2 (m - m_a)^2               where k_f |m - m_a| <= f
//! slip    f |m - m_a| - f^2 / (2 k_f)     beyond
//! ```
//!
//! (Cirio et al. 2017, section 4.4). A yarn that crosses others is anchored by `m = u`, with the `lambda` of all contacts
//! with strands of other groups; two strands that lie beside each other are anchored by `m = u_i - u_{i+1}` with the
//! `lambda` between them. `lambda` is that of the last accepted step, so that this is a convex potential within
//! a step; afterwards, and only after an accepted step, a slipping anchor is drawn along to the
//! distance `f/k_f`. Anchors are in the State, one for each contact and yarn. The Hessian is `k_f` in stick and 0
//! in slip; where it is not to be exact, slip takes `f/|m - m_a|`, the curvature of the parabola that touches the
//! potential there and lies above it: a correction that turns a slip around then meets the friction it
//! will have. It is never part of stiffness-proportional damping. Viscous resistance is `d_f/(2 dt) (m - m0)^2` in `u`
//! alone. SI units.

use super::super::state::{State, StrandState};
use super::kernel::{Kernel, Local, Lower};
use crate::yarn::YarnMesh;

/// Friction of a strand, by its own coordinate (`Kernel<1>`) or against the next strand in its
/// stack (`Kernel<2>`).
pub struct Rubbing {
    /// The strand, an index into the stacks.
    pub strand: u32,
    /// Coefficient of friction with the strand behind and with the one in front, 0 where they do not count.
    pub friction: [f64; 2],
    /// `k_f` [N/m].
    pub stiffness: f64,
    /// Viscous resistance [N s/m].
    pub viscosity: f64,
    anchor: f64,
    bound: f64,
}

/// Strands at the coordinates `u` without friction: every anchor where its measure is, no normal force.
pub fn loose(mesh: &YarnMesh, u: &[f64]) -> Vec<StrandState> {
    let at = |s: usize| u[mesh.stacks[s].incidence as usize];
    (0..mesh.stacks.len())
        .map(|s| StrandState {
            anchor: at(s),
            // of no use in the last strand of a stack
            beside: at(s) - at((s + 1).min(mesh.stacks.len() - 1)),
            contact: 0.0,
        })
        .collect()
}

/// Largest friction of a strand [N]: `friction` with the strand behind and in front.
pub(super) fn bound(strand: usize, friction: [f64; 2], state: &State) -> f64 {
    let behind = if friction[0] > 0.0 {
        friction[0] * state.strands[strand - 1].contact
    } else {
        0.0
    };
    behind + friction[1] * state.strands[strand].contact
}

/// Where an anchor is drawn to.
pub(super) fn drawn(measure: f64, anchor: f64, stiffness: f64, bound: f64) -> f64 {
    let reach = bound / stiffness;
    let off = measure - anchor;
    if off.abs() > reach {
        measure - reach.copysign(off)
    } else {
        anchor
    }
}

impl Rubbing {
    /// Friction of a strand; anchor and bound come with `begin`.
    pub fn new(strand: u32, friction: [f64; 2], stiffness: f64, viscosity: f64) -> Self {
        Self {
            strand,
            friction,
            stiffness,
            viscosity,
            anchor: 0.0,
            bound: 0.0,
        }
    }

    fn energy(&self, m: f64) -> f64 {
        let off = (m - self.anchor).abs();
        if self.stiffness * off <= self.bound {
            0.5 * self.stiffness * off * off
        } else {
            self.bound * (off - 0.5 * self.bound / self.stiffness)
        }
    }

    /// Derivative of the energy.
    fn force(&self, m: f64) -> f64 {
        (self.stiffness * (m - self.anchor)).clamp(-self.bound, self.bound)
    }

    /// Second derivative, or the curvature of the majorant.
    fn curvature(&self, m: f64, exactness: f64) -> f64 {
        let off = (m - self.anchor).abs();
        if self.stiffness * off <= self.bound {
            self.stiffness
        } else if exactness == 1.0 {
            0.0
        } else {
            self.bound / off
        }
    }
}

impl Kernel<1> for Rubbing {
    const NAME: &'static str = "sliding_friction";
    const POSITIONS: usize = 0;
    const LOOKS_BACK: bool = true;
    const LAGGED: bool = true;

    fn value(&self, at: &Local<'_, 1>) -> f64 {
        let moved = at.q[0] - at.q0[0];
        self.energy(at.q[0]) + 0.5 * self.viscosity * at.inv_dt * moved * moved
    }

    fn gradient(&self, at: &Local<'_, 1>, out: &mut [f64; 1]) {
        let moved = at.q[0] - at.q0[0];
        out[0] = self.force(at.q[0]) + self.viscosity * at.inv_dt * moved;
    }

    fn derivatives(
        &self,
        at: &Local<'_, 1>,
        exactness: f64,
        gradient: &mut [f64; 1],
        out: &mut Lower<1>,
    ) {
        Kernel::<1>::gradient(self, at, gradient);
        out[0][0] = self.curvature(at.q[0], exactness) + self.viscosity * at.inv_dt;
    }

    fn begin(&mut self, _: &Local<'_, 1>, _: &[f64; 1], state: &State) {
        let strand = self.strand as usize;
        self.anchor = state.strands[strand].anchor;
        self.bound = bound(strand, self.friction, state);
    }

    fn accept(&self, at: &Local<'_, 1>, state: &mut State) {
        let anchor = &mut state.strands[self.strand as usize].anchor;
        *anchor = drawn(at.q[0], *anchor, self.stiffness, self.bound);
    }
}

impl Kernel<2> for Rubbing {
    const NAME: &'static str = "parallel_friction";
    const POSITIONS: usize = 0;
    const LAGGED: bool = true;

    fn value(&self, at: &Local<'_, 2>) -> f64 {
        self.energy(at.q[0] - at.q[1])
    }

    fn gradient(&self, at: &Local<'_, 2>, out: &mut [f64; 2]) {
        let force = self.force(at.q[0] - at.q[1]);
        *out = [force, -force];
    }

    fn derivatives(
        &self,
        at: &Local<'_, 2>,
        exactness: f64,
        gradient: &mut [f64; 2],
        out: &mut Lower<2>,
    ) {
        Kernel::<2>::gradient(self, at, gradient);
        let k = self.curvature(at.q[0] - at.q[1], exactness);
        out[0][0] = k;
        out[1][0] = -k;
        out[1][1] = k;
    }

    fn begin(&mut self, _: &Local<'_, 2>, _: &[f64; 2], state: &State) {
        let strand = self.strand as usize;
        self.anchor = state.strands[strand].beside;
        self.bound = bound(strand, self.friction, state);
    }

    fn accept(&self, at: &Local<'_, 2>, state: &mut State) {
        let anchor = &mut state.strands[self.strand as usize].beside;
        *anchor = drawn(at.q[0] - at.q[1], *anchor, self.stiffness, self.bound);
    }
}
