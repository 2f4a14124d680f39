//! Which contacts may come off: what stands between two passages that follow each other in a yarn.
//!
//! Two contacts hold each other where the yarn lies on one side of the first partner and on the other side
//! of the second, or where their partners are two yarns: there the yarns' thickness keeps them apart. Elsewhere nothing
//! but friction does: an end slips through its last contact, a contact slides over a node of one yarn, and a loop
//! that lies on one side of the yarn through it at both of two neighbouring contacts is pulled out (Cirio et al. 2017, section 5).
//! Loops come out from the end of a yarn on, one after the other, as a row that is bound off does: the others
//! are held by those between them and the end.

use crate::yarn::{Family, Strand, YarnMesh};

/// What a segment of a yarn is between.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Passing {
    /// Contacts that hold each other, or nodes that do not move along the yarn.
    Kept,
    /// The yarn's free end and its last contact; the end is the first passage (0) or the second (1).
    End(u8),
    /// A node of one yarn and a contact; the node is the first passage (0) or the second (1).
    Lone(u8),
    /// Two contacts with the same stretch of the same yarn on the same side of it, the last ones before a free end.
    Loop,
}

/// The yarns of a mesh while contacts come off: where each passage is.
pub struct Passages<'a> {
    mesh: &'a YarnMesh,
    /// Node of each passage, none where it is gone.
    pub node: Vec<Option<u32>>,
    yarn: Vec<u32>,
    tied: Vec<bool>,
}

impl<'a> Passages<'a> {
    /// As the mesh says.
    pub fn new(mesh: &'a YarnMesh) -> Self {
        let mut yarn = vec![0; mesh.incidences.len()];
        for y in 0..mesh.yarn_count() {
            yarn[mesh.starts[y] as usize..mesh.starts[y + 1] as usize].fill(y as u32);
        }
        let mut tied = vec![false; mesh.uv.len()];
        for tie in &mesh.ties {
            for node in [tie.node, tie.segment[0], tie.segment[1]] {
                tied[node as usize] = true;
            }
        }
        Self {
            mesh,
            node: mesh.incidences.iter().map(|i| Some(i.node)).collect(),
            yarn,
            tied,
        }
    }

    /// Yarn of a passage.
    pub fn yarn(&self, i: usize) -> usize {
        self.yarn[i] as usize
    }

    /// Strands at a node of the mesh that are still there.
    pub fn stack(&self, node: u32) -> impl Iterator<Item = &'a Strand> + '_ {
        let all = self.mesh.stack_starts.len() - 1;
        let stack: &[Strand] = if (node as usize) < all {
            self.mesh.stack(node as usize)
        } else {
            &[]
        };
        (stack.iter()).filter(move |s| self.node[s.incidence as usize] == Some(node))
    }

    /// Whether a passage has its node for itself.
    pub fn is_alone(&self, i: usize) -> bool {
        // a node that has come out of another is one yarn's
        self.node[i].is_none_or(|node| self.stack(node).count() < 2)
    }

    /// Whether the yarn may slide at a passage: a contact, not an end, not tied.
    fn slides(&self, i: usize) -> bool {
        self.mesh.incidences[i].slides && self.node[i].is_some() && !self.is_alone(i)
    }

    fn is_end(&self, i: usize) -> bool {
        let y = self.yarn(i);
        i == self.mesh.starts[y] as usize || i + 1 == self.mesh.starts[y + 1] as usize
    }

    /// The next passage along (1) or against (-1) the yarn that is still there, of contacts alone if asked for.
    pub fn next(&self, i: usize, step: isize, contacts: bool) -> Option<usize> {
        let y = self.yarn(i);
        let range = self.mesh.starts[y] as usize..self.mesh.starts[y + 1] as usize;
        let mut at = i;
        loop {
            at = at.checked_add_signed(step).filter(|k| range.contains(k))?;
            if self.node[at].is_some() && !(contacts && self.is_alone(at)) {
                return Some(at);
            }
        }
    }

    /// Group of a passage in its node's stack, and whether it lies behind the strands that it crosses.
    fn place(&self, i: usize) -> Option<(u8, bool)> {
        let node = self.node[i]?;
        let own = self.stack(node).position(|s| s.incidence as usize == i)?;
        let group = self.stack(node).nth(own)?.group;
        let first = self.stack(node).position(|s| s.group != group)?;
        Some((group, own < first))
    }

    /// Strands of another group at the node of a passage.
    fn partners(&self, i: usize, group: u8) -> impl Iterator<Item = usize> + '_ {
        let stack = self.node[i].into_iter().flat_map(|n| self.stack(n));
        stack
            .filter(move |s| s.group != group)
            .map(|s| s.incidence as usize)
    }

    /// Passages of the yarns that cross a contact's there.
    pub fn crossed(&self, i: usize) -> Vec<usize> {
        let place = self.place(i);
        let crossed = place.map(|(group, _)| self.partners(i, group).collect());
        crossed.unwrap_or_default()
    }

    /// Whether two contacts that follow each other in a yarn are with the same stretch of the same yarns, on
    /// the same side of them, so that the yarn is not held between them.
    pub fn is_loop(&self, i: usize, j: usize) -> bool {
        if !(self.slides(i) && self.slides(j)) || self.node[i] == self.node[j] {
            return false;
        }
        let (Some((group, behind)), Some((other, also))) = (self.place(i), self.place(j)) else {
            return false;
        };
        let neighbours = |p: usize| {
            [-1, 1]
                .into_iter()
                .filter_map(|step| self.next(p, step, true))
                .any(|q| self.partners(j, other).any(|k| k == q))
        };
        behind == also
            && self.partners(i, group).count() == self.partners(j, other).count()
            && self.partners(i, group).all(neighbours)
    }

    /// Whether no more than one contact lies between two contacts of a yarn and one of its ends, and the yarn slides there.
    fn is_last(&self, i: usize, j: usize) -> bool {
        [(i.min(j), -1), (i.max(j), 1)]
            .into_iter()
            .any(|(from, step)| match self.next(from, step, true) {
                Some(outer) => self.slides(outer) && self.next(outer, step, true).is_none(),
                None => true,
            })
    }

    /// Whether a loop is the last one of its yarn, or of a yarn that it lies on.
    fn is_loose(&self, i: usize, j: usize) -> bool {
        let partners = |k: usize| self.crossed(k);
        let (before, after) = (partners(i), partners(j));
        self.is_last(i, j)
            || before
                .iter()
                .flat_map(|p| after.iter().map(move |q| (*p, *q)))
                .any(|(p, q)| self.yarn(p) == self.yarn(q) && self.is_last(p, q))
    }

    /// What the segment from passage `i` to `j`, the next one along the yarn, is between.
    pub fn passing(&self, i: usize, j: usize) -> Passing {
        let y = self.yarn(i);
        if self.mesh.yarn_family[y] == Family::Seam {
            return Passing::Kept;
        }
        let free = |k: usize| {
            let node = self.node[k].map(|n| n as usize);
            self.is_alone(k) && node.is_none_or(|n| self.tied.get(n) != Some(&true))
        };
        for (side, (lone, contact)) in [(i, j), (j, i)].into_iter().enumerate() {
            if free(lone) && self.slides(contact) {
                let side = side as u8;
                return if self.is_end(lone) {
                    Passing::End(side)
                } else {
                    Passing::Lone(side)
                };
            }
        }
        if self.is_loop(i, j) && self.is_loose(i, j) {
            Passing::Loop
        } else {
            Passing::Kept
        }
    }
}

/// [`Passages::passing`] of every segment of a mesh, by its first passage; `Kept` at the last of a yarn.
pub fn passings(mesh: &YarnMesh) -> Vec<Passing> {
    let all = Passages::new(mesh);
    let mut out = vec![Passing::Kept; mesh.incidences.len()];
    for y in 0..mesh.yarn_count() {
        for i in mesh.starts[y] as usize..(mesh.starts[y + 1] as usize).saturating_sub(1) {
            out[i] = all.passing(i, i + 1);
        }
    }
    out
}
