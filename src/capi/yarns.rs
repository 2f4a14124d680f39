//! `toile_sim`: yarns, their nodes and what holds them.

use super::guard::entry;
use super::input::{self, LARGEST_COUNT};
use super::output::{self, flat3};
use super::sim::{SIMS, read, write};
use super::status::toile_status;
use super::types::toile_sim;

/// World positions of the yarns' nodes [m], shape [node_count, 3]; sizes as in toile_sim_positions.
/// Empty in a garment of triangles alone.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_nodes(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat3(sim.yarn_nodes()), out, capacity, needed)
        })
    })
}

/// Where the nodes of each yarn begin in toile_sim_yarn_indices, shape [yarn_count + 1]; the last
/// number is the length of that array; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_offsets(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let starts = sim.yarns().map_or(&[0][..], |yarns| &yarns.starts);
            output::copy(starts, out, capacity, needed)
        })
    })
}

/// Nodes of the yarns, yarn after yarn; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_indices(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let passages = sim.yarns().map_or(&[][..], |yarns| &yarns.incidences);
            let nodes: Vec<u32> = passages.iter().map(|p| p.node).collect();
            output::copy(&nodes, out, capacity, needed)
        })
    })
}

/// Arc length at rest of each yarn at its nodes [m], in the order of toile_sim_yarn_indices; it
/// changes where yarns slide. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_coordinates(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(sim.yarn_coordinates(), out, capacity, needed)
        })
    })
}

/// Tension of each yarn between a node and the next along it [N], negative where it is compressed,
/// in the order of toile_sim_yarn_indices with 0 at the last node of a yarn. Sizes as in
/// toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_tensions(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_tensions(), out, capacity, needed)
        })
    })
}

/// Largest normal force between two yarns at each node [N], shape [node_count], of the last step or
/// drape. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_compressions(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_compressions(), out, capacity, needed)
        })
    })
}

/// How far each yarn has slid through its nodes since it was laid [m], in the order of
/// toile_sim_yarn_indices. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_slips(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_slips(), out, capacity, needed)
        })
    })
}

/// 1 for each node that moves by itself, 0 for one that the triangles around a region of yarns carry,
/// shape [node_count]; sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_active(
    sim: *const toile_sim,
    out: *mut u8,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let active: Vec<u8> = sim.active_yarn_nodes().into_iter().map(u8::from).collect();
            output::copy(&active, out, capacity, needed)
        })
    })
}

/// Holds nodes of yarns, as toile_sim_pin holds vertices; yarns do not slide where they are held.
/// TOILE_E_ARGUMENT names a node that does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_pin_yarn_nodes(
    sim: *mut toile_sim,
    nodes: *const u32,
    count: usize,
    targets: *const f64,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let nodes = input::array(nodes, count, LARGEST_COUNT, "nodes")?.to_vec();
        let targets = if targets.is_null() {
            None
        } else {
            Some(input::points::<3>(
                targets,
                count,
                LARGEST_COUNT,
                "targets",
            )?)
        };
        write(sim, |sim, _| sim.pin_yarn_nodes(&nodes, targets.as_deref()))
    })
}

/// Lets nodes of yarns go. TOILE_E_ARGUMENT names one that is not held.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_unpin_yarn_nodes(
    sim: *mut toile_sim,
    nodes: *const u32,
    count: usize,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let nodes = input::array(nodes, count, LARGEST_COUNT, "nodes")?.to_vec();
        write(sim, |sim, _| sim.unpin_yarn_nodes(&nodes))
    })
}
