//! What hosts read: arrays, views, energies, counts. All of it may run beside each other.

use super::desc;
use super::guard::{entry, value};
use super::input;
use super::output::{self, flat2, flat3};
use super::sim::{SIMS, read};
use super::status::toile_status;
use super::types::{toile_energies, toile_sim, toile_system_info, toile_view_f64};

/// A number that changes exactly when views end: with each call that changes the simulation. 0 for
/// a handle that is none; the last error tells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_epoch(sim: *const toile_sim) -> u64 {
    value(0, || {
        SIMS.get(sim.addr())?.read(|object| Ok(object.epoch()))
    })
}

/// Simulated time [s]. NaN for a handle that is none; the last error tells.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_time(sim: *const toile_sim) -> f64 {
    value(f64::NAN, || read(sim, |sim| Ok(sim.time())))
}

/// Number of vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_count(
    sim: *const toile_sim,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        output::count(&SIMS, sim.addr(), out_count, "vertices", |o| {
            o.sim.positions().len()
        })
    })
}

/// Number of triangles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_triangle_count(
    sim: *const toile_sim,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        output::count(&SIMS, sim.addr(), out_count, "triangles", |o| {
            o.sim.triangles().len()
        })
    })
}

/// Number of bodies; they are numbered from 0 in the order in which they came.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_body_count(
    sim: *const toile_sim,
    out_count: *mut u32,
) -> toile_status {
    entry!({
        output::count(&SIMS, sim.addr(), out_count, "bodies", |o| {
            o.sim.body_count()
        })
    })
}

/// Positions of the vertices [m], shape [vertex_count, 3]. `needed` gets the count of numbers;
/// `out` NULL asks for it; a smaller `capacity` is TOILE_E_SIZE.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_positions(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat3(sim.positions()), out, capacity, needed)
        })
    })
}

/// Velocities of the vertices [m/s], shape [vertex_count, 3]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_velocities(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat3(sim.velocities()), out, capacity, needed)
        })
    })
}

/// Unit normals at the vertices, pointing to the outside of the cloth, shape [vertex_count, 3];
/// sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_normals(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat3(&sim.normals()), out, capacity, needed)
        })
    })
}

/// Panel of each vertex, shape [vertex_count]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_panels(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(sim.vertex_panels(), out, capacity, needed)
        })
    })
}

/// Flat coordinates of each vertex in its panel [m], shape [vertex_count, 2]; sizes as in
/// toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_uv(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat2(sim.vertex_uv()), out, capacity, needed)
        })
    })
}

/// 1 for each vertex that moves by itself, 0 for one that follows the yarns above it, shape
/// [vertex_count]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_active(
    sim: *const toile_sim,
    out: *mut u8,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let active: Vec<u8> = sim.active_vertices().into_iter().map(u8::from).collect();
            output::copy(&active, out, capacity, needed)
        })
    })
}

/// Vertices of each triangle, counter-clockwise seen from the outside of the cloth, shape
/// [triangle_count, 3]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_triangles(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(sim.triangles().as_flattened(), out, capacity, needed)
        })
    })
}

/// Positions of the vertices [m] where they lie, shape [vertex_count, 3].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_positions_view(
    sim: *const toile_sim,
    out: *mut toile_view_f64,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(out, false)?;
        object.read(|o| output::view3(o.sim.positions(), o.epoch(), out))
    })
}

/// Velocities of the vertices [m/s] where they lie, shape [vertex_count, 3].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_velocities_view(
    sim: *const toile_sim,
    out: *mut toile_view_f64,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(out, false)?;
        object.read(|o| output::view3(o.sim.velocities(), o.epoch(), out))
    })
}

/// Vertex of a panel nearest to a point of it, in flat coordinates [m].
///
/// cbindgen:ptrs-as-arrays=[[uv; 2]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_locate(
    sim: *const toile_sim,
    panel: u32,
    uv: *const f64,
    out_vertex: *mut u32,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out_vertex, "out_vertex")?;
        let uv = input::numbers::<2>(uv, "uv")?;
        let vertex = object.read(|o| o.sim.locate(panel, uv))?;
        output::put(out_vertex, vertex);
        Ok(())
    })
}

/// Force [N] and torque [N m] of the cloth on a body at the end of the last step, about the body's
/// own origin, in world axes. Either may be NULL.
///
/// cbindgen:ptrs-as-arrays=[[force; 3], [torque; 3]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_body_wrench(
    sim: *const toile_sim,
    body: u32,
    force: *mut f64,
    torque: *mut f64,
) -> toile_status {
    entry!({
        let (f, t) = read(sim, |sim| sim.body_wrench(body))?;
        if !force.is_null() {
            output::put(force.cast(), f);
        }
        if !torque.is_null() {
            output::put(torque.cast(), t);
        }
        Ok(())
    })
}

/// A body's surface as it stands in the world now, to draw it: positions [m], shape [count, 3];
/// sizes as in toile_sim_positions. A plane gives a square.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_body_positions(
    sim: *const toile_sim,
    body: u32,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let (positions, _) = sim.body_mesh(body)?;
            output::copy(flat3(&positions), out, capacity, needed)
        })
    })
}

/// Triangles of that surface, shape [count, 3]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_body_triangles(
    sim: *const toile_sim,
    body: u32,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let (_, triangles) = sim.body_mesh(body)?;
            output::copy(triangles.as_flattened(), out, capacity, needed)
        })
    })
}

/// Energies of the present state [J].
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_energies(
    sim: *const toile_sim,
    out: *mut toile_energies,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(out, false)?;
        let e = object.read(|o| o.sim.energies())?;
        let energies = toile_energies {
            struct_size: size_of::<toile_energies>(),
            kinetic: e.kinetic,
            gravity: e.gravity,
            membrane: e.membrane,
            bending: e.bending,
            seam: e.seam,
            contact: e.contact,
            yarn: e.yarn,
        };
        desc::write(out, &energies)
    })
}

/// What was built and what it costs.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_info(
    sim: *const toile_sim,
    out: *mut toile_system_info,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(out, false)?;
        let info = object.read(|o| Ok(o.sim.info()))?;
        let info = toile_system_info {
            struct_size: size_of::<toile_system_info>(),
            vertices: info.vertices as u64,
            triangles: info.triangles as u64,
            yarn_nodes: info.yarn_nodes as u64,
            unknowns: info.unknowns as u64,
            bytes: info.bytes as u64,
            factor_bytes: info.factor_bytes as u64,
            min_angle: info.min_angle,
            active_triangles: info.active_triangles as u64,
            carried_nodes: info.carried_nodes as u64,
        };
        desc::write(out, &info)
    })
}

/// Name of the linear solver in use, UTF-8. `needed` gets the bytes, the final NUL included; `out`
/// NULL asks for it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_backend(
    sim: *const toile_sim,
    out: *mut std::ffi::c_char,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy_text(&sim.info().backend, out, capacity, needed)
        })
    })
}
