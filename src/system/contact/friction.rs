//! Coulomb friction as a spring to a moving anchor.
//!
//! With the tangential offset `s` from the anchor and the bound `f = mu lambda` of the force:
//!
//! ```text
//! stick   k/2 |s|^2               where k |s| <= f
//! slip    f |s| - f^2 / (2 k)     beyond
//! ```
//!
//! `lambda` and the tangent plane are those of the last accepted step, so that this is a convex
//! potential within a step; afterwards a slipping anchor is drawn along to the distance `f / k`
//! (Hasegawa et al. 2003; Umetani et al. 2011, section 7). The anchor remembers, so sticking cloth
//! does not creep however soft the spring is. That is why `k` is chosen for the solver: `f / k`, the
//! width of the stick zone, is [`REACH`] wherever the contact's own stiffness allows. A stiffer
//! spring makes Newton's method flip between stick and slip.

use crate::math::{Mat3, Vec3};

/// Offset at which sticking turns into slipping [m].
pub(super) const REACH: f64 = 5e-6;

/// Friction of one contact within a step.
#[derive(Clone, Copy, Debug)]
pub(super) struct Friction {
    /// Unit normal of the contact.
    normal: Vec3,
    /// Largest force [N].
    bound: f64,
    /// Stiffness of the spring [N/m].
    stiffness: f64,
}

impl Friction {
    /// Friction up to the force `bound` [N] of a contact of the stiffness `contact` [N/m]; none for
    /// a bound that is not positive.
    pub(super) fn new(normal: Vec3, bound: f64, contact: f64) -> Option<Self> {
        (bound > 0.0).then(|| Self {
            normal,
            bound,
            stiffness: contact.min(bound / REACH),
        })
    }

    /// Tangential part of an offset from the anchor.
    pub(super) fn slip(&self, offset: &Vec3) -> Vec3 {
        offset - self.normal * self.normal.dot(offset)
    }

    /// Energy [J] of the tangential offset `s`.
    pub(super) fn energy(&self, s: &Vec3) -> f64 {
        let length = s.norm();
        if self.stiffness * length <= self.bound {
            0.5 * self.stiffness * length * length
        } else {
            self.bound * (length - 0.5 * self.bound / self.stiffness)
        }
    }

    /// Its derivative by `s` [N].
    pub(super) fn force(&self, s: &Vec3) -> Vec3 {
        let force = self.stiffness * s.norm();
        s * (self.stiffness * (self.bound / force.max(self.bound)))
    }

    /// Its second derivative [N/m], never negative.
    pub(super) fn hessian(&self, s: &Vec3) -> Mat3 {
        let plane = Mat3::identity() - self.normal * self.normal.transpose();
        let length = s.norm();
        if self.stiffness * length <= self.bound {
            plane * self.stiffness
        } else {
            let t = s / length;
            (plane - t * t.transpose()) * (self.bound / length)
        }
    }
}

/// What is left of the offset `s` once the anchor of a contact of the stiffness `contact` has been
/// drawn along under the bound `bound`.
pub(super) fn kept(s: &Vec3, bound: f64, contact: f64) -> Vec3 {
    let reach = REACH.max(bound / contact);
    let length = s.norm();
    if length <= reach {
        *s
    } else {
        s * (reach / length)
    }
}
