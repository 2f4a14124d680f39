//! `toile_sim`: where yarns would change the answer, as errors and as a region.

use super::desc;
use super::guard::entry;
use super::input;
use super::output;
use super::sim::read;
use super::status::toile_status;
use super::types::{toile_sim, toile_suggest_desc, toile_suggestion};
use crate::error::{Error, Result};
use crate::indicate::indicator::{CRITERIA, LeftOut};
use crate::indicate::{Suggestion, Wish};

/// Criterion: waves that are too short for the triangles.
pub const TOILE_CRITERION_WRINKLE: u32 = 0;
/// Criterion: shape that the mesh does not follow.
pub const TOILE_CRITERION_MESH: u32 = 1;
/// Criterion: curvature beyond the range that triangles are fitted in.
pub const TOILE_CRITERION_CURVATURE: u32 = 2;
/// Criterion: strain beyond that range.
pub const TOILE_CRITERION_STRAIN: u32 = 3;
/// Criterion: jumps of strain between triangles.
pub const TOILE_CRITERION_STRESS: u32 = 4;
/// Criterion: bending moments across seams.
pub const TOILE_CRITERION_SEAM: u32 = 5;
/// Number of criteria.
pub const TOILE_CRITERION_COUNT: u32 = 6;

fn left_out(bits: u32) -> Result<LeftOut> {
    if bits >> CRITERIA.len() != 0 {
        return Err(Error::argument(format!(
            "left_out {bits:#x} has bits beyond those of the {} criteria",
            CRITERIA.len()
        )));
    }
    let mut list = LeftOut::default();
    for (k, left_out) in list.iter_mut().enumerate() {
        *left_out = bits >> k & 1 == 1;
    }
    Ok(list)
}

fn suggestion(found: &Suggestion) -> toile_suggestion {
    toile_suggestion {
        struct_size: size_of::<toile_suggestion>(),
        tolerance: found.tolerance,
        error: found.whole[0],
        error_left: found.left[0],
        largest_left: found.left[1],
        full_triangles: found.region.full.iter().filter(|f| **f).count() as u64,
        yarn_nodes: found.cost.yarn_nodes,
        carried_nodes: found.cost.carried_nodes,
        active_triangles: found.cost.triangles,
        unknowns: found.cost.unknowns,
        bytes: found.cost.bytes,
        time_ratio: found.cost.time_ratio,
        all_yarn_nodes: found.everywhere.yarn_nodes,
        all_time_ratio: found.everywhere.time_ratio,
        iteration_ratio: found.cost.iteration_ratio,
    }
}

/// Suggests the region in which yarns would change the answer, from the present state of triangles alone, for a
/// tolerance, a budget of nodes, or both: `alpha` of each vertex, shape [vertex_count], 1 where yarns are wanted, falling to 0 over
/// the rings, 0 elsewhere; all 0 where triangles do. toile_garment_set_blend_vertices takes it. `out`, which may be NULL, gets what
/// the region leaves and costs. Sizes as in toile_sim_positions; `alpha` NULL asks for the number and for `out`.
/// TOILE_E_ARGUMENT: neither tolerance nor budget, every criterion left out, or no fabric has yarns; TOILE_E_UNSUPPORTED: the
/// simulation has yarns already, so that its state is not that of triangles. Ask one of the same garment without blend regions, or take
/// them away with toile_sim_set_blend_vertices and let the triangles go on first.
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
            let tolerance = input::finite(desc.tolerance, "tolerance")?;
            let wish = Wish {
                tolerance: (tolerance != 0.0).then_some(tolerance),
                budget: (desc.budget > 0).then_some(desc.budget),
                rings: desc.rings,
                left_out: left_out(desc.left_out)?,
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
            let errors = sim.vertex_errors(&LeftOut::default())?;
            output::copy(&errors.error, out, capacity, needed)
        })
    })
}

/// What the error of each vertex is made of, shape [vertex_count, TOILE_CRITERION_COUNT]: the estimate by each criterion, in the order of
/// TOILE_CRITERION_...; the error is the root of the sum of their squares. Otherwise as toile_sim_vertex_errors.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_vertex_criteria(
    sim: *const toile_sim,
    out: *mut f64,
    capacity: usize,
    needed: *mut usize,
) -> toile_status {
    entry!({
        read(sim, |sim| {
            let errors = sim.vertex_errors(&LeftOut::default())?;
            output::copy(errors.criteria.as_flattened(), out, capacity, needed)
        })
    })
}
