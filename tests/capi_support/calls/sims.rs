//! Calls on simulations.

use super::choices::{Choices, size};
use super::world::{World, filled, state};
use std::ptr;
use toile::capi::*;

pub(super) fn add_sim(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
    let garment = world.garment(choices);
    let mut desc = filled(toile_sim_desc_init);
    desc.gravity[1] = choices.near(-9.81);
    desc.wind[0] = choices.near(0.0);
    desc.pressure = choices.near(0.0);
    desc.threads = if choices.once_in(16) {
        choices.index()
    } else {
        1
    };
    desc.max_vertices = if choices.once_in(16) { 0 } else { 300 };
    // a shorter description would ask for the full default limit
    if choices.once_in(16) {
        desc.struct_size = usize::MAX;
    }
    let mut out = ptr::null_mut();
    let status = unsafe { toile_sim_create(garment, &desc, choices.maybe_mut(&mut out)) };
    if status == TOILE_OK {
        world.sims.push(out);
    }
    status
}

extern "C" fn progress(user: *mut std::ffi::c_void, _: *const toile_progress) -> i32 {
    let left = unsafe { &mut *user.cast::<u32>() };
    *left = left.saturating_sub(1);
    i32::from(*left == 0)
}

pub(super) fn change_sim(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let sim = world.sim(choices);
    let before = state(sim);
    let mut needed = 0;
    let vertices = unsafe {
        match toile_sim_positions(sim, ptr::null_mut(), 0, &mut needed) {
            TOILE_OK => needed / 3,
            _ => 0,
        }
    };
    let mut report = filled(toile_step_report_init);
    report.struct_size = size(choices, report.struct_size);
    let report = choices.maybe_mut(&mut report);
    let body = if choices.once_in(4) {
        choices.index()
    } else {
        0
    };
    let point = choices.numbers(3);
    let mut turn = [0.0, 0.0, choices.near(0.3), 1.0];
    if choices.once_in(8) {
        turn = [0.0; 4];
    }
    let pins: Vec<u32> = (0..3).map(|_| choices.index()).collect();
    let targets = choices.numbers(9);
    let targets = if choices.once_in(2) {
        targets.as_ptr()
    } else {
        ptr::null()
    };
    let uv = choices.numbers(8);
    let status = unsafe {
        match choices.below(17) {
            16 => {
                // every corner in, none, or numbers that cannot be
                let alpha = match choices.below(3) {
                    0 => vec![1.0; vertices],
                    1 => vec![0.0; vertices],
                    _ => choices.numbers(vertices.clamp(1, 300)),
                };
                let (count, rings) = (alpha.len(), choices.index());
                toile_sim_set_blend_vertices(sim, alpha.as_ptr(), count, rings)
            }
            14 => {
                let nodes = choices.maybe(pins.as_ptr());
                toile_sim_pin_yarn_nodes(sim, nodes, choices.count(3), targets)
            }
            15 => {
                let nodes = choices.maybe(pins.as_ptr());
                toile_sim_unpin_yarn_nodes(sim, nodes, choices.count(3))
            }
            0..4 => {
                // days of simulated time would be done, and take days
                let dt = match choices.near(0.01) {
                    dt if dt > 0.1 && dt < 1e7 => 0.1,
                    dt => dt,
                };
                toile_sim_step(sim, dt, report)
            }
            4 => {
                let mut desc = filled(toile_drape_desc_init);
                let mut left = 1 + choices.below(4) as u32;
                desc.struct_size = size(choices, desc.struct_size);
                desc.force_tolerance = choices.near(0.0);
                // a description cut off before the callback would drape to the end
                if desc.struct_size < size_of_val(&desc) {
                    desc.struct_size = 0;
                }
                desc.max_steps = 3;
                desc.progress = Some(progress);
                desc.progress_user = (&raw mut left).cast();
                toile_sim_drape(sim, &desc, report)
            }
            5 => toile_sim_pin(sim, choices.maybe(pins.as_ptr()), choices.count(3), targets),
            6 => toile_sim_unpin(sim, choices.maybe(pins.as_ptr()), choices.count(3)),
            7 => {
                let contact = {
                    let mut desc = filled(toile_contact_desc_init);
                    desc.struct_size = size(choices, desc.struct_size);
                    desc.friction = choices.near(0.3);
                    desc.thickness = choices.near(0.002);
                    desc.stiffness = choices.near(1e7);
                    desc
                };
                let mut out = 0;
                let shape = world.body(choices);
                toile_sim_set_body_sdf(sim, shape, choices.maybe(&contact), &mut out)
            }
            8 => toile_sim_set_body_pose(sim, body, choices.maybe(point.as_ptr()), turn.as_ptr()),
            9 => {
                let points = choices.numbers(12);
                let count = choices.count(4);
                toile_sim_set_body_vertices(sim, body, points.as_ptr(), count)
            }
            10 => {
                let names = [
                    c"gravity.x",
                    c"wind.y",
                    c"pressure",
                    c"solver.newton.max_iterations",
                    c"solver.threads",
                    c"contact.self.enabled",
                    c"nothing",
                ];
                let name = names[choices.below(names.len())];
                let usual = if choices.once_in(2) { 1.0 } else { 10.0 };
                toile_sim_set_number(sim, choices.maybe(name.as_ptr()), choices.near(usual))
            }
            11 => {
                let count = choices.count(4);
                let (panel, rings) = (choices.index(), choices.index());
                toile_sim_set_blend_region(sim, panel, uv.as_ptr(), count, rings)
            }
            12 => {
                // as saved, cut off, or with a byte changed
                let mut bytes = before.clone().map_or(vec![1, 2, 3], |b| b.0);
                let at = choices.below(256) % bytes.len().max(1);
                let count = match choices.below(4) {
                    0 => at,
                    1 => {
                        if let Some(byte) = bytes.get_mut(at) {
                            *byte ^= 1 << choices.below(8);
                        }
                        bytes.len()
                    }
                    2 => usize::MAX,
                    _ => bytes.len(),
                };
                toile_sim_restore(sim, bytes.as_ptr(), count)
            }
            _ => {
                let points = choices.numbers(3 * vertices.clamp(1, 300));
                let count = match choices.once_in(4) {
                    true => usize::MAX,
                    false => vertices.min(300),
                };
                toile_sim_set_positions(sim, points.as_ptr(), ptr::null(), count)
            }
        }
    };
    if status != TOILE_OK {
        // views may have ended: the state is the same, but a step that was taken back may have put
        // it elsewhere, and then the epoch says so
        let after = state(sim);
        assert!(
            after.map(|s| s.0) == before.map(|s| s.0),
            "a call that failed changed the simulation: {status}"
        );
    }
    status
}

pub(super) fn read_sim(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let sim = world.sim(choices);
    let capacity = choices.below(65);
    let mut buffer = [7.25_f64; 64];
    let mut needed = 0;
    let out = choices.maybe_mut(buffer.as_mut_ptr());
    let needed = choices.maybe_mut(&mut needed);
    let (mut index, mut number) = (0, 0.0);
    let body = choices.index();
    let point = choices.numbers(3);
    let status = unsafe {
        match choices.below(32) {
            31 => toile_sim_yarn_curves(sim, choices.index(), out, capacity, needed),
            27 => toile_sim_yarn_curve_offsets(sim, choices.index(), out.cast(), capacity, needed),
            28 => toile_sim_yarn_uv(sim, out, capacity, needed),
            29 => toile_sim_yarn_radii(sim, out, capacity, needed),
            30 => {
                let edge = choices.index();
                toile_sim_yarn_nodes_along(sim, body, edge, out.cast(), capacity, needed)
            }
            24 => toile_sim_vertex_errors(sim, out, capacity, needed),
            26 => toile_sim_vertex_criteria(sim, out, capacity, needed),
            25 => {
                let mut wish = filled(toile_suggest_desc_init);
                wish.struct_size = size(choices, wish.struct_size);
                wish.tolerance = choices.near(0.1);
                wish.budget = u64::from(choices.index());
                wish.rings = choices.index();
                wish.left_out = choices.index();
                let mut found = filled(toile_suggestion_init);
                found.struct_size = size(choices, found.struct_size);
                let (wish, found) = (choices.maybe(&wish), choices.maybe_mut(&mut found));
                toile_sim_suggest_region(sim, wish, out, capacity, needed, found)
            }
            20 => toile_sim_yarn_forces(sim, out, capacity, needed),
            21 => {
                let mut changes = filled(toile_yarn_changes_init);
                changes.struct_size = size(choices, changes.struct_size);
                toile_sim_yarn_changes(sim, choices.maybe_mut(&mut changes))
            }
            22 => toile_sim_yarn_end(sim, body, choices.index(), choices.maybe_mut(&mut index)),
            23 => {
                let uv = choices.maybe(point.as_ptr());
                toile_sim_locate_yarn_node(sim, body, uv, choices.maybe_mut(&mut index))
            }
            0 => toile_sim_positions(sim, out, capacity, needed),
            1 => toile_sim_velocities(sim, out, capacity, needed),
            2 => toile_sim_normals(sim, out, capacity, needed),
            3 => toile_sim_vertex_uv(sim, out, capacity, needed),
            4 => toile_sim_triangles(sim, out.cast(), capacity, needed),
            5 => toile_sim_vertex_active(sim, out.cast(), capacity, needed),
            6 => toile_sim_yarn_offsets(sim, out.cast(), capacity, needed),
            7 => toile_sim_body_positions(sim, body, out, capacity, needed),
            8 => toile_sim_body_triangles(sim, body, out.cast(), capacity, needed),
            9 => {
                let mut view = filled(toile_view_f64_init);
                view.struct_size = size(choices, view.struct_size);
                toile_sim_positions_view(sim, choices.maybe_mut(&mut view))
            }
            16 => toile_sim_yarn_nodes(sim, out, capacity, needed),
            17 => toile_sim_yarn_tensions(sim, out, capacity, needed),
            18 => toile_sim_yarn_slips(sim, out, capacity, needed),
            15 => {
                let mut array = ptr::null_mut();
                let mut view = filled(toile_view_f64_init);
                view.struct_size = size(choices, view.struct_size);
                let made = toile_sim_velocities_array(sim, choices.maybe_mut(&mut array));
                let seen = toile_array_view(array, choices.maybe_mut(&mut view));
                toile_array_free(array);
                if made == TOILE_OK { seen } else { made }
            }
            10 => {
                let mut energies = filled(toile_energies_init);
                energies.struct_size = size(choices, energies.struct_size);
                toile_sim_energies(sim, choices.maybe_mut(&mut energies))
            }
            11 => {
                let uv = choices.maybe(point.as_ptr());
                toile_sim_locate(sim, body, uv, choices.maybe_mut(&mut index))
            }
            12 => toile_sim_number(sim, c"gravity.y".as_ptr(), choices.maybe_mut(&mut number)),
            13 => {
                let (mut force, mut torque) = ([0.0; 3], [0.0; 3]);
                toile_sim_body_wrench(sim, body, force.as_mut_ptr(), torque.as_mut_ptr())
            }
            14 => {
                let mut info = filled(toile_system_info_init);
                info.struct_size = size(choices, info.struct_size);
                toile_sim_info(sim, choices.maybe_mut(&mut info))
            }
            _ => {
                let mut report = filled(toile_step_report_init);
                report.struct_size = size(choices, report.struct_size);
                toile_sim_report(sim, choices.maybe_mut(&mut report))
            }
        }
    };
    assert!(
        buffer[capacity..].iter().all(|&x| x == 7.25),
        "written too far"
    );
    status
}
