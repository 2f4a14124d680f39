//! Scene files: a garment, bodies, a world and a plan of what to run, as plain data.
//!
//! `schema` lists every key, `read` turns JSON into a [`Scene`], `motion` says where bodies and pins
//! are at a time, `files` finds and bounds the files that a scene names. Nothing here simulates;
//! `sim_scene` builds a simulation from a scene.

pub mod files;
pub mod motion;
pub mod read;
pub mod schema;

use crate::body::{Body, Pose};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::pattern::Garment;
use crate::solve::settings::Settings;
use crate::system::term::ContactSettings;
use motion::{BodyMotion, OffsetKey};

/// Everything that a scene file says.
#[derive(Clone, Debug)]
pub struct Scene {
    /// Name for people.
    pub name: String,
    /// The garment, its fabrics replaced where the scene says so.
    pub garment: Garment,
    /// Bodies, numbered in this order.
    pub bodies: Vec<SceneBody>,
    /// Acceleration of gravity [m/s^2].
    pub gravity: [f64; 3],
    /// Velocity of the air [m/s].
    pub wind: [f64; 3],
    /// Pressure along the cloth's normal [Pa].
    pub pressure: f64,
    /// Held points.
    pub pins: Vec<ScenePin>,
    /// Named points and curves of the garment that hosts watch.
    pub probes: Vec<SceneProbe>,
    /// Tunables.
    pub settings: Settings,
    /// Whether the scene says on how many threads it runs; else the host chooses.
    pub threads_given: bool,
    /// State to start from instead of the placed panels.
    pub initial: Initial,
    /// What to run.
    pub run: RunPlan,
    /// Remarks on what was read, such as measured numbers that were dropped.
    pub notes: Vec<String>,
}

/// A body of a scene.
#[derive(Clone, Debug)]
pub struct SceneBody {
    /// Name for people and model files.
    pub name: String,
    /// Its shape.
    pub body: Body,
    /// How cloth meets it.
    pub contact: ContactSettings,
    /// How it moves; without motion, where it stands.
    pub motion: BodyMotion,
}

impl SceneBody {
    /// Moves the body, and where it goes over time, by an offset [m].
    pub fn shift(&mut self, offset: Vec3) {
        if self.motion.keys.is_empty() {
            self.motion.keys = BodyMotion::fixed(Pose::default()).keys;
        }
        for key in &mut self.motion.keys {
            key.pose.position += offset;
        }
    }
}

/// Which vertices a pin holds.
/// Which points a pin holds: vertices, or nodes on a panel that is simulated as yarns.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PinPlace {
    /// The point nearest to a flat point [m].
    Point([f64; 2]),
    /// Every point on an edge of the panel, by edge number.
    Edge(u32),
    /// Every node of a yarn, or one at its end: 0 where it begins, 1 where it ends.
    Yarn {
        /// The yarn.
        yarn: u32,
        /// Which end.
        end: Option<u32>,
    },
}

/// A pin of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct ScenePin {
    /// Panel index; of no meaning for a yarn.
    pub panel: u32,
    /// Which points.
    pub place: PinPlace,
    /// Where a single point is to be [m]; otherwise it is held where the panel is placed.
    pub target: Option<[f64; 3]>,
    /// Displacement from there over time.
    pub motion: Vec<OffsetKey>,
    /// Time at which the pin lets go [s].
    pub until: Option<f64>,
}

/// A point or a curve of the garment that hosts watch by name.
#[derive(Clone, Debug, PartialEq)]
pub struct SceneProbe {
    /// Name, no two alike.
    pub name: String,
    /// Panel index.
    pub panel: u32,
    /// A point (its nearest vertex), or an edge: the curve of its vertices.
    pub place: PinPlace,
}

/// State to start from.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Initial {
    /// Vertex positions [m], in the mesh's order.
    pub positions: Option<Vec<[f64; 3]>>,
    /// One velocity for every vertex [m/s].
    pub velocity: [f64; 3],
    /// A saved state of the same scene.
    pub snapshot: Option<Vec<u8>>,
}

/// What to run.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RunPlan {
    /// Sew and drape to rest first.
    pub drape: bool,
    /// Time simulated afterwards [s].
    pub duration: f64,
    /// Step of that time [s].
    pub dt: f64,
    /// Every how many steps a frame is kept; 0 keeps none.
    pub frame_every: u32,
}

impl Default for RunPlan {
    fn default() -> Self {
        Self {
            drape: true,
            duration: 0.0,
            dt: 1.0 / 60.0,
            frame_every: 0,
        }
    }
}

/// Most steps that a plan may have.
pub const MAX_STEPS: f64 = 1e8;

impl RunPlan {
    /// Number of steps: the duration in steps of `dt`, the last one of what is left.
    pub fn steps(&self) -> u64 {
        let steps = self.duration / self.dt;
        // a remainder of rounding is no step
        (steps - 1e-9 * steps.max(1.0)).ceil().clamp(0.0, MAX_STEPS) as u64
    }

    /// Time gone after a number of steps [s].
    pub fn time_after(&self, step: u64) -> f64 {
        let time = step as f64 * self.dt;
        let last = self.duration - (self.steps() as f64 - 1.0) * self.dt;
        if step == self.steps() && (last - self.dt).abs() > 1e-6 * self.dt {
            self.duration
        } else {
            time
        }
    }

    /// Refuses steps that are not positive and plans without end.
    pub fn check(&self) -> Result<()> {
        if !(self.dt.is_finite() && self.dt > 0.0) {
            return Err(Error::argument(format!(
                "run.dt: {} must be finite and positive",
                self.dt
            )));
        }
        if !(self.duration.is_finite() && self.duration >= 0.0) {
            return Err(Error::argument(format!(
                "run.duration: {} must be finite and not negative",
                self.duration
            )));
        }
        if self.duration / self.dt > MAX_STEPS {
            return Err(Error::limit(format!(
                "run: {} s in steps of {} s are more than {MAX_STEPS} steps",
                self.duration, self.dt
            )));
        }
        Ok(())
    }
}

/// Name of the number of threads.
pub const THREADS: &str = "solver.threads";

/// Gravity unless a scene says otherwise [m/s^2].
pub const GRAVITY: [f64; 3] = [0.0, -9.81, 0.0];

impl Scene {
    /// A garment alone in the world.
    pub fn new(garment: Garment) -> Self {
        Self {
            name: garment.name.clone(),
            garment,
            bodies: Vec::new(),
            gravity: GRAVITY,
            wind: [0.0; 3],
            pressure: 0.0,
            pins: Vec::new(),
            probes: Vec::new(),
            settings: Settings::default(),
            threads_given: false,
            initial: Initial::default(),
            run: RunPlan::default(),
            notes: Vec::new(),
        }
    }

    /// Sets a number by dotted name: a tunable, `gravity.x`, `wind.x`, `pressure`, `edge_length`,
    /// `run.duration`, `run.dt`.
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<()> {
        if !value.is_finite() {
            return Err(Error::argument(format!("{name} = {value} must be finite")));
        }
        let axis = |rest: &str| match rest {
            "x" => Some(0),
            "y" => Some(1),
            "z" => Some(2),
            _ => None,
        };
        if let Some(k) = name.strip_prefix("gravity.").and_then(axis) {
            self.gravity[k] = value;
        } else if let Some(k) = name.strip_prefix("wind.").and_then(axis) {
            self.wind[k] = value;
        } else if name == "pressure" {
            self.pressure = value;
        } else if name == "edge_length" {
            self.set_edge_length(value)?;
        } else if name == "run.duration" || name == "run.dt" {
            let mut run = self.run;
            if name == "run.dt" {
                run.dt = value;
            } else {
                run.duration = value;
            }
            run.check()?;
            self.run = run;
        } else {
            self.settings.set(name, value)?;
            self.threads_given |= name == THREADS;
        }
        Ok(())
    }

    /// Target edge length of every panel [m].
    pub fn set_edge_length(&mut self, length: f64) -> Result<()> {
        if !(length.is_finite() && length > 0.0) {
            return Err(Error::argument(format!(
                "edge_length: {length} must be finite and positive"
            )));
        }
        self.garment.edge_length = length;
        for panel in &mut self.garment.panels {
            panel.edge_length = None;
        }
        Ok(())
    }

    /// Number of a panel by name.
    pub fn panel_index(&self, name: &str) -> Option<u32> {
        self.garment
            .panels
            .iter()
            .position(|p| p.name == name)
            .and_then(|i| u32::try_from(i).ok())
    }
}
