//! `y = A x` with ranges of columns side by side.
//!
//! A column of the lower triangle counts for all rows below it as well. Each range of columns gathers what it gives in a
//! vector of its own, and these are added in their order: the ranges depend on the pattern alone, so that results do not depend on the
//! number of threads.

use crate::math::Vec3;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use std::ops::Range;

/// Ranges of columns.
const RANGES: usize = 4;
/// Stored blocks below which waking a thread takes as long as the product.
const SMALL: usize = 40_000;
/// Rows of one task of the sum.
const ROWS: usize = 2_048;

/// Products, and the memory that they need.
#[derive(Default)]
pub(super) struct Multiplication {
    workers: Workers,
    ranges: Vec<Part>,
}

struct Part {
    columns: Range<usize>,
    /// What the columns give to the rows from the first of them on.
    y: Vec<Vec3>,
}

impl Multiplication {
    /// On these threads.
    pub(super) fn new(workers: &Workers) -> Self {
        Self {
            workers: workers.clone(),
            ranges: Vec::new(),
        }
    }

    /// `y = A x`.
    pub(super) fn multiply(&mut self, matrix: &BlockMatrix, x: &[Vec3], y: &mut [Vec3]) {
        if matrix.blocks.len() < SMALL {
            return matrix.multiply(x, y);
        }
        self.cut(&matrix.pattern);
        self.workers.chunks(&mut self.ranges, 1, |_, parts| {
            for part in parts {
                let first = part.columns.start;
                part.y.fill(Vec3::zeros());
                matrix.add_columns(part.columns.clone(), &x[first..], &mut part.y);
            }
        });
        let ranges = &self.ranges;
        self.workers.chunks(y, ROWS, |c, rows| {
            rows.fill(Vec3::zeros());
            for part in ranges {
                let (from, first) = (part.columns.start, c * ROWS);
                let skipped = from.saturating_sub(first).min(rows.len());
                let begin = first.max(from) - from;
                for (y, own) in rows[skipped..]
                    .iter_mut()
                    .zip(&part.y[begin.min(part.y.len())..])
                {
                    *y += own;
                }
            }
        });
    }

    /// Ranges with as many stored blocks each.
    fn cut(&mut self, pattern: &BlockPattern) {
        let n = pattern.n();
        let each = pattern.rows.len().div_ceil(RANGES);
        let ends = (1..=RANGES).map(|k| {
            let goal = (k * each).min(pattern.rows.len()) as u32;
            pattern.starts.partition_point(|start| *start < goal).min(n)
        });
        let mut from = 0;
        self.ranges.resize_with(RANGES, || Part {
            columns: 0..0,
            y: Vec::new(),
        });
        for (part, end) in self.ranges.iter_mut().zip(ends) {
            part.columns = from..end;
            part.y.resize(n - from, Vec3::zeros());
            from = end;
        }
    }

    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let rows: usize = self.ranges.iter().map(|part| part.y.len()).sum();
        size_of::<Vec3>() * rows
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::Mat3;

    #[test]
    fn ranges_of_columns_give_the_product_for_any_number_of_threads() {
        let n = 9_000;
        let pattern = BlockPattern::from_stencils(n, |sink| {
            for i in 0..n as u32 - 200 {
                sink(&[i, i + 1, i + 7, i + 200]);
            }
        });
        let mut matrix = BlockMatrix::zeros(pattern);
        for (k, block) in matrix.blocks.iter_mut().enumerate() {
            *block = Mat3::from_fn(|i, j| ((k * 9 + i * 3 + j) as f64 * 0.7).sin());
        }
        let x: Vec<Vec3> = (0..n)
            .map(|i| Vec3::from_fn(|c, _| ((3 * i + c) as f64).cos()))
            .collect();
        let mut plain = vec![Vec3::zeros(); n];
        matrix.multiply(&x, &mut plain);
        let by = |threads| {
            let mut y = vec![Vec3::repeat(7.0); n];
            Multiplication::new(&Workers::new(threads)).multiply(&matrix, &x, &mut y);
            y
        };
        let one = by(1);
        assert_eq!(one, by(3));
        for (a, b) in plain.iter().zip(&one) {
            assert!((a - b).norm() < 1e-12, "{a} {b}");
        }
    }
}
