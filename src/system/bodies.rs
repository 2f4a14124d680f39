//! The bodies of a world over one substep: where they are at its start and at its end.

use super::state::{BodyState, State};
use super::term::{Bodies, ContactSettings};
use crate::body::{Body, Distance, Pose};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::parallel::Workers;

/// Bound of a distance field's slope. Exact distances have 1; the spline through their samples
/// overshoots where they have a kink, to 2 between the fingers of a hand sampled too coarsely.
pub const SLOPE: f64 = 3.0;
/// Part of the depth that a path may dip below it unseen.
const BLUR: f64 = 0.05;
/// Most evaluations along one path.
const MAX_STRIDES: usize = 4096;

/// A body in the world, with what the next substep does to it.
#[derive(Clone, Debug)]
struct Entry {
    original: Body,
    contact: ContactSettings,
    /// Depth below the body's surface at which the surface is taken to be [m].
    inset: f64,
    start: Body,
    end: Body,
    start_vertices: Vec<Vec3>,
    end_vertices: Vec<Vec3>,
    /// Largest way of a vertex over the substep, in the body's frame [m].
    way: f64,
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
            inset: 0.0,
            start: body.clone(),
            end: body.clone(),
            start_vertices: Vec::new(),
            end_vertices: Vec::new(),
            way: 0.0,
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

    /// Puts a deformed body at `vertices` in, for a state that has them: made once, not again by
    /// [`BodySet::prepare`].
    pub fn place(&mut self, body: usize, deformed: Body, vertices: &[Vec3]) {
        let entry = &mut self.entries[body];
        entry.end = deformed.clone();
        entry.start = deformed;
        entry.start_vertices = vertices.to_vec();
        entry.end_vertices = vertices.to_vec();
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

    /// The same bodies without what lies less than `inset` below their surface [m].
    #[must_use]
    pub fn shrunk(&self, inset: f64) -> Self {
        let mut set = self.clone();
        for entry in &mut set.entries {
            entry.inset = inset;
        }
        set
    }

    /// Prepares the substep that covers `fraction` of what is left of the host's step.
    pub fn prepare(&mut self, state: &State, fraction: f64, workers: &Workers) -> Result<()> {
        for (b, (entry, body)) in self.entries.iter_mut().zip(&state.bodies).enumerate() {
            entry.from = body.pose;
            entry.to = body.pose.toward(&body.target, fraction);
            if entry.start_vertices != body.vertices {
                entry.start = shaped(&entry.original, &body.vertices, workers)
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
                    shaped(&entry.original, &end, workers).map_err(|e| e.at(format!("body {b}")))?
                };
                entry.end_vertices = end;
            }
            entry.way = if entry.start_vertices == entry.end_vertices {
                0.0
            } else {
                let ways = entry.start.vertices().iter().zip(entry.end.vertices());
                ways.map(|(a, b)| (b - a).norm()).fold(0.0, f64::max)
            };
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
                entry.way = 0.0;
                body.vertices.clone_from(&entry.end_vertices);
            }
            if body.vertices == body.target_vertices {
                body.target_vertices.clear();
            }
        }
    }

    /// Whether a body moves or changes its shape over the substep.
    pub fn is_moving(&self, body: usize) -> bool {
        let entry = &self.entries[body];
        entry.from != entry.to || entry.start_vertices != entry.end_vertices
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
        entry.start.value(&entry.from.to_body(point)) + entry.inset
    }

    /// Whether the straight path of a point over the substep, seen from the body that moves and
    /// deforms, comes deeper than `depth` below the surface although its end does not: the point
    /// would have passed through a thin part of the body. A point that is too deep to begin with
    /// may leave.
    pub fn passes_through(&self, body: usize, x0: &Vec3, x: &Vec3, depth: f64) -> bool {
        let entry = &self.entries[body];
        let q = entry.to.to_body(x);
        let end = entry.end.value(&q) + entry.inset;
        // too short a path to come that deep
        let longest = (q - entry.from.to_body(x0)).norm() + entry.way;
        if end - SLOPE * longest >= -depth {
            return false;
        }
        // the start rides along with the surface that it stood at
        let p = entry.to.to_body(&self.carried(body, x0));
        let length = (q - p).norm();
        dips(
            |s| entry.end.value(&p.lerp(&q, s / length)) + entry.inset,
            length,
            end,
            depth,
        )
    }
}

/// Whether a path of some length through a distance field (`value(s)` after a way `s`, `end` after
/// all of it) dips below `-depth` and by `depth` below its end, and if it starts below, below that.
///
/// From a point `d` above the level in question the next `d / SLOPE` of the path are clear (sphere
/// tracing, Hart 1996), whatever the path's length and the body's thickness. Close above the level
/// strides do not fall below what a dip of `BLUR depth` takes. A path that keeps so close to the
/// level that the strides run out counts as passing: the caller then cuts the path.
fn dips(value: impl Fn(f64) -> f64, length: f64, end: f64, depth: f64) -> bool {
    let stride = (2.0 * BLUR * depth / SLOPE).max(1e-6);
    let mut level = (-depth).min(end - depth);
    let mut s = 0.0;
    for _ in 0..MAX_STRIDES {
        if s >= length {
            return false;
        }
        let d = value(s);
        if s == 0.0 && d < level {
            level = d - depth;
        } else if d < level {
            return true;
        }
        s += ((d - level) / SLOPE).max(stride);
    }
    s < length
}

impl Bodies for BodySet {
    fn count(&self) -> usize {
        self.entries.len()
    }

    fn distance(&self, body: usize, point: &Vec3) -> Distance {
        let entry = &self.entries[body];
        distance(&entry.end, &entry.to, entry.inset, point)
    }

    fn value(&self, body: usize, point: &Vec3) -> f64 {
        let entry = &self.entries[body];
        entry.end.value(&entry.to.to_body(point)) + entry.inset
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

/// The bodies as they are at the start of the substep.
pub struct AtStart<'a>(pub &'a BodySet);

impl Bodies for AtStart<'_> {
    fn count(&self) -> usize {
        self.0.count()
    }

    fn distance(&self, body: usize, point: &Vec3) -> Distance {
        let entry = &self.0.entries[body];
        distance(&entry.start, &entry.from, entry.inset, point)
    }

    fn value(&self, body: usize, point: &Vec3) -> f64 {
        self.0.value_at_start(body, point)
    }

    fn carried(&self, _: usize, point: &Vec3) -> Vec3 {
        *point
    }

    fn contact(&self, body: usize) -> &ContactSettings {
        self.0.contact(body)
    }
}

/// Distance to a body in a pose, `inset` below its surface, derivatives by world coordinates.
fn distance(body: &Body, pose: &Pose, inset: f64, point: &Vec3) -> Distance {
    let d = body.distance(&pose.to_body(point));
    let r = pose.rotation.to_rotation_matrix();
    Distance {
        value: d.value + inset,
        gradient: r * d.gradient,
        hessian: r.matrix() * d.hessian * r.matrix().transpose(),
    }
}

fn shaped(original: &Body, vertices: &[Vec3], workers: &Workers) -> Result<Body> {
    if vertices.is_empty() {
        Ok(original.clone())
    } else {
        original.deformed_with(vertices, workers)
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

#[cfg(test)]
mod tests {
    use super::*;

    /// A plate of half thickness `half` around `at`, met head on.
    fn plate(at: f64, half: f64) -> impl Fn(f64) -> f64 {
        move |s| (s - at).abs() - half
    }

    #[test]
    fn a_thin_plate_is_seen_from_any_distance() {
        let depth = 1e-3;
        for length in [0.05, 1.0, 8.0, 100.0, 1e4] {
            for part in [0.1, 0.377, 0.5, 0.9] {
                let at = part * length;
                let value = plate(at, 1.2 * depth);
                assert!(
                    dips(&value, length, value(length), depth),
                    "{length} {part}"
                );
                // one too thin to be that deep inside is not
                let value = plate(at, 0.9 * depth);
                assert!(
                    !dips(&value, length, value(length), depth),
                    "{length} {part}"
                );
                // nor one that the path does not reach
                let value = plate(1.1 * length, 1.2 * depth);
                assert!(
                    !dips(&value, length, value(length), depth),
                    "{length} {part}"
                );
            }
        }
    }

    #[test]
    fn a_point_that_starts_too_deep_may_leave() {
        let depth = 1e-3;
        let value = |s: f64| s - 0.02;
        assert!(!dips(value, 0.05, value(0.05), depth));
        // but not through the other side
        let value = |s: f64| (s - 0.02).abs() - 0.03;
        assert!(dips(value, 0.1, value(0.1), depth));
    }

    #[test]
    fn the_number_of_evaluations_is_bounded_and_the_doubtful_path_is_refused() {
        let depth = 1e-3;
        let count = std::cell::Cell::new(0);
        let level = |_: f64| {
            count.set(count.get() + 1);
            -depth * (1.0 - 1e-9)
        };
        assert!(dips(level, 1e6, 0.5, depth));
        assert_eq!(count.get(), MAX_STRIDES);
    }
}
