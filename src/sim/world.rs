//! The world around the cloth: bodies and their motion, positions, numbers.

use super::{
    ContactSettings, MAX_COMPONENT, MAX_PRESSURE, Settings, Sim, finite, finite_points, within,
};
use crate::body::{Body, Pose};
use crate::error::{Error, Result};
use crate::math::{Rotation, Vec3};
use crate::system::bodies::check_index;
use crate::system::snapshot::BodyOrigin;
use crate::system::state::State;
use std::sync::PoisonError;

impl Sim {
    /// Puts a body into the world at the identity pose; returns its number.
    pub fn add_body(&mut self, body: &Body, contact: &ContactSettings) -> Result<u32> {
        contact.check()?;
        let entry = self.engine().system.bodies.add(body, contact);
        self.state.bodies.push(entry);
        self.origin.bodies.push(BodyOrigin {
            shape: body.fingerprint(),
            contact: *contact,
        });
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

    /// Where the body is to be at the end of the next step; the cloth feels the velocity that
    /// follows. Before the first step or drape it is a placement: the body stands there at once and
    /// has no velocity. A drape takes the body to its pose as it begins, and what lies on it along.
    pub fn set_body_pose(&mut self, body: u32, position: [f64; 3], xyzw: [f64; 4]) -> Result<()> {
        let b = check_index(body, self.bodies.len())?;
        within("position", &position, MAX_COMPONENT)?;
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

    /// Puts a body at a pose at once and without velocity, whether time has passed or not: for hosts
    /// that choose where a run begins.
    pub fn place_body(&mut self, body: u32, position: [f64; 3], xyzw: [f64; 4]) -> Result<()> {
        self.set_body_pose(body, position, xyzw)?;
        let state = &mut self.state.bodies[body as usize];
        state.pose = state.target;
        Ok(())
    }

    /// Vertices of a deforming mesh body at the end of the next step, body frame [m]; like a pose, a
    /// placement before the first step or drape.
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
            let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
            let deformed = self.bodies[b]
                .0
                .deformed_with(&vertices, engine.workers())?;
            engine.system.bodies.place(b, deformed, &vertices);
            drop(engine);
            state.vertices.clone_from(&vertices);
            state.target_vertices.clear();
        } else {
            state.target_vertices = vertices;
        }
        self.epoch += 1;
        Ok(())
    }

    /// Puts the vertices of a deforming mesh somewhere at once, as `place_body` does with a pose.
    pub fn place_body_vertices(&mut self, body: u32, positions: &[[f64; 3]]) -> Result<()> {
        let b = check_index(body, self.bodies.len())?;
        let moved = std::mem::replace(&mut self.state.bodies[b].moved_with_time, false);
        let placed = self.set_body_vertices(body, positions);
        self.state.bodies[b].moved_with_time = moved;
        placed
    }

    /// From here on a pose is a motion, even before the first step.
    pub fn end_placement(&mut self) {
        for body in &mut self.state.bodies {
            body.moved_with_time = true;
        }
    }

    /// Force and torque of the cloth on a body, about the body's origin, world axes [N], [N m].
    pub fn body_wrench(&self, body: u32) -> Result<([f64; 3], [f64; 3])> {
        let b = check_index(body, self.bodies.len())?;
        let (force, torque) = self.engine().body_wrench(&self.state, b)?;
        Ok((force.into(), torque.into()))
    }

    /// Sets positions [m] and velocities [m/s] of every vertex (`None`: zero); nodes of yarns go where
    /// the vertices of their triangles are. Friction anchors are forgotten; pins keep their targets.
    pub fn set_positions(&mut self, x: &[[f64; 3]], v: Option<&[[f64; 3]]>) -> Result<()> {
        let n = self.mesh.uv.len();
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
        let mut state = State {
            positions: x,
            velocities: v,
            ..self.state.clone()
        };
        if let Some(part) = &self.yarns {
            part.take(&self.mesh, &mut state)?;
        }
        self.state = state;
        self.state.body_anchors.clear();
        self.state.pair_anchors.clear();
        self.state.step_size = f64::MAX;
        self.epoch += 1;
        Ok(())
    }

    /// Sets the acceleration of gravity [m/s^2].
    pub fn set_gravity(&mut self, gravity: [f64; 3]) -> Result<()> {
        within("gravity", &gravity, MAX_COMPONENT)?;
        self.state.gravity = Vec3::from(gravity);
        self.epoch += 1;
        Ok(())
    }

    /// Sets the velocity of the air [m/s].
    pub fn set_wind(&mut self, wind: [f64; 3]) -> Result<()> {
        within("wind", &wind, MAX_COMPONENT)?;
        self.state.wind = Vec3::from(wind);
        self.epoch += 1;
        Ok(())
    }

    /// Sets a tunable, gravity (`gravity.x`), wind (`wind.x`) or `pressure` by dotted name.
    pub fn set_number(&mut self, name: &str, value: f64) -> Result<()> {
        finite(name, &[value])?;
        if let Some((slot, most)) = world_number(&mut self.state, name) {
            within(name, &[value], most)?;
            *slot = value;
        } else {
            let mut settings = self.settings.clone();
            settings.set(name, value)?;
            let made = |s: &Settings| [s.blend_means, s.blend_enrich].map(f64::to_bits);
            if self.yarns.is_some() && made(&settings) != made(&self.settings) {
                return Err(Error::state(format!(
                    "{name} is taken when yarns come in, and there are some already"
                )));
            }
            self.engine().set_settings(&settings)?;
            self.origin.numbers = settings.that_matter();
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
}

/// A number of the world by name, and how large it may be.
fn world_number<'a>(state: &'a mut State, name: &str) -> Option<(&'a mut f64, f64)> {
    let slot = match name {
        "gravity.x" => &mut state.gravity.x,
        "gravity.y" => &mut state.gravity.y,
        "gravity.z" => &mut state.gravity.z,
        "wind.x" => &mut state.wind.x,
        "wind.y" => &mut state.wind.y,
        "wind.z" => &mut state.wind.z,
        "pressure" => return Some((&mut state.pressure, MAX_PRESSURE)),
        _ => return None,
    };
    Some((slot, MAX_COMPONENT))
}
