//! The conventions of the C interface, called from Rust as a host would call it: handles, errors,
//! struct sizes, arrays, views.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    clippy::float_cmp,
    reason = "the functions under test take the pointers of C; what goes in is in view here"
)]

use crate::capi_support::scene::*;
use std::ffi::{CStr, c_char};
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
    let mut changes = filled(toile_yarn_changes_init);
    let mut wish = filled(toile_suggest_desc_init);
    wish.tolerance = 0.1;
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
        toile_sim_unpin_yarn_nodes(ptr::null(), 0),
        toile_sim_set_blend_region(0, ptr::null(), 0, 0),
        toile_sim_set_blend_vertices(ptr::null(), 0, 0),
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
        toile_sim_yarn_coordinates(ptr::null_mut(), 0, n),
        toile_sim_yarn_tensions(ptr::null_mut(), 0, n),
        toile_sim_yarn_compressions(ptr::null_mut(), 0, n),
        toile_sim_yarn_slips(ptr::null_mut(), 0, n),
        toile_sim_yarn_active(ptr::null_mut(), 0, n),
        toile_sim_yarn_forces(ptr::null_mut(), 0, n),
        toile_sim_yarn_radii(ptr::null_mut(), 0, n),
        toile_sim_yarn_fabrics(ptr::null_mut(), 0, n),
        toile_sim_yarn_panels(ptr::null_mut(), 0, n),
        toile_sim_yarn_uv(ptr::null_mut(), 0, n),
        toile_sim_yarn_curve_offsets(1, ptr::null_mut(), 0, n),
        toile_sim_yarn_curves(1, ptr::null_mut(), 0, n),
        toile_sim_yarn_nodes_along(0, 0, ptr::null_mut(), 0, n),
        toile_sim_yarn_changes(&mut changes),
        toile_sim_suggest_region(&wish, ptr::null_mut(), 0, n, ptr::null_mut()),
        toile_sim_vertex_errors(ptr::null_mut(), 0, n),
        toile_sim_vertex_criteria(ptr::null_mut(), 0, n),
        toile_sim_locate_yarn_node(0, zero.as_ptr(), &mut count),
        toile_sim_yarn_end(0, 0, &mut count),
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
        toile_garment_set_blend_vertices(corners.as_ptr(), 3, 0),
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
    // those that make an array of its own handle: capi_array
    listed.extend(["toile_sim_positions_array", "toile_sim_velocities_array"]);
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
        toile_sim_yarn_coordinates,
        toile_sim_yarn_tensions,
        toile_sim_yarn_compressions,
        toile_sim_yarn_slips,
        toile_sim_yarn_radii,
        toile_sim_yarn_uv,
    ] {
        check(&sim, call, -7e77);
    }
    for call in [
        toile_sim_triangles,
        toile_sim_vertex_panels,
        toile_sim_yarn_offsets,
        toile_sim_yarn_indices,
        toile_sim_yarn_fabrics,
        toile_sim_yarn_panels,
    ] {
        check(&sim, call, 0xdead_beef);
    }
    for call in [
        toile_sim_vertex_active,
        toile_sim_yarn_active,
        toile_sim_save,
    ] {
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
