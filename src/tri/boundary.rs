//! How many pieces every edge is cut into.
//!
//! An edge of length `L` with target length `h` gets `round(L / h)` pieces, a curve at least two and
//! no piece that turns by more than 45 degrees. Both sides of a seam get the larger of their two
//! counts, so that their vertices, placed at equal steps of arc length, meet one to one.

use crate::error::{Error, Result};
use crate::pattern::Garment;
use crate::pattern::curve::{Curve, Segment};
use std::f64::consts::FRAC_PI_4;

/// Pieces of every edge: `counts[panel][edge]`. `segments[panel]` are the panel's curves, `scale`
/// multiplies the target lengths.
pub fn edge_counts(
    garment: &Garment,
    segments: &[Vec<Segment>],
    scale: f64,
    max_vertices: usize,
) -> Result<Vec<Vec<usize>>> {
    let mut total = 0.0;
    let mut counts = Vec::with_capacity(garment.panels.len());
    for (panel, curves) in garment.panels.iter().zip(segments) {
        let h = scale * garment.panel_edge_length(panel);
        let mut list = Vec::with_capacity(curves.len());
        for (k, segment) in curves.iter().enumerate() {
            let wanted = (segment.length() / h).round().max(least(segment));
            total += wanted;
            if !(total <= max_vertices as f64) {
                return Err(Error::limit(format!(
                    "panel '{}' edge {k}: pieces of {h} m need more than {max_vertices} vertices",
                    panel.name
                )));
            }
            list.push(wanted as usize);
        }
        counts.push(list);
    }
    match_seams(garment, &mut counts);
    Ok(counts)
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

/// Gives both sides of every seam the larger count.
fn match_seams(garment: &Garment, counts: &mut [Vec<usize>]) {
    for seam in &garment.seams {
        let (a, b) = (seam.a, seam.b);
        let most = counts[a.panel as usize][a.edge as usize]
            .max(counts[b.panel as usize][b.edge as usize]);
        counts[a.panel as usize][a.edge as usize] = most;
        counts[b.panel as usize][b.edge as usize] = most;
    }
}

/// Doubles the pieces of all edges of a panel, and of the edges sewn to them.
pub fn refine_panel(garment: &Garment, counts: &mut [Vec<usize>], panel: usize) {
    for count in &mut counts[panel] {
        *count *= 2;
    }
    match_seams(garment, counts);
}
