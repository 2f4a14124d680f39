//! Sequences of calls of the C interface made from bytes: what the random tests and the fuzz
//! targets run. Handles are living, freed, foreign, NULL or invented; numbers are ordinary, huge,
//! tiny, NaN or infinite; counts are right, short or absurd; pointers are NULL now and then.
//!
//! After each call: the status is one of the header's, an error has a text and leaves simulations
//! and garments as they were, bit by bit.

use std::ffi::{CStr, CString, c_char};
use std::ptr;
use toile::capi::*;

/// Bytes that are read as choices; when they end, everything is 0.
#[derive(Debug)]
pub struct Choices<'a> {
    bytes: &'a [u8],
}

impl<'a> Choices<'a> {
    pub fn new(bytes: &'a [u8]) -> Self {
        Self { bytes }
    }

    fn byte(&mut self) -> u8 {
        match self.bytes.split_first() {
            Some((first, rest)) => {
                self.bytes = rest;
                *first
            }
            None => 0,
        }
    }

    /// A number below `count`.
    fn below(&mut self, count: usize) -> usize {
        usize::from(self.byte()) % count.max(1)
    }

    /// True once in `n` times.
    fn once_in(&mut self, n: usize) -> bool {
        self.below(n) == n - 1
    }

    fn number(&mut self) -> f64 {
        let ordinary = (f64::from(self.byte()) - 128.0) / 256.0;
        match self.below(24) {
            0 => f64::NAN,
            1 => f64::INFINITY,
            2 => f64::NEG_INFINITY,
            3 => 1e300,
            4 => -1e300,
            5 => 1e-300,
            6 => 0.0,
            7 => -0.0,
            8 => ordinary * 1e6,
            _ => ordinary,
        }
    }

    /// A number that a call of this kind would take, mostly.
    fn near(&mut self, usual: f64) -> f64 {
        if self.once_in(6) {
            self.number()
        } else {
            usual
        }
    }

    fn index(&mut self) -> u32 {
        match self.below(8) {
            0 => u32::MAX,
            1 => 1 << 31,
            2 => 1000,
            _ => self.below(6) as u32,
        }
    }

    /// A count that is `right`, less, or more than there can be; never a little more, which would
    /// be the caller's fault.
    fn count(&mut self, right: usize) -> usize {
        match self.below(10) {
            0 => usize::MAX,
            1 => 1 << 40,
            2 => isize::MAX as usize,
            3 => self.below(right + 1),
            4 => 0,
            _ => right,
        }
    }

    fn numbers(&mut self, count: usize) -> Vec<f64> {
        let wild = self.once_in(4);
        (0..count)
            .map(|_| {
                if wild {
                    self.number()
                } else {
                    (f64::from(self.byte()) - 128.0) / 512.0
                }
            })
            .collect()
    }

    /// The pointer, or NULL now and then.
    fn maybe<T>(&mut self, pointer: *const T) -> *const T {
        if self.once_in(16) {
            ptr::null()
        } else {
            pointer
        }
    }

    fn maybe_mut<T>(&mut self, pointer: *mut T) -> *mut T {
        if self.once_in(16) {
            ptr::null_mut()
        } else {
            pointer
        }
    }
}

/// Handles made so far, the freed ones too.
#[derive(Debug, Default)]
struct World {
    garments: Vec<*mut toile_garment>,
    bodies: Vec<*mut toile_body>,
    sims: Vec<*mut toile_sim>,
}

impl Drop for World {
    fn drop(&mut self) {
        unsafe {
            self.garments.iter().for_each(|&h| toile_garment_free(h));
            self.bodies.iter().for_each(|&h| toile_body_free(h));
            self.sims.iter().for_each(|&h| toile_sim_free(h));
        }
    }
}

fn pick<T>(choices: &mut Choices<'_>, own: &[*mut T], other: Option<usize>) -> *mut T {
    match choices.below(20) {
        0 => ptr::null_mut(),
        1 => ptr::without_provenance_mut(other.unwrap_or(1)),
        2 => ptr::without_provenance_mut(usize::from(choices.byte()) << 56 | 1),
        _ if own.is_empty() => ptr::null_mut(),
        // mostly the newest
        3..8 => own[choices.below(own.len())],
        _ => own[own.len() - 1],
    }
}

impl World {
    fn garment(&self, choices: &mut Choices<'_>) -> *mut toile_garment {
        pick(choices, &self.garments, self.sims.first().map(|h| h.addr()))
    }

    fn body(&self, choices: &mut Choices<'_>) -> *mut toile_body {
        pick(
            choices,
            &self.bodies,
            self.garments.first().map(|h| h.addr()),
        )
    }

    fn sim(&self, choices: &mut Choices<'_>) -> *mut toile_sim {
        pick(choices, &self.sims, self.bodies.first().map(|h| h.addr()))
    }
}

/// The status is one of the header's and an error has a text.
fn sane(status: toile_status) {
    let name = unsafe { CStr::from_ptr(toile_status_name(status)) };
    assert_ne!(name, c"unknown status", "{status}");
    let text = unsafe { CStr::from_ptr(toile_last_error()) };
    let text = text.to_str().expect("UTF-8");
    assert_ne!(status, TOILE_E_PANIC, "{text}");
    assert!(
        status == TOILE_OK || !text.is_empty(),
        "{status} has no text"
    );
}

fn state(sim: *const toile_sim) -> Option<(Vec<u8>, u64)> {
    let mut needed = 0;
    unsafe {
        if toile_sim_save(sim, ptr::null_mut(), 0, &mut needed) != TOILE_OK {
            return None;
        }
        let mut bytes = vec![0; needed];
        sane(toile_sim_save(sim, bytes.as_mut_ptr(), needed, &mut needed));
        Some((bytes, toile_sim_epoch(sim)))
    }
}

fn json(garment: *const toile_garment) -> Option<Vec<u8>> {
    let mut needed = 0;
    unsafe {
        if toile_garment_to_json(garment, ptr::null_mut(), 0, &mut needed) != TOILE_OK {
            return None;
        }
        let mut bytes = vec![0_u8; needed];
        let out = bytes.as_mut_ptr().cast();
        sane(toile_garment_to_json(garment, out, needed, &mut needed));
        Some(bytes)
    }
}

fn filled<T>(init: unsafe extern "C" fn(*mut T, usize) -> toile_status) -> T {
    let mut value = std::mem::MaybeUninit::uninit();
    unsafe {
        assert_eq!(init(value.as_mut_ptr(), size_of::<T>()), TOILE_OK);
        value.assume_init()
    }
}

/// A struct's size: right, shorter, or one that cannot be.
fn size(choices: &mut Choices<'_>, right: usize) -> usize {
    match choices.below(16) {
        0 => 0,
        1 => usize::MAX,
        2 => 8 + choices.below(right - 8),
        3 => 8 * (1 + choices.below(right / 8)),
        _ => right,
    }
}

fn add_garment(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
    let mut desc = filled(toile_garment_desc_init);
    desc.struct_size = size(choices, desc.struct_size);
    desc.edge_length = choices.near(0.1);
    let mut out = ptr::null_mut();
    let target = choices.maybe_mut(&mut out);
    let status = unsafe { toile_garment_create(choices.maybe(&desc), target) };
    if status == TOILE_OK {
        world.garments.push(out);
    }
    status
}

fn add_panel(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let garment = world.garment(choices);
    let mut corners = vec![-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1];
    if choices.once_in(3) {
        corners = choices.numbers(8);
    }
    let mut edges: Vec<u32> = vec![0, 1, 1, 2, 2, 3, 3, 0];
    if choices.once_in(4) {
        edges = (0..8).map(|_| choices.index()).collect();
    }
    let kinds: Vec<u32> = (0..4).map(|_| choices.index()).collect();
    let controls = choices.numbers(16);
    let holes: Vec<u32> = (0..2).map(|_| choices.index()).collect();
    let mut panel = filled(toile_panel_desc_init);
    panel.struct_size = size(choices, panel.struct_size);
    panel.vertices = choices.maybe(corners.as_ptr());
    panel.vertex_count = choices.count(4);
    panel.position = [choices.near(0.0), choices.near(0.1), choices.near(0.0)];
    panel.quaternion_xyzw[0] = choices.near(0.1);
    panel.grain = choices.near(0.0);
    panel.edge_length = choices.near(0.0);
    panel.fabric = if choices.once_in(8) {
        choices.index()
    } else {
        0
    };
    if choices.once_in(2) {
        panel.edges = choices.maybe(edges.as_ptr());
        panel.edge_count = choices.count(4);
        // arrays that have one entry for each edge are as long as the edges say, or absurd
        if panel.edge_count <= 4 || panel.edge_count > 1 << 30 {
            panel.edge_kinds = if choices.once_in(2) {
                kinds.as_ptr()
            } else {
                ptr::null()
            };
            panel.edge_controls = if choices.once_in(2) {
                controls.as_ptr()
            } else {
                ptr::null()
            };
        }
        if choices.once_in(4) {
            panel.hole_sizes = choices.maybe(holes.as_ptr());
            panel.hole_count = choices.count(2);
        }
    }
    let mut index = 0;
    unsafe {
        toile_garment_add_panel(
            garment,
            choices.maybe(&panel),
            choices.maybe_mut(&mut index),
        )
    }
}

fn edit_garment(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let garment = world.garment(choices);
    let before = json(garment);
    let uv = choices.numbers(8);
    let mut index = 0;
    let fabric: [&CStr; 4] = [c"{\"density\":0.3}", c"{", c"{\"density\":-1}", c"[1,2]"];
    let fabric = fabric[choices.below(4)];
    let length = fabric.to_bytes().len();
    let status = unsafe {
        match choices.below(7) {
            0 => {
                let mut seam = filled(toile_seam_desc_init);
                seam.panel_a = choices.index();
                seam.edge_a = choices.index();
                seam.panel_b = choices.index();
                seam.edge_b = choices.index();
                seam.rest_angle = choices.near(0.0);
                seam.struct_size = size(choices, seam.struct_size);
                toile_garment_add_seam(garment, choices.maybe(&seam), &mut index)
            }
            1 => toile_garment_set_fabric(garment, choices.maybe(fabric.as_ptr()), length),
            2 => toile_garment_add_fabric(garment, fabric.as_ptr(), length, &mut index),
            3 => toile_garment_set_panel_fabric(garment, choices.index(), choices.index()),
            4 => {
                let count = choices.count(4);
                let (panel, rings) = (choices.index(), choices.index());
                toile_garment_set_blend_region(garment, panel, uv.as_ptr(), count, rings)
            }
            5 => toile_garment_clear_blend_region(garment),
            _ => toile_garment_check(garment),
        }
    };
    if status != TOILE_OK {
        assert_eq!(
            json(garment),
            before,
            "an edit that failed changed the garment"
        );
    }
    status
}

fn read_garment(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let garment = world.garment(choices);
    let mut buffer: Vec<c_char> = vec![0x55; 64];
    let capacity = choices.below(65);
    let mut needed = 0;
    let out = choices.maybe_mut(buffer.as_mut_ptr());
    let needed = choices.maybe_mut(&mut needed);
    let mut index = 0;
    let status = unsafe {
        match choices.below(6) {
            0 => toile_garment_to_json(garment, out, capacity, needed),
            1 => toile_garment_to_svg(garment, choices.near(0.01), out, capacity, needed),
            2 => toile_garment_panel_name(garment, choices.index(), out, capacity, needed),
            3 => toile_garment_warnings(garment, out, capacity, needed),
            4 => toile_garment_panel_count(garment, choices.maybe_mut(&mut index)),
            _ => toile_garment_panel_index(garment, c"panel_0".as_ptr(), &mut index),
        }
    };
    if status != TOILE_OK {
        assert!(
            buffer.iter().all(|&b| b == 0x55),
            "written in spite of an error"
        );
    }
    assert!(
        buffer[capacity..].iter().all(|&b| b == 0x55),
        "written too far"
    );
    status
}

fn add_body(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
    let mut out = ptr::null_mut();
    let numbers = choices.numbers(12);
    let tetrahedron = [
        0.05, 0.05, 0.05, -0.05, -0.05, 0.05, -0.05, 0.05, -0.05, 0.05, -0.05, -0.05,
    ];
    let triangles: [u32; 12] = [0, 2, 1, 0, 3, 2, 0, 1, 3, 1, 2, 3];
    let status = unsafe {
        match choices.below(6) {
            0 => toile_body_sphere(choices.near(0.05), choices.maybe_mut(&mut out)),
            1 => toile_body_capsule(choices.near(0.05), choices.near(0.03), &mut out),
            2 => toile_body_plane(choices.maybe(numbers.as_ptr()), choices.near(0.0), &mut out),
            3 => {
                let mut grid = filled(toile_sdf_grid_desc_init);
                grid.struct_size = size(choices, grid.struct_size);
                grid.counts = [
                    2,
                    2,
                    if choices.once_in(4) {
                        choices.index()
                    } else {
                        3
                    },
                ];
                grid.cell_size = choices.near(0.1);
                grid.origin = [choices.near(-0.1), -0.1, -0.1];
                grid.values = choices.maybe(numbers.as_ptr());
                grid.value_count = choices.count(12);
                toile_body_grid(choices.maybe(&grid), &mut out)
            }
            4 => toile_body_obj(
                c"/nowhere/body.obj".as_ptr(),
                choices.near(1.0),
                0.0,
                &mut out,
            ),
            _ => {
                let points = if choices.once_in(3) {
                    &numbers[..]
                } else {
                    &tetrahedron
                };
                let (points, vertex_count) = (choices.maybe(points.as_ptr()), choices.count(4));
                let (triangles, triangle_count) =
                    (choices.maybe(triangles.as_ptr()), choices.count(4));
                toile_body_mesh(
                    points,
                    vertex_count,
                    triangles,
                    triangle_count,
                    0.05,
                    &mut out,
                )
            }
        }
    };
    if status == TOILE_OK {
        world.bodies.push(out);
    }
    status
}

fn add_sim(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
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

fn change_sim(world: &World, choices: &mut Choices<'_>) -> toile_status {
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
        match choices.below(14) {
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

fn read_sim(world: &World, choices: &mut Choices<'_>) -> toile_status {
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
        match choices.below(16) {
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

fn free(world: &World, choices: &mut Choices<'_>) -> toile_status {
    // the handle stays in the list: later calls meet it freed
    unsafe {
        match choices.below(3) {
            0 => toile_garment_free(world.garment(choices)),
            1 => toile_body_free(world.body(choices)),
            _ => toile_sim_free(world.sim(choices)),
        }
    }
    TOILE_OK
}

/// How many calls of a sequence succeeded and failed.
#[derive(Clone, Copy, Debug, Default)]
pub struct Tally {
    pub done: usize,
    pub refused: usize,
    /// Steps and other changes of simulations that succeeded.
    pub changes: usize,
}

/// Runs one sequence of calls.
pub fn run(bytes: &[u8]) -> Tally {
    let choices = &mut Choices::new(bytes);
    let mut world = World::default();
    let mut tally = Tally::default();
    // most sequences get as far as a simulation
    if choices.below(4) != 0 {
        start(&mut world);
    }
    for _ in 0..40 {
        if choices.bytes.is_empty() {
            break;
        }
        let kind = choices.below(16);
        let status = match kind {
            0 => add_garment(&mut world, choices),
            1 => add_panel(&world, choices),
            2 => edit_garment(&world, choices),
            3 => read_garment(&world, choices),
            4 => add_body(&mut world, choices),
            5 => add_sim(&mut world, choices),
            6..12 => change_sim(&world, choices),
            12..15 => read_sim(&world, choices),
            _ => free(&world, choices),
        };
        sane(status);
        match status {
            TOILE_OK => tally.done += 1,
            _ => tally.refused += 1,
        }
        tally.changes += usize::from(status == TOILE_OK && (6..12).contains(&kind));
    }
    tally
}

/// A square over a small sphere.
fn start(world: &mut World) {
    let corners = [-0.1, -0.1, 0.1, -0.1, 0.1, 0.1, -0.1, 0.1];
    let mut garment = ptr::null_mut();
    let mut desc = filled(toile_garment_desc_init);
    desc.edge_length = 0.1;
    let mut panel = filled(toile_panel_desc_init);
    panel.vertices = corners.as_ptr();
    panel.vertex_count = 4;
    panel.position[1] = 0.06;
    panel.quaternion_xyzw = [-(0.5_f64.sqrt()), 0.0, 0.0, 0.5_f64.sqrt()];
    let (mut body, mut sim) = (ptr::null_mut(), ptr::null_mut());
    unsafe {
        assert_eq!(toile_garment_create(&desc, &mut garment), TOILE_OK);
        world.garments.push(garment);
        assert_eq!(
            toile_garment_add_panel(garment, &panel, ptr::null_mut()),
            TOILE_OK
        );
        assert_eq!(toile_body_sphere(0.05, &mut body), TOILE_OK);
        world.bodies.push(body);
        let status = toile_sim_create(garment, ptr::null(), &mut sim);
        assert_eq!(status, TOILE_OK);
        world.sims.push(sim);
        let status = toile_sim_set_body_sdf(sim, body, ptr::null(), ptr::null_mut());
        assert_eq!(status, TOILE_OK);
    }
}

/// Reads bytes as a garment; what can be read is made and stepped once.
pub fn read_text(bytes: &[u8]) -> toile_status {
    let text = bytes.as_ptr().cast();
    let (mut garment, mut sim) = (ptr::null_mut(), ptr::null_mut());
    unsafe {
        let folder = CString::new("/nowhere").expect("no NUL");
        let status = toile_garment_from_json(text, bytes.len(), folder.as_ptr(), &mut garment);
        sane(status);
        assert_eq!(status == TOILE_OK, !garment.is_null());
        if status == TOILE_OK {
            let mut desc = filled(toile_sim_desc_init);
            desc.max_vertices = 500;
            sane(toile_sim_create(garment, &desc, &mut sim));
            toile_garment_free(garment);
            if !sim.is_null() {
                let before = state(sim);
                let stepped = toile_sim_step(sim, 1e-4, ptr::null_mut());
                sane(stepped);
                assert!(stepped == TOILE_OK || state(sim).map(|s| s.0) == before.map(|s| s.0));
                toile_sim_free(sim);
            }
        }
        status
    }
}
