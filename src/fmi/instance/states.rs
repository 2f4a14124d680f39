//! Saved states: out as bytes, back in from bytes of anybody.

use super::{Answer, Instance};
use crate::error::{Error, Result};
use crate::fmi::drive;
use crate::fmi::log::Status;
use crate::fmi::results::Results;
use crate::fmi::saved::Saved;
use crate::fmi::variables::Values;

impl Instance {
    /// Everything that the next answers depend on.
    pub fn save(&mut self) -> Result<Vec<u8>> {
        if self.broken {
            return Err(Error::state(
                "nothing is left to save after an internal error",
            ));
        }
        let saved = Saved {
            mode: self.mode,
            values: self.values.clone(),
            applied: self.applied.clone(),
            start: self.start,
            stop: self.stop,
            time: self.time,
            stale: self.stale,
            report: self.results.report.clone(),
            snapshot: if self.stale {
                Vec::new()
            } else {
                self.sim.save()?
            },
        };
        saved.to_bytes(&self.token)
    }

    /// Refuses bytes that are no saved state of this FMU.
    pub fn check_saved(&self, bytes: &[u8]) -> Result<()> {
        self.read_saved(bytes).map(drop)
    }

    fn read_saved(&self, bytes: &[u8]) -> Result<Saved> {
        let saved = Saved::from_bytes(bytes, &self.token)?;
        let applied = Values {
            scalars: saved.applied.clone(),
            arrays: saved.values.arrays.clone(),
        };
        for values in [&saved.values, &applied] {
            let checked = values.check(&self.model.variables);
            checked.map_err(|e| e.at("FMU state"))?;
        }
        Ok(saved)
    }

    /// Goes to a saved state; on error the simulation is as it was.
    pub fn load(&mut self, bytes: &[u8]) -> Answer {
        let saved = self.read_saved(bytes)?;
        let differs = !saved.stale && self.model.differ(&saved.values.scalars, &self.compiled);
        if self.broken || differs {
            let mut sim = self.model.compile(&saved.values.scalars)?;
            let origin = sim.checkpoint();
            if !saved.stale {
                drive::settings(&self.model, &saved.applied, &mut sim)?;
                sim.restore(&saved.snapshot)?;
            }
            (self.sim, self.origin) = (sim, origin);
            self.compiled.clone_from(&saved.values.scalars);
            self.broken = false;
        } else if !saved.stale {
            drive::settings(&self.model, &saved.applied, &mut self.sim)?;
            if let Err(error) = self.sim.restore(&saved.snapshot) {
                drive::settings(&self.model, &self.applied, &mut self.sim)?;
                return Err(error.into());
            }
        }
        self.mode = saved.mode;
        self.values = saved.values;
        self.applied = saved.applied;
        (self.start, self.stop, self.time) = (saved.start, saved.stop, saved.time);
        self.stale = saved.stale;
        self.results = Results::of(saved.report);
        Ok(Status::Ok)
    }
}
