//! `toile_sim`: regions of yarns that change while it lives.

use super::garment;
use super::guard::entry;
use super::input;
use super::log::TOILE_LOG_INFO;
use super::sim::{Host, SIMS, vertex_count, write};
use super::status::toile_status;
use super::types::toile_sim;
use crate::blend::trace;
use crate::error::Result;
use crate::pattern::BlendRegion;
use crate::sim::Sim;

/// Moves the region of a panel in which every yarn is simulated, with the state carried over: a polygon in flat coordinates [m],
/// shape [count, 2], with `rings` hybrid rings around it, in the place of the panel's earlier regions; a count of 0 takes them away.
/// Yarns that come in lie in the triangles as these are and move with them; vertices stay where they are. The arrays of yarns
/// change their sizes and numbers, the epoch of toile_sim_yarn_changes grows; states that were saved under other regions are refused.
/// Where held vertices begin to follow yarns, the nodes on their edges and beside them are held in their place, as far from their
/// targets as these were; where yarns go, the vertices beside held nodes are. What toile_sim_create refuses is refused; TOILE_E_STATE: nothing
/// can take a pin's place, or the region leaves out where yarns have come out of contacts.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_blend_region(
    sim: *mut toile_sim,
    panel: u32,
    uv: *const f64,
    count: usize,
    rings: u32,
) -> toile_status {
    entry!({
        SIMS.get(sim.addr())?;
        let uv = input::points::<2>(uv, count, 1 << 20, "uv")?;
        write(sim, |sim, host| {
            let regions = garment::regions_with(sim.garment(), panel, &uv, rings)?;
            move_regions(sim, host, regions)
        })
    })
}

/// Moves all regions at once, with the state carried over: yarns are simulated in the triangles whose three corners have an `alpha` of 1,
/// with `rings` hybrid rings around them. One number from 0 to 1 for each vertex, shape [count], as toile_sim_suggest_region gives
/// them; values below 1 are those of the rings, 0 everywhere takes all yarns away. Otherwise as toile_sim_set_blend_region, and
/// TOILE_E_ARGUMENT as in toile_garment_set_blend_vertices.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_set_blend_vertices(
    sim: *mut toile_sim,
    alpha: *const f64,
    count: usize,
    rings: u32,
) -> toile_status {
    entry!({
        let expected = vertex_count(sim)?;
        input::same_count(count, expected, "alpha")?;
        let alpha = input::array(alpha, count, expected, "alpha")?.to_vec();
        write(sim, |sim, host| {
            let regions = trace::from_alpha(sim.mesh(), &alpha, rings)?;
            move_regions(sim, host, regions)
        })
    })
}

fn move_regions(sim: &mut Sim, host: &Host, regions: Vec<BlendRegion>) -> Result<()> {
    let change = sim.set_blend_regions(regions)?;
    host.log.say(TOILE_LOG_INFO, || {
        let [before, after] = change.masses;
        format!(
            "regions: {} yarn nodes stay, {} come in, {} go; mass {before:.6e} kg before, {after:.6e} kg after",
            change.kept, change.laid, change.gone
        )
    });
    Ok(())
}
