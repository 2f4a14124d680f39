//! Exact distances at the nodes of a brick, the search shared by all of them.
//!
//! A triangle nearest to any point of a ball (centre `c`, radius `r`) is at most `d(c) + 2 r` away
//! from `c`, where `d(c)` is the distance of the mesh. The groups of the tree within that reach are
//! listed for the brick, from its list those for each block of 2 x 2 x 2 nodes, and only these are
//! held against the nodes. Each node begins with the triangle that was nearest to the one before,
//! so that the first number found is nearly the smallest.

use super::bounds::{Discs, Lanes, WIDE, lowest, within, within_each};
use super::tree::{Probe, Tree};
use crate::math::Vec3;

/// A list of fewer groups than this is split into theirs, down to groups of triangles.
const SPLIT: usize = 32;
/// Up to this many groups of triangles are held against eight nodes at once.
const MANY: usize = 48;

/// Groups of one level of the tree, eight to a block.
#[derive(Default)]
struct List {
    level: usize,
    blocks: Vec<Discs>,
    groups: Vec<u32>,
}

impl List {
    fn clear(&mut self, level: usize) {
        self.level = level;
        self.blocks.clear();
        self.groups.clear();
    }

    /// Adds the groups of a block whose bits are set; its first is number `first`.
    #[inline]
    fn add(&mut self, discs: &Discs, mut bits: u32, group: impl Fn(usize) -> Option<u32>) {
        while bits != 0 {
            let lane = bits.trailing_zeros() as usize;
            bits &= bits - 1;
            let Some(number) = group(lane) else { continue };
            let to = self.groups.len() % WIDE;
            if to == 0 {
                self.blocks.push(Discs::NONE);
            }
            if let Some(last) = self.blocks.last_mut() {
                last.set(to, discs, lane);
            }
            self.groups.push(number);
        }
    }

    /// What of another list is within reach.
    fn cull(&mut self, from: &Self, probe: &Probe, reach2: f32) {
        self.clear(from.level);
        for (b, discs) in from.blocks.iter().enumerate() {
            let bits = within(&discs.bounds(&probe.local), reach2);
            self.add(discs, bits, |lane| {
                from.groups.get(b * WIDE + lane).copied()
            });
        }
    }

    /// What of the groups of another list is within reach.
    fn split(&mut self, from: &Self, tree: &Tree, probe: &Probe, reach2: f32) {
        self.clear(from.level - 1);
        let count = tree.count(from.level - 1) as u32;
        for &group in &from.groups {
            let discs = tree.children(from.level, group as usize);
            let bits = within(&discs.bounds(&probe.local), reach2);
            let first = group * WIDE as u32;
            self.add(discs, bits, |lane| {
                Some(first + lane as u32).filter(|&g| g < count)
            });
        }
    }

    /// Smallest distance to the listed groups; `place` becomes that of the nearest triangle.
    #[inline]
    fn distance(&self, tree: &Tree, p: &Vec3, bounds: &mut Vec<Lanes>, place: &mut usize) -> f64 {
        let probe = tree.probe(p);
        bounds.clear();
        let mut first = (0, 0, f32::INFINITY);
        for (b, discs) in self.blocks.iter().enumerate() {
            let block = discs.bounds(&probe.local);
            let lane = lowest(&block).trailing_zeros() as usize;
            if block[lane] < first.2 {
                first = (b, lane, block[lane]);
            }
            bounds.push(block);
        }
        // the group that seems nearest first: after it few are left to look at
        let mut best = f64::INFINITY;
        let mut improve = |at: usize, best: &mut f64| {
            if let Some(&group) = self.groups.get(at) {
                tree.improve(&probe, self.level, group as usize, best, place);
            }
        };
        improve(first.0 * WIDE + first.1, &mut best);
        let mut reach2 = probe.reach2(best.sqrt());
        for (b, block) in bounds.iter().enumerate() {
            let mut bits = within(block, reach2);
            if b == first.0 {
                bits &= !(1 << first.1);
            }
            while bits != 0 {
                let lane = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if !(block[lane] > reach2) {
                    improve(b * WIDE + lane, &mut best);
                    reach2 = probe.reach2(best.sqrt());
                }
            }
        }
        best.sqrt()
    }
}

/// Triangles listed for eight points.
#[derive(Default)]
struct Faces {
    places: Vec<u32>,
    bounds: Vec<Lanes>,
}

impl Faces {
    /// The triangles of listed groups of eight that are within reach.
    fn collect(&mut self, list: &List, tree: &Tree, probe: &Probe, reach2: f32) {
        self.places.clear();
        let count = tree.count(0) as u32;
        for &group in &list.groups {
            let mut bits = within(&tree.triangles(group as usize).bounds(&probe.local), reach2);
            while bits != 0 {
                let place = group * WIDE as u32 + bits.trailing_zeros();
                bits &= bits - 1;
                if place < count {
                    self.places.push(place);
                }
            }
        }
    }

    /// Smallest distances to the listed triangles.
    fn distances(&mut self, tree: &Tree, points: &[Vec3; WIDE]) -> [f64; WIDE] {
        let probes = points.map(|p| tree.probe(&p));
        let mut local = [[0.0; WIDE]; 3];
        for (i, probe) in probes.iter().enumerate() {
            for d in 0..3 {
                local[d][i] = probe.local[d];
            }
        }
        self.bounds.clear();
        let mut low = [f32::INFINITY; WIDE];
        let mut which = [0u32; WIDE];
        for (k, &place) in (0u32..).zip(&self.places) {
            let bounds = tree.triangle(place as usize).bounds(&local);
            for i in 0..WIDE {
                which[i] = if bounds[i] < low[i] { k } else { which[i] };
                low[i] = if bounds[i] < low[i] {
                    bounds[i]
                } else {
                    low[i]
                };
            }
            self.bounds.push(bounds);
        }
        // the bounds are nearly the distances: after the lowest one few are left to look at
        let exact = |k: usize, i: usize| tree.distance2(self.places[k] as usize, &points[i]);
        let mut best: [f64; WIDE] = std::array::from_fn(|i| exact(which[i] as usize, i));
        let mut reach2: Lanes = std::array::from_fn(|i| probes[i].reach2(best[i].sqrt()));
        for (k, bounds) in self.bounds.iter().enumerate() {
            let mut bits = within_each(bounds, &reach2);
            while bits != 0 {
                let i = bits.trailing_zeros() as usize;
                bits &= bits - 1;
                if which[i] as usize != k {
                    let d2 = exact(k, i);
                    if d2 < best[i] {
                        best[i] = d2;
                        reach2[i] = probes[i].reach2(d2.sqrt());
                    }
                }
            }
        }
        best.map(f64::sqrt)
    }
}

/// Distances at bricks of one tree; works fastest on bricks that follow each other in space.
pub(super) struct Sampler<'a> {
    tree: &'a Tree,
    hint: usize,
    brick: List,
    block: List,
    spare: List,
    bounds: Vec<Lanes>,
    faces: Faces,
}

impl<'a> Sampler<'a> {
    pub(super) fn new(tree: &'a Tree) -> Self {
        Self {
            tree,
            hint: 0,
            brick: List::default(),
            block: List::default(),
            spare: List::default(),
            bounds: Vec::new(),
            faces: Faces::default(),
        }
    }

    /// Smallest distance to `p`, if it is not above `limit`.
    pub(super) fn distance(&mut self, p: &Vec3, limit: f64) -> Option<f64> {
        // nothing beyond the limit is looked for; the slack keeps the comparison itself exact
        let bar = limit * limit * (1.0 + 1e-12);
        let mut best = self.tree.distance2(self.hint, p).min(bar);
        let probe = self.tree.probe(p);
        let (root, place) = (self.tree.root(), &mut self.hint);
        self.tree.improve(&probe, root, 0, &mut best, place);
        let d = best.sqrt();
        (best < bar && d <= limit).then_some(d)
    }

    /// Distances at the 64 nodes `center + h (i - 3/2, j - 3/2, k - 3/2)`; `distance` is that of the
    /// centre, `node(n)` the place of node `n = (4 i + j) 4 + k`.
    pub(super) fn brick(
        &mut self,
        center: &Vec3,
        distance: f64,
        h: f64,
        node: impl Fn(usize) -> Vec3,
    ) -> [f64; 64] {
        let tree = self.tree;
        // half diagonals of the nodes: 1.5 sqrt(3) and 0.5 sqrt(3) spacings, rounded up
        let (whole, part) = (2.5981 * h, 0.8661 * h);
        let probe = tree.probe(center);
        let reach2 = probe.reach2(distance + 2.0 * whole);
        self.spare.clear(tree.root());
        self.spare.groups.push(0);
        self.brick.split(&self.spare, tree, &probe, reach2);
        narrow(&mut self.brick, &mut self.spare, tree, &probe, reach2);
        let mut out = [0.0; 64];
        for step in 0..8usize {
            // neighbours follow each other (Gray code)
            let s = step ^ (step >> 1);
            let corner = [s >> 2 & 1, s >> 1 & 1, s & 1];
            let c = center + Vec3::from_fn(|d, _| (2.0 * corner[d] as f64 - 1.0) * h);
            let near = self
                .brick
                .distance(tree, &c, &mut self.bounds, &mut self.hint);
            let probe = tree.probe(&c);
            let reach2 = probe.reach2(near + 2.0 * part);
            self.block.cull(&self.brick, &probe, reach2);
            narrow(&mut self.block, &mut self.spare, tree, &probe, reach2);
            let at = |m: usize| {
                let i = [m >> 2, m >> 1 & 1, m & 1];
                16 * (2 * corner[0] + i[0]) + 4 * (2 * corner[1] + i[1]) + 2 * corner[2] + i[2]
            };
            if self.block.level == 1 && self.block.groups.len() <= MANY {
                self.faces.collect(&self.block, tree, &probe, reach2);
                let points = std::array::from_fn(|m| node(at(m)));
                let found = self.faces.distances(tree, &points);
                for (m, d) in found.into_iter().enumerate() {
                    out[at(m)] = d;
                }
            } else {
                for m in (0..8).map(|m| m ^ (m >> 1)) {
                    let p = node(at(m));
                    out[at(m)] = self
                        .block
                        .distance(tree, &p, &mut self.bounds, &mut self.hint);
                }
            }
        }
        out
    }
}

/// Splits the groups of a short list.
fn narrow(list: &mut List, spare: &mut List, tree: &Tree, probe: &Probe, reach2: f32) {
    while list.level > 1 && list.groups.len() < SPLIT {
        spare.split(list, tree, probe, reach2);
        std::mem::swap(list, spare);
    }
}
