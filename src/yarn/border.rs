//! Which nodes are the border of the yarns along each edge of their panel.
//!
//! A knitted piece is laid in whole loops in the middle of its panel, so there may be a gap between it and an edge. With
//! the fabric's larger pitch `p`, a node lies along an edge if it is nearer than `0.45 p` to it, or if it faces the edge and
//! no yarn of the panel lies before it: if its straight way to the nearest point of the edge, of length `l` and
//! direction `e`, ends between the edge's corners without crossing the outline, and no node at `r` from it has
//!
//! ```text
//! 0.05 p <= r . e < l + 0.05 p   and   |r - (r . e) e| < 0.55 p
//! ```
//!
//! Rods of seams lie on the outline: they are nodes along the edge that they are near to, and before no other.

use super::{Family, YarnMesh};
use crate::error::Result;
use crate::math::Vec2;
use crate::pattern::outline::{Piece, crosses, polylines};
use crate::pattern::{Garment, Panel};
use std::collections::BTreeMap;

/// Turn of an edge between two points that nodes are measured from [rad].
const TURN: f64 = 0.1;
/// Distance to an edge, over the pitch, below which a node is on it.
const BESIDE: f64 = 0.45;
/// How much farther out, over the pitch, another node lies before one.
const AHEAD: f64 = 0.05;
/// Half the width of the way out, over the pitch.
const ASIDE: f64 = 0.55;

/// A node along an edge of its panel.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Border {
    /// The panel.
    pub panel: u32,
    /// Edge number in the panel.
    pub edge: u32,
    /// The node.
    pub node: u32,
}

/// Nodes along every edge of the panels whose yarns these are, sorted.
pub fn borders(garment: &Garment, laid: &YarnMesh) -> Result<Vec<Border>> {
    let mut rod = vec![false; laid.uv.len()];
    for y in (0..laid.yarn_count()).filter(|y| laid.yarn_family[*y] == Family::Seam) {
        for passage in laid.yarn(y) {
            rod[passage.node as usize] = true;
        }
    }
    let mut nodes = vec![Vec::new(); garment.panels.len()];
    for (node, panel) in (0_u32..).zip(&laid.node_panel) {
        nodes[*panel as usize].push(node);
    }
    let mut out = Vec::new();
    for ((panel, shape), nodes) in (0_u32..).zip(&garment.panels).zip(&nodes) {
        let Some(fabric) = garment.fabrics[shape.fabric].yarns.as_ref() else {
            continue;
        };
        let [a, b] = fabric.structure.pitch();
        let sight = Sight::new(shape, a.max(b), laid, nodes, &rod)?;
        for edge in 0..shape.edge_count() {
            let along = |n: &u32| sight.reaches(edge, laid.uv[*n as usize], rod[*n as usize]);
            let edge = edge as u32;
            let found = nodes.iter().copied().filter(along);
            out.extend(found.map(|node| Border { panel, edge, node }));
        }
    }
    Ok(out)
}

/// What may lie between nodes of a panel and its edges.
struct Sight {
    outline: Vec<Piece>,
    pitch: f64,
    /// Nodes by the square of the pitch that they lie in.
    squares: BTreeMap<[i64; 2], Vec<Vec2>>,
    /// Diagonal of the box of all nodes [m].
    extent: f64,
}

impl Sight {
    fn new(
        shape: &Panel,
        pitch: f64,
        laid: &YarnMesh,
        nodes: &[u32],
        rod: &[bool],
    ) -> Result<Self> {
        let mut squares: BTreeMap<[i64; 2], Vec<Vec2>> = BTreeMap::new();
        let mut corners = [Vec2::repeat(f64::INFINITY), Vec2::repeat(f64::NEG_INFINITY)];
        for node in nodes.iter().filter(|n| !rod[**n as usize]) {
            let uv = laid.uv[*node as usize];
            squares.entry(square(uv, pitch)).or_default().push(uv);
            corners = [corners[0].inf(&uv), corners[1].sup(&uv)];
        }
        Ok(Self {
            outline: polylines(&shape.segments()?, &shape.loops(), TURN),
            pitch,
            squares,
            extent: (corners[1] - corners[0]).norm().max(0.0),
        })
    }

    /// Whether a node at `uv`, a rod's or another, lies along the edge.
    fn reaches(&self, edge: usize, uv: Vec2, rod: bool) -> bool {
        let pieces = self.outline.iter().filter(|p| p.edge == edge);
        let nearest = pieces
            .map(|p| nearest(uv, p))
            .min_by(|a, b| (a - uv).norm().total_cmp(&(b - uv).norm()));
        let Some(foot) = nearest else { return false };
        let way = foot - uv;
        let length = way.norm();
        let across = || {
            let open = self.open(uv, way / length, length);
            open && self.faces(edge, foot) && self.sees(uv, foot)
        };
        length < BESIDE * self.pitch || (!rod && across())
    }

    /// Whether a point of an edge is none of its two ends.
    fn faces(&self, edge: usize, foot: Vec2) -> bool {
        let mut pieces = self.outline.iter().filter(|p| p.edge == edge);
        let first = pieces.next();
        let last = pieces.next_back().or(first);
        first.is_some_and(|p| p.a != foot) && last.is_some_and(|p| p.b != foot)
    }

    fn sees(&self, uv: Vec2, foot: Vec2) -> bool {
        !self.outline.iter().any(|p| crosses(uv, foot, p.a, p.b))
    }

    /// Whether no node lies before `uv` on its way out.
    fn open(&self, uv: Vec2, out: Vec2, length: f64) -> bool {
        let before = |q: &Vec2| {
            let r = q - uv;
            let along = r.dot(&out);
            // yarns that end on the edge lie before it, whatever rounding says
            let ahead = (AHEAD * self.pitch..length + AHEAD * self.pitch).contains(&along);
            ahead && (r - out * along).norm() < ASIDE * self.pitch
        };
        let steps = (length.min(self.extent) / self.pitch).ceil() as usize;
        (0..=steps).all(|k| {
            let [i, j] = square(uv + out * (k as f64 * self.pitch), self.pitch);
            let around = (i - 1..=i + 1).flat_map(|i| (j - 1..=j + 1).map(move |j| [i, j]));
            let mut near = around.filter_map(|s| self.squares.get(&s));
            !near.any(|nodes| nodes.iter().any(before))
        })
    }
}

fn square(uv: Vec2, pitch: f64) -> [i64; 2] {
    [uv.x, uv.y].map(|c| (c / pitch).floor() as i64)
}

fn nearest(point: Vec2, piece: &Piece) -> Vec2 {
    let way = piece.b - piece.a;
    let t = (point - piece.a).dot(&way) / way.norm_squared();
    // exactly the ends: whether a node faces the edge hangs on it
    if t <= 0.0 {
        piece.a
    } else if t >= 1.0 {
        piece.b
    } else {
        piece.a + way * t
    }
}
