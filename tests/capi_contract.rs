//! Every convention of the C interface, called from Rust as a host would call it.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "the functions under test take the pointers of C; what goes in is in view here"
)]

use crate::capi_support::scene::*;
use std::ffi::{CStr, c_char, c_void};
use std::ptr;
use toile::capi::*;

const NULL_OUT: *mut usize = ptr::null_mut();

/// Every function that takes a simulation, with arguments that would do.
fn with_sim(sim: *mut toile_sim) -> Vec<(&'static str, toile_status)> {
    let (mut size, mut number, mut count, mut body) = (0, 0.0, 0, 0);
    let mut vector = [0.0; 3];
    let mut view = filled(toile_view_f64_init);
    let mut report = filled(toile_step_report_init);
    let mut energies = filled(toile_energies_init);
    let mut info = filled(toile_system_info_init);
    let sphere = sphere(0.1);
    let garment = &mut ptr::null_mut();
    let zero = [0.0; 12];
    let unit = [0.0, 0.0, 0.0, 1.0];
    macro_rules! all {
        ($($name:ident($($argument:expr),*)),* $(,)?) => {
            vec![$((stringify!($name), unsafe { $name(sim, $($argument),*) })),*]
        };
    }
    let n: *mut usize = &mut size;
    all![
        toile_sim_garment(garment),
        toile_sim_set_body_sdf(sphere.0, ptr::null(), &mut body),
        toile_sim_set_body_pose(0, zero.as_ptr(), unit.as_ptr()),
        toile_sim_set_body_vertices(0, zero.as_ptr(), 4),
        toile_sim_body_wrench(0, vector.as_mut_ptr(), vector.as_mut_ptr()),
        toile_sim_pin([0].as_ptr(), 1, ptr::null()),
        toile_sim_unpin([0].as_ptr(), 1),
        toile_sim_pin_yarn_nodes(ptr::null(), 0, ptr::null()),
        toile_sim_set_blend_region(0, ptr::null(), 0, 0),
        toile_sim_locate(0, zero.as_ptr(), &mut count),
        toile_sim_step(0.01, &mut report),
        toile_sim_drape(ptr::null(), &mut report),
        toile_sim_report(&mut report),
        toile_sim_vertex_count(&mut count),
        toile_sim_triangle_count(&mut count),
        toile_sim_body_count(&mut count),
        toile_sim_positions(ptr::null_mut(), 0, n),
        toile_sim_velocities(ptr::null_mut(), 0, n),
        toile_sim_normals(ptr::null_mut(), 0, n),
        toile_sim_vertex_panels(ptr::null_mut(), 0, n),
        toile_sim_vertex_uv(ptr::null_mut(), 0, n),
        toile_sim_vertex_active(ptr::null_mut(), 0, n),
        toile_sim_triangles(ptr::null_mut(), 0, n),
        toile_sim_positions_view(&mut view),
        toile_sim_velocities_view(&mut view),
        toile_sim_yarn_nodes(ptr::null_mut(), 0, n),
        toile_sim_yarn_offsets(ptr::null_mut(), 0, n),
        toile_sim_yarn_indices(ptr::null_mut(), 0, n),
        toile_sim_body_positions(0, ptr::null_mut(), 0, n),
        toile_sim_body_triangles(0, ptr::null_mut(), 0, n),
        toile_sim_energies(&mut energies),
        toile_sim_info(&mut info),
        toile_sim_backend(ptr::null_mut(), 0, n),
        toile_sim_save(ptr::null_mut(), 0, n),
        toile_sim_restore([0_u8].as_ptr(), 1),
        toile_sim_set_number(c"gravity.x".as_ptr(), 0.0),
        toile_sim_number(c"gravity.x".as_ptr(), &mut number),
        toile_sim_set_gravity(zero.as_ptr()),
        toile_sim_set_wind(zero.as_ptr()),
        toile_sim_set_positions(zero.as_ptr(), ptr::null(), 4),
    ]
}

/// Every function that takes a garment.
fn with_garment(garment: *mut toile_garment) -> Vec<(&'static str, toile_status)> {
    let (mut size, mut index) = (0, 0);
    let n: *mut usize = &mut size;
    let corners = [0.0, 0.0, 1.0, 0.0, 0.0, 1.0];
    let panel = level_panel(&corners, 0.0);
    let seam = filled(toile_seam_desc_init);
    let json = c"{}";
    let mut sim = ptr::null_mut();
    macro_rules! all {
        ($($name:ident($($argument:expr),*)),* $(,)?) => {
            vec![$((stringify!($name), unsafe { $name(garment, $($argument),*) })),*]
        };
    }
    all![
        toile_garment_add_panel(&panel, &mut index),
        toile_garment_add_seam(&seam, &mut index),
        toile_garment_set_fabric(json.as_ptr(), 2),
        toile_garment_add_fabric(json.as_ptr(), 2, &mut index),
        toile_garment_set_panel_fabric(0, 0),
        toile_garment_set_blend_region(0, corners.as_ptr(), 3, 1),
        toile_garment_clear_blend_region(),
        toile_garment_check(),
        toile_garment_panel_count(&mut index),
        toile_garment_seam_count(&mut index),
        toile_garment_panel_index(c"a".as_ptr(), &mut index),
        toile_garment_panel_name(0, ptr::null_mut(), 0, n),
        toile_garment_warnings(ptr::null_mut(), 0, n),
        toile_garment_to_json(ptr::null_mut(), 0, n),
        toile_garment_to_svg(0.0, ptr::null_mut(), 0, n),
        toile_sim_create(ptr::null(), &mut sim),
    ]
}

#[test]
fn lists_of_this_file_are_complete() {
    let mut listed: Vec<&str> = with_sim(ptr::null_mut()).iter().map(|c| c.0).collect();
    listed.extend(with_garment(ptr::null_mut()).iter().map(|c| c.0));
    listed.extend(["toile_sim_epoch", "toile_sim_time", "toile_sim_free"]);
    listed.extend(["toile_garment_free", "toile_garment_create"]);
    listed.extend(["toile_garment_from_json", "toile_sim_from_scene"]);
    for name in crate::capi_support::header_functions() {
        let of_object = name.starts_with("toile_sim_") || name.starts_with("toile_garment_");
        if of_object && !name.ends_with("_init") {
            assert!(listed.contains(&name.as_str()), "{name} is not tested here");
        }
    }
}

#[test]
fn handles_that_are_none_are_refused_by_every_function() {
    let freed = Sim::small().0;
    let garment = square(0.05, 0.0);
    let freed_garment = square(0.05, 0.0).0;
    let body = sphere(0.1);
    let invented = ptr::without_provenance_mut::<toile_sim>(0x7300_0001_0000_ffff);
    for sim in [
        ptr::null_mut(),
        freed,
        garment.0.cast(),
        body.0.cast(),
        invented,
        ptr::without_provenance_mut(usize::MAX),
        (&raw const garment).cast_mut().cast(),
    ] {
        for (name, status) in with_sim(sim) {
            assert_eq!(
                status,
                TOILE_E_HANDLE,
                "{name} with {sim:p}: {}",
                last_error()
            );
        }
        unsafe {
            assert_eq!(toile_sim_epoch(sim), 0);
            assert!(toile_sim_time(sim).is_nan());
            toile_sim_free(sim);
        }
    }
    for wrong in [ptr::null_mut(), freed_garment, body.0.cast(), freed.cast()] {
        for (name, status) in with_garment(wrong) {
            assert_eq!(
                status,
                TOILE_E_HANDLE,
                "{name} with {wrong:p}: {}",
                last_error()
            );
        }
        unsafe { toile_garment_free(wrong) };
    }
    // the living ones are none the worse
    ok(unsafe { toile_garment_check(garment.0) });
    let mut distance = 0.0;
    let origin = [0.0; 3];
    ok(unsafe { toile_body_distance(body.0, origin.as_ptr(), &mut distance, ptr::null_mut()) });
    assert!((distance + 0.1).abs() < 1e-12);
    let wrong = garment.0.cast();
    fails(
        unsafe { toile_body_distance(wrong, origin.as_ptr(), &mut distance, ptr::null_mut()) },
        TOILE_E_HANDLE,
    );
}

#[test]
fn freed_twice_or_null_is_no_harm() {
    let garment = square(0.05, 0.0);
    unsafe {
        toile_garment_free(ptr::null_mut());
        toile_body_free(ptr::null_mut());
        toile_sim_free(ptr::null_mut());
        toile_garment_free(garment.0);
        toile_garment_free(garment.0);
    }
}

#[test]
fn an_error_has_a_text_that_names_place_limit_and_value() {
    let sim = Sim::small();
    let count = sim.vertex_count() as u32;
    fails(
        unsafe { toile_sim_pin(sim.0, [count].as_ptr(), 1, ptr::null()) },
        TOILE_E_ARGUMENT,
    );
    let text = last_error();
    assert!(text.contains(&count.to_string()), "{text}");
    fails(
        unsafe { toile_sim_step(sim.0, -0.5, ptr::null_mut()) },
        TOILE_E_ARGUMENT,
    );
    assert!(last_error().contains("dt = -0.5"), "{}", last_error());
    let other = std::thread::spawn(last_error).join().unwrap();
    assert_eq!(other, "", "the text belongs to the thread");
    for status in [0, -1, -100, 5, i32::MIN] {
        assert!(!toile_status_name(status).is_null());
    }
    let name = unsafe { CStr::from_ptr(toile_status_name(TOILE_E_BUSY)) };
    assert_eq!(name, c"TOILE_E_BUSY");
}

#[test]
fn short_descriptions_mean_defaults_and_short_reports_are_not_overrun() {
    // an old host's sim description: gravity only
    let garment = square(0.05, 0.0);
    #[repr(C)]
    struct Old {
        struct_size: usize,
        gravity: [f64; 3],
    }
    let old = Old {
        struct_size: size_of::<Old>(),
        gravity: [1.0, 2.0, 3.0],
    };
    let mut out = ptr::null_mut();
    ok(unsafe { toile_sim_create(garment.0, (&raw const old).cast(), &mut out) });
    let sim = Sim(out);
    assert_eq!(sim.number("gravity.y"), 2.0);
    assert_eq!(sim.number("wind.x"), 0.0);

    // an old host's report ends after the outcome
    let mut words = [16_usize, 77, 88, 99];
    ok(unsafe { toile_sim_step(sim.0, 0.01, words.as_mut_ptr().cast()) });
    assert_eq!(words[0], 16);
    assert_ne!(words[1], 77);
    assert_eq!(words[2..], [88, 99]);

    // a new host's report goes on after what the library knows
    let mut long = [0_usize; 64];
    long[0] = size_of_val(&long);
    ok(unsafe { toile_sim_step(sim.0, 0.01, long.as_mut_ptr().cast()) });
    assert_eq!(long[0], size_of_val(&long));

    // sizes that cannot be are refused before anything happens
    let before = (sim.save(), sim.epoch());
    for size in [0, 4, 20, 5000, usize::MAX] {
        let mut bad = [size, 0, 0, 0, 0, 0, 0, 0];
        let p = bad.as_mut_ptr();
        unsafe {
            fails(toile_sim_step(sim.0, 0.01, p.cast()), TOILE_E_SIZE);
            fails(
                toile_sim_drape(sim.0, p.cast(), ptr::null_mut()),
                TOILE_E_SIZE,
            );
            fails(toile_sim_drape(sim.0, ptr::null(), p.cast()), TOILE_E_SIZE);
            fails(toile_sim_energies(sim.0, p.cast()), TOILE_E_SIZE);
            fails(toile_sim_positions_view(sim.0, p.cast()), TOILE_E_SIZE);
            fails(
                toile_sim_create(garment.0, p.cast(), &mut out),
                TOILE_E_SIZE,
            );
            fails(
                toile_garment_add_panel(garment.0, p.cast(), ptr::null_mut()),
                TOILE_E_SIZE,
            );
            fails(toile_sim_desc_init(p.cast(), size), TOILE_E_SIZE);
        }
    }
    assert_eq!((sim.save(), sim.epoch()), before);
}

#[test]
fn arrays_are_copied_out_in_two_calls_or_not_at_all() {
    type Call<T> =
        unsafe extern "C" fn(*const toile_sim, *mut T, usize, *mut usize) -> toile_status;
    fn check<T: Copy + Default + PartialEq + std::fmt::Debug>(sim: &Sim, call: Call<T>, mark: T) {
        let mut needed = usize::MAX;
        unsafe {
            ok(call(sim.0, ptr::null_mut(), 0, &mut needed));
            fails(call(sim.0, ptr::null_mut(), 0, NULL_OUT), TOILE_E_ARGUMENT);
        }
        let count = needed;
        let mut buffer = vec![mark; count + 3];
        if count > 0 {
            needed = 0;
            let status = unsafe { call(sim.0, buffer.as_mut_ptr(), count - 1, &mut needed) };
            fails(status, TOILE_E_SIZE);
            assert_eq!(needed, count);
            assert!(buffer.iter().all(|x| *x == mark), "nothing was written");
        }
        ok(unsafe { call(sim.0, buffer.as_mut_ptr(), count + 3, NULL_OUT) });
        assert!(buffer[count..].iter().all(|x| *x == mark), "not too much");
        let again = array(|out, n, needed| unsafe { call(sim.0, out, n, needed) });
        assert_eq!(again, buffer[..count]);
    }
    let sim = Sim::small();
    sim.step(0.01);
    let n = sim.vertex_count();
    assert!(n > 8);
    for call in [
        toile_sim_positions,
        toile_sim_velocities,
        toile_sim_normals,
        toile_sim_vertex_uv,
        toile_sim_yarn_nodes,
    ] {
        check(&sim, call, -7e77);
    }
    for call in [
        toile_sim_triangles,
        toile_sim_vertex_panels,
        toile_sim_yarn_offsets,
        toile_sim_yarn_indices,
    ] {
        check(&sim, call, 0xdead_beef);
    }
    for call in [toile_sim_vertex_active, toile_sim_save] {
        check(&sim, call, 0xcc_u8);
    }
    check(&sim, toile_sim_backend, 0x55 as c_char);

    // shapes
    let active = array(|o, c, k| unsafe { toile_sim_vertex_active(sim.0, o, c, k) });
    assert_eq!(active, vec![1_u8; n]);
    let uv = array::<f64>(|o, c, k| unsafe { toile_sim_vertex_uv(sim.0, o, c, k) });
    assert_eq!(uv.len(), 2 * n);
    let normals = array::<f64>(|o, c, k| unsafe { toile_sim_normals(sim.0, o, c, k) });
    for normal in normals.chunks(3) {
        let length = normal.iter().map(|x| x * x).sum::<f64>().sqrt();
        assert!((length - 1.0).abs() < 1e-9, "{normal:?}");
    }
    let triangles = array::<u32>(|o, c, k| unsafe { toile_sim_triangles(sim.0, o, c, k) });
    assert!(triangles.iter().all(|&v| (v as usize) < n));
    let mut counts = [0; 3];
    unsafe {
        ok(toile_sim_vertex_count(sim.0, &mut counts[0]));
        ok(toile_sim_triangle_count(sim.0, &mut counts[1]));
        ok(toile_sim_body_count(sim.0, &mut counts[2]));
    }
    assert_eq!(counts, [n as u32, triangles.len() as u32 / 3, 1]);
}

#[test]
fn there_are_no_yarns_yet_and_nobody_pretends() {
    let sim = Sim::small();
    unsafe {
        assert!(array::<f64>(|o, c, k| toile_sim_yarn_nodes(sim.0, o, c, k)).is_empty());
        assert!(array::<u32>(|o, c, k| toile_sim_yarn_indices(sim.0, o, c, k)).is_empty());
        assert_eq!(
            array(|o, c, k| toile_sim_yarn_offsets(sim.0, o, c, k)),
            [0_u32]
        );
        ok(toile_sim_pin_yarn_nodes(sim.0, ptr::null(), 0, ptr::null()));
        let status = toile_sim_pin_yarn_nodes(sim.0, [3].as_ptr(), 1, ptr::null());
        fails(status, TOILE_E_ARGUMENT);
        let uv = [-0.05, -0.05, 0.05, -0.05, 0.0, 0.05];
        let before = (sim.save(), sim.epoch());
        let status = toile_sim_set_blend_region(sim.0, 0, uv.as_ptr(), 3, 2);
        fails(status, TOILE_E_UNSUPPORTED);
        fails(
            toile_sim_set_blend_region(sim.0, 9, uv.as_ptr(), 3, 2),
            TOILE_E_ARGUMENT,
        );
        assert_eq!((sim.save(), sim.epoch()), before);
        ok(toile_sim_set_blend_region(sim.0, 0, ptr::null(), 0, 0));

        // a garment keeps its region, and is not simulated as if it had none
        let garment = square(0.05, 0.0);
        ok(toile_garment_set_blend_region(
            garment.0,
            0,
            uv.as_ptr(),
            3,
            2,
        ));
        let mut out = ptr::null_mut();
        fails(
            toile_sim_create(garment.0, ptr::null(), &mut out),
            TOILE_E_UNSUPPORTED,
        );
        assert!(out.is_null());
        ok(toile_garment_clear_blend_region(garment.0));
        drop(Sim::new(&garment));
    }
}

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
fn a_grid_body_has_the_distances_it_was_given() {
    let n = 9_u32;
    let mut values = Vec::new();
    for i in 0..n {
        for j in 0..n {
            for k in 0..n {
                let at = [i, j, k].map(|c| f64::from(c) * 0.05 - 0.2);
                values.push(at.iter().map(|x| x * x).sum::<f64>().sqrt() - 0.1);
            }
        }
    }
    let mut grid = filled(toile_sdf_grid_desc_init);
    grid.counts = [n; 3];
    grid.origin = [-0.2; 3];
    grid.cell_size = 0.05;
    grid.values = values.as_ptr();
    grid.value_count = values.len();
    let mut out = ptr::null_mut();
    ok(unsafe { toile_body_grid(&grid, &mut out) });
    let body = Body(out);
    let (mut distance, mut gradient) = (0.0, [0.0; 3]);
    let node = [0.1, 0.0, 0.15];
    ok(unsafe { toile_body_distance(body.0, node.as_ptr(), &mut distance, gradient.as_mut_ptr()) });
    let exact = (0.1_f64.powi(2) + 0.15_f64.powi(2)).sqrt() - 0.1;
    // the field is smoothed: it passes the nodes within the cube of the cell size
    assert!(
        (distance - exact).abs() < 0.05_f64.powi(3),
        "{distance} {exact}"
    );
    assert!(gradient[0] > 0.0 && gradient[2] > 0.0);
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
fn a_garment_comes_back_from_its_json() {
    let garment = tunic();
    let json = garment.json();
    for length in [json.len(), json.len() + 1] {
        // with and without the final NUL
        let bytes = [json.as_bytes(), &[0]].concat();
        let mut out = ptr::null_mut();
        let p = bytes.as_ptr().cast();
        ok(unsafe { toile_garment_from_json(p, length, ptr::null(), &mut out) });
        assert_eq!(Garment(out).json(), json);
    }
    let mut index = 9;
    unsafe {
        ok(toile_garment_panel_index(
            garment.0,
            c"back".as_ptr(),
            &mut index,
        ));
        assert_eq!(index, 1);
        let status = toile_garment_panel_index(garment.0, c"sleeve".as_ptr(), &mut index);
        fails(status, TOILE_E_ARGUMENT);
        let name = text(|o, c, k| toile_garment_panel_name(garment.0, 0, o, c, k));
        assert_eq!(name, "front");
        let svg = text(|o, c, k| toile_garment_to_svg(garment.0, 0.01, o, c, k));
        assert!(svg.contains("<svg") && svg.contains("</svg>"));
        let status = toile_garment_to_svg(garment.0, f64::NAN, ptr::null_mut(), 0, NULL_OUT);
        fails(status, TOILE_E_ARGUMENT);
    }
    // the garment of a simulation is the one it was made of
    let sim = Sim::new(&garment);
    let mut out = ptr::null_mut();
    ok(unsafe { toile_sim_garment(sim.0, &mut out) });
    assert_eq!(Garment(out).json(), json);
}

#[test]
fn the_epoch_changes_exactly_with_the_calls_that_end_views() {
    let sim = Sim::small();
    let mut view = filled(toile_view_f64_init);
    let mut epoch = sim.epoch();
    assert_ne!(epoch, 0);
    let saved = sim.save();
    let n = sim.vertex_count();
    let x = sim.positions();
    let body = sphere(0.05);
    let unit = [0.0, 0.0, 0.0, 1.0];
    let origin = [0.0; 3];
    let changes: [(&str, &dyn Fn() -> toile_status); 9] = unsafe {
        [
            ("step", &|| toile_sim_step(sim.0, 0.01, ptr::null_mut())),
            ("pin", &|| {
                toile_sim_pin(sim.0, [0].as_ptr(), 1, ptr::null())
            }),
            ("unpin", &|| toile_sim_unpin(sim.0, [0].as_ptr(), 1)),
            ("pose", &|| {
                toile_sim_set_body_pose(sim.0, 0, origin.as_ptr(), unit.as_ptr())
            }),
            ("number", &|| {
                toile_sim_set_number(sim.0, c"gravity.x".as_ptr(), 0.0)
            }),
            ("wind", &|| toile_sim_set_wind(sim.0, origin.as_ptr())),
            ("restore", &|| {
                toile_sim_restore(sim.0, saved.as_ptr(), saved.len())
            }),
            ("positions", &|| {
                toile_sim_set_positions(sim.0, x.as_ptr(), ptr::null(), n)
            }),
            ("body", &|| {
                toile_sim_set_body_sdf(sim.0, body.0, ptr::null(), ptr::null_mut())
            }),
        ]
    };
    for (name, change) in changes {
        ok(unsafe { toile_sim_positions_view(sim.0, &mut view) });
        assert_eq!(view.epoch, epoch);
        assert_eq!(
            (view.count, view.components, view.stride),
            (n as u64, 3, 24)
        );
        let seen = unsafe { std::slice::from_raw_parts(view.data, 3 * n) };
        assert_eq!(seen, sim.positions(), "a view and a copy are the same");
        assert_eq!(sim.epoch(), epoch, "reading changes no epoch");
        ok(change());
        assert_ne!(sim.epoch(), epoch, "{name} ends views");
        epoch = sim.epoch();
    }
}

#[test]
fn a_view_of_the_object_itself_may_be_given_as_input() {
    let sim = Sim::small();
    sim.step(0.01);
    let before = sim.positions();
    let mut view = filled(toile_view_f64_init);
    ok(unsafe { toile_sim_positions_view(sim.0, &mut view) });
    let n = sim.vertex_count();
    ok(unsafe { toile_sim_set_positions(sim.0, view.data, ptr::null(), n) });
    assert_eq!(sim.positions(), before);
}

#[test]
fn a_saved_state_goes_on_as_the_first_time_and_damaged_bytes_change_nothing() {
    let sim = Sim::small();
    for _ in 0..5 {
        sim.step(0.02);
    }
    let saved = sim.save();
    for _ in 0..5 {
        sim.step(0.02);
    }
    let end = sim.save();
    let other = Sim::small();
    ok(unsafe { toile_sim_restore(other.0, saved.as_ptr(), saved.len()) });
    assert_eq!(other.save(), saved);
    for _ in 0..5 {
        other.step(0.02);
    }
    assert_eq!(other.save(), end);
    assert_eq!(unsafe { toile_sim_time(other.0) }, unsafe {
        toile_sim_time(sim.0)
    });

    let before = (sim.save(), sim.epoch());
    for cut in [0, 1, 7, saved.len() / 2, saved.len() - 1] {
        let status = unsafe { toile_sim_restore(sim.0, saved.as_ptr(), cut) };
        assert_ne!(status, TOILE_OK, "{cut} bytes");
        assert_eq!((sim.save(), sim.epoch()), before);
    }
    // a state of another garment, and one with other bodies
    let coarse = Sim::new(&square(0.1, 0.0));
    let foreign = coarse.save();
    let status = unsafe { toile_sim_restore(sim.0, foreign.as_ptr(), foreign.len()) };
    assert_ne!(status, TOILE_OK);
    assert_eq!((sim.save(), sim.epoch()), before);
}

#[test]
fn pins_hold_and_reach_their_targets_at_the_end_of_the_step() {
    let sim = Sim::small();
    let mut vertex = TOILE_NONE;
    ok(unsafe { toile_sim_locate(sim.0, 0, [-0.1, -0.1].as_ptr(), &mut vertex) });
    let start = sim.positions();
    let at = 3 * vertex as usize;
    let target = [start[at] - 0.002, start[at + 1] + 0.003, start[at + 2]];
    ok(unsafe { toile_sim_pin(sim.0, &vertex, 1, target.as_ptr()) });
    let report = sim.step(0.02);
    assert_eq!(sim.positions()[at..at + 3], target);
    assert!((report.advanced - 0.02).abs() < 1e-15);
    assert!(report.substeps >= 1 && report.newton_iterations >= 1);
    assert!(report.kinetic_energy > 0.0 && report.potential_energy.is_finite());
    ok(unsafe { toile_sim_unpin(sim.0, &vertex, 1) });
    fails(
        unsafe { toile_sim_unpin(sim.0, &vertex, 1) },
        TOILE_E_ARGUMENT,
    );
    sim.step(0.02);
    assert_ne!(sim.positions()[at..at + 3], target);
}

#[test]
fn energies_add_up_to_the_report() {
    let sim = Sim::small();
    for _ in 0..10 {
        sim.step(0.01);
    }
    let mut report = filled(toile_step_report_init);
    let mut e = filled(toile_energies_init);
    unsafe {
        ok(toile_sim_report(sim.0, &mut report));
        ok(toile_sim_energies(sim.0, &mut e));
    }
    assert_eq!(report.substeps, 0);
    assert!((e.kinetic - report.kinetic_energy).abs() <= 1e-12 * e.kinetic.abs().max(1.0));
    let potential = e.gravity + e.membrane + e.bending + e.seam + e.contact;
    assert!(
        (potential - report.potential_energy).abs() <= 1e-9 * potential.abs().max(1e-6),
        "{potential} {}",
        report.potential_energy
    );
    assert_eq!(e.yarn, 0.0);
    let mut info = filled(toile_system_info_init);
    ok(unsafe { toile_sim_info(sim.0, &mut info) });
    assert_eq!(info.vertices as usize, sim.vertex_count());
    assert_eq!(info.unknowns, 3 * info.vertices);
    assert!(info.bytes > 0 && info.min_angle > 0.1 && info.yarn_nodes == 0);
}

struct Heard {
    sim: *mut toile_sim,
    thread: std::thread::ThreadId,
    calls: u32,
    stop_after: u32,
    last: f64,
    busy: bool,
}

extern "C" fn hear(user: *mut c_void, progress: *const toile_progress) -> i32 {
    let (heard, progress) = unsafe { (&mut *user.cast::<Heard>(), &*progress) };
    heard.calls += 1;
    let name = unsafe { CStr::from_ptr(progress.stage) };
    let right = std::thread::current().id() == heard.thread
        && progress.fraction >= heard.last
        && (0.0..=1.0).contains(&progress.fraction)
        && !name.is_empty()
        && progress.struct_size == size_of::<toile_progress>();
    heard.last = progress.fraction;
    unsafe {
        let mut needed = 0;
        heard.busy &= right
            && toile_sim_positions(heard.sim, ptr::null_mut(), 0, &mut needed) == TOILE_E_BUSY
            && toile_sim_step(heard.sim, 0.01, ptr::null_mut()) == TOILE_E_BUSY;
    }
    i32::from(heard.calls >= heard.stop_after)
}

fn drape(sim: &Sim, stop_after: u32) -> (Heard, toile_step_report) {
    let mut heard = Heard {
        sim: sim.0,
        thread: std::thread::current().id(),
        calls: 0,
        stop_after,
        last: 0.0,
        busy: true,
    };
    let mut desc = filled(toile_drape_desc_init);
    desc.progress = Some(hear);
    desc.progress_user = (&raw mut heard).cast();
    let mut report = filled(toile_step_report_init);
    ok(unsafe { toile_sim_drape(sim.0, &desc, &mut report) });
    (heard, report)
}

#[test]
fn progress_comes_on_the_calling_thread_and_may_stop_a_drape() {
    let sim = Sim::small();
    let (heard, report) = drape(&sim, 1);
    assert_eq!(heard.calls, 1);
    assert!(heard.busy, "order, thread, or calls from inside are wrong");
    assert_eq!(report.outcome, TOILE_OUTCOME_CANCELLED);
    let (heard, report) = drape(&sim, u32::MAX);
    assert!(heard.busy && heard.calls > 1);
    assert_ne!(report.outcome, TOILE_OUTCOME_CANCELLED);
    assert!(report.min_gap > -1e-3, "{}", report.min_gap);
}

extern "C" fn log(user: *mut c_void, level: u32, message: *const c_char) {
    let (lines, text) = unsafe {
        let lines = &*user.cast::<std::sync::Mutex<Vec<(u32, String)>>>();
        (lines, CStr::from_ptr(message))
    };
    let line = (level, text.to_str().expect("UTF-8").to_owned());
    lines.lock().unwrap().push(line);
}

#[test]
fn the_log_goes_to_the_callback_of_the_description_and_nowhere_else() {
    let lines = std::sync::Mutex::new(Vec::<(u32, String)>::new());
    let mut desc = filled(toile_sim_desc_init);
    desc.log = Some(log);
    desc.log_user = (&raw const lines).cast_mut().cast();
    let garment = square(0.05, 0.0);
    let mut out = ptr::null_mut();
    ok(unsafe { toile_sim_create(garment.0, &desc, &mut out) });
    let sim = Sim(out);
    let vertices = sim.vertex_count();
    let status = unsafe { toile_sim_unpin(sim.0, [0].as_ptr(), 1) };
    fails(status, TOILE_E_ARGUMENT);
    let lines = lines.lock().unwrap();
    assert_eq!(lines[0].0, TOILE_LOG_INFO);
    assert!(
        lines[0].1.contains(&format!("{vertices} vertices")),
        "{lines:?}"
    );
    assert_eq!(lines[1], (TOILE_LOG_ERROR, last_error()));
}

#[test]
fn world_numbers_go_in_and_come_out() {
    let sim = Sim::small();
    let gravity = [0.5, -1.0, 2.0];
    unsafe {
        ok(toile_sim_set_gravity(sim.0, gravity.as_ptr()));
        ok(toile_sim_set_wind(sim.0, [3.0, 0.0, -1.0].as_ptr()));
        ok(toile_sim_set_number(sim.0, c"pressure".as_ptr(), 4.0));
        ok(toile_sim_set_number(
            sim.0,
            c"solver.newton.max_iterations".as_ptr(),
            40.0,
        ));
        let status = toile_sim_set_number(sim.0, c"no.such".as_ptr(), 4.0);
        fails(status, TOILE_E_ARGUMENT);
        assert!(last_error().contains("no.such"));
        let status = toile_sim_set_number(sim.0, c"solver.newton.max_iterations".as_ptr(), -4.0);
        fails(status, TOILE_E_ARGUMENT);
    }
    let read = [
        "gravity.x",
        "gravity.y",
        "gravity.z",
        "wind.x",
        "wind.z",
        "pressure",
    ];
    assert_eq!(
        read.map(|n| sim.number(n)),
        [0.5, -1.0, 2.0, 3.0, -1.0, 4.0]
    );
    assert_eq!(sim.number("solver.newton.max_iterations"), 40.0);
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
