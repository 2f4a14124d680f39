//! A block diagonal `D` and the projection onto what constraints `C` admit that goes with it.
//!
//! ```text
//! P = I - D^-1 C^T (C D^-1 C^T)^-1 C,   P D^-1 P^T = P D^-1
//! ```
//!
//! The small matrix is sparse: it couples constraints that share points. What is held has `D^-1 = 0`.

use super::super::LinearError;
use super::super::cholesky::Cholesky;
use crate::blend::Filter;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};

/// The inverse.
pub(super) struct Diagonal {
    rows: Vec<Vec<(u32, f64)>>,
    /// Entries of the constraints at each point.
    at_point: Vec<Vec<(u32, f64)>>,
    masses: Option<Vec<f64>>,
    /// `D^-1` by block.
    inverse: Vec<Mat3>,
    small: BlockMatrix,
    factor: Option<Cholesky<f64>>,
    right: Vec<Vec3>,
    multipliers: Vec<Vec3>,
    workers: Workers,
}

impl Diagonal {
    /// Of masses by point [N/m], or of the blocks of the matrix.
    pub(super) fn new(filter: &Filter, masses: Option<Vec<f64>>, workers: &Workers) -> Self {
        let rows = filter.rows();
        let count = rows.iter().flatten().map(|e| e.0 as usize + 1);
        let mut at_point = vec![Vec::new(); count.max().unwrap_or(0)];
        for (k, row) in (0..).zip(&rows) {
            for (point, e) in row {
                at_point[*point as usize].push((k, *e));
            }
        }
        let pattern = BlockPattern::from_stencils(rows.len(), |sink| {
            for list in &at_point {
                sink(&list.iter().map(|e| e.0).collect::<Vec<u32>>());
            }
        });
        let zeros = vec![Vec3::zeros(); rows.len()];
        Self {
            rows,
            at_point,
            masses,
            inverse: Vec::new(),
            small: BlockMatrix::zeros(pattern),
            factor: None,
            right: zeros.clone(),
            multipliers: zeros,
            workers: workers.clone(),
        }
    }

    pub(super) fn prepare(
        &mut self,
        matrix: &BlockMatrix,
        fixed: &[bool],
    ) -> Result<(), LinearError> {
        self.inverse.clear();
        for (i, fixed) in fixed.iter().enumerate() {
            let mass = self.masses.as_ref().and_then(|m| m.get(i));
            let inverse = match (fixed, mass) {
                (true, _) => Some(Mat3::zeros()),
                (false, Some(mass)) => Some(Mat3::from_diagonal_element(1.0 / mass)),
                (false, None) => {
                    let block = matrix.blocks[matrix.pattern.starts[i] as usize];
                    block.cholesky().map(|c| c.inverse())
                }
            };
            let inverse = inverse.filter(|m| m.iter().all(|v| v.is_finite()));
            self.inverse
                .push(inverse.ok_or(LinearError::NotPositiveDefinite)?);
        }
        for block in &mut self.small.blocks {
            block.fill(0.0);
        }
        for (list, inverse) in self.at_point.iter().zip(&self.inverse) {
            for (k, a) in list {
                for (l, b) in list.iter().filter(|(l, _)| l <= k) {
                    if let Some(slot) = self.small.pattern.slot(*k, *l) {
                        self.small.blocks[slot] += inverse * (a * b);
                    }
                }
            }
        }
        Cholesky::for_pattern(&mut self.factor, &self.small.pattern)?
            .prepare(&self.small, &self.workers)
    }

    /// `z = D^-1 r`.
    pub(super) fn divide(&self, r: &[Vec3], z: &mut [Vec3]) {
        for ((z, r), inverse) in z.iter_mut().zip(r).zip(&self.inverse) {
            *z = inverse * r;
        }
    }

    /// `z <- P z`.
    pub(super) fn project(&mut self, z: &mut [Vec3]) -> Result<(), LinearError> {
        for (right, row) in self.right.iter_mut().zip(&self.rows) {
            *right = row.iter().map(|(p, e)| z[*p as usize] * *e).sum();
        }
        self.solve()?;
        for (p, list) in self.at_point.iter().enumerate() {
            z[p] -= self.inverse[p] * self.force(list);
        }
        Ok(())
    }

    /// `r <- P^T r`.
    pub(super) fn restrict(&mut self, r: &mut [Vec3]) -> Result<(), LinearError> {
        for (right, row) in self.right.iter_mut().zip(&self.rows) {
            let terms = row.iter().map(|(p, e)| {
                let p = *p as usize;
                self.inverse[p] * r[p] * *e
            });
            *right = terms.sum();
        }
        self.solve()?;
        for (r, list) in r.iter_mut().zip(&self.at_point) {
            *r -= self.force(list);
        }
        Ok(())
    }

    /// Multipliers `(C D^-1 C^T)^-1 right`.
    fn solve(&mut self) -> Result<(), LinearError> {
        let factor = self.factor.as_mut().ok_or(LinearError::NoConvergence)?;
        factor.solve(&self.right, &mut self.multipliers, &self.workers)
    }

    /// `C^T lam` at a point.
    fn force(&self, list: &[(u32, f64)]) -> Vec3 {
        let terms = list.iter().map(|(k, e)| self.multipliers[*k as usize] * *e);
        terms.sum()
    }

    pub(super) fn bytes(&self) -> usize {
        size_of::<Mat3>() * (self.inverse.len() + self.small.blocks.len())
            + 32 * self.rows.iter().map(Vec::len).sum::<usize>()
            + self.factor.as_ref().map_or(0, Cholesky::bytes)
    }
}
