//! Parts of the cloth that nothing will ever stop.
//!
//! A part (what hangs together by triangles and seams) without pins is lost if a force that does not
//! vanish acts on it as a whole, it touches nothing, and neither bodies nor other parts lie on its
//! way along that force. The way of a vertex is followed by the distance field (sphere tracing,
//! Hart 1996), with a margin that widens with the way, as a part does not move along a line. A part
//! that has gone `FAR` times its own size is lost too: one that slides down an endless slope never
//! leaves it.
//!
//! Looking costs as much as some relaxation steps, so it is done when a part has gone as far as it is
//! long, and again after twice that.

use super::engine::Engine;
use crate::error::Result;
use crate::math::Vec3;
use crate::math::boxtree::Aabb;
use crate::system::bodies::SLOPE;
use crate::system::build::System;
use crate::system::state::State;
use crate::system::term::Bodies;

/// Ways longer than this, over the size of the part, have no end.
const FAR: f64 = 1e3;
/// Margin beside a way over its length.
const WIDENING: f64 = 0.1;
/// Evaluations of the distances along one way; more of them count as an obstacle.
const STRIDES: usize = 256;

/// Watches the parts that no pin holds.
pub(super) struct Drift {
    /// All parts, pinned ones included.
    parts: Vec<Part>,
}

struct Part {
    vertices: Vec<u32>,
    pinned: bool,
    start: Vec3,
    size: f64,
    /// How far it may go before it is looked at [m].
    next: f64,
}

impl Drift {
    /// Watches from the present state on.
    pub(super) fn new(system: &System, state: &State) -> Self {
        let parts = system
            .parts()
            .into_iter()
            .map(|vertices| {
                let pinned = vertices.iter().any(|v| {
                    let pins = &state.pins;
                    pins.binary_search_by_key(v, |p| p.vertex).is_ok()
                });
                let bounds = bounds(&vertices, &state.positions);
                let size = (bounds.max - bounds.min).norm();
                Part {
                    start: centre(&vertices, &state.positions),
                    vertices,
                    pinned,
                    size,
                    next: size,
                }
            })
            .collect();
        Self { parts }
    }

    /// A vertex of a part that is lost, if there is one. Forces below `tolerance` [N] are none.
    pub(super) fn lost(
        &mut self,
        engine: &mut Engine,
        state: &State,
        tolerance: f64,
    ) -> Result<Option<u32>> {
        for k in 0..self.parts.len() {
            let part = &self.parts[k];
            if part.pinned {
                continue;
            }
            let gone = (centre(&part.vertices, &state.positions) - part.start).norm();
            if gone <= part.next {
                continue;
            }
            if gone > FAR * part.size || self.is_adrift(k, engine, state, tolerance)? {
                return Ok(self.parts[k].vertices.first().copied());
            }
            self.parts[k].next = 2.0 * gone;
        }
        Ok(None)
    }

    fn is_adrift(
        &self,
        k: usize,
        engine: &mut Engine,
        state: &State,
        tolerance: f64,
    ) -> Result<bool> {
        let part = &self.parts[k];
        let gradient = engine.forces(state)?;
        let force = -part
            .vertices
            .iter()
            .map(|&v| gradient[v as usize])
            .sum::<Vec3>();
        let size = force.norm();
        if size <= tolerance {
            return Ok(false);
        }
        let along = force / size;
        let x = &state.positions;
        let reach = engine.system.mean_edge();
        let length = FAR * part.size;
        let others = self
            .parts
            .iter()
            .enumerate()
            .filter(|(other, _)| *other != k);
        let own = bounds(&part.vertices, x);
        for (_, other) in others {
            if meets(&own, &bounds(&other.vertices, x), &along, reach) {
                return Ok(false);
            }
        }
        let bodies = &engine.system.bodies;
        let blocked = (0..bodies.count()).any(|b| {
            let reach = reach + bodies.contact(b).thickness;
            part.vertices.iter().any(|&v| {
                is_blocked(
                    |s| bodies.value(b, &(x[v as usize] + along * s)),
                    reach,
                    length,
                )
            })
        });
        Ok(!blocked)
    }
}

/// Whether the way of some length comes nearer than `reach` and the margin to a body of which
/// `value(s)` is the distance after a way `s`.
fn is_blocked(value: impl Fn(f64) -> f64, reach: f64, length: f64) -> bool {
    let mut s = 0.0;
    for _ in 0..STRIDES {
        let clear = value(s) - reach - WIDENING * s;
        if clear <= 0.0 {
            return true;
        }
        s += clear.max(reach) / (SLOPE + WIDENING);
        if s > length {
            return false;
        }
    }
    true
}

/// Whether a box that moves along `along`, with its margin, may meet another: the bounding spheres
/// decide.
fn meets(own: &Aabb, other: &Aabb, along: &Vec3, reach: f64) -> bool {
    let middle = |b: &Aabb| 0.5 * (b.min + b.max);
    let radius = |b: &Aabb| 0.5 * (b.max - b.min).norm();
    let off = middle(other) - middle(own);
    let ahead = off.dot(along);
    let radii = radius(own) + radius(other) + reach;
    let beside = (off - along * ahead).norm();
    ahead > -radii && beside < radii + WIDENING * ahead.max(0.0)
}

fn bounds(vertices: &[u32], x: &[Vec3]) -> Aabb {
    vertices
        .iter()
        .fold(Aabb::EMPTY, |b, &v| b.join(&Aabb::of(&[x[v as usize]])))
}

fn centre(vertices: &[u32], x: &[Vec3]) -> Vec3 {
    vertices.iter().map(|&v| x[v as usize]).sum::<Vec3>() / vertices.len().max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_way_past_a_ball_is_clear_and_one_onto_it_is_not() {
        let ball = |from: Vec3| move |s: f64| (from + Vec3::x() * s).norm() - 0.5;
        let (reach, length) = (0.02, 1e3);
        assert!(is_blocked(ball(Vec3::new(-3.0, 0.2, 0.0)), reach, length));
        // beside it, but within the margin
        assert!(is_blocked(ball(Vec3::new(-3.0, 0.7, 0.0)), reach, length));
        assert!(!is_blocked(ball(Vec3::new(-3.0, 1.5, 0.0)), reach, length));
        // leaving it
        assert!(!is_blocked(ball(Vec3::new(0.6, 0.0, 0.0)), reach, length));
        // a wall beside the way: not known to be clear
        assert!(is_blocked(|_| 0.3, reach, length));
    }

    #[test]
    fn parts_that_move_apart_do_not_meet() {
        let ball = |x: f64, y: f64| {
            let c = Vec3::new(x, y, 0.0);
            Aabb {
                min: c - Vec3::repeat(0.1),
                max: c + Vec3::repeat(0.1),
            }
        };
        let down = -Vec3::y();
        assert!(meets(&ball(0.0, 1.0), &ball(0.1, 0.0), &down, 0.0));
        assert!(!meets(&ball(0.0, 0.0), &ball(0.1, 1.0), &down, 0.0));
        assert!(!meets(&ball(0.0, 1.0), &ball(2.0, 0.0), &down, 0.0));
    }
}
