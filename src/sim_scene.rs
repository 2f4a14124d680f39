//! From a scene to a simulation, and the scene's bodies and pins through time.
//!
//! [`build`] compiles the garment, places bodies and pins and puts the initial state in. A
//! [`Driver`] then tells the simulation, before each step, where bodies and pins are at its end.
//! [`pinned_points`] and [`along`] find the points that pins and probes of a scene mean.

use crate::body::Pose;
use crate::error::{Error, Result};
use crate::scene::{PinPlace, Scene, motion};
use crate::sim::{Sim, SimOptions, StepReport};
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
    let pins = pinned_points(&sim, scene)?;
    for (i, (pin, points)) in scene.pins.iter().zip(&pins).enumerate() {
        let start = motion::offset(&pin.motion, 0.0);
        let targets: Vec<[f64; 3]> = points
            .iter()
            .map(|&p| {
                let home = sim.points()[p as usize].into();
                add(pin.target.unwrap_or(home), start.into())
            })
            .collect();
        sim.pin_points(points, Some(&targets))
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

/// Points of each pin of the scene: vertices, nodes where the panel is simulated as yarns.
pub fn pinned_points(sim: &Sim, scene: &Scene) -> Result<Vec<Vec<u32>>> {
    scene
        .pins
        .iter()
        .enumerate()
        .map(|(i, pin)| place(sim, pin.panel, pin.place).map_err(|e| e.at(format!("pins[{i}]"))))
        .collect()
}

/// Points at a place of a panel: one, or those of an edge or of a yarn in rising order without repetition.
fn place(sim: &Sim, panel: u32, place: PinPlace) -> Result<Vec<u32>> {
    if let (PinPlace::Yarn { yarn, .. }, None) = (place, sim.yarns()) {
        return Err(Error::argument(format!(
            "yarn {yarn} is held, and no yarns are simulated: triangles alone have none to hold or to pull"
        )));
    }
    let nodes = match place {
        PinPlace::Point(uv) => {
            let vertex = sim.locate(panel, uv)?;
            if sim.moves_by_itself(vertex) {
                return Ok(vec![vertex]);
            }
            vec![sim.locate_yarn_node(panel, uv)?]
        }
        PinPlace::Edge(edge) => {
            // a closed edge starts and ends at one vertex
            let vertices = along(sim, panel, edge)?.iter().copied();
            let nodes = sim.yarn_nodes_along(panel, edge)?.into_iter();
            let all = vertices.chain(nodes.map(|n| sim.point_of_node(n)));
            let held = sorted(all.filter(|p| sim.moves_by_itself(*p)).collect());
            if held.is_empty() {
                return Err(Error::argument(format!(
                    "edge {edge} of panel {panel} holds nothing: no vertex and no yarn node along it moves by itself"
                )));
            }
            return Ok(held);
        }
        PinPlace::Yarn { yarn, end: None } => sim.yarn(yarn)?,
        PinPlace::Yarn {
            yarn,
            end: Some(end),
        } => vec![sim.yarn_end(yarn, end)?],
    };
    Ok(sorted(
        nodes.into_iter().map(|n| sim.point_of_node(n)).collect(),
    ))
}

fn sorted(mut points: Vec<u32>) -> Vec<u32> {
    points.sort_unstable();
    points.dedup();
    points
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
    /// Points of each pin, and where each is without motion [m].
    pins: Vec<Vec<(u32, [f64; 3])>>,
    held: Vec<bool>,
}

impl Driver {
    /// Takes the pins' places from a simulation as [`build`] gives it: call this before anything
    /// runs.
    pub fn new(sim: &Sim, scene: &Scene) -> Result<Self> {
        let pins = pinned_points(sim, scene)?;
        // a restored pin may have moved: its place is where the panel is placed
        let restored = scene.initial.snapshot.is_some();
        let home = |p: u32| {
            if restored {
                sim.placed(p)
            } else {
                sim.points()[p as usize]
            }
            .into()
        };
        Ok(Self {
            pins: scene
                .pins
                .iter()
                .zip(pins)
                .map(|(pin, points)| {
                    let place = |p| pin.target.unwrap_or_else(|| home(p));
                    points.into_iter().map(|p| (p, place(p))).collect()
                })
                .collect(),
            held: scene
                .pins
                .iter()
                .map(|pin| pin.until.is_none_or(|until| sim.time() <= until))
                .collect(),
        })
    }

    /// Takes step `step`, from 1, of the scene's run, which began when the simulation was at `origin` [s].
    pub fn step(
        &mut self,
        sim: &mut Sim,
        scene: &Scene,
        origin: f64,
        step: u64,
    ) -> Result<StepReport> {
        let (time, steps) = (scene.run.time_after(step), scene.run.steps());
        self.set(sim, scene, origin + time)?;
        // a last step of what is left of the duration
        let whole = step < steps || time == step as f64 * scene.run.dt;
        let dt = if whole {
            scene.run.dt
        } else {
            time - scene.run.time_after(step - 1)
        };
        sim.step(dt)
            .map_err(|e| e.at(format!("step {step} of {steps}")))
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
                    sim.unpin_points(&free).map_err(place)?;
                }
            } else if pin.motion.len() > 1 {
                let points: Vec<u32> = self.pins[i].iter().map(|p| p.0).collect();
                let offset = motion::offset(&pin.motion, time).into();
                let targets: Vec<[f64; 3]> =
                    self.pins[i].iter().map(|p| add(p.1, offset)).collect();
                sim.pin_points(&points, Some(&targets)).map_err(place)?;
            }
        }
        Ok(())
    }

    /// Whether a pin that is still on holds a point.
    fn holds(&self, point: u32) -> bool {
        self.pins
            .iter()
            .zip(&self.held)
            .any(|(pin, &held)| held && pin.iter().any(|p| p.0 == point))
    }
}
