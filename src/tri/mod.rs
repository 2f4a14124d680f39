//! Flat panels to triangles: constrained Delaunay refinement, seams matched by fraction of arc
//! length, placement around the body, coarse levels of the same garment.

pub mod boundary;
pub mod delaunay;
pub mod grid;
pub mod quality;
pub mod seam;
pub mod transfer;

pub use delaunay::triangulate;

use crate::math::{Vec2, Vec3};

/// Triangle mesh of a whole garment; vertices of different panels are never shared.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct GarmentMesh {
    /// Flat coordinates in the vertex's panel [m].
    pub uv: Vec<Vec2>,
    /// World position before sewing [m].
    pub placed: Vec<Vec3>,
    /// Panel of each vertex.
    pub vertex_panel: Vec<u32>,
    /// Vertex triples, ordered so that the normal points to the outside of the cloth.
    pub triangles: Vec<[u32; 3]>,
    /// Panel of each triangle.
    pub triangle_panel: Vec<u32>,
    /// `edge_vertices[panel][edge]`: vertices along that edge from its start to its end. The two
    /// edges of a seam are cut at the same fractions of arc length: equal steps, graded where a
    /// shorter or finer edge is near.
    pub edge_vertices: Vec<Vec<Vec<u32>>>,
    /// One entry for each seam of the garment.
    pub seams: Vec<SeamMesh>,
    /// First vertex of each panel, length `panel_count + 1`: a panel's vertices are contiguous.
    pub panel_starts: Vec<u32>,
    /// Smallest triangle angle [rad].
    pub min_angle: f64,
    /// Panels whose refinement ended only at a lower angle limit than asked for.
    pub lowered: Vec<LoweredAngle>,
}

/// A panel with worse triangles than the others.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LoweredAngle {
    /// The panel.
    pub panel: u32,
    /// The limit that refinement was asked for at first [rad].
    pub asked: f64,
    /// The limit that it ended with [rad]; 0 is none.
    pub kept: f64,
}

/// A seam on the mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct SeamMesh {
    /// Vertices tied to points of edges of the other side. Usually every vertex of side a is tied to
    /// one vertex of side b (`t` is 0 or 1); `length` sums to the mean length of the two edges.
    pub links: Vec<SeamLink>,
    /// Rest angle across the seam [rad].
    pub rest_angle: f64,
}

/// `vertex` is tied to the point `(1 - t) edge[0] + t edge[1]`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeamLink {
    /// The emitting vertex.
    pub vertex: u32,
    /// The receiving boundary edge.
    pub edge: [u32; 2],
    /// Position on the receiving edge, 0 to 1.
    pub t: f64,
    /// Length of seam that this link stands for [m].
    pub length: f64,
}

impl GarmentMesh {
    /// For each vertex whether a seam ties it, or ties something to an edge of it.
    pub fn sewn(&self) -> Vec<bool> {
        let mut sewn = vec![false; self.uv.len()];
        for link in self.seams.iter().flat_map(|s| &s.links) {
            for v in [link.vertex, link.edge[0], link.edge[1]] {
                sewn[v as usize] = true;
            }
        }
        sewn
    }

    /// Leaves out some triangles, and the ties of seams to vertices that have none left; vertices
    /// stay, without triangles.
    pub fn without_triangles(&self, left_out: &[bool]) -> Self {
        let mut mesh = self.clone();
        mesh.triangles.clear();
        mesh.triangle_panel.clear();
        let mut used = vec![false; self.uv.len()];
        for (t, tri) in self.triangles.iter().enumerate() {
            if !left_out[t] {
                mesh.triangles.push(*tri);
                mesh.triangle_panel.push(self.triangle_panel[t]);
                for v in tri {
                    used[*v as usize] = true;
                }
            }
        }
        for seam in &mut mesh.seams {
            seam.links.retain(|l| {
                [l.vertex, l.edge[0], l.edge[1]]
                    .iter()
                    .all(|&v| used[v as usize])
            });
        }
        mesh
    }
}

/// Where each vertex of a fine mesh lies in a coarse mesh of the same garment.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Transfer {
    /// Coarse triangle of each fine vertex.
    pub triangle: Vec<u32>,
    /// Barycentric weights in it; a fine vertex just outside the coarse outline extrapolates.
    pub weights: Vec<[f64; 3]>,
}
