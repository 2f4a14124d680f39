//! The bodies of a world over one substep: where they are at its start and at its end.

use super::state::{BodyState, State};
use super::term::{Bodies, ContactSettings};
use crate::body::{Body, Distance, Pose};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// A body in the world, with what the next substep does to it.
#[derive(Clone, Debug)]
struct Entry {
    original: Body,
    contact: ContactSettings,
    start: Body,
    end: Body,
    start_vertices: Vec<Vec3>,
    end_vertices: Vec<Vec3>,
    from: Pose,
    to: Pose,
}

/// All bodies; a cache of what the State says of them.
#[derive(Clone, Debug, Default)]
pub struct BodySet {
    entries: Vec<Entry>,
}

impl BodySet {
    /// Adds a body at the identity pose and returns its state.
    pub fn add(&mut self, body: &Body, contact: &ContactSettings) -> BodyState {
        self.entries.push(Entry {
            original: body.clone(),
            contact: *contact,
            start: body.clone(),
            end: body.clone(),
            start_vertices: Vec::new(),
            end_vertices: Vec::new(),
            from: Pose::default(),
            to: Pose::default(),
        });
        BodyState {
            pose: Pose::default(),
            target: Pose::default(),
            vertices: Vec::new(),
            target_vertices: Vec::new(),
            moved_with_time: false,
        }
    }

    /// The body as created.
    pub fn original(&self, body: usize) -> Option<&Body> {
        self.entries.get(body).map(|e| &e.original)
    }

    /// The body as deformed at the end of the last prepared substep.
    pub fn deformed(&self, body: usize) -> Option<&Body> {
        self.entries.get(body).map(|e| &e.end)
    }

    /// The same bodies with the friction of each multiplied by `factor`.
    #[must_use]
    pub fn with_friction(&self, factor: f64) -> Self {
        let mut set = self.clone();
        for entry in &mut set.entries {
            entry.contact.friction *= factor;
        }
        set
    }

    /// Prepares the substep that covers `fraction` of what is left of the host's step.
    pub fn prepare(&mut self, state: &State, fraction: f64) -> Result<()> {
        for (b, (entry, body)) in self.entries.iter_mut().zip(&state.bodies).enumerate() {
            entry.from = body.pose;
            entry.to = body.pose.toward(&body.target, fraction);
            if entry.start_vertices != body.vertices {
                entry.start = shaped(&entry.original, &body.vertices)
                    .map_err(|e| e.at(format!("body {b}")))?;
                entry.start_vertices.clone_from(&body.vertices);
            }
            let end = between(
                &entry.original,
                &body.vertices,
                &body.target_vertices,
                fraction,
            );
            if entry.end_vertices != end {
                entry.end = if end == entry.start_vertices {
                    entry.start.clone()
                } else {
                    shaped(&entry.original, &end).map_err(|e| e.at(format!("body {b}")))?
                };
                entry.end_vertices = end;
            }
        }
        Ok(())
    }

    /// Writes the end of the prepared substep into the state.
    pub fn accept(&mut self, state: &mut State) {
        for (entry, body) in self.entries.iter_mut().zip(&mut state.bodies) {
            body.pose = entry.to;
            if entry.start_vertices != entry.end_vertices {
                entry.start = entry.end.clone();
                entry.start_vertices.clone_from(&entry.end_vertices);
                body.vertices.clone_from(&entry.end_vertices);
            }
            if body.vertices == body.target_vertices {
                body.target_vertices.clear();
            }
        }
    }

    /// Length of the path of a point over the substep, seen from the body; infinite for a body that
    /// changes its shape.
    pub fn travel(&self, body: usize, x0: &Vec3, x: &Vec3) -> f64 {
        let entry = &self.entries[body];
        if entry.start_vertices == entry.end_vertices {
            (entry.to.to_body(x) - entry.from.to_body(x0)).norm()
        } else {
            f64::INFINITY
        }
    }

    /// Signed distance at the start of the substep.
    pub fn value_at_start(&self, body: usize, point: &Vec3) -> f64 {
        let entry = &self.entries[body];
        entry.start.value(&entry.from.to_body(point))
    }

    /// Whether the straight path of a point over the substep, seen from the body, comes deeper
    /// than `depth` below the surface although its end does not: the point would have passed
    /// through a thin part of the body.
    pub fn passes_through(&self, body: usize, x0: &Vec3, x: &Vec3, depth: f64) -> bool {
        let entry = &self.entries[body];
        let (p, q) = (entry.from.to_body(x0), entry.to.to_body(x));
        let length = (q - p).norm();
        let end = entry.end.value(&q);
        let mut s = 0.0;
        // the field is 1-Lipschitz: from a point at distance d the next |d| of the path is clear
        while s < length {
            let d = entry.end.value(&p.lerp(&q, s / length));
            if d < -depth && end > d + depth {
                return true;
            }
            // however long the path, it is marched in a bounded number of strides
            s += d.abs().max(0.5 * depth).max(1e-5).max(1e-4 * length);
        }
        false
    }
}

impl Bodies for BodySet {
    fn count(&self) -> usize {
        self.entries.len()
    }

    fn distance(&self, body: usize, point: &Vec3) -> Distance {
        let entry = &self.entries[body];
        let d = entry.end.distance(&entry.to.to_body(point));
        let r = entry.to.rotation.to_rotation_matrix();
        Distance {
            value: d.value,
            gradient: r * d.gradient,
            hessian: r.matrix() * d.hessian * r.matrix().transpose(),
        }
    }

    fn value(&self, body: usize, point: &Vec3) -> f64 {
        let entry = &self.entries[body];
        entry.end.value(&entry.to.to_body(point))
    }

    fn carried(&self, body: usize, point: &Vec3) -> Vec3 {
        let entry = &self.entries[body];
        let mut local = entry.from.to_body(point);
        if entry.start_vertices != entry.end_vertices
            && let Some((triangle, w)) = entry.start.nearest(&local)
        {
            let corners = entry.start.triangles()[triangle as usize].map(|v| v as usize);
            let (a, b) = (entry.start.vertices(), entry.end.vertices());
            for (k, &v) in corners.iter().enumerate() {
                local += w[k] * (b[v] - a[v]);
            }
        }
        entry.to.to_world(&local)
    }

    fn contact(&self, body: usize) -> &ContactSettings {
        &self.entries[body].contact
    }
}

fn shaped(original: &Body, vertices: &[Vec3]) -> Result<Body> {
    if vertices.is_empty() {
        Ok(original.clone())
    } else {
        original.deformed(vertices)
    }
}

/// Vertices a fraction of the way from the present to the target; empty means "as created".
fn between(original: &Body, now: &[Vec3], target: &[Vec3], fraction: f64) -> Vec<Vec3> {
    if target.is_empty() {
        return now.to_vec();
    }
    if fraction >= 1.0 {
        return target.to_vec();
    }
    let now = if now.is_empty() {
        original.vertices()
    } else {
        now
    };
    now.iter()
        .zip(target)
        .map(|(a, b)| a.lerp(b, fraction))
        .collect()
}

/// Refuses a body number that does not exist.
pub fn check_index(body: u32, count: usize) -> Result<usize> {
    let index = body as usize;
    if index < count {
        Ok(index)
    } else {
        Err(Error::argument(format!(
            "body {body} does not exist; there are {count}"
        )))
    }
}
