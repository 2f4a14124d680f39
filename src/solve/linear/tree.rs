//! The elimination tree of a factor's supernodes, cut into subtrees that can be worked on side by side.
//!
//! Supernodes are numbered in postorder, so that a subtree is a range of them and its unknowns are one too. Supernodes of
//! different subtrees share no unknown but those of their common ancestors. The tree is cut into subtrees of at most
//! a sixteenth of the stored numbers and the ancestors that remain, the top. The cut depends on the factor's pattern
//! alone, so results do not depend on the number of threads.

use super::LinearError;
use crate::math::block::BlockPattern;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::Range;

/// A subtree has at most one of this many parts of the stored numbers.
const PARTS: usize = 16;
/// Stored numbers below which a factor is not cut: waking threads takes as long as the solution.
const SMALL: usize = 500_000;
/// Largest part of the stored numbers that the top may have.
const TOP: f64 = 0.3;

/// Supernodes with their cut.
#[derive(Default)]
pub(super) struct Tree {
    /// Parent of each supernode, its own number at a root.
    pub(super) parent: Vec<u32>,
    /// First supernode of the subtree below each.
    pub(super) first: Vec<u32>,
    /// Subtrees, ascending.
    pub(super) subtrees: Vec<Range<usize>>,
    /// Supernodes in no subtree, by levels: what is below one is in earlier levels.
    pub(super) levels: Vec<Vec<usize>>,
}

impl Tree {
    /// The tree of a pattern, which has to be in postorder.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<u32>) -> Result<Self, LinearError> {
        let count = symbolic.n_supernodes();
        let mut node_of = vec![0_u32; symbolic.nrows()];
        for s in 0..count {
            node_of[columns(symbolic, s)].fill(s as u32);
        }
        let mut parent: Vec<u32> = (0..count as u32).collect();
        let mut first = parent.clone();
        let mut sizes = vec![1_u32; count];
        for s in 0..count {
            if first[s] + sizes[s] != s as u32 + 1 {
                return Err(LinearError::NoConvergence);
            }
            if let Some(row) = panel(symbolic, s).0.first() {
                let p = node_of[*row as usize] as usize;
                parent[s] = p as u32;
                first[p] = first[p].min(first[s]);
                sizes[p] += sizes[s];
            }
        }
        let mut tree = Self {
            parent,
            first,
            subtrees: Vec::new(),
            levels: Vec::new(),
        };
        tree.cut(symbolic);
        Ok(tree)
    }

    /// Children of a supernode, the last one first.
    pub(super) fn children(&self, s: usize) -> impl Iterator<Item = usize> {
        let begin = self.first[s] as usize;
        let mut end = s;
        std::iter::from_fn(move || {
            let child = end.checked_sub(1).filter(|child| *child >= begin)?;
            end = self.first[child] as usize;
            Some(child)
        })
    }

    /// Whether a supernode has no parent.
    pub(super) fn is_root(&self, s: usize) -> bool {
        self.parent[s] as usize == s
    }

    /// The largest subtree loses its root to the top while that stays small.
    fn cut(&mut self, symbolic: &SymbolicSupernodalCholesky<u32>) {
        let count = self.parent.len();
        let all = symbolic.len_val();
        let values = symbolic.col_ptr_for_val();
        let work = |s: usize| (values[s + 1] - values[self.first[s] as usize]) as usize;
        let mut roots: Vec<usize> = (0..count).filter(|s| self.is_root(*s)).collect();
        let (mut top, mut top_work) = (Vec::new(), 0);
        while all >= SMALL
            && let Some(at) = (0..roots.len()).max_by_key(|&i| (work(roots[i]), i))
        {
            let s = roots[at];
            let own = panel(symbolic, s).1.len();
            if work(s) * PARTS <= all || (top_work + own) as f64 > TOP * all as f64 {
                break;
            }
            roots.swap_remove(at);
            roots.extend(self.children(s));
            top.push(s);
            top_work += own;
        }
        top.sort_unstable();
        roots.sort_unstable();
        let subtrees = roots.iter().map(|&s| self.first[s] as usize..s + 1);
        self.subtrees = if top.is_empty() {
            vec![0..count]
        } else {
            subtrees.collect()
        };
        let mut level = vec![0; count];
        for &s in &top {
            if level[s] == self.levels.len() {
                self.levels.push(Vec::new());
            }
            self.levels[level[s]].push(s);
            let parent = self.parent[s] as usize;
            level[parent] = level[parent].max(level[s] + 1);
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        8 * self.parent.len() + 16 * self.subtrees.len()
    }
}

/// Unknowns of a supernode.
pub(super) fn columns(symbolic: &SymbolicSupernodalCholesky<u32>, s: usize) -> Range<usize> {
    symbolic.supernode_begin()[s] as usize..symbolic.supernode_end()[s] as usize
}

/// Rows below a supernode's diagonal block, and the numbers of its panel among those of all.
pub(super) fn panel(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    s: usize,
) -> (&[u32], Range<usize>) {
    let values = symbolic.col_ptr_for_val();
    (
        &symbolic.row_idx()[rows(symbolic, s)],
        values[s] as usize..values[s + 1] as usize,
    )
}

/// Where the rows below a supernode's diagonal block are listed.
pub(super) fn rows(symbolic: &SymbolicSupernodalCholesky<u32>, s: usize) -> Range<usize> {
    let rows = symbolic.col_ptr_for_row_idx();
    rows[s] as usize..rows[s + 1] as usize
}

/// Place of a row in a vector of the unknowns `inside` and the rows `above` them; rows are asked for in ascending order, and `at` goes on
/// through `above`.
pub(super) fn place(row: u32, inside: &Range<usize>, above: &[u32], at: &mut usize) -> u32 {
    if (row as usize) < inside.end {
        return row - inside.start as u32;
    }
    *at += above[*at..].partition_point(|r| *r < row);
    (inside.len() + *at) as u32
}

/// Rearranges the new places of block rows so that the elimination tree is in postorder (Liu 1990): the fill stays the same, and
/// nothing changes where it already is.
pub(super) fn postorder(pattern: &BlockPattern, place: &mut [u32]) {
    let n = place.len();
    // the earlier rows that each row is coupled with
    let mut starts = vec![0_usize; n + 1];
    let each = |visit: &mut dyn FnMut(usize, u32)| {
        for j in 0..n {
            for k in pattern.starts[j] as usize + 1..pattern.starts[j + 1] as usize {
                let (p, q) = (place[pattern.rows[k] as usize], place[j]);
                visit(p.max(q) as usize, p.min(q));
            }
        }
    };
    each(&mut |row, _| starts[row + 1] += 1);
    for i in 0..n {
        starts[i + 1] += starts[i];
    }
    let mut earlier = vec![0_u32; starts[n]];
    let mut next = starts.clone();
    each(&mut |row, other| {
        earlier[next[row]] = other;
        next[row] += 1;
    });
    // rows without a parent have themselves
    let mut parent: Vec<usize> = (0..n).collect();
    let mut ancestor: Vec<usize> = (0..n).collect();
    for i in 0..n {
        for &j in &earlier[starts[i]..starts[i + 1]] {
            let mut r = j as usize;
            while ancestor[r] != r && ancestor[r] != i {
                r = std::mem::replace(&mut ancestor[r], i);
            }
            if ancestor[r] == r && r != i {
                ancestor[r] = i;
                parent[r] = i;
            }
        }
    }
    // where each subtree begins: after those of the parent's earlier children
    let mut sizes = vec![1_usize; n];
    for i in 0..n {
        if parent[i] != i {
            sizes[parent[i]] += sizes[i];
        }
    }
    let mut begins = vec![0; n];
    let (mut free, mut roots) = (vec![0; n], n);
    for i in (0..n).rev() {
        let end = if parent[i] == i {
            roots -= sizes[i];
            roots
        } else {
            free[parent[i]] -= sizes[i];
            free[parent[i]]
        };
        begins[i] = end;
        free[i] = end + sizes[i] - 1;
    }
    for p in place {
        *p = (begins[*p as usize] + sizes[*p as usize] - 1) as u32;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_are_rearranged_into_postorder_and_then_stay() {
        // the tree of this order is 0 -> 3, 1 -> 2, 2 -> 4, 3 -> 4
        let pattern = BlockPattern::from_stencils(5, |sink| {
            for pair in [[0, 3], [1, 2], [2, 4], [3, 4]] {
                sink(&pair);
            }
        });
        let mut place = [0, 1, 2, 3, 4];
        postorder(&pattern, &mut place);
        assert_eq!(place, [2, 0, 1, 3, 4]);
        postorder(&pattern, &mut place);
        assert_eq!(place, [2, 0, 1, 3, 4]);
    }
}
