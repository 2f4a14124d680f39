//! What the contacts of yarns carry, and which of them slide, from one accepted step to the next.

use super::YarnOptions;
use super::compression::{Compression, YarnPlace};
use super::passing::{Passing, passings};
use super::release::{Nearness, nearness, release};
use super::slip::{self, SlipRule};
use super::springs::{self, StrandFriction};
use super::stack::StackRule;
use crate::error::Result;
use crate::math::parallel::Workers;
use crate::system::state::State;
use crate::yarn::Yarns;
use std::sync::Arc;

/// Length of a segment over its laid length below which contacts that hold each other slide no nearer: the
/// yarns' thickness keeps them apart.
const JAMMED: f64 = 0.2;

/// Where yarns may slide.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Sliding {
    /// Nowhere: contacts keep their material coordinates.
    Nowhere,
    /// Where friction does not hold them.
    #[default]
    WhereSlipping,
    /// Everywhere, friction being a stiff spring where it holds.
    Everywhere,
}

/// Normal forces and friction of all contacts.
pub struct Contacts {
    laid: Arc<Yarns>,
    yarns: Arc<Yarns>,
    passings: Vec<Passing>,
    compression: Compression,
    frictions: Vec<StrandFriction>,
    rule: SlipRule,
    held: Vec<bool>,
}

impl Contacts {
    /// Rest data of the contacts of yarns that were laid otherwise, or so.
    pub fn new(laid: Arc<Yarns>, yarns: Arc<Yarns>, options: &YarnOptions) -> Result<Self> {
        let (mesh, materials) = (&yarns.mesh, &yarns.materials);
        Ok(Self {
            compression: Compression::new(mesh, materials, options, StackRule::default())?,
            frictions: springs::frictions(mesh, materials)?,
            rule: SlipRule::default(),
            held: Vec::new(),
            passings: passings(mesh),
            laid,
            yarns,
        })
    }

    /// Takes the normal forces of an accepted step and says which yarns slide in the next, and which contacts they
    /// have left, if any may be (`releases`): then the yarns as they are now are returned, for which this is to be made
    /// anew. Yarns do not slide at nodes that are held.
    pub fn follow(
        &mut self,
        sliding: Sliding,
        releases: bool,
        state: &mut State,
        workers: &Workers,
    ) -> Result<Option<Yarns>> {
        let mesh = &self.yarns.mesh;
        let first = state.positions.len() - mesh.uv.len();
        self.held.clear();
        self.held.resize(mesh.uv.len(), false);
        for pin in &state.pins {
            if let Some(node) = (pin.vertex as usize).checked_sub(first) {
                self.held[node] = true;
            }
        }
        let place = YarnPlace {
            x: &state.positions[first..],
            u: &state.u,
            held: &self.held,
            gravity: state.gravity,
        };
        self.compression
            .update(&place, workers, &mut state.yarn_normals, &mut state.strands);
        let forces = self.compression.sliding_forces();
        let mut next = match sliding {
            Sliding::Nowhere => vec![false; state.sliding.len()],
            Sliding::Everywhere => mesh.incidences.iter().map(|i| i.slides).collect(),
            Sliding::WhereSlipping => slip::sliding(
                mesh,
                &self.frictions,
                state,
                forces,
                &state.sliding,
                &self.rule,
            ),
        };
        if !releases && sliding == Sliding::WhereSlipping {
            // at rest friction would fix and free a coordinate in turn as the normal forces follow: its anchor
            // holds it as well
            for (slides, before) in next.iter_mut().zip(&state.sliding) {
                *slides |= before;
            }
        }
        for (slides, incidence) in next.iter_mut().zip(&mesh.incidences) {
            *slides &= !self.held[incidence.node as usize];
        }
        for y in 0..mesh.yarn_count() {
            for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
                if self.is_jammed(i - 1, releases, state) {
                    next[i - 1] &= forces[i - 1] < 0.0 && state.u_rates[i - 1] <= 0.0;
                    next[i] &= forces[i] > 0.0 && state.u_rates[i] >= 0.0;
                }
            }
        }
        if next != state.sliding {
            let before = std::mem::replace(&mut state.sliding, next);
            let after = std::mem::take(&mut state.sliding);
            slip::set_anchors(mesh, &self.frictions, forces, &before, &after, state);
            for (rate, slides) in state.u_rates.iter_mut().zip(&after) {
                if !slides {
                    *rate = 0.0;
                }
            }
            state.sliding = after;
        }
        if !releases {
            return Ok(None);
        }
        // where triangles have a part nothing comes off
        for (node, held) in (0..).zip(&mut self.held) {
            *held |= !mesh.is_whole(node);
        }
        release(&self.laid, &self.yarns, &self.passings, &self.held, state)
    }

    /// Whether the passages `i` and `i + 1` of a yarn do not slide nearer to each other.
    fn is_jammed(&self, i: usize, releases: bool, state: &State) -> bool {
        let passages = [i, i + 1].map(|i| &self.yarns.mesh.incidences[i]);
        let mesh = &self.yarns.mesh;
        let stays = |node: u32| self.held[node as usize] || !mesh.is_whole(node);
        let held = passages.iter().any(|p| stays(p.node));
        let passing = self.passings[i];
        if held || passing == Passing::Kept {
            return state.u[i + 1] - state.u[i] < JAMMED * (passages[1].u - passages[0].u);
        }
        match nearness(&self.yarns, i, passing, state) {
            Nearness::Apart => false,
            Nearness::Gripped => true,
            Nearness::Pulled => !releases,
        }
    }
}
