//! Preconditioners for conjugate gradients under the constraints of blended rings, `C (v, p) = 0`.
//!
//! ```text
//! z = N r + Q r,   N = P M^-1 P^T,   P = I - D^-1 C^T (C D^-1 C^T)^-1 C,   Q = W (W^T A W)^-1 W^T
//! ```
//!
//! `P` leads to what the constraints admit, by moves that are small where the matrix is stiff: `D` holds its diagonal blocks
//! ([`diagonal`]). `M` is what [`Beside`] says: `D` itself (Gould, Hribar and Nocedal 2001) or the factors of
//! overlapping parts ([`super::schwarz`]), in which vertices and nodes know nothing of each other. At the border to the full
//! region nodes are stiff and vertices soft, at the other border it is the other way round, and an even weight in `P`
//! would throw the stiff ones about: with `F` in its place the iterations are six times as many.
//!
//! The second level, on request, is the matrix of the triangles everywhere, those under yarns too: `W` lets every node ride on
//! its triangle, which the constraints admit. Beside parts, whose every use is dear, the levels are taken one after the other, the triangles
//! before and after (the balancing form; Tang et al. 2009, J. Sci. Comput. 39, table 1),
//!
//! ```text
//! z = Q r + (I - Q A) N (I - A Q) r
//! ```
//!
//! symmetric and positive definite with `N`, whatever symmetric `A` is in it: the matrix that is solved for, be the levels those of an earlier one. It costs two products with that and takes 29 iterations to 1e-3 where
//! the sum takes 65 (triangles of 20 pitches, 10 ms), 6 where it takes 17 at 5 pitches. Overlaps of 2 and 3 blocks in the place of 1 left the sum at 73 and
//! 70, parts of twice the size at 59.
//!
//! Rounding lets the residual drift out of what the constraints admit, from where the iteration diverges. So what
//! it has along `C^T`, which does no work, is taken away in every iteration ([`Filter::restrict`]).

mod diagonal;
mod triangles;

use super::pcg::Preconditioner;
use super::schwarz::Schwarz;
use super::{LinearError, Product};
use crate::blend::Filter;
use crate::math::Vec3;
use crate::math::block::BlockMatrix;
use crate::math::parallel::Workers;
use diagonal::Diagonal;
use std::sync::Arc;
use triangles::Triangles;

/// What stands for the matrix beside the triangles.
#[derive(Clone, Debug, PartialEq)]
pub enum Beside {
    /// Lumped masses over the square of the step, by point [N/m]; diagonal blocks on what is no point. On filtered residuals this
    /// is `(S M + mu (I - S))^-1`, the paper's (Casafranca et al. 2020, equation 12) in units that agree.
    Mass(Vec<f64>),
    /// Diagonal blocks of the matrix.
    Blocks,
    /// Factors of overlapping parts of the matrix.
    Parts,
}

/// A preconditioner that keeps the constraints.
pub struct Filtered {
    filter: Arc<Filter>,
    fixed: Vec<bool>,
    diagonal: Diagonal,
    parts: Option<Schwarz>,
    triangles: Option<Triangles>,
    right: Vec<Vec3>,
    /// What the triangles say, and what is left of the residual then.
    work: [Vec<Vec3>; 2],
    of_mass: bool,
}

impl Filtered {
    /// For matrices of a system with this filter, whose vertices must all have energies; `second` adds the level of the
    /// triangles.
    pub fn new(filter: &Arc<Filter>, beside: Beside, second: bool, workers: &Workers) -> Self {
        let parts = beside == Beside::Parts;
        let masses = match beside {
            Beside::Mass(masses) => Some(masses),
            Beside::Blocks | Beside::Parts => None,
        };
        Self {
            filter: filter.clone(),
            fixed: Vec::new(),
            of_mass: masses.is_some(),
            diagonal: Diagonal::new(filter, masses, workers),
            parts: parts.then(|| Schwarz::new(workers)),
            triangles: second.then(|| Triangles::new(filter, workers)),
            right: Vec::new(),
            work: [Vec::new(), Vec::new()],
        }
    }

    fn first(
        &mut self,
        product: Product<'_>,
        r: &[Vec3],
        z: &mut [Vec3],
    ) -> Result<(), LinearError> {
        let Some(parts) = &mut self.parts else {
            self.diagonal.divide(r, z);
            return self.diagonal.project(z);
        };
        self.right.clear();
        self.right.extend_from_slice(r);
        self.diagonal.restrict(&mut self.right)?;
        for (r, fixed) in self.right.iter_mut().zip(&self.fixed) {
            if *fixed {
                r.fill(0.0);
            }
        }
        parts.apply(product, &self.right, z);
        self.diagonal.project(z)
    }

    /// One level after the other.
    fn balanced(
        &mut self,
        triangles: &mut Triangles,
        product: Product<'_>,
        r: &[Vec3],
        z: &mut [Vec3],
    ) -> Result<(), LinearError> {
        let mut work = std::mem::take(&mut self.work);
        let [coarse, left] = &mut work;
        for list in [&mut *coarse, &mut *left] {
            list.clear();
            list.resize(r.len(), Vec3::zeros());
        }
        triangles.add(1.0, r, coarse)?;
        product(coarse, left);
        for (left, r) in left.iter_mut().zip(r) {
            *left = r - *left;
        }
        self.first(product, left, z)?;
        product(z, left);
        triangles.add(-1.0, left, z)?;
        for (z, coarse) in z.iter_mut().zip(&*coarse) {
            *z += coarse;
        }
        self.work = work;
        Ok(())
    }

    fn levels(
        &mut self,
        product: Product<'_>,
        r: &[Vec3],
        z: &mut [Vec3],
    ) -> Result<(), LinearError> {
        let Some(mut triangles) = self.triangles.take() else {
            return self.first(product, r, z);
        };
        let done = if self.parts.is_some() {
            self.balanced(&mut triangles, product, r, z)
        } else {
            (self.first(product, r, z)).and_then(|()| triangles.add(1.0, r, z))
        };
        self.triangles = Some(triangles);
        done
    }
}

impl Preconditioner for Filtered {
    fn solver_name(&self) -> &'static str {
        match (&self.parts, &self.triangles) {
            (None, None) if self.of_mass => "cg_filtered_mass",
            (None, Some(_)) if self.of_mass => "cg_filtered_mass_two_levels",
            (None, None) => "cg_filtered_blocks",
            (None, Some(_)) => "cg_filtered_two_levels",
            (Some(_), None) => "cg_filtered_schwarz",
            (Some(_), Some(_)) => "cg_filtered_schwarz_two_levels",
        }
    }

    fn hold(&mut self, fixed: &[bool]) -> bool {
        let changed = self.fixed != fixed;
        if changed {
            self.fixed.clear();
            self.fixed.extend_from_slice(fixed);
        }
        changed
    }

    fn project(&mut self, r: &mut [Vec3]) {
        self.filter.restrict(r);
        for (r, fixed) in r.iter_mut().zip(&self.fixed) {
            if *fixed {
                r.fill(0.0);
            }
        }
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        // what is not known to be held moves
        self.fixed.resize(matrix.n(), false);
        self.diagonal.prepare(matrix, &self.fixed)?;
        if let Some(parts) = &mut self.parts {
            parts.prepare(matrix)?;
        }
        let Some(triangles) = &mut self.triangles else {
            return Ok(());
        };
        triangles.prepare(matrix, &self.fixed)
    }

    fn apply(&mut self, product: Product<'_>, r: &[Vec3], z: &mut [Vec3]) {
        if self.levels(product, r, z).is_err() {
            // NaN is the iteration's sign of breakdown
            z.fill(Vec3::repeat(f64::NAN));
        }
    }

    fn bytes(&self) -> usize {
        self.fixed.len()
            + size_of_val(&self.right[..])
            + self.work.iter().map(|w| size_of_val(&w[..])).sum::<usize>()
            + self.diagonal.bytes()
            + self.parts.as_ref().map_or(0, Schwarz::bytes)
            + self.triangles.as_ref().map_or(0, Triangles::bytes)
    }
}
