//! Newton's method with a line search on the incremental potential of one substep.
//!
//! ```text
//! Phi(x) = sum_i w_i/2 |x_i - xhat_i|^2 + V(x),   w_i = m_i (1/h^2 + alpha/h)
//! ```
//!
//! Backward Euler is the stationary point for `xhat = x0 + h v0 / (1 + alpha h)`; a static relaxation
//! uses the same with `v0 = 0`. No step is accepted that raises `Phi`.

use super::linear::{LinearError, LinearSolver};
use super::local::Local;
use crate::blend::Coupling;
use crate::error::{Error, Result, Status};
use crate::math::block::BlockMatrix;
use crate::math::parallel::Workers;
use crate::math::{Mat3, Vec3};
use crate::system::assemble::{Assembler, Products, complete, energy, fix_rows};
use crate::system::term::{Configuration, HessianKind, Term, World};

/// The quadratic part of the incremental potential.
#[derive(Clone, Copy)]
pub struct Inertia<'a> {
    /// Weight of each vertex [N/m].
    pub weight: &'a [f64],
    /// Where the quadratic part is least [m].
    pub center: &'a [Vec3],
    /// What inertia resists a force with [N/m]: the weight, or the lumped equal of inertia that
    /// terms bring.
    pub measure: &'a [f64],
}

/// When to stop.
#[derive(Clone, Copy, Debug)]
pub struct Tolerance {
    /// Largest correction of a coordinate's vertex [m].
    pub displacement: f64,
    /// Decrease of `Phi` in an iteration over that in all of them.
    pub relative: f64,
    /// What the decrease in all of them is counted from [J], where that is not the start.
    pub first: Option<f64>,
    /// A full correction, with what few nodes were moved for it, over the whole displacement, both as root mean squares weighted by
    /// what inertia resists with.
    pub motion: f64,
    /// Largest force on a free vertex [N].
    pub force: f64,
    /// Newton iterations.
    pub iterations: u32,
    /// Relative residual of the linear solver.
    pub linear: f64,
    /// How much of the exact Hessian is tried in the first iteration, see [`HessianKind`].
    pub exactness: f64,
    /// How much of it is tried later.
    pub most_exactness: f64,
    /// Whether all of that is tried as soon as a full correction does what its model promised, instead
    /// of step by step.
    pub hasty: bool,
    /// Whether a matrix that is not positive definite ends the solve instead of being made so by
    /// less of the exact Hessian.
    pub strict: bool,
    /// Whether the few blocks that are worse than all others are solved for by themselves, between corrections and where the
    /// line search refuses a full one.
    pub settle: bool,
}

/// How a solve ended.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Summary {
    /// Whether a tolerance was met.
    pub converged: bool,
    /// Newton iterations.
    pub iterations: u32,
    /// Linear iterations.
    pub linear_iterations: u64,
    /// Largest force on a free vertex when it was last evaluated [N].
    pub residual: f64,
    /// The same before the first correction, without the quadratic part: the static residual of
    /// the start [N].
    pub static_residual: f64,
    /// Length of the last line search, 1 for a full step, 0 if none was found.
    pub last_length: f64,
    /// Largest displacement in the last correction [m].
    pub moved: f64,
    /// How much of the exact Hessian the last correction used.
    pub exactness: f64,
    /// Decrease of `Phi` by the last correction over what its quadratic model promised.
    pub agreement: f64,
    /// Whether a strict solve met a matrix that is not positive definite.
    pub indefinite: bool,
    /// Corrections by a matrix at a point where nothing was carried any more.
    pub corrections: u32,
}

/// What a Newton solve works on and with.
#[derive(Clone, Copy)]
pub struct Problem<'a> {
    /// Energies.
    pub terms: &'a [Box<dyn Term>],
    /// World at the end of the substep.
    pub world: &'a World<'a>,
    /// Start of the substep [m].
    pub x0: &'a [Vec3],
    /// Material coordinates of yarns at the start of the substep [m].
    pub u: &'a [f64],
    /// One over the substep size [1/s], 0 in statics.
    pub inv_dt: f64,
    /// Quadratic part.
    pub inertia: Inertia<'a>,
    /// Vertices that keep their place, and points that ride.
    pub fixed: &'a [bool],
    /// What joins points to each other.
    pub coupling: &'a Coupling,
    /// Threads.
    pub workers: &'a Workers,
}

/// Vectors that live as long as the solver does.
#[derive(Debug, Default)]
pub struct Work {
    gradient: Vec<Vec3>,
    /// The gradient by coordinates that are independent.
    gathered: Vec<Vec3>,
    negative: Vec<Vec3>,
    direction: Vec<Vec3>,
    trial: Vec<Vec3>,
    /// Of products without a matrix.
    products: Vec<Vec3>,
    local: Local,
}

impl Work {
    /// Bytes held.
    pub(super) fn bytes(&self) -> usize {
        let vectors = [
            &self.gradient,
            &self.gathered,
            &self.negative,
            &self.direction,
            &self.trial,
            &self.products,
        ];
        vectors.map(|v| size_of_val(&v[..])).iter().sum::<usize>() + self.local.bytes()
    }

    fn resize(&mut self, n: usize) {
        for v in [
            &mut self.gradient,
            &mut self.gathered,
            &mut self.negative,
            &mut self.direction,
            &mut self.trial,
        ] {
            v.resize(n, Vec3::zeros());
        }
    }
}

/// Part of the displacement tolerance below which a force that inertia alone resists is no force.
const UNMOVED: f64 = 1e-3;
/// Decrease over the promised one from which a model is to be trusted.
const AGREES: f64 = 0.5;
/// Small corrections in one solve that are not taken for convergence at once.
const DOUBTS: u32 = 4;

impl Problem<'_> {
    pub(super) fn at<'b>(&'b self, x: &'b [Vec3]) -> Configuration<'b> {
        Configuration {
            x,
            x0: self.x0,
            u: self.u,
            inv_dt: self.inv_dt,
            world: self.world,
        }
    }

    /// `Phi` [J].
    pub fn value(&self, x: &[Vec3]) -> f64 {
        let inertia = self.workers.sum(x.len(), |i| {
            0.5 * self.inertia.weight[i] * (x[i] - self.inertia.center[i]).norm_squared()
        });
        inertia + energy(self.terms, &self.at(x), self.workers)
    }

    /// Distance of two points, weighted by what inertia resists with [N m, square root].
    fn weighed(&self, a: &[Vec3], b: &[Vec3]) -> f64 {
        let pairs = a.iter().zip(b).zip(self.inertia.measure);
        let square = |((a, b), w): ((&Vec3, &Vec3), &f64)| w * (b - a).norm_squared();
        pairs.map(square).sum::<f64>().sqrt()
    }

    /// Names an energy that is not finite.
    fn unbounded(&self, x: &[Vec3]) -> String {
        let at = self.at(x);
        let mut terms = self.terms.iter().filter(|term| !term.is_idle(&at));
        let found = terms.find(|term| {
            let mut values = (0..term.stencils().count()).map(|e| term.value(e, &at));
            values.any(|value| !value.is_finite())
        });
        format!("the energy of {}", found.map_or("motion", |t| t.name()))
    }

    /// Force on what moves, as large as it is anywhere [N].
    fn size(&self, gradient: &[Vec3], gathered: &mut [Vec3]) -> f64 {
        if self.coupling.filter.is_none() {
            return largest(gradient);
        }
        gathered.copy_from_slice(gradient);
        self.coupling.gather(gathered);
        for (g, fixed) in gathered.iter_mut().zip(self.fixed) {
            if *fixed {
                g.fill(0.0);
            }
        }
        largest(gathered)
    }

    fn derivatives(
        &self,
        x: &[Vec3],
        kind: HessianKind,
        way: Option<&[Vec3]>,
        assembler: &mut Assembler,
        work: &mut Work,
    ) -> f64 {
        let Work {
            gradient, gathered, ..
        } = work;
        gradient.fill(Vec3::zeros());
        let matrix: &mut BlockMatrix = assembler.matrix_mut();
        self.workers.chunks(&mut matrix.blocks, 4_096, |_, blocks| {
            blocks.fill(Mat3::zeros());
        });
        for (i, w) in self.inertia.weight.iter().enumerate() {
            let slot = matrix.pattern.starts[i] as usize;
            for d in 0..3 {
                matrix.blocks[slot][(d, d)] = *w;
            }
        }
        assembler.add(self.terms, &self.at(x), Some(kind), self.workers, gradient);
        if let Some(way) = way {
            assembler.matrix().add_product(way, gradient);
        }
        let matrix = assembler.matrix_mut();
        fix_rows(matrix, self.fixed, self.workers);
        complete(matrix);
        for (g, fixed) in gradient.iter_mut().zip(self.fixed) {
            if *fixed {
                g.fill(0.0);
            }
        }
        let residual = self.size(gradient, gathered);
        for (i, g) in gradient.iter_mut().enumerate() {
            if !self.fixed[i] {
                *g += (x[i] - self.inertia.center[i]) * self.inertia.weight[i];
            }
        }
        residual
    }

    /// `y = A p` with the Hessian of `Phi` at `x`, as [`Self::derivatives`] assembles it.
    fn times(
        &self,
        x: &[Vec3],
        kind: HessianKind,
        widths: &[u8],
        (p, y): (&[Vec3], &mut [Vec3]),
        work: &mut Vec<Vec3>,
    ) {
        for ((y, p), w) in y.iter_mut().zip(p).zip(self.inertia.weight) {
            *y = p * *w;
        }
        let products = Products {
            terms: self.terms,
            at: self.at(x),
            kind,
            riders: &self.coupling.riders,
            workers: self.workers,
        };
        // what is fixed has zeros in `p`
        products.add(p, y, work);
        for ((y, p), width) in y.iter_mut().zip(p).zip(widths) {
            for c in usize::from(*width)..3 {
                y[c] = p[c];
            }
        }
        for ((y, p), fixed) in y.iter_mut().zip(p).zip(self.fixed) {
            if *fixed {
                *y = *p;
            }
        }
    }

    /// The gradient of `Phi` where it is free.
    fn slope(&self, x: &[Vec3], assembler: &mut Assembler, gradient: &mut [Vec3]) {
        gradient.fill(Vec3::zeros());
        assembler.add(self.terms, &self.at(x), None, self.workers, gradient);
        for (i, g) in gradient.iter_mut().enumerate() {
            if self.fixed[i] {
                g.fill(0.0);
            } else {
                *g += (x[i] - self.inertia.center[i]) * self.inertia.weight[i];
            }
        }
    }

    /// Largest force on a free vertex at `x` [N], and how far the free vertices would be carried if
    /// nothing but inertia resisted it [m].
    fn remains(&self, x: &[Vec3], assembler: &mut Assembler, gradient: &mut [Vec3]) -> (f64, f64) {
        gradient.fill(Vec3::zeros());
        assembler.add(self.terms, &self.at(x), None, self.workers, gradient);
        let (mut force, mut reach) = (0.0_f64, 0.0_f64);
        for (i, g) in gradient.iter_mut().enumerate() {
            if self.fixed[i] {
                continue;
            }
            *g += (x[i] - self.inertia.center[i]) * self.inertia.weight[i];
        }
        self.coupling.gather(gradient);
        for (i, g) in gradient.iter().enumerate().filter(|(i, _)| !self.fixed[*i]) {
            let size = g.norm();
            force = force.max(size);
            reach = reach.max(size / self.inertia.measure[i]);
        }
        (force, reach)
    }

    /// Moves the fixed vertices along `way` and the others by the linear answer to it. Returns how
    /// many matrices were tried; the answer is none if no one could be solved.
    pub fn answer(
        &self,
        x: &[Vec3],
        way: &[Vec3],
        assembler: &mut Assembler,
        linear: &mut dyn LinearSolver,
        work: &mut Work,
    ) -> (u32, Option<Vec<Vec3>>) {
        work.resize(x.len());
        linear.hold(self.fixed);
        let mut tried = 0;
        for kind in [HessianKind::Exact, HessianKind::Psd] {
            tried += 1;
            self.derivatives(x, kind, Some(way), assembler, work);
            for (m, g) in work.negative.iter_mut().zip(&work.gradient) {
                *m = -g;
            }
            let matrix = assembler.matrix();
            let solved = linear
                .prepare(matrix)
                .and_then(|()| linear.solve(matrix, &work.negative, &mut work.direction, 0.0));
            if solved.is_ok() {
                self.coupling.carry(&mut work.direction);
                // the rows of fixed vertices have no answer
                let moved = x.iter().zip(way).zip(&work.direction);
                return (tried, Some(moved.map(|((x, w), d)| x + w + d).collect()));
            }
        }
        (tried, None)
    }

    /// Whether `Phi` is convex around `x`: whether its exact Hessian has a Cholesky factor.
    pub fn is_convex(
        &self,
        x: &[Vec3],
        assembler: &mut Assembler,
        linear: &mut dyn LinearSolver,
        work: &mut Work,
    ) -> bool {
        work.resize(x.len());
        linear.hold(self.fixed);
        self.derivatives(x, HessianKind::Exact, None, assembler, work);
        linear.prepare(assembler.matrix()).is_ok()
    }

    /// Minimises `Phi` from `x`, which holds the best admissible point on return.
    pub fn minimise(
        &self,
        x: &mut [Vec3],
        tolerance: &Tolerance,
        assembler: &mut Assembler,
        linear: &mut dyn LinearSolver,
        work: &mut Work,
    ) -> Result<Summary> {
        let n = x.len();
        work.resize(n);
        linear.hold(self.fixed);
        let mut summary = Summary::default();
        let mut value = self.value(x);
        if !value.is_finite() {
            return Err(not_finite(&self.unbounded(x)));
        }
        work.local.forget();
        let mut exactness = tolerance.exactness;
        let mut doubts = 0;
        let first = tolerance.first.unwrap_or(value);
        for iteration in 0..tolerance.iterations {
            loop {
                let kept = linear.keeps(assembler.matrix());
                let kind = if kept {
                    HessianKind::Part(tolerance.most_exactness)
                } else {
                    HessianKind::Part(exactness)
                };
                let still = self.derivatives(x, kind, None, assembler, work);
                summary.residual = self.size(&work.gradient, &mut work.gathered);
                if iteration == 0 {
                    summary.static_residual = still;
                }
                if !summary.residual.is_finite() {
                    return Err(not_finite("force"));
                }
                if summary.residual <= tolerance.force {
                    summary.converged = true;
                    return Ok(summary);
                }
                for (m, g) in work.negative.iter_mut().zip(&work.gradient) {
                    *m = -g;
                }
                let matrix = assembler.matrix();
                let prepared = if kept { Ok(()) } else { linear.prepare(matrix) };
                let Work {
                    negative,
                    direction,
                    products,
                    ..
                } = work;
                let solved = prepared.and_then(|()| {
                    if linear.is_matrix_free() {
                        let mut product = |p: &[Vec3], y: &mut [Vec3]| {
                            self.times(x, kind, &matrix.pattern.widths, (p, y), products);
                        };
                        linear.solve_by(&mut product, negative, direction, tolerance.linear)
                    } else {
                        linear.solve(matrix, negative, direction, tolerance.linear)
                    }
                });
                match solved {
                    Ok(iterations) => {
                        self.coupling.carry(&mut work.direction);
                        summary.linear_iterations += u64::from(iterations);
                        summary.exactness = kind.exactness();
                        break;
                    }
                    // not positive definite: less of the exact Hessian
                    Err(_) if kept => linear.forget(),
                    Err(_) if tolerance.strict => {
                        summary.indefinite = true;
                        return Ok(summary);
                    }
                    Err(_) if exactness > 0.0 => {
                        summary.indefinite = true;
                        exactness = if exactness > 0.3 {
                            0.5 * exactness
                        } else {
                            0.0
                        };
                    }
                    Err(error) => return Err(linear_error(error)),
                }
            }
            summary.iterations += 1;
            summary.corrections += 1;
            let slope: f64 = dot(&work.gradient, &work.direction);
            let reach = largest(&work.direction);
            if !slope.is_finite() || !reach.is_finite() {
                return Err(not_finite("Newton correction"));
            }
            // below the rounding of the energy a decrease cannot be seen: trust the correction
            let noise = 1e-13 * value.abs().max(1e-12);
            let mut length = 1.0;
            let (mut gain, mut moved) = (0.0, f64::INFINITY);
            let mut mended = !tolerance.settle;
            loop {
                for i in 0..n {
                    work.trial[i] = x[i] + work.direction[i] * length;
                }
                let mut trial = self.value(&work.trial);
                let most = value + 1e-4 * length * slope + noise;
                if !mended && trial.is_finite() && trial > most {
                    mended = true;
                    self.slope(&work.trial, assembler, &mut work.negative);
                    let matrix = assembler.matrix();
                    let Work {
                        local,
                        negative,
                        trial: at,
                        ..
                    } = &mut *work;
                    trial -= local.settle(self, matrix, negative, at);
                }
                if trial <= most {
                    if tolerance.motion > 0.0 {
                        moved = self.weighed(x, &work.trial);
                    }
                    x.copy_from_slice(&work.trial);
                    gain = value - trial;
                    value = trial;
                    break;
                }
                length *= 0.5;
                if length < 1e-8 {
                    length = 0.0;
                    break;
                }
            }
            summary.last_length = length;
            summary.agreement = -gain / (slope * length * (1.0 - 0.5 * length));
            summary.moved = length * reach;
            exactness = if tolerance.strict {
                exactness
            } else if length < 1.0 {
                0.0
            } else if tolerance.hasty && summary.agreement > AGREES && !summary.indefinite {
                tolerance.most_exactness
            } else {
                (2.0 * exactness).max(0.25).min(tolerance.most_exactness)
            };
            if length == 0.0 {
                return Ok(summary);
            }
            if tolerance.relative > 0.0 && gain <= tolerance.relative * (first - value) {
                summary.converged = true;
                return Ok(summary);
            }
            if tolerance.motion > 0.0
                && length == 1.0
                && moved <= tolerance.motion * self.weighed(self.x0, x)
            {
                summary.converged = true;
                return Ok(summary);
            }
            if length * reach <= tolerance.displacement {
                // where friction sticks in the model but slips in truth the correction is small and
                // wrong: a small one counts only if it has lowered the force, or if what is left
                // cannot move anything
                let (force, reach) = self.remains(x, assembler, &mut work.gradient);
                if force <= 0.5 * summary.residual
                    || reach <= UNMOVED * tolerance.displacement
                    || doubts == DOUBTS
                {
                    summary.converged = true;
                    return Ok(summary);
                }
                doubts += 1;
            }
            if tolerance.settle && iteration + 1 < tolerance.iterations {
                self.slope(x, assembler, &mut work.negative);
                let matrix = assembler.matrix();
                value -= work.local.settle(self, matrix, &work.negative, x);
            }
        }
        Ok(summary)
    }
}

/// Largest Euclidean norm [same unit].
pub fn largest(v: &[Vec3]) -> f64 {
    // max would swallow a NaN
    v.iter()
        .map(Vec3::norm_squared)
        .fold(0.0, |a: f64, b| if b > a || b.is_nan() { b } else { a })
        .sqrt()
}

fn dot(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter().zip(b).map(|(p, q)| p.dot(q)).sum()
}

fn not_finite(what: &str) -> Error {
    Error::new(Status::NoAdmissibleState, format!("{what} is not finite"))
}

fn linear_error(error: LinearError) -> Error {
    let text = match error {
        LinearError::NotPositiveDefinite => "the matrix of a Newton step is not positive definite",
        LinearError::NoConvergence => "the linear solver did not converge",
    };
    Error::new(Status::LinearSolve, text)
}
