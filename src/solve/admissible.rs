//! Whether the end of a substep may stand: no vertex deep in a body or on its other side, no cloth
//! through cloth, no edge that has changed its length out of all proportion.

use crate::math::Vec3;
use crate::math::parallel::Workers;
use crate::system::bodies::SLOPE;
use crate::system::build::System;
use crate::system::term::{Bodies, Configuration};
use crate::system::yarn::kernel::Kernel;
use crate::system::yarn::stretch::Stretch;

/// Vertices of one parallel task.
const CHUNK: usize = 256;

/// Why a converged substep may still not stand.
pub(super) fn inadmissible(
    system: &System,
    at: &Configuration<'_>,
    dynamic: bool,
    workers: &Workers,
) -> Option<&'static str> {
    let count = system.points.count();
    let (start, x) = (&at.x0[..count], &at.x[..count]);
    let mut reasons = vec![None; x.len().div_ceil(CHUNK)];
    for b in 0..system.bodies.count() {
        workers.chunks(&mut reasons, 1, |c, reason| {
            let vertices = c * CHUNK..((c + 1) * CHUNK).min(x.len());
            reason[0] = vertices
                .into_iter()
                .find_map(|v| misplaced(system, b, &start[v], &x[v]));
        });
        if let Some(reason) = reasons.iter().flatten().next() {
            return Some(reason);
        }
    }
    if let Some(term) = system.terms.iter().find(|term| term.max_step(at) < 1.0) {
        return Some(match term.name() {
            Stretch::NAME => "a yarn would slide out between two contacts",
            _ => "cloth would pass through itself",
        });
    }
    if dynamic && system.largest_stretch_change(start, x) > 0.2 {
        return Some("an edge changed its length too much");
    }
    None
}

/// What is wrong with the way of a vertex from `x0` to `x` past a body.
fn misplaced(system: &System, body: usize, x0: &Vec3, x: &Vec3) -> Option<&'static str> {
    let bodies = &system.bodies;
    let limit = system.depth_limit(body);
    // what the distance cannot have fallen by on this path is clear
    let room = bodies.value_at_start(body, x0) + limit;
    if room > SLOPE * bodies.travel(body, x0, x) {
        return None;
    }
    if room > 0.0 && bodies.value(body, x) < -limit {
        return Some("a vertex went too deep into a body");
    }
    if bodies.passes_through(body, x0, x, limit) {
        return Some("a vertex passed through a body");
    }
    None
}
