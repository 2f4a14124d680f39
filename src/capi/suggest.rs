//! `toile_sim`: where yarns would change the answer, as errors and as a region.

use super::desc;
use super::guard::entry;
use super::input;
use super::output;
use super::sim::read;
use super::status::toile_status;
use super::types::{toile_sim, toile_suggest_desc, toile_suggestion};
use crate::indicate::{Suggestion, Wish};

fn suggestion(found: &Suggestion) -> toile_suggestion {
    toile_suggestion {
        struct_size: size_of::<toile_suggestion>(),
        tolerance: found.tolerance,
        error: found.errors[0],
        error_left: found.errors[1],
        largest_left: found.largest_left,
        full_triangles: found.region.full.iter().filter(|f| **f).count() as u64,
        yarn_nodes: found.cost.yarn_nodes,
        carried_nodes: found.cost.carried_nodes,
        active_triangles: found.cost.triangles,
        unknowns: found.cost.unknowns,
        bytes: found.cost.bytes,
        time_ratio: found.cost.time_ratio,
        all_yarn_nodes: found.everywhere.yarn_nodes,
        all_time_ratio: found.everywhere.time_ratio,
    }
}

/// Suggests the region in which yarns would change the answer, from the present state of triangles alone, for a
/// tolerance, a budget of nodes, or both: `alpha` of each vertex, shape [vertex_count], 1 where yarns are wanted, falling to 0 over
/// the rings, 0 elsewhere; all 0 where triangles do. toile_garment_set_blend_vertices takes it. `out`, which may be NULL, gets what
/// the region leaves and costs. Sizes as in toile_sim_positions; `alpha` NULL asks for the number and for `out`.
/// TOILE_E_ARGUMENT: neither tolerance nor budget, or no fabric has yarns; TOILE_E_UNSUPPORTED: the
/// simulation has yarns already.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_suggest_region(
    sim: *const toile_sim,
    desc: *const toile_suggest_desc,
    alpha: *mut f64,
    capacity: usize,
    needed: *mut usize,
    out: *mut toile_suggestion,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let desc = desc::read(desc)?;
            desc::check_target(out, true)?;
            input::reserved(desc.reserved)?;
            let tolerance = input::not_negative(desc.tolerance, "tolerance")?;
            let wish = Wish {
                tolerance: (tolerance > 0.0).then_some(tolerance),
                budget: (desc.budget > 0).then_some(desc.budget),
                rings: desc.rings,
            };
            let found = sim.suggest_region(&wish)?;
            output::copy(&found.region.alpha, alpha, capacity, needed)?;
            desc::write(out, &suggestion(&found))
        })
    })
}

/// Estimated error of the triangles at each vertex, shape [vertex_count], in the present state: that of the deformation's gradient,
/// without a unit; 0 where the fabric has no yarns. Sizes as in toile_sim_positions. TOILE_E_UNSUPPORTED: the simulation has yarns.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_errors(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            output::copy(&sim.vertex_errors()?.error, out, capacity, needed)
        })
    })
}
