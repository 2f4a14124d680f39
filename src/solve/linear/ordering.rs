//! Elimination orders for the incomplete factorization.
//!
//! Reverse Cuthill-McKee (Cuthill and McKee 1969, George 1971) keeps neighbours together, which an
//! incomplete factorization needs. Umetani, Kaufman, Igarashi and Grinspun 2011, section 7, put the
//! vertices of seams first: seam springs are much stiffer than cloth, the entries of emitting
//! vertices dominate those of receiving ones, which dominate the rest, and an incomplete
//! factorization does well when large entries come early. Both are a function of the pattern (and
//! the priorities) alone.

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
    let (starts, neighbours) = adjacency(pattern);
    let of = |v: u32| &neighbours[starts[v as usize]..starts[v as usize + 1]];
    let degree = |v: u32| starts[v as usize + 1] - starts[v as usize];

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
            let (far, far_depth, seen) = farthest(root, &of, &degree, &mut level, &mut front);
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
            for &w in of(v) {
                if !placed[w as usize] {
                    placed[w as usize] = true;
                    order.push(w);
                }
            }
            order[tail..].sort_unstable_by_key(|&w| (degree(w), w));
        }
    }
    order.reverse();
    if let Some(priorities) = priorities {
        order.sort_by_key(|&v| priorities.get(v as usize).copied().unwrap_or(ORDINARY));
    }
    order
}

/// Last vertex of smallest degree on the deepest level around `root`, the depth, and what was seen.
fn farthest<'a>(
    root: u32,
    of: &impl Fn(u32) -> &'a [u32],
    degree: &impl Fn(u32) -> usize,
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
        for &w in of(v) {
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
        .min_by_key(|&v| (degree(v), v))
        .unwrap_or(root);
    (far, depth, front.clone())
}

/// Both directions of the graph, without the diagonal.
fn adjacency(pattern: &BlockPattern) -> (Vec<usize>, Vec<u32>) {
    let n = pattern.n();
    let mut starts = vec![0_usize; n + 1];
    let each = |visit: &mut dyn FnMut(usize, usize)| {
        for j in 0..n {
            for k in pattern.starts[j] as usize + 1..pattern.starts[j + 1] as usize {
                visit(pattern.rows[k] as usize, j);
            }
        }
    };
    each(&mut |i, j| {
        starts[i + 1] += 1;
        starts[j + 1] += 1;
    });
    for v in 0..n {
        starts[v + 1] += starts[v];
    }
    let mut next = starts.clone();
    let mut neighbours = vec![0_u32; starts[n]];
    each(&mut |i, j| {
        neighbours[next[i]] = j as u32;
        next[i] += 1;
        neighbours[next[j]] = i as u32;
        next[j] += 1;
    });
    (starts, neighbours)
}
