//! What there is: arrays of the garment, energies, sizes.

use super::run::kinetic_energy;
use super::{Energies, Sim};
use crate::blend::Region;
use crate::error::Result;
use crate::math::Vec3;
use crate::readout::surface;
use crate::tri::GarmentMesh;
use crate::yarn::YarnMesh;

/// Counts and bytes of what was built, as `toile info` prints them.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemInfo {
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
    /// Triangles that are simulated; yarns stand for the others.
    pub active_triangles: usize,
    /// Nodes of yarns.
    pub yarn_nodes: usize,
    /// Nodes among them that triangles carry.
    pub carried_nodes: usize,
    /// Nodes in hybrid rings, blended with triangles.
    pub hybrid_nodes: usize,
    /// Vertices there that nodes determine, and those that they support too poorly.
    pub hybrid_vertices: [usize; 2],
    /// How far a vertex there may go when each node goes by one.
    pub amplification: f64,
    /// Yarns.
    pub yarns: usize,
    /// Scalar unknowns.
    pub unknowns: usize,
    /// Terms: name and stencils.
    pub terms: Vec<(String, usize)>,
    /// Bytes of mesh, terms and matrix, without the factor.
    pub bytes: usize,
    /// Bytes of the factor and the solver's work arrays.
    pub factor_bytes: usize,
    /// Smallest triangle angle [rad].
    pub min_angle: f64,
    /// What the triangulation could not do as asked, each with the panel's name.
    pub notes: Vec<String>,
    /// Name of the linear solver.
    pub backend: String,
}

fn leave(points: &mut Vec<Vec3>) -> Vec<Vec3> {
    let copy = points.clone();
    std::mem::replace(points, copy)
}

impl Sim {
    /// Changes with every call that may invalidate a view.
    pub fn epoch(&self) -> u64 {
        self.epoch
    }

    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.state.time
    }

    /// Vertex positions [m].
    pub fn positions(&self) -> &[Vec3] {
        &self.state.positions[..self.mesh.uv.len()]
    }

    /// Vertex velocities [m/s].
    pub fn velocities(&self) -> &[Vec3] {
        &self.state.velocities[..self.mesh.uv.len()]
    }

    /// The memory of the positions, for those who need them to stay; the simulation goes on with a
    /// copy.
    pub fn leave_positions(&mut self) -> Vec<Vec3> {
        leave(&mut self.state.positions)
    }

    /// The memory of the velocities, likewise.
    pub fn leave_velocities(&mut self) -> Vec<Vec3> {
        leave(&mut self.state.velocities)
    }

    /// Unit vertex normals, pointing to the outside of the cloth.
    pub fn normals(&self) -> Vec<Vec3> {
        surface::normals(self.positions(), &self.mesh.triangles)
    }

    /// Vertex triples.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
    }

    /// The triangulated garment.
    pub fn mesh(&self) -> &GarmentMesh {
        &self.mesh
    }

    /// Lumped mass of each vertex [kg].
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Mass of each point, vertices first, as it is simulated [kg].
    pub fn point_masses(&self) -> Vec<f64> {
        self.engine().system.points.masses.clone()
    }

    /// How far the nodes of hybrid rings are from what their vertices say of them, weighted means [m]; 0 without
    /// rings.
    pub fn constraint_violation(&self) -> f64 {
        let filter = self
            .yarns
            .as_ref()
            .and_then(|part| part.coupling.filter.as_ref());
        filter.map_or(0.0, |f| f.violation(&self.state.positions))
    }

    /// Panel of each vertex.
    pub fn vertex_panels(&self) -> &[u32] {
        &self.mesh.vertex_panel
    }

    /// Flat coordinates of each vertex [m].
    pub fn vertex_uv(&self) -> &[crate::math::Vec2] {
        &self.mesh.uv
    }

    /// Energies of the present state.
    pub fn energies(&self) -> Result<Energies> {
        let mut out = Energies {
            kinetic: kinetic_energy(&self.state, &self.engine().system.points.masses),
            ..Energies::default()
        };
        for (name, value) in self.engine().energies(&self.state)? {
            match name {
                "gravity" | "yarn_gravity" => out.gravity += value,
                "membrane" => out.membrane += value,
                "hinge" | "quadratic_bending" => out.bending += value,
                "seam" | "seam_hinge" => out.seam += value,
                "body_contact" | "edge_contact" | "self_contact" => out.contact += value,
                "yarn_stretch" | "yarn_bending" | "yarn_shear" | "yarn_spacing" | "yarn_tie"
                | "stitch_wrapping" | "stitch_length" | "sliding_friction"
                | "parallel_friction" => {
                    out.yarn += value;
                }
                _ => {}
            }
        }
        Ok(out)
    }

    /// Gradient of elastic, contact and outer energies in the present state [N], one vector for each
    /// vertex, pinned ones included. On a free vertex at rest it vanishes; on a held one it is what
    /// its holder bears, turned around.
    pub fn forces(&self) -> Result<Vec<Vec3>> {
        let mut forces = self.point_forces()?;
        forces.truncate(self.mesh.uv.len());
        Ok(forces)
    }

    /// A sentence for each panel that was refined with a lower angle limit than asked for.
    fn lowered_angles(&self) -> Vec<String> {
        self.mesh
            .lowered
            .iter()
            .map(|l| {
                let name = self.garment.panels.get(l.panel as usize);
                format!(
                    "panel {} '{}': refinement ended only with an angle limit of {:.0} degrees, {:.0} were asked",
                    l.panel,
                    name.map_or("", |p| p.name.as_str()),
                    l.kept.to_degrees(),
                    l.asked.to_degrees()
                )
            })
            .collect()
    }

    /// What to tell of hybrid rings that join no vertex to yarns.
    fn idle_rings(&self) -> Option<String> {
        let wanted = self.garment.blend_regions.iter().find(|r| r.rings > 0)?;
        let region = Region::new(&self.garment, &self.mesh).ok()?;
        if !region.hybrid.contains(&true) {
            return None;
        }
        let panel = &self.garment.panels[wanted.panel as usize];
        let yarns = self.garment.fabrics[panel.fabric].yarns.as_ref()?;
        let [a, b] = yarns.structure.pitch();
        Some(format!(
            "the {} hybrid rings of panel '{}' join no vertex to yarns, so the region is as without them: yarns are {a} \
             and {b} m apart, the triangles' edges {} m long",
            wanted.rings,
            panel.name,
            self.garment.panel_edge_length(panel)
        ))
    }

    /// What was built and what it costs.
    pub fn info(&self) -> SystemInfo {
        let engine = self.engine();
        let system = &engine.system;
        let points = &system.points;
        let filter = points.coupling.filter.as_ref();
        let rows = filter.map_or(0, |f| f.width());
        let moving = (0..points.count()).filter(|p| points.moves(*p)).count();
        let mut notes = self.lowered_angles();
        if filter.is_none_or(|f| f.kept().is_empty()) {
            notes.extend(self.idle_rings());
        }
        SystemInfo {
            vertices: self.mesh.uv.len(),
            triangles: self.mesh.triangles.len(),
            active_triangles: system.cloth.mesh.triangles.len(),
            yarn_nodes: self.yarn_nodes().len(),
            carried_nodes: points.coupling.riders.list().len(),
            hybrid_nodes: filter.map_or(0, |f| f.nodes().len()),
            hybrid_vertices: filter.map_or([0; 2], |f| [f.kept().len(), f.dropped().len()]),
            amplification: filter.map_or(0.0, |f| f.amplification()),
            yarns: self.yarns().map_or(0, YarnMesh::yarn_count),
            unknowns: 3 * (moving - self.state.pins.len() - rows) + system.unknowns.sliding(),
            terms: system
                .terms
                .iter()
                .map(|t| (t.name().to_owned(), t.stencils().count()))
                .collect(),
            bytes: engine.matrix_bytes() + system.bytes(),
            factor_bytes: engine.factor_bytes(),
            min_angle: self.mesh.min_angle,
            notes,
            backend: engine.backend().to_owned(),
        }
    }
}
