//! How far points of the cloth may move before they can touch a body: most distances of a Newton
//! solve need not be looked up.

use super::super::term::{Bodies, ContactSettings};
use crate::math::Vec3;

/// Clearance of points from every body at the start of a step.
#[derive(Debug, Default)]
pub(super) struct Clearance {
    /// Per point and body [m].
    values: Vec<f64>,
    bodies: usize,
}

impl Clearance {
    /// Takes it for `points`, which keep the distance `free` from a body of such contact.
    pub(super) fn update(
        &mut self,
        bodies: &dyn Bodies,
        points: impl Iterator<Item = Vec3>,
        free: impl Fn(usize, &ContactSettings) -> f64,
    ) {
        self.bodies = bodies.count();
        self.values.clear();
        for (e, x) in points.enumerate() {
            let clear = |b: usize| bodies.value(b, &x) - free(e, bodies.contact(b));
            self.values.extend((0..self.bodies).map(clear));
        }
    }

    /// Bodies that a point may touch after it has moved that far [m].
    pub(super) fn touching(&self, point: usize, moved: f64) -> impl Iterator<Item = usize> + '_ {
        let from = point * self.bodies;
        (0..self.bodies).filter(move |b| moved >= self.values[from + b])
    }
}
