//! From the values of inputs to bodies, pins, air and tunables of the simulation.

use super::model::Model;
use super::variables::{Quantity, Values};
use crate::error::{Error, Result};
use crate::math::{Rotation, Vec3};
use crate::scene::motion;
use crate::sim::Sim;
use crate::solve::settings::Settings;

/// What the inputs say of one body.
#[derive(Clone, Copy, Debug, Default)]
struct BodyInput<'a> {
    driven: bool,
    /// Vertices of a deforming mesh that follows the inputs, row by row.
    vertices: Option<&'a [f64]>,
    position: [f64; 3],
    quaternion: [f64; 4],
    velocity: [f64; 3],
    angular_velocity: [f64; 3],
}

impl BodyInput<'_> {
    /// Position and quaternion of the body a time `h` [s] after it was at the inputs' pose. Without
    /// turning the quaternion is handed on as it came, so that other hosts get the same bits.
    fn pose(&self, body: usize, h: f64) -> Result<([f64; 3], [f64; 4])> {
        let position = [0, 1, 2].map(|k| self.position[k] + h * self.velocity[k]);
        let axis = h * Vec3::from(self.angular_velocity);
        if axis == Vec3::zeros() {
            return Ok((position, self.quaternion));
        }
        let [x, y, z, w] = self.quaternion;
        let q = nalgebra::Quaternion::new(w, x, y, z);
        let rotation = Rotation::try_new(q, 1e-12).ok_or_else(|| {
            Error::argument(format!(
                "body {body}: quaternion {:?} has no length",
                self.quaternion
            ))
        })?;
        let turned = Rotation::from_scaled_axis(axis) * rotation;
        Ok((position, xyzw(&turned)))
    }
}

/// What the inputs say of one pin.
#[derive(Clone, Copy, Debug)]
struct PinInput {
    held: bool,
    displacement: [f64; 3],
}

/// Inputs by body and pin.
struct Inputs<'a> {
    bodies: Vec<BodyInput<'a>>,
    pins: Vec<PinInput>,
}

fn inputs<'a>(model: &Model, values: &'a Values) -> Inputs<'a> {
    let mut bodies = vec![BodyInput::default(); model.scene.bodies.len()];
    let pin = PinInput {
        held: true,
        displacement: [0.0; 3],
    };
    let mut pins = vec![pin; model.scene.pins.len()];
    let mut meshes = vec![false; bodies.len()];
    for (reference, variable) in (0..).zip(&model.variables) {
        let value = values.scalars[reference as usize];
        match variable.quantity {
            Quantity::MeshDriven(b) => meshes[b] = value > 0.5,
            Quantity::MeshVertices(b) => {
                bodies[b].vertices = meshes[b].then_some(values.of(reference));
            }
            Quantity::Driven(b) => bodies[b].driven = value > 0.5,
            Quantity::BodyPosition(b, k) => bodies[b].position[k] = value,
            Quantity::BodyQuaternion(b, k) => bodies[b].quaternion[k] = value,
            Quantity::BodyVelocity(b, k) => bodies[b].velocity[k] = value,
            Quantity::BodyAngularVelocity(b, k) => bodies[b].angular_velocity[k] = value,
            Quantity::PinHeld(p) => pins[p].held = value > 0.5,
            Quantity::PinDisplacement(p, k) => pins[p].displacement[k] = value,
            _ => {}
        }
    }
    Inputs { bodies, pins }
}

fn xyzw(rotation: &Rotation) -> [f64; 4] {
    let q = rotation.quaternion();
    [q.i, q.j, q.k, q.w]
}

/// Gravity, wind and pressure.
pub(super) fn world(model: &Model, values: &[f64], sim: &mut Sim) -> Result<()> {
    const AXES: [&str; 3] = ["x", "y", "z"];
    for (variable, &value) in model.variables.iter().zip(values) {
        match variable.quantity {
            Quantity::Gravity(k) => sim.set_number(&format!("gravity.{}", AXES[k]), value)?,
            Quantity::Wind(k) => sim.set_number(&format!("wind.{}", AXES[k]), value)?,
            Quantity::Pressure => sim.set_number("pressure", value)?,
            _ => {}
        }
    }
    Ok(())
}

/// Tunables. Only what changed is set, as a tunable may rebuild terms.
pub(super) fn settings(model: &Model, values: &[f64], sim: &mut Sim) -> Result<()> {
    for (variable, &value) in model.variables.iter().zip(values) {
        if let Quantity::Setting(s) = variable.quantity {
            let name = Settings::KEYS[s].name;
            if sim.number(name)?.to_bits() != value.to_bits() {
                sim.set_number(name, value)?;
            }
        }
    }
    Ok(())
}

/// Puts bodies and pins where a run begins.
pub(super) fn place(model: &Model, values: &Values, sim: &mut Sim) -> Result<()> {
    let inputs = inputs(model, values);
    for (b, input) in inputs.bodies.iter().enumerate() {
        if input.driven {
            let (position, quaternion) = input.pose(b, 0.0)?;
            sim.place_body(b as u32, position, quaternion)?;
        }
        if let Some(vertices) = input.vertices {
            sim.place_body_vertices(b as u32, vertices.as_chunks().0)?;
        }
    }
    let time = sim.time();
    set_pins(model, &inputs, sim, time)
}

/// Says where bodies and pins are at the end of a step of `h` [s].
pub(super) fn step(model: &Model, values: &Values, sim: &mut Sim, h: f64) -> Result<()> {
    let inputs = inputs(model, values);
    let time = sim.time() + h;
    for (b, (input, body)) in inputs.bodies.iter().zip(&model.scene.bodies).enumerate() {
        let index = b as u32;
        if input.driven {
            let (position, quaternion) = input.pose(b, h)?;
            sim.set_body_pose(index, position, quaternion)?;
        } else if body.motion.keys.len() > 1 {
            let pose = body.motion.pose(time);
            sim.set_body_pose(index, pose.position.into(), xyzw(&pose.rotation))?;
        }
        if let Some(vertices) = input.vertices {
            sim.set_body_vertices(index, vertices.as_chunks().0)?;
        } else if body.motion.frames.len() > 1
            && let Some(vertices) = body.motion.vertices(time)
        {
            sim.set_body_vertices(index, &vertices)?;
        }
    }
    set_pins(model, &inputs, sim, time)
}

/// Targets of the pins that hold at `time` [s]; the others let go.
fn set_pins(model: &Model, inputs: &Inputs<'_>, sim: &mut Sim, time: f64) -> Result<()> {
    let holds = |p: usize| {
        let until = model.scene.pins[p].until;
        inputs.pins[p].held && until.is_none_or(|until| time <= until)
    };
    // a corner may belong to another pin that still holds
    let mut free: Vec<u32> = Vec::new();
    for (p, vertices) in model.pins.iter().enumerate() {
        if !holds(p) {
            free.extend(vertices.iter().map(|v| v.0));
        }
    }
    for (p, vertices) in model.pins.iter().enumerate() {
        if !holds(p) {
            continue;
        }
        let offset = motion::offset(&model.scene.pins[p].motion, time)
            + Vec3::from(inputs.pins[p].displacement);
        let indices: Vec<u32> = vertices.iter().map(|v| v.0).collect();
        let targets: Vec<[f64; 3]> = vertices
            .iter()
            .map(|v| (Vec3::from(v.1) + offset).into())
            .collect();
        sim.pin_points(&indices, Some(&targets))
            .map_err(|e| e.at(format!("pin[{}]", p + 1)))?;
        free.retain(|v| !indices.contains(v));
    }
    free.sort_unstable();
    free.dedup();
    free.retain(|v| sim.is_pinned(*v));
    if free.is_empty() {
        return Ok(());
    }
    sim.unpin_points(&free)
}
