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
/// Largest change of an edge's length in a substep, over its rest length.
const MOST_CHANGE: f64 = 0.2;

/// Why a converged substep may still not stand.
pub(super) fn inadmissible(
    system: &System,
    at: &Configuration<'_>,
    dynamic: bool,
    workers: &Workers,
) -> Option<String> {
    let count = system.points.count();
    let (start, x) = (&at.x0[..count], &at.x[..count]);
    let mut reasons = vec![None; x.len().div_ceil(CHUNK)];
    for b in 0..system.bodies.count() {
        workers.chunks(&mut reasons, 1, |c, reason| {
            let vertices = c * CHUNK..((c + 1) * CHUNK).min(x.len());
            reason[0] = vertices
                .into_iter()
                .find_map(|v| misplaced(system, b, &start[v], &x[v]).map(|what| (v, what)));
        });
        if let Some((v, what)) = reasons.iter().flatten().next() {
            return Some(format!("{} {what} {b}", named(system, *v)));
        }
    }
    for term in &system.terms {
        let most = term.max_step(at);
        if most.part < 1.0 {
            let what = match term.name() {
                Stretch::NAME => "a yarn would slide out",
                _ => "cloth would pass through itself",
            };
            let [a, b] = most.points.map(|p| named(system, p as usize));
            return Some(format!("{what} between {a} and {b}"));
        }
    }
    if dynamic
        && let Some((vertex, change)) = system.largest_stretch_change(start, x)
        && change > MOST_CHANGE
    {
        return Some(format!(
            "an edge at {} changed its length by {:.0} % (at most {:.0} % in a substep)",
            named(system, vertex as usize),
            1e2 * change,
            1e2 * MOST_CHANGE
        ));
    }
    None
}

/// A point as hosts count it.
pub(super) fn named(system: &System, point: usize) -> String {
    let panel = system.panel_of(point as u32);
    match point.checked_sub(system.points.vertex_count) {
        Some(node) => format!("yarn node {node} of panel {panel}"),
        None => format!("vertex {point} of panel {panel}"),
    }
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
        return Some("went too deep into body");
    }
    if bodies.passes_through(body, x0, x, limit) {
        return Some("passed through body");
    }
    None
}
