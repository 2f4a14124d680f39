//! Cuts the path of a knitted piece at a panel's outline, as scissors cut knitted cloth.
//!
//! The piece fills the panel's box and is finished where the outline touches the box: cast-on and
//! bind-off, selvedges. Everywhere else the outline cuts through it: a garment cut out of knitted
//! cloth, which is how outlines of any shape are made; shaping by increases and decreases needs a chart
//! of its own. The yarn falls into pieces that end on the outline.
//!
//! A contact holds if both of its nodes lie inside, the outline does not pass between them, and the new
//! yarn and at least one old one still run through it. A contact nearer than a fifth of the loop width
//! to the end of one of its yarns lets go, and a piece of yarn with fewer than two contacts falls out,
//! which may free others: repeated until nothing changes.

use super::knit::Path;
use super::region::{Region, Rim};
use super::weave::SHORT;
use crate::math::Vec2;

/// A piece of the path: passages `first..=last`, and where it was cut.
pub(super) struct Part {
    pub ends: [Option<Rim>; 2],
    pub range: std::ops::Range<usize>,
    pub dropped: bool,
}

/// What is left of a path.
pub(super) struct Cut {
    pub parts: Vec<Part>,
    /// Whether each node is still passed as a node.
    pub alive: Vec<bool>,
}

/// Cuts the path, whose frame begins at `origin` of the region's, and drops what no longer holds.
/// `w` is the loop width [m].
pub(super) fn cut(path: &Path, region: &Region, origin: Vec2, w: f64) -> Cut {
    let place = |node: u32| path.points[node as usize] + origin;
    let inside: Vec<bool> = path
        .points
        .iter()
        .map(|p| region.inside(p + origin))
        .collect();
    let mut alive = inside.clone();
    for k in 0..path.contact_nodes / 2 {
        let both = alive[2 * k] && alive[2 * k + 1];
        (alive[2 * k], alive[2 * k + 1]) = (both, both);
    }
    let mut parts = Vec::new();
    let mut open: Option<(Option<Rim>, usize)> = None;
    let mut close = |open: &mut Option<(Option<Rim>, usize)>, end: Option<Rim>, to: usize| {
        if let Some((start, from)) = open.take()
            && from < to
        {
            parts.push(Part {
                ends: [start, end],
                range: from..to,
                dropped: false,
            });
        }
    };
    for (k, passage) in path.passages.iter().enumerate() {
        // rounding may disagree with the crossings about points on the outline itself
        match (inside[passage.node as usize], &open) {
            (true, None) => open = Some((None, k)),
            (false, Some(_)) => close(&mut open, None, k),
            _ => {}
        }
        let Some(next) = path.passages.get(k + 1) else {
            break;
        };
        let (a, b) = (place(passage.node), place(next.node));
        let crossings = region.crossings(a, b);
        if !crossings.is_empty()
            && passage.node / 2 == next.node / 2
            && (passage.node as usize) < path.contact_nodes
        {
            kill(&mut alive, path, passage.node);
        }
        for (_, rim) in crossings {
            if open.is_some() {
                close(&mut open, Some(rim), k + 1);
            } else {
                open = Some((Some(rim), k + 1));
            }
        }
    }
    close(&mut open, None, path.passages.len());
    let mut cut = Cut { parts, alive };
    while cut.loosen(path, origin, SHORT * w) {}
    cut
}

/// A node that is none any more, with the other one of its contact.
fn kill(alive: &mut [bool], path: &Path, node: u32) {
    let node = node as usize;
    alive[node] = false;
    if node < path.contact_nodes {
        alive[node ^ 1] = false;
    }
}

impl Cut {
    /// One round of letting go; whether anything changed.
    fn loosen(&mut self, path: &Path, origin: Vec2, short: f64) -> bool {
        let Self { parts, alive } = self;
        let contacts = path.contact_nodes / 2;
        // strands of the new and of the old yarn in each contact
        let mut strands = vec![[0u8; 2]; contacts];
        let mut changed = false;
        for part in parts.iter_mut().filter(|part| !part.dropped) {
            let passages = &path.passages[part.range.clone()];
            let held = |node: u32| alive[node as usize] && (node as usize) < path.contact_nodes;
            let visits = passages.iter().filter(|p| held(p.node)).count() / 2;
            if visits < 2 {
                part.dropped = true;
                changed = true;
                continue;
            }
            for p in passages {
                if held(p.node) && p.node % 2 == 0 {
                    strands[p.node as usize / 2][p.place.group as usize] += 1;
                }
            }
            let first = passages.iter().find(|p| alive[p.node as usize]);
            let last = passages.iter().rfind(|p| alive[p.node as usize]);
            let nodes = [first, last].map(|p| p.map(|p| p.node));
            for (end, node) in part.ends.iter().zip(nodes) {
                if let (Some(rim), Some(node)) = (end, node)
                    && (rim.point - path.points[node as usize] - origin).norm() < short
                {
                    kill(alive, path, node);
                    changed = true;
                }
            }
        }
        for (k, [old, new]) in strands.iter().enumerate() {
            if alive[2 * k] && (*old == 0 || *new == 0) {
                (alive[2 * k], alive[2 * k + 1]) = (false, false);
                changed = true;
            }
        }
        changed
    }
}
