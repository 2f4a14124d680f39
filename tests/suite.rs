//! All tests that can share a process, one module for each file.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]
#![allow(
    unreachable_pub,
    reason = "helpers are shared by the modules of this program"
)]

// what several of them use
mod capi_support;
mod common_data;
mod linear_cases;
mod ring_cases;
mod self_contact_cases;
mod sheets;
mod terms_cases;
mod tri_common;
mod wave_cases;
mod yarn_cases;
mod yarn_common;
mod yarn_pull;

#[path = "abi.rs"]
mod abi;
#[path = "blend_algebra.rs"]
mod blend_algebra;
#[path = "blend_hard.rs"]
mod blend_hard;
#[path = "blend_patches.rs"]
mod blend_patches;
#[path = "body_contact_term.rs"]
mod body_contact_term;
#[path = "body_mannequin.rs"]
mod body_mannequin;
#[path = "body_mesh.rs"]
mod body_mesh;
#[path = "body_shapes.rs"]
mod body_shapes;
#[path = "c_examples.rs"]
mod c_examples;
#[path = "capi_array.rs"]
mod capi_array;
#[path = "capi_contract.rs"]
mod capi_contract;
#[path = "capi_random_calls.rs"]
mod capi_random_calls;
#[path = "capi_refusals.rs"]
mod capi_refusals;
#[path = "capi_results.rs"]
mod capi_results;
#[path = "capi_suggest.rs"]
mod capi_suggest;
#[path = "capi_threads.rs"]
mod capi_threads;
#[path = "cli_toile.rs"]
mod cli_toile;
#[path = "docs.rs"]
mod docs;
#[path = "drape_ends.rs"]
mod drape_ends;
#[path = "fabric_cell.rs"]
mod fabric_cell;
#[path = "fabric_fitted.rs"]
mod fabric_fitted;
#[path = "fmi.rs"]
mod fmi;
#[path = "hard_cases.rs"]
mod hard_cases;
#[path = "header.rs"]
mod header;
#[path = "layering.rs"]
mod layering;
#[path = "licences.rs"]
mod licences;
#[path = "linear_solvers.rs"]
mod linear_solvers;
#[path = "live_regions.rs"]
mod live_regions;
#[path = "matrix_free.rs"]
mod matrix_free;
#[path = "mixed_hard.rs"]
mod mixed_hard;
#[path = "mixed_patches.rs"]
mod mixed_patches;
#[path = "mixed_pucker.rs"]
mod mixed_pucker;
#[path = "mixed_riders.rs"]
mod mixed_riders;
#[path = "mixed_scenes.rs"]
mod mixed_scenes;
mod mixed_waves;
#[path = "pattern_bytes.rs"]
mod pattern_bytes;
#[path = "pattern_check.rs"]
mod pattern_check;
#[path = "pattern_examples.rs"]
mod pattern_examples;
#[path = "pattern_garmentcode.rs"]
mod pattern_garmentcode;
#[path = "pattern_materials.rs"]
mod pattern_materials;
#[path = "physics_laws.rs"]
mod physics_laws;
#[path = "python_driver.rs"]
mod python_driver;
#[path = "readout_real_bodies.rs"]
mod readout_real_bodies;
#[path = "real_garments.rs"]
mod real_garments;
#[path = "reference_bending.rs"]
mod reference_bending;
#[path = "reference_membrane.rs"]
mod reference_membrane;
#[path = "report.rs"]
mod report;
#[path = "rest.rs"]
mod rest;
#[path = "scene_motion.rs"]
mod scene_motion;
#[path = "scene_motion_errors.rs"]
mod scene_motion_errors;
#[path = "scene_reader.rs"]
mod scene_reader;
#[path = "self_contact_sheets.rs"]
mod self_contact_sheets;
#[path = "self_contact_term.rs"]
mod self_contact_term;
#[path = "snapshots.rs"]
mod snapshots;
#[path = "suggest.rs"]
mod suggest;
#[path = "terms_fd.rs"]
mod terms_fd;
#[path = "terms_physics.rs"]
mod terms_physics;
#[path = "terms_symmetry.rs"]
mod terms_symmetry;
#[path = "tri_garments.rs"]
mod tri_garments;
#[path = "tri_real.rs"]
mod tri_real;
#[path = "yarn_charts.rs"]
mod yarn_charts;
#[path = "yarn_contacts.rs"]
mod yarn_contacts;
#[path = "yarn_edges.rs"]
mod yarn_edges;
#[path = "yarn_fabrics.rs"]
mod yarn_fabrics;
#[path = "yarn_friction.rs"]
mod yarn_friction;
#[path = "yarn_garments.rs"]
mod yarn_garments;
#[path = "yarn_knit.rs"]
mod yarn_knit;
#[path = "yarn_lace.rs"]
mod yarn_lace;
#[path = "yarn_laws.rs"]
mod yarn_laws;
#[path = "yarn_robust.rs"]
mod yarn_robust;
#[path = "yarn_sims.rs"]
mod yarn_sims;
#[path = "yarn_single.rs"]
mod yarn_single;
#[path = "yarn_stretch.rs"]
mod yarn_stretch;
#[path = "yarn_terms_fd.rs"]
mod yarn_terms_fd;
#[path = "yarn_terms_symmetry.rs"]
mod yarn_terms_symmetry;
#[path = "yarn_topology.rs"]
mod yarn_topology;
#[path = "yarn_weave.rs"]
mod yarn_weave;
#[path = "yarn_worn.rs"]
mod yarn_worn;
