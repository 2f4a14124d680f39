//! Contacts that yarns leave: after an accepted step the topology in the State follows.
//!
//! Where a segment has become shorter than half a yarn's radius (half its laid length if that is less) and yarns
//! slide there:
//!
//! * An end takes its last contact off: that passage is gone, the end stays, laid straight on from the passage before.
//! * A contact passes a node of one yarn (at a fifth of the radius): that passage is gone.
//! * The last loop before an end comes out: its two nodes become one for each yarn, at the same places. What lay
//!   behind or before the same stretch of yarn at the contacts on both sides of it is then no longer held either, and
//!   comes apart likewise.
//!
//! An end and a loop come off only if the yarn that goes on from there is under a tension above `k_b/(8 R^2)`: the
//! bending energy per length of a yarn that lies around another one, which has to be bent straight to come out.
//! Cloth that is held well does not fray by its own weight. Where inertia has carried them to a fifth of the radius they come off
//! at once.
//!
//! Where several yarns of one group are left at a node, each gets its own. Material coordinates of ends and of nodes
//! of one yarn are constants from then on, so that lengths and masses stay what they are. Momentum: what each yarn
//! loses of `sum rho/2 (du (x0' + x1') - (x1 - x0)(u0' + u1'))` the nodes that it changed at get back as velocity.
//! Anchors there begin anew. SI units.

use super::passing::{Passages, Passing};
use crate::error::Result;
use crate::math::Vec3;
use crate::system::state::{State, StrandState};
use crate::yarn::{Topology, YarnMesh, Yarns};

/// Length of a segment, over the radius and over its laid length, that no contact lasts below.
const SHORT: f64 = 0.5;
/// The same that no grip keeps, and where a contact passes a node of one yarn.
const PASSED: f64 = 0.2;

/// What comes off.
struct Change<'a> {
    yarns: &'a Yarns,
    passages: Passages<'a>,
    /// Laid nodes that new ones come out of.
    split: Vec<u32>,
    /// Passage and node that each new node takes over.
    moved: Vec<(usize, u32)>,
    /// Passages beside what has come off, each a yarn's.
    touched: Vec<usize>,
    /// Ends and the passage that they lose.
    slipped: Vec<(usize, usize)>,
}

/// How near two passages of a yarn have come that may pass each other.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Nearness {
    /// There is room between them.
    Apart,
    /// No room, and the yarn's bending holds what should come off.
    Gripped,
    /// Pulled off.
    Pulled,
}

/// How near the passages `i` and `i + 1` are.
pub(super) fn nearness(yarns: &Yarns, i: usize, passing: Passing, state: &State) -> Nearness {
    let mesh = &yarns.mesh;
    let laid = mesh.incidences[i + 1].u - mesh.incidences[i].u;
    let yarn = mesh.starts.partition_point(|&s| s as usize <= i) - 1;
    let material = yarns.material(yarn);
    let length = (state.u[i + 1] - state.u[i]) / material.radius.min(laid);
    let lone = matches!(passing, Passing::Lone(_));
    if length >= if lone { PASSED } else { SHORT } {
        return Nearness::Apart;
    }
    if length < PASSED && passing != Passing::Kept {
        return Nearness::Pulled;
    }
    let grip = material.bending / (8.0 * material.radius * material.radius);
    let range = mesh.starts[yarn] as usize..mesh.starts[yarn + 1] as usize;
    let first = state.positions.len() - mesh.uv.len();
    let point = |k: usize| state.positions[first + mesh.incidences[k].node as usize];
    let pulls = |a: usize, b: usize| {
        let stretch = (point(b) - point(a)).norm() / (state.u[b] - state.u[a]);
        material.stretch * (stretch - 1.0) > grip
    };
    let before = || i > range.start && pulls(i - 1, i);
    let after = || i + 2 < range.end && pulls(i + 1, i + 2);
    let pulled = match passing {
        Passing::Kept | Passing::Lone(_) => false,
        Passing::End(0) => after(),
        Passing::End(_) => before(),
        Passing::Loop => before() || after(),
    };
    if pulled {
        Nearness::Pulled
    } else {
        Nearness::Gripped
    }
}

/// Takes off what has come free between the passages of `yarns`, which `passings` tells; nothing comes off at nodes
/// that are `held`. If the topology has changed, so has everything in the state that counts passages, and the
/// yarns as they are now are returned.
pub(super) fn release(
    laid: &Yarns,
    yarns: &Yarns,
    passings: &[Passing],
    held: &[bool],
    state: &mut State,
) -> Result<Option<Yarns>> {
    let mesh = &yarns.mesh;
    let comes_off = |(i, passing): (usize, &Passing)| {
        *passing != Passing::Kept
            && (state.sliding[i] || state.sliding[i + 1])
            && nearness(yarns, i, *passing, state) == Nearness::Pulled
    };
    let near: Vec<usize> = (passings.iter().enumerate())
        .filter(|p| comes_off(*p))
        .map(|(i, _)| i)
        .collect();
    if near.is_empty() {
        return Ok(None);
    }
    let mut change = Change {
        yarns,
        passages: Passages::new(mesh),
        split: state.topology.split.clone(),
        moved: Vec::new(),
        touched: Vec::new(),
        slipped: Vec::new(),
    };
    for i in near {
        change.take(i, held);
    }
    if change.touched.is_empty() {
        return Ok(None);
    }
    change.finish(laid, held, state).map(Some)
}

impl Change<'_> {
    /// Takes off what is at the segment that begins at `i`, if it is still there; nothing comes off
    /// at nodes that are held.
    fn take(&mut self, i: usize, held: &[bool]) {
        let j = i + 1;
        let (Some(p), Some(q)) = (self.passages.node[i], self.passages.node[j]) else {
            return;
        };
        let is_held = |node: u32| held.get(node as usize) == Some(&true);
        if is_held(p) || is_held(q) {
            return;
        }
        // what came off before may have changed it
        match self.passages.passing(i, j) {
            Passing::Kept => {}
            Passing::End(side) => {
                let (end, contact) = if side == 0 { (i, j) } else { (j, i) };
                self.slipped.push((end, contact));
                self.remove(contact);
            }
            Passing::Lone(side) => self.remove(if side == 0 { i } else { j }),
            Passing::Loop => self.pull_out([i, j], held),
        }
    }

    /// A loop comes off at two contacts, and off those beside them with the same two yarns if it is
    /// not held there then.
    fn pull_out(&mut self, mut pair: [usize; 2], held: &[bool]) {
        let nodes = |s: &Self, pair: [usize; 2]| {
            let [p, q] = pair.map(|i| s.passages.node[i]);
            let nodes = [p?, q?];
            nodes
                .iter()
                .all(|n| held.get(*n as usize) != Some(&true))
                .then_some(nodes)
        };
        while let Some([p, q]) = nodes(self, pair) {
            let partners = pair.map(|i| self.passages.crossed(i));
            self.part(pair[0], p);
            self.part(pair[1], q);
            let beyond = |k: usize, step: isize| self.passages.next(pair[k], step, true);
            let (Some(a), Some(b)) = (beyond(0, -1), beyond(1, 1)) else {
                return;
            };
            // the same stretch of the same yarns
            let follows = |k: usize, i: usize| {
                let beside = |p: &usize| {
                    [-1, 1].iter().any(|step| {
                        let next = self.passages.next(*p, *step, false);
                        next.is_some_and(|n| partners[k].contains(&n))
                    })
                };
                self.passages.crossed(i).iter().all(beside)
            };
            if !(follows(0, a) && follows(1, b) && self.passages.is_loop(a, b)) {
                return;
            }
            pair = [a, b];
        }
    }

    /// The yarn of a passage makes it no more.
    fn remove(&mut self, i: usize) {
        let beside = [-1, 1].map(|step| self.passages.next(i, step, false));
        self.touched.extend(beside.into_iter().flatten());
        let node = self.passages.node[i].take();
        if let Some(node) = node {
            self.settle(node);
        }
    }

    /// The yarn of a passage gets a node of its own.
    fn part(&mut self, i: usize, node: u32) {
        self.own(i, node);
        self.settle(node);
    }

    fn own(&mut self, i: usize, node: u32) {
        let mesh = &self.yarns.mesh;
        let laid = mesh.uv.len() - self.laid_split();
        let origin = match (node as usize).checked_sub(laid) {
            Some(k) => self.split[k],
            None => node,
        };
        let new = (laid + self.split.len()) as u32;
        self.split.push(origin);
        self.moved.push((i, node));
        self.passages.node[i] = Some(new);
        self.touched.push(i);
    }

    /// New nodes that the mesh has already.
    fn laid_split(&self) -> usize {
        self.split.len() - self.moved.len()
    }

    /// What is left at a node that a yarn has gone from: yarns of one group do not hold each other.
    fn settle(&mut self, node: u32) {
        let left: Vec<(usize, u8)> = self
            .passages
            .stack(node)
            .map(|s| (s.incidence as usize, s.group))
            .collect();
        if left.windows(2).any(|w| w[0].1 != w[1].1) {
            self.touched.extend(left.iter().map(|l| l.0));
            return;
        }
        for (k, (i, _)) in left.iter().enumerate() {
            if k == 0 {
                self.touched.push(*i);
            } else {
                self.own(*i, node);
            }
        }
    }

    fn topology(&self, laid: &YarnMesh) -> Topology {
        let mut node = vec![None; laid.incidences.len()];
        for (laid, now) in self.yarns.passages.iter().zip(&self.passages.node) {
            node[*laid as usize] = *now;
        }
        let passages = (0_u32..).zip(node.iter().zip(&laid.incidences));
        Topology {
            changed: passages
                .filter(|(_, (now, laid))| **now != Some(laid.node))
                .map(|(i, (now, _))| (i, *now))
                .collect(),
            split: self.split.clone(),
        }
    }

    fn finish(mut self, laid: &Yarns, held: &[bool], state: &mut State) -> Result<Yarns> {
        let old = self.yarns;
        let topology = self.topology(&laid.mesh);
        let new = laid.present(&topology)?;
        let first = state.positions.len() - old.mesh.uv.len();
        let mut yarns: Vec<usize> = self
            .touched
            .iter()
            .map(|i| self.passages.yarn(*i))
            .collect();
        yarns.sort_unstable();
        yarns.dedup();
        let before: Vec<Vec3> = (yarns.iter())
            .map(|y| momentum(old, *y, first, state))
            .collect();
        for (end, contact) in &self.slipped {
            straighten(&self.passages, *end, *contact, first, state, old);
        }
        for (_, node) in &self.moved {
            let from = first + *node as usize;
            state.positions.push(state.positions[from]);
            state.velocities.push(state.velocities[from]);
        }
        state.yarn_normals.resize(new.mesh.uv.len(), Vec3::zeros());
        // passages that are still there, in the order of both meshes
        let kept: Vec<usize> = (0..old.mesh.incidences.len())
            .filter(|i| self.passages.node[*i].is_some())
            .collect();
        self.strands(&new.mesh, &kept, state);
        state.u = kept.iter().map(|i| state.u[*i]).collect();
        state.u_rates = kept.iter().map(|i| state.u_rates[*i]).collect();
        state.sliding = kept.iter().map(|i| state.sliding[*i]).collect();
        for (i, incidence) in new.mesh.incidences.iter().enumerate() {
            if !incidence.slides {
                state.sliding[i] = false;
                state.u_rates[i] = 0.0;
            }
            if new.mesh.stack(incidence.node as usize).len() < 2 {
                state.yarn_normals[incidence.node as usize] = Vec3::zeros();
            }
        }
        let is_left = |point: u32| {
            let node = (point as usize).checked_sub(first);
            node.is_some_and(|n| new.mesh.stack(n).is_empty())
        };
        state.body_anchors.retain(|a| !is_left(a.vertex));
        state
            .pair_anchors
            .retain(|a| !is_left(a.a) && !is_left(a.b));
        for node in 0..new.mesh.uv.len() {
            if new.mesh.stack(node).is_empty() {
                state.velocities[first + node] = Vec3::zeros();
            }
        }
        let masses = masses(&new, state);
        let lost: Vec<Vec3> = (yarns.iter().zip(before))
            .map(|(y, before)| before - momentum(&new, *y, first, state))
            .collect();
        for (y, lost) in yarns.into_iter().zip(lost) {
            let mut nodes: Vec<u32> = (self.touched.iter())
                .filter(|i| self.passages.yarn(**i) == y)
                .filter_map(|i| self.passages.node[*i])
                .filter(|n| masses[*n as usize] > 0.0 && held.get(*n as usize) != Some(&true))
                .collect();
            nodes.sort_unstable();
            nodes.dedup();
            let mass: f64 = nodes.iter().map(|n| masses[*n as usize]).sum();
            for n in nodes {
                state.velocities[first + n as usize] += lost / mass;
            }
        }
        state.topology = topology;
        Ok(new)
    }

    /// Friction of the strands that are left; where the stack has changed it begins anew.
    fn strands(&mut self, new: &YarnMesh, kept: &[usize], state: &mut State) {
        let old = &self.yarns.mesh;
        let mut place = vec![0; old.incidences.len()];
        for (s, strand) in old.stacks.iter().enumerate() {
            place[strand.incidence as usize] = s;
        }
        let mut strands = Vec::with_capacity(new.stacks.len());
        for node in 0..new.uv.len() {
            let stack = new.stack(node);
            let whole = node < old.uv.len()
                && old.stack(node).len() == stack.len()
                && (old.stack(node).iter().zip(stack))
                    .all(|(a, b)| a.incidence as usize == kept[b.incidence as usize]);
            for (k, strand) in stack.iter().enumerate() {
                let i = kept[strand.incidence as usize];
                strands.push(if whole {
                    state.strands[place[i]]
                } else {
                    let next = stack.get(k + 1).map_or(i, |s| kept[s.incidence as usize]);
                    StrandState {
                        anchor: state.u[i],
                        beside: state.u[i] - state.u[next],
                        contact: 0.0,
                    }
                });
            }
        }
        state.strands = strands;
    }
}

/// Momentum of a yarn [kg m/s].
pub fn momentum(yarns: &Yarns, yarn: usize, first: usize, state: &State) -> Vec3 {
    let mesh = &yarns.mesh;
    let half = 0.5 * yarns.material(yarn).density;
    let range = mesh.starts[yarn] as usize + 1..mesh.starts[yarn + 1] as usize;
    range
        .map(|i| {
            let [a, b] = [i - 1, i].map(|i| first + mesh.incidences[i].node as usize);
            let du = state.u[i] - state.u[i - 1];
            let slid = state.u_rates[i] + state.u_rates[i - 1];
            let d = state.positions[b] - state.positions[a];
            ((state.velocities[a] + state.velocities[b]) * du - d * slid) * half
        })
        .sum()
}

/// What the momentum of all yarns grows by with the velocity of each node [kg].
fn masses(yarns: &Yarns, state: &State) -> Vec<f64> {
    let mesh = &yarns.mesh;
    let mut masses = vec![0.0; mesh.uv.len()];
    for y in 0..mesh.yarn_count() {
        let half = 0.5 * yarns.material(y).density;
        for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
            for k in [i - 1, i] {
                masses[mesh.incidences[k].node as usize] += half * (state.u[i] - state.u[i - 1]);
            }
        }
    }
    masses
}

/// Lays an end that has lost its last contact straight on from the passage before it, as long as it was.
fn straighten(
    passages: &Passages<'_>,
    end: usize,
    contact: usize,
    first: usize,
    state: &mut State,
    old: &Yarns,
) {
    let step = if end > contact { -1 } else { 1 };
    let point = |i: usize| first + old.mesh.incidences[i].node as usize;
    let Some(before) = passages.next(contact, step, false) else {
        return;
    };
    let x = |i: usize| state.positions[point(i)];
    let way = x(contact) - x(before);
    if let Some(along) = way.try_normalize(0.0) {
        let length = way.norm() + (x(end) - x(contact)).norm();
        let target = x(before) + along * length;
        state.positions[point(end)] = target;
    }
}
