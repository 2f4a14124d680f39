//! Time and rest: the step and the drape.

use super::desc;
use super::guard::{c_text, entry};
use super::input;
use super::log::{Log, TOILE_LOG_INFO, TOILE_LOG_WARNING};
use super::sim::{SIMS, write};
use super::status::toile_status;
use super::types::{
    toile_drape_desc, toile_progress, toile_progress_fn, toile_sim, toile_step_report,
};
use crate::sim::{DrapeOptions, Outcome, Progress, StepReport};
use std::ffi::c_void;

/// The host's progress callback.
#[derive(Clone, Copy, Debug)]
pub(super) struct Watcher {
    callback: toile_progress_fn,
    user: *mut c_void,
}

// SAFETY: the header tells the host that its callback runs on the thread that steps, whichever that
// is; `user` is only handed on.
unsafe impl Send for Watcher {}
// SAFETY: as above.
unsafe impl Sync for Watcher {}

impl Watcher {
    pub(super) fn new(callback: toile_progress_fn, user: *mut c_void) -> Self {
        Self { callback, user }
    }

    pub(super) fn none() -> Self {
        Self::new(None, std::ptr::null_mut())
    }

    /// Tells the host; whether it wants to go on.
    fn go_on(&self, progress: &Progress) -> bool {
        let Some(callback) = self.callback else {
            return true;
        };
        let stage = c_text(progress.stage);
        let progress = toile_progress {
            struct_size: size_of::<toile_progress>(),
            fraction: progress.fraction,
            stage: stage.as_ptr(),
            residual: progress.residual,
        };
        callback(self.user, &raw const progress) == 0
    }
}

/// The report as C sees it.
pub(super) fn report_for_c(report: &StepReport) -> toile_step_report {
    toile_step_report {
        struct_size: size_of::<toile_step_report>(),
        outcome: report.outcome as u32,
        reserved: 0,
        newton_iterations: report.newton_iterations,
        linear_iterations: report.linear_iterations,
        substeps: report.substeps,
        advanced: report.advanced,
        residual: report.residual,
        max_edge_strain: report.max_edge_strain,
        min_gap: report.min_gap,
        kinetic_energy: report.kinetic_energy,
        potential_energy: report.potential_energy,
        max_seam_gap: report.max_seam_gap,
    }
}

fn tell(log: &Log, what: &str, report: &StepReport) {
    let level = match report.outcome {
        Outcome::IterationLimit | Outcome::Stalled | Outcome::Falling => TOILE_LOG_WARNING,
        _ => TOILE_LOG_INFO,
    };
    log.say(level, || {
        format!(
            "{what}: {}, {} substeps, {} Newton iterations, residual {:.3e} N{}{}",
            report.outcome.name(),
            report.substeps,
            report.newton_iterations,
            report.residual,
            if report.reason.is_empty() { "" } else { ": " },
            report.reason
        )
    });
}

/// Advances by exactly `dt` [s], in smaller steps inside where needed, or fails and leaves the
/// simulation as it was. `report` may be NULL. Stopped by the simulation's progress callback it is
/// TOILE_OK, has advanced by 0 and leaves everything as it was. TOILE_E_NO_ADMISSIBLE_STATE: pins or
/// bodies ask for what cannot be; a shorter step may pass. `dt` is at most 1e6; no step inside is longer than
/// the number "solver.step.max" (0.05 s), so a long one takes as long as many.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_step(
    sim: *mut toile_sim,
    dt: f64,
    report: *mut toile_step_report,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let dt = input::positive(dt, "dt")?;
        desc::check_target(report, true)?;
        let result = write(sim, |sim, host| {
            let result = sim.step_watched(dt, &mut |progress| host.watcher.go_on(progress))?;
            if result.outcome != Outcome::Converged {
                tell(&host.log, "step", &result);
            }
            Ok(result)
        })?;
        desc::write(report, &report_for_c(&result))
    })
}

/// Sews the garment and lets it come to rest. `desc` NULL takes the defaults; `report` may be NULL.
/// Stopped by the iteration limit, by the progress callback, in a dead end, or because nothing holds
/// the garment, it is TOILE_OK too, with the outcome in the report, and may be called again to go
/// on.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_drape(
    sim: *mut toile_sim,
    desc: *const toile_drape_desc,
    report: *mut toile_step_report,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let desc = desc::read_or_default(desc)?;
        let options = DrapeOptions {
            force_tolerance: input::not_negative(desc.force_tolerance, "force_tolerance")?,
            max_steps: desc.max_steps,
        };
        desc::check_target(report, true)?;
        let watcher = Watcher::new(desc.progress, desc.progress_user);
        let result = write(sim, |sim, host| {
            let result = sim.drape(&options, &mut |progress| watcher.go_on(progress))?;
            tell(&host.log, "drape", &result);
            Ok(result)
        })?;
        desc::write(report, &report_for_c(&result))
    })
}

/// The report of the present state without advancing it: counts 0; the outcome is converged if it is
/// at rest to the force tolerance of a drape, else iteration limit; residual, strain, gaps and
/// energies as they are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_report(
    sim: *const toile_sim,
    report: *mut toile_step_report,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(report, false)?;
        let result = object.read(|object| object.sim.report())?;
        desc::write(report, &report_for_c(&result))
    })
}
