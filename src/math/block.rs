//! Symmetric block-sparse matrices with 3x3 blocks.
//!
//! Only the lower triangle is stored, by block columns: column `j` lists the block rows `i >= j`
//! in increasing order, the diagonal first. A block is column-major, so that scalar column
//! `3 j + c` of the lower triangle is the concatenation of the blocks' columns `c`: what a
//! supernodal Cholesky wants comes without a sort.

use super::{Mat3, Vec3};
use std::ops::Range;

/// Which blocks of a symmetric matrix exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockPattern {
    /// Start of each block column in `rows`, length `n + 1`.
    pub starts: Vec<u32>,
    /// Block row of each stored block; `rows[starts[j]] == j`.
    pub rows: Vec<u32>,
    /// How many scalars of each block row are unknowns, the first ones, 1 to 3; the others have the rows and columns of the identity. Empty
    /// where all are.
    pub widths: Vec<u8>,
}

impl Default for BlockPattern {
    /// The pattern of no rows.
    fn default() -> Self {
        Self {
            starts: vec![0],
            rows: Vec::new(),
            widths: Vec::new(),
        }
    }
}

impl BlockPattern {
    /// Pattern of an `n` x `n` block matrix that couples the vertices of every stencil.
    /// `stencils` is called with a sink that takes one stencil (a list of block indices) a time.
    pub fn from_stencils(n: usize, stencils: impl Fn(&mut dyn FnMut(&[u32]))) -> Self {
        // the rows of each column as often as they come, and then once
        let each = |visit: &mut dyn FnMut(u32, u32)| {
            stencils(&mut |s: &[u32]| {
                for (k, &a) in s.iter().enumerate() {
                    for &b in &s[..k] {
                        if a != b {
                            visit(a.max(b), a.min(b));
                        }
                    }
                }
            });
        };
        let mut ends = vec![0_usize; n + 1];
        each(&mut |_, column| ends[column as usize + 1] += 1);
        for j in 0..n {
            ends[j + 1] += ends[j];
        }
        let mut all = vec![0_u32; ends[n]];
        each(&mut |row, column| {
            all[ends[column as usize]] = row;
            ends[column as usize] += 1;
        });
        let mut starts = Vec::with_capacity(n + 1);
        let mut rows = Vec::with_capacity(n + all.len() / 4);
        let mut column_of = vec![u32::MAX; n];
        starts.push(0);
        let mut from = 0;
        for j in 0..n as u32 {
            let first = rows.len();
            rows.push(j);
            for &row in &all[from..ends[j as usize]] {
                if column_of[row as usize] != j {
                    column_of[row as usize] = j;
                    rows.push(row);
                }
            }
            rows[first..].sort_unstable();
            from = ends[j as usize];
            starts.push(rows.len() as u32);
        }
        rows.shrink_to_fit();
        Self {
            starts,
            rows,
            widths: Vec::new(),
        }
    }

    /// Number of block rows.
    pub fn n(&self) -> usize {
        self.starts.len() - 1
    }

    /// Unknown scalars of a block row.
    pub fn width(&self, row: u32) -> u8 {
        self.widths.get(row as usize).copied().unwrap_or(3)
    }

    /// Index of block `(i, j)`, `i >= j`, among the stored blocks.
    pub fn slot(&self, i: u32, j: u32) -> Option<usize> {
        let (from, to) = (
            self.starts[j as usize] as usize,
            self.starts[j as usize + 1] as usize,
        );
        self.rows[from..to].binary_search(&i).ok().map(|k| from + k)
    }
}

/// Values on a [`BlockPattern`].
#[derive(Clone, Debug)]
pub struct BlockMatrix {
    /// Which blocks are stored.
    pub pattern: BlockPattern,
    /// One block for each entry of `pattern.rows`.
    pub blocks: Vec<Mat3>,
}

impl BlockMatrix {
    /// The zero matrix on a pattern.
    pub fn zeros(pattern: BlockPattern) -> Self {
        let blocks = vec![Mat3::zeros(); pattern.rows.len()];
        Self { pattern, blocks }
    }

    /// Takes another pattern; what the blocks hold then has no meaning.
    pub fn take_pattern(&mut self, pattern: BlockPattern) {
        let count = pattern.rows.len();
        self.blocks
            .reserve_exact(count.saturating_sub(self.blocks.len()));
        self.blocks.resize(count, Mat3::zeros());
        self.pattern = pattern;
    }

    /// Number of block rows.
    pub fn n(&self) -> usize {
        self.pattern.n()
    }

    /// `y = A x`.
    pub fn multiply(&self, x: &[Vec3], y: &mut [Vec3]) {
        y.fill(Vec3::zeros());
        self.add_product(x, y);
    }

    /// `y += A x`.
    pub fn add_product(&self, x: &[Vec3], y: &mut [Vec3]) {
        self.add_columns(0..self.n(), x, y);
    }

    /// Adds to `y` what the stored blocks of some columns and their transposes give; `x` and `y` begin with the row of the
    /// first of them.
    pub fn add_columns(&self, columns: Range<usize>, x: &[Vec3], y: &mut [Vec3]) {
        let first = columns.start;
        for j in columns {
            let (from, to) = (
                self.pattern.starts[j] as usize,
                self.pattern.starts[j + 1] as usize,
            );
            let xj = x[j - first];
            let mut yj = y[j - first] + self.blocks[from] * xj;
            for (row, block) in self.pattern.rows[from + 1..to]
                .iter()
                .zip(&self.blocks[from + 1..to])
            {
                let i = *row as usize - first;
                y[i] += block * xj;
                yj += block.tr_mul(&x[i]);
            }
            y[j - first] = yj;
        }
    }
}
