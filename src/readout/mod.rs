//! What hosts and people look at: surfaces, exports, pictures, plots.
//!
//! Everything here reads plain arrays (positions, triangles) and never a simulation, so that a
//! stored frame is drawn and written by the same code as a running one.

pub mod crossings;
pub mod export;
pub mod flat_yarns;
pub mod palette;
pub mod picture;
pub mod plot;
pub mod surface;
pub mod yarns;

use crate::math::{Vec3, topology};

/// One mesh of a picture or a model file: the garment, or a body.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Part {
    /// Name in model files.
    pub name: String,
    /// World positions [m].
    pub positions: Vec<Vec3>,
    /// Vertex triples; every index is below `positions.len()`.
    pub triangles: Vec<[u32; 3]>,
    /// sRGB colour of each vertex, 0 to 1; shape `[positions.len()]`.
    pub colours: Vec<[f32; 3]>,
    /// Edges drawn as dark lines in pictures (panel borders, seams).
    pub lines: Vec<[u32; 2]>,
    /// Cloth is thin, seen from both sides and framed by the camera; a body is neither.
    pub cloth: bool,
}

impl Part {
    /// A garment: one colour for each panel, panel borders as lines.
    pub fn garment(
        name: &str,
        positions: &[Vec3],
        triangles: &[[u32; 3]],
        vertex_panels: &[u32],
    ) -> Self {
        Self {
            name: name.into(),
            positions: positions.to_vec(),
            triangles: triangles.to_vec(),
            colours: (0..positions.len())
                .map(|v| palette::panel(vertex_panels.get(v).copied().unwrap_or(0)))
                .collect(),
            lines: topology::boundary_edges(triangles),
            cloth: true,
        }
    }

    /// A body in neutral grey.
    pub fn body(name: &str, positions: Vec<Vec3>, triangles: Vec<[u32; 3]>) -> Self {
        Self {
            name: name.into(),
            colours: vec![palette::BODY; positions.len()],
            positions,
            triangles,
            lines: Vec::new(),
            cloth: false,
        }
    }

    /// Refuses arrays that contradict each other and positions that are not finite.
    pub fn check(&self) -> crate::error::Result<()> {
        use crate::error::Error;
        let n = self.positions.len();
        if self.colours.len() != n {
            return Err(Error::argument(format!(
                "'{}': {} colours for {n} vertices",
                self.name,
                self.colours.len()
            )));
        }
        for (v, p) in self.positions.iter().enumerate() {
            if !p.iter().all(|c| c.is_finite()) {
                return Err(Error::argument(format!(
                    "'{}': vertex {v} at ({}, {}, {}) is not finite",
                    self.name, p.x, p.y, p.z
                )));
            }
        }
        let outside = |&i: &u32| i as usize >= n;
        for (t, tri) in self.triangles.iter().enumerate() {
            if let Some(i) = tri.iter().find(|i| outside(i)) {
                return Err(Error::argument(format!(
                    "'{}': triangle {t} names vertex {i} of {n}",
                    self.name
                )));
            }
        }
        for line in &self.lines {
            if let Some(i) = line.iter().find(|i| outside(i)) {
                return Err(Error::argument(format!(
                    "'{}': a line names vertex {i} of {n}",
                    self.name
                )));
            }
        }
        Ok(())
    }
}
