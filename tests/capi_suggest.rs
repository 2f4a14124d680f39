//! Regions of yarns that hosts are suggested, through the C interface.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "the functions under test take the pointers of C; what goes in is in view here"
)]

use crate::capi_support::scene::*;
use std::f64::consts::PI;
use std::ffi::CStr;
use std::ptr;
use toile::capi::*;

const WEAVE: &CStr = c"{\"density\": 0.3, \"membrane\": {\"warp\": 500, \"weft\": 500, \"shear\": 20, \"coupling\": 0},
    \"bending\": {\"warp\": 1e-5, \"weft\": 1e-5},
    \"yarns\": {\"weave\": \"plain\", \"warp_pitch\": 0.004, \"radius\": 0.001, \"young\": 6e5, \"shear\": 2e4}}";

/// A square of a weave with waves on its half with `u > 0`.
fn waved() -> (Garment, Sim) {
    let garment = square(0.012, 0.0);
    let fabric = WEAVE.to_bytes();
    ok(unsafe { toile_garment_set_fabric(garment.0, fabric.as_ptr().cast(), fabric.len()) });
    let sim = Sim::new(&garment);
    let mut x = sim.positions();
    let uv: Vec<f64> = array(|o, c, k| unsafe { toile_sim_vertex_uv(sim.0, o, c, k) });
    for (p, uv) in x.chunks_mut(3).zip(uv.chunks(2)) {
        p[1] += 4e-3 * (PI * uv[0].max(0.0) / 0.03).sin();
    }
    let count = sim.vertex_count();
    ok(unsafe { toile_sim_set_positions(sim.0, x.as_ptr(), ptr::null(), count) });
    (garment, sim)
}

fn alpha(sim: &Sim, desc: &toile_suggest_desc) -> Vec<f64> {
    array(|o, c, k| unsafe { toile_sim_suggest_region(sim.0, desc, o, c, k, ptr::null_mut()) })
}

/// A host asks for a region, gives its alpha to the garment and has a simulation with yarns there.
#[test]
fn a_suggested_region_is_one_that_a_garment_takes() {
    let (garment, sim) = waved();
    let mut desc = filled(toile_suggest_desc_init);
    assert_eq!((desc.tolerance, desc.budget, desc.rings), (0.0, 0, 0));
    desc.budget = 1300;
    let mut out = filled(toile_suggestion_init);
    let epoch = sim.epoch();
    let alpha = alpha(&sim, &desc);
    let (none, unasked) = (ptr::null_mut(), &mut 0);
    ok(unsafe { toile_sim_suggest_region(sim.0, &desc, none, 0, unasked, &mut out) });
    assert_eq!(alpha.len(), sim.vertex_count());
    assert_eq!(sim.epoch(), epoch);
    assert!(out.yarn_nodes > 800 && out.yarn_nodes <= 1300);
    assert!(out.yarn_nodes < out.all_yarn_nodes && out.time_ratio < out.all_time_ratio);
    assert!(out.error_left < out.error && out.full_triangles > 0);
    let uv: Vec<f64> = array(|o, c, k| unsafe { toile_sim_vertex_uv(sim.0, o, c, k) });
    for (a, uv) in alpha.iter().zip(uv.chunks(2)) {
        assert!(*a == 0.0 || (*a == 1.0 && uv[0] > -0.04), "{a} at {uv:?}");
    }
    let errors: Vec<f64> = array(|o, c, k| unsafe { toile_sim_vertex_errors(sim.0, o, c, k) });
    assert_eq!(errors.len(), alpha.len());
    let criteria: Vec<f64> = array(|o, c, k| unsafe { toile_sim_vertex_criteria(sim.0, o, c, k) });
    let of_each = criteria.chunks(TOILE_CRITERION_COUNT as usize);
    assert_eq!(of_each.len(), errors.len());
    for (error, criteria) in errors.iter().zip(of_each) {
        let sum: f64 = criteria.iter().map(|c| c * c).sum();
        assert!((error - sum.sqrt()).abs() < 1e-12);
    }
    // waves across no seam: that criterion alone wants nothing
    let mut seam = desc;
    seam.left_out = (1 << TOILE_CRITERION_COUNT) - 1 - (1 << TOILE_CRITERION_SEAM);
    assert!(self::alpha(&sim, &seam).iter().all(|a| *a == 0.0));
    let count = alpha.len();
    ok(unsafe { toile_garment_set_blend_vertices(garment.0, alpha.as_ptr(), count, 0) });
    let mixed = Sim::new(&garment);
    let mut info = filled(toile_system_info_init);
    ok(unsafe { toile_sim_info(mixed.0, &mut info) });
    assert_eq!(info.active_triangles, out.active_triangles);
    assert_eq!(
        (info.yarn_nodes, info.carried_nodes, info.unknowns),
        (out.yarn_nodes, out.carried_nodes, out.unknowns)
    );
    // the simulation that was asked takes it as it lives
    let x = sim.positions();
    ok(unsafe { toile_sim_set_blend_vertices(sim.0, alpha.as_ptr(), count, 0) });
    assert_eq!(sim.positions(), x);
    assert!(sim.epoch() > epoch);
    let mut live = filled(toile_system_info_init);
    ok(unsafe { toile_sim_info(sim.0, &mut live) });
    assert_eq!(
        (live.yarn_nodes, live.active_triangles, live.unknowns),
        (info.yarn_nodes, info.active_triangles, info.unknowns)
    );
    let few = unsafe { toile_sim_set_blend_vertices(sim.0, alpha.as_ptr(), count - 1, 0) };
    fails(few, TOILE_E_ARGUMENT);
    let _ = sim.step(1e-3);
    ok(unsafe { toile_sim_set_blend_region(sim.0, 0, ptr::null(), 0, 0) });
    ok(unsafe { toile_sim_info(sim.0, &mut live) });
    assert_eq!(live.yarn_nodes, 0);
    // the mixed one is not asked again
    let status = unsafe { toile_sim_suggest_region(mixed.0, &desc, none, 0, unasked, none.cast()) };
    fails(status, TOILE_E_UNSUPPORTED);
    assert!(last_error().contains("without blend regions"));
    let status = unsafe { toile_sim_vertex_errors(mixed.0, none, 0, unasked) };
    fails(status, TOILE_E_UNSUPPORTED);
    // zero everywhere takes the regions away
    let zero = vec![0.0; count];
    ok(unsafe { toile_garment_set_blend_vertices(garment.0, zero.as_ptr(), count, 0) });
    assert!(!garment.json().contains("blend_regions"));
}

/// What a host did not mean is refused, and nothing is changed or written.
#[test]
fn wishes_and_alphas_that_cannot_be_are_refused() {
    let (garment, sim) = waved();
    let ask = |desc: &toile_suggest_desc| {
        let needed = &mut 0;
        unsafe {
            toile_sim_suggest_region(sim.0, desc, ptr::null_mut(), 0, needed, ptr::null_mut())
        }
    };
    let with = |change: &dyn Fn(&mut toile_suggest_desc)| {
        let mut desc = filled(toile_suggest_desc_init);
        desc.tolerance = 0.1;
        change(&mut desc);
        desc
    };
    ok(ask(&with(&|_| ())));
    fails(ask(&filled(toile_suggest_desc_init)), TOILE_E_ARGUMENT);
    assert!(last_error().contains("tolerance or a budget"));
    for bad in [-1.0, f64::NAN, 1e-9, f64::INFINITY] {
        fails(ask(&with(&|d| d.tolerance = bad)), TOILE_E_ARGUMENT);
    }
    fails(ask(&with(&|d| d.rings = 4)), TOILE_E_ARGUMENT);
    for left_out in [1 << TOILE_CRITERION_COUNT, (1 << TOILE_CRITERION_COUNT) - 1] {
        fails(ask(&with(&|d| d.left_out = left_out)), TOILE_E_ARGUMENT);
    }
    fails(ask(&with(&|d| d.struct_size = 3)), TOILE_E_SIZE);
    // an older host's description ends after the tolerance
    ok(ask(&with(&|d| d.struct_size = 16)));
    let desc = with(&|_| ());
    let mut few = [7.0; 2];
    let status = unsafe {
        toile_sim_suggest_region(
            sim.0,
            &desc,
            few.as_mut_ptr(),
            2,
            ptr::null_mut(),
            ptr::null_mut(),
        )
    };
    fails(status, TOILE_E_SIZE);
    assert_eq!(few, [7.0; 2]);
    // a fabric without yarns
    let plain = Sim::small();
    let status = unsafe {
        toile_sim_suggest_region(plain.0, &desc, ptr::null_mut(), 0, &mut 0, ptr::null_mut())
    };
    fails(status, TOILE_E_ARGUMENT);
    let before = garment.json();
    let count = sim.vertex_count();
    let mut alpha = vec![1.0; count];
    let set = |alpha: &[f64], rings| unsafe {
        toile_garment_set_blend_vertices(garment.0, alpha.as_ptr(), alpha.len(), rings)
    };
    fails(set(&alpha[1..], 0), TOILE_E_ARGUMENT);
    assert!(last_error().contains("values of alpha"), "{}", last_error());
    fails(set(&alpha, 9), TOILE_E_ARGUMENT);
    alpha[5] = f64::NAN;
    fails(set(&alpha, 0), TOILE_E_ARGUMENT);
    assert!(last_error().contains("alpha[5]"), "{}", last_error());
    fails(set(&vec![0.25; count], 0), TOILE_E_ARGUMENT);
    assert_eq!(garment.json(), before);
    // a garment may get its regions before its fabric: whole, it is refused as a simulation of it is
    let bare = square(0.012, 0.0);
    let alpha = vec![1.0; count];
    ok(unsafe { toile_garment_set_blend_vertices(bare.0, alpha.as_ptr(), count, 0) });
    fails(unsafe { toile_garment_check(bare.0) }, TOILE_E_ARGUMENT);
    assert!(last_error().contains("has no yarns"), "{}", last_error());
    let fabric = WEAVE.to_bytes();
    ok(unsafe { toile_garment_set_fabric(bare.0, fabric.as_ptr().cast(), fabric.len()) });
    ok(unsafe { toile_garment_check(bare.0) });
}
