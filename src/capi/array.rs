//! Arrays that stay: numbers of a simulation where they lie, kept as they were for as long as their
//! handle lives, whatever becomes of the simulation.
//!
//! Nothing is copied when such an array is made: it points to the simulation's own memory. A call
//! that may change the simulation first looks for arrays that are still held. If there are any it
//! leaves them that memory and goes on with a copy of it (copy on write), so that what a host reads
//! through the pointer neither moves nor changes nor goes, not even while another thread steps.
//! Hosts whose objects are freed at times that nobody knows, such as NumPy's arrays, need this;
//! views (`readout`) are for those that can keep track.

use super::desc;
use super::guard::{entry, guard};
use super::handle::Table;
use super::input;
use super::output;
use super::sim::SIMS;
use super::status::toile_status;
use super::types::{toile_array, toile_sim, toile_view_f64};
use crate::error::Result;
use crate::math::Vec3;
use crate::sim::Sim;
use std::ptr;
use std::sync::{Arc, Mutex, PoisonError, Weak};

/// Points that somebody holds.
#[derive(Debug)]
pub(super) struct Held {
    data: *const Vec3,
    count: usize,
    epoch: u64,
    /// The memory itself, once the simulation has left it.
    own: Mutex<Option<Vec<Vec3>>>,
}

// SAFETY: `data` is only read, and what it points to is neither changed nor freed while this lives:
// it belongs to the simulation until that changes or goes, and to `own` from then on.
unsafe impl Send for Held {}
// SAFETY: as above.
unsafe impl Sync for Held {}

static ARRAYS: Table<Arc<Held>> = Table::new(0x74, "array");

/// What a simulation has lent of its memory since it last changed.
#[derive(Debug, Default)]
pub(super) struct Lent {
    positions: Mutex<Weak<Held>>,
    velocities: Mutex<Weak<Held>>,
}

/// The array that holds `points` already, or a new one.
fn hold(slot: &Mutex<Weak<Held>>, points: &[Vec3], epoch: u64) -> Arc<Held> {
    let mut slot = slot.lock().unwrap_or_else(PoisonError::into_inner);
    if let Some(held) = slot.upgrade() {
        return held;
    }
    let held = Arc::new(Held {
        data: points.as_ptr(),
        count: points.len(),
        epoch,
        own: Mutex::new(None),
    });
    *slot = Arc::downgrade(&held);
    held
}

/// Gives the memory to whoever holds it, if anybody does.
fn leave(slot: &mut Mutex<Weak<Held>>, memory: impl FnOnce() -> Vec<Vec3>) {
    let slot = slot.get_mut().unwrap_or_else(PoisonError::into_inner);
    if let Some(held) = std::mem::take(slot).upgrade() {
        *held.own.lock().unwrap_or_else(PoisonError::into_inner) = Some(memory());
    }
}

impl Lent {
    /// Ends every loan, before the simulation changes or goes.
    pub(super) fn settle(&mut self, sim: &mut Sim) {
        leave(&mut self.positions, || sim.leave_positions());
        leave(&mut self.velocities, || sim.leave_velocities());
    }
}

unsafe fn give(held: Arc<Held>, out: *mut *mut toile_array) -> Result<()> {
    let handle = ptr::without_provenance_mut(ARRAYS.insert(held)?);
    // SAFETY: checked by the caller.
    unsafe { output::put(out, handle) };
    Ok(())
}

/// Positions of the vertices [m] as they are now, shape [vertex_count, 3], kept as they are until
/// toile_array_free, whatever happens to the simulation. No copy is made now; the next call that
/// changes the simulation makes one if the array is still there.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_positions_array(
    sim: *const toile_sim,
    out: *mut *mut toile_array,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out, "out")?;
        let held = object.read(|o| Ok(hold(&o.lent.positions, o.sim.positions(), o.epoch())))?;
        give(held, out)
    })
}

/// Velocities of the vertices [m/s], shape [vertex_count, 3], kept like toile_sim_positions_array.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_velocities_array(
    sim: *const toile_sim,
    out: *mut *mut toile_array,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out, "out")?;
        let held = object.read(|o| Ok(hold(&o.lent.velocities, o.sim.velocities(), o.epoch())))?;
        give(held, out)
    })
}

/// Where the numbers of an array lie. They are there, and the same, until toile_array_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_array_view(
    array: *const toile_array,
    out: *mut toile_view_f64,
) -> toile_status {
    entry!({
        let array = ARRAYS.get(array.addr())?;
        desc::check_target(out, false)?;
        array.read(|held| {
            let points = std::slice::from_raw_parts(held.data, held.count);
            output::view3(points, held.epoch, out)
        })
    })
}

/// Frees an array; NULL is allowed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_array_free(array: *mut toile_array) {
    if !array.is_null() {
        guard(|| ARRAYS.remove(array.addr()));
    }
}
