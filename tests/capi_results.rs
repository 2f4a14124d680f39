//! What the C interface hands out is what was put in or follows from it.
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

#[test]
fn triangles_alone_have_no_yarns_and_nobody_pretends() {
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
        fails(status, TOILE_E_ARGUMENT);
        assert!(last_error().contains("has no yarns"), "{}", last_error());
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
            TOILE_E_ARGUMENT,
        );
        assert!(out.is_null());
        ok(toile_garment_clear_blend_region(garment.0));
        drop(Sim::new(&garment));
    }
}

/// Hosts get the yarns of a panel that a region covers, hold their nodes, and see them slide and pull.
#[test]
fn a_panel_of_yarns_is_read_held_and_moved() {
    let json = br#"{"toile_garment": 1, "name": "swatch", "edge_length": 0.01,
        "panels": [{"name": "p", "fabric": "y",
            "vertices": [[0, 0], [0.02, 0], [0.02, 0.018], [0, 0.018]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
        "fabrics": [{"name": "y", "yarns": {"preset": "jersey"}}]}"#;
    unsafe {
        let mut out = ptr::null_mut();
        ok(toile_garment_from_json(
            json.as_ptr().cast(),
            json.len(),
            ptr::null(),
            &mut out,
        ));
        let garment = Garment(out);
        let uv = [-1.0, -1.0, 1.0, -1.0, 1.0, 1.0, -1.0, 1.0];
        ok(toile_garment_set_blend_region(
            garment.0,
            0,
            uv.as_ptr(),
            4,
            0,
        ));
        let sim = Sim::new(&garment);
        let x = array::<f64>(|o, c, k| toile_sim_yarn_nodes(sim.0, o, c, k));
        let starts = array::<u32>(|o, c, k| toile_sim_yarn_offsets(sim.0, o, c, k));
        let nodes = array::<u32>(|o, c, k| toile_sim_yarn_indices(sim.0, o, c, k));
        let u = array::<f64>(|o, c, k| toile_sim_yarn_coordinates(sim.0, o, c, k));
        let count = x.len() / 3;
        assert!(count > 100, "{count}");
        assert_eq!(*starts.last().unwrap() as usize, nodes.len());
        assert_eq!(u.len(), nodes.len());
        assert!(nodes.iter().all(|n| (*n as usize) < count));
        for y in starts.windows(2) {
            let u = &u[y[0] as usize..y[1] as usize];
            assert!(u.windows(2).all(|w| w[0] < w[1]));
        }
        let active = array::<u8>(|o, c, k| toile_sim_vertex_active(sim.0, o, c, k));
        assert!(active.iter().all(|a| *a == 0));
        let held = [nodes[0], nodes[nodes.len() - 1]];
        let place = |n: u32| [0, 1, 2].map(|k| x[3 * n as usize + k]);
        let mut targets = [place(held[0]), place(held[1])].concat();
        targets[2] += 1e-4;
        ok(toile_sim_pin_yarn_nodes(
            sim.0,
            held.as_ptr(),
            2,
            targets.as_ptr(),
        ));
        let mut report = filled(toile_step_report_init);
        // what begins to slip at the end of a step slides in the next
        ok(toile_sim_step(sim.0, 1e-3, &mut report));
        ok(toile_sim_step(sim.0, 1e-3, &mut report));
        let moved = array::<f64>(|o, c, k| toile_sim_yarn_nodes(sim.0, o, c, k));
        for (k, n) in held.iter().enumerate() {
            let n = 3 * *n as usize;
            assert_eq!(moved[n..n + 3], targets[3 * k..3 * k + 3]);
        }
        let slips = array::<f64>(|o, c, k| toile_sim_yarn_slips(sim.0, o, c, k));
        let tensions = array::<f64>(|o, c, k| toile_sim_yarn_tensions(sim.0, o, c, k));
        let pressed = array::<f64>(|o, c, k| toile_sim_yarn_compressions(sim.0, o, c, k));
        assert_eq!((slips.len(), tensions.len()), (u.len(), u.len()));
        assert_eq!(pressed.len(), count);
        let active = array::<u8>(|o, c, k| toile_sim_yarn_active(sim.0, o, c, k));
        assert_eq!(active, vec![1; count]);
        assert!(slips.iter().any(|s| *s != 0.0));
        assert!(tensions.iter().any(|t| *t > 0.0));
        assert!(pressed.iter().all(|l| *l >= 0.0));
        ok(toile_sim_unpin_yarn_nodes(sim.0, held.as_ptr(), 1));
        fails(
            toile_sim_unpin_yarn_nodes(sim.0, held.as_ptr(), 1),
            TOILE_E_ARGUMENT,
        );
    }
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
fn a_step_tells_how_far_it_is_and_may_be_stopped_as_if_it_had_not_begun() {
    struct Told {
        fractions: Vec<f64>,
        stop_after: usize,
    }
    extern "C" fn watch(user: *mut c_void, progress: *const toile_progress) -> i32 {
        let (told, progress) = unsafe { (&mut *user.cast::<Told>(), &*progress) };
        let stage = unsafe { CStr::from_ptr(progress.stage) };
        assert_eq!(stage, c"step");
        told.fractions.push(progress.fraction);
        i32::from(told.fractions.len() >= told.stop_after)
    }
    let mut told = Told {
        fractions: Vec::new(),
        stop_after: 3,
    };
    let mut desc = filled(toile_sim_desc_init);
    desc.progress = Some(watch);
    desc.progress_user = (&raw mut told).cast();
    let garment = square(0.05, 0.0);
    let mut out = ptr::null_mut();
    ok(unsafe { toile_sim_create(garment.0, &desc, &mut out) });
    let sim = Sim(out);
    // several substeps
    ok(unsafe { toile_sim_set_number(sim.0, c"solver.step.max".as_ptr(), 0.01) });
    let before = sim.save();
    let mut report = filled(toile_step_report_init);
    ok(unsafe { toile_sim_step(sim.0, 0.05, &mut report) });
    assert_eq!(report.outcome, TOILE_OUTCOME_CANCELLED);
    assert_eq!(report.advanced, 0.0);
    assert!(
        sim.save() == before,
        "the stopped step left something behind"
    );
    for (k, fraction) in told.fractions.iter().enumerate() {
        assert!((fraction - 0.2 * k as f64).abs() < 1e-9, "{k}: {fraction}");
    }
    told.fractions.clear();
    told.stop_after = usize::MAX;
    ok(unsafe { toile_sim_step(sim.0, 0.05, &mut report) });
    assert_eq!(report.outcome, TOILE_OUTCOME_CONVERGED);
    assert_eq!(told.fractions.len(), 5);
}
