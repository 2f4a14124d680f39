//! Vertices carried by the yarns around them.
//!
//! A vertex at `u_v` of the flat panel takes the value at `u_v` of the affine map that fits the nodes
//! within a distance `r` best,
//!
//! ```text
//! min over c, A of  sum_k w_k |x_k - c - A (u_k - u_v)|^2,   w_k = (1 - |u_k - u_v|^2 / r^2)^2
//! ```
//!
//! (moving least squares; Lancaster and Salkauskas 1981), so `x_v = c` is a fixed combination of
//! nodes that carries every affine motion exactly. `r` begins at the given reach and grows until at
//! least eight nodes that do not lie on one line are in it.
//!
//! A vertex on a seam goes where the seam's rod is, `x_v = (1 - t) x_a + t x_b` with the foot `t` of `u_v` on the
//! nearest piece of the rod: both sides of a seam meet there.

use crate::error::{Error, Result};
use crate::math::{Mat3, Vec2, Vec3};
use crate::tri::GarmentMesh;
use crate::yarn::{Family, YarnMesh};

/// Fewest nodes that carry a vertex.
const FEWEST: usize = 8;
/// Growth of the reach, and how often it may grow.
const GROWTH: f64 = 1.5;
const GROWTHS: usize = 24;
/// Determinant of the moments over the product of their diagonal below which nodes are collinear.
const FLAT: f64 = 1e-3;

/// Weights of nodes for each vertex that is carried.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Follow {
    /// The vertices.
    pub vertices: Vec<u32>,
    /// Nodes of vertex `k` of the list: `starts[k]..starts[k + 1]`.
    starts: Vec<u32>,
    nodes: Vec<u32>,
    weights: Vec<f64>,
}

impl Follow {
    /// Weights for the vertices in `follows`; of a panel, `name_and_reach` are its name and the length of its edges [m].
    pub fn new(
        mesh: &GarmentMesh,
        yarns: &YarnMesh,
        follows: &[bool],
        name_and_reach: impl Fn(usize) -> (String, f64),
    ) -> Result<Self> {
        let mut out = Self {
            starts: vec![0],
            ..Self::default()
        };
        let sewn = mesh.sewn();
        for panel in 0..mesh.panel_starts.len() - 1 {
            let vertices = mesh.panel_starts[panel]..mesh.panel_starts[panel + 1];
            let mut vertices = vertices.filter(|v| follows[*v as usize]).peekable();
            if vertices.peek().is_none() {
                continue;
            }
            let (name, reach) = name_and_reach(panel);
            let buckets = Buckets::new(yarns, panel as u32, reach);
            let rods = rods(yarns, panel as u32);
            for vertex in vertices {
                let place = mesh.uv[vertex as usize];
                let on_rod = sewn[vertex as usize] && out.carry_on_rod(&rods, &place);
                if !on_rod && !out.carry(yarns, &buckets, &place, reach) {
                    return Err(Error::geometry(format!(
                        "panel '{name}': too few yarns near vertex {vertex} at ({:.4}, {:.4}) m",
                        place.x, place.y
                    )));
                }
                out.vertices.push(vertex);
                out.starts.push(out.nodes.len() as u32);
            }
        }
        Ok(out)
    }

    fn carry(&mut self, yarns: &YarnMesh, buckets: &Buckets, place: &Vec2, reach: f64) -> bool {
        let mut r = reach;
        for _ in 0..GROWTHS {
            let near = buckets.within(yarns, place, r);
            let weight = |d: f64| (1.0 - d / (r * r)).powi(2);
            let moments: Mat3 = near
                .iter()
                .map(|(node, d)| {
                    let p = basis(&(yarns.uv[*node as usize] - place), r);
                    p * p.transpose() * weight(*d)
                })
                .sum();
            let scale = moments[(0, 0)] * moments[(1, 1)] * moments[(2, 2)];
            if near.len() >= FEWEST
                && moments.determinant() > FLAT * scale
                && let Some(inverse) = moments.try_inverse()
            {
                let row = inverse.column(0).into_owned();
                for (node, d) in near {
                    let p = basis(&(yarns.uv[node as usize] - place), r);
                    self.nodes.push(node);
                    self.weights.push(weight(d) * row.dot(&p));
                }
                return true;
            }
            r *= GROWTH;
        }
        false
    }

    /// Whether a piece of a rod is near enough to carry a vertex at `place`.
    fn carry_on_rod(&mut self, rods: &[Piece], place: &Vec2) -> bool {
        let mut nearest = None;
        let mut least = f64::INFINITY;
        for piece in rods {
            let way = piece.uv[1] - piece.uv[0];
            let t = ((place - piece.uv[0]).dot(&way) / way.norm_squared()).clamp(0.0, 1.0);
            let apart = (piece.uv[0] + way * t - place).norm();
            if apart < way.norm() && apart < least {
                (least, nearest) = (apart, Some((piece.nodes, t)));
            }
        }
        let Some((nodes, t)) = nearest else {
            return false;
        };
        self.nodes.extend(nodes);
        self.weights.extend([1.0 - t, t]);
        true
    }

    /// Writes the values of the carried vertices from those of the nodes.
    pub fn apply(&self, nodes: &[Vec3], vertices: &mut [Vec3]) {
        for (k, vertex) in self.vertices.iter().enumerate() {
            let range = self.starts[k] as usize..self.starts[k + 1] as usize;
            vertices[*vertex as usize] = range
                .map(|j| nodes[self.nodes[j] as usize] * self.weights[j])
                .sum();
        }
    }
}

fn basis(offset: &Vec2, r: f64) -> Vec3 {
    Vec3::new(1.0, offset.x / r, offset.y / r)
}

/// A piece of a seam's rod between two nodes, and where those lie in one of the seam's panels.
struct Piece {
    nodes: [u32; 2],
    uv: [Vec2; 2],
}

/// Pieces of all rods along edges of a panel.
fn rods(yarns: &YarnMesh, panel: u32) -> Vec<Piece> {
    let mut other: Vec<(u32, Vec2)> = (yarns.across.iter())
        .filter(|a| a.panel == panel)
        .map(|a| (a.node, a.uv))
        .collect();
    other.sort_by_key(|a| a.0);
    let own =
        |node: u32| (yarns.node_panel[node as usize] == panel).then(|| yarns.uv[node as usize]);
    let beyond = |node: u32| {
        let k = other.binary_search_by_key(&node, |a| a.0).ok()?;
        Some(other[k].1)
    };
    let mut pieces = Vec::new();
    for (y, family) in yarns.yarn_family.iter().enumerate() {
        if *family != Family::Seam {
            continue;
        }
        let passages = &yarns.incidences[yarns.starts[y] as usize..yarns.starts[y + 1] as usize];
        for nodes in passages.windows(2).map(|p| [p[0].node, p[1].node]) {
            let sides = [nodes.map(own), nodes.map(beyond)];
            pieces.extend(sides.into_iter().filter_map(|side| match side {
                [Some(a), Some(b)] => Some(Piece { nodes, uv: [a, b] }),
                _ => None,
            }));
        }
    }
    pieces
}

/// Nodes of one panel, sorted by the cells of a grid.
struct Buckets {
    cell: f64,
    /// Cell and node, sorted.
    entries: Vec<((i64, i64), u32)>,
}

impl Buckets {
    fn new(yarns: &YarnMesh, panel: u32, cell: f64) -> Self {
        let mut entries: Vec<_> = (0..yarns.uv.len())
            .filter(|n| yarns.node_panel[*n] == panel)
            .map(|n| (key(&yarns.uv[n], cell), n as u32))
            .collect();
        entries.sort_unstable();
        Self { cell, entries }
    }

    /// Nodes nearer than `r`, with the squares of their distances.
    fn within(&self, yarns: &YarnMesh, place: &Vec2, r: f64) -> Vec<(u32, f64)> {
        let low = key(&(place - Vec2::repeat(r)), self.cell);
        let high = key(&(place + Vec2::repeat(r)), self.cell);
        let mut near = Vec::new();
        for i in low.0..=high.0 {
            let from = self.entries.partition_point(|e| e.0 < (i, low.1));
            for (cell, node) in &self.entries[from..] {
                if *cell > (i, high.1) {
                    break;
                }
                let d = (yarns.uv[*node as usize] - place).norm_squared();
                if d < r * r {
                    near.push((*node, d));
                }
            }
        }
        near
    }
}

fn key(p: &Vec2, cell: f64) -> (i64, i64) {
    ((p.x / cell).floor() as i64, (p.y / cell).floor() as i64)
}
