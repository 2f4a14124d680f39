//! Where the scalars of yarns stand among the unknowns of the system.
//!
//! Unknowns are blocks of three scalars. Block `first_node + i` is the position of node `i` [m]. A node at
//! which yarns slide has further blocks of up to three of its material coordinates [m], in the order
//! of its stack; entries of such a block that are not in use are to be held fixed.

use crate::error::{Error, Result};
use crate::yarn::YarnMesh;
use std::sync::Arc;

/// Blocks of the nodes and of the coordinates that slide now.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Unknowns {
    /// Block of node 0.
    pub first_node: u32,
    /// Block of the first sliding coordinates.
    pub first_slide: u32,
    /// Per incidence: block and component of its coordinate, none where it does not slide now.
    pub slides: Vec<Option<(u32, u8)>>,
    /// Per incidence of a periodic cell: how far its coordinate is from the one whose image it is [m]; empty
    /// without images.
    pub shifts: Arc<[Option<f64>]>,
    /// Node of each sliding block.
    pub owners: Vec<u32>,
    /// Components in use of each sliding block, 1 to 3, the first ones.
    pub used: Vec<u8>,
}

impl Unknowns {
    /// Blocks for the incidences that `sliding` names.
    pub fn new(
        mesh: &YarnMesh,
        first_node: u32,
        first_slide: u32,
        sliding: &[bool],
    ) -> Result<Self> {
        if sliding.len() != mesh.incidences.len() {
            return Err(Error::argument(format!(
                "{} flags for {} passages of yarns",
                sliding.len(),
                mesh.incidences.len()
            )));
        }
        let mut out = Self {
            first_node,
            first_slide,
            slides: vec![None; sliding.len()],
            shifts: Arc::default(),
            owners: Vec::new(),
            used: Vec::new(),
        };
        for node in 0..mesh.uv.len() {
            let mut room = 0;
            for strand in mesh.stack(node) {
                let i = strand.incidence as usize;
                if !sliding[i] {
                    continue;
                }
                if room == 0 {
                    out.owners.push(node as u32);
                    out.used.push(0);
                    room = 3;
                }
                let last = out.used.len() - 1;
                out.slides[i] = Some((first_slide + last as u32, out.used[last]));
                out.used[last] += 1;
                room -= 1;
            }
        }
        for (i, wanted) in sliding.iter().enumerate() {
            if *wanted && !(out.slides[i].is_some() && mesh.incidences[i].slides) {
                return Err(Error::argument(format!(
                    "passage {i} at node {} cannot slide",
                    mesh.incidences[i].node
                )));
            }
        }
        if !mesh.images.is_empty() {
            let mut shifts = vec![None; sliding.len()];
            for image in &mesh.images {
                let [i, of] = [image.incidence, image.of].map(|i| i as usize);
                out.slides[i] = out.slides[of];
                shifts[i] = Some(mesh.incidences[i].u - mesh.incidences[of].u);
            }
            out.shifts = shifts.into();
        }
        Ok(out)
    }

    /// How far a coordinate is from the one whose image it is, if it is one [m].
    pub fn shift(&self, incidence: usize) -> Option<f64> {
        self.shifts.get(incidence).copied().flatten()
    }

    /// Number of sliding blocks.
    pub fn slide_blocks(&self) -> usize {
        self.owners.len()
    }

    /// Number of coordinates that slide.
    pub fn sliding(&self) -> usize {
        self.used.iter().map(|&n| usize::from(n)).sum()
    }

    /// Block of a node's position.
    pub fn node(&self, node: u32) -> u32 {
        self.first_node + node
    }
}
