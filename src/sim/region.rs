//! Regions of yarns that change while a simulation lives.
//!
//! The garment is compiled anew beside the one that lives, which stays as it is if anything cannot be, and what there is
//! goes over, by name:
//!
//! * vertices stay where they are: those that followed yarns and have triangles again lie where they followed them to;
//! * nodes, passages and strands that are there before and after keep positions, velocities, coordinates, friction and normals bit by
//!   bit, but for nodes that ride on triangles now or are blended with them, which go where those say;
//! * what comes in lies in the triangles as they are, `x = B v + lift n`, with the velocity of that, without friction;
//! * yarn that comes in or whose nodes were moved goes on from what the yarn has beside it with the same stretch: else slip would become
//!   strain there, again in every change.
//!
//! Velocities are those of the cloth, so the momentum changes as the mass does where yarns do not weigh what triangles do. Yarns that
//! came out of contacts must stay whole: triangles cannot tell what has come apart. Pins pass from vertices to yarns and back ([`super::hold`]).

use super::yarns::YarnPart;
use super::{Compiled, Sim};
use crate::blend::embed::carried_along;
use crate::error::{Error, Result};
use crate::fabric::fitted::check_regions;
use crate::math::Vec3;
use crate::pattern::BlendRegion;
use crate::solve::engine::Engine;
use crate::system::points::Points;
use crate::system::state::{BodyAnchor, PairAnchor, State};
use crate::system::yarn::friction::loose;
use crate::yarn::names::Name;
use crate::yarn::{Names, Topology, YarnMesh};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Distance of two nodes, over the yarn between them, below which they are at one point.
const POINT: f64 = 1e-3;
/// Most that a segment that comes in may be longer or shorter than laid, over that.
const MOST_SLIP: f64 = 0.8;

/// What a change of regions did.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RegionChange {
    /// Mass of all that is simulated before and after [kg].
    pub masses: [f64; 2],
    /// Nodes of yarns that stayed.
    pub kept: usize,
    /// Nodes that came in.
    pub laid: usize,
    /// Nodes that went.
    pub gone: usize,
}

/// What coordinates come from.
struct Was<'a> {
    u: &'a [f64],
    nodes: &'a [Vec3],
}

/// For what there is now its number before.
pub(super) struct Before {
    pub(super) nodes: Vec<Option<u32>>,
    passages: Vec<Option<u32>>,
}

impl Sim {
    /// Puts these regions of yarns in the place of those that there are and carries the state over; nothing changes on error. A region
    /// that cannot be is refused, and so is one in which a held point would not move by itself any more and nothing takes its place, or
    /// what yarns have left would be laid anew.
    pub fn set_blend_regions(&mut self, regions: Vec<BlendRegion>) -> Result<RegionChange> {
        let mut garment = self.garment.clone();
        garment.blend_regions = regions;
        garment.check_geometry()?;
        check_regions(&garment, &self.first_settings)?;
        let Compiled {
            mut yarns,
            fingerprint,
            mut system,
        } = Compiled::new(&garment, &self.mesh, &self.settings, &self.first_settings)?;
        let old = self.yarns.as_ref();
        let topology = match old {
            Some(old) => self.topology_in(old, yarns.as_ref())?,
            None => Topology::default(),
        };
        if let Some(part) = &mut yarns
            && topology != Topology::default()
        {
            part.now = Arc::new(part.now.present(&topology)?);
            part.topology.clone_from(&topology);
        }
        let before = Before::new(old, yarns.as_ref());
        let mut state = self.carried_over(&before, topology, yarns.as_ref())?;
        let masses = self.point_masses();
        system.bodies = self.engine().system.bodies.clone();
        let mut engine = Engine::new(system, &self.settings);
        engine.take_contacts(&state)?;
        self.carry_holds(&before, yarns.as_ref(), &engine.system.points, &mut state)?;
        let kept = before.nodes.iter().flatten().count();
        let change = RegionChange {
            masses: [
                masses.iter().sum(),
                engine.system.points.masses.iter().sum(),
            ],
            kept,
            laid: before.nodes.len() - kept,
            gone: self.yarn_nodes().len() - kept,
        };
        if let (Some(part), Some(now)) = (&mut yarns, &engine.system.yarns) {
            part.now = now.clone();
        }
        self.garment = garment;
        self.state = state;
        self.engine = engine.into();
        self.yarns = yarns;
        self.origin.garment = fingerprint;
        self.epoch += 1;
        self.yarn_epoch += 1;
        Ok(change)
    }

    /// What yarns have left, in the new part; they must be whole there.
    fn topology_in(&self, old: &YarnPart, new: Option<&YarnPart>) -> Result<Topology> {
        if old.topology == Topology::default() {
            return Ok(Topology::default());
        }
        let laid = old.now.mesh.uv.len() - old.topology.split.len();
        let empty = YarnMesh::default();
        let mesh = new.map_or(&empty, |part| &part.now.mesh);
        let (nodes, passages) = match new {
            Some(part) => (numbers(&part.names.nodes), numbers(&part.names.passages)),
            None => (BTreeMap::new(), BTreeMap::new()),
        };
        let node = |n: u32| {
            let there = nodes.get(&old.names.nodes[n as usize]).copied();
            there.filter(|n| mesh.is_whole(*n))
        };
        let passage = |i: u32| {
            let there = passages.get(&old.names.passages[i as usize]).copied();
            there.filter(|i| mesh.is_whole(mesh.incidences[*i as usize].node))
        };
        (old.topology.in_part([laid, mesh.uv.len()], passage, node)).map_err(|i| {
            let [panel, u, v] = self.place_of(old, i);
            Error::state(format!(
                "panel '{}': yarns have come out of contacts near ({u:.4}, {v:.4}) m; the region must hold them, as triangles \
                 cannot tell it",
                self.garment.panels[panel as usize].name
            ))
        })
    }

    /// Panel and flat place where a yarn that has left passage `i` was laid, or lies nearest to that.
    fn place_of(&self, old: &YarnPart, i: u32) -> [f64; 3] {
        let passages = &old.now.passages;
        let near = passages.partition_point(|p| *p < i).min(passages.len() - 1);
        let mesh = &old.now.mesh;
        let n = mesh.incidences[near].node as usize;
        [f64::from(mesh.node_panel[n]), mesh.uv[n].x, mesh.uv[n].y]
    }

    /// The state of vertices and of the new part's yarns.
    fn carried_over(
        &self,
        before: &Before,
        topology: Topology,
        part: Option<&YarnPart>,
    ) -> Result<State> {
        let (old, count) = (&self.state, self.mesh.uv.len());
        let mut state = State {
            positions: old.positions[..count].to_vec(),
            velocities: old.velocities[..count].to_vec(),
            topology,
            u: Vec::new(),
            u_rates: Vec::new(),
            sliding: Vec::new(),
            strands: Vec::new(),
            yarn_normals: Vec::new(),
            ..old.clone()
        };
        let Some(part) = part else {
            return Ok(state);
        };
        let mesh = &part.now.mesh;
        let (places, rates) = carried_along(&self.mesh, &state.positions, &state.velocities, mesh)?;
        for (values, old, new) in [
            (&mut state.positions, &old.positions, places),
            (&mut state.velocities, &old.velocities, rates),
        ] {
            values.extend(picked(&before.nodes, &old[count..], |n| new[n]));
            if let Some(filter) = &part.coupling.filter {
                filter.settle(values);
            }
            part.coupling.riders.carry(values);
        }
        let list = &before.passages;
        let was = Was {
            u: &old.u,
            nodes: &old.positions[count..],
        };
        state.u = slid_along(before, mesh, &was, &state.positions[count..]);
        state.u_rates = picked(list, &old.u_rates, |_| 0.0);
        state.sliding = picked(list, &old.sliding, |_| false);
        for (i, incidence) in mesh.incidences.iter().enumerate() {
            if !incidence.slides {
                (state.sliding[i], state.u_rates[i]) = (false, 0.0);
            }
        }
        state.yarn_normals = picked(&before.nodes, &old.yarn_normals, |_| Vec3::zeros());
        self.check_lengths(before, mesh, &state.u)?;
        state.strands = loose(mesh, &state.u);
        if let Some(laid) = self.yarns() {
            self.carry_strands(before, [laid, mesh], &mut state);
        }
        Ok(state)
    }

    /// Friction of strands: all of it where the next strand of the stack is the same, else what the yarn has by itself.
    fn carry_strands(&self, before: &Before, [old, new]: [&YarnMesh; 2], state: &mut State) {
        let mut place = vec![0; old.incidences.len()];
        let mut next = vec![None; old.incidences.len()];
        for n in 0..old.uv.len() {
            let stack = old.stack(n);
            for (k, strand) in stack.iter().enumerate() {
                let i = strand.incidence as usize;
                place[i] = old.stack_starts[n] as usize + k;
                next[i] = stack.get(k + 1).map(|s| s.incidence);
            }
        }
        for n in 0..new.uv.len() {
            let stack = new.stack(n);
            for (k, strand) in stack.iter().enumerate() {
                let Some(i) = before.passages[strand.incidence as usize] else {
                    continue;
                };
                // what was put elsewhere along the yarn takes its anchors with it
                let shift =
                    |now: u32, before: u32| state.u[now as usize] - self.state.u[before as usize];
                let own = shift(strand.incidence, i);
                let mut was = self.state.strands[place[i as usize]];
                was.anchor += own;
                let now = &mut state.strands[new.stack_starts[n] as usize + k];
                let beside = stack.get(k + 1).map(|s| s.incidence);
                match (beside, next[i as usize]) {
                    (None, None) => *now = was,
                    (Some(b), Some(j)) if before.passages[b as usize] == Some(j) => {
                        was.beside += own - shift(b, j);
                        *now = was;
                    }
                    _ => now.anchor = was.anchor,
                }
            }
        }
    }

    /// Refuses yarns that come in beside one that has slid nearly as far.
    fn check_lengths(&self, before: &Before, mesh: &YarnMesh, u: &[f64]) -> Result<()> {
        for y in 0..mesh.yarn_count() {
            for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
                let known = before.passages[i - 1].is_some() && before.passages[i].is_some();
                let laid = mesh.incidences[i].u - mesh.incidences[i - 1].u;
                let length = u[i] - u[i - 1];
                if !known && !((length - laid).abs() <= MOST_SLIP * laid) {
                    let n = mesh.incidences[i].node as usize;
                    return Err(Error::state(format!(
                        "panel '{}': a yarn has slid so far that {length:.3e} m of it would lie near ({:.4}, {:.4}) m, where {laid:.3e} m \
                         are laid",
                        self.garment.panels[mesh.node_panel[n] as usize].name,
                        mesh.uv[n].x,
                        mesh.uv[n].y
                    )));
                }
            }
        }
        Ok(())
    }

    /// Pins, which go on holding what moves by itself, and friction anchors of what still touches.
    fn carry_holds(
        &self,
        before: &Before,
        part: Option<&YarnPart>,
        points: &Points,
        state: &mut State,
    ) -> Result<()> {
        let count = self.mesh.uv.len();
        let mut now = vec![None; self.yarn_nodes().len()];
        for (n, old) in (0..).zip(&before.nodes) {
            if let Some(old) = old {
                now[*old as usize] = Some(n);
            }
        }
        let there = |point: u32| match (point as usize).checked_sub(count) {
            None => Some(point),
            Some(node) => now[node].map(|n: u32| n + count as u32),
        };
        state.pins = self.carry_pins(before, part, there, state)?;
        let touches = |p: u32| there(p).filter(|p| points.areas[*p as usize] > 0.0);
        state.body_anchors = (self.state.body_anchors.iter())
            .filter_map(|a| touches(a.vertex).map(|vertex| BodyAnchor { vertex, ..*a }))
            .collect();
        state.body_anchors.sort_by_key(|a| (a.vertex, a.body));
        state.pair_anchors = (self.state.pair_anchors.iter())
            .filter_map(|pair| {
                let [a, b] = [touches(pair.a)?, touches(pair.b)?];
                let offset = if a < b { pair.offset } else { -pair.offset };
                Some(PairAnchor {
                    a: a.min(b),
                    b: a.max(b),
                    offset,
                    ..*pair
                })
            })
            .collect();
        state.pair_anchors.sort_by_key(|p| (p.a, p.b));
        Ok(())
    }
}

impl Before {
    fn new(old: Option<&YarnPart>, new: Option<&YarnPart>) -> Self {
        let none = Names::default();
        let names = old.map_or(&none, |part| &part.names);
        let (nodes, passages) = (numbers(&names.nodes), numbers(&names.passages));
        let mut before = Self {
            nodes: Vec::new(),
            passages: Vec::new(),
        };
        let Some(new) = new else {
            return before;
        };
        let was = |name: &Name| nodes.get(name).copied();
        before.nodes = new.names.nodes.iter().map(was).collect();
        // nodes that came out of others are counted on in the same order
        let first = names.nodes.len() as u32;
        let split = (first..).take(new.topology.split.len());
        before.nodes.extend(split.map(Some));
        let there = old.map_or(&[][..], |part| &part.now.passages);
        let was = |laid: &u32| {
            let laid = passages.get(&new.names.passages[*laid as usize])?;
            there.binary_search(laid).ok().map(|i| i as u32)
        };
        before.passages = new.now.passages.iter().map(was).collect();
        before
    }
}

/// Material coordinates. A passage that was there and whose node stays keeps its own. The others follow along the yarn from the nearest
/// of those, segment by segment: where both ends were there a segment keeps its stretch `|x1 - x0|/(u1 - u0)`, else it is as long
/// as laid; between two that keep theirs all lengths are scaled to fit.
fn slid_along(before: &Before, mesh: &YarnMesh, was: &Was<'_>, nodes: &[Vec3]) -> Vec<f64> {
    let node = |i: usize| mesh.incidences[i].node as usize;
    let there = |i: usize| Some((before.passages[i]?, before.nodes[node(i)]?));
    let stays = |i: usize| there(i).is_some_and(|(_, n)| was.nodes[n as usize] == nodes[node(i)]);
    let length = |i: usize| {
        let laid = mesh.incidences[i + 1].u - mesh.incidences[i].u;
        let (Some((p, a)), Some((q, b))) = (there(i), there(i + 1)) else {
            return laid;
        };
        let [a, b] = [a, b].map(|n| was.nodes[n as usize]);
        let (apart, length) = ((b - a).norm(), was.u[q as usize] - was.u[p as usize]);
        let now = (nodes[node(i + 1)] - nodes[node(i)]).norm();
        let grown = if apart > POINT * length {
            now / apart
        } else {
            1.0
        };
        length * grown.clamp(1.0 - MOST_SLIP, 1.0 / (1.0 - MOST_SLIP))
    };
    let known = |i: usize| before.passages[i].map_or(mesh.incidences[i].u, |p| was.u[p as usize]);
    let mut u: Vec<f64> = (0..mesh.incidences.len()).map(known).collect();
    for ends in mesh.starts.windows(2) {
        let range = ends[0] as usize..ends[1] as usize;
        let mut held: Vec<usize> = range.clone().filter(|i| stays(*i)).collect();
        if held.is_empty() {
            held.extend(range.clone().find(|i| there(*i).is_some()));
        }
        let (Some(&first), Some(&last)) = (held.first(), held.last()) else {
            continue;
        };
        for i in (range.start..first).rev() {
            u[i] = u[i + 1] - length(i);
        }
        for pair in held.windows(2) {
            let between = pair[0]..pair[1];
            let whole: f64 = between.clone().map(length).sum();
            let scale = (u[pair[1]] - u[pair[0]]) / whole;
            for i in between.take(pair[1] - pair[0] - 1) {
                u[i + 1] = u[i] + scale * length(i);
            }
        }
        for i in last + 1..range.end {
            u[i] = u[i - 1] + length(i - 1);
        }
    }
    u
}

fn numbers(names: &[Name]) -> BTreeMap<Name, u32> {
    names.iter().copied().zip(0..).collect()
}

/// What there was, and `new` where there was nothing.
fn picked<T: Copy>(before: &[Option<u32>], old: &[T], new: impl Fn(usize) -> T) -> Vec<T> {
    let value = |(k, b): (usize, &Option<u32>)| b.map_or_else(|| new(k), |b| old[b as usize]);
    before.iter().enumerate().map(value).collect()
}
