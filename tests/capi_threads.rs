//! The thread rule: const beside const, one alone for the rest, different handles independent.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "the functions under test take the pointers of C"
)]

use crate::capi_support::scene::*;
use std::ffi::c_void;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Barrier, mpsc};
use std::time::Duration;
use toile::capi::*;

#[test]
fn const_calls_run_beside_each_other_and_agree() {
    let sim = Sim::small();
    for _ in 0..5 {
        sim.step(0.02);
    }
    let (positions, state) = (sim.positions(), sim.save());
    let sim = &sim;
    std::thread::scope(|scope| {
        for _ in 0..8 {
            scope.spawn(|| {
                for _ in 0..200 {
                    assert_eq!(sim.positions(), positions);
                    assert_eq!(sim.save(), state);
                    let mut energies = filled(toile_energies_init);
                    ok(unsafe { toile_sim_energies(sim.0, &mut energies) });
                    assert!(sim.epoch() > 0);
                }
            });
        }
    });
    assert_eq!(sim.save(), state);
}

struct Held {
    entered: mpsc::Sender<()>,
    go_on: mpsc::Receiver<()>,
    first: bool,
}

/// Keeps a drape inside its callback until the test lets it go.
extern "C" fn hold(user: *mut c_void, _: *const toile_progress) -> i32 {
    let held = unsafe { &mut *user.cast::<Held>() };
    if held.first {
        held.first = false;
        held.entered.send(()).expect("test waits");
        held.go_on
            .recv_timeout(Duration::from_secs(60))
            .expect("test answers");
    }
    0
}

#[test]
fn a_second_thread_on_a_handle_at_work_is_told_so_and_changes_nothing() {
    let sim = Sim::small();
    let alone = Sim::small();
    ok(unsafe { toile_sim_drape(alone.0, ptr::null(), ptr::null_mut()) });
    let (entered, is_in) = mpsc::channel();
    let (let_go, go_on) = mpsc::channel();
    let sim = &sim;
    std::thread::scope(|scope| {
        scope.spawn(move || {
            let mut held = Held {
                entered,
                go_on,
                first: true,
            };
            let mut desc = filled(toile_drape_desc_init);
            desc.progress = Some(hold);
            desc.progress_user = (&raw mut held).cast();
            ok(unsafe { toile_sim_drape(sim.0, &desc, ptr::null_mut()) });
        });
        is_in
            .recv_timeout(Duration::from_secs(60))
            .expect("drape began");
        let mut needed = 0;
        unsafe {
            fails(toile_sim_step(sim.0, 0.01, ptr::null_mut()), TOILE_E_BUSY);
            fails(
                toile_sim_positions(sim.0, ptr::null_mut(), 0, &mut needed),
                TOILE_E_BUSY,
            );
            fails(
                toile_sim_pin(sim.0, [0].as_ptr(), 1, ptr::null()),
                TOILE_E_BUSY,
            );
            assert_eq!(toile_sim_epoch(sim.0), 0);
        }
        // another handle is not concerned
        Sim::small().step(0.01);
        let_go.send(()).expect("drape waits");
    });
    assert_eq!(sim.save(), alone.save());
}

#[test]
fn of_two_threads_that_change_one_handle_each_call_is_done_or_refused() {
    let sim = Sim::small();
    let (done, busy) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let barrier = Barrier::new(4);
    let shared = &sim;
    std::thread::scope(|scope| {
        for _ in 0..4 {
            scope.spawn(|| {
                barrier.wait();
                for _ in 0..50 {
                    match unsafe { toile_sim_step(shared.0, 0.005, ptr::null_mut()) } {
                        TOILE_OK => done.fetch_add(1, Ordering::Relaxed),
                        TOILE_E_BUSY => busy.fetch_add(1, Ordering::Relaxed),
                        other => panic!("{other}: {}", last_error()),
                    };
                }
            });
        }
    });
    let done = done.into_inner();
    assert_eq!(done + busy.into_inner(), 200);
    // the state is the one that as many steps give
    let alone = Sim::small();
    for _ in 0..done {
        alone.step(0.005);
    }
    assert_eq!(sim.save(), alone.save());
}

#[test]
fn a_handle_freed_in_the_middle_of_calls_is_safe() {
    for _ in 0..20 {
        let garment = square(0.05, 0.0);
        let sim = Sim::new(&garment);
        let stop = AtomicBool::new(false);
        let shared = &sim;
        std::thread::scope(|scope| {
            for _ in 0..3 {
                scope.spawn(|| {
                    while !stop.load(Ordering::Relaxed) {
                        let status = unsafe { toile_sim_step(shared.0, 0.001, ptr::null_mut()) };
                        assert!(
                            [TOILE_OK, TOILE_E_BUSY, TOILE_E_HANDLE].contains(&status),
                            "{status}"
                        );
                    }
                });
            }
            std::thread::sleep(Duration::from_millis(3));
            unsafe { toile_sim_free(shared.0) };
            std::thread::sleep(Duration::from_millis(1));
            stop.store(true, Ordering::Relaxed);
        });
    }
}

#[test]
fn results_are_the_same_bits_for_any_number_of_threads() {
    let garment = tunic();
    let mut states = Vec::new();
    for threads in [1, 2, 3] {
        let mut desc = filled(toile_sim_desc_init);
        desc.threads = threads;
        let mut out = ptr::null_mut();
        ok(unsafe { toile_sim_create(garment.0, &desc, &mut out) });
        let sim = Sim(out);
        for _ in 0..5 {
            sim.step(1.0 / 60.0);
        }
        states.push(sim.positions());
    }
    for other in &states[1..] {
        let same = other
            .iter()
            .zip(&states[0])
            .all(|(a, b)| a.to_bits() == b.to_bits());
        assert!(same, "positions differ");
    }
}
