//! A body made from a triangle mesh, as created or deformed.
//!
//! What does not change with the deformation (topology, the tree's shape, the field of the mesh as
//! created) is shared; positions, boxes and field are of one deformation. An update always starts from the mesh
//! as created, never from the last deformation, and every number it takes over is one that it
//! would compute again: the bits depend on the vertices alone.

use super::field::{Field, Origin, Source};
use super::mesh::{MeshReport, Topology, finite_positions};
use super::tree::Tree;
use super::{analytic, sign};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::boxtree::Aabb;
use crate::math::hash::Hash;
use crate::math::parallel::Workers;
use std::sync::Arc;

/// Largest cell size given over the least extent of the body.
const COARSEST: f64 = 0.25;

/// What all deformations of a mesh share.
#[derive(Debug)]
struct Rest {
    topology: Topology,
    vertices: Arc<Vec<Vec3>>,
    tree: Arc<Tree>,
    origin: Origin,
}

/// A mesh body.
#[derive(Debug)]
pub(super) struct MeshBody {
    rest: Arc<Rest>,
    vertices: Arc<Vec<Vec3>>,
    tree: Arc<Tree>,
    pub(super) field: Arc<Field>,
}

/// Cell size for a mesh when none is given [m]: half the median edge, but so that the area is
/// 36,000 to 150,000 cells. A person of 1.8 m^2 with edges of 1 cm gets 5 mm.
fn automatic_cell(report: &MeshReport) -> f64 {
    let typical = (report.area / 72_000.0).sqrt();
    (0.5 * report.median_edge).clamp(0.7 * typical, 1.4 * typical)
}

/// Refuses a cell size at which the field would lose the inside of the body.
fn fine_enough(vertices: &[Vec3], cell: f64) -> Result<()> {
    let bounds = Aabb::of(vertices);
    let least = (bounds.max - bounds.min).min();
    if cell > COARSEST * least {
        return Err(Error::geometry(format!(
            "cell size {cell} m: the body is {least} m thin, and cells are at most {COARSEST} of that; 0 chooses"
        )));
    }
    Ok(())
}

impl MeshBody {
    /// Takes all that makes the body into a hash.
    pub(super) fn add_to(&self, hash: &mut Hash) {
        hash.add(b"mesh");
        for vertices in [&self.rest.vertices, &self.vertices] {
            hash.numbers(vertices.iter().flat_map(|p| [p.x, p.y, p.z]));
        }
        for v in self.triangles().as_flattened() {
            hash.add(&v.to_le_bytes());
        }
        hash.numbers([self.field.cell_size()]);
    }

    pub(super) fn new(
        positions: &[[f64; 3]],
        triangles: &[[u32; 3]],
        cell: f64,
        workers: &Workers,
    ) -> Result<Self> {
        let vertices = finite_positions(positions)?;
        if cell != 0.0 {
            analytic::positive("cell size", cell)?;
        }
        let topology = Topology::new(&vertices, triangles)?;
        fine_enough(&vertices, cell)?;
        let h = if cell == 0.0 {
            automatic_cell(&topology.report)
        } else {
            cell
        };
        let tree = Tree::new(&vertices, &topology.welded, workers);
        let source = Source {
            positions: &vertices,
            triangles: &topology.welded,
            tree: &tree,
        };
        let origin = Origin::new(source, h, workers)?;
        let vertices = Arc::new(vertices);
        let tree = Arc::new(tree);
        let field = Arc::clone(&origin.field);
        Ok(Self {
            vertices: Arc::clone(&vertices),
            tree: Arc::clone(&tree),
            field,
            rest: Arc::new(Rest {
                topology,
                vertices,
                tree,
                origin,
            }),
        })
    }

    pub(super) fn deformed(&self, vertices: &[Vec3], workers: &Workers) -> Result<Self> {
        let rest = &self.rest;
        rest.topology.check_deformation(vertices)?;
        let triangles = &rest.topology.welded;
        let moved = rest.tree.moved(triangles, &rest.vertices, vertices);
        let tree = rest.tree.refitted(vertices, triangles, &moved, workers);
        let created = Source {
            positions: &rest.vertices,
            triangles,
            tree: &rest.tree,
        };
        let source = Source {
            positions: vertices,
            triangles,
            tree: &tree,
        };
        let field = rest.origin.updated(created, source, &moved, workers)?;
        Ok(Self {
            rest: Arc::clone(rest),
            vertices: Arc::new(vertices.to_vec()),
            tree: Arc::new(tree),
            field: Arc::new(field),
        })
    }

    pub(super) fn report(&self) -> &MeshReport {
        &self.rest.topology.report
    }

    pub(super) fn vertices(&self) -> &[Vec3] {
        &self.vertices
    }

    pub(super) fn triangles(&self) -> &[[u32; 3]] {
        &self.rest.topology.triangles
    }

    pub(super) fn nearest(&self, p: &Vec3) -> (u32, [f64; 3]) {
        self.tree.nearest(p)
    }

    /// Place of a material point of the surface on given vertices.
    fn place(&self, vertices: &[Vec3], triangle: u32, w: &[f64; 3]) -> Vec3 {
        let t = self.triangles()[triangle as usize];
        vertices[t[0] as usize] * w[0]
            + vertices[t[1] as usize] * w[1]
            + vertices[t[2] as usize] * w[2]
    }

    pub(super) fn carried(&self, to: &[Vec3], p: &Vec3) -> Option<Vec3> {
        if to.len() != self.vertices.len() {
            return None;
        }
        let (t, w) = self.nearest(p);
        Some(p + self.place(to, t, &w) - self.place(&self.vertices, t, &w))
    }

    pub(super) fn exact_distance(&self, p: &Vec3) -> f64 {
        let d = self.tree.distance(p, &mut 0);
        if self.is_inside(p) { -d } else { d }
    }

    pub(super) fn is_inside(&self, p: &Vec3) -> bool {
        sign::winding_number(&self.vertices, &self.rest.topology.welded, p) > 0.5
    }

    pub(super) fn segment_hits(&self, p: &Vec3, q: &Vec3) -> bool {
        self.tree.segment_hits(p, q)
    }
}
