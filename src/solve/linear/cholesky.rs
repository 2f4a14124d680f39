//! Sparse Cholesky `P A P^T = L L^T` in either precision.
//!
//! The fill-reducing permutation is approximate minimum degree (Amestoy, Davis and Duff 1996) on
//! the graph of 3x3 blocks, brought into postorder and expanded to the scalars that are unknowns: the same fill as on scalars, several times
//! cheaper, and the scalars of a vertex stay together in a supernode. The supernodes are faer's; [`fronts`](super::fronts) factors into
//! [`tiles`](super::tiles), with which [`substitution`](super::substitution) solves.
//!
//! Permutation, symbolic factor and work memory are a function of the pattern alone and are kept
//! while it stays the same; then a new factor of a small matrix allocates nothing.
//!
//! A matrix is refused as not positive definite when a pivot is not above 64 times the unit
//! roundoff times the diagonal entry it came from (its solution would have no correct digit), and
//! when an entry is not finite.

use super::LinearError;
use super::fronts::{Entry, Fronts, Source};
use super::substitution::{Factor, Substitution};
use super::tiles::{Right, SIDE, Shape, Tiles};
use super::tree::{Tree, columns, panel, place, postorder};
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::sparse::SymbolicSparseColMatRef;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal,
};
use faer::traits::RealField;
use faer::{Mat, Side};
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Range, Sub, SubAssign};
use std::sync::atomic::{AtomicBool, Ordering};

/// Rows of one task that permutes.
const ROWS: usize = 4_096;

/// A precision to factor in.
pub(super) trait Number:
    RealField
    + Copy
    + Send
    + Into<f64>
    + Add<Output = Self>
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Div<Output = Self>
    + AddAssign
    + SubAssign
    + MulAssign
    + Default
{
    /// What a factor keeps of a number.
    type Stored: Copy + Default + Send + Sync;
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// The nearest number.
    fn of(value: f64) -> Self;
    /// What is kept of a number.
    fn stored(self) -> Self::Stored;
    /// What was kept.
    fn loaded(stored: Self::Stored) -> Self;
}

impl Number for f64 {
    type Stored = Self;
    const EPSILON: f64 = Self::EPSILON;
    fn of(value: f64) -> Self {
        value
    }
    #[inline(always)]
    fn stored(self) -> Self {
        self
    }
    #[inline(always)]
    fn loaded(stored: Self) -> Self {
        stored
    }
}

/// Factors in f32 are preconditioners, which are read in every iteration and need be no more than near: of most numbers the upper 16
/// bits are kept, eight of them the mantissa's (bfloat16).
impl Number for f32 {
    type Stored = u16;
    const EPSILON: f64 = Self::EPSILON as f64;
    fn of(value: f64) -> Self {
        value as Self
    }
    #[inline(always)]
    fn stored(self) -> u16 {
        // rounded to even; only a NaN could overflow, which pivots do not let through
        let bits = self.to_bits();
        (bits.wrapping_add(0x7fff + (bits >> 16 & 1)) >> 16) as u16
    }
    #[inline(always)]
    fn loaded(stored: u16) -> Self {
        Self::from_bits(u32::from(stored) << 16)
    }
}

/// What depends on the pattern, and memory of the sizes it asks for.
pub(super) struct Cholesky<T: Number> {
    pattern: BlockPattern,
    /// New place of each block row.
    place: Vec<u32>,
    /// First scalar of each permuted block row, and their number.
    offsets: Vec<u32>,
    /// Row, by scalars of all blocks, of each permuted unknown.
    rows: Vec<u32>,
    /// Blocks of the permuted lower triangle, column by column.
    entries: Vec<Entry>,
    /// Start of each permuted block column in `entries`.
    starts: Vec<u32>,
    symbolic: SymbolicCholesky<u32>,
    tree: Tree,
    fronts: Fronts<T>,
    tiles: Tiles<T>,
    rhs: Vec<T>,
    substitution: Substitution<T>,
}

impl<T: Number> Cholesky<T> {
    /// The analysis kept in `slot`, made anew where the pattern has changed.
    pub(super) fn for_pattern<'a>(
        slot: &'a mut Option<Self>,
        pattern: &BlockPattern,
    ) -> Result<&'a mut Self, LinearError> {
        if slot.as_ref().is_none_or(|c| c.pattern != *pattern) {
            // the old memory goes before the new is taken
            let tiles = slot.take().map(|old| old.tiles);
            *slot = Some(Self::new(pattern, tiles.unwrap_or_default())?);
        }
        slot.as_mut().ok_or(LinearError::NoConvergence)
    }

    /// Analysis of a pattern, in the memory of older tiles.
    fn new(pattern: &BlockPattern, old: Tiles<T>) -> Result<Self, LinearError> {
        let n = pattern.n();
        // faer counts with the same 32 bits and refuses a factor that has more numbers
        if 9 * pattern.rows.len() > u32::MAX as usize {
            return Err(LinearError::NoConvergence);
        }
        let mut place = minimum_degree(pattern)?;
        postorder(pattern, &mut place);
        let mut offsets = vec![0; n + 1];
        for (j, p) in (0..).zip(&place) {
            offsets[*p as usize + 1] = u32::from(pattern.width(j));
        }
        for p in 0..n {
            offsets[p + 1] += offsets[p];
        }
        let mut rows = vec![0; offsets[n] as usize];
        for (j, p) in (0..).zip(&place) {
            for (row, to) in (3 * j..).zip(&mut rows[scalars(&offsets, *p)]) {
                *to = row;
            }
        }

        // Permuted block columns of the lower triangle, each sorted by rows; at first with the rows themselves.
        let mut starts = vec![0_u32; n + 1];
        let each = |visit: &mut dyn FnMut(u32, Entry)| {
            for j in 0..n {
                for k in pattern.starts[j]..pattern.starts[j + 1] {
                    let i = pattern.rows[k as usize];
                    let (p, q) = (place[i as usize], place[j]);
                    let transposed = p < q;
                    let entry = Entry {
                        slot: k,
                        row: p.max(q),
                        height: pattern.width(if transposed { j as u32 } else { i }),
                        transposed,
                    };
                    visit(p.min(q), entry);
                }
            }
        };
        each(&mut |column, _| starts[column as usize + 1] += 1);
        for j in 0..n {
            starts[j + 1] += starts[j];
        }
        let mut next = starts.clone();
        let empty = Entry {
            slot: 0,
            row: 0,
            height: 0,
            transposed: false,
        };
        let mut entries = vec![empty; pattern.rows.len()];
        each(&mut |column, entry| {
            entries[next[column as usize] as usize] = entry;
            next[column as usize] += 1;
        });
        for j in 0..n {
            entries[starts[j] as usize..starts[j + 1] as usize].sort_unstable_by_key(|e| e.row);
        }

        let count = offsets[n] as usize;
        let symbolic = {
            let (column_starts, rows) = scalar_upper(&offsets, &starts, &entries);
            let upper =
                SymbolicSparseColMatRef::new_checked(count, count, &column_starts, None, &rows);
            let params = CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            };
            factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
                .map_err(|_| LinearError::NoConvergence)?
        };
        let (mut tree, mut fronts, mut substitution) = Default::default();
        let mut tiles = Tiles::default();
        // faer has no supernodes of an empty matrix
        if count > 0 {
            let nodes = supernodal(&symbolic)?;
            place_in_fronts(nodes, &offsets, &starts, &mut entries);
            tree = Tree::new(nodes)?;
            fronts = Fronts::new(nodes, &tree);
            let shapes = (0..nodes.n_supernodes()).map(|s| Shape {
                width: columns(nodes, s).len(),
                below: panel(nodes, s).0.len(),
            });
            tiles = old.reshaped(shapes.collect())?;
            substitution = Substitution::new(nodes, &tree, &tiles);
        }
        Ok(Self {
            pattern: pattern.clone(),
            place,
            offsets,
            rows,
            entries,
            starts,
            tiles,
            rhs: vec![T::of(0.0); count],
            fronts,
            substitution,
            tree,
            symbolic,
        })
    }

    /// Factors a matrix of the pattern.
    pub(super) fn prepare(
        &mut self,
        matrix: &BlockMatrix,
        workers: &Workers,
    ) -> Result<(), LinearError> {
        self.prepare_blocks(|slot| matrix.blocks[slot], workers)
    }

    /// The same with the blocks of the pattern by their slots.
    pub(super) fn prepare_blocks(
        &mut self,
        block: impl Fn(usize) -> Mat3 + Sync,
        workers: &Workers,
    ) -> Result<(), LinearError> {
        if self.place.is_empty() {
            return Ok(());
        }
        let source = Source {
            symbolic: supernodal(&self.symbolic)?,
            tree: &self.tree,
            block,
            offsets: &self.offsets,
            starts: &self.starts,
            entries: &self.entries,
        };
        self.fronts.factorize(&source, &mut self.tiles, workers)
    }

    /// Solves with the factor.
    pub(super) fn solve(
        &mut self,
        b: &[Vec3],
        x: &mut [Vec3],
        workers: &Workers,
    ) -> Result<(), LinearError> {
        if b.is_empty() {
            return Ok(());
        }
        let (rows, offsets, place) = (&self.rows, &self.offsets, &self.place);
        workers.chunks(&mut self.rhs, ROWS, |c, rhs| {
            for (x, row) in rhs.iter_mut().zip(&rows[c * ROWS..]) {
                *x = T::of(b[*row as usize / 3][*row as usize % 3]);
            }
        });
        let factor = Factor {
            symbolic: supernodal(&self.symbolic)?,
            tiles: &self.tiles,
        };
        self.substitution.solve(factor, &mut self.rhs, workers);
        let (rhs, finite) = (&self.rhs, AtomicBool::new(true));
        workers.chunks(x, ROWS, |c, x| {
            for (i, x) in (c * ROWS..).zip(x) {
                // what is no unknown has the row of the identity
                *x = b[i];
                for (x, solved) in x.iter_mut().zip(&rhs[scalars(offsets, place[i])]) {
                    *x = (*solved).into();
                }
                if !x.iter().all(|v| v.is_finite()) {
                    finite.store(false, Ordering::Relaxed);
                }
            }
        });
        if !finite.into_inner() {
            return Err(LinearError::NoConvergence);
        }
        Ok(())
    }

    /// Stored numbers of the factor, zeros that fill tiles up included.
    pub(super) fn factor_length(&self) -> usize {
        self.tiles.len()
    }

    /// Block rows.
    pub(super) fn n(&self) -> usize {
        self.place.len()
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let indices = self.place.len() + self.offsets.len() + self.rows.len() + self.starts.len();
        let symbolic = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(s) => s.row_idx().len() + 4 * s.n_supernodes(),
            SymbolicCholeskyRaw::Simplicial(s) => s.row_idx().len() + s.nrows(),
        };
        let pattern = self.pattern.rows.len() + self.pattern.starts.len();
        size_of::<T>() * self.rhs.len()
            + self.tiles.bytes()
            + 4 * (indices + symbolic + pattern)
            + size_of::<Entry>() * self.entries.len()
            + self.tree.bytes()
            + self.fronts.bytes()
            + self.substitution.bytes()
    }
}

impl Cholesky<f64> {
    /// The factor, for [`Self::solve_columns`]; none of an empty matrix.
    pub(super) fn factor(&self) -> Result<Option<Factor<'_, f64>>, LinearError> {
        if self.place.is_empty() {
            return Ok(None);
        }
        Ok(Some(Factor {
            symbolic: supernodal(&self.symbolic)?,
            tiles: &self.tiles,
        }))
    }

    /// Solves with the factor for sparse right-hand sides of `(scalar row, value)`, in columns; on this thread.
    pub(super) fn solve_columns(
        &self,
        factor: Option<Factor<'_, f64>>,
        right: &[Vec<(u32, f64)>],
    ) -> Mat<f64> {
        let mut out = Mat::zeros(3 * self.place.len(), right.len());
        let Some(factor) = factor else {
            return out;
        };
        let place = |i: usize| scalars(&self.offsets, self.place[i / 3]).nth(i % 3);
        let mut permuted: Vec<Right<f64>> = vec![[0.0; SIDE]; self.rhs.len()];
        for (g, group) in right.chunks(SIDE).enumerate() {
            permuted.fill([0.0; SIDE]);
            for (k, column) in group.iter().enumerate() {
                for (i, value) in column {
                    match place(*i as usize) {
                        Some(i) => permuted[i][k] = *value,
                        None => out[(*i as usize, SIDE * g + k)] = *value,
                    }
                }
            }
            factor.solve_all(&mut permuted);
            for i in 0..out.nrows() {
                if let Some(place) = place(i) {
                    for k in 0..group.len() {
                        out[(i, SIDE * g + k)] = permuted[place][k];
                    }
                }
            }
        }
        out
    }
}

/// Replaces the block rows of sorted entries by their places in the fronts of their columns.
fn place_in_fronts(
    symbolic: &supernodal::SymbolicSupernodalCholesky<u32>,
    offsets: &[u32],
    starts: &[u32],
    entries: &mut [Entry],
) {
    let mut column = 0;
    for s in 0..symbolic.n_supernodes() {
        let (inside, below) = (columns(symbolic, s), panel(symbolic, s).0);
        while column + 1 < offsets.len() && (offsets[column] as usize) < inside.end {
            let mut at = 0;
            for entry in &mut entries[starts[column] as usize..starts[column + 1] as usize] {
                entry.row = place(offsets[entry.row as usize], &inside, below, &mut at);
            }
            column += 1;
        }
    }
}

/// The supernodal analysis, the only kind that is asked for.
pub(super) fn supernodal(
    symbolic: &SymbolicCholesky<u32>,
) -> Result<&supernodal::SymbolicSupernodalCholesky<u32>, LinearError> {
    match symbolic.raw() {
        SymbolicCholeskyRaw::Supernodal(symbolic) => Ok(symbolic),
        SymbolicCholeskyRaw::Simplicial(_) => Err(LinearError::NoConvergence),
    }
}

/// New place of each block row under approximate minimum degree.
fn minimum_degree(pattern: &BlockPattern) -> Result<Vec<u32>, LinearError> {
    let n = pattern.n();
    let graph = SymbolicSparseColMatRef::new_checked(n, n, &pattern.starts, None, &pattern.rows);
    let mut old = vec![0_u32; n];
    let mut place = vec![0_u32; n];
    let mut memory = MemBuffer::try_new(amd::order_scratch::<u32>(n, pattern.rows.len()))
        .map_err(|_| LinearError::NoConvergence)?;
    amd::order(
        &mut old,
        &mut place,
        graph,
        amd::Control::default(),
        MemStack::new(&mut memory),
    )
    .map_err(|_| LinearError::NoConvergence)?;
    Ok(place)
}

/// Scalars of a permuted block row.
fn scalars(offsets: &[u32], p: u32) -> Range<usize> {
    offsets[p as usize] as usize..offsets[p as usize + 1] as usize
}

/// Scalar columns of the upper triangle (what the symbolic analysis reads) from the entries of the block columns of the lower one.
fn scalar_upper(offsets: &[u32], starts: &[u32], entries: &[Entry]) -> (Vec<u32>, Vec<u32>) {
    // the columns of the lower triangle come in order, so each column of the upper one fills in the order of its rows
    let n = starts.len() - 1;
    let mut counts = vec![0_usize; n + 1];
    for entry in entries {
        counts[entry.row as usize + 1] += 1;
    }
    for j in 0..n {
        counts[j + 1] += counts[j];
    }
    let mut block_rows = vec![0; entries.len()];
    let mut next = counts.clone();
    for (column, ends) in (0..).zip(starts.windows(2)) {
        for entry in &entries[ends[0] as usize..ends[1] as usize] {
            block_rows[next[entry.row as usize]] = column;
            next[entry.row as usize] += 1;
        }
    }
    let mut column_starts = Vec::with_capacity(offsets[n] as usize + 1);
    let mut rows = Vec::with_capacity(9 * entries.len());
    column_starts.push(0);
    for j in 0..n {
        for column in offsets[j]..offsets[j + 1] {
            for &i in &block_rows[counts[j]..counts[j + 1]] {
                rows.extend(offsets[i as usize]..offsets[i as usize + 1].min(column + 1));
            }
            column_starts.push(rows.len() as u32);
        }
    }
    (column_starts, rows)
}
