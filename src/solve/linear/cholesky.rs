//! Sparse Cholesky `P A P^T = L L^T` in either precision.
//!
//! The fill-reducing permutation is approximate minimum degree (Amestoy, Davis and Duff 1996) on
//! the graph of 3x3 blocks, brought into postorder and expanded to the scalars that are unknowns: the same fill as on scalars, several times
//! cheaper, and the scalars of a vertex stay together in a supernode. The supernodes are faer's; [`fronts`](super::fronts) factors and
//! [`substitution`](super::substitution) solves.
//!
//! Permutation, symbolic factor and work memory are a function of the pattern alone and are kept
//! while it stays the same; then a new factor of a small matrix allocates nothing.
//!
//! A matrix is refused as not positive definite when a pivot is not above 64 times the unit
//! roundoff times the diagonal entry it came from (its solution would have no correct digit), and
//! when an entry is not finite.

use super::LinearError;
use super::fronts::{Entry, Fronts, Source};
use super::substitution::Substitution;
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
use faer::{Conj, Mat, Par, Side};
use pulp::Simd;
use std::ops::{Add, AddAssign, Div, Mul, MulAssign, Range, Sub, SubAssign};

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
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// The nearest number.
    fn of(value: f64) -> Self;
    /// Inner products of columns with `x`, all of one length.
    fn dots<S: Simd, const K: usize>(simd: S, columns: [&[Self]; K], x: &[Self]) -> [Self; K];
}

macro_rules! number {
    ($number:ty, $split:ident, $splat:ident, $fused:ident, $add:ident, $sum:ident) => {
        impl Number for $number {
            const EPSILON: f64 = <$number>::EPSILON as f64;
            fn of(value: f64) -> Self {
                value as $number
            }
            #[inline(always)]
            fn dots<S: Simd, const K: usize>(
                simd: S,
                columns: [&[Self]; K],
                x: &[Self],
            ) -> [Self; K] {
                let (x, rest) = S::$split(x);
                let (pairs, last) = x.as_chunks::<2>();
                // closures would not be compiled for the instructions of `simd`
                let mut parts = [S::$split(columns[0]); K];
                let mut whole = [&parts[0].0.as_chunks::<2>().0[..pairs.len()]; K];
                for k in 0..K {
                    parts[k] = S::$split(columns[k]);
                    whole[k] = &parts[k].0.as_chunks::<2>().0[..pairs.len()];
                }
                // two strands for each column: a sum waits for the one before
                let mut sums = [[simd.$splat(0.0); 2]; K];
                for (i, x) in pairs.iter().enumerate() {
                    for k in 0..K {
                        let column = &whole[k][i];
                        sums[k] = [
                            simd.$fused(column[0], x[0], sums[k][0]),
                            simd.$fused(column[1], x[1], sums[k][1]),
                        ];
                    }
                }
                if let [x] = last {
                    for k in 0..K {
                        sums[k][0] = simd.$fused(parts[k].0[2 * pairs.len()], *x, sums[k][0]);
                    }
                }
                let mut out = [0.0; K];
                for k in 0..K {
                    out[k] = simd.$sum(simd.$add(sums[k][0], sums[k][1]));
                }
                for (i, x) in rest.iter().enumerate() {
                    for k in 0..K {
                        out[k] += parts[k].1[i] * x;
                    }
                }
                out
            }
        }
    };
}

number!(
    f64,
    as_simd_f64s,
    splat_f64s,
    mul_add_e_f64s,
    add_f64s,
    reduce_sum_f64s
);
number!(
    f32,
    as_simd_f32s,
    splat_f32s,
    mul_add_e_f32s,
    add_f32s,
    reduce_sum_f32s
);

/// What depends on the pattern, and memory of the sizes it asks for.
pub(super) struct Cholesky<T> {
    pattern: BlockPattern,
    /// New place of each block row.
    place: Vec<u32>,
    /// First scalar of each permuted block row, and their number.
    offsets: Vec<u32>,
    /// Blocks of the permuted lower triangle, column by column.
    entries: Vec<Entry>,
    /// Start of each permuted block column in `entries`.
    starts: Vec<u32>,
    symbolic: SymbolicCholesky<u32>,
    tree: Tree,
    fronts: Fronts<T>,
    factor: Vec<T>,
    rhs: Vec<T>,
    substitution: Substitution<T>,
}

impl<T: Number> Cholesky<T> {
    /// The analysis kept in `slot`, made anew where the pattern has changed.
    pub(super) fn for_pattern<'a>(
        slot: &'a mut Option<Self>,
        pattern: &BlockPattern,
    ) -> Result<&'a mut Self, LinearError> {
        // the old memory goes before the new is taken
        if slot.as_ref().is_some_and(|c| c.pattern != *pattern) {
            *slot = None;
        }
        if slot.is_none() {
            *slot = Some(Self::new(pattern)?);
        }
        slot.as_mut().ok_or(LinearError::NoConvergence)
    }

    /// Analysis of a pattern.
    fn new(pattern: &BlockPattern) -> Result<Self, LinearError> {
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
        // faer has no supernodes of an empty matrix
        if count > 0 {
            let nodes = supernodal(&symbolic)?;
            place_in_fronts(nodes, &offsets, &starts, &mut entries);
            tree = Tree::new(nodes)?;
            fronts = Fronts::new(nodes, &tree);
            substitution = Substitution::new(nodes, &tree);
        }
        Ok(Self {
            pattern: pattern.clone(),
            place,
            offsets,
            entries,
            starts,
            factor: vec![T::of(0.0); symbolic.len_val()],
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
        self.fronts.factorize(&source, &mut self.factor, workers)
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
        for (b, &p) in b.iter().zip(&self.place) {
            for (x, b) in self.rhs[scalars(&self.offsets, p)].iter_mut().zip(b) {
                *x = T::of(*b);
            }
        }
        self.substitution.solve(
            supernodal(&self.symbolic)?,
            &self.factor,
            &mut self.rhs,
            workers,
        );
        for ((x, b), &p) in x.iter_mut().zip(b).zip(&self.place) {
            // what is no unknown has the row of the identity
            *x = *b;
            for (x, solved) in x.iter_mut().zip(&self.rhs[scalars(&self.offsets, p)]) {
                *x = (*solved).into();
            }
            if !x.iter().all(|v| v.is_finite()) {
                return Err(LinearError::NoConvergence);
            }
        }
        Ok(())
    }

    /// Solves with the factor for sparse right-hand sides of `(scalar row, value)`, in columns; on this thread.
    pub(super) fn solve_columns(&self, right: &[Vec<(u32, f64)>]) -> Mat<f64>
    where
        T: RealField,
    {
        let mut permuted = Mat::<T>::zeros(self.rhs.len(), right.len());
        let place = |i: usize| scalars(&self.offsets, self.place[i / 3]).nth(i % 3);
        let mut out = Mat::zeros(3 * self.place.len(), right.len());
        for (k, column) in right.iter().enumerate() {
            for (i, value) in column {
                match place(*i as usize) {
                    Some(i) => permuted[(i, k)] = T::of(*value),
                    None => out[(*i as usize, k)] = *value,
                }
            }
        }
        if let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() {
            let need = symbolic.solve_in_place_scratch::<T>(right.len(), Par::Seq);
            let mut memory = MemBuffer::new(need);
            supernodal::SupernodalLltRef::new(symbolic, &self.factor).solve_in_place_with_conj(
                Conj::No,
                permuted.as_mut(),
                Par::Seq,
                MemStack::new(&mut memory),
            );
        }
        for i in 0..out.nrows() {
            if let Some(place) = place(i) {
                for k in 0..right.len() {
                    out[(i, k)] = permuted[(place, k)].into();
                }
            }
        }
        out
    }

    /// Stored numbers of the factor, padding of supernodes included.
    pub(super) fn factor_length(&self) -> usize {
        self.factor.len()
    }

    /// Block rows.
    pub(super) fn n(&self) -> usize {
        self.place.len()
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let numbers = self.factor.len() + self.rhs.len();
        let indices = self.place.len() + self.offsets.len() + self.starts.len();
        let symbolic = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(s) => s.row_idx().len() + 4 * s.n_supernodes(),
            SymbolicCholeskyRaw::Simplicial(s) => s.row_idx().len() + s.nrows(),
        };
        let pattern = self.pattern.rows.len() + self.pattern.starts.len();
        size_of::<T>() * numbers
            + 4 * (indices + symbolic + pattern)
            + size_of::<Entry>() * self.entries.len()
            + self.tree.bytes()
            + self.fronts.bytes()
            + self.substitution.bytes()
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
