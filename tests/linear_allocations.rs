//! Solving again on the same pattern takes no memory.
#![allow(clippy::expect_used, reason = "test code")]

mod linear_cases;

use std::alloc::{GlobalAlloc, Layout, System};
use std::sync::atomic::{AtomicUsize, Ordering};
use toile::math::Vec3;
use toile::math::parallel::Workers;
use toile::solve::linear::choose::{Made, solver};

struct Counting;

static COUNT: AtomicUsize = AtomicUsize::new(0);

#[allow(unsafe_code, reason = "an allocator can only be written with it")]
// SAFETY: everything is passed on to the system's allocator.
unsafe impl GlobalAlloc for Counting {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        COUNT.fetch_add(1, Ordering::Relaxed);
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.alloc(layout) }
    }
    unsafe fn dealloc(&self, ptr: *mut u8, layout: Layout) {
        // SAFETY: the caller's contract is the system allocator's.
        unsafe { System.dealloc(ptr, layout) }
    }
}

#[global_allocator]
static ALLOCATOR: Counting = Counting;

/// The only test of this program, so that nothing else allocates meanwhile.
#[test]
fn a_second_solve_on_the_same_pattern_allocates_nothing() {
    let case = linear_cases::sewn_cloth(900, 3, 3e-3);
    let b = linear_cases::forces(case.matrix.n(), 3);
    let mut x = vec![Vec3::zeros(); b.len()];
    for kind in [0, 1, 2, 3] {
        let mut solver = solver(
            kind,
            b.len(),
            Made::Triangles(Some(&case.priorities)),
            &Workers::default(),
        );
        solver.prepare(&case.matrix).expect("prepares");
        solver
            .solve(&case.matrix, &b, &mut x, 1e-6)
            .expect("solves");
        let before = COUNT.load(Ordering::Relaxed);
        solver.prepare(&case.matrix).expect("prepares");
        solver
            .solve(&case.matrix, &b, &mut x, 1e-6)
            .expect("solves");
        let taken = COUNT.load(Ordering::Relaxed) - before;
        assert_eq!(taken, 0, "{} allocated {taken} times", solver.name());
        assert!(solver.bytes() > 72 * b.len());
    }
}
