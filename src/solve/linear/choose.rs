//! Which linear solver.
//!
//! The crossover was measured by `benches/linear.rs` on sewn cloth (time to a relative residual of
//! 1e-6 without the symbolic analysis, one core of an AMD Zen 3). With `rho` the stiffness of a
//! vertex over its mass by the squared step, IC(0) against Cholesky takes
//!
//! | vertices | rho, ms against ms | | |
//! |---|---|---|---|
//! | 1 600 | 16: 2.3, 5.4 | 140: 6.6, 5.6 | 1 600: 13, 10 |
//! | 4 800 | 50: 11, 36 | 430: 28, 44 | 4 800: 55, 43 |
//! | 10 000 | 100: 41, 134 | 900: 97, 148 | 10 000: 286, 149 |
//! | 30 000 | 300: 284, 817 | 2 700: 2 060, 813 | 30 000: 4 100, 691 |
//!
//! so that iterating wins by a fair margin where `rho < 700 min(1, (n / 5000)^1.7)`: for a shirt of
//! 10^4 vertices, up to steps of about 3 ms.
//!
//! `rho` is read off the matrix: internal stiffness has zero row sums, so what a row's blocks sum
//! to is its mass term, and `rho` is the median over vertices of trace(diagonal block) over
//! trace(row sum). Vertices held by a body count as heavy ones, the median ignores them while they
//! are few. The choice is a function of the matrix alone, so a restored run takes the same.

use super::direct::Direct;
use super::ic0::{IncompleteCholesky, Order, Storage};
use super::jacobi::BlockJacobi;
use super::pcg::ConjugateGradients;
use super::{LinearError, LinearSolver};
use crate::math::block::BlockMatrix;
use crate::math::{Mat3, Vec3};

/// Stiffness over mass below which iterating wins on large garments.
const CROSSOVER_RATIO: f64 = 700.0;
/// Vertices below which the direct solver gains.
const CROSSOVER_VERTICES: f64 = 5_000.0;
/// How fast it gains.
const CROSSOVER_EXPONENT: f64 = 1.7;

/// Vertices below which either takes less than some milliseconds and Cholesky is not worth
/// comparing.
const ALWAYS_DIRECT: usize = 800;

/// A solver by its number in the settings, for `n` block rows: 0 chooses for each matrix, 1 sparse
/// Cholesky, 2 conjugate gradients with block Jacobi, 3 with incomplete Cholesky. Other numbers are
/// taken as 0: the settings refuse them at the door.
///
/// `priorities` (see [`super::ordering`]), one for each block row, mark the vertices of seams for
/// the incomplete factorization.
pub fn solver(kind: u32, n: usize, priorities: Option<&[u8]>) -> Box<dyn LinearSolver> {
    match kind {
        1 => Box::new(Direct::new()),
        2 => Box::new(ConjugateGradients::new(Box::new(BlockJacobi::new()))),
        3 => Box::new(incomplete(priorities)),
        _ if n < ALWAYS_DIRECT => Box::new(Direct::new()),
        _ => Box::new(Automatic::new(priorities)),
    }
}

fn incomplete(priorities: Option<&[u8]>) -> ConjugateGradients {
    let order = match priorities {
        Some(p) => Order::Priorities(p.to_vec()),
        None => Order::CuthillMckee,
    };
    ConjugateGradients::new(Box::new(IncompleteCholesky::new(order, Storage::F64)))
}

/// Chooses for each matrix; what does not converge is solved directly.
pub struct Automatic {
    direct: Direct,
    iterative: ConjugateGradients,
    iterates: bool,
    ratios: Vec<f64>,
    sums: Vec<Mat3>,
}

impl Automatic {
    /// With the priorities of [`solver`].
    pub fn new(priorities: Option<&[u8]>) -> Self {
        Self {
            direct: Direct::new(),
            iterative: incomplete(priorities),
            iterates: false,
            ratios: Vec::new(),
            sums: Vec::new(),
        }
    }

    /// Median of stiffness over mass; infinite where the rows sum to nothing (statics).
    fn stiffness_ratio(&mut self, matrix: &BlockMatrix) -> f64 {
        let n = matrix.n();
        self.sums.clear();
        self.sums.resize(n, Mat3::zeros());
        for j in 0..n {
            let from = matrix.pattern.starts[j] as usize;
            self.sums[j] += matrix.blocks[from];
            for k in from + 1..matrix.pattern.starts[j + 1] as usize {
                self.sums[matrix.pattern.rows[k] as usize] += matrix.blocks[k];
                self.sums[j] += matrix.blocks[k].transpose();
            }
        }
        self.ratios.clear();
        for (j, sum) in self.sums.iter().enumerate() {
            let diagonal = matrix.blocks[matrix.pattern.starts[j] as usize].trace();
            let mass = sum.trace().max(1e-12 * diagonal);
            self.ratios.push(diagonal / mass);
        }
        if n == 0 {
            return 1.0;
        }
        *self.ratios.select_nth_unstable_by(n / 2, f64::total_cmp).1
    }
}

/// Whether iterating is the faster way for this size and stiffness ratio.
pub fn iterates(n: usize, ratio: f64) -> bool {
    let size = (n as f64 / CROSSOVER_VERTICES).min(1.0);
    ratio < CROSSOVER_RATIO * size.powf(CROSSOVER_EXPONENT)
}

impl LinearSolver for Automatic {
    fn name(&self) -> &'static str {
        if self.iterates {
            self.iterative.name()
        } else {
            self.direct.name()
        }
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        let ratio = self.stiffness_ratio(matrix);
        self.iterates = iterates(matrix.n(), ratio) && self.iterative.prepare(matrix).is_ok();
        if self.iterates {
            return Ok(());
        }
        self.direct.prepare(matrix)
    }

    fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError> {
        if self.iterates {
            match self.iterative.solve(matrix, b, x, tolerance) {
                Err(LinearError::NoConvergence) => {
                    self.iterates = false;
                    self.direct.prepare(matrix)?;
                }
                done => return done,
            }
        }
        self.direct.solve(matrix, b, x, tolerance)
    }

    fn bytes(&self) -> usize {
        self.direct.bytes()
            + self.iterative.bytes()
            + 8 * self.ratios.len()
            + size_of::<Mat3>() * self.sums.len()
    }
}
