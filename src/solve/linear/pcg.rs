//! Conjugate gradients with a preconditioner (Hestenes and Stiefel 1952; Saad 2003, algorithm 9.1).
//!
//! Stops when `|b - A x| <= tolerance |b|` in the Euclidean norm, that is in newtons, whatever the
//! preconditioner. Where stiff and soft forces meet that norm says little of the solution: the factor of a yarn's matrix in single precision
//! leaves a third of the residual and a hundredth of the error. There the solver also stops
//! [by what is gained](ConjugateGradients::in_energy). The recursive residual drifts from the true one as the condition number grows,
//! so the true one is computed before the answer is given, and the iteration is restarted from it
//! when it does not hold.
//!
//! A direction of negative curvature gives `NotPositiveDefinite`. Sums are added in one order,
//! so results do not depend on threads. No allocation while the size stays the same.

use super::product::Multiplication;
use super::{LinearError, LinearSolver, Product};
use crate::math::Vec3;
use crate::math::block::{BlockMatrix, BlockPattern};
use crate::math::parallel::Workers;

/// An approximation of the inverse, symmetric and positive definite.
pub trait Preconditioner: Send {
    /// Stable name of the solver made with it, as in reports.
    fn solver_name(&self) -> &'static str;
    /// Blocks whose rows the next matrices have as those of the identity. Whether it has to be prepared anew for that.
    fn hold(&mut self, fixed: &[bool]) -> bool {
        let _ = fixed;
        false
    }
    /// Replaces a residual by an equal one under constraints that the preconditioner keeps.
    fn project(&mut self, r: &mut [Vec3]) {
        let _ = r;
    }
    /// Takes a new matrix. Keeps what depends on the pattern alone while that stays the same.
    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError>;
    /// Drops what was decided by the values of earlier matrices.
    fn forget(&mut self) {}
    /// `z = M^-1 r` for the matrix last prepared; `product` is that of the one that is solved for.
    fn apply(&mut self, product: Product<'_>, r: &[Vec3], z: &mut [Vec3]);
    /// Bytes held.
    fn bytes(&self) -> usize;
}

/// Iterations after which a solution of a series is taken as it is.
const ENOUGH: u32 = 60;

/// Error in the norm of energy, over the tolerance of the residual, at which a solution is taken for good.
const ENERGY: f64 = 50.0;

/// State of a solver for the slowly changing matrices of Newton's method.
#[derive(Clone, Debug, Default)]
struct Series {
    /// Iterations up to which a preconditioner is kept for the next matrix.
    keep: u32,
    /// Pattern of the matrix that the preconditioner was made for, while it is good enough.
    prepared: Option<BlockPattern>,
}

/// Rows of vectors that one task works on.
const ROWS: usize = 4_096;

/// Times that a drifted iteration is restarted from the true residual.
const RESTARTS: u32 = 10;

/// Conjugate gradients.
pub struct ConjugateGradients {
    preconditioner: Box<dyn Preconditioner>,
    limit: Option<u32>,
    /// What is kept for a series of matrices.
    series: Option<Series>,
    /// Whether little gained ends an iteration too.
    in_energy: bool,
    /// Whether matrices come by their diagonal blocks.
    matrix_free: bool,
    workers: Workers,
    multiplication: Multiplication,
    r: Vec<Vec3>,
    z: Vec<Vec3>,
    p: Vec<Vec3>,
    q: Vec<Vec3>,
}

impl ConjugateGradients {
    /// With the default iteration limit `500 + 60 sqrt(3 n)`.
    pub fn new(preconditioner: Box<dyn Preconditioner>) -> Self {
        Self {
            preconditioner,
            limit: None,
            series: None,
            in_energy: false,
            matrix_free: false,
            workers: Workers::default(),
            multiplication: Multiplication::default(),
            r: Vec::new(),
            z: Vec::new(),
            p: Vec::new(),
            q: Vec::new(),
        }
    }

    /// For the directions of Newton's method: the preconditioner is kept for later matrices of the
    /// same pattern while the iterations are at most `keep`, and an iteration that is long or meets negative
    /// curvature ends with what it has, a direction of descent (Steihaug 1983).
    #[must_use]
    pub fn for_newton(mut self, keep: u32) -> Self {
        self.series = Some(Series {
            keep,
            prepared: None,
        });
        self.limit = Some(ENOUGH);
        self
    }

    /// The same that ends too where the last two iterations together lowered `x.A x / 2 - b.x` by
    ///
    /// ```text
    /// g_k + g_(k-1) <= 2 (50 tolerance)^2 sum_i g_i,   g_i = alpha_i r_i.z_i
    /// ```
    ///
    /// With a good preconditioner what is still to be gained, half the squared error in the norm of `A`, is about the last
    /// gain (Hestenes and Stiefel 1952, theorem 6:1; Strakos and Tichy 2002).
    #[must_use]
    pub fn in_energy(mut self) -> Self {
        self.in_energy = true;
        self
    }

    /// The same that gets of matrices their diagonal blocks and products.
    #[must_use]
    pub fn matrix_free(mut self) -> Self {
        self.matrix_free = true;
        self
    }

    /// The same on these threads.
    #[must_use]
    pub fn on(mut self, workers: &Workers) -> Self {
        self.workers = workers.clone();
        self.multiplication = Multiplication::new(workers);
        self
    }

    /// The same with its own iteration limit.
    #[must_use]
    pub fn with_limit(mut self, limit: u32) -> Self {
        self.limit = Some(limit);
        self
    }
}

impl LinearSolver for ConjugateGradients {
    fn name(&self) -> &'static str {
        self.preconditioner.solver_name()
    }

    fn hold(&mut self, fixed: &[bool]) {
        if self.preconditioner.hold(fixed) {
            self.discard();
        }
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        for work in [&mut self.r, &mut self.z, &mut self.p, &mut self.q] {
            work.resize(matrix.n(), Vec3::zeros());
        }
        self.discard();
        self.preconditioner.prepare(matrix)?;
        if let Some(series) = &mut self.series {
            series.prepared = Some(matrix.pattern.clone());
        }
        Ok(())
    }

    fn keeps(&self, matrix: &BlockMatrix) -> bool {
        let prepared = self.series.as_ref().and_then(|s| s.prepared.as_ref());
        prepared.is_some_and(|pattern| *pattern == matrix.pattern)
    }

    fn forget(&mut self) {
        self.preconditioner.forget();
        self.discard();
    }

    fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError> {
        if matrix.n() != b.len() {
            return Err(LinearError::NoConvergence);
        }
        let mut multiplication = std::mem::take(&mut self.multiplication);
        let mut product = |x: &[Vec3], y: &mut [Vec3]| multiplication.multiply(matrix, x, y);
        let solved = self.solve_by(&mut product, b, x, tolerance);
        self.multiplication = multiplication;
        solved
    }

    fn is_matrix_free(&self) -> bool {
        self.matrix_free
    }

    fn solve_by(
        &mut self,
        product: Product<'_>,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError> {
        let n = b.len();
        if [x.len(), self.r.len()] != [n; 2] {
            return Err(LinearError::NoConvergence);
        }
        x.fill(Vec3::zeros());
        self.r.copy_from_slice(b);
        self.preconditioner.project(&mut self.r);
        let goal = dot(&self.r, &self.r) * tolerance * tolerance;
        let gained = if self.in_energy {
            2.0 * (ENERGY * tolerance).powi(2)
        } else {
            0.0
        };
        if goal == 0.0 && b.iter().all(|v| *v == Vec3::zeros()) {
            return Ok(0);
        }
        if !goal.is_finite() {
            return Err(LinearError::NoConvergence);
        }
        let limit = self
            .limit
            .unwrap_or(500 + (60.0 * (3.0 * n as f64).sqrt()) as u32);
        let mut iterations = 0;
        for _ in 0..=RESTARTS {
            let done = self.iterate(product, x, [goal, gained], limit, &mut iterations);
            if let Some(keep) = self.series.as_ref().map(|s| s.keep) {
                if iterations > keep {
                    self.discard();
                }
                let direction = x.iter().any(|v| *v != Vec3::zeros());
                let finite = dot(x, x).is_finite();
                return match done {
                    Err(_) if direction && finite => Ok(iterations),
                    done => done.map(|()| iterations),
                };
            }
            done?;
            product(x, &mut self.q);
            for i in 0..n {
                self.r[i] = b[i] - self.q[i];
            }
            self.preconditioner.project(&mut self.r);
            if dot(&self.r, &self.r) <= goal {
                return Ok(iterations);
            }
        }
        Err(LinearError::NoConvergence)
    }

    fn bytes(&self) -> usize {
        4 * size_of::<Vec3>() * self.r.len()
            + self.multiplication.bytes()
            + self.preconditioner.bytes()
    }
}

impl ConjugateGradients {
    fn dot(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        let alone = Workers::default();
        // waking a thread takes longer than a short sum
        let workers = if a.len() > 2 * ROWS {
            &self.workers
        } else {
            &alone
        };
        workers.sum(a.len(), |i| a[i].dot(&b[i]))
    }

    /// The next matrix is prepared anew.
    fn discard(&mut self) {
        if let Some(series) = &mut self.series {
            series.prepared = None;
        }
    }

    /// Iterates from `x` with residual `self.r` until the square of the recursive residual meets the first goal, or what two iterations
    /// gain the second as a part of the whole gain.
    fn iterate(
        &mut self,
        product: Product<'_>,
        x: &mut [Vec3],
        [goal, gained]: [f64; 2],
        limit: u32,
        iterations: &mut u32,
    ) -> Result<(), LinearError> {
        self.preconditioner.apply(product, &self.r, &mut self.z);
        self.p.copy_from_slice(&self.z);
        let mut rz = self.dot(&self.r, &self.z);
        let mut rr = self.dot(&self.r, &self.r);
        let (mut whole, mut last) = (0.0, [f64::INFINITY; 2]);
        while rr > goal && last[0] + last[1] > gained * whole {
            if *iterations >= limit {
                return Err(LinearError::NoConvergence);
            }
            *iterations += 1;
            product(&self.p, &mut self.q);
            let curvature = self.dot(&self.p, &self.q);
            if curvature.is_nan() || rz.is_nan() {
                return Err(LinearError::NoConvergence);
            }
            if curvature <= 0.0 || rz <= 0.0 {
                if *iterations == 1 && rz > 0.0 {
                    x.copy_from_slice(&self.p);
                }
                return Err(LinearError::NotPositiveDefinite);
            }
            let alpha = rz / curvature;
            whole += alpha * rz;
            last = [last[1], alpha * rz];
            let (p, q) = (&self.p, &self.q);
            let (x_rows, r_rows) = ((&mut *x, ROWS), (&mut self.r[..], ROWS));
            self.workers.chunks_of_two(x_rows, r_rows, |c, x, r| {
                for (i, (x, r)) in (c * ROWS..).zip(x.iter_mut().zip(r)) {
                    *x += alpha * p[i];
                    *r -= alpha * q[i];
                }
            });
            self.preconditioner.project(&mut self.r);
            rr = self.dot(&self.r, &self.r);
            self.preconditioner.apply(product, &self.r, &mut self.z);
            let next = self.dot(&self.r, &self.z);
            let beta = next / rz;
            rz = next;
            let z = &self.z;
            self.workers.chunks(&mut self.p, ROWS, |c, p| {
                for (p, z) in p.iter_mut().zip(&z[c * ROWS..]) {
                    *p = z + beta * *p;
                }
            });
        }
        if rr.is_nan() {
            return Err(LinearError::NoConvergence);
        }
        Ok(())
    }
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a.dot(b)).sum()
}
