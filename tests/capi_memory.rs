//! Objects made and freed leave nothing behind. Alone in its program: it looks at the process.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    reason = "the functions under test take the pointers of C"
)]

mod capi_support;
use capi_support::scene::*;

/// Memory of this process that is really there [bytes].
fn resident() -> Option<usize> {
    let text = std::fs::read_to_string("/proc/self/statm").ok()?;
    let pages: usize = text.split_whitespace().nth(1)?.parse().ok()?;
    Some(pages * 4096)
}

#[test]
fn ten_thousand_objects_made_and_freed_do_not_grow_memory() {
    if resident().is_none() {
        return capi_support::skip("/proc/self/statm is not there");
    }
    let cycle = || {
        let garment = square(0.1, 0.06);
        let sim = Sim::new(&garment);
        let body = sphere(0.05);
        let null = std::ptr::null_mut();
        ok(unsafe { toile::capi::toile_sim_set_body_sdf(sim.0, body.0, null, null.cast()) });
        drop(garment);
        drop(body);
        assert!(sim.vertex_count() > 3);
        // an error's text and a refused object are objects too
        let bad = unsafe { toile::capi::toile_sim_step(sim.0, f64::NAN, null.cast()) };
        assert_ne!(bad, 0);
    };
    for _ in 0..1000 {
        cycle();
    }
    let before = resident().expect("statm");
    for _ in 0..10_000 {
        cycle();
    }
    let after = resident().expect("statm");
    let growth = after.saturating_sub(before);
    assert!(growth < 2 << 20, "{growth} bytes more after 10000 cycles");
}
