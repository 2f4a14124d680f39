//! From a scene to a simulation, and the scene's bodies and pins through time.
//!
//! [`build`] compiles the garment, places bodies and pins and puts the initial state in. A
//! [`Driver`] then tells the simulation, before each step, where bodies and pins are at its end.
//! [`pinned_vertices`] and [`along`] find the vertices that pins and probes of a scene mean.

use crate::body::Pose;
use crate::error::{Error, Result};
use crate::scene::{PinPlace, Scene, motion};
use crate::sim::{Sim, SimOptions};
use std::path::Path;

/// Reads a scene and builds its simulation.
pub fn sim_from_json(text: &str, base_dir: Option<&Path>) -> Result<(Sim, Scene)> {
    let scene = Scene::from_json(text, base_dir)?;
    let sim = build(&scene)?;
    Ok((sim, scene))
}

/// The simulation of a scene at its initial state, nothing run yet.
pub fn build(scene: &Scene) -> Result<Sim> {
    let mut sim = Sim::new(
        &scene.garment,
        &SimOptions {
            gravity: Some(scene.gravity),
            wind: scene.wind,
            pressure: scene.pressure,
            settings: scene.settings.clone(),
        },
    )?;
    for (i, body) in scene.bodies.iter().enumerate() {
        let place = |e: Error| e.at(format!("bodies[{i}]"));
        let index = sim.add_body(&body.body, &body.contact).map_err(place)?;
        set_pose(&mut sim, index, &body.motion.pose(0.0)).map_err(place)?;
        if let Some(vertices) = body.motion.vertices(0.0) {
            sim.set_body_vertices(index, &vertices).map_err(place)?;
        }
    }
    let place = |e: Error| e.at("initial");
    if let Some(bytes) = &scene.initial.snapshot {
        // pins belong to the saved state
        sim.restore(bytes).map_err(place)?;
        return Ok(sim);
    }
    let count = sim.positions().len();
    let given = scene.initial.positions.clone();
    if given.is_some() || scene.initial.velocity.iter().any(|&v| v.abs() > 0.0) {
        let x = given.unwrap_or_else(|| sim.positions().iter().map(|p| (*p).into()).collect());
        if x.len() != count {
            return Err(place(Error::argument(format!(
                "{} positions for {count} vertices",
                x.len()
            ))));
        }
        let v = vec![scene.initial.velocity; count];
        sim.set_positions(&x, Some(&v)).map_err(place)?;
    }
    let pins = pinned_vertices(&sim, scene)?;
    for (i, (pin, vertices)) in scene.pins.iter().zip(&pins).enumerate() {
        let start = motion::offset(&pin.motion, 0.0);
        let targets: Vec<[f64; 3]> = vertices
            .iter()
            .map(|&v| {
                let home = sim.positions()[v as usize].into();
                add(pin.target.unwrap_or(home), start.into())
            })
            .collect();
        sim.pin(vertices, Some(&targets))
            .map_err(|e| e.at(format!("pins[{i}]")))?;
    }
    Ok(sim)
}

fn set_pose(sim: &mut Sim, body: u32, pose: &Pose) -> Result<()> {
    let q = pose.rotation.quaternion();
    sim.set_body_pose(body, pose.position.into(), [q.i, q.j, q.k, q.w])
}

fn add(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [0, 1, 2].map(|k| a[k] + b[k])
}

/// Vertices of each pin of the scene.
pub fn pinned_vertices(sim: &Sim, scene: &Scene) -> Result<Vec<Vec<u32>>> {
    scene
        .pins
        .iter()
        .enumerate()
        .map(|(i, pin)| place(sim, pin.panel, pin.place).map_err(|e| e.at(format!("pins[{i}]"))))
        .collect()
}

/// Vertices at a place of a panel: one, or those of an edge in rising order without repetition.
fn place(sim: &Sim, panel: u32, place: PinPlace) -> Result<Vec<u32>> {
    match place {
        PinPlace::Point(uv) => sim.locate(panel, uv).map(|v| vec![v]),
        PinPlace::Edge(edge) => {
            // a closed edge starts and ends at one vertex
            let mut vertices = along(sim, panel, edge)?.to_vec();
            vertices.sort_unstable();
            vertices.dedup();
            Ok(vertices)
        }
    }
}

/// Vertices along an edge of a panel, from its start to its end.
pub fn along(sim: &Sim, panel: u32, edge: u32) -> Result<&[u32]> {
    sim.mesh()
        .edge_vertices
        .get(panel as usize)
        .and_then(|edges| edges.get(edge as usize))
        .map(Vec::as_slice)
        .ok_or_else(|| Error::argument(format!("panel {panel} has no edge {edge}")))
}

/// Moves bodies and pins of a scene.
#[derive(Clone, Debug)]
pub struct Driver {
    /// Vertices of each pin, and where each is without motion [m].
    pins: Vec<Vec<(u32, [f64; 3])>>,
    held: Vec<bool>,
}

impl Driver {
    /// Takes the pins' places from a simulation as [`build`] gives it: call this before anything
    /// runs.
    pub fn new(sim: &Sim, scene: &Scene) -> Result<Self> {
        let pins = pinned_vertices(sim, scene)?;
        // a restored pin may have moved: its place is where the panel is placed
        let placed = &sim.mesh().placed;
        let restored = scene.initial.snapshot.is_some();
        let home = |v: u32| {
            let v = v as usize;
            if restored {
                placed[v]
            } else {
                sim.positions()[v]
            }
            .into()
        };
        Ok(Self {
            pins: scene
                .pins
                .iter()
                .zip(pins)
                .map(|(pin, vertices)| {
                    let place = |v| pin.target.unwrap_or_else(|| home(v));
                    vertices.into_iter().map(|v| (v, place(v))).collect()
                })
                .collect(),
            held: scene
                .pins
                .iter()
                .map(|pin| pin.until.is_none_or(|until| sim.time() <= until))
                .collect(),
        })
    }

    /// Says where everything is at `time` [s], the end of the next step.
    pub fn set(&mut self, sim: &mut Sim, scene: &Scene, time: f64) -> Result<()> {
        // the bodies stand at their start: from here on they go, the first step included
        sim.end_placement();
        for (i, body) in scene.bodies.iter().enumerate() {
            let index = u32::try_from(i).map_err(|_| Error::limit("too many bodies"))?;
            if body.motion.keys.len() > 1 {
                set_pose(sim, index, &body.motion.pose(time))
                    .map_err(|e| e.at(format!("bodies[{i}]")))?;
            }
            if body.motion.frames.len() > 1
                && let Some(vertices) = body.motion.vertices(time)
            {
                sim.set_body_vertices(index, &vertices)
                    .map_err(|e| e.at(format!("bodies[{i}]")))?;
            }
        }
        for (i, pin) in scene.pins.iter().enumerate() {
            if !self.held[i] {
                continue;
            }
            let place = |e: Error| e.at(format!("pins[{i}]"));
            if pin.until.is_some_and(|until| time > until) {
                self.held[i] = false;
                // a corner may belong to another pin that still holds
                let free: Vec<u32> = self.pins[i]
                    .iter()
                    .map(|p| p.0)
                    .filter(|&v| !self.holds(v))
                    .collect();
                if !free.is_empty() {
                    sim.unpin(&free).map_err(place)?;
                }
            } else if pin.motion.len() > 1 {
                let vertices: Vec<u32> = self.pins[i].iter().map(|p| p.0).collect();
                let offset = motion::offset(&pin.motion, time).into();
                let targets: Vec<[f64; 3]> =
                    self.pins[i].iter().map(|p| add(p.1, offset)).collect();
                sim.pin(&vertices, Some(&targets)).map_err(place)?;
            }
        }
        Ok(())
    }

    /// Whether a pin that is still on holds a vertex.
    fn holds(&self, vertex: u32) -> bool {
        self.pins
            .iter()
            .zip(&self.held)
            .any(|(pin, &held)| held && pin.iter().any(|p| p.0 == vertex))
    }
}
