//! `toile_sim`: yarns, their nodes and what holds them.

use super::desc;
use super::guard::entry;
use super::input::{self, LARGEST_COUNT};
use super::output::{self, flat2, flat3};
use super::sim::{SIMS, read, write};
use super::status::toile_status;
use super::types::{toile_sim, toile_yarn_changes};
use crate::error::{Error, Result};
use crate::math::Vec3;

/// Most pieces of a curve between two nodes.
const MOST_SAMPLES: u32 = 64;

/// World positions of the yarns' nodes [m], shape [node_count, 3]; sizes as in toile_sim_positions.
/// Empty in a garment of triangles alone.
///
/// Nodes keep their numbers. Where yarns come out of contacts (toile_sim_yarn_changes tells) new nodes are counted
/// on at the end, and nodes that no yarn passes any more stay where they were; the sizes of this and of the
/// arrays below change then.
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

/// Force on each node of the yarns and of what acts on them [N], shape [node_count, 3]: on a node that is held
/// what its holder bears. Inertia is no part of it. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_forces(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(flat3(&sim.yarn_forces()?), out, capacity, needed)
        })
    })
}

/// Radius of each yarn [m], shape [yarn_count]. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_radii(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_radii(), out, capacity, needed)
        })
    })
}

/// Fabric of each yarn, counted as in the garment, shape [yarn_count]; rods along seams have the coarser of their two
/// sides. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_fabrics(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let fabrics = sim.yarns().map_or(&[][..], |yarns| &yarns.yarn_fabric);
            output::copy(fabrics, out, capacity, needed)
        })
    })
}

/// Panel in which each yarn was laid, shape [yarn_count]; rods along seams lie in one of the two. Sizes as in
/// toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_panels(
    sim: *const toile_sim,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_panels(), out, capacity, needed)
        })
    })
}

/// Where each node was laid in its panel, flat coordinates [m], shape [node_count, 2]. Sizes as in
/// toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_uv(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let uv = sim.yarns().map_or(&[][..], |yarns| &yarns.uv);
            output::copy(flat2(uv), out, capacity, needed)
        })
    })
}

/// Where the points of each yarn begin in toile_sim_yarn_curves of the same `samples`, shape [yarn_count + 1]; the last
/// number is the number of points. It changes when the epoch of toile_sim_yarn_changes does. Sizes as in toile_sim_positions.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_curve_offsets(
    sim: *const toile_sim,
    samples: u32,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        let samples = pieces(samples)?;
        read(sim, |sim| {
            output::copy(&sim.yarn_curve_offsets(samples)?, out, capacity, needed)
        })
    })
}

/// Yarns as they are drawn: points of smooth centre lines, `samples` pieces (1 to 64) between two nodes, which run beside each
/// other where yarns cross [m], shape [point_count, 3], yarn after yarn; a tube of toile_sim_yarn_radii around each is the
/// yarn. Sizes as in toile_sim_positions; asking for the number makes no points.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_curves(
    sim: *const toile_sim,
    samples: u32,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        let samples = pieces(samples)?;
        read(sim, |sim| {
            let offsets = sim.yarn_curve_offsets(samples)?;
            let count = 3 * offsets.last().copied().unwrap_or(0) as usize;
            if !output::takes(count, out, capacity, needed)? {
                return Ok(());
            }
            let curves = sim.yarn_curves(samples);
            let points: Vec<Vec3> = curves.into_iter().flat_map(|c| c.points).collect();
            output::copy(flat3(&points), out, capacity, needed)
        })
    })
}

fn pieces(samples: u32) -> Result<usize> {
    if (1..=MOST_SAMPLES).contains(&samples) {
        return Ok(samples as usize);
    }
    Err(Error::argument(format!(
        "samples = {samples} must be from 1 to {MOST_SAMPLES}"
    )))
}

/// Nodes of the border of a panel's yarns along one of its edges, rising: those on the edge, or with none before them
/// where a piece lies away from it, as a pin with `edge` in a scene holds them. Empty where no yarns are simulated. Sizes as
/// in toile_sim_positions. TOILE_E_ARGUMENT names a panel or an edge that does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_nodes_along(
    sim: *const toile_sim,
    panel: u32,
    edge: u32,
    out: *mut u32,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.yarn_nodes_along(panel, edge)?, out, capacity, needed)
        })
    })
}

/// What has changed since the yarns were laid: contacts that yarns came out of. `epoch` grows with every step, drape,
/// restored state or change of regions that changes it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_changes(
    sim: *const toile_sim,
    out: *mut toile_yarn_changes,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        desc::check_target(out, false)?;
        let (epoch, changes) = object.read(|o| Ok((o.sim.yarn_epoch(), o.sim.yarn_changes())))?;
        let changes = toile_yarn_changes {
            struct_size: size_of::<toile_yarn_changes>(),
            epoch,
            passages_gone: changes.passages_gone as u64,
            nodes_split: changes.nodes_split as u64,
            nodes_left: changes.nodes_left as u64,
        };
        desc::write(out, &changes)
    })
}

/// Node of a panel's yarns that was laid nearest to a point of the panel, in flat coordinates [m].
/// TOILE_E_ARGUMENT: the panel is not simulated as yarns.
///
/// cbindgen:ptrs-as-arrays=[[uv; 2]]
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_locate_yarn_node(
    sim: *const toile_sim,
    panel: u32,
    uv: *const f64,
    out_node: *mut u32,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out_node, "out_node")?;
        let uv = input::numbers::<2>(uv, "uv")?;
        let node = object.read(|o| o.sim.locate_yarn_node(panel, uv))?;
        output::put(out_node, node);
        Ok(())
    })
}

/// Node at the first (0) or the last (1) end of a yarn. TOILE_E_ARGUMENT names a yarn that does not exist.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_yarn_end(
    sim: *const toile_sim,
    yarn: u32,
    end: u32,
    out_node: *mut u32,
) -> toile_status {
    entry!({
        let object = SIMS.get(sim.addr())?;
        input::target(out_node, "out_node")?;
        let node = object.read(|o| o.sim.yarn_end(yarn, end))?;
        output::put(out_node, node);
        Ok(())
    })
}

/// Holds nodes of yarns, as toile_sim_pin holds vertices; yarns do not slide where they are held,
/// and no contact comes off there. A yarn is held whole by all of its nodes. TOILE_E_ARGUMENT names a node that does
/// not exist, or that no yarn passes any more.
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
