//! Neighbours along yarns as they pass each other now: yarns slide, and what was far apart along them when they were laid
//! may have become near.
//!
//! The way between two nodes follows segments of yarn, each as long as the material in it, and may change yarns at
//! nodes. Coordinates are those at the start of the step.

use crate::yarn::Yarns;

/// Segments around each node, and their lengths.
#[derive(Clone, Debug, Default)]
pub(super) struct Rods {
    /// Point of the first node.
    first: u32,
    /// Passages through node `n`: `passages[starts[n]..starts[n + 1]]`.
    starts: Vec<u32>,
    passages: Vec<u32>,
    /// Node of each passage.
    nodes: Vec<u32>,
    /// Whether the yarn goes on from a passage to the next one.
    goes_on: Vec<bool>,
    u: Vec<f64>,
}

impl Rods {
    /// As laid; `first` is the point of the first node.
    pub(super) fn new(yarns: &Yarns, first: u32) -> Self {
        let mesh = &yarns.mesh;
        let mut goes_on = vec![true; mesh.incidences.len()];
        for y in 0..mesh.yarn_count() {
            if let Some(last) = (mesh.starts[y + 1] as usize).checked_sub(1) {
                goes_on[last] = false;
            }
        }
        Self {
            first,
            starts: mesh.stack_starts.clone(),
            passages: mesh.stacks.iter().map(|s| s.incidence).collect(),
            nodes: mesh.incidences.iter().map(|i| i.node).collect(),
            goes_on,
            u: mesh.incidences.iter().map(|i| i.u).collect(),
        }
    }

    /// Takes the coordinates of a state.
    pub(super) fn follow(&mut self, u: &[f64]) {
        self.u.clear();
        self.u.extend_from_slice(u);
    }

    /// Whether two points are nodes with a way along yarns of at most `limit` [m] between them.
    pub(super) fn near(&self, a: u32, b: u32, limit: f64) -> bool {
        let node = |point: u32| {
            let node = point.checked_sub(self.first);
            node.filter(|n| (*n as usize) + 1 < self.starts.len())
        };
        let (Some(from), Some(to)) = (node(a), node(b)) else {
            return false;
        };
        // a handful of nodes: the nearest is found by looking at all
        let mut reached = vec![(from, 0.0_f64, false)];
        loop {
            let open = reached.iter().enumerate().filter(|(_, r)| !r.2);
            let Some((k, (node, way, _))) = open.min_by(|p, q| p.1.1.total_cmp(&q.1.1)) else {
                return false;
            };
            let (node, way) = (*node, *way);
            if node == to {
                return true;
            }
            reached[k].2 = true;
            let stack =
                self.starts[node as usize] as usize..self.starts[node as usize + 1] as usize;
            for &i in &self.passages[stack] {
                let i = i as usize;
                let before = i.checked_sub(1).filter(|b| self.goes_on[*b]);
                let after = self.goes_on[i].then_some(i + 1);
                for j in before.into_iter().chain(after) {
                    let far = way + (self.u[j] - self.u[i]).abs();
                    if far > limit {
                        continue;
                    }
                    match reached.iter_mut().find(|r| r.0 == self.nodes[j]) {
                        Some(known) => known.1 = known.1.min(far),
                        None => reached.push((self.nodes[j], far, false)),
                    }
                }
            }
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        4 * (self.starts.len() + self.passages.len() + self.nodes.len()) + 9 * self.u.len()
    }
}
