//! Sparse Cholesky `P A P^T = L L^T` (faer's supernodal factorization, one thread) in either
//! precision.
//!
//! The fill-reducing permutation is approximate minimum degree (Amestoy, Davis and Duff 1996) on
//! the graph of 3x3 blocks, expanded to scalars: the same fill as on scalars, several times
//! cheaper, and the three scalars of a vertex stay together in a supernode. Values are permuted
//! while they are copied from blocks into the lower triangle by scalar columns, so that faer
//! factors them in place under the identity ordering.
//!
//! Permutation, symbolic factor and work memory are a function of the pattern alone and are kept
//! while it stays the same; then a new factor allocates nothing.
//!
//! A matrix is refused as not positive definite when a pivot is not above 64 times the unit
//! roundoff times the diagonal entry it came from (its solution would have no correct digit), and
//! when an entry is not finite.

use super::LinearError;
use super::substitution::Substitution;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::traits::RealField;
use faer::{Conj, Mat, Par, Side};
use std::ops::{Add, AddAssign, Div, Mul, Sub, SubAssign};

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
{
    /// Distance from 1 to the next number.
    const EPSILON: f64;
    /// The nearest number.
    fn of(value: f64) -> Self;
}

impl Number for f64 {
    const EPSILON: f64 = f64::EPSILON;
    fn of(value: f64) -> Self {
        value
    }
}

impl Number for f32 {
    const EPSILON: f64 = f32::EPSILON as f64;
    fn of(value: f64) -> Self {
        value as f32
    }
}

/// What depends on the pattern, and memory of the sizes it asks for.
pub(super) struct Cholesky<T> {
    pattern: BlockPattern,
    /// New place of each block row.
    place: Vec<u32>,
    /// `2 * slot + transposed` of the blocks of the permuted lower triangle, column by column.
    source: Vec<u32>,
    /// Start of each permuted block column in `source`.
    starts: Vec<u32>,
    lower: SymbolicSparseColMat<u32>,
    symbolic: SymbolicCholesky<u32>,
    values: Vec<T>,
    factor: Vec<T>,
    rhs: Vec<T>,
    substitution: Substitution<T>,
    factor_memory: MemBuffer,
    work_bytes: usize,
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
        let place = minimum_degree(pattern)?;

        // Permuted block columns of the lower triangle: (column, row, source), sorted.
        let mut entries = Vec::with_capacity(pattern.rows.len());
        for j in 0..n {
            for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                let (p, q) = (place[pattern.rows[k] as usize], place[j]);
                let transposed = p < q;
                entries.push((p.min(q), p.max(q), 2 * k as u32 + u32::from(transposed)));
            }
        }
        entries.sort_unstable();
        let mut starts = vec![0_u32; n + 1];
        for &(column, _, _) in &entries {
            starts[column as usize + 1] += 1;
        }
        for j in 0..n {
            starts[j + 1] += starts[j];
        }

        let lower = scalar_lower(n, &starts, &entries);
        let symbolic = {
            let (column_starts, rows) = scalar_upper(n, &entries);
            let upper =
                SymbolicSparseColMatRef::new_checked(3 * n, 3 * n, &column_starts, None, &rows);
            let params = CholeskySymbolicParams {
                supernodal_flop_ratio_threshold: SupernodalThreshold::FORCE_SUPERNODAL,
                ..Default::default()
            };
            factorize_symbolic_cholesky(upper, Side::Upper, SymmetricOrdering::Identity, params)
                .map_err(|_| LinearError::NoConvergence)?
        };
        let factor_need = symbolic.factorize_numeric_llt_scratch::<T>(Par::Seq, Default::default());
        Ok(Self {
            pattern: pattern.clone(),
            place,
            source: entries.iter().map(|e| e.2).collect(),
            starts,
            values: vec![T::of(0.0); lower.row_idx().len()],
            factor: vec![T::of(0.0); symbolic.len_val()],
            rhs: vec![T::of(0.0); 3 * n],
            substitution: Substitution::new(&symbolic)?,
            factor_memory: MemBuffer::try_new(factor_need)
                .map_err(|_| LinearError::NoConvergence)?,
            work_bytes: factor_need.unaligned_bytes_required(),
            lower,
            symbolic,
        })
    }

    /// Factors a matrix of the pattern.
    pub(super) fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.prepare_blocks(|slot| matrix.blocks[slot])
    }

    /// The same with the blocks of the pattern by their slots.
    pub(super) fn prepare_blocks(
        &mut self,
        block: impl Fn(usize) -> Mat3,
    ) -> Result<(), LinearError> {
        self.load(block)?;
        self.factorize()
    }

    /// Copies the blocks into permuted scalar columns; refuses what is not finite.
    fn load(&mut self, block: impl Fn(usize) -> Mat3) -> Result<(), LinearError> {
        let mut poison = 0.0;
        let mut at = 0;
        for j in 0..self.place.len() {
            let blocks = &self.source[self.starts[j] as usize..self.starts[j + 1] as usize];
            for c in 0..3 {
                for (k, &source) in blocks.iter().enumerate() {
                    let block = block(source as usize >> 1);
                    // The diagonal block comes first in its column and gives its lower part.
                    for r in if k == 0 { c } else { 0 }..3 {
                        let value = if source & 1 == 1 {
                            block[(c, r)]
                        } else {
                            block[(r, c)]
                        };
                        poison += value * 0.0;
                        self.values[at] = T::of(value);
                        at += 1;
                    }
                }
            }
        }
        if poison.is_nan() {
            return Err(LinearError::NotPositiveDefinite);
        }
        Ok(())
    }

    fn factorize(&mut self) -> Result<(), LinearError> {
        if self.place.is_empty() {
            return Ok(());
        }
        self.symbolic
            .factorize_numeric_llt(
                &mut self.factor,
                SparseColMatRef::new(self.lower.as_ref(), &self.values),
                Side::Lower,
                LltRegularization::default(),
                Par::Seq,
                MemStack::new(&mut self.factor_memory),
                Default::default(),
            )
            .map_err(|_| LinearError::NotPositiveDefinite)?;
        self.check_pivots()
    }

    /// Compares every pivot with the diagonal entry that it was reduced from.
    fn check_pivots(&self) -> Result<(), LinearError> {
        let symbolic = supernodal(&self.symbolic)?;
        let factor = supernodal::SupernodalLltRef::new(symbolic, &self.factor);
        let columns = self.lower.col_ptr();
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let block = node.val();
            for c in 0..block.ncols() {
                let root: f64 = block[(c, c)].into();
                let diagonal: f64 = self.values[columns[node.start() + c] as usize].into();
                let pivot = root * root;
                if pivot.is_nan() || pivot <= 64.0 * T::EPSILON * diagonal {
                    return Err(LinearError::NotPositiveDefinite);
                }
            }
        }
        Ok(())
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
            for c in 0..3 {
                self.rhs[3 * p as usize + c] = T::of(b[c]);
            }
        }
        self.substitution.solve(
            supernodal(&self.symbolic)?,
            &self.factor,
            &mut self.rhs,
            workers,
        );
        for (x, &p) in x.iter_mut().zip(&self.place) {
            *x = Vec3::from_fn(|c, _| self.rhs[3 * p as usize + c].into());
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
        let n = 3 * self.place.len();
        let mut permuted = Mat::<T>::zeros(n, right.len());
        let place = |i: usize| 3 * self.place[i / 3] as usize + i % 3;
        for (k, column) in right.iter().enumerate() {
            for (i, value) in column {
                permuted[(place(*i as usize), k)] = T::of(*value);
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
        Mat::from_fn(n, right.len(), |i, k| permuted[(place(i), k)].into())
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
        let numbers = self.values.len() + self.factor.len() + self.rhs.len();
        let indices = self.place.len()
            + self.source.len()
            + self.starts.len()
            + self.lower.row_idx().len()
            + self.lower.col_ptr().len();
        let symbolic = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(s) => s.row_idx().len() + 4 * s.n_supernodes(),
            SymbolicCholeskyRaw::Simplicial(s) => s.row_idx().len() + s.nrows(),
        };
        size_of::<T>() * numbers
            + 4 * (indices + symbolic + self.pattern.rows.len() + self.pattern.starts.len())
            + self.work_bytes
            + self.substitution.bytes()
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

/// Scalar columns of the lower triangle from sorted block entries `(column, row, _)`.
fn scalar_lower(
    n: usize,
    starts: &[u32],
    entries: &[(u32, u32, u32)],
) -> SymbolicSparseColMat<u32> {
    let mut column_starts = Vec::with_capacity(3 * n + 1);
    let mut rows = Vec::with_capacity(9 * entries.len());
    column_starts.push(0);
    for j in 0..n {
        for c in 0..3 {
            for &(column, row, _) in &entries[starts[j] as usize..starts[j + 1] as usize] {
                let first = if row == column { c } else { 0 };
                rows.extend((first..3).map(|r| 3 * row + r));
            }
            column_starts.push(rows.len() as u32);
        }
    }
    rows.shrink_to_fit();
    SymbolicSparseColMat::new_checked(3 * n, 3 * n, column_starts, None, rows)
}

/// Scalar columns of the upper triangle (what the symbolic analysis reads) from the same entries.
fn scalar_upper(n: usize, entries: &[(u32, u32, u32)]) -> (Vec<u32>, Vec<u32>) {
    // Sorted by (column, row) of the lower triangle, so each upper column fills in row order.
    let mut counts = vec![0_usize; n + 1];
    for &(_, row, _) in entries {
        counts[row as usize + 1] += 1;
    }
    for j in 0..n {
        counts[j + 1] += counts[j];
    }
    let mut block_rows = vec![0; entries.len()];
    let mut next = counts.clone();
    for &(column, row, _) in entries {
        block_rows[next[row as usize]] = column;
        next[row as usize] += 1;
    }
    let mut column_starts = Vec::with_capacity(3 * n + 1);
    let mut rows = Vec::with_capacity(9 * entries.len());
    column_starts.push(0);
    for j in 0..n {
        for c in 0..3 {
            for &i in &block_rows[counts[j]..counts[j + 1]] {
                let last = if i as usize == j { c } else { 2 };
                rows.extend((0..=last).map(|r| 3 * i + r));
            }
            column_starts.push(rows.len() as u32);
        }
    }
    (column_starts, rows)
}
