//! Simulations: made, put into a world, edited, saved, restored.

use super::array::Lent;
use super::body::BODIES;
use super::desc;
use super::garment::{self, GARMENTS};
use super::guard::{entry, guard};
use super::handle::Table;
use super::input;
use super::log::{Log, TOILE_LOG_ERROR, TOILE_LOG_INFO, TOILE_LOG_WARNING};
use super::motion::Watcher;
use super::output;
use super::status::toile_status;
use super::types::{toile_body, toile_contact_desc, toile_garment, toile_sim, toile_sim_desc};
use crate::error::Result;
use crate::sim::{ContactSettings, Settings, Sim, SimOptions};
use crate::sim_scene;
use std::ffi::c_char;
use std::ptr;

/// A simulation and what the boundary keeps beside it.
pub(super) struct SimObject {
    pub(super) sim: Sim,
    host: Host,
    /// Arrays that hosts hold.
    pub(super) lent: Lent,
    /// Calls that left the state as it was, but elsewhere in memory.
    moved: u64,
}

/// The host's callbacks.
#[derive(Clone, Copy, Debug)]
pub(super) struct Host {
    pub(super) log: Log,
    /// Of steps; a drape brings its own.
    pub(super) watcher: Watcher,
}

impl Drop for SimObject {
    fn drop(&mut self) {
        self.lent.settle(&mut self.sim);
    }
}

impl SimObject {
    /// Changes exactly when views end.
    pub(super) fn epoch(&self) -> u64 {
        self.sim.epoch() + self.moved
    }
}

pub(super) static SIMS: Table<SimObject> = Table::new(0x73, "simulation");

pub(super) fn read<R>(sim: *const toile_sim, f: impl FnOnce(&Sim) -> Result<R>) -> Result<R> {
    SIMS.get(sim.addr())?.read(|object| f(&object.sim))
}

/// Runs a call that may change the simulation; its failure is logged.
pub(super) fn write<R>(
    sim: *mut toile_sim,
    f: impl FnOnce(&mut Sim, &Host) -> Result<R>,
) -> Result<R> {
    SIMS.get(sim.addr())?.write(|object| {
        let host = object.host;
        let place = |sim: &Sim| (sim.positions().as_ptr(), sim.velocities().as_ptr());
        let before = (place(&object.sim), object.sim.epoch());
        object.lent.settle(&mut object.sim);
        let result = f(&mut object.sim, &host).inspect_err(|error| {
            host.log.say(TOILE_LOG_ERROR, || error.message.clone());
        });
        if object.sim.epoch() == before.1 && place(&object.sim) != before.0 {
            object.moved += 1;
        }
        result
    })
}

/// Number of vertices, asked before arrays of the caller are measured against it.
pub(super) fn vertex_count(sim: *const toile_sim) -> Result<usize> {
    read(sim, |sim| Ok(sim.positions().len()))
}

unsafe fn give(sim: Sim, host: Host, out: *mut *mut toile_sim) -> Result<()> {
    host.log.say(TOILE_LOG_INFO, || {
        let info = sim.info();
        format!(
            "{} vertices, {} triangles, {} unknowns, smallest angle {:.1} degrees, {}",
            info.vertices,
            info.triangles,
            info.unknowns,
            info.min_angle.to_degrees(),
            info.backend
        )
    });
    for note in sim.info().notes {
        host.log.say(TOILE_LOG_WARNING, || note.clone());
    }
    let object = SimObject {
        sim,
        host,
        lent: Lent::default(),
        moved: 0,
    };
    let handle = ptr::without_provenance_mut(SIMS.insert(object)?);
    // SAFETY: checked by the caller.
    unsafe { output::put(out, handle) };
    Ok(())
}

/// Triangulates a garment and makes it ready to move; its vertices stand where the panels are
/// placed. `desc` NULL takes the defaults. The garment may be changed or freed afterwards. Free the
/// simulation with toile_sim_free. TOILE_E_GEOMETRY and TOILE_E_LIMIT name the panel;
/// TOILE_E_ARGUMENT: a blend region holds no triangle, its fabric has no yarns, or it has more than 3 hybrid
/// rings; TOILE_E_UNSUPPORTED: regions have different numbers of rings.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_create(
    garment: *const toile_garment,
    desc: *const toile_sim_desc,
    out: *mut *mut toile_sim,
) -> toile_status {
    entry!({
        let garment = GARMENTS.get(garment.addr())?;
        input::target(out, "out")?;
        let desc = desc::read_or_default(desc)?;
        input::reserved(desc.reserved)?;
        input::finite_all(&desc.gravity, "gravity")?;
        input::finite_all(&desc.wind, "wind")?;
        let mut settings = Settings::default();
        settings.set("solver.threads", f64::from(desc.threads))?;
        settings.set("limits.vertices", desc.max_vertices as f64)?;
        let options = SimOptions {
            gravity: Some(desc.gravity),
            wind: desc.wind,
            pressure: input::finite(desc.pressure, "pressure")?,
            settings,
        };
        let host = Host {
            log: Log::new(desc.log, desc.log_user),
            watcher: Watcher::new(desc.progress, desc.progress_user),
        };
        let sim = garment.read(|object| Sim::new(&object.garment, &options))?;
        give(sim, host, out)
    })
}

/// Makes a simulation from a scene file: garment, bodies, pins, numbers. `utf8` has `length` bytes;
/// files named inside are looked for in `base_dir` (UTF-8, ends with NUL; NULL: the working
/// directory). Bodies and pins stand where the file has them at its start; motions and the length of
/// the run are the host's to play. Free it with toile_sim_free. TOILE_E_PARSE names the key.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_from_scene(
    utf8: *const c_char,
    length: usize,
    base_dir: *const c_char,
    out: *mut *mut toile_sim,
) -> toile_status {
    entry!({
        input::target(out, "out")?;
        let text = input::text(utf8, length, "utf8")?;
        let folder = input::optional_folder(base_dir)?;
        let (sim, _) = sim_scene::sim_from_json(text, folder.as_deref())?;
        give(
            sim,
            Host {
                log: Log::none(),
                watcher: Watcher::none(),
            },
            out,
        )
    })
}

/// The garment that the simulation was made of, with its present regions of yarns, as a new handle; free it with toile_garment_free.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_garment(
    sim: *const toile_sim,
    out: *mut *mut toile_garment,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out, "out")?;
        let copy = object.read(|object| Ok(object.sim.garment().clone()))?;
        output::put(out, garment::insert(copy, Vec::new())?);
        Ok(())
    })
}

/// Puts a body into the world, at the origin until it gets a pose. `contact` NULL takes the
/// defaults; `out_body`, which may be NULL, gets the body's number. The body may be freed afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_body_sdf(
    sim: *mut toile_sim,
    body: *const toile_body,
    contact: *const toile_contact_desc,
    out_body: *mut u32,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let body = BODIES.get(body.addr())?.read(|body| Ok(body.clone()))?;
        let desc = desc::read_or_default(contact)?;
        let contact = ContactSettings {
            friction: input::not_negative(desc.friction, "friction")?,
            thickness: input::not_negative(desc.thickness, "thickness")?,
            stiffness: input::positive(desc.stiffness, "stiffness")?,
        };
        let number = write(sim, |sim, _| sim.add_body(&body, &contact))?;
        if !out_body.is_null() {
            output::put(out_body, number);
        }
        Ok(())
    })
}

/// Says where a body is to be at the end of the next step: position [m] of its origin, within 1e6, and rotation
/// x, y, z, w. The cloth feels the velocity that follows. Before the first step or drape it is a
/// placement: the body stands there at once and has no velocity. A drape takes the body to its pose, and
/// cloth that rests on it goes along.
///
/// cbindgen:ptrs-as-arrays=[[position; 3], [quaternion_xyzw; 4]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_body_pose(
    sim: *mut toile_sim,
    body: u32,
    position: *const f64,
    quaternion_xyzw: *const f64,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let position = input::numbers::<3>(position, "position")?;
        let xyzw = input::numbers::<4>(quaternion_xyzw, "quaternion_xyzw")?;
        // checked here, made a unit one there: every host gets the same bits
        input::quaternion(xyzw, "quaternion_xyzw")?;
        write(sim, |sim, _| sim.set_body_pose(body, position, xyzw))
    })
}

/// Says where the vertices of a mesh body are to be at the end of the next step, in the body's
/// frame [m], within 1e6, shape [vertex_count, 3]. `vertex_count` must be the body's. The cloth feels the
/// velocities that follow; before the first step or drape it is a placement, as with a pose.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_body_vertices(
    sim: *mut toile_sim,
    body: u32,
    positions: *const f64,
    vertex_count: usize,
) -> toile_status {
    entry!({
        let expected = read(sim, |sim| sim.body_mesh(body))?.0.len();
        input::same_count(vertex_count, expected, "positions")?;
        let positions = input::points(positions, vertex_count, expected, "positions")?;
        write(sim, |sim, _| sim.set_body_vertices(body, &positions))
    })
}

/// Holds vertices: [count] numbers, targets [m], within 1e6, shape [count, 3], reached at the end of the next
/// step. `targets` NULL holds them where they are. A vertex that is held already gets the new
/// target.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_pin(
    sim: *mut toile_sim,
    vertices: *const u32,
    count: usize,
    targets: *const f64,
) -> toile_status {
    entry!({
        let limit = vertex_count(sim)?;
        let vertices = input::array(vertices, count, limit, "vertices")?.to_vec();
        let targets = if targets.is_null() {
            None
        } else {
            Some(input::points::<3>(targets, count, limit, "targets")?)
        };
        write(sim, |sim, _| sim.pin(&vertices, targets.as_deref()))
    })
}

/// Lets vertices go. TOILE_E_ARGUMENT names one that is not held.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_unpin(
    sim: *mut toile_sim,
    vertices: *const u32,
    count: usize,
) -> toile_status {
    entry!({
        let limit = vertex_count(sim)?;
        let vertices = input::array(vertices, count, limit, "vertices")?.to_vec();
        write(sim, |sim, _| sim.unpin(&vertices))
    })
}

/// Sets a tunable number by its dotted name, the same as in scene files:
/// "solver.newton.max_iterations", "gravity.x", "wind.z", "pressure". TOILE_E_ARGUMENT names the
/// range. `toile schema` prints every name with its unit, range and meaning.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_number(
    sim: *mut toile_sim,
    name: *const c_char,
    value: f64,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let name = input::name(name, "name")?.to_owned();
        let value = input::finite(value, &name)?;
        write(sim, |sim, _| sim.set_number(&name, value))
    })
}

/// Reads what toile_sim_set_number sets.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_number(
    sim: *const toile_sim,
    name: *const c_char,
    out: *mut f64,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        input::target(out, "out")?;
        let name = input::name(name, "name")?;
        let value = read(sim, |sim| sim.number(name))?;
        output::put(out, value);
        Ok(())
    })
}

/// Sets the acceleration of gravity [m/s^2], each component within 1e6.
///
/// cbindgen:ptrs-as-arrays=[[gravity; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_gravity(
    sim: *mut toile_sim,
    gravity: *const f64,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let gravity = input::numbers::<3>(gravity, "gravity")?;
        write(sim, |sim, _| sim.set_gravity(gravity))
    })
}

/// Sets the velocity of the air [m/s], each component within 1e6.
///
/// cbindgen:ptrs-as-arrays=[[wind; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_wind(sim: *mut toile_sim, wind: *const f64) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let wind = input::numbers::<3>(wind, "wind")?;
        write(sim, |sim, _| sim.set_wind(wind))
    })
}

/// Puts every vertex somewhere: positions [m] and velocities [m/s] within 1e6, shape [vertex_count, 3];
/// `velocities` NULL is at rest. `vertex_count` must be the simulation's.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_positions(
    sim: *mut toile_sim,
    positions: *const f64,
    velocities: *const f64,
    vertex_count: usize,
) -> toile_status {
    entry!({
        let expected = self::vertex_count(sim)?;
        input::same_count(vertex_count, expected, "positions")?;
        let x = input::points(positions, vertex_count, expected, "positions")?;
        let v = if velocities.is_null() {
            None
        } else {
            Some(input::points(
                velocities,
                vertex_count,
                expected,
                "velocities",
            )?)
        };
        write(sim, |sim, _| sim.set_positions(&x, v.as_deref()))
    })
}

/// The state as bytes: everything that the next step depends on. `needed` gets the number of bytes;
/// `out` NULL asks for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_save(
    sim: *const toile_sim,
    out: *mut u8,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({ read(sim, |sim| output::copy(&sim.save()?, out, capacity, needed)) })
}

/// Restores what toile_sim_save wrote, of a simulation made of the same garment with the same
/// bodies, in this process or another. The simulation then goes on bit by bit as the saved one did.
/// TOILE_E_PARSE and TOILE_E_STATE say what does not fit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_restore(
    sim: *mut toile_sim,
    bytes: *const u8,
    count: usize,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let bytes = input::array(bytes, count, 1 << 36, "bytes")?;
        write(sim, |sim, _| sim.restore(bytes))
    })
}

/// Frees a simulation; NULL is allowed. Views of it end.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_free(sim: *mut toile_sim) {
    if !sim.is_null() {
        guard(|| SIMS.remove(sim.addr()));
    }
}
