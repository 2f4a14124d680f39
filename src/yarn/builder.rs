//! Puts a [`YarnMesh`] together yarn by yarn, and remembers where yarns end.

use super::{Family, Incidence, Strand, YarnMesh};
use crate::math::{Mat2, Vec2};

/// A node at an edge of its panel: the end of a yarn, or of a finished border.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct EdgeNode {
    pub node: u32,
    pub panel: u32,
    /// Edge number in the panel.
    pub edge: u32,
    /// Fraction of the edge's arc length.
    pub fraction: f64,
}

/// The place of a passage in its node's stack.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub(super) struct Place {
    /// 0 at the back, growing to the front.
    pub rank: u8,
    /// Strands of one group lie beside each other.
    pub group: u8,
}

#[derive(Default)]
pub(super) struct Builder {
    pub mesh: YarnMesh,
    places: Vec<Place>,
    /// From a step on the panel to the same one in the nominal layout.
    pub nominal: Mat2,
    pub edge_nodes: Vec<EdgeNode>,
}

impl Builder {
    /// A node of a panel at a flat place [m].
    pub(super) fn node(&mut self, panel: u32, uv: Vec2, lift: f64) -> u32 {
        let mesh = &mut self.mesh;
        mesh.uv.push(uv);
        mesh.lift.push(lift);
        mesh.node_panel.push(panel);
        mesh.uv.len() as u32 - 1
    }

    /// The yarn passes a node, the straight distance of the nominal layout after its last one; the index of
    /// the incidence.
    pub(super) fn pass(&mut self, node: u32, place: Place) -> u32 {
        let mesh = &mut self.mesh;
        let first = mesh.starts.last().copied().unwrap_or(0) as usize;
        let u = match mesh.incidences.get(first..).and_then(<[Incidence]>::last) {
            Some(last) => {
                let step = mesh.uv[node as usize] - mesh.uv[last.node as usize];
                last.u + (self.nominal * step).norm()
            }
            None => 0.0,
        };
        mesh.incidences.push(Incidence {
            node,
            u,
            slides: true,
        });
        self.places.push(place);
        mesh.incidences.len() as u32 - 1
    }

    /// Ends the yarn whose passages were added last.
    pub(super) fn end_yarn(&mut self, fabric: u32, family: Family) {
        let mesh = &mut self.mesh;
        if mesh.starts.is_empty() {
            mesh.starts.push(0);
        }
        mesh.starts.push(mesh.incidences.len() as u32);
        mesh.yarn_fabric.push(fabric);
        mesh.yarn_family.push(family);
    }

    /// The yarn of the last incidences begins here.
    pub(super) fn yarn_start(&self) -> u32 {
        self.mesh.starts.last().copied().unwrap_or(0)
    }

    /// Sorts the stacks and decides where yarns slide: not at their ends, not at nodes of one yarn,
    /// not where a node is tied.
    pub(super) fn finish(self) -> YarnMesh {
        let Self {
            mut mesh, places, ..
        } = self;
        if mesh.starts.is_empty() {
            mesh.starts.push(0);
        }
        let nodes = mesh.uv.len();
        let mut starts = vec![0u32; nodes + 1];
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
        for (k, incidence) in mesh.incidences.iter().enumerate() {
            let slot = &mut next[incidence.node as usize];
            mesh.stacks[*slot as usize] = Strand {
                incidence: k as u32,
                group: places[k].group,
            };
            *slot += 1;
        }
        for k in 0..nodes {
            let stack = &mut mesh.stacks[starts[k] as usize..starts[k + 1] as usize];
            stack.sort_by_key(|s| (places[s.incidence as usize].rank, s.incidence));
            if let [only] = stack {
                mesh.incidences[only.incidence as usize].slides = false;
            }
        }
        mesh.stack_starts = starts;
        for y in 0..mesh.yarn_count() {
            let (first, last) = (mesh.starts[y] as usize, mesh.starts[y + 1] as usize - 1);
            mesh.incidences[first].slides = false;
            mesh.incidences[last].slides = false;
        }
        for k in 0..mesh.ties.len() {
            let node = mesh.ties[k].node as usize;
            for s in mesh.stack_starts[node] as usize..mesh.stack_starts[node + 1] as usize {
                let incidence = mesh.stacks[s].incidence as usize;
                mesh.incidences[incidence].slides = false;
            }
        }
        mesh
    }
}
