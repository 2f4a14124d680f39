//! The objects that a sequence has made, and what is asked of every call.

use super::choices::Choices;
use std::ffi::CStr;
use std::ptr;
use toile::capi::*;

/// Handles made so far, the freed ones too.
#[derive(Debug, Default)]
pub(super) struct World {
    pub(super) garments: Vec<*mut toile_garment>,
    pub(super) bodies: Vec<*mut toile_body>,
    pub(super) sims: Vec<*mut toile_sim>,
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

pub(super) fn pick<T>(choices: &mut Choices<'_>, own: &[*mut T], other: Option<usize>) -> *mut T {
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
    pub(super) fn garment(&self, choices: &mut Choices<'_>) -> *mut toile_garment {
        pick(choices, &self.garments, self.sims.first().map(|h| h.addr()))
    }

    pub(super) fn body(&self, choices: &mut Choices<'_>) -> *mut toile_body {
        pick(
            choices,
            &self.bodies,
            self.garments.first().map(|h| h.addr()),
        )
    }

    pub(super) fn sim(&self, choices: &mut Choices<'_>) -> *mut toile_sim {
        pick(choices, &self.sims, self.bodies.first().map(|h| h.addr()))
    }
}

/// The status is one of the header's and an error has a text.
pub(super) fn sane(status: toile_status) {
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

pub(super) fn state(sim: *const toile_sim) -> Option<(Vec<u8>, u64)> {
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

pub(super) fn json(garment: *const toile_garment) -> Option<Vec<u8>> {
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

pub(super) fn filled<T>(init: unsafe extern "C" fn(*mut T, usize) -> toile_status) -> T {
    let mut value = std::mem::MaybeUninit::uninit();
    unsafe {
        assert_eq!(init(value.as_mut_ptr(), size_of::<T>()), TOILE_OK);
        value.assume_init()
    }
}

/// A square over a small sphere.
pub(super) fn start(world: &mut World) {
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

/// A scrap of weave with a weft that is half pulled out.
pub(super) fn start_yarns(world: &mut World) {
    let text = r#"{"toile_garment": 1, "name": "scrap", "edge_length": 0.002,
        "fabrics": [{"name": "y", "yarns":
            {"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025}}],
        "panels": [{"name": "p", "fabric": "y",
            "vertices": [[0, 0], [0.003, 0], [0.003, 0.003], [0, 0.003]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
        "blend_regions": [{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]}"#;
    let (mut garment, mut sim) = (ptr::null_mut(), ptr::null_mut());
    unsafe {
        let (bytes, length) = (text.as_ptr().cast(), text.len());
        let status = toile_garment_from_json(bytes, length, ptr::null(), &mut garment);
        assert_eq!(status, TOILE_OK);
        world.garments.push(garment);
        assert_eq!(toile_sim_create(garment, ptr::null(), &mut sim), TOILE_OK);
        world.sims.push(sim);
        for yarn in 0..3 {
            for end in 0..2 {
                let mut node = 0;
                sane(toile_sim_yarn_end(sim, yarn, end, &mut node));
                sane(toile_sim_pin_yarn_nodes(sim, &node, 1, ptr::null()));
            }
        }
        let mut node = 0;
        assert_eq!(toile_sim_yarn_end(sim, 4, 1, &mut node), TOILE_OK);
        for step in 1..=14 {
            let target = [3e-3 + 1e-4 * f64::from(step), 1.5e-3, 0.0];
            sane(toile_sim_pin_yarn_nodes(sim, &node, 1, target.as_ptr()));
            sane(toile_sim_step(sim, 1e-3, ptr::null_mut()));
        }
        let mut changes = filled(toile_yarn_changes_init);
        assert_eq!(toile_sim_yarn_changes(sim, &mut changes), TOILE_OK);
        assert!(changes.passages_gone > 0, "{changes:?}");
    }
}

pub(super) fn free(world: &World, choices: &mut Choices<'_>) -> toile_status {
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
