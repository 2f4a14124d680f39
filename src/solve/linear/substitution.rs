//! `L L^T x = b` by supernodes, with the subtrees of the elimination tree side by side.
//!
//! Supernodes of different subtrees share no unknown but those of their common ancestors. The tree
//! is cut into [`PARTS`] sets of subtrees of similar work and the ancestors that remain, the top.
//! Each part eliminates its own unknowns and gathers what it takes from the top in a vector of its own;
//! these are added in the order of the parts. The cut depends on the factor's pattern alone, so
//! results do not depend on the number of threads.

use super::LinearError;
use super::cholesky::{Number, supernodal};
use crate::math::parallel::Workers;
use faer::sparse::linalg::cholesky::SymbolicCholesky;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use std::ops::Range;

/// Sets of subtrees.
const PARTS: usize = 8;
/// Stored numbers below which a factor is not cut: waking a thread takes as long as the solution.
const SMALL: usize = 200_000;
/// Largest part of the stored numbers that the top may have.
const TOP: f64 = 0.3;

/// The cut of a factor, and the vectors that its solution needs.
pub(super) struct Substitution<T> {
    parts: Vec<Part<T>>,
    /// Supernodes that no part has, ascending.
    top: Vec<usize>,
    /// Their unknowns.
    top_rows: Vec<Range<usize>>,
    below: Vec<T>,
}

struct Part<T> {
    /// Supernodes, ascending: every one before its ancestors.
    nodes: Vec<usize>,
    /// The whole solution as this part sees it.
    x: Vec<T>,
    /// Part of a vector below a supernode.
    below: Vec<T>,
}

impl<T: Number> Substitution<T> {
    /// Cuts the elimination tree of a factor.
    pub(super) fn new(symbolic: &SymbolicCholesky<u32>) -> Result<Self, LinearError> {
        let n = symbolic.nrows();
        if n == 0 {
            return Ok(Self {
                parts: Vec::new(),
                top: Vec::new(),
                top_rows: Vec::new(),
                below: Vec::new(),
            });
        }
        let symbolic = supernodal(symbolic)?;
        let (sets, top) = cut(symbolic);
        let zeros = || vec![T::of(0.0); n];
        let parts = sets.into_iter().map(|nodes| Part {
            nodes,
            x: zeros(),
            below: zeros(),
        });
        Ok(Self {
            parts: parts.collect(),
            top_rows: top.iter().map(|&s| columns(symbolic, s)).collect(),
            top,
            below: zeros(),
        })
    }

    /// `x = L^-T L^-1 x`.
    pub(super) fn solve(
        &mut self,
        symbolic: &SymbolicSupernodalCholesky<u32>,
        factor: &[T],
        x: &mut [T],
        workers: &Workers,
    ) {
        let (right, top_rows) = (&*x, &self.top_rows);
        workers.chunks(&mut self.parts, 1, |_, part| {
            for part in part {
                for rows in top_rows {
                    part.x[rows.clone()].fill(T::of(0.0));
                }
                for &s in &part.nodes {
                    let rows = columns(symbolic, s);
                    part.x[rows.clone()].copy_from_slice(&right[rows]);
                }
                for &s in &part.nodes {
                    forward(symbolic, factor, s, &mut part.x, &mut part.below);
                }
            }
        });
        for part in &self.parts {
            for rows in &self.top_rows {
                for (x, taken) in x[rows.clone()].iter_mut().zip(&part.x[rows.clone()]) {
                    *x += *taken;
                }
            }
        }
        for &s in &self.top {
            forward(symbolic, factor, s, x, &mut self.below);
        }
        for &s in self.top.iter().rev() {
            backward(symbolic, factor, s, x, &mut self.below);
        }
        let solved = &*x;
        workers.chunks(&mut self.parts, 1, |_, part| {
            for part in part {
                for rows in top_rows {
                    part.x[rows.clone()].copy_from_slice(&solved[rows.clone()]);
                }
                for &s in part.nodes.iter().rev() {
                    backward(symbolic, factor, s, &mut part.x, &mut part.below);
                }
            }
        });
        for part in &self.parts {
            for &s in &part.nodes {
                let rows = columns(symbolic, s);
                x[rows.clone()].copy_from_slice(&part.x[rows]);
            }
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let parts = self.parts.iter();
        size_of::<T>() * self.below.len() * (1 + 2 * self.parts.len())
            + 8 * (parts.map(|p| p.nodes.len()).sum::<usize>() + 3 * self.top.len())
    }
}

fn columns(symbolic: &SymbolicSupernodalCholesky<u32>, s: usize) -> Range<usize> {
    symbolic.supernode_begin()[s] as usize..symbolic.supernode_end()[s] as usize
}

/// Rows below a supernode's diagonal block, and where its panel is stored.
fn panel(symbolic: &SymbolicSupernodalCholesky<u32>, s: usize) -> (&[u32], Range<usize>) {
    let (rows, values) = (symbolic.col_ptr_for_row_idx(), symbolic.col_ptr_for_val());
    (
        &symbolic.row_idx()[rows[s] as usize..rows[s + 1] as usize],
        values[s] as usize..values[s + 1] as usize,
    )
}

/// Plain loops over the columns of the panels beat the general dense kernels for one right-hand side
/// and narrow panels.
fn forward<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    factor: &[T],
    s: usize,
    x: &mut [T],
    below: &mut [T],
) {
    let inside = columns(symbolic, s);
    let (begin, width) = (inside.start, inside.len());
    let (rows, values) = panel(symbolic, s);
    let below = &mut below[..rows.len()];
    below.fill(T::of(0.0));
    for (j, column) in factor[values].chunks_exact(width + rows.len()).enumerate() {
        let value = x[begin + j] / column[j];
        x[begin + j] = value;
        for (x, l) in x[begin + j + 1..].iter_mut().zip(&column[j + 1..width]) {
            *x -= *l * value;
        }
        for (b, l) in below.iter_mut().zip(&column[width..]) {
            *b += *l * value;
        }
    }
    for (b, row) in below.iter().zip(rows) {
        x[*row as usize] -= *b;
    }
}

fn backward<T: Number>(
    symbolic: &SymbolicSupernodalCholesky<u32>,
    factor: &[T],
    s: usize,
    x: &mut [T],
    below: &mut [T],
) {
    let inside = columns(symbolic, s);
    let (begin, width) = (inside.start, inside.len());
    let (rows, values) = panel(symbolic, s);
    let below = &mut below[..rows.len()];
    for (b, row) in below.iter_mut().zip(rows) {
        *b = x[*row as usize];
    }
    for (j, column) in factor[values]
        .chunks_exact(width + rows.len())
        .enumerate()
        .rev()
    {
        let inside = dot(&column[j + 1..width], &x[begin + j + 1..begin + width]);
        x[begin + j] = (x[begin + j] - inside - dot(&column[width..], below)) / column[j];
    }
}

/// Sets of supernodes that share no unknown, and the rest of the supernodes; all ascending.
fn cut(symbolic: &SymbolicSupernodalCholesky<u32>) -> (Vec<Vec<usize>>, Vec<usize>) {
    let count = symbolic.n_supernodes();
    if symbolic.len_val() < SMALL {
        return (Vec::new(), (0..count).collect());
    }
    let mut node_of = vec![0; symbolic.nrows()];
    for s in 0..count {
        node_of[columns(symbolic, s)].fill(s);
    }
    let own: Vec<usize> = (0..count).map(|s| panel(symbolic, s).1.len()).collect();
    let mut work = own.clone();
    let mut children = vec![Vec::new(); count];
    let mut roots = Vec::new();
    for s in 0..count {
        match panel(symbolic, s).0.iter().min() {
            Some(&row) => {
                work[node_of[row as usize]] += work[s];
                children[node_of[row as usize]].push(s);
            }
            None => roots.push(s),
        }
    }
    // the largest subtree loses its root to the top while that stays small
    let (mut top, mut top_work) = (Vec::new(), 0);
    while let Some(at) = (0..roots.len()).max_by_key(|&i| (work[roots[i]], i)) {
        let s = roots[at];
        if work[s] * 2 * PARTS <= symbolic.len_val()
            || (top_work + own[s]) as f64 > TOP * symbolic.len_val() as f64
        {
            break;
        }
        roots.swap_remove(at);
        roots.extend(&children[s]);
        top.push(s);
        top_work += own[s];
    }
    roots.sort_unstable_by_key(|&s| (std::cmp::Reverse(work[s]), s));
    let mut sets = vec![(0, Vec::new()); PARTS];
    for root in roots {
        let Some((load, set)) = sets.iter_mut().min_by_key(|set| set.0) else {
            break;
        };
        *load += work[root];
        let mut open = vec![root];
        while let Some(s) = open.pop() {
            set.push(s);
            open.extend(&children[s]);
        }
    }
    let mut sets: Vec<Vec<usize>> = sets.into_iter().map(|set| set.1).collect();
    for set in &mut sets {
        set.sort_unstable();
    }
    top.sort_unstable();
    (sets, top)
}

/// Inner product in a fixed order, in eight strands so that it can be vectorised.
fn dot<T: Number>(a: &[T], b: &[T]) -> T {
    const STRANDS: usize = 8;
    let mut sums = [T::of(0.0); STRANDS];
    let (whole_a, rest_a) = a.as_chunks::<STRANDS>();
    let (whole_b, rest_b) = b.as_chunks::<STRANDS>();
    for (a, b) in whole_a.iter().zip(whole_b) {
        for k in 0..STRANDS {
            sums[k] += a[k] * b[k];
        }
    }
    let mut sum = T::of(0.0);
    for k in 0..STRANDS / 2 {
        sum += sums[k] + sums[k + STRANDS / 2];
    }
    for (a, b) in rest_a.iter().zip(rest_b) {
        sum += *a * *b;
    }
    sum
}
