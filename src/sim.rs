//! The one Rust facade: a garment in a world, stepped, draped, edited, saved, restored.

use crate::body::{Body, Pose};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::{Rotation, Vec3};
use crate::pattern::Garment;
use crate::readout::surface;
use crate::solve::drape;
use crate::solve::engine::Engine;
pub use crate::solve::report::{Energies, Outcome, StepReport};
pub use crate::solve::settings::Settings;
use crate::solve::step::{self, Totals};
use crate::system::bodies::check_index;
use crate::system::build::{BuildOptions, System};
use crate::system::snapshot;
use crate::system::state::{Pin, State};
pub use crate::system::term::ContactSettings;
use crate::tri::GarmentMesh;
use std::sync::{Mutex, MutexGuard, PoisonError};

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
    settings: Settings,
    state: State,
    bodies: Vec<(Body, ContactSettings)>,
    engine: Mutex<Engine>,
    mesh: GarmentMesh,
    masses: Vec<f64>,
    epoch: u64,
    fingerprint: u64,
}

impl Sim {
    /// Triangulates and compiles the garment; its vertices stand where the panels are placed.
    pub fn new(garment: &Garment, options: &SimOptions) -> Result<Self> {
        garment.check()?;
        if !garment.blend_regions.is_empty() {
            return Err(Error::unsupported(
                "the garment has a blend region, and this version simulates triangles only",
            ));
        }
        let mesh = crate::tri::triangulate(garment, 1.0, options.settings.max_vertices as usize)?;
        Self::from_mesh(garment, mesh, options)
    }

    /// A simulation on a mesh of the caller's making, for benchmarks and tests of the mechanics.
    pub fn from_mesh(garment: &Garment, mesh: GarmentMesh, options: &SimOptions) -> Result<Self> {
        let gravity = options.gravity.unwrap_or([0.0, -9.81, 0.0]);
        finite("gravity", &gravity)?;
        finite("wind", &options.wind)?;
        finite("pressure", &[options.pressure])?;
        let cloth = Cloth::new(garment, mesh.clone())?;
        let masses = cloth.masses.clone();
        let fingerprint = snapshot::fingerprint(&cloth);
        let system = System::new(cloth, &BuildOptions::from(&options.settings))?;
        let state = State {
            time: 0.0,
            positions: mesh.placed.clone(),
            velocities: vec![Vec3::zeros(); mesh.placed.len()],
            pins: Vec::new(),
            bodies: Vec::new(),
            body_anchors: Vec::new(),
            pair_anchors: Vec::new(),
            step_size: f64::MAX,
            gravity: Vec3::from(gravity),
            wind: Vec3::from(options.wind),
            pressure: options.pressure,
        };
        Ok(Self {
            garment: garment.clone(),
            settings: options.settings.clone(),
            state,
            bodies: Vec::new(),
            engine: Mutex::new(Engine::new(system, &options.settings)),
            mesh,
            masses,
            epoch: 1,
            fingerprint,
        })
    }

    fn engine(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The garment that was compiled.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }

    /// Puts a body into the world at the identity pose; returns its number.
    pub fn add_body(&mut self, body: &Body, contact: &ContactSettings) -> Result<u32> {
        contact.check()?;
        let entry = self.engine().system.bodies.add(body, contact);
        self.state.bodies.push(entry);
        self.bodies.push((body.clone(), *contact));
        self.epoch += 1;
        Ok((self.bodies.len() - 1) as u32)
    }

    /// Number of bodies.
    pub fn body_count(&self) -> usize {
        self.bodies.len()
    }

    /// Display mesh of a body at its present pose and deformation.
    pub fn body_mesh(&self, body: u32) -> Result<(Vec<Vec3>, Vec<[u32; 3]>)> {
        let b = check_index(body, self.bodies.len())?;
        let (mut positions, triangles) = self.bodies[b].0.display_mesh();
        let state = &self.state.bodies[b];
        if !state.vertices.is_empty() {
            positions.clone_from(&state.vertices);
        }
        for p in &mut positions {
            *p = state.pose.to_world(p);
        }
        Ok((positions, triangles))
    }

    /// Where the body is to be at the end of the next step (before the first step: where it is).
    pub fn set_body_pose(&mut self, body: u32, position: [f64; 3], xyzw: [f64; 4]) -> Result<()> {
        let b = check_index(body, self.bodies.len())?;
        finite("position", &position)?;
        finite("quaternion", &xyzw)?;
        let [x, y, z, w] = xyzw;
        let quaternion = nalgebra::Quaternion::new(w, x, y, z);
        let rotation = Rotation::try_new(quaternion, 1e-12).ok_or_else(|| {
            Error::argument(format!("body {b}: quaternion {xyzw:?} has no length"))
        })?;
        let pose = Pose {
            position: Vec3::from(position),
            rotation,
        };
        let state = &mut self.state.bodies[b];
        state.target = pose;
        if !state.moved_with_time {
            state.pose = pose;
        }
        self.epoch += 1;
        Ok(())
    }

    /// Vertices of a deforming mesh body at the end of the next step, body frame [m].
    pub fn set_body_vertices(&mut self, body: u32, positions: &[[f64; 3]]) -> Result<()> {
        let b = check_index(body, self.bodies.len())?;
        let count = self.bodies[b].0.vertices().len();
        if count == 0 {
            return Err(Error::unsupported(format!(
                "body {b} is not a mesh and cannot deform"
            )));
        }
        if positions.len() != count {
            return Err(Error::argument(format!(
                "body {b} has {count} vertices, {} were given",
                positions.len()
            )));
        }
        let vertices: Vec<Vec3> = positions.iter().map(|p| Vec3::from(*p)).collect();
        finite_points("body vertex", &vertices)?;
        let state = &mut self.state.bodies[b];
        if !state.moved_with_time {
            // a placement: the deformed field must exist before anything is changed
            self.bodies[b].0.deformed_with(
                &vertices,
                self.engine
                    .lock()
                    .unwrap_or_else(PoisonError::into_inner)
                    .workers(),
            )?;
            state.vertices.clone_from(&vertices);
            state.target_vertices.clear();
        } else {
            state.target_vertices = vertices;
        }
        self.epoch += 1;
        Ok(())
    }

    /// Force and torque of the cloth on a body, about the body's origin, world axes [N], [N m].
    pub fn body_wrench(&self, body: u32) -> Result<([f64; 3], [f64; 3])> {
        let b = check_index(body, self.bodies.len())?;
        let (force, torque) = self.engine().body_wrench(&self.state, b)?;
        Ok((force.into(), torque.into()))
    }

    /// Holds vertices; targets are reached at the end of the next step, `None` holds them where
    /// they are. A vertex that is already pinned takes the new target.
    pub fn pin(&mut self, vertices: &[u32], targets: Option<&[[f64; 3]]>) -> Result<()> {
        self.check_vertices(vertices)?;
        if let Some(targets) = targets {
            if targets.len() != vertices.len() {
                return Err(Error::argument(format!(
                    "{} vertices but {} targets",
                    vertices.len(),
                    targets.len()
                )));
            }
            for (v, t) in vertices.iter().zip(targets) {
                finite(&format!("target of vertex {v}"), t)?;
            }
        }
        for (k, &vertex) in vertices.iter().enumerate() {
            let target = targets.map_or(self.state.positions[vertex as usize], |targets| {
                Vec3::from(targets[k])
            });
            match self.state.pins.binary_search_by_key(&vertex, |p| p.vertex) {
                Ok(i) => self.state.pins[i].target = target,
                Err(i) => self.state.pins.insert(i, Pin { vertex, target }),
            }
        }
        self.epoch += 1;
        Ok(())
    }

    /// Lets vertices go; one that is not pinned is refused.
    pub fn unpin(&mut self, vertices: &[u32]) -> Result<()> {
        self.check_vertices(vertices)?;
        let pinned = |v: &u32| {
            self.state
                .pins
                .binary_search_by_key(v, |p| p.vertex)
                .is_ok()
        };
        if let Some(v) = vertices.iter().find(|v| !pinned(v)) {
            return Err(Error::argument(format!("vertex {v} is not pinned")));
        }
        self.state.pins.retain(|p| !vertices.contains(&p.vertex));
        self.epoch += 1;
        Ok(())
    }

    fn check_vertices(&self, vertices: &[u32]) -> Result<()> {
        let n = self.state.positions.len();
        match vertices.iter().find(|&&v| v as usize >= n) {
            Some(v) => Err(Error::argument(format!(
                "vertex {v} does not exist; there are {n} vertices"
            ))),
            None => Ok(()),
        }
    }

    /// Vertex of a panel nearest to a flat point [m].
    pub fn locate(&self, panel: u32, uv: [f64; 2]) -> Result<u32> {
        finite("uv", &uv)?;
        let starts = &self.mesh.panel_starts;
        let p = panel as usize;
        if p + 1 >= starts.len() {
            return Err(Error::argument(format!(
                "panel {panel} does not exist; there are {}",
                starts.len().saturating_sub(1)
            )));
        }
        let point = crate::math::Vec2::from(uv);
        (starts[p]..starts[p + 1])
            .min_by(|a, b| {
                let d = |v: &u32| (self.mesh.uv[*v as usize] - point).norm_squared();
                d(a).total_cmp(&d(b))
            })
            .ok_or_else(|| Error::argument(format!("panel {panel} has no vertices")))
    }

    /// Advances by exactly `dt` [s], or returns the state untouched.
    pub fn step(&mut self, dt: f64) -> Result<StepReport> {
        if !(dt.is_finite() && dt > 0.0 && dt <= 1e6) {
            return Err(Error::argument(format!(
                "dt = {dt} s must be positive and at most 1e6"
            )));
        }
        let saved = self.state.clone();
        let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let done = step::step(&mut engine, &mut self.state, dt).and_then(|totals| {
            let outcome = if totals.cut {
                Outcome::Substepped
            } else {
                Outcome::Converged
            };
            describe(&mut engine, &self.state, &totals, outcome, dt)
        });
        drop(engine);
        match done {
            Ok(report) => {
                self.epoch += 1;
                Ok(report)
            }
            Err(error) => {
                self.state = saved;
                Err(error)
            }
        }
    }

    /// Sews and drapes to rest; time does not advance. The callback returns false to stop, which
    /// leaves the state reached so far and is no error.
    pub fn drape(
        &mut self,
        options: &DrapeOptions,
        progress: &mut dyn FnMut(&Progress) -> bool,
    ) -> Result<StepReport> {
        finite("force_tolerance", &[options.force_tolerance])?;
        if options.force_tolerance < 0.0 {
            return Err(Error::argument(format!(
                "force_tolerance = {} N must not be negative",
                options.force_tolerance
            )));
        }
        let plan = drape::Plan {
            force_tolerance: if options.force_tolerance > 0.0 {
                options.force_tolerance
            } else {
                self.settings.drape_force_tolerance
            },
            max_steps: if options.max_steps > 0 {
                options.max_steps
            } else {
                self.settings.drape_max_steps as u64
            },
        };
        let saved = self.state.clone();
        let flat = self.state.positions == self.mesh.placed;
        let levels = if flat {
            self.coarse_levels()?
        } else {
            Vec::new()
        };
        for body in &mut self.state.bodies {
            body.pose = body.target;
            if !body.target_vertices.is_empty() {
                body.vertices = std::mem::take(&mut body.target_vertices);
            }
        }
        let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
        let done = drape::drape(
            &mut engine,
            &mut self.state,
            levels,
            flat,
            &plan,
            &mut |f, s, r| {
                progress(&Progress {
                    fraction: f,
                    stage: s,
                    residual: r,
                })
            },
        )
        .and_then(|relaxed| {
            let outcome = if relaxed.cancelled {
                Outcome::Cancelled
            } else if relaxed.converged {
                Outcome::Converged
            } else {
                Outcome::IterationLimit
            };
            describe(&mut engine, &self.state, &relaxed.totals, outcome, 0.0)
        });
        drop(engine);
        match done {
            Ok(report) => {
                self.epoch += 1;
                Ok(report)
            }
            Err(error) => {
                self.state = saved;
                Err(error)
            }
        }
    }

    /// Coarse versions of the garment, coarsest first, each at least a few hundred vertices.
    fn coarse_levels(&self) -> Result<Vec<drape::Level>> {
        let mut levels = Vec::new();
        if self.garment.panels.is_empty() {
            return Ok(levels);
        }
        for k in (1..=self.settings.drape_levels as i32).rev() {
            let scale = COARSENING.powi(k);
            if (self.mesh.uv.len() as f64) / (scale * scale) < SMALLEST_LEVEL {
                continue;
            }
            let mesh =
                crate::tri::triangulate(&self.garment, scale, self.settings.max_vertices as usize)?;
            let cloth = Cloth::new(&self.garment, mesh)?;
            let mut system = System::new(cloth, &BuildOptions::from(&self.settings))?;
            for (body, contact) in &self.bodies {
                let _ = system.bodies.add(body, contact);
            }
            levels.push(drape::Level {
                engine: Engine::new(system, &self.settings),
            });
        }
        Ok(levels)
    }

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
        &self.state.positions
    }

    /// Vertex velocities [m/s].
    pub fn velocities(&self) -> &[Vec3] {
        &self.state.velocities
    }

    /// Sets positions [m] and velocities [m/s] of every vertex (`None`: zero). Friction anchors are
    /// forgotten; pins keep their targets.
    pub fn set_positions(&mut self, x: &[[f64; 3]], v: Option<&[[f64; 3]]>) -> Result<()> {
        let n = self.state.positions.len();
        if x.len() != n || v.is_some_and(|v| v.len() != n) {
            return Err(Error::argument(format!(
                "{n} vertices, not {}, are expected",
                x.len()
            )));
        }
        let x: Vec<Vec3> = x.iter().map(|p| Vec3::from(*p)).collect();
        let v: Vec<Vec3> = v.map_or_else(
            || vec![Vec3::zeros(); n],
            |v| v.iter().map(|p| Vec3::from(*p)).collect(),
        );
        finite_points("position of vertex", &x)?;
        finite_points("velocity of vertex", &v)?;
        self.state.positions = x;
        self.state.velocities = v;
        self.state.body_anchors.clear();
        self.state.pair_anchors.clear();
        self.state.step_size = f64::MAX;
        self.epoch += 1;
        Ok(())
    }

    /// Unit vertex normals, pointing to the outside of the cloth.
    pub fn normals(&self) -> Vec<Vec3> {
        surface::normals(&self.state.positions, &self.mesh.triangles)
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
            kinetic: self.kinetic_energy(),
            ..Energies::default()
        };
        for (name, value) in self.engine().energies(&self.state)? {
            match name {
                "gravity" => out.gravity += value,
                "membrane" => out.membrane += value,
                "hinge" | "quadratic_bending" => out.bending += value,
                "seam" | "seam_hinge" => out.seam += value,
                "body_contact" | "edge_contact" | "self_contact" => out.contact += value,
                _ => {}
            }
        }
        Ok(out)
    }

    fn kinetic_energy(&self) -> f64 {
        kinetic_energy(&self.state, &self.masses)
    }

    /// Numbers of the present state without advancing it (counts are zero).
    pub fn report(&self) -> Result<StepReport> {
        let mut engine = self.engine();
        describe(
            &mut engine,
            &self.state,
            &Totals::default(),
            Outcome::Converged,
            0.0,
        )
    }

    /// The state as bytes.
    pub fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(&self.state, self.fingerprint)
    }

    /// Restores saved bytes of the same garment and bodies; on error nothing changes.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let mut state = snapshot::read(bytes, self.fingerprint, &self.state)?;
        for (b, ((body, _), entry)) in self.bodies.iter().zip(&mut state.bodies).enumerate() {
            for vertices in [&entry.vertices, &entry.target_vertices] {
                if !vertices.is_empty() && vertices.len() != body.vertices().len() {
                    return Err(Error::parse(format!(
                        "snapshot: body {b} has {} vertices, {} are expected",
                        vertices.len(),
                        body.vertices().len()
                    )));
                }
            }
        }
        std::mem::swap(&mut self.state, &mut state);
        self.epoch += 1;
        Ok(())
    }

    /// Sets a tunable, gravity (`gravity.x`), wind (`wind.x`) or `pressure` by dotted name.
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<()> {
        finite(name, &[value])?;
        if let Some(slot) = world_number(&mut self.state, name) {
            *slot = value;
        } else {
            let mut settings = self.settings.clone();
            settings.set(name, value)?;
            self.engine().set_settings(&settings)?;
            self.settings = settings;
        }
        self.epoch += 1;
        Ok(())
    }

    /// Reads what `set_number` sets.
    pub fn number(&self, name: &str) -> Result<f64> {
        let s = &self.state;
        let value = match name {
            "gravity.x" => Some(s.gravity.x),
            "gravity.y" => Some(s.gravity.y),
            "gravity.z" => Some(s.gravity.z),
            "wind.x" => Some(s.wind.x),
            "wind.y" => Some(s.wind.y),
            "wind.z" => Some(s.wind.z),
            "pressure" => Some(s.pressure),
            _ => self.settings.get(name),
        };
        value.ok_or_else(|| Error::argument(format!("'{name}' is not the name of a number")))
    }

    /// What was built and what it costs.
    pub fn info(&self) -> SystemInfo {
        let engine = self.engine();
        let system = &engine.system;
        SystemInfo {
            vertices: self.mesh.uv.len(),
            triangles: self.mesh.triangles.len(),
            unknowns: 3 * (self.mesh.uv.len() - self.state.pins.len()),
            terms: system
                .terms
                .iter()
                .map(|t| (t.name().to_owned(), t.stencils().count()))
                .collect(),
            bytes: engine.matrix_bytes() + system.bytes(),
            factor_bytes: engine.factor_bytes(),
            min_angle: self.mesh.min_angle,
            backend: engine.backend().to_owned(),
        }
    }
}

/// Ratio of edge lengths between two levels of a drape.
const COARSENING: f64 = 2.5;
/// No level with fewer vertices is made.
const SMALLEST_LEVEL: f64 = 200.0;

fn describe(
    engine: &mut Engine,
    state: &State,
    totals: &Totals,
    outcome: Outcome,
    advanced: f64,
) -> Result<StepReport> {
    let potential_energy = engine.potential_energy(state)?;
    let system = &engine.system;
    Ok(StepReport {
        outcome,
        newton_iterations: totals.newton_iterations,
        linear_iterations: totals.linear_iterations,
        substeps: totals.substeps,
        advanced,
        residual: totals.residual,
        max_edge_strain: system.largest_strain(&state.positions),
        min_gap: system.smallest_gap(&state.positions),
        kinetic_energy: kinetic_energy(state, &system.cloth.masses),
        potential_energy,
        max_seam_gap: system.largest_seam_gap(&state.positions),
    })
}

fn kinetic_energy(state: &State, masses: &[f64]) -> f64 {
    state
        .velocities
        .iter()
        .zip(masses)
        .map(|(v, m)| 0.5 * m * v.norm_squared())
        .sum()
}

fn world_number<'a>(state: &'a mut State, name: &str) -> Option<&'a mut f64> {
    match name {
        "gravity.x" => Some(&mut state.gravity.x),
        "gravity.y" => Some(&mut state.gravity.y),
        "gravity.z" => Some(&mut state.gravity.z),
        "wind.x" => Some(&mut state.wind.x),
        "wind.y" => Some(&mut state.wind.y),
        "wind.z" => Some(&mut state.wind.z),
        "pressure" => Some(&mut state.pressure),
        _ => None,
    }
}

fn finite(what: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(Error::argument(format!("{what} = {v} must be finite"))),
        None => Ok(()),
    }
}

fn finite_points(what: &str, points: &[Vec3]) -> Result<()> {
    match points.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
        Some(i) => Err(Error::argument(format!(
            "{what} {i} = {:?} must be finite",
            points[i]
        ))),
        None => Ok(()),
    }
}
