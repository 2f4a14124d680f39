//! Which linear solver.
//!
//! The crossover was measured by `benches/linear.rs` on sewn cloth (time to a relative residual of
//! 1e-6, one core of an AMD Zen 3). With `n` vertices, Cholesky takes about
//! `0.135 s (n / 10^4)^1.6`; an iteration with IC(0) takes `0.12 us n`, and it needs about
//! `2.9 sqrt(rho)` of them, where `rho` is the stiffness of a vertex over its mass by the squared
//! step. So iterating wins by a fair margin when
//! `rho < 900 (n / 10^4)^1.2`: at 10^4 vertices of a light shirt up to steps of 3 ms.
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

/// Stiffness over mass below which iterating wins at `CROSSOVER_VERTICES` vertices.
const CROSSOVER_RATIO: f64 = 900.0;
const CROSSOVER_VERTICES: f64 = 10_000.0;
/// Growth of that ratio with the number of vertices.
const CROSSOVER_EXPONENT: f64 = 1.2;

/// A solver by its number in the settings: 0 chooses for each matrix, 1 sparse Cholesky, 2
/// conjugate gradients with block Jacobi, 3 with incomplete Cholesky. Other numbers are taken as
/// 0: the settings refuse them at the door.
///
/// `priorities` (see [`super::ordering`]), one for each block row, mark the vertices of seams for
/// the incomplete factorization.
pub fn solver(kind: u32, priorities: Option<&[u8]>) -> Box<dyn LinearSolver> {
    match kind {
        1 => Box::new(Direct::new()),
        2 => Box::new(ConjugateGradients::new(Box::new(BlockJacobi::new()))),
        3 => Box::new(incomplete(priorities)),
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
    ratio < CROSSOVER_RATIO * (n as f64 / CROSSOVER_VERTICES).powf(CROSSOVER_EXPONENT)
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
