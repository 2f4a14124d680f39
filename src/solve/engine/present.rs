//! What is true of a state as it is: energies, forces, residual, wrenches on bodies, whether it is a
//! minimum. Nothing moves, and bodies are where they stand now.

use super::{Engine, Inertia, Problem, largest};
use crate::error::Result;
use crate::math::Vec3;
use crate::system::assemble::energy;
use crate::system::state::State;
use crate::system::term::{Configuration, World};

impl Engine {
    /// Whether a state at rest is a minimum of the energy: whether the exact Hessian with the inertia
    /// of a step `h` [s] is positive definite there.
    pub fn is_minimum(&mut self, state: &State, h: f64) -> Result<bool> {
        self.with_present(state, |engine, at| {
            engine.start.clear();
            engine.start.extend_from_slice(at.x);
            engine.set_inertia(state, h, false);
            for pin in &state.pins {
                engine.fixed[pin.vertex as usize] = true;
            }
            let system = &engine.system;
            let widths = || system.widths();
            (engine.assembler).refresh(widths, &system.terms, &engine.workers);
            let problem = Problem {
                terms: &engine.system.terms,
                world: at.world,
                x0: at.x0,
                u: at.u,
                inv_dt: at.inv_dt,
                inertia: Inertia {
                    weight: &engine.weight,
                    measure: &engine.measure,
                    center: &engine.center,
                },
                fixed: &engine.fixed,
                coupling: &engine.system.points.coupling,
                workers: &engine.workers,
            };
            problem.is_convex(
                at.x,
                &mut engine.assembler,
                engine.direct.as_mut(),
                &mut engine.work,
            )
        })
    }

    /// Lets friction anchors and normal forces follow the present state.
    pub fn follow(&mut self, state: &mut State) -> Result<()> {
        let still = state.clone();
        self.with_present(&still, |engine, at| {
            for term in &mut engine.system.terms {
                term.accept(at, state);
            }
            let workers = engine.workers.clone();
            let changed = engine.system.follow_contacts(false, state, &workers)?;
            engine.assembler.outdate(changed);
            Ok(())
        })?
    }

    /// Sum of all energies of the present state [J].
    pub fn potential_energy(&mut self, state: &State) -> Result<f64> {
        self.with_present(state, |engine, at| {
            energy(&engine.system.terms, at, &engine.workers)
        })
    }

    /// Energy of each term of the present state [J], by term name.
    pub fn energies(&mut self, state: &State) -> Result<Vec<(&'static str, f64)>> {
        self.with_present(state, |engine, at| {
            let terms = &engine.system.terms;
            (0..terms.len())
                .map(|t| (terms[t].name(), energy(&terms[t..=t], at, &engine.workers)))
                .collect()
        })
    }

    /// Gradient of the potential in the present state [N]: points, pinned ones included, then sliding
    /// coordinates. What nodes of blended rings bear as a whole is on the vertices.
    pub fn forces(&mut self, state: &State) -> Result<Vec<Vec3>> {
        self.with_present(state, |engine, at| {
            let mut gradient = vec![Vec3::zeros(); at.x.len()];
            let system = &engine.system;
            let widths = || system.widths();
            (engine.assembler).refresh(widths, &system.terms, &engine.workers);
            engine.assembler.add(
                &engine.system.terms,
                at,
                None,
                &engine.workers,
                &mut gradient,
            );
            engine.system.points.coupling.gather(&mut gradient);
            gradient
        })
    }

    /// Largest static residual of a free vertex [N].
    pub fn residual(&mut self, state: &State) -> Result<f64> {
        let mut forces = self.forces(state)?;
        for pin in &state.pins {
            forces[pin.vertex as usize].fill(0.0);
        }
        Ok(largest(&forces))
    }

    fn with_present<R>(
        &mut self,
        state: &State,
        f: impl FnOnce(&mut Self, &Configuration<'_>) -> R,
    ) -> Result<R> {
        let mut still = state.clone();
        for body in &mut still.bodies {
            body.target = body.pose;
            body.target_vertices.clear();
        }
        self.take_contacts(state)?;
        self.system.bodies.prepare(&still, 1.0, &self.workers)?;
        let bodies = self.system.bodies.clone();
        let world = World {
            gravity: state.gravity,
            wind: state.wind,
            pressure: state.pressure,
            bodies: &bodies,
        };
        let mut x = Vec::new();
        self.system.pack(state, &mut x);
        let at = Configuration {
            x: &x,
            x0: &x,
            u: &state.u,
            inv_dt: 0.0,
            world: &world,
        };
        for term in &mut self.system.terms {
            self.assembler.outdate(term.begin_step(state, &at));
        }
        Ok(f(self, &at))
    }

    /// Force and torque of the cloth on a body about the body's origin [N], [N m].
    pub fn body_wrench(&mut self, state: &State, body: usize) -> Result<(Vec3, Vec3)> {
        let origin = state.bodies[body].pose.position;
        self.with_present(state, |engine, at| {
            let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
            for term in &engine.system.terms {
                term.add_wrench(body, at, &origin, &mut force, &mut torque);
            }
            (force, torque)
        })
    }
}
