//! The factor of an earlier matrix as a preconditioner: sparse Cholesky in f32 of the stiff part.
//!
//! Newton's method meets a series of matrices that change little. Conjugate gradients with the
//! factor of an earlier one need a handful of iterations, each at a tenth of the price of a new
//! factor; single precision halves that price again and costs an iteration or two.
//!
//! Blocks whose norm is below [`DROPPED`] of the geometric mean of their diagonal blocks (bending
//! couples second neighbours a thousand times more weakly than the membrane couples first ones) are
//! left out and their norm is added to both diagonals, which keeps the matrix positive definite:
//! `|2 x . B y| <= |B| (|x|^2 + |y|^2)`. The factor then has the fill of the membrane alone. Which
//! blocks are kept is decided once for a pattern.

use super::LinearError;
use super::cholesky::Cholesky;
use super::pcg::Preconditioner;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::{Mat3, Vec3};

/// Part of the diagonal blocks below which a coupling is left out.
const DROPPED: f64 = 3e-3;
/// Mark of a block that is left out.
const NOWHERE: u32 = u32::MAX;

/// Cholesky factor in f32 of the stiff part of a matrix.
pub struct StiffFactor {
    /// Pattern of the whole matrix that `slots` is for.
    pattern: Option<BlockPattern>,
    /// Where each of its blocks goes in `stiff`.
    slots: Vec<u32>,
    stiff: BlockMatrix,
    cholesky: Option<Cholesky<f32>>,
    dropped: f64,
}

impl Default for StiffFactor {
    fn default() -> Self {
        Self::new(DROPPED)
    }
}

impl StiffFactor {
    /// Leaves out couplings below the given part of the diagonal blocks; 0 keeps all.
    pub fn new(dropped: f64) -> Self {
        Self {
            pattern: None,
            slots: Vec::new(),
            stiff: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
            cholesky: None,
            dropped,
        }
    }

    /// Decides which blocks of a matrix are kept.
    fn select(&mut self, matrix: &BlockMatrix) {
        let pattern = &matrix.pattern;
        let n = pattern.n();
        let diagonal: Vec<f64> = (0..n)
            .map(|j| matrix.blocks[pattern.starts[j] as usize].norm())
            .collect();
        let (mut starts, mut rows) = (Vec::with_capacity(n + 1), Vec::new());
        self.slots.clear();
        starts.push(0);
        for j in 0..n {
            for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                let i = pattern.rows[k] as usize;
                let limit = self.dropped * (diagonal[i] * diagonal[j]).sqrt();
                if i == j || matrix.blocks[k].norm() >= limit {
                    self.slots.push(rows.len() as u32);
                    rows.push(i as u32);
                } else {
                    self.slots.push(NOWHERE);
                }
            }
            starts.push(rows.len() as u32);
        }
        self.stiff = BlockMatrix::zeros(BlockPattern { starts, rows });
        self.pattern = Some(pattern.clone());
    }
}

/// An upper bound of the largest singular value.
fn bound(block: &Mat3) -> f64 {
    let sums = |m: &Mat3| m.column_iter().map(|c| c.lp_norm(1)).fold(0.0, f64::max);
    block
        .norm()
        .min((sums(block) * sums(&block.transpose())).sqrt())
}

impl Preconditioner for StiffFactor {
    fn solver_name(&self) -> &'static str {
        "cg_cholesky"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        if self.pattern.as_ref() != Some(&matrix.pattern) {
            self.select(matrix);
        }
        let pattern = &matrix.pattern;
        for block in &mut self.stiff.blocks {
            block.fill(0.0);
        }
        for j in 0..pattern.n() {
            for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                let block = &matrix.blocks[k];
                if self.slots[k] == NOWHERE {
                    let lump = Mat3::from_diagonal_element(bound(block));
                    let i = pattern.rows[k] as usize;
                    for v in [i, j] {
                        self.stiff.blocks[self.stiff.pattern.starts[v] as usize] += lump;
                    }
                } else {
                    self.stiff.blocks[self.slots[k] as usize] += block;
                }
            }
        }
        Cholesky::for_pattern(&mut self.cholesky, &self.stiff.pattern)?.prepare(&self.stiff)
    }

    fn forget(&mut self) {
        self.pattern = None;
    }

    fn apply(&mut self, r: &[Vec3], z: &mut [Vec3]) {
        let solved = match &mut self.cholesky {
            Some(cholesky) => cholesky.solve(r, z),
            None => Err(LinearError::NoConvergence),
        };
        if solved.is_err() {
            // an overflow of single precision ends the iteration: NaN is its sign of breakdown
            z.fill(Vec3::repeat(f64::NAN));
        }
    }

    fn bytes(&self) -> usize {
        let pattern = self
            .pattern
            .as_ref()
            .map_or(0, |p| p.rows.len() + p.starts.len());
        4 * (pattern + self.slots.len() + self.stiff.pattern.rows.len())
            + size_of::<Mat3>() * self.stiff.blocks.len()
            + self.cholesky.as_ref().map_or(0, Cholesky::bytes)
    }
}
