//! Block Jacobi: the inverses of the 3x3 diagonal blocks (Saad 2003, section 12.2). Iterations grow
//! with the square root of stiffness over mass; good for short steps only. A block that is not
//! positive definite refuses the matrix.

use super::pcg::Preconditioner;
use super::{LinearError, Product};
use crate::math::block::BlockMatrix;
use crate::math::{Mat3, Vec3};

/// Inverses of the diagonal blocks.
#[derive(Default)]
pub struct BlockJacobi {
    inverses: Vec<Mat3>,
}

impl BlockJacobi {
    /// Without a matrix yet.
    pub fn new() -> Self {
        Self::default()
    }
}

impl Preconditioner for BlockJacobi {
    fn solver_name(&self) -> &'static str {
        "cg_jacobi"
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        self.inverses.resize(matrix.n(), Mat3::zeros());
        for (j, inverse) in self.inverses.iter_mut().enumerate() {
            let block = matrix.blocks[matrix.pattern.starts[j] as usize];
            *inverse = block
                .cholesky()
                .ok_or(LinearError::NotPositiveDefinite)?
                .inverse();
        }
        Ok(())
    }

    fn apply(&mut self, _product: Product<'_>, r: &[Vec3], z: &mut [Vec3]) {
        for ((z, r), inverse) in z.iter_mut().zip(r).zip(&self.inverses) {
            *z = inverse * r;
        }
    }

    fn bytes(&self) -> usize {
        self.inverses.len() * size_of::<Mat3>()
    }
}
