//! Values of outputs, computed when they are asked for and kept until the state changes.

use super::model::Model;
use super::variables::{EnergyPart, Quantity, Variable};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::sim::{Energies, Sim, StepReport};

/// What was computed of the present state.
#[derive(Clone, Debug, Default)]
pub(super) struct Results {
    /// Report of the last step or drape.
    pub(super) report: Option<StepReport>,
    energies: Option<Energies>,
    wrenches: Vec<Option<([f64; 3], [f64; 3])>>,
    forces: Option<Vec<Vec3>>,
}

fn count(n: u64) -> f64 {
    n.min(i32::MAX as u64) as f64
}

fn flat(points: &[Vec3], out: &mut Vec<f64>) {
    out.extend(points.iter().flat_map(|p| [p.x, p.y, p.z]));
}

impl Results {
    /// Nothing computed yet; the report of what led here, if anything did.
    pub(super) fn of(report: Option<StepReport>) -> Self {
        Self {
            report,
            ..Self::default()
        }
    }

    fn report(&mut self, sim: &Sim) -> Result<&StepReport> {
        let report = match self.report.take() {
            Some(report) => report,
            None => sim.report()?,
        };
        Ok(self.report.insert(report))
    }

    fn energies(&mut self, sim: &Sim) -> Result<Energies> {
        if let Some(energies) = self.energies {
            return Ok(energies);
        }
        let energies = sim.energies()?;
        self.energies = Some(energies);
        Ok(energies)
    }

    fn wrench(&mut self, sim: &Sim, body: usize) -> Result<([f64; 3], [f64; 3])> {
        self.wrenches.resize(sim.body_count(), None);
        if let Some(wrench) = self.wrenches[body] {
            return Ok(wrench);
        }
        let wrench = sim.body_wrench(body as u32)?;
        self.wrenches[body] = Some(wrench);
        Ok(wrench)
    }

    /// Force of the cloth on the holder of a pin [N].
    fn reaction(&mut self, model: &Model, sim: &Sim, pin: usize) -> Result<Vec3> {
        if self.forces.is_none() {
            self.forces = Some(sim.point_forces()?);
        }
        let forces = self.forces.as_deref().unwrap_or_default();
        let vertices = model.pins[pin].iter().filter(|v| sim.is_pinned(v.0));
        Ok(-vertices.map(|v| forces[v.0 as usize]).sum::<Vec3>())
    }

    /// Appends the value of a variable that the simulation computes, flattened row by row.
    pub(super) fn read(
        &mut self,
        model: &Model,
        sim: &Sim,
        variable: &Variable,
        out: &mut Vec<f64>,
    ) -> Result<()> {
        let x = sim.positions();
        let least = |k: usize| x.iter().map(|p| p[k]).fold(f64::INFINITY, f64::min);
        let greatest = |k: usize| x.iter().map(|p| p[k]).fold(f64::NEG_INFINITY, f64::max);
        let probe = |i: usize| model.probes[i].iter().map(|&v| v as usize);
        let value = match variable.quantity {
            Quantity::BodyForce(b, k) => self.wrench(sim, b)?.0[k],
            Quantity::BodyTorque(b, k) => self.wrench(sim, b)?.1[k],
            Quantity::PinReaction(p, k) => self.reaction(model, sim, p)?[k],
            Quantity::Energy(part) => {
                let e = self.energies(sim)?;
                match part {
                    EnergyPart::Kinetic => e.kinetic,
                    EnergyPart::Gravity => e.gravity,
                    EnergyPart::Membrane => e.membrane,
                    EnergyPart::Bending => e.bending,
                    EnergyPart::Seam => e.seam,
                    EnergyPart::Contact => e.contact,
                    EnergyPart::Yarn => e.yarn,
                    EnergyPart::Total => {
                        e.kinetic + e.gravity + e.membrane + e.bending + e.seam + e.contact + e.yarn
                    }
                }
            }
            Quantity::MaxStrain => self.report(sim)?.max_edge_strain,
            Quantity::MinGap => self.report(sim)?.min_gap,
            Quantity::MaxSeamGap => self.report(sim)?.max_seam_gap,
            Quantity::Residual => self.report(sim)?.residual,
            Quantity::Outcome => f64::from(self.report(sim)?.outcome as u32),
            Quantity::NewtonIterations => count(self.report(sim)?.newton_iterations),
            Quantity::LinearIterations => count(self.report(sim)?.linear_iterations),
            Quantity::Substeps => count(self.report(sim)?.substeps),
            Quantity::ExtentMin(k) => least(k),
            Quantity::ExtentMax(k) => greatest(k),
            Quantity::Centre(k) => {
                let masses = sim.masses();
                let sum: f64 = x.iter().zip(masses).map(|(p, m)| m * p[k]).sum();
                sum / masses.iter().sum::<f64>()
            }
            Quantity::ProbePosition(i, k) => probe(i).map(|v| x[v][k]).sum(),
            Quantity::ProbeVelocity(i, k) => probe(i).map(|v| sim.velocities()[v][k]).sum(),
            Quantity::CurveLength(i) => {
                let vertices: Vec<usize> = probe(i).collect();
                let steps = vertices.windows(2);
                steps.map(|w| (x[w[1]] - x[w[0]]).norm()).sum()
            }
            Quantity::CurvePoints(i) => {
                out.extend(probe(i).flat_map(|v| [x[v].x, x[v].y, x[v].z]));
                return Ok(());
            }
            Quantity::Positions => {
                flat(x, out);
                return Ok(());
            }
            Quantity::NodeCount => count(sim.yarn_nodes().len() as u64),
            Quantity::Nodes => {
                let end = out.len() + variable.size();
                flat(sim.yarn_nodes(), out);
                out.resize(end, 0.0);
                return Ok(());
            }
            Quantity::Velocities => {
                flat(sim.velocities(), out);
                return Ok(());
            }
            Quantity::Normals => {
                flat(&sim.normals(), out);
                return Ok(());
            }
            Quantity::Triangles => {
                out.extend(sim.triangles().iter().flatten().map(|&v| f64::from(v)));
                return Ok(());
            }
            _ => {
                return Err(Error::unsupported(format!(
                    "{} has no value of its own",
                    variable.name
                )));
            }
        };
        out.push(value);
        Ok(())
    }
}
