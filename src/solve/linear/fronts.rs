//! The numeric factorization `P A P^T = L L^T` by fronts (Duff and Reid 1983; Liu 1992).
//!
//! The front of a supernode is the dense matrix of its unknowns and of the rows below them. It is assembled from the matrix and
//! from what the children leave to those rows; its unknowns are eliminated, and what is left
//!
//! ```text
//! U = F22 - L21 L21^T
//! ```
//!
//! goes to the parent. Subtrees of the elimination tree are side by side, each with a stack of what is left; above them the
//! columns of the dense matrices are. Sums are in one order for any number of threads.

use super::LinearError;
use super::cholesky::Number;
use super::tiles::{Rest, Tiles};
use super::tree::{Tree, columns, panel, place, rows};
use crate::math::Mat3;
use crate::math::parallel::Workers;
use faer::linalg::matmul::matmul;
use faer::sparse::linalg::cholesky::supernodal::SymbolicSupernodalCholesky;
use faer::{Accum, MatMut, MatRef, Par};
use pulp::{Arch, Simd, WithSimd};
use std::ops::Range;
use std::sync::Mutex;

/// Columns that are eliminated by plain loops before those after them are updated.
const NARROW: usize = 32;
/// Columns of a dense matrix that are one task.
const STRIP: usize = 96;
/// Unknowns and rows below which plain loops are faster than the general product.
const LITTLE: [usize; 2] = [16, 48];

/// A block of the permuted lower triangle in the front of its column.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    /// Slot of the block.
    pub(super) slot: u32,
    /// First row in the front.
    pub(super) row: u32,
    /// Unknown scalars of its row.
    pub(super) height: u8,
    /// Whether the block is the transpose of the one in the slot.
    pub(super) transposed: bool,
}

/// What a factorization reads.
pub(super) struct Source<'a, B> {
    /// The supernodes.
    pub(super) symbolic: &'a SymbolicSupernodalCholesky<u32>,
    /// Their tree.
    pub(super) tree: &'a Tree,
    /// Block of each slot.
    pub(super) block: B,
    /// First scalar of each permuted block row, and their number.
    pub(super) offsets: &'a [u32],
    /// Where the entries of each block column begin.
    pub(super) starts: &'a [u32],
    /// The entries, column by column, the diagonal block first.
    pub(super) entries: &'a [Entry],
}

/// What the fronts of a pattern need.
#[derive(Default)]
pub(super) struct Fronts<T> {
    /// Place in the parent's front of every row below a supernode.
    relative: Vec<u32>,
    /// One of each subtree.
    subtrees: Vec<Subtree<T>>,
    /// What tasks that have ended worked with.
    spare: Mutex<Vec<Memory<T>>>,
}

/// What is known of a subtree.
struct Subtree<T> {
    /// Numbers that its stack takes at most, and those of them that are for what is above.
    most: usize,
    root: usize,
    /// The latter.
    left: Vec<T>,
    done: Result<(), LinearError>,
}

/// What a task works with.
struct Memory<T> {
    /// What the supernodes of a subtree leave to those above, one after the other.
    stack: Vec<T>,
    /// The panel of a front.
    panel: Vec<T>,
    /// Its diagonal before anything is taken from it.
    diagonal: Vec<T>,
}

/// A subtree at work.
struct Task<'a, T: Number> {
    nodes: Range<usize>,
    subtree: &'a mut Subtree<T>,
    kept: Rest<'a, T>,
}

/// A supernode above the subtrees at work.
struct Top<'a, T: Number> {
    s: usize,
    /// What the children leave.
    given: Vec<(usize, Vec<T>)>,
    kept: Rest<'a, T>,
    left: Vec<T>,
    done: Result<(), LinearError>,
}

impl<T: Number> Fronts<T> {
    /// For the supernodes of a pattern.
    pub(super) fn new(symbolic: &SymbolicSupernodalCholesky<u32>, tree: &Tree) -> Self {
        let mut relative = vec![0; symbolic.row_idx().len()];
        for s in 0..symbolic.n_supernodes() {
            if tree.is_root(s) {
                continue;
            }
            let parent = tree.parent[s] as usize;
            let (inside, above) = (columns(symbolic, parent), panel(symbolic, parent).0);
            let mut at = 0;
            let own = symbolic.row_idx()[rows(symbolic, s)].iter();
            for (there, row) in relative[rows(symbolic, s)].iter_mut().zip(own) {
                *there = place(*row, &inside, above, &mut at);
            }
        }
        let left = |s: usize| panel(symbolic, s).0.len().pow(2);
        let subtree = |nodes: &Range<usize>| {
            let (mut now, mut most) = (0_usize, 0);
            for s in nodes.clone() {
                most = most.max(now + left(s));
                now += left(s);
                for child in tree.children(s) {
                    now -= left(child);
                }
            }
            Subtree {
                most,
                root: nodes.clone().last().map_or(0, left),
                left: Vec::new(),
                done: Ok(()),
            }
        };
        Self {
            relative,
            subtrees: tree.subtrees.iter().map(subtree).collect(),
            spare: Mutex::default(),
        }
    }

    /// Factors into the tiles of all supernodes.
    pub(super) fn factorize<B: Fn(usize) -> Mat3 + Sync>(
        &mut self,
        source: &Source<'_, B>,
        tiles: &mut Tiles<T>,
        workers: &Workers,
    ) -> Result<(), LinearError> {
        let tree = source.tree;
        let relative = &self.relative;
        if tree.levels.is_empty()
            && let ([nodes], [subtree]) = (&tree.subtrees[..], &mut self.subtrees[..])
        {
            let mut whole = Task {
                nodes: nodes.clone(),
                subtree,
                kept: tiles.rest(),
            };
            let mut memory = take(&self.spare);
            whole.factorize(source, relative, &mut memory)?;
            give(&self.spare, memory);
            return Ok(());
        }
        let (mut rest, mut at) = (tiles.rest(), 0);
        let mut tasks = Vec::with_capacity(self.subtrees.len());
        for (nodes, subtree) in tree.subtrees.iter().zip(&mut self.subtrees) {
            rest.take(nodes.start - at);
            at = nodes.end;
            tasks.push(Task {
                nodes: nodes.clone(),
                subtree,
                kept: rest.take(nodes.len()),
            });
        }
        let spare = &self.spare;
        workers.chunks(&mut tasks, 1, |_, tasks| {
            for task in tasks {
                let mut memory = take(spare);
                task.subtree.done = task.factorize(source, relative, &mut memory);
                // after a refusal what was left before is still there
                task.subtree.left.clear();
                task.subtree.left.extend_from_slice(&memory.stack);
                give(spare, memory);
            }
        });
        for subtree in &self.subtrees {
            subtree.done?;
        }
        let mut left: Vec<Vec<T>> = Vec::new();
        left.resize_with(tree.parent.len(), Vec::new);
        for (nodes, subtree) in tree.subtrees.iter().zip(&mut self.subtrees) {
            if let Some(root) = nodes.clone().last() {
                left[root] = std::mem::take(&mut subtree.left);
            }
        }
        for level in &tree.levels {
            let (mut rest, mut at) = (tiles.rest(), 0);
            let fronts = level.iter().map(|&s| {
                rest.take(s - at);
                at = s + 1;
                let given: Vec<_> = (tree.children(s))
                    .map(|c| (c, std::mem::take(&mut left[c])))
                    .collect();
                Top {
                    s,
                    given,
                    kept: rest.take(1),
                    left: Vec::new(),
                    done: Ok(()),
                }
            });
            let mut fronts: Vec<Top<'_, T>> = fronts.collect();
            workers.chunks(&mut fronts, 1, |_, fronts| {
                for front in fronts {
                    front.done = front.factorize(source, relative, workers);
                }
            });
            for front in fronts {
                front.done?;
                left[front.s] = front.left;
            }
        }
        Ok(())
    }

    /// Bytes held while it factors on one thread.
    pub(super) fn bytes(&self) -> usize {
        let left: usize = self.subtrees.iter().map(|subtree| subtree.root).sum();
        let most = self.subtrees.iter().map(|subtree| subtree.most).max();
        4 * self.relative.len() + size_of::<T>() * (left + most.unwrap_or(0))
    }
}

/// Memory to work with, of an earlier task if there is any.
fn take<T>(spare: &Mutex<Vec<Memory<T>>>) -> Memory<T> {
    let known = spare.lock().ok().and_then(|mut spare| spare.pop());
    known.unwrap_or(Memory {
        stack: Vec::new(),
        panel: Vec::new(),
        diagonal: Vec::new(),
    })
}

/// Leaves memory to later tasks.
fn give<T>(spare: &Mutex<Vec<Memory<T>>>, memory: Memory<T>) {
    if let Ok(mut spare) = spare.lock() {
        spare.push(memory);
    }
}

impl<T: Number> Top<'_, T> {
    fn factorize<B: Fn(usize) -> Mat3>(
        &mut self,
        source: &Source<'_, B>,
        relative: &[u32],
        workers: &Workers,
    ) -> Result<(), LinearError> {
        let symbolic = source.symbolic;
        let (width, below) = (
            columns(symbolic, self.s).len(),
            panel(symbolic, self.s).0.len(),
        );
        let (mut panel, mut diagonal) = (Vec::new(), Vec::new());
        source.load(self.s, &mut panel, &mut diagonal)?;
        self.left
            .try_reserve_exact(below * below)
            .map_err(|_| LinearError::NoConvergence)?;
        self.left.resize(below * below, T::of(0.0));
        for (child, given) in std::mem::take(&mut self.given) {
            let places = &relative[rows(symbolic, child)];
            assemble(places, &given, (width, below), &mut panel, &mut self.left);
        }
        let front = Front {
            width,
            below,
            workers,
        };
        front.eliminate(&mut panel, &mut self.left, &diagonal)?;
        self.kept.keep(&panel);
        Ok(())
    }
}

impl<T: Number> Task<'_, T> {
    fn factorize<B: Fn(usize) -> Mat3>(
        &mut self,
        source: &Source<'_, B>,
        relative: &[u32],
        memory: &mut Memory<T>,
    ) -> Result<(), LinearError> {
        let Source { symbolic, tree, .. } = source;
        let alone = Workers::default();
        let Memory {
            stack: left,
            panel: own,
            diagonal,
        } = memory;
        left.clear();
        left.try_reserve_exact(self.subtree.most)
            .map_err(|_| LinearError::NoConvergence)?;
        for s in self.nodes.clone() {
            let (width, below) = (columns(symbolic, s).len(), panel(symbolic, s).0.len());
            source.load(s, own, diagonal)?;
            let top = left.len();
            left.resize(top + below * below, T::of(0.0));
            let (given, update) = left.split_at_mut(top);
            let mut begin = top;
            for child in tree.children(s) {
                let places = &relative[rows(symbolic, child)];
                let end = begin;
                begin -= places.len().pow(2);
                assemble(places, &given[begin..end], (width, below), own, update);
            }
            let front = Front {
                width,
                below,
                workers: &alone,
            };
            front.eliminate(own, update, diagonal)?;
            self.kept.keep(own);
            left.copy_within(top.., begin);
            left.truncate(begin + below * below);
        }
        Ok(())
    }
}

impl<B: Fn(usize) -> Mat3> Source<'_, B> {
    /// The columns of a supernode as a panel, and their diagonal; refuses what is not finite.
    fn load<T: Number>(
        &self,
        s: usize,
        values: &mut Vec<T>,
        diagonal: &mut Vec<T>,
    ) -> Result<(), LinearError> {
        let inside = columns(self.symbolic, s);
        let height = inside.len() + panel(self.symbolic, s).0.len();
        values.clear();
        values.resize(inside.len() * height, T::of(0.0));
        diagonal.clear();
        let mut poison = 0.0;
        let first = self
            .offsets
            .partition_point(|o| (*o as usize) < inside.start);
        for q in first.. {
            let begin = self.offsets[q] as usize;
            if begin >= inside.end {
                break;
            }
            let width = self.offsets[q + 1] as usize - begin;
            let column = begin - inside.start;
            for entry in &self.entries[self.starts[q] as usize..self.starts[q + 1] as usize] {
                let block = (self.block)(entry.slot as usize);
                for c in 0..width {
                    let to = &mut values[(column + c) * height + entry.row as usize..];
                    for (r, to) in to[..usize::from(entry.height)].iter_mut().enumerate() {
                        let value = if entry.transposed {
                            block[(c, r)]
                        } else {
                            block[(r, c)]
                        };
                        poison += value * 0.0;
                        *to = T::of(value);
                    }
                }
            }
            for c in column..column + width {
                diagonal.push(values[c * height + c]);
            }
        }
        if poison.is_nan() {
            return Err(LinearError::NotPositiveDefinite);
        }
        Ok(())
    }
}

/// Adds what a child left to the front of its parent, which has `width` unknowns and `below` rows; `places` ascend.
fn assemble<T: Number>(
    places: &[u32],
    given: &[T],
    (width, below): (usize, usize),
    values: &mut [T],
    update: &mut [T],
) {
    if places.is_empty() {
        return;
    }
    let height = width + below;
    for (j, (place, given)) in places
        .iter()
        .zip(given.chunks_exact(places.len()))
        .enumerate()
    {
        let column = *place as usize;
        let (to, skipped) = match column.checked_sub(width) {
            None => (&mut values[column * height..][..height], 0),
            Some(column) => (&mut update[column * below..][..below], width),
        };
        for (place, given) in places[j..].iter().zip(&given[j..]) {
            to[*place as usize - skipped] += *given;
        }
    }
}

/// The shape of a front.
struct Front<'a> {
    width: usize,
    below: usize,
    workers: &'a Workers,
}

impl Front<'_> {
    /// Eliminates the unknowns: the panel becomes that of the factor, and what it takes from the rows below is taken from `update`. Only
    /// lower triangles have meaning.
    fn eliminate<T: Number>(
        &self,
        values: &mut [T],
        update: &mut [T],
        diagonal: &[T],
    ) -> Result<(), LinearError> {
        let height = self.width + self.below;
        for begin in (0..self.width).step_by(NARROW) {
            let end = (begin + NARROW).min(self.width);
            let (done, after) = values.split_at_mut(end * height);
            let narrow = Narrow {
                columns: &mut done[begin * height..],
                height,
                first: begin,
                diagonal: &diagonal[begin..end],
            };
            if !Arch::new().dispatch(narrow) {
                return Err(LinearError::NotPositiveDefinite);
            }
            let columns = &done[begin * height..];
            self.workers.chunks(after, STRIP * height, |c, strip| {
                subtract(columns, height, end + c * STRIP, strip, height, 0);
            });
        }
        if self.below > 0 {
            self.workers.chunks(update, STRIP * self.below, |c, strip| {
                subtract(
                    values,
                    height,
                    self.width + c * STRIP,
                    strip,
                    self.below,
                    self.width,
                );
            });
        }
        Ok(())
    }
}

/// `S -= L L_j^T` in the columns of a strip, of which the first has its diagonal in row `first` of the columns `L`, whose row `skipped`
/// is the strip's row 0.
fn subtract<T: Number>(
    columns: &[T],
    height: usize,
    first: usize,
    strip: &mut [T],
    strip_height: usize,
    skipped: usize,
) {
    let (count, width) = (columns.len() / height, strip.len() / strip_height);
    if count < LITTLE[0] || strip_height < LITTLE[1] {
        return Arch::new().dispatch(Subtract {
            columns,
            height,
            first,
            strip,
            strip_height,
            skipped,
        });
    }
    let l = MatRef::from_column_major_slice_with_stride(columns, height, count, height)
        .subrows(first, height - first);
    let right = l.subrows(0, width).transpose();
    let to =
        MatMut::from_column_major_slice_with_stride_mut(strip, strip_height, width, strip_height);
    let to = to.subrows_mut(first - skipped, height - first);
    matmul(to, Accum::Add, l, right, T::of(-1.0), Par::Seq);
}

/// [`subtract`] by plain loops.
struct Subtract<'a, T> {
    columns: &'a [T],
    height: usize,
    first: usize,
    strip: &'a mut [T],
    strip_height: usize,
    skipped: usize,
}

impl<T: Number> WithSimd for Subtract<'_, T> {
    type Output = ();

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) {
        let strips = self.strip.chunks_exact_mut(self.strip_height);
        for (row, to) in (self.first..).zip(strips) {
            let to = &mut to[row - self.skipped..];
            let mut quads = self.columns.chunks_exact(4 * self.height);
            for four in &mut quads {
                let [a, b, c, d]: [&[T]; 4] = std::array::from_fn(|k| {
                    &four[k * self.height + row..(k + 1) * self.height][..to.len()]
                });
                let [p, q, r, s] = [a[0], b[0], c[0], d[0]];
                for ((((to, a), b), c), d) in to.iter_mut().zip(a).zip(b).zip(c).zip(d) {
                    *to -= (*a * p + *b * q) + (*c * r + *d * s);
                }
            }
            for column in quads.remainder().chunks_exact(self.height) {
                let column = &column[row..];
                let p = column[0];
                for (to, a) in to.iter_mut().zip(column) {
                    *to -= *a * p;
                }
            }
        }
    }
}

/// Columns of a panel from unknown `first` on, which are eliminated one by one; whether all pivots are positive.
///
/// A pivot has to be above 64 times the unit roundoff times the diagonal entry that it came from.
struct Narrow<'a, T> {
    columns: &'a mut [T],
    height: usize,
    first: usize,
    diagonal: &'a [T],
}

impl<T: Number> WithSimd for Narrow<'_, T> {
    type Output = bool;

    #[inline(always)]
    fn with_simd<S: Simd>(self, _: S) -> bool {
        let height = self.height;
        for (k, diagonal) in self.diagonal.iter().enumerate() {
            let row = self.first + k;
            let (done, after) = self.columns.split_at_mut((k + 1) * height);
            let column = &mut done[k * height + row..];
            let pivot: f64 = column[0].into();
            let least: f64 = (*diagonal).into();
            if pivot.is_nan() || pivot <= 64.0 * T::EPSILON * least {
                return false;
            }
            let inverse = T::of(1.0 / pivot.sqrt());
            column[0] = T::of(pivot.sqrt());
            for value in &mut column[1..] {
                *value *= inverse;
            }
            let column = &column[1..];
            for (j, to) in after.chunks_exact_mut(height).enumerate() {
                let to = &mut to[row + 1 + j..];
                let column = &column[j..][..to.len()];
                let p = column[0];
                for (to, value) in to.iter_mut().zip(column) {
                    *to -= *value * p;
                }
            }
        }
        true
    }
}
