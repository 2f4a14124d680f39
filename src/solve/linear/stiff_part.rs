//! The stiff part of a matrix, which is what a preconditioner is made from.
//!
//! Blocks whose norm is below a given part of the geometric mean of their diagonal blocks (bending of triangles
//! couples second neighbours a thousand times more weakly than the membrane couples first ones) are
//! left out and their norm is added to both diagonals, which keeps the matrix positive definite:
//! `|2 x . B y| <= |B| (|x|^2 + |y|^2)`. A factor then has the fill of the membrane alone. Which
//! blocks are kept is decided once for a pattern.

use crate::math::Mat3;
use crate::math::block::{BlockMatrix, BlockPattern};

/// Which blocks of a matrix are kept, and what is added to its diagonals for the others.
#[derive(Default)]
pub(super) struct StiffPart {
    /// Part of the diagonal blocks below which a coupling is left out.
    dropped: f64,
    /// Pattern of the whole matrix.
    whole: BlockPattern,
    /// Pattern of the part.
    pattern: BlockPattern,
    /// Slots in the whole matrix of its blocks.
    kept: Vec<u32>,
    /// Slots of the blocks that are left out.
    left: Vec<u32>,
    /// What each block row has on its diagonal for them.
    lumps: Vec<f64>,
}

impl StiffPart {
    /// The part of a matrix whose pattern may have changed.
    pub(super) fn take(&mut self, matrix: &BlockMatrix) {
        if self.whole != matrix.pattern {
            self.select(matrix);
        }
        self.lumps.fill(0.0);
        let mut column = 0;
        for slot in &self.left {
            while matrix.pattern.starts[column + 1] <= *slot {
                column += 1;
            }
            let lump = bound(&matrix.blocks[*slot as usize]);
            self.lumps[column] += lump;
            self.lumps[matrix.pattern.rows[*slot as usize] as usize] += lump;
        }
    }

    /// A part without couplings below `dropped` of the diagonal blocks.
    pub(super) fn without(dropped: f64) -> Self {
        Self {
            dropped,
            ..Self::default()
        }
    }

    /// Forgets which blocks were kept.
    pub(super) fn forget(&mut self) {
        *self = Self::without(self.dropped);
    }

    /// Pattern of the part.
    pub(super) fn pattern(&self) -> &BlockPattern {
        &self.pattern
    }

    /// A block of the part of the matrix last taken, by its slot.
    pub(super) fn block(&self, matrix: &BlockMatrix, slot: usize) -> Mat3 {
        let source = self.kept[slot] as usize;
        let block = matrix.blocks[source];
        let row = self.pattern.rows[slot] as usize;
        // the diagonal block comes first in its column
        if self.pattern.starts[row] as usize == slot {
            return block + Mat3::from_diagonal_element(self.lumps[row]);
        }
        block
    }

    /// Decides which blocks of a matrix are kept.
    fn select(&mut self, matrix: &BlockMatrix) {
        let pattern = &matrix.pattern;
        let n = pattern.n();
        let diagonal: Vec<f64> = (0..n)
            .map(|j| matrix.blocks[pattern.starts[j] as usize].norm())
            .collect();
        let (mut starts, mut rows) = (Vec::with_capacity(n + 1), Vec::new());
        self.kept.clear();
        self.left.clear();
        starts.push(0);
        for j in 0..n {
            for k in pattern.starts[j]..pattern.starts[j + 1] {
                let i = pattern.rows[k as usize] as usize;
                let limit = self.dropped * (diagonal[i] * diagonal[j]).sqrt();
                if i == j || matrix.blocks[k as usize].norm() >= limit {
                    self.kept.push(k);
                    rows.push(i as u32);
                } else {
                    self.left.push(k);
                }
            }
            starts.push(rows.len() as u32);
        }
        self.lumps.resize(n, 0.0);
        self.pattern = BlockPattern {
            starts,
            rows,
            widths: pattern.widths.clone(),
        };
        self.whole = pattern.clone();
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let patterns = [&self.whole, &self.pattern].map(|p| p.rows.len() + p.starts.len());
        4 * (patterns[0] + patterns[1] + self.kept.len() + self.left.len()) + 8 * self.lumps.len()
    }
}

/// An upper bound of the largest singular value.
fn bound(block: &Mat3) -> f64 {
    let sums = |m: &Mat3| m.column_iter().map(|c| c.lp_norm(1)).fold(0.0, f64::max);
    block
        .norm()
        .min((sums(block) * sums(&block.transpose())).sqrt())
}
