//! How yarns pass their nodes now, against how they were laid.
//!
//! Yarns leave contacts: their ends slip through, loops are pulled out, a contact slides over a node of one
//! yarn. The mesh of the present is a function of the laid mesh and of the passages that are not as
//! laid (Cirio et al. 2017, section 5: small segments collapse, a node of several yarns comes apart into
//! one for each). Nodes keep their numbers; a node that no yarn passes stays without meaning, a new one is
//! counted on at the end.

use super::{StitchSpring, Strand, Wrap, YarnMesh, Yarns};
use crate::error::{Error, Result};
use serde::{Deserialize, Serialize};

/// What is not as laid.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
pub struct Topology {
    /// Passages of the laid mesh that are elsewhere, sorted: the node where the yarn passes now, none if
    /// the passage is gone.
    pub changed: Vec<(u32, Option<u32>)>,
    /// For each node after the laid ones the laid node that it came out of.
    pub split: Vec<u32>,
}

impl Topology {
    /// Number of laid passages that are gone.
    pub fn gone(&self) -> usize {
        self.changed.iter().filter(|c| c.1.is_none()).count()
    }

    /// The same in another part of the yarns: `passage` gives the number there of a laid passage whose node is whole there,
    /// `node` that of a laid node, likewise. `counts` of laid nodes here and there. A passage that is elsewhere than laid, or its
    /// node, and is not whole there is given back.
    pub fn in_part(
        &self,
        counts: [usize; 2],
        passage: impl Fn(u32) -> Option<u32>,
        node: impl Fn(u32) -> Option<u32>,
    ) -> std::result::Result<Self, u32> {
        let place = |n: u32| match (n as usize).checked_sub(counts[0]) {
            Some(split) => Some((counts[1] + split) as u32),
            None => node(n),
        };
        let mut changed = Vec::with_capacity(self.changed.len());
        for (i, n) in &self.changed {
            let there = match n {
                Some(n) => place(*n).map(Some),
                None => Some(None),
            };
            changed.push((passage(*i).ok_or(*i)?, there.ok_or(*i)?));
        }
        changed.sort_unstable();
        // each of them has a passage in it
        let split = self.split.iter().filter_map(|n| node(*n)).collect();
        Ok(Self { changed, split })
    }
}

impl Yarns {
    /// Yarns as laid, and what they are made of, one for each fabric of the garment.
    pub fn laid(mesh: YarnMesh, materials: Vec<super::YarnMaterial>) -> Self {
        let passages = (0..mesh.incidences.len() as u32).collect();
        Self {
            mesh,
            materials,
            passages,
            split: Vec::new(),
        }
    }

    /// The yarns with a topology; `self` is as laid. Refuses what cannot be.
    pub fn present(&self, topology: &Topology) -> Result<Self> {
        let (mesh, passages) = present(&self.mesh, topology)?;
        mesh.check()?;
        Ok(Self {
            mesh,
            materials: self.materials.clone(),
            passages,
            split: topology.split.clone(),
        })
    }
}

const GONE: u32 = u32::MAX;

/// A laid mesh and where its passages are now.
struct Map<'a> {
    laid: &'a YarnMesh,
    /// Node of each laid passage, or `GONE`.
    node: Vec<u32>,
    /// Number of each laid passage now, or `GONE`.
    number: Vec<u32>,
}

impl Map<'_> {
    /// Whether a laid passage is there and where it was.
    fn stays(&self, laid: u32) -> bool {
        self.node[laid as usize] == self.laid.incidences[laid as usize].node
    }

    fn here(&self, laid: u32) -> Option<u32> {
        Some(self.number[laid as usize]).filter(|n| *n != GONE)
    }
}

fn bad<T>(what: String) -> Result<T> {
    Err(Error::argument(format!("topology of yarns: {what}")))
}

fn present(laid: &YarnMesh, topology: &Topology) -> Result<(YarnMesh, Vec<u32>)> {
    let (nodes, count) = (laid.uv.len(), laid.incidences.len());
    let mut node: Vec<u32> = laid.incidences.iter().map(|i| i.node).collect();
    let mut last = None;
    for (passage, place) in &topology.changed {
        let known = (*passage as usize) < count && last.is_none_or(|l| l < *passage);
        let there = place.is_none_or(|n| (n as usize) < nodes + topology.split.len());
        if !known || !there {
            let at = place.map_or("none".to_owned(), |n| n.to_string());
            return bad(format!("passage {passage} of {count} at node {at}"));
        }
        node[*passage as usize] = place.unwrap_or(GONE);
        last = Some(*passage);
    }
    let mut mesh = YarnMesh {
        uv: laid.uv.clone(),
        lift: laid.lift.clone(),
        node_panel: laid.node_panel.clone(),
        yarn_fabric: laid.yarn_fabric.clone(),
        yarn_family: laid.yarn_family.clone(),
        ties: laid.ties.clone(),
        outside: laid.outside.clone(),
        alpha: laid.alpha.clone(),
        starts: vec![0],
        ..YarnMesh::default()
    };
    for origin in &topology.split {
        let o = *origin as usize;
        if o >= nodes {
            return bad(format!("a node came out of node {o} of {nodes}"));
        }
        mesh.uv.push(laid.uv[o]);
        mesh.lift.push(laid.lift[o]);
        mesh.node_panel.push(laid.node_panel[o]);
        if !mesh.outside.is_empty() {
            mesh.outside.push(false);
        }
        if !mesh.alpha.is_empty() {
            mesh.alpha.push(laid.alpha[o]);
        }
    }
    let mut passages = Vec::with_capacity(count);
    let mut number = vec![GONE; count];
    for y in 0..laid.yarn_count() {
        for i in laid.starts[y]..laid.starts[y + 1] {
            if node[i as usize] != GONE {
                number[i as usize] = passages.len() as u32;
                passages.push(i);
                let mut incidence = laid.incidences[i as usize];
                incidence.node = node[i as usize];
                mesh.incidences.push(incidence);
            }
        }
        mesh.starts.push(passages.len() as u32);
    }
    let map = Map { laid, node, number };
    stack(&mut mesh, &map);
    contacts(&mut mesh, &map);
    Ok((mesh, passages))
}

/// Stacks in their laid order, and where yarns slide.
fn stack(mesh: &mut YarnMesh, map: &Map<'_>) {
    let nodes = mesh.uv.len();
    let mut starts = vec![0_u32; nodes + 1];
    for incidence in &mesh.incidences {
        starts[incidence.node as usize + 1] += 1;
    }
    for k in 0..nodes {
        starts[k + 1] += starts[k];
    }
    let mut next = starts.clone();
    let empty = Strand {
        incidence: 0,
        group: 0,
    };
    mesh.stacks = vec![empty; mesh.incidences.len()];
    for strand in &map.laid.stacks {
        if let Some(incidence) = map.here(strand.incidence) {
            let slot = &mut next[mesh.incidences[incidence as usize].node as usize];
            mesh.stacks[*slot as usize] = Strand {
                incidence,
                group: strand.group,
            };
            *slot += 1;
        }
    }
    for node in 0..nodes {
        if let [only] = &mesh.stacks[starts[node] as usize..starts[node + 1] as usize] {
            mesh.incidences[only.incidence as usize].slides = false;
        }
    }
    mesh.stack_starts = starts;
}

/// What joins passages, where these are still there and contacts still are.
fn contacts(mesh: &mut YarnMesh, map: &Map<'_>) {
    let laid = map.laid;
    let crossed = |mesh: &YarnMesh, node: u32| mesh.stack(node as usize).len() > 1;
    let joined = |mesh: &YarnMesh, [a, b]: [u32; 2]| {
        let pair = [map.here(a)?, map.here(b)?];
        let whole = [a, b]
            .iter()
            .all(|i| map.stays(*i) && crossed(mesh, laid.incidences[*i as usize].node));
        (whole && pair[1] == pair[0] + 1).then_some(pair)
    };
    for spring in &laid.stitch_springs {
        if let Some(incidences) = joined(mesh, spring.incidences) {
            mesh.stitch_springs.push(StitchSpring {
                incidences,
                ..*spring
            });
        }
    }
    for spacing in &laid.spacings {
        if let Some(incidences) = joined(mesh, spacing.incidences) {
            mesh.spacings.push(super::Spacing {
                incidences,
                ..*spacing
            });
        }
    }
    for wrap in &laid.wraps {
        if let Some(wings) = wings(mesh, map, wrap) {
            mesh.wraps.push(Wrap { wings, ..*wrap });
        }
    }
    for corner in &laid.corners {
        let [q, a, b] = corner.nodes;
        if crossed(mesh, q) && mesh.beside(q, a) && mesh.beside(q, b) {
            mesh.corners.push(*corner);
        }
    }
}

/// The wings of a wrap whose contact is whole: each yarn goes on from there to the next passage that
/// there is.
fn wings(mesh: &YarnMesh, map: &Map<'_>, wrap: &Wrap) -> Option<[u32; 2]> {
    let strands = map.laid.wrapped(wrap)?;
    let mut out = [0; 2];
    for (out, (step, from)) in out.iter_mut().zip(strands) {
        let far = from.checked_add_signed(step)?;
        if !(map.stays(from) && map.stays(far)) {
            return None;
        }
        let near = map.here(from)?;
        *out = near.checked_add_signed(-step)?;
        if !mesh.neighbours(near, *out) {
            return None;
        }
    }
    let aside = out.map(|i| mesh.incidences[i as usize].node);
    let apart = aside.iter().all(|n| !wrap.axis.contains(n)) && out[0] != out[1];
    // where passages have gone the two may have become one strand
    let now = Wrap {
        wings: out,
        ..*wrap
    };
    (apart && mesh.wrapped(&now).is_some()).then_some(out)
}
