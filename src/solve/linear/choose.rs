//! Which linear solver.
//!
//! Newton's directions are wanted to a relative residual of 1e-3 to 1e-2. With `rho` the stiffness of a vertex
//! over its mass by the squared step, measured on cloth in motion and in drapes:
//!
//! * small `rho` (time steps): conjugate gradients with IC(0) take 10 to 30 iterations; a new
//!   incomplete factor costs little and follows every change;
//! * large `rho` (statics): their number grows without bound, while the complete factor of an earlier
//!   matrix keeps it below 15.
//!
//! CPU seconds on a machine with other work, so only their ratios count: a sheet of 1 600 vertices
//! falling over a sphere for 1 s with steps of 10 ms (`rho` about 2 400), IC(0) to 1e-2 4.0 and kept
//! factors to 3e-2 5.5; 10 000 vertices for 0.25 s (`rho` about 12 000), both to 1e-2, 9.8 and 10.7;
//! the drape of a shirt of 9 600 vertices to 1e-2 102 (two coarse levels) and 57 (one). The place of
//! the crossover between these is an estimate.
//!
//! The median does not see a few stiff vertices: where cloth that moves folds onto itself, conjugate
//! gradients with IC(0) went from 11 to 110 iterations for a Newton iteration. Once they took more than
//! [`MANY`], the matrices that follow get kept factors. A skirt of 3 986 vertices that falls down
//! itself: two steps of 1/60 s took 6.8 CPU seconds with IC(0) alone, 2.2 with kept factors.
//!
//! Yarns, whose stretch is 1e4 times as stiff as their bending, have a `rho` of 1e5 at 1 ms. Incomplete factors take hundreds of
//! iterations there: kept factors serve motion and rest, and every matrix of small systems is factored as it is. In a hanging swatch of 16 772
//! nodes a step of 1 ms took half the time by kept factors that it took by those of overlapping parts
//! ([`super::schwarz`]), both with the same error, and a quarter of the memory; at 4 292 nodes, where exact factors took twice as long as kept ones, a little
//! less; a garment of 223 485 nodes of jersey took as long, with 7.2 and 9.2 KB a node. Weaves are another matter: patches of 61 600 nodes
//! take as long by parts, of 250 000 nodes as long on one thread and two thirds of the time on two: there large ones in motion are
//! solved by parts.
//!
//! `rho` is read off the matrix: internal stiffness has zero row sums, so what a row's blocks sum
//! to is its mass term, and `rho` is the median over vertices of trace(diagonal block) over
//! trace(row sum). Vertices held by a body count as heavy ones, the median ignores them while they
//! are few. The choice is a function of the matrices since the last [`LinearSolver::forget`], so that a
//! restored run takes the same.

use super::constrained::Constrained;
use super::direct::Direct;
use super::factored::SingleFactor;
use super::filtered::{Beside, Filtered};
use super::ic0::{IncompleteCholesky, Order, Storage};
use super::jacobi::BlockJacobi;
use super::pcg::ConjugateGradients;
use super::schwarz::Schwarz;
use super::{LinearError, LinearSolver};
use crate::blend::Filter;
use crate::math::block::BlockMatrix;
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use std::sync::Arc;

/// Stiffness over mass below which incomplete factors are enough for triangles.
const CROSSOVER_RATIO: f64 = 2e4;

/// Iterations of conjugate gradients beyond which incomplete factors are not enough.
const MANY: u32 = 50;

/// Stiffness over mass of yarns in motion; 10 ms of a hanging knit are below.
const MOVING_YARNS: f64 = 1e7;

/// Blocks below which every matrix is factored: for triangles such a factor takes about a millisecond.
const ALWAYS_DIRECT: usize = 300;
/// The same of a system with yarns, in motion and in all else.
const ALWAYS_DIRECT_YARNS: [usize; 2] = [3_000, 20_000];

/// Blocks from which on weaves in motion are solved by parts.
const BY_PARTS: usize = 120_000;

/// Iterations up to which a factor is kept for the next matrix. A new one costs triangles that many, yarns, whose every iteration
/// is dear, a few.
const KEPT: u32 = 15;
/// The same of yarns, and of the factors of parts.
const KEPT_YARNS: [u32; 2] = [6, 4];

/// Part of the diagonal blocks below which a coupling of triangles is left out of a kept factor.
pub const DROPPED: f64 = 3e-3;
/// The same of yarns. In two puckered patches of a weave (61 600 nodes) conjugate gradients took 30 iterations a correction without
/// what is below 3e-3, 11 without what is below 1e-3 and 7 at 1e-4, where the factor is twice as large as the first one; a step took 8, 6 and
/// 5 s. In jersey as many, as large, and as long.
const DROPPED_YARNS: f64 = 1e-4;

/// What a system is made of, as far as its matrices show it.
#[derive(Clone, Copy)]
pub enum Made<'a> {
    /// Of triangles. The priorities (see [`super::ordering`]), one for each block row, mark the vertices of seams for the
    /// incomplete factorization.
    Triangles(Option<&'a [u8]>),
    /// Of weaves, alone or with triangles.
    Weaves,
    /// Of yarns among which there are knits.
    Knits,
}

/// A solver by its number in the settings, for `n` block rows: 0 chooses for each matrix, 1 sparse
/// Cholesky, 2 conjugate gradients with block Jacobi, 3 with incomplete Cholesky, 4 with the factor
/// of an earlier matrix, 5 with the factors of its overlapping parts, 6 with block Jacobi and without the matrix. Other numbers are
/// taken as 0: the settings refuse them at the door.
pub fn solver(kind: u32, n: usize, made: Made<'_>, workers: &Workers) -> Box<dyn LinearSolver> {
    match kind {
        1 => Box::new(Direct::new(workers)),
        2 => Box::new(ConjugateGradients::new(Box::new(BlockJacobi::new())).on(workers)),
        3 => Box::new(incomplete(made)),
        4 => Box::new(factored(made, workers)),
        5 => Box::new(parted(workers)),
        6 => Box::new(matrix_free()),
        _ if n < ALWAYS_DIRECT => Box::new(Direct::new(workers)),
        _ => Box::new(Automatic::new(made, workers)),
    }
}

/// A solver under the constraints of blended rings, by the same numbers: 2, 3 and 6 are conjugate gradients with diagonal blocks, 4 and 5
/// with factors of overlapping parts, both with the triangles as a second level.
pub fn filtered(kind: u32, filter: &Arc<Filter>, workers: &Workers) -> Box<dyn LinearSolver> {
    // vertices without energies have no diagonal blocks
    let beside = match kind {
        2 | 3 | 6 if filter.bare().is_empty() => Beside::Blocks,
        4 | 5 if filter.bare().is_empty() => Beside::Parts,
        _ => return Box::new(Constrained::new(filter, workers)),
    };
    let costly = beside == Beside::Parts;
    let levels = Box::new(Filtered::new(filter, beside, true, workers));
    let cg = ConjugateGradients::new(levels).on(workers);
    // diagonal blocks are cheap to make and take too many iterations to end early
    Box::new(if costly {
        cg.for_newton(KEPT_YARNS[1])
    } else {
        cg
    })
}

fn factored(made: Made<'_>, workers: &Workers) -> ConjugateGradients {
    let cg = |dropped| {
        let factor = SingleFactor::new(dropped, workers);
        ConjugateGradients::new(Box::new(factor)).on(workers)
    };
    match made {
        Made::Triangles(_) => cg(DROPPED).for_newton(KEPT),
        Made::Weaves | Made::Knits => cg(DROPPED_YARNS).for_newton(KEPT_YARNS[0]).in_energy(),
    }
}

fn parted(workers: &Workers) -> ConjugateGradients {
    ConjugateGradients::new(Box::new(Schwarz::new(workers)))
        .on(workers)
        .for_newton(KEPT_YARNS[1])
        .in_energy()
}

fn matrix_free() -> ConjugateGradients {
    ConjugateGradients::new(Box::new(BlockJacobi::new())).matrix_free()
}

fn incomplete(made: Made<'_>) -> ConjugateGradients {
    let order = match made {
        Made::Triangles(Some(p)) => Order::Priorities(p.to_vec()),
        _ => Order::CuthillMckee,
    };
    let factor = Box::new(IncompleteCholesky::new(order, Storage::F64));
    ConjugateGradients::new(factor)
}

/// Chooses for each matrix; what the others refuse is solved directly.
pub struct Automatic {
    direct: Direct,
    /// For matrices of triangles in which inertia has a say.
    near: Option<ConjugateGradients>,
    factored: ConjugateGradients,
    /// For large matrices of weaves in motion.
    parted: Option<ConjugateGradients>,
    chosen: Choice,
    /// Whether `near` was not enough for a matrix since the last `forget`.
    slow: bool,
    ratios: Vec<f64>,
    sums: Vec<Mat3>,
}

#[derive(Clone, Copy, PartialEq)]
enum Choice {
    Direct,
    Near,
    Factored,
    Parted,
}

impl Automatic {
    /// For what a system is made of.
    pub fn new(made: Made<'_>, workers: &Workers) -> Self {
        let triangles = matches!(made, Made::Triangles(_));
        Self {
            direct: Direct::new(workers),
            near: triangles.then(|| incomplete(made)),
            factored: factored(made, workers),
            parted: matches!(made, Made::Weaves).then(|| parted(workers)),
            chosen: Choice::Direct,
            slow: false,
            ratios: Vec::new(),
            sums: Vec::new(),
        }
    }

    fn chosen(&self) -> &dyn LinearSolver {
        match (self.chosen, &self.near, &self.parted) {
            (Choice::Near, Some(near), _) => near,
            (Choice::Factored, _, _) => &self.factored,
            (Choice::Parted, _, Some(parted)) => parted,
            _ => &self.direct,
        }
    }

    /// The solver for matrices in which inertia has a say, if it is for this one.
    fn nearby(&mut self, matrix: &BlockMatrix) -> Option<&mut ConjugateGradients> {
        if self.slow || self.near.is_none() || self.stiffness_ratio(matrix) >= CROSSOVER_RATIO {
            return None;
        }
        self.near.as_mut()
    }

    /// Whether a matrix is factored as it is.
    fn is_small(&mut self, matrix: &BlockMatrix) -> bool {
        // yarns begin and cease to slide: their blocks are counted in each matrix
        if self.near.is_some() || matrix.n() >= ALWAYS_DIRECT_YARNS[1] {
            return false;
        }
        matrix.n() < ALWAYS_DIRECT_YARNS[0] || self.stiffness_ratio(matrix) >= MOVING_YARNS
    }

    /// The solver by factors of parts, if it is for this matrix.
    fn by_parts(&mut self, matrix: &BlockMatrix) -> Option<&mut ConjugateGradients> {
        let large = self.parted.is_some()
            && matrix.n() >= BY_PARTS
            && self.stiffness_ratio(matrix) < MOVING_YARNS;
        self.parted.as_mut().filter(|_| large)
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

impl LinearSolver for Automatic {
    fn name(&self) -> &'static str {
        self.chosen().name()
    }

    fn keeps(&self, matrix: &BlockMatrix) -> bool {
        self.chosen().keeps(matrix)
    }

    fn forget(&mut self) {
        if let Some(near) = &mut self.near {
            near.forget();
        }
        self.factored.forget();
        if let Some(parted) = &mut self.parted {
            parted.forget();
        }
        self.chosen = Choice::Direct;
        self.slow = false;
    }

    fn prepare(&mut self, matrix: &BlockMatrix) -> Result<(), LinearError> {
        if let Some(near) = self.nearby(matrix)
            && near.prepare(matrix).is_ok()
        {
            self.chosen = Choice::Near;
            return Ok(());
        }
        if let Some(parted) = self.by_parts(matrix)
            && parted.prepare(matrix).is_ok()
        {
            self.chosen = Choice::Parted;
            return Ok(());
        }
        self.chosen = Choice::Factored;
        if !self.is_small(matrix) && self.factored.prepare(matrix).is_ok() {
            self.direct.drop_factor();
            return Ok(());
        }
        self.chosen = Choice::Direct;
        self.direct.prepare(matrix)
    }

    fn solve(
        &mut self,
        matrix: &BlockMatrix,
        b: &[Vec3],
        x: &mut [Vec3],
        tolerance: f64,
    ) -> Result<u32, LinearError> {
        let solved = match (self.chosen, &mut self.near, &mut self.parted) {
            (Choice::Near, Some(near), _) => near.solve(matrix, b, x, tolerance),
            (Choice::Factored, _, _) => self.factored.solve(matrix, b, x, tolerance),
            (Choice::Parted, _, Some(parted)) => parted.solve(matrix, b, x, tolerance),
            _ => return self.direct.solve(matrix, b, x, tolerance),
        };
        if self.chosen == Choice::Near {
            self.slow = !solved.as_ref().is_ok_and(|&count| count <= MANY);
        }
        match solved {
            Err(LinearError::NoConvergence) => {
                self.chosen = Choice::Direct;
                self.direct.prepare(matrix)?;
                self.direct.solve(matrix, b, x, tolerance)
            }
            done => done,
        }
    }

    fn bytes(&self) -> usize {
        self.direct.bytes()
            + self.near.as_ref().map_or(0, LinearSolver::bytes)
            + self.factored.bytes()
            + self.parted.as_ref().map_or(0, LinearSolver::bytes)
            + 8 * self.ratios.len()
            + size_of::<Mat3>() * self.sums.len()
    }
}
