//! One instance of an FMU, without C: modes, values, steps, saved states. The entry points of FMI 2
//! and 3 are thin layers over this, so that both give the same bits.
//!
//! How a run is made of values: until the initialization ends, the simulation is a function of the
//! values alone (`stale` says that it is yet to be made). From then on a step takes the inputs as
//! they are when it begins, and outputs are those of its end. `values` reads and sets variables,
//! `states` saves and restores.

mod states;
mod values;

use super::drive;
use super::log::{Log, Status};
use super::model::Model;
use super::results::Results;
use super::variables::{Quantity, Values, Variable};
use crate::error::{self, Error, Result};
use crate::sim::{DrapeOptions, Outcome, Sim};
use crate::system::state::State;
use serde::{Deserialize, Serialize};
use std::path::Path;

/// Where an instance is in its life.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize, Deserialize)]
pub enum Mode {
    /// Made, or reset.
    Instantiated,
    /// Structural parameters may be set.
    Configuration,
    /// Start values are being settled.
    Initialization,
    /// At a communication point.
    Step,
    /// Ended, by the master or by an error.
    Terminated,
}

impl Mode {
    fn name(self) -> &'static str {
        match self {
            Self::Instantiated => "Instantiated",
            Self::Configuration => "Configuration Mode",
            Self::Initialization => "Initialization Mode",
            Self::Step => "Step Mode",
            Self::Terminated => "Terminated",
        }
    }
}

/// Why a call was not done.
#[derive(Clone, Debug)]
pub enum Fault {
    /// Nothing changed; a shorter step may do.
    Discard(Error),
    /// The instance is terminated.
    Error(Error),
}

impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        Self::Error(error)
    }
}

/// What a call came to.
pub type Answer = std::result::Result<Status, Fault>;

/// Largest relative difference between the master's time and the instance's own.
const TIME_TOLERANCE: f64 = 1e-9;

/// An instance.
pub struct Instance {
    name: String,
    token: String,
    model: Model,
    sim: Sim,
    /// State of the compiled simulation before anything ran.
    origin: State,
    /// Values that the simulation was compiled with.
    compiled: Vec<f64>,
    /// Values that its tunables were last taken from.
    applied: Vec<f64>,
    values: Values,
    mode: Mode,
    start: f64,
    stop: Option<f64>,
    time: f64,
    stale: bool,
    /// A panic may have left the simulation half-changed.
    broken: bool,
    results: Results,
    binaries: Vec<Vec<u8>>,
    log: Log,
}

impl Instance {
    /// An instance of the FMU whose resources lie in a folder.
    pub fn new(name: &str, token: &str, resources: &Path, log: Log) -> Result<Self> {
        let (model, sim) = Model::load(resources, token)?;
        let values = Values::start(&model.variables);
        Ok(Self {
            name: name.to_owned(),
            token: token.to_owned(),
            origin: sim.checkpoint(),
            sim,
            compiled: values.scalars.clone(),
            applied: values.scalars.clone(),
            values,
            model,
            mode: Mode::Instantiated,
            start: 0.0,
            stop: None,
            time: 0.0,
            stale: true,
            broken: false,
            results: Results::default(),
            binaries: Vec::new(),
            log,
        })
    }

    /// The name that the master gave.
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Time that was reached [s].
    pub fn time(&self) -> f64 {
        self.time
    }

    /// Whether the run has ended.
    pub fn is_terminated(&self) -> bool {
        self.mode == Mode::Terminated
    }

    /// The master's log.
    pub fn log(&mut self) -> &mut Log {
        &mut self.log
    }

    /// Runs a call: logs what it came to, ends the run on an error, stops panics.
    pub fn call(&mut self, function: &str, body: impl FnOnce(&mut Self) -> Answer) -> Status {
        if self.broken {
            return self.refused(
                function,
                &Error::state("the instance was given up after an internal error: reset it"),
            );
        }
        self.call_anyway(function, body)
    }

    /// [`Instance::call`] for calls that make the simulation anew.
    pub fn call_anyway(
        &mut self,
        function: &str,
        body: impl FnOnce(&mut Self) -> Answer,
    ) -> Status {
        match error::catch(|| Ok(body(self))) {
            Ok(Ok(status)) => status,
            Ok(Err(Fault::Discard(e))) => {
                self.log.say(Status::Discard, || format!("{function}: {e}"));
                Status::Discard
            }
            Ok(Err(Fault::Error(e))) => self.refused(function, &e),
            Err(panic) => {
                self.broken = true;
                self.refused(function, &panic)
            }
        }
    }

    fn refused(&mut self, function: &str, error: &Error) -> Status {
        self.mode = Mode::Terminated;
        self.log
            .say(Status::Error, || format!("{function}: {error}"));
        Status::Error
    }

    fn expect(&self, modes: &[Mode]) -> Result<()> {
        if modes.contains(&self.mode) {
            return Ok(());
        }
        let names: Vec<&str> = modes.iter().map(|m| m.name()).collect();
        Err(Error::state(format!(
            "not allowed in {}, only in {}",
            self.mode.name(),
            names.join(", ")
        )))
    }

    /// Makes the simulation from the values, if it is not made yet.
    fn refresh(&mut self) -> Result<()> {
        if !self.stale {
            return Ok(());
        }
        if self.broken || self.model.differ(&self.values.scalars, &self.compiled) {
            self.sim = self.model.compile(&self.values.scalars)?;
            self.origin = self.sim.checkpoint();
            self.compiled.clone_from(&self.values.scalars);
            self.broken = false;
            self.log.say(Status::Ok, || {
                "the simulation was built for changed parameters".into()
            });
        }
        self.sim.roll_back(self.origin.clone())?;
        self.tell_numbers()?;
        drive::place(&self.model, &self.values, &mut self.sim)?;
        self.results = Results::default();
        self.stale = false;
        Ok(())
    }

    fn tell_numbers(&mut self) -> Result<()> {
        drive::settings(&self.model, &self.values.scalars, &mut self.sim)?;
        self.applied.clone_from(&self.values.scalars);
        drive::world(&self.model, &self.values.scalars, &mut self.sim)
    }

    /// From Instantiated to Configuration Mode.
    pub fn enter_configuration(&mut self) -> Answer {
        self.expect(&[Mode::Instantiated])?;
        self.mode = Mode::Configuration;
        Ok(Status::Ok)
    }

    /// Back from Configuration Mode.
    pub fn exit_configuration(&mut self) -> Answer {
        self.expect(&[Mode::Configuration])?;
        self.mode = Mode::Instantiated;
        Ok(Status::Ok)
    }

    /// Takes the times of the run, and the master's tolerance, which must be a number and is of no
    /// use to a simulation that keeps its own.
    pub fn set_up(&mut self, tolerance: Option<f64>, start: f64, stop: Option<f64>) -> Answer {
        self.expect(&[Mode::Instantiated])?;
        if let Some(tolerance) = tolerance.filter(|t| !t.is_finite() || *t < 0.0) {
            return Err(Error::argument(format!(
                "tolerance = {tolerance} must be finite and not negative"
            ))
            .into());
        }
        if !start.is_finite() || stop.is_some_and(|stop| !stop.is_finite() || stop <= start) {
            let stop = stop.map_or("none".to_owned(), |stop| format!("{stop} s"));
            return Err(Error::argument(format!(
                "start time {start} s and stop time {stop} must be finite, the stop after the start"
            ))
            .into());
        }
        (self.start, self.stop, self.time) = (start, stop, start);
        Ok(Status::Ok)
    }

    /// From Instantiated to Initialization Mode.
    pub fn enter_initialization(&mut self) -> Answer {
        self.expect(&[Mode::Instantiated])?;
        self.mode = Mode::Initialization;
        Ok(Status::Ok)
    }

    /// From Initialization to Step Mode: the simulation is made, and draped if asked for.
    pub fn exit_initialization(&mut self) -> Answer {
        self.expect(&[Mode::Initialization])?;
        self.refresh()?;
        let mut status = Status::Ok;
        let wanted = |v: &Variable| v.quantity == Quantity::Drape;
        let drape = self.model.variables.iter().position(wanted);
        if drape.is_some_and(|d| self.values.scalars[d] > 0.5) {
            let options = DrapeOptions {
                force_tolerance: 0.0,
                max_steps: 0,
            };
            let report = self.sim.drape(&options, &mut |_| true)?;
            if report.outcome != Outcome::Converged {
                status = Status::Warning;
            }
            self.log.say(status, || {
                format!(
                    "drape: {}, {} steps, residual {:.3e} N {}",
                    report.outcome.name(),
                    report.substeps,
                    report.residual,
                    report.reason
                )
            });
            self.results = Results::of(Some(report));
        }
        self.sim.end_placement();
        self.mode = Mode::Step;
        Ok(status)
    }

    /// One step of the master, from `point` over `size` [s].
    pub fn do_step(&mut self, point: f64, size: f64) -> Answer {
        self.expect(&[Mode::Step])?;
        if !(size.is_finite() && size > 0.0) {
            return Err(Error::argument(format!(
                "communication step size {size} must be finite and positive"
            ))
            .into());
        }
        let slack = TIME_TOLERANCE * point.abs().max(self.time.abs()).max(size);
        if !((point - self.time).abs() <= slack) {
            return Err(Error::argument(format!(
                "communication point {point} is not the time that was reached, {}",
                self.time
            ))
            .into());
        }
        let end = point + size;
        if let Some(stop) = self.stop
            && end > stop + TIME_TOLERANCE * end.abs().max(size)
        {
            return Err(Error::argument(format!(
                "a step of {size} from {point} passes the stop time {stop}"
            ))
            .into());
        }
        let before = self.sim.checkpoint();
        match self.advance(size) {
            Ok(report) => {
                self.time = end;
                if report.outcome != Outcome::Converged {
                    self.log.say(Status::Ok, || {
                        format!(
                            "step to {end} s: {}, {} substeps, {} Newton iterations",
                            report.outcome.name(),
                            report.substeps,
                            report.newton_iterations
                        )
                    });
                }
                self.results = Results::of(Some(report));
                Ok(Status::Ok)
            }
            Err(e) => {
                self.sim.roll_back(before)?;
                match e.status {
                    error::Status::NoAdmissibleState | error::Status::LinearSolve => {
                        Err(Fault::Discard(e))
                    }
                    _ => Err(Fault::Error(e)),
                }
            }
        }
    }

    fn advance(&mut self, size: f64) -> Result<crate::sim::StepReport> {
        self.tell_numbers()?;
        drive::step(&self.model, &self.values, &mut self.sim, size)?;
        self.sim.step(size)
    }

    /// Ends the run.
    pub fn terminate(&mut self) -> Answer {
        self.expect(&[Mode::Step])?;
        self.mode = Mode::Terminated;
        Ok(Status::Ok)
    }

    /// As it was when it was made.
    pub fn reset(&mut self) -> Answer {
        self.values = Values::start(&self.model.variables);
        self.mode = Mode::Instantiated;
        (self.start, self.stop, self.time) = (0.0, None, 0.0);
        self.stale = true;
        self.results = Results::default();
        self.binaries.clear();
        if self.broken {
            self.refresh()?;
            self.stale = true;
        }
        Ok(Status::Ok)
    }
}
