//! How far a step may go before cloth can have passed through cloth.
//!
//! Spheres act only where a solver looks. Between the start and the end of a step the vertices are
//! taken to move on straight lines, and no pair of spheres may on its way come nearer than
//! `min(safe distance, 0.7 of its distance at the start)`: above the safe distance no edge slips
//! through (see [`super::spheres`]), and a pair that is already nearer may always use some of
//! what is left. Pairs that coincide have no side to keep to and may part in any direction. Common motion costs nothing: nodes of a tree over the vertices meet when the box
//! of their relative places, swept by the box of their relative displacements, reaches a contact.

use super::spheres::Spheres;
use crate::math::Vec3;
use crate::math::boxtree::{Aabb, BoxTree};
use crate::system::term::MaxStep;

/// Part of its distance that a pair keeps in any step.
const KEPT: f64 = 0.7;
/// Part of the distance at which a pair touches below which it coincides.
pub(super) const COINCIDENT: f64 = 1e-3;

/// Largest part (0 to 1) of the way from `x0` to `x` on which no pair of spheres passes through
/// each other.
pub fn max_travel(spheres: &Spheres, x0: &[Vec3], x: &[Vec3]) -> MaxStep {
    let tree = BoxTree::new(x0);
    let places = tree.fit(|i| Aabb::of(&[x0[i as usize]]));
    let moves = tree.fit(|i| Aabb::of(&[x[i as usize] - x0[i as usize]]));
    let reach = 2.0 * spheres.largest / (1.0 + spheres.reserve);
    let meet = |a: usize, b: usize| {
        (0..3).all(|k| {
            let low = places[b].min[k] - places[a].max[k];
            let high = places[b].max[k] - places[a].min[k];
            let back = (moves[b].min[k] - moves[a].max[k]).min(0.0);
            let forth = (moves[b].max[k] - moves[a].min[k]).max(0.0);
            low + back <= reach && high + forth >= -reach
        })
    };
    let mut most = MaxStep::default();
    tree.pairs(meet, |a, b| {
        if spheres.radii[a as usize] == 0.0 || spheres.radii[b as usize] == 0.0 {
            return;
        }
        let from = x0[b as usize] - x0[a as usize];
        let by = x[b as usize] - x[a as usize] - from;
        let distance = from.norm();
        if distance < COINCIDENT * spheres.rest_distance(a, b) {
            return;
        }
        let limit = spheres.safe_distance(a, b).min(KEPT * distance);
        if let Some(t) = first_time(&from, &by, limit)
            && t < most.part
            && !spheres.excluded(a, b)
        {
            most = MaxStep {
                part: t,
                points: [a, b],
            };
        }
    });
    most
}

/// First `t` in 0..1 at which `|from + t by|` falls to `limit < |from|`.
fn first_time(from: &Vec3, by: &Vec3, limit: f64) -> Option<f64> {
    let (a, half_b, c) = (
        by.norm_squared(),
        from.dot(by),
        from.norm_squared() - limit * limit,
    );
    if half_b >= 0.0 || c <= 0.0 {
        return None;
    }
    let discriminant = half_b * half_b - a * c;
    if discriminant <= 0.0 {
        return None;
    }
    // The form without cancellation: half_b is negative.
    let t = c / (-half_b + discriminant.sqrt());
    (t < 1.0).then_some(t)
}
