//! Direct solution by [`cholesky`](super::cholesky) in f64.
//!
//! The accuracy is that of backward stable Cholesky, so the tolerance handed to `solve` is not
//! looked at.

use super::cholesky::Cholesky;
use super::{LinearError, LinearSolver};
use crate::math::Vec3;
use crate::math::block::BlockMatrix;
use crate::math::parallel::Workers;

/// Sparse Cholesky with a cached symbolic analysis.
#[derive(Default)]
pub struct Direct {
    cholesky: Option<Cholesky<f64>>,
    /// Whether the factor belongs to the matrix last prepared.
    factored: bool,
    workers: Workers,
}

impl Direct {
    /// A solver that has seen no matrix yet.
    pub fn new(workers: &Workers) -> Self {
        Self {
            workers: workers.clone(),
            ..Self::default()
        }
    }

    /// Gives the memory of the factor back.
    pub(super) fn drop_factor(&mut self) {
        self.cholesky = None;
        self.factored = false;
    }

    /// Stored numbers of the factor, padding of supernodes included; 0 before the first matrix.
    pub fn factor_length(&self) -> usize {
        self.cholesky.as_ref().map_or(0, Cholesky::factor_length)
    }
}

impl LinearSolver for Direct {
    fn name(&self) -> &'static str {
        "cholesky"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.factored = false;
        Cholesky::for_pattern(&mut self.cholesky, &matrix.pattern)?
            .prepare(matrix, &self.workers)?;
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
        match &mut self.cholesky {
            Some(cholesky) if self.factored && b.len() == cholesky.n() => {
                cholesky.solve(b, x, &self.workers)?;
                Ok(1)
            }
            _ => Err(LinearError::NoConvergence),
        }
    }

    fn bytes(&self) -> usize {
        self.cholesky.as_ref().map_or(0, Cholesky::bytes)
    }
}
