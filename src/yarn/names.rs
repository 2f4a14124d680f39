//! Names of nodes and passages that are the same in every layout of a garment, whichever panels are laid.
//!
//! A panel is laid alike whatever else is: its nodes and passages are known by the panel and their number among the panel's.
//! A rod goes along one side of its seam or along the other, in steps that depend on both: its nodes are known by where
//! they lie and how much of the rod is before them.

use super::{Family, YarnMesh};

/// What a node or a passage is called.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Name {
    rod: bool,
    panel: u32,
    /// Number in the panel, or the bits of flat place [m] and coordinate [m].
    key: [u64; 3],
}

/// Names of all nodes and passages.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Names {
    /// Of nodes.
    pub nodes: Vec<Name>,
    /// Of passages.
    pub passages: Vec<Name>,
}

impl Names {
    /// Those of a part, by the numbers that its nodes and passages have here.
    pub fn part(&self, nodes: &[u32], passages: &[u32]) -> Self {
        Self {
            nodes: nodes.iter().map(|n| self.nodes[*n as usize]).collect(),
            passages: passages
                .iter()
                .map(|i| self.passages[*i as usize])
                .collect(),
        }
    }
}

impl YarnMesh {
    /// Names in yarns as [`lay`](super::lay) lays them: panel by panel, then the rods.
    pub fn names(&self) -> Names {
        let mut names = Names::default();
        let first_rod = (self.yarn_family.iter())
            .position(|f| *f == Family::Seam)
            .map_or(self.incidences.len(), |y| self.starts[y] as usize);
        let rods = &self.incidences[first_rod..];
        let first_node = rods.first().map_or(self.uv.len(), |i| i.node as usize);
        let mut start = 0;
        for (n, panel) in self.node_panel[..first_node].iter().enumerate() {
            if *panel != self.node_panel[start] {
                start = n;
            }
            names.nodes.push(numbered(*panel, n - start));
        }
        let panel = |i: usize| self.node_panel[self.incidences[i].node as usize];
        let mut start = 0;
        for i in 0..first_rod {
            if panel(i) != panel(start) {
                start = i;
            }
            names.passages.push(numbered(panel(i), i - start));
        }
        // each node of a rod has one passage, in the same order
        for rod in rods {
            let (uv, panel) = (
                self.uv[rod.node as usize],
                self.node_panel[rod.node as usize],
            );
            let name = Name {
                rod: true,
                panel,
                key: [uv.x, uv.y, rod.u].map(f64::to_bits),
            };
            names.nodes.push(name);
            names.passages.push(name);
        }
        names
    }
}

fn numbered(panel: u32, number: usize) -> Name {
    Name {
        rod: false,
        panel,
        key: [number as u64, 0, 0],
    }
}
