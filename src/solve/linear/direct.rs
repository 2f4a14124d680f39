//! Sparse Cholesky `P A P^T = L L^T` (faer's supernodal factorization, f64, one thread).
//!
//! The fill-reducing permutation is approximate minimum degree (Amestoy, Davis and Duff 1996) on
//! the graph of 3x3 blocks, expanded to scalars: the same fill as on scalars, several times
//! cheaper, and the three scalars of a vertex stay together in a supernode. Values are permuted
//! while they are copied from blocks into the lower triangle by scalar columns, so that faer
//! factors them in place under the identity ordering.
//!
//! Permutation, symbolic factor and work memory are a function of the pattern alone and are kept
//! while it stays the same; then `prepare` and `solve` allocate nothing.
//!
//! Limits: a matrix is refused as not positive definite when a pivot is not above
//! `64 eps` times the diagonal entry it came from (its solution would have no correct digit), and
//! when an entry is not finite. The accuracy is that of backward stable Cholesky, so the tolerance
//! handed to `solve` is not looked at.

use super::{LinearError, LinearSolver};
use crate::math::Vec3;
use crate::math::block::{BlockMatrix, BlockPattern};
use faer::dyn_stack::{MemBuffer, MemStack};
use faer::linalg::cholesky::llt::factor::LltRegularization;
use faer::sparse::linalg::SupernodalThreshold;
use faer::sparse::linalg::amd;
use faer::sparse::linalg::cholesky::{
    CholeskySymbolicParams, LltRef, SymbolicCholesky, SymbolicCholeskyRaw, SymmetricOrdering,
    factorize_symbolic_cholesky, supernodal,
};
use faer::sparse::{SparseColMatRef, SymbolicSparseColMat, SymbolicSparseColMatRef};
use faer::{Conj, MatMut, Par, Side};

/// A pivot this small beside its diagonal entry is a pivot of a singular matrix.
const SINGULAR: f64 = 64.0 * f64::EPSILON;

/// Sparse Cholesky with a cached symbolic analysis.
#[derive(Default)]
pub struct Direct {
    analysis: Option<Analysis>,
    /// Whether `factor` belongs to the matrix last prepared.
    factored: bool,
}

/// What depends on the pattern, and memory of the sizes it asks for.
struct Analysis {
    pattern: BlockPattern,
    /// New place of each block row.
    place: Vec<usize>,
    /// `2 * slot + transposed` of the blocks of the permuted lower triangle, column by column.
    source: Vec<usize>,
    /// Start of each permuted block column in `source`.
    starts: Vec<usize>,
    lower: SymbolicSparseColMat<usize>,
    symbolic: SymbolicCholesky<usize>,
    values: Vec<f64>,
    factor: Vec<f64>,
    rhs: Vec<f64>,
    factor_memory: MemBuffer,
    solve_memory: MemBuffer,
    work_bytes: usize,
}

impl Direct {
    /// A solver that has seen no matrix yet.
    pub fn new() -> Self {
        Self::default()
    }

    /// Stored numbers of the factor, padding of supernodes included; 0 before the first matrix.
    pub fn factor_length(&self) -> usize {
        self.analysis.as_ref().map_or(0, |a| a.factor.len())
    }
}

impl LinearSolver for Direct {
    fn name(&self) -> &'static str {
        "cholesky"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.factored = false;
        if self
            .analysis
            .as_ref()
            .is_none_or(|a| a.pattern != matrix.pattern)
        {
            self.analysis = None;
            self.analysis = Some(Analysis::new(&matrix.pattern)?);
        }
        let Some(analysis) = &mut self.analysis else {
            return Err(LinearError::NoConvergence);
        };
        analysis.load(matrix)?;
        analysis.factorize()?;
        self.factored = true;
        Ok(())
    }

    fn solve(
        &mut self,
        _matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        _tolerance: f64,
    ) -> Result<u32, LinearError> {
        match &mut self.analysis {
            Some(analysis) if self.factored && b.len() == analysis.place.len() => {
                analysis.solve(b, x)?;
                Ok(1)
            }
            _ => Err(LinearError::NoConvergence),
        }
    }

    fn bytes(&self) -> usize {
        self.analysis.as_ref().map_or(0, Analysis::bytes)
    }
}

impl Analysis {
    fn new(pattern: &BlockPattern) -> Result<Self, LinearError> {
        let n = pattern.n();
        let place = minimum_degree(pattern)?;

        // Permuted block columns of the lower triangle: (column, row, source), sorted.
        let mut entries = Vec::with_capacity(pattern.rows.len());
        for j in 0..n {
            for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                let (p, q) = (place[pattern.rows[k] as usize], place[j]);
                let transposed = p < q;
                entries.push((p.min(q), p.max(q), 2 * k + usize::from(transposed)));
            }
        }
        entries.sort_unstable();
        let mut starts = vec![0; n + 1];
        for &(column, _, _) in &entries {
            starts[column + 1] += 1;
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
        let factor_need =
            symbolic.factorize_numeric_llt_scratch::<f64>(Par::Seq, Default::default());
        let solve_need = symbolic.solve_in_place_scratch::<f64>(1, Par::Seq);
        Ok(Self {
            pattern: pattern.clone(),
            place,
            source: entries.iter().map(|e| e.2).collect(),
            starts,
            values: vec![0.0; lower.row_idx().len()],
            factor: vec![0.0; symbolic.len_val()],
            rhs: vec![0.0; 3 * n],
            factor_memory: MemBuffer::try_new(factor_need)
                .map_err(|_| LinearError::NoConvergence)?,
            solve_memory: MemBuffer::try_new(solve_need).map_err(|_| LinearError::NoConvergence)?,
            work_bytes: factor_need.unaligned_bytes_required()
                + solve_need.unaligned_bytes_required(),
            lower,
            symbolic,
        })
    }

    /// Copies the blocks into permuted scalar columns; refuses what is not finite.
    fn load(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        let mut poison = 0.0;
        let mut at = 0;
        for j in 0..self.place.len() {
            let blocks = &self.source[self.starts[j]..self.starts[j + 1]];
            for c in 0..3 {
                for (k, &source) in blocks.iter().enumerate() {
                    let block = &matrix.blocks[source >> 1];
                    // The diagonal block comes first in its column and gives its lower part.
                    for r in if k == 0 { c } else { 0 }..3 {
                        let value = if source & 1 == 1 {
                            block[(c, r)]
                        } else {
                            block[(r, c)]
                        };
                        poison += value * 0.0;
                        self.values[at] = value;
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
        let SymbolicCholeskyRaw::Supernodal(symbolic) = self.symbolic.raw() else {
            return Err(LinearError::NoConvergence);
        };
        let factor = supernodal::SupernodalLltRef::new(symbolic, &self.factor);
        let columns = self.lower.col_ptr();
        for s in 0..symbolic.n_supernodes() {
            let node = factor.supernode(s);
            let block = node.val();
            for c in 0..block.ncols() {
                let root = block[(c, c)];
                let diagonal = self.values[columns[node.start() + c]];
                let pivot = root * root;
                if pivot.is_nan() || pivot <= SINGULAR * diagonal {
                    return Err(LinearError::NotPositiveDefinite);
                }
            }
        }
        Ok(())
    }

    fn solve(&mut self, b: &[Vec3], x: &mut [Vec3]) -> Result<(), LinearError> {
        if b.is_empty() {
            return Ok(());
        }
        for (b, &p) in b.iter().zip(&self.place) {
            self.rhs[3 * p..3 * p + 3].copy_from_slice(b.as_slice());
        }
        let rows = self.rhs.len();
        LltRef::new(&self.symbolic, &self.factor).solve_in_place_with_conj(
            Conj::No,
            MatMut::from_column_major_slice_mut(&mut self.rhs, rows, 1),
            Par::Seq,
            MemStack::new(&mut self.solve_memory),
        );
        for (x, &p) in x.iter_mut().zip(&self.place) {
            x.copy_from_slice(&self.rhs[3 * p..3 * p + 3]);
            if !x.iter().all(|v| v.is_finite()) {
                return Err(LinearError::NoConvergence);
            }
        }
        Ok(())
    }

    fn bytes(&self) -> usize {
        let numbers = self.values.len()
            + self.factor.len()
            + self.rhs.len()
            + self.place.len()
            + self.source.len()
            + self.starts.len()
            + self.lower.row_idx().len()
            + self.lower.col_ptr().len();
        let symbolic = match self.symbolic.raw() {
            SymbolicCholeskyRaw::Supernodal(s) => s.row_idx().len() + 4 * s.n_supernodes(),
            SymbolicCholeskyRaw::Simplicial(s) => s.row_idx().len() + s.nrows(),
        };
        8 * (numbers + symbolic)
            + 4 * (self.pattern.rows.len() + self.pattern.starts.len())
            + self.work_bytes
    }
}

/// New place of each block row under approximate minimum degree.
fn minimum_degree(pattern: &BlockPattern) -> Result<Vec<usize>, LinearError> {
    let n = pattern.n();
    let starts: Vec<usize> = pattern.starts.iter().map(|&s| s as usize).collect();
    let rows: Vec<usize> = pattern.rows.iter().map(|&r| r as usize).collect();
    let graph = SymbolicSparseColMatRef::new_checked(n, n, &starts, None, &rows);
    let mut old = vec![0_usize; n];
    let mut place = vec![0_usize; n];
    let mut memory = MemBuffer::try_new(amd::order_scratch::<usize>(n, rows.len()))
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
    starts: &[usize],
    entries: &[(usize, usize, usize)],
) -> SymbolicSparseColMat<usize> {
    let mut column_starts = Vec::with_capacity(3 * n + 1);
    let mut rows = Vec::with_capacity(9 * entries.len());
    column_starts.push(0);
    for j in 0..n {
        for c in 0..3 {
            for &(column, row, _) in &entries[starts[j]..starts[j + 1]] {
                let first = if row == column { c } else { 0 };
                rows.extend((first..3).map(|r| 3 * row + r));
            }
            column_starts.push(rows.len());
        }
    }
    SymbolicSparseColMat::new_checked(3 * n, 3 * n, column_starts, None, rows)
}

/// Scalar columns of the upper triangle (what the symbolic analysis reads) from the same entries.
fn scalar_upper(n: usize, entries: &[(usize, usize, usize)]) -> (Vec<usize>, Vec<usize>) {
    // Sorted by (column, row) of the lower triangle, so each upper column fills in row order.
    let mut counts = vec![0; n + 1];
    for &(_, row, _) in entries {
        counts[row + 1] += 1;
    }
    for j in 0..n {
        counts[j + 1] += counts[j];
    }
    let mut block_rows = vec![0; entries.len()];
    let mut next = counts.clone();
    for &(column, row, _) in entries {
        block_rows[next[row]] = column;
        next[row] += 1;
    }
    let mut column_starts = Vec::with_capacity(3 * n + 1);
    let mut rows = Vec::with_capacity(9 * entries.len());
    column_starts.push(0);
    for j in 0..n {
        for c in 0..3 {
            for &i in &block_rows[counts[j]..counts[j + 1]] {
                let last = if i == j { c } else { 2 };
                rows.extend((0..=last).map(|r| 3 * i + r));
            }
            column_starts.push(rows.len());
        }
    }
    (column_starts, rows)
}
