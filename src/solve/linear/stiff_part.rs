//! The stiff part of a matrix, which is what a preconditioner is made from.
//!
//! Blocks whose norm is below [`DROPPED`] of the geometric mean of their diagonal blocks (bending
//! couples second neighbours a thousand times more weakly than the membrane couples first ones) are
//! left out and their norm is added to both diagonals, which keeps the matrix positive definite:
//! `|2 x . B y| <= |B| (|x|^2 + |y|^2)`. A factor then has the fill of the membrane alone. Which
//! blocks are kept is decided once for a pattern.

use super::LinearError;
use super::pcg::Preconditioner;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::{Mat3, Vec3};

/// Part of the diagonal blocks below which a coupling is left out.
const DROPPED: f64 = 3e-3;
/// Mark of a block that is left out.
const NOWHERE: u32 = u32::MAX;

/// A preconditioner of the stiff part.
pub struct StiffPart {
    inner: Box<dyn Preconditioner>,
    /// Pattern of the whole matrix that `slots` is for.
    pattern: Option<BlockPattern>,
    /// Where each of its blocks goes in `stiff`.
    slots: Vec<u32>,
    stiff: BlockMatrix,
}

impl StiffPart {
    /// What `inner` makes of the stiff part.
    pub fn new(inner: Box<dyn Preconditioner>) -> Self {
        Self {
            inner,
            pattern: None,
            slots: Vec::new(),
            stiff: BlockMatrix::zeros(BlockPattern::from_stencils(0, |_| {})),
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
                let limit = DROPPED * (diagonal[i] * diagonal[j]).sqrt();
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

impl Preconditioner for StiffPart {
    fn solver_name(&self) -> &'static str {
        self.inner.solver_name()
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
        self.inner.prepare(&self.stiff)
    }

    fn forget(&mut self) {
        self.pattern = None;
        self.inner.forget();
    }

    fn apply(&mut self, r: &[Vec3], z: &mut [Vec3]) {
        self.inner.apply(r, z);
    }

    fn bytes(&self) -> usize {
        let pattern = self
            .pattern
            .as_ref()
            .map_or(0, |p| p.rows.len() + p.starts.len());
        4 * (pattern + self.slots.len() + self.stiff.pattern.rows.len())
            + size_of::<Mat3>() * self.stiff.blocks.len()
            + self.inner.bytes()
    }
}
