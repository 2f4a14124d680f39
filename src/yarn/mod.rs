//! Yarns as laid on the flat panels: which yarn passes which contact, in what order, how stitches
//! hold each other.
//!
//! A node is a contact of one or more yarns (Cirio et al. 2017, section 3): a place and, for each yarn
//! through it, the yarn's material coordinate `u` there, its arc length at rest. A yarn is the
//! ordered list of its incidences. Everything here is rest data; what moves is in the State.

pub mod border;
mod builder;
mod check;
mod cut;
mod knit;
pub mod layout;
pub mod material;
pub mod names;
pub mod part;
pub mod periodic;
mod piece;
mod region;
mod rods;
mod stitch;
pub mod topology;
mod weave;

pub use layout::{Cell, Layout, lay};
pub use material::YarnMaterial;
pub use names::Names;
pub use topology::Topology;

use crate::math::Vec2;

/// Every yarn of a garment on its flat panels.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct YarnMesh {
    /// Flat coordinates of each node in its panel [m].
    pub uv: Vec<Vec2>,
    /// Height of each node over its panel, along +z of the panel's plane [m]: the small disturbance
    /// that lets a flat knit leave its plane. Weaves have none.
    pub lift: Vec<f64>,
    /// Panel of each node.
    pub node_panel: Vec<u32>,
    /// Incidences of yarn `y`: `starts[y]..starts[y + 1]`; length `yarn_count + 1`.
    pub starts: Vec<u32>,
    /// Passages of yarns through nodes, along each yarn, with increasing `u`.
    pub incidences: Vec<Incidence>,
    /// Fabric of each yarn, an index into the garment's fabrics.
    pub yarn_fabric: Vec<u32>,
    /// What each yarn is.
    pub yarn_family: Vec<Family>,
    /// Stack of node `i`: `stack_starts[i]..stack_starts[i + 1]`; length `node_count + 1`.
    pub stack_starts: Vec<u32>,
    /// Strands at each node from the back to the front of the cloth, which is its outside.
    pub stacks: Vec<Strand>,
    /// Angles of stitches that unwrap (knits).
    pub wraps: Vec<Wrap>,
    /// Lengths of yarn inside of stitch contacts (knits).
    pub stitch_springs: Vec<StitchSpring>,
    /// Angles between warp and weft (weaves).
    pub corners: Vec<Corner>,
    /// Segments whose ends are kept apart by the yarns that they lie beside.
    pub spacings: Vec<Spacing>,
    /// Nodes held at points of other yarns' segments: yarn ends at the rods of seams.
    pub ties: Vec<Tie>,
    /// Places of the rods' nodes on the other side of their seams.
    pub across: Vec<Across>,
    /// Nodes that are there only because energies of other nodes reach them; empty where there are
    /// none, as in whole panels. See [`part`].
    pub outside: Vec<bool>,
    /// `alpha` of each node: how much of the cloth there its yarns are; empty where they are all of it.
    pub alpha: Vec<f64>,
    /// Passages whose coordinates follow from others', in a [`periodic`] cell alone.
    pub images: Vec<Image>,
}

/// Yarns and what they are made of.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Yarns {
    /// How they lie.
    pub mesh: YarnMesh,
    /// One for each fabric of the garment.
    pub materials: Vec<YarnMaterial>,
    /// Each passage's number among the laid ones.
    pub passages: Vec<u32>,
    /// Nodes that the last nodes of the mesh came out of, one for each.
    pub split: Vec<u32>,
}

impl Yarns {
    /// What a yarn is made of.
    pub fn material(&self, yarn: usize) -> &YarnMaterial {
        &self.materials[self.mesh.yarn_fabric[yarn] as usize]
    }
}

/// One passage of a yarn through a node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Incidence {
    /// The node.
    pub node: u32,
    /// Arc length of the yarn at rest from its start [m].
    pub u: f64,
    /// Whether the yarn may slide here; false at ends, at nodes of one yarn and at seams.
    pub slides: bool,
}

/// A passage through the image of a node: its coordinate is that of the passage `of`, as far away as it was laid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Image {
    /// The passage.
    pub incidence: u32,
    /// Whose coordinate it has.
    pub of: u32,
}

/// What a yarn is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Family {
    /// Along `v` of a weave.
    Warp,
    /// Along `u` of a weave.
    Weft,
    /// A knitting yarn.
    Course,
    /// The rod along a seam.
    Seam,
}

/// One yarn in the stack of a node.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Strand {
    /// Its incidence.
    pub incidence: u32,
    /// Strands of one number lie beside each other, strands of two numbers cross.
    pub group: u8,
}

/// Two yarns that turn around each other between the nodes of a stitch contact (Cirio et al. 2017,
/// equation 2, with the signed angle).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Wrap {
    /// Nodes `q0` and `q1` of the contact.
    pub axis: [u32; 2],
    /// Incidences at the far ends of the two wings: of one yarn beside `q0`, of another beside `q1`.
    pub wings: [u32; 2],
    /// Length of the contact at rest [m].
    pub length: f64,
    /// Handedness, +1 or -1.
    pub sign: f64,
}

/// A yarn's length between the two nodes of a stitch contact (Cirio et al. 2017, equation 6).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct StitchSpring {
    /// The yarn's incidences at the two nodes, in the order of the yarn.
    pub incidences: [u32; 2],
    /// Length at rest [m].
    pub length: f64,
}

/// The angle at a crossing between a neighbour along one yarn and a neighbour along the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Corner {
    /// The crossing, its neighbour along the first yarn, its neighbour along the second.
    pub nodes: [u32; 3],
    /// Pitch at rest [m].
    pub length: f64,
}

/// A least length of yarn between two neighbouring crossings.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Spacing {
    /// Consecutive incidences of one yarn, in its order.
    pub incidences: [u32; 2],
    /// Least length between them [m].
    pub least: f64,
    /// Length at rest [m].
    pub length: f64,
}

/// `node` is held at the point `(1 - t) segment[0] + t segment[1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Tie {
    /// The node that is held.
    pub node: u32,
    /// Nodes of the segment that holds it.
    pub segment: [u32; 2],
    /// Position on the segment, 0 to 1.
    pub t: f64,
    /// Length of seam that the tie stands for [m].
    pub length: f64,
}

/// Where a node of a seam's rod, which lies on one side of the seam, lies on the other.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Across {
    /// The node.
    pub node: u32,
    /// Panel of the other side.
    pub panel: u32,
    /// Flat coordinates in it [m].
    pub uv: Vec2,
}

impl YarnMesh {
    /// Whether a node is simulated for its own sake.
    pub fn is_inside(&self, node: u32) -> bool {
        !self.outside.get(node as usize).copied().unwrap_or(false)
    }

    /// Whether an energy over these nodes exists: whether one of them is inside.
    pub fn reaches(&self, nodes: &[u32]) -> bool {
        nodes.iter().any(|n| self.is_inside(*n))
    }

    /// Least and one minus largest `alpha` of an energy that is not whole.
    pub const LEAST_ALPHA: f64 = 0.01;

    /// Part of an energy over these nodes that is the yarns'.
    pub fn weight(&self, nodes: &[u32]) -> f64 {
        if self.alpha.is_empty() {
            return 1.0;
        }
        blended_weight_of(nodes.iter().map(|n| self.alpha[*n as usize]))
    }

    /// Whether the cloth at a node is its yarns alone.
    pub fn is_whole(&self, node: u32) -> bool {
        self.is_inside(node) && self.weight(&[node]) == 1.0
    }

    /// Number of yarns.
    pub fn yarn_count(&self) -> usize {
        self.yarn_fabric.len()
    }

    /// Panel of the first node of a yarn.
    pub fn panel_of(&self, y: usize) -> usize {
        let first = self.incidences[self.starts[y] as usize].node;
        self.node_panel[first as usize] as usize
    }

    /// Incidences of one yarn, in its order.
    pub fn yarn(&self, y: usize) -> &[Incidence] {
        &self.incidences[self.starts[y] as usize..self.starts[y + 1] as usize]
    }

    /// Strands at one node, from the back to the front.
    pub fn stack(&self, node: usize) -> &[Strand] {
        &self.stacks[self.stack_starts[node] as usize..self.stack_starts[node + 1] as usize]
    }
}

/// Weight of an element with these values of `alpha`: their mean, kept from both ends unless all are 1.
pub fn blended_weight(alpha: &[f64]) -> f64 {
    blended_weight_of(alpha.iter().copied())
}

fn blended_weight_of(alpha: impl ExactSizeIterator<Item = f64>) -> f64 {
    let count = alpha.len() as f64;
    let mean = alpha.sum::<f64>() / count;
    if mean >= 1.0 {
        1.0
    } else {
        mean.clamp(YarnMesh::LEAST_ALPHA, 1.0 - YarnMesh::LEAST_ALPHA)
    }
}
