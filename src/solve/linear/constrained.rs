//! Direct solution under linear constraints: `min 1/2 x.A x - b.x` with `C x = 0`.
//!
//! ```text
//! [A  C^T] [x  ]   [b]
//! [C  0  ] [lam] = [0]
//! ```
//!
//! `A` alone would not do: without the triangles the yarns of a region are held by next to nothing, and vertices without
//! energy by nothing at all. So the rows of a few anchors of the yarns and of such vertices go to the end with the
//! multipliers. What is left of `A` has a sparse Cholesky factor, and the last rows a dense Schur complement, which
//! is indefinite: it is factored as `L B L^T` with pivots of size 1 and 2 (Bunch and Kaufman 1977). By Haynsworth's
//! law `A` is positive definite on the kernel of `C` if the Schur complement has as many negative eigenvalues as there are
//! multipliers; otherwise, and where the rest of `A` is not positive definite, the matrix is refused. So a matrix may be
//! refused that is positive definite under the constraints alone; no semi-definite sum of energies is.
//!
//! The solution is refined until its residual is that of rounding. Columns of the Schur complement are made in batches
//! of fixed size, so that results do not depend on the number of threads.

use super::cholesky::Cholesky;
use super::{LinearError, LinearSolver};
use crate::blend::Filter;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use faer::linalg::solvers::{Lblt, Solve};
use faer::{Mat, Side};
use std::sync::Arc;

/// Columns of the Schur complement in one batch.
const BATCH: usize = 24;
/// Rounds of refinement, and the relative residual at which it ends.
const ROUNDS: usize = 3;
const REFINED: f64 = 1e-14;
/// Rounds of equilibration.
const SCALINGS: usize = 3;
/// Set in the place of a block that goes to the end.
const LAST: u32 = 1 << 31;

/// A factor with constraints.
pub struct Constrained {
    /// Coefficients of the constraints by point, for one component of space.
    rows: Vec<Vec<(u32, f64)>>,
    /// Blocks that are eliminated last, ascending.
    last: Vec<u32>,
    fixed: Vec<bool>,
    plan: Option<Plan>,
    cholesky: Option<Cholesky<f64>>,
    first: BlockMatrix,
    dense: Option<Dense>,
    workers: Workers,
    work: Work,
}

/// What follows from the pattern.
struct Plan {
    pattern: BlockPattern,
    /// Place of each block among those eliminated first, or among the last with [`LAST`].
    place: Vec<u32>,
    /// Slot in the matrix of each block of the part eliminated first.
    slots: Vec<u32>,
}

/// The factor of the scaled Schur complement.
struct Dense {
    lblt: Lblt<f64>,
    scale: Vec<f64>,
}

/// Entries `(scalar row, value)` of a column of what couples the last rows to the first.
type Column = Vec<(u32, f64)>;

#[derive(Default)]
struct Work {
    columns: Vec<Column>,
    rest: Vec<Vec3>,
    part: Vec<Vec3>,
    answer: Vec<Vec3>,
    step: Vec<Vec3>,
    multipliers: Vec<f64>,
    last: Vec<f64>,
}

impl Constrained {
    /// A solver for the matrices of a system with these constraints.
    pub fn new(filter: &Arc<Filter>, workers: &Workers) -> Self {
        let mut last: Vec<u32> = filter
            .bare()
            .iter()
            .chain(filter.anchors())
            .copied()
            .collect();
        last.sort_unstable();
        last.dedup();
        Self {
            rows: filter.rows(),
            last,
            fixed: Vec::new(),
            plan: None,
            cholesky: None,
            first: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
            dense: None,
            workers: workers.clone(),
            work: Work::default(),
        }
    }

    /// Scalar rows of the Schur complement.
    fn width(&self) -> usize {
        3 * (self.last.len() + self.rows.len())
    }

    fn plan(&mut self, pattern: &BlockPattern) -> Result<(), LinearError> {
        if self.plan.as_ref().is_some_and(|p| p.pattern == *pattern) {
            return Ok(());
        }
        self.plan = None;
        let n = pattern.n();
        if self.last.last().is_some_and(|k| *k as usize >= n) {
            return Err(LinearError::NoConvergence);
        }
        let mut place = vec![0_u32; n];
        for (k, block) in (0..).zip(&self.last) {
            place[*block as usize] = k | LAST;
        }
        let first = place.iter_mut().filter(|p| **p & LAST == 0);
        for (k, p) in (0..).zip(first) {
            *p = k;
        }
        let (mut starts, mut rows, mut slots) = (vec![0], Vec::new(), Vec::new());
        for j in (0..n).filter(|j| place[*j] & LAST == 0) {
            for k in pattern.starts[j]..pattern.starts[j + 1] {
                let i = place[pattern.rows[k as usize] as usize];
                if i & LAST == 0 {
                    rows.push(i);
                    slots.push(k);
                }
            }
            starts.push(rows.len() as u32);
        }
        self.first = BlockMatrix::zeros(BlockPattern {
            starts,
            rows,
            widths: Vec::new(),
        });
        self.plan = Some(Plan {
            pattern: pattern.clone(),
            place,
            slots,
        });
        Ok(())
    }

    /// Blocks of the matrix between the last rows, and the columns that couple these to the first; constraints come
    /// after the last blocks.
    fn border(&mut self, matrix: &BlockMatrix) -> Mat<f64> {
        let width = self.width();
        let mut corner = Mat::<f64>::zeros(width, width);
        let columns = &mut self.work.columns;
        columns.resize(width, Column::new());
        for column in columns.iter_mut() {
            column.clear();
        }
        let Some(plan) = &self.plan else {
            return corner;
        };
        for j in 0..matrix.n() {
            let from = matrix.pattern.starts[j] as usize;
            for k in from..matrix.pattern.starts[j + 1] as usize {
                let i = matrix.pattern.rows[k] as usize;
                let block = &matrix.blocks[k];
                let (p, q) = (plan.place[i], plan.place[j]);
                match (p & LAST != 0, q & LAST != 0) {
                    (false, false) => {}
                    (true, true) => {
                        let (p, q) = ((p & !LAST) as usize, (q & !LAST) as usize);
                        for (r, c) in all() {
                            corner[(3 * p + r, 3 * q + c)] = block[(r, c)];
                            corner[(3 * q + c, 3 * p + r)] = block[(r, c)];
                        }
                    }
                    (false, true) => {
                        let q = (q & !LAST) as usize;
                        for (r, c) in all() {
                            columns[3 * q + c].push((3 * p + r as u32, block[(r, c)]));
                        }
                    }
                    (true, false) => {
                        let p = (p & !LAST) as usize;
                        for (r, c) in all() {
                            columns[3 * p + r].push((3 * q + c as u32, block[(r, c)]));
                        }
                    }
                }
            }
        }
        for (k, row) in self.rows.iter().enumerate() {
            let k = self.last.len() + k;
            for (point, e) in row {
                if self.fixed.get(*point as usize) == Some(&true) {
                    continue;
                }
                let p = plan.place[*point as usize];
                for c in 0..3 {
                    if p & LAST == 0 {
                        columns[3 * k + c].push((3 * p + c as u32, *e));
                    } else {
                        let p = (p & !LAST) as usize;
                        corner[(3 * k + c, 3 * p + c)] = *e;
                        corner[(3 * p + c, 3 * k + c)] = *e;
                    }
                }
            }
        }
        corner
    }

    /// Factors `S = A22 - A21 A11^-1 A12`.
    fn factor_dense(&mut self, corner: Mat<f64>) -> Result<(), LinearError> {
        let width = self.width();
        let Some(cholesky) = &self.cholesky else {
            return Err(LinearError::NoConvergence);
        };
        let factor = cholesky.factor()?;
        let columns = &self.work.columns;
        let mut schur = vec![0.0; width * width];
        self.workers
            .chunks(&mut schur, BATCH * width.max(1), |batch, chunk| {
                let from = batch * BATCH;
                let count = chunk.len() / width;
                let solved = cholesky.solve_columns(factor, &columns[from..from + count]);
                for (k, out) in chunk.chunks_mut(width).enumerate() {
                    for (row, entry) in out.iter_mut().enumerate() {
                        let by: f64 = (columns[row].iter())
                            .map(|(i, value)| value * solved[(*i as usize, k)])
                            .sum();
                        *entry = corner[(row, from + k)] - by;
                    }
                }
            });
        let entry = |i: usize, j: usize| 0.5 * (schur[i * width + j] + schur[j * width + i]);
        let mut scale = vec![1.0_f64; width];
        for _ in 0..SCALINGS {
            for i in 0..width {
                let largest = (0..width)
                    .map(|j| (entry(i, j) * scale[i] * scale[j]).abs())
                    .fold(0.0, f64::max);
                if !largest.is_finite() || largest == 0.0 {
                    return Err(LinearError::NotPositiveDefinite);
                }
                scale[i] /= largest.sqrt();
            }
        }
        let scaled = Mat::from_fn(width, width, |i, j| entry(i, j) * scale[i] * scale[j]);
        let lblt = scaled.lblt(Side::Lower);
        if negative(&lblt, width) != Some(3 * self.rows.len()) {
            return Err(LinearError::NotPositiveDefinite);
        }
        self.dense = Some(Dense { lblt, scale });
        Ok(())
    }

    /// `(x, lam) += M^-1 (rest, -rest of the constraints)` with the factors as they are.
    fn correct(&mut self, rest: &[Vec3], rest_rows: &[f64]) -> Result<(), LinearError> {
        let (Some(plan), Some(cholesky), Some(dense)) =
            (&self.plan, &mut self.cholesky, &self.dense)
        else {
            return Err(LinearError::NoConvergence);
        };
        let work = &mut self.work;
        let blocks = 3 * self.last.len();
        work.part.resize(cholesky.n(), Vec3::zeros());
        work.answer.resize(cholesky.n(), Vec3::zeros());
        work.last.clear();
        work.last.resize(work.columns.len(), 0.0);
        for (r, p) in rest.iter().zip(&plan.place) {
            if p & LAST == 0 {
                work.part[*p as usize] = *r;
            } else {
                let p = (p & !LAST) as usize;
                work.last[3 * p..3 * p + 3].copy_from_slice(r.as_slice());
            }
        }
        work.last[blocks..].copy_from_slice(rest_rows);
        cholesky.solve(&work.part, &mut work.answer, &self.workers)?;
        let mut u = Mat::<f64>::zeros(work.last.len(), 1);
        for (k, column) in work.columns.iter().enumerate() {
            let by: f64 = (column.iter())
                .map(|(i, value)| value * work.answer[*i as usize / 3][*i as usize % 3])
                .sum();
            u[(k, 0)] = (work.last[k] - by) * dense.scale[k];
        }
        dense.lblt.solve_in_place(u.as_mut());
        for (k, column) in work.columns.iter().enumerate() {
            let value = u[(k, 0)] * dense.scale[k];
            if !value.is_finite() {
                return Err(LinearError::NoConvergence);
            }
            for (i, e) in column {
                work.part[*i as usize / 3][*i as usize % 3] -= e * value;
            }
            work.last[k] = value;
        }
        cholesky.solve(&work.part, &mut work.answer, &self.workers)?;
        for (x, p) in work.step.iter_mut().zip(&plan.place) {
            *x += if p & LAST == 0 {
                work.answer[*p as usize]
            } else {
                let p = (p & !LAST) as usize;
                Vec3::from_column_slice(&work.last[3 * p..3 * p + 3])
            };
        }
        for (sum, u) in work.multipliers.iter_mut().zip(&work.last[blocks..]) {
            *sum += u;
        }
        Ok(())
    }

    /// `C x` of what is not fixed, negated, and `rest -= C^T lam`.
    fn apply_constraints(&self, x: &[Vec3], multipliers: &[f64], rest: &mut [Vec3]) -> Vec<f64> {
        let mut out = Vec::with_capacity(3 * self.rows.len());
        for (k, row) in self.rows.iter().enumerate() {
            let lambda = Vec3::from_column_slice(&multipliers[3 * k..3 * k + 3]);
            let mut sum = Vec3::zeros();
            for (point, e) in row {
                let p = *point as usize;
                if self.fixed.get(p) != Some(&true) {
                    sum -= x[p] * *e;
                    rest[p] -= lambda * *e;
                }
            }
            out.extend_from_slice(sum.as_slice());
        }
        out
    }
}

fn all() -> impl Iterator<Item = (usize, usize)> {
    (0..9).map(|k| (k % 3, k / 3))
}

/// Number of negative eigenvalues; none if one vanishes.
fn negative(lblt: &Lblt<f64>, n: usize) -> Option<usize> {
    let (diagonal, below) = (lblt.B_diag(), lblt.B_subdiag());
    let (mut count, mut k) = (0, 0);
    while k < n {
        let pair = k + 1 < n && below[k] != 0.0;
        let (a, size) = (diagonal[k], if pair { 2 } else { 1 });
        if pair {
            let (b, c) = (below[k], diagonal[k + 1]);
            let determinant = a * c - b * b;
            if !determinant.is_finite() || determinant == 0.0 {
                return None;
            }
            count += match (determinant < 0.0, a < 0.0) {
                (true, _) => 1,
                (false, true) => 2,
                (false, false) => 0,
            };
        } else if !a.is_finite() || a == 0.0 {
            return None;
        } else {
            count += usize::from(a < 0.0);
        }
        k += size;
    }
    Some(count)
}

impl LinearSolver for Constrained {
    fn name(&self) -> &'static str {
        "constrained_cholesky"
    }

    fn hold(&mut self, fixed: &[bool]) {
        self.fixed.clear();
        self.fixed.extend_from_slice(fixed);
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.dense = None;
        self.plan(&matrix.pattern)?;
        if let Some(plan) = &self.plan {
            for (block, slot) in self.first.blocks.iter_mut().zip(&plan.slots) {
                *block = matrix.blocks[*slot as usize];
            }
        }
        Cholesky::for_pattern(&mut self.cholesky, &self.first.pattern)?
            .prepare(&self.first, &self.workers)?;
        let corner = self.border(matrix);
        self.factor_dense(corner)
    }

    fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        _tolerance: f64,
    ) -> Result<u32, LinearError> {
        if b.len() != matrix.n() || x.len() != b.len() {
            return Err(LinearError::NoConvergence);
        }
        self.work.step.clear();
        self.work.step.resize(b.len(), Vec3::zeros());
        self.work.multipliers.clear();
        self.work.multipliers.resize(3 * self.rows.len(), 0.0);
        let size = |v: &[Vec3]| v.iter().map(Vec3::norm_squared).sum::<f64>().sqrt();
        let mut rest = std::mem::take(&mut self.work.rest);
        rest.clear();
        rest.extend_from_slice(b);
        let mut rest_rows = vec![0.0; 3 * self.rows.len()];
        let whole = size(b);
        let mut done = Ok(1);
        for round in 0..=ROUNDS {
            done = self.correct(&rest, &rest_rows).map(|()| 1);
            if done.is_err() || round == ROUNDS {
                break;
            }
            matrix.multiply(&self.work.step, &mut rest);
            for (r, b) in rest.iter_mut().zip(b) {
                *r = b - *r;
            }
            rest_rows = self.apply_constraints(&self.work.step, &self.work.multipliers, &mut rest);
            if size(&rest) <= REFINED * whole {
                break;
            }
        }
        x.copy_from_slice(&self.work.step);
        self.work.rest = rest;
        done
    }

    fn bytes(&self) -> usize {
        let width = self.width();
        let columns: usize = self.work.columns.iter().map(|c| 16 * c.len()).sum();
        self.cholesky.as_ref().map_or(0, Cholesky::bytes)
            + size_of::<Mat3>() * self.first.blocks.len()
            + 8 * width * width
            + columns
    }
}
