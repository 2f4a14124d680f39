//! Arrays that stay as they were while their simulation moves on, ends, or is stepped by another
//! thread. `examples_c/04_views.c` does the same under the address sanitizer and valgrind.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::float_cmp,
    clippy::unwrap_used,
    reason = "the functions under test take the pointers of C; what goes in is in view here"
)]

use crate::capi_support::scene::*;
use std::ptr;
use toile::capi::*;

/// An array of a simulation, freed at the end.
struct Array(*mut toile_array);

impl Array {
    fn positions(sim: &Sim) -> Self {
        let mut out = ptr::null_mut();
        ok(unsafe { toile_sim_positions_array(sim.0, &mut out) });
        Self(out)
    }

    fn view(&self) -> toile_view_f64 {
        let mut view = filled(toile_view_f64_init);
        ok(unsafe { toile_array_view(self.0, &mut view) });
        view
    }

    fn numbers(&self) -> Vec<f64> {
        let view = self.view();
        let count = (view.count * view.components) as usize;
        unsafe { std::slice::from_raw_parts(view.data, count) }.to_vec()
    }
}

impl Drop for Array {
    fn drop(&mut self) {
        unsafe { toile_array_free(self.0) };
    }
}

fn place(sim: &Sim) -> *const f64 {
    let mut view = filled(toile_view_f64_init);
    ok(unsafe { toile_sim_positions_view(sim.0, &mut view) });
    view.data
}

#[test]
fn an_array_is_the_memory_of_the_simulation_until_that_changes() {
    let sim = Sim::small();
    let epoch = sim.epoch();
    let (first, second) = (Array::positions(&sim), Array::positions(&sim));
    let (view, before) = (first.view(), sim.positions());
    assert_eq!(view.data, place(&sim), "no copy was made");
    assert_eq!(second.view().data, view.data);
    assert_eq!((view.components, view.stride, view.epoch), (3, 24, epoch));
    assert_eq!(sim.epoch(), epoch, "holding changes nothing");
    sim.step(0.01);
    assert_ne!(place(&sim), view.data, "the simulation has moved away");
    assert_ne!(sim.positions(), before);
    let third = Array::positions(&sim);
    assert_eq!(third.numbers(), sim.positions());
    for array in [&first, &second] {
        assert_eq!(array.view().data, view.data);
        assert_eq!(array.numbers(), before);
    }
    drop(first);
    assert_eq!(second.numbers(), before);
}

#[test]
fn holding_arrays_changes_no_bit_of_the_simulation() {
    let (held, free) = (Sim::small(), Sim::small());
    let mut arrays = Vec::new();
    for _ in 0..4 {
        arrays.push(Array::positions(&held));
        held.step(0.01);
        free.step(0.01);
        assert_eq!(held.save(), free.save());
    }
    let mut seen: Vec<Vec<f64>> = arrays.iter().map(Array::numbers).collect();
    seen.dedup();
    assert_eq!(seen.len(), 4, "each is of its own time");
}

#[test]
fn an_array_outlives_its_simulation_and_a_failed_call() {
    let sim = Sim::small();
    let array = Array::positions(&sim);
    let (before, epoch) = (array.numbers(), sim.epoch());
    let refused = unsafe { toile_sim_step(sim.0, f64::NAN, ptr::null_mut()) };
    assert_ne!(refused, TOILE_OK);
    assert_eq!(sim.positions(), before);
    if place(&sim) != array.view().data {
        assert_ne!(sim.epoch(), epoch, "views have ended, and the epoch tells");
    }
    drop(sim);
    let filler = vec![7.0; before.len()];
    assert_eq!(array.numbers(), before);
    assert_eq!(filler.len(), before.len());
}

#[test]
fn freed_arrays_and_other_handles_are_refused() {
    let sim = Sim::small();
    let array = Array::positions(&sim);
    let handle = array.0;
    drop(array);
    let mut view = filled(toile_view_f64_init);
    let mut out = ptr::null_mut();
    unsafe {
        toile_array_free(ptr::null_mut());
        toile_array_free(handle);
        assert_eq!(toile_array_view(handle, &mut view), TOILE_E_HANDLE);
        assert_eq!(toile_array_view(sim.0.cast(), &mut view), TOILE_E_HANDLE);
        let wrong = handle.cast();
        assert_eq!(toile_sim_positions_array(wrong, &mut out), TOILE_E_HANDLE);
        let nowhere = ptr::null_mut();
        assert_eq!(toile_sim_positions_array(sim.0, nowhere), TOILE_E_ARGUMENT);
    }
    assert!(out.is_null());
}

#[test]
fn a_thread_reads_an_array_while_another_steps() {
    let sim = Sim::small();
    let handle = sim.0.addr();
    for _ in 0..5 {
        let array = Array::positions(&sim);
        let before = array.numbers();
        std::thread::scope(|scope| {
            let stepping = scope.spawn(|| {
                let sim = ptr::without_provenance_mut(handle);
                for _ in 0..3 {
                    ok(unsafe { toile_sim_step(sim, 0.01, ptr::null_mut()) });
                }
            });
            let mut reads = 0;
            while reads < 100 || !stepping.is_finished() {
                let view = array_view(array.0.addr());
                assert_eq!(view, before);
                reads += 1;
            }
        });
    }
}

fn array_view(handle: usize) -> Vec<f64> {
    let borrowed = std::mem::ManuallyDrop::new(Array(ptr::without_provenance_mut(handle)));
    borrowed.numbers()
}
