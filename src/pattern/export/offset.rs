//! The line at a fixed distance outside the cloth: where to cut when the outline is where to sew.
//!
//! Every piece of the loops is moved outwards, an arc closes the gap at every corner where it opens,
//! all moved pieces are cut where they cross one another, and what lies nearer to the cloth's edge
//! than the distance, or on the cloth, is dropped. What is left are closed lines. Pieces touching
//! along a stretch (a slit exactly twice the distance wide) may leave an open line.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::outline::{Piece, crosses, inside, point_distance};

/// Most pieces whose crossings are searched pair by pair.
const MAX_PIECES: usize = 20_000;
/// Angle between points of the arcs at corners [rad].
const ARC_STEP: f64 = std::f64::consts::PI / 12.0;

fn cross(a: Vec2, b: Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}

/// Lines at `distance` [m] outside the cloth that the loops `pieces` bound; ring 0 is the outline,
/// the others are holes.
pub fn outside(pieces: &[Piece], distance: f64) -> Result<Vec<Vec<Vec2>>> {
    let moved = moved_pieces(pieces, distance);
    if moved.len() > MAX_PIECES {
        return Err(Error::limit(format!(
            "outline of {} pieces, limit {MAX_PIECES}",
            moved.len()
        )));
    }
    let tolerance = 1e-6 * distance;
    let holes = pieces.iter().map(|p| p.ring).max().unwrap_or(0);
    let on_cloth = |p: Vec2| inside(p, pieces, 0) && !(1..=holes).any(|r| inside(p, pieces, r));
    let mut kept: Vec<[Vec2; 2]> = Vec::new();
    for (i, [a, b]) in moved.iter().enumerate() {
        let mut stops = vec![0.0, 1.0];
        for (j, [c, d]) in moved.iter().enumerate() {
            if i != j && boxes_meet([*a, *b], [*c, *d]) && crosses(*a, *b, *c, *d) {
                stops.push(cross(c - a, d - c) / cross(b - a, d - c));
            }
        }
        stops.sort_by(f64::total_cmp);
        for w in stops.windows(2) {
            let middle = a + 0.5 * (w[0] + w[1]) * (b - a);
            let clear = pieces
                .iter()
                .all(|p| point_distance(middle, p.a, p.b) >= distance - tolerance);
            if w[1] > w[0] && clear && !on_cloth(middle) {
                kept.push([a + w[0] * (b - a), a + w[1] * (b - a)]);
            }
        }
    }
    Ok(chain(kept, 10.0 * tolerance))
}

fn boxes_meet([a, b]: [Vec2; 2], [c, d]: [Vec2; 2]) -> bool {
    (0..2).all(|k| a[k].min(b[k]) <= c[k].max(d[k]) && c[k].min(d[k]) <= a[k].max(b[k]))
}

/// Every piece moved outwards, and arcs around the corners that open.
fn moved_pieces(pieces: &[Piece], distance: f64) -> Vec<[Vec2; 2]> {
    let rings = pieces.iter().map(|p| p.ring).max().map_or(0, |r| r + 1);
    let mut area = vec![0.0; rings];
    for p in pieces {
        area[p.ring] += cross(p.a, p.b);
    }
    // the cloth lies left of a counter-clockwise outline, right of a counter-clockwise hole
    let outward = |p: &Piece| {
        let side = if (area[p.ring] > 0.0) == (p.ring == 0) {
            1.0
        } else {
            -1.0
        };
        side * Vec2::new(p.b.y - p.a.y, p.a.x - p.b.x).normalize()
    };
    // corner after each piece: where the moved piece ends, the arc, where the next one starts
    let corners: Vec<Vec<Vec2>> = pieces
        .iter()
        .map(|p| {
            let (n, m) = (outward(p), outward(&pieces[p.next]));
            let turn = cross(n, m).atan2(n.dot(&m));
            let at = |angle: f64, reach: f64| {
                let (sin, cos) = angle.sin_cos();
                p.b + reach * Vec2::new(cos * n.x - sin * n.y, sin * n.x + cos * n.y)
            };
            if turn.abs() <= ARC_STEP {
                // along a curve the moved pieces meet in one point, on either side of it
                return vec![at(0.5 * turn, distance / (0.5 * turn).cos())];
            }
            // corners of a polygon around the circle, so that its sides keep the distance; where
            // the corner closes, the moved pieces cross and the arc is cut off again
            let steps = (turn.abs() / ARC_STEP).ceil() as usize;
            let half = 0.5 * turn / steps as f64;
            let mut corner = vec![at(0.0, distance)];
            corner.extend((0..steps).map(|k| at((2 * k + 1) as f64 * half, distance / half.cos())));
            corner.push(at(turn, distance));
            corner
        })
        .collect();
    let mut before = vec![0; pieces.len()];
    for (k, p) in pieces.iter().enumerate() {
        before[p.next] = k;
    }
    let mut moved = Vec::new();
    for (k, corner) in corners.iter().enumerate() {
        let start = &corners[before[k]];
        moved.push([start[start.len() - 1], corner[0]]);
        moved.extend(corner.windows(2).map(|w| [w[0], w[1]]));
    }
    moved
}

/// Joins pieces end to start.
fn chain(pieces: Vec<[Vec2; 2]>, tolerance: f64) -> Vec<Vec<Vec2>> {
    let mut used = vec![false; pieces.len()];
    let mut lines = Vec::new();
    for first in 0..pieces.len() {
        if used[first] {
            continue;
        }
        used[first] = true;
        let mut line = vec![pieces[first][0], pieces[first][1]];
        let mut end = pieces[first][1];
        // consecutive pieces usually follow one another: look there first
        let mut at = first;
        loop {
            let follow = (1..pieces.len())
                .map(|k| (at + k) % pieces.len())
                .find(|k| !used[*k] && (pieces[*k][0] - end).norm() <= tolerance);
            let Some(k) = follow else { break };
            used[k] = true;
            end = pieces[k][1];
            line.push(end);
            at = k;
        }
        lines.push(line);
    }
    lines
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pattern::curve::{Curve, Segment};
    use crate::pattern::outline::polylines;

    fn polygon(points: &[[f64; 2]]) -> Vec<Segment> {
        (0..points.len())
            .map(|k| Segment {
                start: points[k].into(),
                end: points[(k + 1) % points.len()].into(),
                curve: Curve::Line,
            })
            .collect()
    }

    fn lines(segments: &[Segment], loops: &[std::ops::Range<usize>], d: f64) -> Vec<Vec<Vec2>> {
        let pieces = polylines(segments, loops, 0.05);
        let lines = outside(&pieces, d).unwrap();
        for line in &lines {
            assert!(
                (line[0] - line[line.len() - 1]).norm() < 1e-5,
                "open: {line:?}"
            );
            for p in line {
                let gap = pieces
                    .iter()
                    .map(|q| point_distance(*p, q.a, q.b))
                    .fold(f64::INFINITY, f64::min);
                assert!(gap > 0.998 * d && gap < 1.02 * d, "{gap} {d}");
            }
        }
        lines
    }

    fn area(line: &[Vec2]) -> f64 {
        line.windows(2).map(|w| 0.5 * cross(w[0], w[1])).sum()
    }

    #[test]
    fn a_rectangle_grows_by_its_perimeter_and_a_disc() {
        let (w, h, d) = (0.5, 0.3, 0.01);
        let mut corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h]];
        for turned in [false, true] {
            if turned {
                corners.reverse();
            }
            let lines = lines(&polygon(&corners), &[0..4], d);
            assert_eq!(lines.len(), 1);
            let exact = w * h + 2.0 * (w + h) * d + std::f64::consts::PI * d * d;
            let error = (area(&lines[0]).abs() - exact).abs() / exact;
            assert!(error < 1e-4, "{error}");
        }
    }

    #[test]
    fn a_dart_narrower_than_the_allowance_is_bridged() {
        let dart = [
            [0.0, 0.0],
            [0.2, 0.0],
            [0.2, 0.3],
            [0.105, 0.3],
            [0.1, 0.2],
            [0.095, 0.3],
            [0.0, 0.3],
        ];
        let lines = lines(&polygon(&dart), &[0..7], 0.01);
        assert_eq!(lines.len(), 1);
    }

    #[test]
    fn an_l_and_a_hole_give_one_line_each() {
        let mut segments = polygon(&[
            [0.0, 0.0],
            [0.4, 0.0],
            [0.4, 0.2],
            [0.2, 0.2],
            [0.2, 0.4],
            [0.0, 0.4],
        ]);
        let arc = |a: [f64; 2], b: [f64; 2]| Segment {
            start: a.into(),
            end: b.into(),
            curve: Curve::Arc {
                radius: 0.03,
                large: false,
                right: true,
            },
        };
        segments.push(arc([0.07, 0.1], [0.13, 0.1]));
        segments.push(arc([0.13, 0.1], [0.07, 0.1]));
        let lines = lines(&segments, &[0..6, 6..8], 0.01);
        assert_eq!(lines.len(), 2);
        let hole = area(&lines[1]).abs();
        assert!(
            (hole / (std::f64::consts::PI * 0.02 * 0.02) - 1.0).abs() < 0.01,
            "{hole}"
        );
    }
}
