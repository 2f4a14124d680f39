//! Where every edge is cut: fractions of its arc length.
//!
//! An edge of length `L` with target length `h` gets `round(L / h)` equal pieces, a curve at least two
//! and no piece that turns by more than 45 degrees. Where a short edge meets a long one, or a
//! finely cut one a coarse one, the piece length `s` is graded: at distance `d` from the corner it is
//! at most `s_corner + g d`, so that triangles beside the corner keep good angles. Both sides of a seam
//! get the same fractions, from the finer of the two wishes at every point, so that their vertices meet
//! one to one. Fineness travels on through corners and seams.

use crate::error::{Error, Result};
use crate::pattern::curve::{Curve, Segment};
use crate::pattern::{EdgeRef, Garment};
use std::f64::consts::FRAC_PI_4;

/// Growth of the piece length per length along an edge.
const GROWTH: f64 = 0.4;
/// Fineness travels over this many corners and seams at most.
const SWEEPS: usize = 12;
/// Changes of a corner's piece length by less than this factor do not travel.
const WORTH: f64 = 0.85;

/// Wished piece lengths along an edge, as fractions of its length.
#[derive(Clone, Copy, Debug)]
struct Wish {
    /// Anywhere.
    most: f64,
    /// At the start and at the end, at most `most`.
    ends: [f64; 2],
}

/// `fractions[panel][edge]`: from 0 to 1, ascending. `targets[panel]` is the target length [m].
pub fn edge_fractions(
    garment: &Garment,
    segments: &[Vec<Segment>],
    targets: &[f64],
    max_vertices: usize,
) -> Result<Vec<Vec<Vec<f64>>>> {
    let lengths: Vec<Vec<f64>> = segments
        .iter()
        .map(|list| list.iter().map(Segment::length).collect())
        .collect();
    let mut wishes: Vec<Vec<Wish>> = Vec::with_capacity(segments.len());
    let mut total = 0.0;
    for (k, panel) in garment.panels.iter().enumerate() {
        let mut list = Vec::with_capacity(segments[k].len());
        for (e, segment) in segments[k].iter().enumerate() {
            let pieces = (lengths[k][e] / targets[k]).round().max(least(segment));
            total += pieces;
            if !(total <= max_vertices as f64) {
                return Err(Error::limit(format!(
                    "panel '{}' edge {e}: pieces of {} m need more than {max_vertices} vertices",
                    panel.name, targets[k]
                )));
            }
            let most = 1.0 / pieces;
            list.push(Wish {
                most,
                ends: [most, most],
            });
        }
        wishes.push(list);
    }
    travel(garment, &lengths, &mut wishes);
    let mut fractions: Vec<Vec<Vec<f64>>> = wishes
        .iter()
        .map(|list| list.iter().map(Wish::cut).collect())
        .collect();
    // one side decides, the other copies: they must agree to the last bit
    for seam in &garment.seams {
        let mut cut = fractions[seam.a.panel as usize][seam.a.edge as usize].clone();
        if !seam.same_direction {
            cut = cut.iter().rev().map(|x| 1.0 - x).collect();
        }
        fractions[seam.b.panel as usize][seam.b.edge as usize] = cut;
    }
    let total: usize = fractions.iter().flatten().map(|cut| cut.len() - 1).sum();
    if total > max_vertices {
        return Err(Error::limit(format!(
            "{}: {total} boundary vertices, limit {max_vertices}",
            garment.title()
        )));
    }
    Ok(fractions)
}

/// Fewest pieces that keep the shape of a curve.
fn least(segment: &Segment) -> f64 {
    let closed: f64 = if segment.start == segment.end {
        3.0
    } else {
        1.0
    };
    match segment.curve {
        Curve::Line => closed,
        _ => (segment.turning() / FRAC_PI_4)
            .ceil()
            .clamp(2.0, 64.0)
            .max(closed),
    }
}

/// Lets fineness travel along edges, around corners and across seams.
fn travel(garment: &Garment, lengths: &[Vec<f64>], wishes: &mut [Vec<Wish>]) {
    // gathered seams in a ring could make each other finer for ever: stop at the finest wish
    let floor = wishes
        .iter()
        .zip(lengths)
        .flat_map(|(w, l)| w.iter().zip(l).map(|(w, l)| w.most * l))
        .fold(f64::INFINITY, f64::min);
    for _ in 0..SWEEPS {
        let mut changed = false;
        for seam in &garment.seams {
            changed |= share(wishes, seam.a, seam.b, seam.same_direction);
        }
        for (panel, list) in garment.panels.iter().zip(wishes.iter_mut().zip(lengths)) {
            let (list, lengths) = list;
            for range in panel.loops() {
                for k in range.clone() {
                    let next = if k + 1 == range.end {
                        range.start
                    } else {
                        k + 1
                    };
                    let here = (list[k].ends[1] * lengths[k]).max(floor);
                    let there = (list[next].ends[0] * lengths[next]).max(floor);
                    changed |= lower(&mut list[k].ends[1], there / lengths[k]);
                    changed |= lower(&mut list[next].ends[0], here / lengths[next]);
                    // from one end of the edge to the other
                    let [start, end] = list[k].ends;
                    changed |= lower(&mut list[k].ends[1], start + GROWTH);
                    changed |= lower(&mut list[k].ends[0], end + GROWTH);
                }
            }
        }
        if !changed {
            break;
        }
    }
    for seam in &garment.seams {
        share(wishes, seam.a, seam.b, seam.same_direction);
    }
}

/// Lowers a wish if that is worth it.
fn lower(wish: &mut f64, value: f64) -> bool {
    let worth = value < WORTH * *wish;
    if worth {
        *wish = value;
    }
    worth
}

/// Gives both sides of a seam the finer of their wishes.
fn share(wishes: &mut [Vec<Wish>], a: EdgeRef, b: EdgeRef, same_direction: bool) -> bool {
    let p = wishes[a.panel as usize][a.edge as usize];
    let mut q = wishes[b.panel as usize][b.edge as usize];
    let turn = |w: &mut Wish| {
        if !same_direction {
            w.ends.reverse();
        }
    };
    turn(&mut q);
    let mut both = Wish {
        most: p.most.min(q.most),
        ends: [p.ends[0].min(q.ends[0]), p.ends[1].min(q.ends[1])],
    };
    both.ends = both.ends.map(|end| end.min(both.most));
    let changed = [(p, both), (q, both)].iter().any(|(old, new)| {
        new.most < WORTH * old.most || (0..2).any(|k| new.ends[k] < WORTH * old.ends[k])
    });
    wishes[a.panel as usize][a.edge as usize] = both;
    turn(&mut both);
    wishes[b.panel as usize][b.edge as usize] = both;
    changed
}

impl Wish {
    /// Cuts at equal steps of `int dx / s(x)` with
    /// `s(x) = min(most, start + g x, end + g (1 - x))`.
    fn cut(&self) -> Vec<f64> {
        let (most, [start, end]) = (self.most, self.ends);
        let even = (1.0 / most).round().max(1.0) as usize;
        let mut rise = (most - start) / GROWTH;
        let mut fall = 1.0 - (most - end) / GROWTH;
        if rise <= 0.0 && fall >= 1.0 {
            return (0..=even).map(|k| k as f64 / even as f64).collect();
        }
        if rise > fall {
            let middle = (0.5 * (1.0 + (end - start) / GROWTH)).clamp(0.0, 1.0);
            (rise, fall) = (middle, middle);
        }
        let up = (GROWTH * rise / start).ln_1p() / GROWTH;
        let flat = (fall - rise) / most;
        let down = (GROWTH * (1.0 - fall) / end).ln_1p() / GROWTH;
        let all = up + flat + down;
        let pieces = (all.round() as usize).max(even);
        let mut cut = Vec::with_capacity(pieces + 1);
        cut.push(0.0);
        for k in 1..pieces {
            let y = all * (k as f64 / pieces as f64);
            cut.push(if y <= up {
                start * (GROWTH * y).exp_m1() / GROWTH
            } else if y <= up + flat {
                rise + (y - up) * most
            } else {
                1.0 - end * (GROWTH * (all - y)).exp_m1() / GROWTH
            });
        }
        cut.push(1.0);
        cut
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_ascend_from_zero_to_one_with_graded_steps() {
        for (most, ends) in [
            (0.1, [0.1, 0.1]),
            (0.1, [0.01, 0.1]),
            (0.1, [0.1, 0.02]),
            (0.5, [0.01, 0.03]),
            (1.0, [0.001, 1.0]),
            (1.0, [0.9, 0.9]),
        ] {
            let cut = Wish { most, ends }.cut();
            assert_eq!((cut[0], cut[cut.len() - 1]), (0.0, 1.0));
            let steps: Vec<f64> = cut.windows(2).map(|w| w[1] - w[0]).collect();
            assert!(steps.iter().all(|s| *s > 0.0 && *s < 1.3 * most));
            for w in steps.windows(2) {
                assert!(
                    w[0] / w[1] < 1.7 && w[1] / w[0] < 1.7,
                    "{most} {ends:?} {steps:?}"
                );
            }
            if steps.len() > 4 {
                assert!((steps[0] / ends[0] - 1.0).abs() < 0.4, "{steps:?}");
            }
        }
    }
}
