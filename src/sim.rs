//! The one Rust facade: a garment in a world, stepped, draped, edited, saved, restored.
//!
//! Here: making, saving and restoring a [`Sim`]. `run` lets time pass, `world` edits what is around
//! the cloth, `pins` holds it, `region` moves regions of yarns and `hold` the pins with them, `read` tells what there is.

mod hold;
mod pins;
mod read;
mod region;
mod run;
mod suggest;
mod world;
mod yarns;

use crate::blend::Coupling;
use crate::body::Body;
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::fabric::fitted::fitted;
use crate::math::Vec3;
use crate::pattern::Garment;
use crate::solve::engine::Engine;
pub use crate::solve::report::{Energies, Outcome, StepReport};
pub use crate::solve::settings::Settings;
use crate::system::build::System;
use crate::system::snapshot::{self, Origin};
use crate::system::state::State;
pub use crate::system::term::ContactSettings;
use crate::tri::GarmentMesh;
use crate::yarn::Topology;
pub use read::SystemInfo;
pub use region::RegionChange;
use std::sync::{Mutex, MutexGuard, PoisonError};
pub use yarns::YarnChanges;
use yarns::YarnPart;

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
    /// Stage name: "sew", "settle", "unfold", "rest" of a drape, "step" of a step.
    pub stage: &'static str,
    /// Present residual [N].
    pub residual: f64,
}

/// A garment in a world.
pub struct Sim {
    garment: Garment,
    settings: Settings,
    /// What its fabrics were found with.
    first_settings: Settings,
    state: State,
    bodies: Vec<(Body, ContactSettings)>,
    engine: Mutex<Engine>,
    mesh: GarmentMesh,
    masses: Vec<f64>,
    yarns: Option<YarnPart>,
    /// Grows whenever the yarns change.
    yarn_epoch: u64,
    epoch: u64,
    origin: Origin,
}

impl Sim {
    /// Triangulates and compiles the garment; its vertices stand where the panels are placed.
    pub fn new(garment: &Garment, options: &SimOptions) -> Result<Self> {
        garment.check_within(options.settings.max_vertices as usize)?;
        let mesh = crate::tri::triangulate(garment, 1.0, options.settings.max_vertices as usize)?;
        Self::from_mesh(garment, mesh, options)
    }

    /// A simulation on a mesh of the caller's making, for benchmarks and tests of the mechanics.
    pub fn from_mesh(garment: &Garment, mesh: GarmentMesh, options: &SimOptions) -> Result<Self> {
        let gravity = options.gravity.unwrap_or([0.0, -9.81, 0.0]);
        garment.check_geometry()?;
        let garment = &*fitted(garment, &options.settings)?;
        within("gravity", &gravity, MAX_COMPONENT)?;
        within("wind", &options.wind, MAX_COMPONENT)?;
        within("pressure", &[options.pressure], MAX_PRESSURE)?;
        let masses = Cloth::new(garment, mesh.clone())?.masses;
        let compiled = Compiled::new(garment, &mesh, &options.settings, &options.settings)?;
        let Compiled {
            yarns,
            fingerprint,
            system,
        } = compiled;
        let origin = Origin {
            garment: fingerprint,
            bodies: Vec::new(),
            numbers: options.settings.that_matter(),
        };
        let mut state = State {
            time: 0.0,
            positions: mesh.placed.clone(),
            velocities: vec![Vec3::zeros(); mesh.placed.len()],
            topology: Topology::default(),
            u: Vec::new(),
            u_rates: Vec::new(),
            sliding: Vec::new(),
            strands: Vec::new(),
            yarn_normals: Vec::new(),
            pins: Vec::new(),
            bodies: Vec::new(),
            body_anchors: Vec::new(),
            pair_anchors: Vec::new(),
            step_size: f64::MAX,
            gravity: Vec3::from(gravity),
            wind: Vec3::from(options.wind),
            pressure: options.pressure,
        };
        if let Some(part) = &yarns {
            part.place(garment, &mut state);
        }
        Ok(Self {
            garment: garment.clone(),
            settings: options.settings.clone(),
            first_settings: options.settings.clone(),
            state,
            bodies: Vec::new(),
            engine: Mutex::new(Engine::new(system, &options.settings)),
            mesh,
            masses,
            yarn_epoch: u64::from(yarns.is_some()),
            yarns,
            epoch: 1,
            origin,
        })
    }

    fn engine(&self) -> MutexGuard<'_, Engine> {
        self.engine.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// The garment that was compiled.
    pub fn garment(&self) -> &Garment {
        &self.garment
    }

    /// The state as bytes.
    pub fn save(&self) -> Result<Vec<u8>> {
        snapshot::write(&self.state, &self.origin)
    }

    /// A copy of the state, to go back to with [`Sim::roll_back`]: cheaper than bytes.
    pub fn checkpoint(&self) -> State {
        self.state.clone()
    }

    /// Goes back to a state that this simulation was in since its regions changed last.
    pub fn roll_back(&mut self, state: State) -> Result<()> {
        snapshot::check(&state, &self.state).map_err(Error::state)?;
        self.state = state;
        self.epoch += 1;
        self.take_yarns()
    }

    /// Restores saved bytes of the same garment, bodies and tunables (threads and the limit of
    /// vertices may differ, as no bit depends on them); on error nothing changes.
    pub fn restore(&mut self, bytes: &[u8]) -> Result<()> {
        let mut state = snapshot::read(bytes, &self.origin, &self.state)?;
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
        if let Err(error) = self.take_yarns().and_then(|()| self.check_coordinates()) {
            self.state = state;
            self.take_yarns()?;
            return Err(error.at("snapshot"));
        }
        self.epoch += 1;
        Ok(())
    }
}

/// A garment with its regions of yarns, as it is simulated.
struct Compiled {
    yarns: Option<YarnPart>,
    fingerprint: u64,
    system: System,
}

impl Compiled {
    /// `found` are the settings that fabrics are found with, the same for as long as the simulation lives.
    fn new(
        garment: &Garment,
        mesh: &GarmentMesh,
        settings: &Settings,
        found: &Settings,
    ) -> Result<Self> {
        let yarns = YarnPart::new(garment, mesh, settings, found)?;
        let cloth = match &yarns {
            Some(part) => part.rest_of(garment, mesh)?,
            None => Cloth::new(garment, mesh.clone())?,
        };
        let fingerprint = snapshot::fingerprint(&cloth, &garment.blend_regions);
        let laid = yarns.as_ref().map(|part| part.now.clone());
        let coupling =
            (yarns.as_ref()).map_or_else(Coupling::default, |part| part.coupling.clone());
        let system = System::with_yarns(cloth, laid, coupling, &settings.into())?;
        Ok(Self {
            yarns,
            fingerprint,
            system,
        })
    }
}

fn finite(what: &str, values: &[f64]) -> Result<()> {
    match values.iter().find(|v| !v.is_finite()) {
        Some(v) => Err(Error::argument(format!("{what} = {v} must be finite"))),
        None => Ok(()),
    }
}

/// Largest component of a place [m], a velocity [m/s] or of gravity [m/s^2] that a host may give; squares of much larger ones
/// overflow.
const MAX_COMPONENT: f64 = 1e6;
/// Largest pressure on either side [Pa].
const MAX_PRESSURE: f64 = 1e9;

/// Refuses numbers that are not finite, or beyond `most`.
fn within(what: &str, values: &[f64], most: f64) -> Result<()> {
    // NaN is not within
    match values.iter().find(|v| !(v.abs() <= most)) {
        Some(v) => Err(Error::argument(format!(
            "{what} = {v} must be finite and within {most}"
        ))),
        None => Ok(()),
    }
}

/// Refuses points with a component that is not finite, or beyond [`MAX_COMPONENT`].
fn finite_points(what: &str, points: &[Vec3]) -> Result<()> {
    // NaN is not within
    let is_within = |p: &Vec3| p.iter().all(|c| c.abs() <= MAX_COMPONENT);
    match points.iter().position(|p| !is_within(p)) {
        Some(i) => Err(Error::argument(format!(
            "{what} {i} = ({}, {}, {}) must be finite and within {MAX_COMPONENT}",
            points[i].x, points[i].y, points[i].z
        ))),
        None => Ok(()),
    }
}
