//! What the C interface refuses: numbers, counts and edits that cannot be change nothing.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "the functions under test take the pointers of C; what goes in is in view here"
)]

use crate::capi_support::scene::*;
use std::ptr;
use toile::capi::*;

const BAD: [f64; 3] = [f64::NAN, f64::INFINITY, f64::NEG_INFINITY];

#[test]
fn numbers_that_are_not_finite_are_refused_at_the_door_and_change_nothing() {
    let sim = Sim::small();
    sim.step(0.01);
    let n = sim.vertex_count();
    let before = (sim.save(), sim.epoch());
    let unit = [0.0, 0.0, 0.0, 1.0];
    for bad in BAD {
        let point = [0.0, bad, 0.0];
        let turned = [0.0, 0.0, bad, 1.0];
        let mut many = vec![0.0; 3 * n];
        many[3 * n - 1] = bad;
        let mut contacts = [filled(toile_contact_desc_init); 3];
        contacts[0].friction = bad;
        contacts[1].thickness = bad;
        contacts[2].stiffness = bad;
        let mut drape = filled(toile_drape_desc_init);
        drape.force_tolerance = bad;
        let mut vertex = 0;
        let body = sphere(0.1);
        unsafe {
            let mut refused = vec![
                toile_sim_step(sim.0, bad, ptr::null_mut()),
                toile_sim_drape(sim.0, &drape, ptr::null_mut()),
                toile_sim_set_body_pose(sim.0, 0, point.as_ptr(), unit.as_ptr()),
                toile_sim_set_body_pose(sim.0, 0, unit.as_ptr(), turned.as_ptr()),
                toile_sim_pin(sim.0, [0].as_ptr(), 1, point.as_ptr()),
                toile_sim_set_positions(sim.0, many.as_ptr(), ptr::null(), n),
                toile_sim_set_positions(sim.0, vec![0.0; 3 * n].as_ptr(), many.as_ptr(), n),
                toile_sim_set_number(sim.0, c"gravity.y".as_ptr(), bad),
                toile_sim_set_number(sim.0, c"solver.step.max".as_ptr(), bad),
                toile_sim_set_gravity(sim.0, point.as_ptr()),
                toile_sim_set_wind(sim.0, point.as_ptr()),
                toile_sim_set_blend_region(sim.0, 0, [bad; 6].as_ptr(), 3, 1),
                toile_sim_set_blend_vertices(sim.0, many[2 * n..].as_ptr(), n, 1),
                toile_sim_locate(sim.0, 0, [bad, 0.0].as_ptr(), &mut vertex),
            ];
            for contact in &contacts {
                let status = toile_sim_set_body_sdf(sim.0, body.0, contact, ptr::null_mut());
                refused.push(status);
            }
            for (i, status) in refused.into_iter().enumerate() {
                assert_eq!(status, TOILE_E_ARGUMENT, "call {i} with {bad}");
            }
        }
    }
    // zero and negative where only positive makes sense
    unsafe {
        for dt in [0.0, -0.0, -1.0] {
            fails(toile_sim_step(sim.0, dt, ptr::null_mut()), TOILE_E_ARGUMENT);
        }
        let zero = [0.0; 4];
        let status = toile_sim_set_body_pose(sim.0, 0, zero.as_ptr(), zero.as_ptr());
        fails(status, TOILE_E_ARGUMENT);
        // squares of these would overflow, or be of no use
        let far = [0.0, -1.1e6, 0.0];
        for status in [
            toile_sim_set_gravity(sim.0, far.as_ptr()),
            toile_sim_set_wind(sim.0, far.as_ptr()),
            toile_sim_set_body_pose(sim.0, 0, far.as_ptr(), unit.as_ptr()),
            toile_sim_set_number(sim.0, c"wind.z".as_ptr(), 1.1e6),
            toile_sim_set_number(sim.0, c"pressure".as_ptr(), -1.1e9),
            toile_sim_step(sim.0, 1.1e6, ptr::null_mut()),
        ] {
            fails(status, TOILE_E_ARGUMENT);
        }
    }
    assert_eq!((sim.save(), sim.epoch()), before);
    sim.step(0.01);
}

#[test]
fn bodies_refuse_numbers_that_cannot_be() {
    let mut out = ptr::null_mut();
    let points = [0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0];
    unsafe {
        for bad in BAD.into_iter().chain([-1.0]) {
            fails(toile_body_sphere(bad, &mut out), TOILE_E_ARGUMENT);
            fails(toile_body_capsule(bad, 0.1, &mut out), TOILE_E_ARGUMENT);
            fails(toile_body_capsule(0.1, bad, &mut out), TOILE_E_ARGUMENT);
            let status = toile_body_mesh(points.as_ptr(), 3, [0, 1, 2].as_ptr(), 1, bad, &mut out);
            fails(status, TOILE_E_ARGUMENT);
            let status = toile_body_obj(c"/nowhere.obj".as_ptr(), bad, 0.0, &mut out);
            fails(status, TOILE_E_ARGUMENT);
        }
        for bad in BAD {
            fails(
                toile_body_plane([0.0, bad, 0.0].as_ptr(), 0.0, &mut out),
                TOILE_E_ARGUMENT,
            );
            fails(
                toile_body_plane([0.0, 1.0, 0.0].as_ptr(), bad, &mut out),
                TOILE_E_ARGUMENT,
            );
        }
        fails(
            toile_body_plane(ptr::null(), 0.0, &mut out),
            TOILE_E_ARGUMENT,
        );
        assert_ne!(toile_body_plane([0.0; 3].as_ptr(), 0.0, &mut out), TOILE_OK);
        // an index beyond the vertices, an open mesh, a file that is not there
        let status = toile_body_mesh(points.as_ptr(), 3, [0, 1, 3].as_ptr(), 1, 0.0, &mut out);
        fails(status, TOILE_E_ARGUMENT);
        assert_ne!(
            toile_body_mesh(points.as_ptr(), 3, [0, 1, 2].as_ptr(), 1, 0.0, &mut out),
            TOILE_OK
        );
        fails(
            toile_body_obj(c"/nowhere.obj".as_ptr(), 1.0, 0.0, &mut out),
            TOILE_E_IO,
        );
        // a grid: counts whose product does not fit, counts that contradict the values
        let mut grid = filled(toile_sdf_grid_desc_init);
        grid.cell_size = 0.1;
        grid.values = points.as_ptr();
        grid.value_count = 8;
        for counts in [[u32::MAX; 3], [1 << 14; 3]] {
            grid.counts = counts;
            fails(toile_body_grid(&grid, &mut out), TOILE_E_LIMIT);
        }
        for counts in [[2, 2, 3], [1, 8, 1], [0, 0, 0]] {
            grid.counts = counts;
            fails(toile_body_grid(&grid, &mut out), TOILE_E_ARGUMENT);
        }
        fails(toile_body_sphere(1.0, ptr::null_mut()), TOILE_E_ARGUMENT);
    }
    assert!(out.is_null(), "an error gives no handle");
}

#[test]
fn counts_that_cannot_be_are_refused_before_anything_is_read() {
    let sim = Sim::small();
    let garment = square(0.05, 0.0);
    let one = [0.0_f64; 3];
    let before = (sim.save(), sim.epoch(), garment.json());
    for huge in [usize::MAX, usize::MAX / 8, isize::MAX as usize, 1 << 40] {
        let mut out = ptr::null_mut();
        let mut body = ptr::null_mut();
        unsafe {
            let statuses = [
                toile_sim_pin(sim.0, one.as_ptr().cast(), huge, ptr::null()),
                toile_sim_unpin(sim.0, one.as_ptr().cast(), huge),
                toile_sim_pin_yarn_nodes(sim.0, one.as_ptr().cast(), huge, ptr::null()),
                toile_sim_set_blend_region(sim.0, 0, one.as_ptr(), huge, 1),
                toile_sim_set_positions(sim.0, one.as_ptr(), ptr::null(), huge),
                toile_sim_set_body_vertices(sim.0, 0, one.as_ptr(), huge),
                toile_sim_restore(sim.0, one.as_ptr().cast(), huge),
                toile_garment_set_blend_region(garment.0, 0, one.as_ptr(), huge, 1),
                toile_garment_set_fabric(garment.0, one.as_ptr().cast(), huge),
                toile_garment_from_json(one.as_ptr().cast(), huge, ptr::null(), &mut out),
                toile_body_mesh(one.as_ptr(), huge, one.as_ptr().cast(), 1, 0.0, &mut body),
                toile_body_mesh(one.as_ptr(), 1, one.as_ptr().cast(), huge, 0.0, &mut body),
            ];
            for (i, status) in statuses.into_iter().enumerate() {
                assert!(
                    status == TOILE_E_LIMIT || status == TOILE_E_ARGUMENT,
                    "call {i} with {huge}: {status}"
                );
            }
            let mut panels = [filled(toile_panel_desc_init); 4];
            let corners = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
            for panel in &mut panels {
                panel.vertices = corners.as_ptr();
                panel.vertex_count = 3;
            }
            panels[0].vertex_count = huge;
            panels[1].edges = one.as_ptr().cast();
            panels[1].edge_count = huge;
            panels[2].hole_sizes = one.as_ptr().cast();
            panels[2].hole_count = huge;
            panels[3].edge_count = huge;
            for panel in &panels {
                assert_ne!(
                    toile_garment_add_panel(garment.0, panel, ptr::null_mut()),
                    TOILE_OK
                );
            }
        }
    }
    // NULL with a count
    unsafe {
        let status = toile_sim_pin(sim.0, ptr::null(), 1, ptr::null());
        fails(status, TOILE_E_ARGUMENT);
        fails(toile_sim_restore(sim.0, ptr::null(), 5), TOILE_E_ARGUMENT);
        fails(
            toile_garment_set_fabric(garment.0, ptr::null(), 5),
            TOILE_E_ARGUMENT,
        );
        // a pointer that is not aligned
        let odd = one.as_ptr().cast::<u8>().add(1);
        fails(
            toile_sim_pin(sim.0, odd.cast(), 1, ptr::null()),
            TOILE_E_ARGUMENT,
        );
        fails(
            toile_sim_set_blend_region(sim.0, 0, odd.cast(), 1, 1),
            TOILE_E_ARGUMENT,
        );
    }
    assert_eq!((sim.save(), sim.epoch(), garment.json()), before);
}

#[test]
fn edits_that_fail_leave_the_garment_as_it_was() {
    let garment = tunic();
    let before = garment.json();
    let corners = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let good = level_panel(&corners, 0.0);
    let mut bad = Vec::new();
    macro_rules! with {
        ($($field:ident = $value:expr),*) => {{
            let mut panel = good;
            $(panel.$field = $value;)*
            bad.push(panel);
        }};
    }
    let short_edges = [0_u32, 1, 1, 7];
    let open_edges = [0_u32, 1, 1, 2];
    let kinds = [9_u32, 0, 0];
    let edges = [0_u32, 1, 1, 2, 2, 0];
    let controls = [[f64::NAN; 4]; 3];
    let holes = [3_u32];
    with!(vertex_count = 1);
    with!(edges = short_edges.as_ptr(), edge_count = 2);
    with!(edges = open_edges.as_ptr(), edge_count = 2);
    with!(
        edges = edges.as_ptr(),
        edge_count = 3,
        edge_kinds = kinds.as_ptr()
    );
    with!(
        edges = edges.as_ptr(),
        edge_count = 3,
        edge_kinds = [TOILE_EDGE_CUBIC; 3].as_ptr(),
        edge_controls = controls.as_ptr().cast()
    );
    with!(
        edges = edges.as_ptr(),
        edge_count = 3,
        hole_sizes = holes.as_ptr(),
        hole_count = 1
    );
    with!(position = [f64::NAN, 0.0, 0.0]);
    with!(quaternion_xyzw = [0.0; 4]);
    with!(grain = f64::INFINITY);
    with!(edge_length = -1.0);
    with!(fabric = 5);
    with!(reserved = 1);
    for (i, panel) in bad.iter().enumerate() {
        let mut index = 77;
        let status = unsafe { toile_garment_add_panel(garment.0, panel, &mut index) };
        assert_ne!(status, TOILE_OK, "panel {i}");
        assert_eq!(index, 77);
        assert_eq!(garment.json(), before, "panel {i}");
    }
    let seam = filled(toile_seam_desc_init);
    let mut seams = [seam; 5];
    seams[0].panel_b = 9;
    seams[1].edge_a = 99;
    seams[2].same_direction = 2;
    seams[3].rest_angle = f64::NAN;
    seams[4].reserved = 1;
    for (i, seam) in seams.iter().enumerate() {
        let status = unsafe { toile_garment_add_seam(garment.0, seam, ptr::null_mut()) };
        assert_ne!(status, TOILE_OK, "seam {i}");
    }
    for json in [c"{", c"[]", c"{\"density\": -1}", c"null", c""] {
        let length = json.to_bytes().len();
        let status = unsafe { toile_garment_set_fabric(garment.0, json.as_ptr(), length) };
        assert_ne!(status, TOILE_OK, "{json:?}");
    }
    assert_eq!(garment.json(), before);
}

#[test]
fn limits_are_kept_before_memory_is_taken() {
    let garment = square(1e-5, 0.0); // would be some 10^8 vertices
    let mut out = ptr::null_mut();
    let status = unsafe { toile_sim_create(garment.0, ptr::null(), &mut out) };
    assert!(
        status == TOILE_E_LIMIT || status == TOILE_E_GEOMETRY,
        "{status} {}",
        last_error()
    );
    let garment = square(0.02, 0.0);
    let mut desc = filled(toile_sim_desc_init);
    desc.max_vertices = 20;
    let status = unsafe { toile_sim_create(garment.0, &desc, &mut out) };
    fails(status, TOILE_E_LIMIT);
    for threads in [0, 100_000] {
        let mut desc = filled(toile_sim_desc_init);
        desc.threads = threads;
        let status = unsafe { toile_sim_create(garment.0, &desc, &mut out) };
        fails(status, TOILE_E_ARGUMENT);
    }
    assert!(out.is_null());
}
