//! One compiled system with what is needed to advance it: terms, matrix, linear solver, threads.

mod present;

use super::admissible::inadmissible;
use super::carry::Carry;
use super::linear::LinearSolver;
use super::linear::choose::{self, Made};
use super::linear::constrained::Constrained;
use super::linear::direct::Direct;
use super::linear::ordering::seam_priorities;
use super::newton::{Inertia, Problem, Summary, Tolerance, Work, largest};
use super::pace::ALMOST;
use super::settings::Settings;
use crate::error::Result;
use crate::math::Vec3;
use crate::math::parallel::Workers;
use crate::system::assemble::Assembler;
use crate::system::bodies::AtStart;
use crate::system::build::{BuildOptions, System};
use crate::system::state::State;
use crate::system::term::{Configuration, World};

/// Corrections of one attempt at rest.
const REST_ITERATIONS: u32 = 8;

/// A system and its solver.
pub struct Engine {
    /// What is simulated.
    pub system: System,
    /// Tunables.
    pub settings: Settings,
    assembler: Assembler,
    linear: Box<dyn LinearSolver>,
    /// Solves at rest, where the exact Hessian has to be factored as it is.
    direct: Box<dyn LinearSolver>,
    workers: Workers,
    work: Work,
    weight: Vec<f64>,
    measure: Vec<f64>,
    center: Vec<Vec3>,
    fixed: Vec<bool>,
    start: Vec<Vec3>,
    u: Vec<f64>,
    carry: Carry,
}

/// What one attempt at a substep came to.
#[derive(Clone, Debug, PartialEq)]
pub enum Attempt {
    /// The state was advanced.
    Accepted(Summary),
    /// The state is as before; a smaller substep may do.
    Rejected(String, Summary),
}

/// How a substep moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Motion {
    /// Backward Euler.
    Dynamic,
    /// Towards rest by one semi-implicit step: one Newton correction, rate terms off.
    Relax {
        /// How much of the exact Hessian is tried.
        exact: f64,
        /// Whether friction anchors and normal forces follow the step.
        follow: bool,
    },
    /// To rest by Newton's method with the exact Hessian alone, rate terms off. What touches a body
    /// is first carried along with it.
    Rest {
        /// Largest force on a free vertex at its end [N].
        force: f64,
    },
}

impl Engine {
    /// A solver for a system.
    pub fn new(system: System, settings: &Settings) -> Self {
        let workers = Workers::new(settings.threads as usize);
        let linear = linear_solver(&system, settings, &workers);
        let assembler = assembler(&system, linear.as_ref());
        Self {
            assembler,
            linear,
            direct: exact_solver(&system, &workers),
            workers,
            work: Work::default(),
            weight: Vec::new(),
            measure: Vec::new(),
            center: Vec::new(),
            fixed: Vec::new(),
            start: Vec::new(),
            u: Vec::new(),
            carry: Carry::default(),
            settings: settings.clone(),
            system,
        }
    }

    /// Takes changed tunables: threads and the linear solver follow at once.
    pub fn set_settings(&mut self, settings: &Settings) -> Result<()> {
        let threads = settings.threads.to_bits() != self.settings.threads.to_bits();
        if threads {
            self.workers = Workers::new(settings.threads as usize);
            self.direct = exact_solver(&self.system, &self.workers);
        }
        if threads || settings.linear_kind.to_bits() != self.settings.linear_kind.to_bits() {
            self.linear = linear_solver(&self.system, settings, &self.workers);
        }
        self.system.set_options(&settings.into())?;
        self.settings = settings.clone();
        if self.linear.is_matrix_free() == self.assembler.is_of_diagonal() {
            self.assembler.outdate(true);
        } else {
            self.assembler = assembler(&self.system, self.linear.as_ref());
        }
        Ok(())
    }

    /// Multiplies the stiffness of the membrane by `factor`, 1 for the truth.
    pub fn soften(&mut self, factor: f64) -> Result<()> {
        let options = BuildOptions {
            softening: factor,
            ..(&self.settings).into()
        };
        self.system.set_options(&options)?;
        self.assembler.outdate(true);
        Ok(())
    }

    /// Takes the contacts that a state's yarns are in and where they slide.
    pub fn take_contacts(&mut self, state: &State) -> Result<()> {
        let changed = self.system.take_contacts(state)?;
        self.assembler.outdate(changed);
        Ok(())
    }

    /// Starts a call of the host: results depend on the state alone, not on what was solved before.
    pub fn begin(&mut self) {
        self.linear.forget();
    }

    /// Name of the linear solver.
    pub fn backend(&self) -> &'static str {
        self.linear.name()
    }

    /// Bytes of the factor and of work arrays.
    pub fn factor_bytes(&self) -> usize {
        let vectors = [&self.center, &self.start].map(|v| size_of_val(&v[..]));
        let numbers = [&self.weight, &self.measure, &self.u].map(|v| size_of_val(&v[..]));
        let own = vectors.iter().chain(&numbers).sum::<usize>() + self.work.bytes();
        own + self.linear.bytes() + self.direct.bytes()
    }

    /// Whether there is a matrix to factor, and not its diagonal blocks alone.
    pub fn has_matrix(&self) -> bool {
        !self.linear.is_matrix_free()
    }

    /// Bytes of the matrix and the scatter plans.
    pub fn matrix_bytes(&self) -> usize {
        self.assembler.bytes()
    }

    /// Threads.
    pub fn workers(&self) -> &Workers {
        &self.workers
    }

    /// Tries one substep of size `h` [s] that covers `fraction` of what is left of the bodies' and
    /// pins' motion. A rejected or failed attempt leaves the state untouched.
    pub fn attempt(
        &mut self,
        state: &mut State,
        h: f64,
        fraction: f64,
        motion: Motion,
    ) -> Result<Attempt> {
        let workers = self.workers.clone();
        workers.install(|| self.substep(state, h, fraction, motion))
    }

    fn substep(
        &mut self,
        state: &mut State,
        h: f64,
        fraction: f64,
        motion: Motion,
    ) -> Result<Attempt> {
        self.take_contacts(state)?;
        let dynamic = motion == Motion::Dynamic;
        let rest = matches!(motion, Motion::Rest { .. });
        let inv_dt = if dynamic { 1.0 / h } else { 0.0 };
        self.system.bodies.prepare(state, fraction, &self.workers)?;
        self.system.pack(state, &mut self.start);
        self.u.clone_from(&state.u);
        self.set_inertia(state, h, dynamic);
        let mut x = self.start.clone();
        for pin in &state.pins {
            let i = pin.vertex as usize;
            self.fixed[i] = true;
            let mut place = x[i].lerp(&pin.target, fraction);
            if fraction >= 1.0 {
                place = pin.target;
            }
            self.center[i] = place;
            if !rest {
                x[i] = place;
            }
        }
        let coupling = &self.system.points.coupling;
        coupling.carry(&mut x);
        self.carry.way.clear();
        if rest {
            self.carry
                .take_along(state, &self.center, &self.fixed, &self.system.bodies);
            if !self.carry.way.is_empty() {
                coupling.carry(&mut self.carry.way);
            }
        }
        let system = &mut self.system;
        let world = World {
            gravity: state.gravity,
            wind: state.wind,
            pressure: state.pressure,
            bodies: &system.bodies,
        };
        {
            let at = Configuration {
                x: &self.start,
                x0: &self.start,
                u: &self.u,
                inv_dt,
                world: &world,
            };
            for term in &mut system.terms {
                self.assembler.outdate(term.begin_step(state, &at));
            }
        }
        self.assembler
            .refresh(|| system.widths(), &system.terms, &self.workers);
        let problem = Problem {
            terms: &system.terms,
            world: &world,
            x0: &self.start,
            u: &self.u,
            inv_dt,
            inertia: Inertia {
                weight: &self.weight,
                center: &self.center,
                measure: &self.measure,
            },
            fixed: &self.fixed,
            coupling: &system.points.coupling,
            workers: &self.workers,
        };
        let mut tolerance = Tolerance {
            displacement: if dynamic {
                self.settings.newton_velocity_tolerance * h
            } else {
                0.0
            },
            relative: if dynamic {
                self.settings.newton_relative_tolerance
            } else {
                0.0
            },
            first: None,
            motion: if dynamic && system.has_yarns() {
                self.settings.yarn_relative_velocity
            } else {
                0.0
            },
            force: match motion {
                Motion::Rest { force } => force,
                _ => 0.0,
            },
            iterations: match motion {
                Motion::Dynamic => self.settings.newton_max_iterations as u32,
                Motion::Relax { .. } => 1,
                Motion::Rest { .. } => REST_ITERATIONS,
            },
            // a relaxation takes one correction for each matrix: a rough one will do. With yarns the directions of conjugate gradients
            // are far better than their residuals; without rings it is the energy that ends an iteration
            linear: {
                let rough = match (&system.points.coupling.filter, dynamic) {
                    (Some(_), true) => 100.0,
                    (None, true) => 1.0,
                    (None, false) if system.has_yarns() => 1.0,
                    (_, false) => 10.0,
                };
                (rough * self.settings.linear_tolerance).min(0.1)
            },
            exactness: match motion {
                Motion::Dynamic => 0.0,
                Motion::Relax { exact, .. } => exact,
                Motion::Rest { .. } => 1.0,
            },
            most_exactness: match motion {
                Motion::Relax { exact, .. } => exact,
                Motion::Dynamic if system.has_yarns() => ALMOST,
                _ => 1.0,
            },
            hasty: system.has_yarns(),
            strict: rest,
            settle: !rest && system.has_yarns(),
        };
        let linear = if rest {
            self.direct.as_mut()
        } else {
            self.linear.as_mut()
        };
        let mut tried = 0;
        if !self.carry.way.is_empty() {
            let before = AtStart(&system.bodies);
            let answer = Problem {
                world: &World {
                    bodies: &before,
                    ..world
                },
                fixed: &self.carry.held,
                ..problem
            }
            .answer(
                &x,
                &self.carry.way,
                &mut self.assembler,
                linear,
                &mut self.work,
            );
            tried = answer.0;
            for pin in &state.pins {
                x[pin.vertex as usize] = self.center[pin.vertex as usize];
            }
            problem.coupling.carry(&mut x);
            // where that costs energy everything but the pins is left behind
            if let Some(answer) = answer.1
                && problem.value(&answer) <= problem.value(&x)
            {
                x = answer;
            }
        }
        if dynamic && system.has_yarns() && problem.coupling.filter.is_none() {
            let mut ahead = x.clone();
            go_on(system, state, h, &self.fixed, &mut ahead);
            let at = Configuration {
                x: &ahead,
                x0: &self.start,
                u: &self.u,
                inv_dt,
                world: &world,
            };
            if inadmissible(system, &at, false, &self.workers).is_none()
                && problem.value(&ahead).is_finite()
            {
                // stiff yarns have much energy there, which is no measure of what the step has to find
                tolerance.first = Some(problem.value(&x)).filter(|first| first.is_finite());
                x = ahead;
            }
        }
        let mut summary = problem.minimise(
            &mut x,
            &tolerance,
            &mut self.assembler,
            linear,
            &mut self.work,
        )?;
        summary.iterations += tried;
        let refused = if dynamic && !summary.converged {
            Some("Newton's method did not converge".to_owned())
        } else if !dynamic && summary.last_length == 0.0 && !summary.converged {
            Some("the line search found no decrease".to_owned())
        } else {
            let at = Configuration {
                x: &x,
                x0: &self.start,
                u: &self.u,
                inv_dt,
                world: &world,
            };
            inadmissible(system, &at, dynamic, &self.workers)
        };
        if let Some(reason) = refused {
            return Ok(Attempt::Rejected(reason, summary));
        }
        let at = Configuration {
            x: &x,
            x0: &self.start,
            u: &self.u,
            inv_dt,
            world: &world,
        };
        if !matches!(motion, Motion::Relax { follow: false, .. }) {
            for term in &mut system.terms {
                term.accept(&at, state);
            }
        }
        system.unpack(&self.start, &x, h, state);
        if !matches!(motion, Motion::Relax { follow: false, .. }) {
            // the forces of a relaxation are not those of a motion: yarns come out of contacts in time only
            let changed = system.follow_contacts(dynamic, state, &self.workers)?;
            self.assembler.outdate(changed);
        }
        system.bodies.accept(state);
        Ok(Attempt::Accepted(summary))
    }

    /// The quadratic part of a substep's potential. The terms of yarns bring their own inertia, which
    /// is not diagonal; a relaxation takes lumped masses in its place, those of riders on the vertices that carry them.
    fn set_inertia(&mut self, state: &State, h: f64, dynamic: bool) {
        let system = &self.system;
        let points = &system.points;
        let n = system.block_count();
        for list in [&mut self.weight, &mut self.measure] {
            list.clear();
            list.resize(n, 0.0);
        }
        self.center.clone_from(&self.start);
        self.fixed.clear();
        self.fixed.resize(n, false);
        for i in 0..points.count() {
            let alpha = if dynamic { points.damping[i] } else { 0.0 };
            self.measure[i] = points.masses[i] * (1.0 / (h * h) + alpha / h);
            if i < points.vertex_count || !dynamic {
                self.weight[i] = self.measure[i];
                self.center[i] += state.velocities[i] * (h / (1.0 + alpha * h));
            }
            self.fixed[i] = !points.moves(i);
        }
        for node in points.coupling.filter.iter().flat_map(|f| f.nodes()) {
            // inertia alone resists what is done to a vertex with that of the nodes on it
            let own = self.measure[node.point as usize];
            for (v, w) in node.vertices.iter().zip(&node.weights) {
                self.measure[*v as usize] += w.max(0.0) * own;
            }
        }
        for rider in points.coupling.riders.list() {
            let own = self.measure[rider.point as usize];
            for (v, w) in rider.vertices.iter().zip(&rider.weights) {
                // a rider just outside of its triangle has a weight below zero
                let part = w.max(0.0) * own;
                self.measure[*v as usize] += part;
                if !dynamic {
                    self.weight[*v as usize] += part;
                }
            }
            self.weight[rider.point as usize] = 0.0;
        }
        let unknowns = &system.unknowns;
        for (k, owner) in unknowns.owners.iter().enumerate() {
            let block = unknowns.first_slide as usize + k;
            self.measure[block] = points.masses[unknowns.node(*owner) as usize] / (h * h);
            if !dynamic {
                self.weight[block] = self.measure[block];
            }
        }
        if !dynamic {
            for (i, slot) in unknowns.slides.iter().enumerate() {
                if let Some((block, c)) = slot {
                    self.center[*block as usize][usize::from(*c)] += h * state.u_rates[i];
                }
            }
        }
    }
}

/// Moves what is free in `x` on as it moves now. Segments of yarn are so stiff that Newton's method
/// from where a step begins takes twice the corrections that it takes from here.
fn go_on(system: &System, state: &State, h: f64, fixed: &[bool], x: &mut [Vec3]) {
    let points = &system.points;
    for i in (0..points.count()).filter(|i| !fixed[*i]) {
        x[i] += state.velocities[i] * (h / (1.0 + points.damping[i] * h));
    }
    let unknowns = &system.unknowns;
    for (i, (slot, rate)) in unknowns.slides.iter().zip(&state.u_rates).enumerate() {
        // an image has no coordinate of its own
        if let (Some((block, c)), None) = (slot, unknowns.shift(i)) {
            x[*block as usize][usize::from(*c)] += rate * h;
        }
    }
    points.coupling.carry(x);
}

/// What the linear solver wants of matrices.
fn assembler(system: &System, linear: &dyn LinearSolver) -> Assembler {
    let riders = &system.points.coupling.riders;
    if linear.is_matrix_free() {
        Assembler::of_diagonal(&system.widths(), &system.terms, riders)
    } else {
        Assembler::new(&system.widths(), &system.terms, riders)
    }
}

/// The solver that factors every matrix as it is.
fn exact_solver(system: &System, workers: &Workers) -> Box<dyn LinearSolver> {
    match &system.points.coupling.filter {
        Some(filter) => Box::new(Constrained::new(filter, workers)),
        None => Box::new(Direct::new(workers)),
    }
}

fn linear_solver(system: &System, settings: &Settings, workers: &Workers) -> Box<dyn LinearSolver> {
    if let Some(filter) = &system.points.coupling.filter {
        return choose::filtered(settings.linear_kind as u32, filter, workers);
    }
    let (kind, blocks) = (settings.linear_kind as u32, system.block_count());
    if let Some(yarns) = &system.yarns {
        let knit = !yarns.mesh.wraps.is_empty();
        let made = if knit { Made::Knits } else { Made::Weaves };
        return choose::solver(kind, blocks, made, workers);
    }
    let priorities = seam_priorities(&system.cloth.mesh);
    choose::solver(kind, blocks, Made::Triangles(Some(&priorities)), workers)
}
