//! Values of variables, read and set by value reference.

use super::{Answer, Fault, Instance, Mode};
use crate::error::{Error, Result};
use crate::fmi::log::Status;
use crate::fmi::variables::{Causality, Kind, Quantity, Variability, Variable};

impl Instance {
    fn typed(&self, kind: Kind, reference: u32, fmi2: bool) -> Result<&Variable> {
        let variable = self.model.variable(reference)?;
        if variable.kind != kind {
            return Err(Error::argument(format!(
                "{} (value reference {reference}) is {}, not {}",
                variable.name,
                variable.kind.name(),
                kind.name()
            )));
        }
        if fmi2 && !variable.is_in_fmi2() {
            return Err(Error::argument(format!(
                "{} (value reference {reference}) is an array, which FMI 2 does not have",
                variable.name
            )));
        }
        Ok(variable)
    }

    /// Values of variables, arrays flattened row by row; `count` must be the number of them.
    pub fn read(
        &mut self,
        kind: Kind,
        references: &[u32],
        count: usize,
        fmi2: bool,
    ) -> std::result::Result<Vec<f64>, Fault> {
        let (mut size, mut computed) = (0_usize, false);
        for &reference in references {
            let variable = self.typed(kind, reference, fmi2)?;
            size = size.saturating_add(variable.size());
            computed |= variable.is_computed();
        }
        if size != count {
            return Err(Error::argument(format!(
                "{count} values were given room, the variables have {size}"
            ))
            .into());
        }
        if computed {
            self.refresh()?;
        }
        let mut out = Vec::with_capacity(count);
        for &reference in references {
            let variable = &self.model.variables[reference as usize];
            if variable.is_settable() {
                out.extend_from_slice(self.values.of(reference));
            } else if variable.quantity == Quantity::Time {
                out.push(self.time);
            } else {
                self.results
                    .read(&self.model, &self.sim, variable, &mut out)?;
            }
        }
        Ok(out)
    }

    /// Sets variables, all of them or, on an error, none.
    pub fn write(&mut self, kind: Kind, references: &[u32], values: &[f64], fmi2: bool) -> Answer {
        let mut size = 0_usize;
        for &reference in references {
            size = size.saturating_add(self.typed(kind, reference, fmi2)?.size());
        }
        if size != values.len() {
            return Err(Error::argument(format!(
                "{} values were given, the variables have {size}",
                values.len()
            ))
            .into());
        }
        let mut rest = values;
        for &reference in references {
            let variable = self.typed(kind, reference, fmi2)?;
            let own;
            (own, rest) = rest.split_at(variable.size());
            if !variable.is_settable() {
                return Err(Error::argument(format!(
                    "{} is {} and cannot be set",
                    variable.name,
                    variable.causality.name()
                ))
                .into());
            }
            self.expect(settable_in(variable))
                .map_err(|e| e.at(format!("setting {}", variable.name)))?;
            own.iter().try_for_each(|&value| variable.check(value))?;
        }
        let mut rest = values;
        for &reference in references {
            let slot = self.values.of_mut(reference);
            let own;
            (own, rest) = rest.split_at(slot.len());
            let bits = own.iter().map(|v| v.to_bits());
            let changed = !slot.iter().map(|v| v.to_bits()).eq(bits);
            slot.copy_from_slice(own);
            self.stale |= changed && self.mode != Mode::Step;
        }
        Ok(Status::Ok)
    }

    /// Bytes of binary variables; they stay where they are until the next call that reads some.
    pub fn read_binaries(
        &mut self,
        references: &[u32],
        count: usize,
    ) -> std::result::Result<&[Vec<u8>], Fault> {
        for &reference in references {
            self.typed(Kind::Binary, reference, false)?;
        }
        if references.len() != count {
            return Err(Error::argument(format!(
                "{count} values were given room, the variables have {}",
                references.len()
            ))
            .into());
        }
        self.refresh()?;
        let bytes = self.sim.save()?;
        self.binaries = vec![bytes; references.len()];
        Ok(&self.binaries)
    }
}

/// Modes in which a variable may be set.
fn settable_in(variable: &Variable) -> &'static [Mode] {
    match (variable.causality, variable.variability) {
        (Causality::Structural, _) => &[Mode::Configuration],
        (Causality::Parameter, Variability::Fixed) => &[Mode::Instantiated, Mode::Initialization],
        _ => &[Mode::Instantiated, Mode::Initialization, Mode::Step],
    }
}
