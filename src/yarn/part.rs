//! The part of laid yarns that the energies of some nodes reach.
//!
//! Where triangles stand for the cloth around a region of yarns, an energy of the yarns exists as a whole if any of
//! its nodes lies in the region (Casafranca et al. 2020 blend them; cutting them at the border instead makes a
//! stretched patch err by ten times more). So the part has the nodes inside, and further the nodes outside
//! that a segment, a bend, a corner, a stitch or a tie of an inside node needs. Those keep the material
//! coordinates that they were laid with: yarns do not slide there, and a yarn that leaves the part ends. Nor do yarns slide where an energy
//! is in part the triangles': it would cost less to be stretched there, and material would gather.

use super::{Across, Corner, Incidence, Spacing, StitchSpring, Strand, Tie, Wrap, YarnMesh};

const NONE: u32 = u32::MAX;
/// Passages beside one that an energy by its coordinate reaches.
const REACH: usize = 2;

impl YarnMesh {
    /// The part that the nodes with `inside` reach, the number that each of its nodes has here, and that
    /// each passage has there, `u32::MAX` where it has none.
    pub fn part(&self, inside: &[bool]) -> (Self, Vec<u32>, Vec<u32>) {
        self.part_with(inside, &self.wanted(inside))
    }

    /// Same with more nodes outside than energies need, which have yarn between them but no energy.
    pub(super) fn part_with(&self, inside: &[bool], wanted: &[bool]) -> (Self, Vec<u32>, Vec<u32>) {
        // pieces of yarns with at least one segment
        let mut pieces: Vec<(usize, std::ops::Range<usize>)> = Vec::new();
        for y in 0..self.yarn_count() {
            let end = self.starts[y + 1] as usize;
            let start = self.starts[y] as usize;
            let mut from = start;
            for i in start..=end {
                if i == end || !wanted[self.incidences[i].node as usize] {
                    if i - from > 1 {
                        pieces.push((y, from..i));
                    }
                    from = i + 1;
                }
            }
        }
        let mut ids = vec![NONE; self.uv.len()];
        for i in pieces.iter().flat_map(|p| p.1.clone()) {
            ids[self.incidences[i].node as usize] = 0;
        }
        let nodes: Vec<u32> = (0..self.uv.len() as u32)
            .filter(|n| ids[*n as usize] != NONE)
            .collect();
        for (id, node) in (0..).zip(&nodes) {
            ids[*node as usize] = id;
        }
        let pick = |n: &u32| *n as usize;
        let mut part = Self {
            uv: nodes.iter().map(|n| self.uv[pick(n)]).collect(),
            lift: nodes.iter().map(|n| self.lift[pick(n)]).collect(),
            node_panel: nodes.iter().map(|n| self.node_panel[pick(n)]).collect(),
            outside: nodes.iter().map(|n| !inside[pick(n)]).collect(),
            alpha: (nodes.iter().filter(|_| !self.alpha.is_empty()))
                .map(|n| self.alpha[pick(n)])
                .collect(),
            starts: vec![0],
            stack_starts: vec![0],
            ..Self::default()
        };
        let mut passages = vec![NONE; self.incidences.len()];
        for (y, range) in pieces {
            let (first, last) = (range.start, range.end - 1);
            let whole = |i: usize| part.is_whole(ids[self.incidences[i].node as usize]);
            let may_slide: Vec<bool> = range
                .clone()
                .map(|i| {
                    let near = i.saturating_sub(REACH).max(first)..=(i + REACH).min(last);
                    i != first
                        && i != last
                        && inside[self.incidences[i].node as usize]
                        && (part.alpha.is_empty() || near.into_iter().all(whole))
                })
                .collect();
            for (i, may_slide) in range.zip(may_slide) {
                let Incidence { node, u, slides } = self.incidences[i];
                passages[i] = part.incidences.len() as u32;
                part.incidences.push(Incidence {
                    node: ids[node as usize],
                    u,
                    slides: slides && may_slide,
                });
            }
            part.starts.push(part.incidences.len() as u32);
            part.yarn_fabric.push(self.yarn_fabric[y]);
            part.yarn_family.push(self.yarn_family[y]);
        }
        for node in &nodes {
            for strand in self.stack(*node as usize) {
                let incidence = passages[strand.incidence as usize];
                if incidence != NONE {
                    part.stacks.push(Strand {
                        incidence,
                        group: strand.group,
                    });
                }
            }
            part.stack_starts.push(part.stacks.len() as u32);
        }
        part.take_contacts(self, &ids, &passages);
        (part, nodes, passages)
    }

    /// Nodes that are inside or in an energy with one that is.
    pub(super) fn wanted(&self, inside: &[bool]) -> Vec<bool> {
        let mut wanted = inside.to_vec();
        let mut reach = |nodes: &[u32]| {
            if nodes.iter().any(|n| inside[*n as usize]) {
                for n in nodes {
                    wanted[*n as usize] = true;
                }
            }
        };
        for y in 0..self.yarn_count() {
            let yarn = self.yarn(y);
            for pair in yarn.windows(2) {
                reach(&[pair[0].node, pair[1].node]);
            }
            for three in yarn.windows(3) {
                reach(&[three[0].node, three[1].node, three[2].node]);
            }
        }
        for corner in &self.corners {
            reach(&corner.nodes);
        }
        for wrap in &self.wraps {
            let [a, b] = wrap.wings.map(|i| self.incidences[i as usize].node);
            reach(&[wrap.axis[0], wrap.axis[1], a, b]);
        }
        for tie in self.ties.iter().filter(|t| inside[t.node as usize]) {
            reach(&[tie.node, tie.segment[0], tie.segment[1]]);
        }
        wanted
    }

    /// What of `whole` holds nodes and passages of this part that are inside.
    fn take_contacts(&mut self, whole: &Self, ids: &[u32], passages: &[u32]) {
        fn moved<const N: usize>(list: [u32; N], to: &[u32]) -> Option<[u32; N]> {
            let list = list.map(|k| to[k as usize]);
            (!list.contains(&NONE)).then_some(list)
        }
        let node = |i: u32, part: &Self| part.incidences[i as usize].node;
        for corner in &whole.corners {
            if let Some(nodes) = moved(corner.nodes, ids)
                && self.reaches(&nodes)
            {
                self.corners.push(Corner { nodes, ..*corner });
            }
        }
        for wrap in &whole.wraps {
            if let (Some(axis), Some(wings)) = (moved(wrap.axis, ids), moved(wrap.wings, passages))
                && self.reaches(&[axis[0], axis[1], node(wings[0], self), node(wings[1], self)])
            {
                let wrap = Wrap {
                    axis,
                    wings,
                    ..*wrap
                };
                self.wraps.push(wrap);
            }
        }
        for spring in &whole.stitch_springs {
            if let Some(incidences) = moved(spring.incidences, passages)
                && self.reaches(&incidences.map(|i| node(i, self)))
            {
                self.stitch_springs.push(StitchSpring {
                    incidences,
                    ..*spring
                });
            }
        }
        for spacing in &whole.spacings {
            if let Some(incidences) = moved(spacing.incidences, passages)
                && self.reaches(&incidences.map(|i| node(i, self)))
            {
                self.spacings.push(Spacing {
                    incidences,
                    ..*spacing
                });
            }
        }
        for tie in &whole.ties {
            if let Some([node, a, b]) = moved([tie.node, tie.segment[0], tie.segment[1]], ids)
                && self.is_inside(node)
            {
                self.ties.push(Tie {
                    node,
                    segment: [a, b],
                    ..*tie
                });
            }
        }
        for across in &whole.across {
            if let Some([node]) = moved([across.node], ids) {
                self.across.push(Across { node, ..*across });
            }
        }
    }
}
