//! Which linear solver.
//!
//! The crossover comes from `benches/linear.rs`, which prints time to a relative residual of 1e-6
//! (analysis, factorization and solve) on sewn cloth at step sizes from 1 to 10 ms.

use super::LinearSolver;
use super::direct::Direct;
use super::ic0::{IncompleteCholesky, Order, Storage};
use super::jacobi::BlockJacobi;
use super::pcg::ConjugateGradients;

/// Vertices from which the automatic choice takes conjugate gradients.
pub const CROSSOVER: usize = 60_000;

/// A solver by its number in the settings: 0 chooses by `n` (block rows), 1 sparse Cholesky,
/// 2 conjugate gradients with block Jacobi, 3 with incomplete Cholesky. Numbers above are taken
/// as 0: the settings refuse them at the door.
///
/// `priorities` (see [`super::ordering`]) mark the vertices of seams for the incomplete
/// factorization.
pub fn solver(kind: u32, n: usize, priorities: Option<&[u8]>) -> Box<dyn LinearSolver> {
    let order = match priorities {
        Some(p) => Order::Priorities(p.to_vec()),
        None => Order::CuthillMckee,
    };
    match kind {
        1 => Box::new(Direct::new()),
        2 => Box::new(ConjugateGradients::new(Box::new(BlockJacobi::new()))),
        3 => Box::new(ConjugateGradients::new(Box::new(IncompleteCholesky::new(
            order,
            Storage::F32,
        )))),
        _ => solver(if n < CROSSOVER { 1 } else { 3 }, n, priorities),
    }
}
