//! What pins and bodies take along when they move: the start of Newton's method at rest.

use crate::math::Vec3;
use crate::system::bodies::BodySet;
use crate::system::state::State;
use crate::system::term::Bodies;

/// A way on which some vertices are taken.
#[derive(Default)]
pub(super) struct Carry {
    /// Way of each vertex [m]; empty where none is taken anywhere.
    pub(super) way: Vec<Vec3>,
    /// Which vertices are taken, or held still.
    pub(super) held: Vec<bool>,
}

impl Carry {
    /// The way of the pins (`fixed`) to their places `center`, and of the vertices that rub on a
    /// body with the body.
    pub(super) fn take_along(
        &mut self,
        state: &State,
        center: &[Vec3],
        fixed: &[bool],
        bodies: &BodySet,
    ) {
        let x = &state.positions;
        self.way.resize(center.len(), Vec3::zeros());
        self.held.clear();
        self.held.extend_from_slice(fixed);
        for anchor in &state.body_anchors {
            let (v, body) = (anchor.vertex as usize, anchor.body as usize);
            if !fixed[v] && bodies.is_moving(body) {
                self.held[v] = true;
                self.way[v] = bodies.carried(body, &x[v]) - x[v];
            }
        }
        for pin in &state.pins {
            let v = pin.vertex as usize;
            self.way[v] = center[v] - x[v];
        }
        if self.way.iter().all(|way| *way == Vec3::zeros()) {
            self.way.clear();
        }
    }
}
