//! Rods along seams, to which the yarns of both sides are tied.
//!
//! A rod runs along the seam's first side, or along the second if only that is laid, at steps of about
//! the pitch of the coarser fabric, and is one yarn of that fabric. Yarn ends on a sewn edge, and the nodes of
//! finished knitted borders near it, are tied to the rod at the same fraction of arc length.

use super::builder::{Builder, EdgeNode, Place};
use super::layout::yarns_of;
use super::{Across, Family, Tie};
use crate::error::Result;
use crate::pattern::{Garment, Seam};

/// Puts the rods of all seams that a laid panel has a side in.
pub(super) fn sew(builder: &mut Builder, garment: &Garment, panels: &[usize]) -> Result<()> {
    let mut nodes = std::mem::take(&mut builder.edge_nodes);
    nodes.sort_by(|a, b| {
        (a.panel, a.edge)
            .cmp(&(b.panel, b.edge))
            .then(a.fraction.total_cmp(&b.fraction))
            .then(a.node.cmp(&b.node))
    });
    for seam in &garment.seams {
        rod(builder, garment, panels, seam, &nodes)?;
    }
    Ok(())
}

fn rod(
    builder: &mut Builder,
    garment: &Garment,
    panels: &[usize],
    seam: &Seam,
    nodes: &[EdgeNode],
) -> Result<()> {
    let sides = [seam.a, seam.b];
    let laid = sides.map(|side| panels.binary_search(&(side.panel as usize)).is_ok());
    let Some(along) = laid.iter().position(|laid| *laid) else {
        return Ok(());
    };
    let mut coarsest = None;
    for (side, laid) in sides.iter().zip(laid) {
        let panel = side.panel as usize;
        if laid {
            let yarns = yarns_of(garment, panel)?;
            if coarsest.is_none_or(|(_, radius, _)| yarns.radius > radius) {
                let [a, b] = yarns.structure.pitch();
                coarsest = Some((garment.panels[panel].fabric, yarns.radius, a.max(b)));
            }
        }
    }
    let Some((fabric, _, step)) = coarsest else {
        return Ok(());
    };
    let side = sides[along];
    let segments = garment.panels[side.panel as usize].segments()?;
    let Some(segment) = segments.get(side.edge as usize) else {
        return Ok(());
    };
    let length = segment.length();
    let least = if segment.turning() > 0.0 { 4.0 } else { 1.0 };
    let pieces = (length / step).round().max(least) as usize;
    let fractions: Vec<f64> = (0..=pieces).map(|k| k as f64 / pieces as f64).collect();
    let first = builder.mesh.uv.len() as u32;
    for point in segment.points_at(&fractions) {
        builder.node(side.panel, point, 0.0);
    }
    let other = sides[1 - along];
    let segments = garment.panels[other.panel as usize].segments()?;
    if let Some(segment) = segments.get(other.edge as usize) {
        let mut points = segment.points_at(&fractions);
        if !seam.same_direction {
            points.reverse();
        }
        for (node, uv) in (first..).zip(points) {
            builder.mesh.across.push(Across {
                node,
                panel: other.panel,
                uv,
            });
        }
    }
    for k in 0..=pieces as u32 {
        builder.pass(first + k, Place::default());
    }
    builder.end_yarn(fabric as u32, Family::Seam);
    for (k, side) in sides.iter().enumerate() {
        let key = (side.panel, side.edge);
        let from = nodes.partition_point(|n| (n.panel, n.edge) < key);
        let to = nodes.partition_point(|n| (n.panel, n.edge) <= key);
        let turned = k != along && !seam.same_direction;
        let place = |n: &EdgeNode| if turned { 1.0 - n.fraction } else { n.fraction };
        let mut list: Vec<(f64, u32)> =
            nodes[from..to].iter().map(|n| (place(n), n.node)).collect();
        if turned {
            list.reverse();
        }
        for (i, (x, node)) in list.iter().enumerate() {
            let before = if i == 0 {
                0.0
            } else {
                0.5 * (list[i - 1].0 + x)
            };
            let after = list.get(i + 1).map_or(1.0, |next| 0.5 * (x + next.0));
            let at = x * pieces as f64;
            let piece = (at as usize).min(pieces - 1);
            builder.mesh.ties.push(Tie {
                node: *node,
                segment: [first + piece as u32, first + piece as u32 + 1],
                t: (at - piece as f64).clamp(0.0, 1.0),
                length: (after - before) * length,
            });
        }
    }
    Ok(())
}
