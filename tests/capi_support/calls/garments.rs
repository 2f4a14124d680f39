//! Calls on garments and bodies.

use super::choices::{Choices, size};
use super::world::{World, filled, json};
use std::ffi::{CStr, c_char};
use std::ptr;
use toile::capi::*;

pub(super) fn add_garment(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
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

pub(super) fn add_panel(world: &World, choices: &mut Choices<'_>) -> toile_status {
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

pub(super) fn edit_garment(world: &World, choices: &mut Choices<'_>) -> toile_status {
    let garment = world.garment(choices);
    let before = json(garment);
    let uv = choices.numbers(8);
    let mut index = 0;
    let fabric: [&CStr; 4] = [c"{\"density\":0.3}", c"{", c"{\"density\":-1}", c"[1,2]"];
    let fabric = fabric[choices.below(4)];
    let length = fabric.to_bytes().len();
    let status = unsafe {
        match choices.below(8) {
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
            6 => {
                let (count, rings) = (choices.count(8), choices.index());
                toile_garment_set_blend_vertices(garment, uv.as_ptr(), count, rings)
            }
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

pub(super) fn read_garment(world: &World, choices: &mut Choices<'_>) -> toile_status {
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

pub(super) fn add_body(world: &mut World, choices: &mut Choices<'_>) -> toile_status {
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
