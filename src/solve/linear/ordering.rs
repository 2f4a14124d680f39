//! Elimination orders for the incomplete factorization.
//!
//! Reverse Cuthill-McKee (Cuthill and McKee 1969, George 1971) keeps neighbours together, which an
//! incomplete factorization needs. Umetani, Kaufman, Igarashi and Grinspun 2011, section 7, put the
//! vertices of seams first: seam springs are much stiffer than cloth, the entries of emitting
//! vertices dominate those of receiving ones, which dominate the rest, and an incomplete
//! factorization does well when large entries come early. Both are a function of the pattern (and
//! the priorities) alone.

use super::graph::Graph;
use crate::math::block::BlockPattern;
use crate::tri::GarmentMesh;

/// Priority of a vertex that emits seam springs.
pub const EMITTING: u8 = 0;
/// Priority of a vertex of an edge that receives seam springs.
pub const RECEIVING: u8 = 1;
/// Priority of every other vertex.
pub const ORDINARY: u8 = 2;

/// Priorities of a garment's vertices; one that both emits and receives counts as emitting.
pub fn seam_priorities(mesh: &GarmentMesh) -> Vec<u8> {
    let mut priorities = vec![ORDINARY; mesh.uv.len()];
    let links = || mesh.seams.iter().flat_map(|s| &s.links);
    for v in links().flat_map(|l| l.edge) {
        priorities[v as usize] = RECEIVING;
    }
    for link in links() {
        priorities[link.vertex as usize] = EMITTING;
    }
    priorities
}

/// Block rows in the order of their elimination: `order[new] = old`.
///
/// With `priorities` (one for each block row) rows of smaller priority come first and rows of equal
/// priority stay in reverse Cuthill-McKee order.
pub fn reverse_cuthill_mckee(pattern: &BlockPattern, priorities: Option<&[u8]>) -> Vec<u32> {
    let n = pattern.n();
    let graph = Graph::new(pattern);
    let mut order: Vec<u32> = Vec::with_capacity(n);
    let mut level = vec![u32::MAX; n];
    let mut placed = vec![false; n];
    let mut front = Vec::new();
    for seed in 0..n as u32 {
        if placed[seed as usize] {
            continue;
        }
        // A vertex far out: walk to the last level until the depth no longer grows.
        let mut root = seed;
        let mut depth = 0;
        loop {
            let (far, far_depth, seen) = farthest(root, &graph, &mut level, &mut front);
            for v in seen {
                level[v as usize] = u32::MAX;
            }
            if far_depth <= depth {
                break;
            }
            (root, depth) = (far, far_depth);
        }
        // Breadth first from there, neighbours by growing degree.
        let from = order.len();
        order.push(root);
        placed[root as usize] = true;
        let mut head = from;
        while head < order.len() {
            let v = order[head];
            head += 1;
            let tail = order.len();
            for &w in graph.of(v) {
                if !placed[w as usize] {
                    placed[w as usize] = true;
                    order.push(w);
                }
            }
            order[tail..].sort_unstable_by_key(|&w| (graph.degree(w), w));
        }
    }
    order.reverse();
    if let Some(priorities) = priorities {
        order.sort_by_key(|&v| priorities.get(v as usize).copied().unwrap_or(ORDINARY));
    }
    order
}

/// Last vertex of smallest degree on the deepest level around `root`, the depth, and what was seen.
fn farthest(
    root: u32,
    graph: &Graph,
    level: &mut [u32],
    front: &mut Vec<u32>,
) -> (u32, u32, Vec<u32>) {
    front.clear();
    front.push(root);
    level[root as usize] = 0;
    let mut head = 0;
    while head < front.len() {
        let v = front[head];
        head += 1;
        for &w in graph.of(v) {
            if level[w as usize] == u32::MAX {
                level[w as usize] = level[v as usize] + 1;
                front.push(w);
            }
        }
    }
    let depth = front.last().map_or(0, |&v| level[v as usize]);
    let far = front
        .iter()
        .copied()
        .filter(|&v| level[v as usize] == depth)
        .min_by_key(|&v| (graph.degree(v), v))
        .unwrap_or(root);
    (far, depth, front.clone())
}
