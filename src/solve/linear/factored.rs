//! The factor of the [`stiff_part`](super::stiff_part) of an earlier matrix as a preconditioner: sparse Cholesky in f32.
//!
//! Newton's method meets a series of matrices that change little. Conjugate gradients with the
//! factor of an earlier one need a handful of iterations, each at a tenth of the price of a new
//! factor. Of most of its numbers 16 bits are kept: a quarter of f64's memory, and of jersey in
//! motion as many iterations as with the whole factor in f32.

use super::cholesky::Cholesky;
use super::pcg::Preconditioner;
use super::stiff_part::StiffPart;
use super::{LinearError, Product};
use crate::math::Vec3;
use crate::math::block::BlockMatrix;
use crate::math::parallel::Workers;

/// Cholesky factor in f32.
pub struct SingleFactor {
    stiff: StiffPart,
    cholesky: Option<Cholesky<f32>>,
    workers: Workers,
}

impl SingleFactor {
    /// A preconditioner that has seen no matrix yet; couplings below `dropped` of the diagonal blocks are not in the factor.
    pub fn new(dropped: f64, workers: &Workers) -> Self {
        Self {
            stiff: StiffPart::without(dropped),
            cholesky: None,
            workers: workers.clone(),
        }
    }
}

impl Preconditioner for SingleFactor {
    fn solver_name(&self) -> &'static str {
        "cg_cholesky"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.stiff.take(matrix);
        Cholesky::for_pattern(&mut self.cholesky, self.stiff.pattern())?
            .prepare_blocks(|slot| self.stiff.block(matrix, slot), &self.workers)
    }

    fn forget(&mut self) {
        self.stiff.forget();
    }

    fn apply(&mut self, _product: Product<'_>, r: &[Vec3], z: &mut [Vec3]) {
        let solved = match &mut self.cholesky {
            Some(cholesky) => cholesky.solve(r, z, &self.workers),
            None => Err(LinearError::NoConvergence),
        };
        if solved.is_err() {
            // an overflow of single precision ends the iteration: NaN is its sign of breakdown
            z.fill(Vec3::repeat(f64::NAN));
        }
    }

    fn bytes(&self) -> usize {
        self.stiff.bytes() + self.cholesky.as_ref().map_or(0, Cholesky::bytes)
    }
}
