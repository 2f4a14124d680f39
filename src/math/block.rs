//! Symmetric block-sparse matrices with 3x3 blocks.
//!
//! Only the lower triangle is stored, by block columns: column `j` lists the block rows `i >= j`
//! in increasing order, the diagonal first. A block is column-major, so that scalar column
//! `3 j + c` of the lower triangle is the concatenation of the blocks' columns `c`: what a
//! supernodal Cholesky wants comes without a sort.

use super::{Mat3, Vec3};

/// Which blocks of a symmetric matrix exist.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct BlockPattern {
    /// Start of each block column in `rows`, length `n + 1`.
    pub starts: Vec<u32>,
    /// Block row of each stored block; `rows[starts[j]] == j`.
    pub rows: Vec<u32>,
}

impl Default for BlockPattern {
    /// The pattern of no rows.
    fn default() -> Self {
        Self {
            starts: vec![0],
            rows: Vec::new(),
        }
    }
}

impl BlockPattern {
    /// Pattern of an `n` x `n` block matrix that couples the vertices of every stencil.
    /// `stencils` is called with a sink that takes one stencil (a list of block indices) a time.
    pub fn from_stencils(n: usize, stencils: impl Fn(&mut dyn FnMut(&[u32]))) -> Self {
        let mut pairs: Vec<u64> = (0..n as u64).map(|j| j << 32 | j).collect();
        stencils(&mut |s: &[u32]| {
            for &a in s {
                for &b in s {
                    if a > b {
                        pairs.push(u64::from(b) << 32 | u64::from(a));
                    }
                }
            }
        });
        pairs.sort_unstable();
        pairs.dedup();
        let mut starts = vec![0_u32; n + 1];
        let mut rows = Vec::with_capacity(pairs.len());
        for p in pairs {
            starts[(p >> 32) as usize + 1] += 1;
            rows.push(p as u32);
        }
        for j in 0..n {
            starts[j + 1] += starts[j];
        }
        Self { starts, rows }
    }

    /// Number of block rows.
    pub fn n(&self) -> usize {
        self.starts.len() - 1
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
        for j in 0..self.n() {
            let (from, to) = (
                self.pattern.starts[j] as usize,
                self.pattern.starts[j + 1] as usize,
            );
            let xj = x[j];
            let mut yj = y[j] + self.blocks[from] * xj;
            for k in from + 1..to {
                let i = self.pattern.rows[k] as usize;
                y[i] += self.blocks[k] * xj;
                yj += self.blocks[k].tr_mul(&x[i]);
            }
            y[j] = yj;
        }
    }
}
