//! Loops as polylines, and what can be wrong with polylines: crossing, touching, folding back,
//! lying outside one another.

use super::curve::Segment;
use crate::error::{Error, Result};
use crate::math::Vec2;

/// Two pieces of outline nearer than this [m] count as touching.
pub const TOUCH: f64 = 1e-8;
/// Polyline points nearer than this [m] to the one before are dropped.
const MERGE: f64 = 1e-6;
/// Pairs of pieces looked at before the outline is refused as too tangled.
const MAX_PAIRS: u64 = 40_000_000;

/// Straight piece of a sampled loop.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// Start [m].
    pub a: Vec2,
    /// End [m].
    pub b: Vec2,
    /// Edge number in the panel.
    pub edge: usize,
    /// Number of the loop: 0 outline, then holes.
    pub ring: usize,
    /// Number of the next piece of the loop.
    pub next: usize,
}

/// Samples loops into pieces that turn by no more than `turn` [rad], at most 64 to an edge.
pub fn polylines(segments: &[Segment], loops: &[std::ops::Range<usize>], turn: f64) -> Vec<Piece> {
    let mut pieces: Vec<Piece> = Vec::new();
    for (ring, range) in loops.iter().enumerate() {
        let first = pieces.len();
        for edge in range.clone() {
            let segment = &segments[edge];
            let turning = segment.turning();
            let count = if turning > 0.0 {
                ((turning / turn).ceil() as usize).clamp(2, 64)
            } else {
                1
            };
            let mut from = segment.start;
            for k in 1..=count {
                let to = if k == count {
                    segment.end
                } else {
                    segment.point(k as f64 / count as f64)
                };
                if k < count && (to - from).norm() < MERGE {
                    continue;
                }
                pieces.push(Piece {
                    a: from,
                    b: to,
                    edge,
                    ring,
                    next: pieces.len() + 1,
                });
                from = to;
            }
        }
        if let Some(last) = pieces.get_mut(first..).and_then(<[Piece]>::last_mut) {
            last.next = first;
        }
    }
    pieces
}

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Distance of a point from a straight piece [m].
pub fn point_distance(p: Vec2, a: Vec2, b: Vec2) -> f64 {
    let d = b - a;
    let squared = d.norm_squared();
    let t = if squared > 0.0 {
        ((p - a).dot(&d) / squared).clamp(0.0, 1.0)
    } else {
        0.0
    };
    (p - a - t * d).norm()
}

/// Whether two straight pieces cross properly, each ending on both sides of the other.
pub fn crosses(a: Vec2, b: Vec2, c: Vec2, d: Vec2) -> bool {
    let side = |o: Vec2, e: Vec2, p: Vec2| cross(e - o, p - o);
    side(a, b, c) * side(a, b, d) < 0.0 && side(c, d, a) * side(c, d, b) < 0.0
}

fn touches(p: &Piece, q: &Piece) -> bool {
    crosses(p.a, p.b, q.a, q.b)
        || point_distance(p.a, q.a, q.b) < TOUCH
        || point_distance(p.b, q.a, q.b) < TOUCH
        || point_distance(q.a, p.a, p.b) < TOUCH
        || point_distance(q.b, p.a, p.b) < TOUCH
}

/// First pair of pieces (in order along x) that cross, touch or fold back; neighbours may share
/// their common point.
pub fn first_contact(pieces: &[Piece]) -> Result<Option<(Piece, Piece)>> {
    let mut order: Vec<usize> = (0..pieces.len()).collect();
    let low = |k: usize| pieces[k].a.x.min(pieces[k].b.x);
    let high = |k: usize| pieces[k].a.x.max(pieces[k].b.x);
    order.sort_by(|i, j| low(*i).total_cmp(&low(*j)).then(i.cmp(j)));
    let mut active: Vec<usize> = Vec::new();
    let mut pairs = 0u64;
    for &i in &order {
        let p = &pieces[i];
        active.retain(|&j| high(j) >= low(i) - TOUCH);
        pairs += active.len() as u64;
        if pairs > MAX_PAIRS {
            return Err(Error::limit(format!(
                "outline too tangled to check: more than {MAX_PAIRS} pairs of pieces overlap in x"
            )));
        }
        for &j in &active {
            let q = &pieces[j];
            if p.a.y.min(p.b.y) > q.a.y.max(q.b.y) + TOUCH
                || q.a.y.min(q.b.y) > p.a.y.max(p.b.y) + TOUCH
            {
                continue;
            }
            let bad = if p.next == j && q.next == i {
                // a loop of two pieces encloses nothing
                true
            } else if p.next == j {
                point_distance(q.b, p.a, p.b) < TOUCH || point_distance(p.a, q.a, q.b) < TOUCH
            } else if q.next == i {
                point_distance(p.b, q.a, q.b) < TOUCH || point_distance(q.a, p.a, p.b) < TOUCH
            } else {
                touches(p, q)
            };
            if bad {
                return Ok(Some(if i < j { (*p, *q) } else { (*q, *p) }));
            }
        }
        active.push(i);
    }
    Ok(None)
}

/// Whether a point lies inside the loop `ring`, by the parity of crossings of a ray along +x.
pub fn inside(point: Vec2, pieces: &[Piece], ring: usize) -> bool {
    let mut odd = false;
    for piece in pieces.iter().filter(|piece| piece.ring == ring) {
        let (a, b) = (piece.a, piece.b);
        if (a.y > point.y) != (b.y > point.y) {
            let x = a.x + (point.y - a.y) / (b.y - a.y) * (b.x - a.x);
            if x > point.x {
                odd = !odd;
            }
        }
    }
    odd
}
