//! Linear systems `A x = b` with symmetric positive definite block-sparse `A`, behind one trait.
//!
//! * [`direct`]: [`cholesky`] by supernodes, ordered by approximate minimum degree on the block graph; [`fronts`] factor
//!   into [`tiles`], [`substitution`] solves with these, and both have the subtrees of the elimination [`tree`] side by side.
//! * [`pcg`]: conjugate gradients with a [`pcg::Preconditioner`]: [`jacobi`] (3x3 diagonal blocks),
//!   [`ic0`] (incomplete Cholesky on the pattern of `A`, in an [`ordering`]), [`factored`] (the
//!   complete factor of an earlier matrix, of its stiff part) or [`schwarz`] (factors of overlapping parts of the [`graph`]).
//! * [`constrained`]: the same with linear constraints between the unknowns, of blended rings;
//!   [`filtered`] is a preconditioner under these.
//!   A solver that [is matrix-free](LinearSolver::is_matrix_free) gets products in place of the matrix.
//! * [`choose`]: which of them, by number or by measured crossover.

mod cholesky;
pub mod choose;
pub mod constrained;
pub mod direct;
pub mod factored;
pub mod filtered;
mod fronts;
pub mod graph;
pub mod ic0;
pub mod jacobi;
pub mod ordering;
pub mod pcg;
mod product;
pub mod schwarz;
mod stiff_part;
mod substitution;
mod tiles;
mod tree;

use crate::math::Vec3;
use crate::math::block::BlockMatrix;

/// Why a factorization or an iteration failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum LinearError {
    /// A pivot was not positive.
    NotPositiveDefinite,
    /// The iteration limit was reached, or the iteration broke down.
    NoConvergence,
}

/// One way of solving.
pub trait LinearSolver: Send {
    /// Stable name, as in reports and as users force it.
    fn name(&self) -> &'static str;
    /// Blocks whose rows the next matrices have as those of the identity: the values there stay.
    fn hold(&mut self, fixed: &[bool]) {
        let _ = fixed;
    }
    /// Takes a new matrix. Reuses the symbolic analysis while the pattern stays the same.
    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError>;
    /// Whether `solve` may be called with this matrix although an earlier one was prepared.
    fn keeps(&self, matrix: &BlockMatrix) -> bool {
        let _ = matrix;
        false
    }
    /// Drops what depends on the values of earlier matrices: the next solution is that of a new
    /// solver, bit for bit.
    fn forget(&mut self) {}
    /// Solves for `x` (whose content on entry is ignored), `matrix` being the one last prepared, or
    /// one that it [keeps](Self::keeps) for.
    /// Returns the iterations taken; a direct solve counts one.
    fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError>;
    /// Whether it is content with the diagonal blocks of a matrix and calls for products with the whole of it:
    /// [`solve_by`](Self::solve_by) is then called in the place of `solve`.
    fn is_matrix_free(&self) -> bool {
        false
    }
    /// The same as `solve` where `product(x, y)` gives `y = A x`.
    fn solve_by(
        &mut self,
        product: Product<'_>,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError> {
        let _ = (product, b, x, tolerance);
        Err(LinearError::NoConvergence)
    }
    /// Bytes held by factors and work arrays.
    fn bytes(&self) -> usize;
}

/// `y = A x` by `product(x, y)`.
pub type Product<'a> = &'a mut dyn FnMut(&[Vec3], &mut [Vec3]);
