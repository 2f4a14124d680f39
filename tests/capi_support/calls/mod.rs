//! Sequences of calls of the C interface made from bytes: what the random tests and the fuzz
//! targets run. Handles are living, freed, foreign, NULL or invented; numbers are ordinary, huge,
//! tiny, NaN or infinite; counts are right, short or absurd; pointers are NULL now and then.
//!
//! After each call: the status is one of the header's, an error has a text and leaves simulations
//! and garments as they were, bit by bit.

mod choices;
mod garments;
mod sims;
mod world;

use choices::Choices;
use garments::{add_body, add_garment, add_panel, edit_garment, read_garment};
use sims::{add_sim, change_sim, read_sim};
use std::ffi::CString;
use std::ptr;
use toile::capi::*;
use world::{World, filled, free, sane, start, start_yarns, state};

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
    // yarns cost more than a square of eight triangles
    if choices.once_in(64) {
        start_yarns(&mut world);
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
                step_and_free(sim);
            }
        }
        status
    }
}

/// Reads bytes as a scene; a small one that can be read is made and stepped once.
pub fn read_scene(bytes: &[u8]) -> toile_status {
    let folder = std::path::Path::new("/nowhere");
    if let Ok(text) = std::str::from_utf8(bytes) {
        let (scene, _) = toile::scene::Scene::read_all(text, Some(folder));
        let large = |s: &toile::scene::Scene| {
            let count = s.garment.estimated_vertices(1.0);
            count.is_ok_and(|n| n > 500.0) || s.settings.threads > 4.0
        };
        // it would be made, and take its time
        if scene.as_ref().is_some_and(large) {
            return TOILE_E_LIMIT;
        }
    }
    let mut sim = ptr::null_mut();
    let text = bytes.as_ptr().cast();
    let status = unsafe { toile_sim_from_scene(text, bytes.len(), c"/nowhere".as_ptr(), &mut sim) };
    sane(status);
    assert_eq!(status == TOILE_OK, !sim.is_null());
    if status == TOILE_OK {
        step_and_free(sim);
    }
    status
}

/// One short step, which succeeds or changes nothing.
fn step_and_free(sim: *mut toile_sim) {
    let before = state(sim);
    unsafe {
        let stepped = toile_sim_step(sim, 1e-4, ptr::null_mut());
        sane(stepped);
        assert!(stepped == TOILE_OK || state(sim).map(|s| s.0) == before.map(|s| s.0));
        toile_sim_free(sim);
    }
}
