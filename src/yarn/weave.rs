//! Warp and weft on a panel, cut at its outline.
//!
//! Warp yarns lie at equal distances with equal margins at both sides of the panel, weft yarns likewise.
//! Every crossing is a node, those inside of floats too; each yarn ends in a node of its own on the
//! outline. A crossing nearer than a fifth of the pitch to the end of one of its yarns is no contact:
//! the two pass each other, so that no segment is very short. A yarn held by fewer than two crossings
//! would fall out of the cloth and is left out.
//!
//! The lengths that keep crossings apart are `min(d, 0.95 du)` with `d = 4R` where the yarn changes
//! face and `2R` in a float: a flat layout can be denser than round yarns allow, and exerts no force.

use super::builder::{Builder, EdgeNode, Place};
use super::layout::Cell;
use super::region::{Region, Rim};
use super::{Corner, Family, Spacing};
use crate::math::Vec2;
use crate::pattern::yarn_fabric::Weave;

/// Least length of a segment over the pitch.
pub(super) const SHORT: f64 = 0.2;
/// Least spacing over the laid one, at most.
pub(super) const SLACK: f64 = 0.95;

/// The rest length between two passages, and the least one that lets yarns of this radius lie side by
/// side [m].
pub(super) fn spacing(radius: f64, changes_face: bool, incidences: [u32; 2], du: f64) -> Spacing {
    let touch = if changes_face { 4.0 } else { 2.0 } * radius;
    Spacing {
        incidences,
        least: touch.min(SLACK * du),
        length: du,
    }
}

/// A stretch of a line inside of the outline.
struct Run {
    line: i64,
    ends: [Rim; 2],
    /// First crossing and the one after the last.
    range: [i64; 2],
    alive: bool,
}

/// Lines at `first + k pitch`, `count` of them.
#[derive(Clone, Copy)]
struct Lines {
    first: f64,
    pitch: f64,
    count: i64,
}

impl Lines {
    fn across(low: f64, high: f64, pitch: f64) -> Self {
        // a panel of n pitches has n yarns, rounding aside
        let count = ((high - low) / pitch + 1e-6).floor().max(0.0);
        Self {
            first: 0.5 * (low + high - (count - 1.0) * pitch),
            pitch,
            count: count as i64,
        }
    }

    fn at(&self, k: i64) -> f64 {
        self.first + k as f64 * self.pitch
    }

    /// Numbers of the lines between two places, `margin` away from them.
    fn between(&self, from: f64, to: f64, margin: f64) -> [i64; 2] {
        let first = ((from + margin - self.first) / self.pitch).ceil().max(0.0) as i64;
        let last = ((to - margin - self.first) / self.pitch).floor() as i64;
        [first, (last + 1).min(self.count).max(first)]
    }
}

/// Numbers of warp and weft lines on a box [m], before any memory is taken.
pub(super) fn line_counts(weave: &Weave, cell: &Cell, size: Vec2) -> [f64; 2] {
    [
        (size.x / (weave.warp_pitch * cell.across)).floor(),
        (size.y / (weave.weft_pitch * cell.along)).floor(),
    ]
}

fn runs(region: &Region, axis: usize, lines: Lines, others: Lines) -> Vec<Run> {
    let mut out = Vec::new();
    for line in 0..lines.count {
        for pair in region.line(axis, lines.at(line)).chunks_exact(2) {
            let [from, to] = [pair[0], pair[1]];
            let other = 1 - axis;
            out.push(Run {
                line,
                range: others.between(from.point[other], to.point[other], SHORT * others.pitch),
                ends: [from, to],
                alive: true,
            });
        }
    }
    out
}

/// Lays the warp and the weft of one panel.
pub(super) fn lay(
    builder: &mut Builder,
    region: &Region,
    weave: &Weave,
    radius: f64,
    cell: &Cell,
    fabric: u32,
    panel: u32,
) {
    let [low, high] = region.bounds();
    let lines = [
        Lines::across(low.x, high.x, weave.warp_pitch * cell.across),
        Lines::across(low.y, high.y, weave.weft_pitch * cell.along),
    ];
    // runs of the warp (x = const) and of the weft (y = const)
    let mut runs = [
        runs(region, 0, lines[0], lines[1]),
        runs(region, 1, lines[1], lines[0]),
    ];
    // crossings are numbered along the warp; each knows its weft
    let mut starts = vec![0usize];
    for run in &runs[0] {
        starts.push(starts[starts.len() - 1] + (run.range[1] - run.range[0]) as usize);
    }
    let total = starts[starts.len() - 1];
    let mut first_run = vec![0usize; lines[0].count as usize + 1];
    for run in &runs[0] {
        first_run[run.line as usize + 1] += 1;
    }
    for k in 0..lines[0].count as usize {
        first_run[k + 1] += first_run[k];
    }
    const NONE: u32 = u32::MAX;
    let mut weft_of = vec![NONE; total];
    let mut weft_nodes: Vec<Vec<usize>> = Vec::with_capacity(runs[1].len());
    for (w, run) in runs[1].iter().enumerate() {
        let mut nodes = Vec::new();
        for i in run.range[0]..run.range[1] {
            let range = first_run[i as usize]..first_run[i as usize + 1];
            let found = range
                .clone()
                .find(|k| (runs[0][*k].range[0]..runs[0][*k].range[1]).contains(&run.line));
            if let Some(k) = found {
                let id = starts[k] + (run.line - runs[0][k].range[0]) as usize;
                weft_of[id] = w as u32;
                nodes.push(id);
            }
        }
        weft_nodes.push(nodes);
    }
    // a yarn that fewer than two others hold falls out, which may free the next
    loop {
        let mut changed = false;
        for k in 0..runs[0].len() {
            let ids = starts[k]..starts[k + 1];
            if runs[0][k].alive && weft_of[ids.clone()].iter().filter(|w| **w != NONE).count() < 2 {
                runs[0][k].alive = false;
                weft_of[ids].fill(NONE);
                changed = true;
            }
        }
        for (w, nodes) in weft_nodes.iter_mut().enumerate() {
            nodes.retain(|id| weft_of[*id] != NONE);
            if runs[1][w].alive && nodes.len() < 2 {
                runs[1][w].alive = false;
                changed = true;
                for id in nodes.drain(..) {
                    weft_of[id] = NONE;
                }
            }
        }
        if !changed {
            break;
        }
    }
    // nodes of the crossings
    let first_node = builder.mesh.uv.len();
    let mut node_of = vec![NONE; total];
    let mut over = Vec::new();
    for (k, run) in runs[0].iter().enumerate() {
        for j in run.range[0]..run.range[1] {
            let id = starts[k] + (j - run.range[0]) as usize;
            if weft_of[id] != NONE {
                let p = Vec2::new(lines[0].at(run.line), lines[1].at(j));
                node_of[id] = builder.node(panel, region.to_panel(p), 0.0);
                over.push(weave.mask.warp_over(run.line as usize, j as usize));
            }
        }
    }
    let face = |node: u32| over.get(node as usize - first_node).copied();
    // neighbours of each crossing before and after it along the warp and along the weft
    let mut beside = vec![[[NONE; 2]; 2]; over.len()];
    let mut paths: Vec<Vec<u32>> = Vec::new();
    for (k, run) in runs[0].iter().enumerate() {
        if run.alive {
            let ids = starts[k]..starts[k + 1];
            paths.push(
                node_of[ids]
                    .iter()
                    .copied()
                    .filter(|n| *n != NONE)
                    .collect(),
            );
        }
    }
    let warps = paths.len();
    for (w, run) in runs[1].iter().enumerate() {
        if run.alive {
            paths.push(weft_nodes[w].iter().map(|id| node_of[*id]).collect());
        }
    }
    let alive = runs.iter().flatten().filter(|run| run.alive);
    for (y, (path, run)) in paths.iter().zip(alive).enumerate() {
        let weft = y >= warps;
        let end = |builder: &mut Builder, rim: &Rim| {
            let node = builder.node(panel, region.to_panel(rim.point), 0.0);
            builder.edge_nodes.push(EdgeNode {
                node,
                panel,
                edge: rim.edge,
                fraction: rim.fraction,
            });
            node
        };
        let ends = [end(builder, &run.ends[0]), end(builder, &run.ends[1])];
        let mut last: Option<(u32, u32)> = None;
        for node in std::iter::once(ends[0])
            .chain(path.iter().copied())
            .chain([ends[1]])
        {
            let front = face(node).map(|warp_over| warp_over != weft);
            let place = Place {
                rank: u8::from(front == Some(true)),
                group: u8::from(weft),
            };
            let incidence = builder.pass(node, place);
            if let Some((before, old)) = last {
                if let Some(slot) = beside.get_mut(node as usize - first_node) {
                    slot[usize::from(weft)][0] = before;
                }
                if let Some(slot) = beside.get_mut(before as usize - first_node) {
                    slot[usize::from(weft)][1] = node;
                }
                if let (Some(a), Some(b)) = (face(before), face(node)) {
                    let passages = &builder.mesh.incidences;
                    let du = passages[incidence as usize].u - passages[old as usize].u;
                    let spacing = spacing(radius, a != b, [old, incidence], du);
                    builder.mesh.spacings.push(spacing);
                }
            }
            last = Some((node, incidence));
        }
        builder.end_yarn(fabric, if weft { Family::Weft } else { Family::Warp });
    }
    let pitch = 0.5 * cell.rest * (weave.warp_pitch + weave.weft_pitch);
    for (k, [warp, weft]) in beside.iter().enumerate() {
        for a in warp {
            for b in weft {
                if *a != NONE && *b != NONE {
                    builder.mesh.corners.push(Corner {
                        nodes: [(first_node + k) as u32, *a, *b],
                        length: pitch,
                    });
                }
            }
        }
    }
}
