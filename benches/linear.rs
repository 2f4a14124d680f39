//! Time to solve one Newton system of sewn cloth: sizes x step sizes x solvers. One thread,
//! thread CPU is not separated from wall time, so run it on a quiet machine.
//! `cargo bench --bench linear [-- LARGEST_N [SMALLEST_N]]`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

#[path = "../tests/linear_cases/mod.rs"]
mod cases;

use std::time::Instant;
use toile::math::Vec3;
use toile::math::parallel::Workers;
use toile::solve::linear::LinearSolver;
use toile::solve::linear::choose::DROPPED;
use toile::solve::linear::direct::Direct;
use toile::solve::linear::factored::SingleFactor;
use toile::solve::linear::ic0::{IncompleteCholesky, Order, Storage};
use toile::solve::linear::jacobi::BlockJacobi;
use toile::solve::linear::pcg::ConjugateGradients;

fn main() {
    let sizes: Vec<usize> = std::env::args().filter_map(|a| a.parse().ok()).collect();
    let largest = sizes.first().copied().unwrap_or(30_000);
    let smallest = sizes.get(1).copied().unwrap_or(0);
    println!(
        "relative residual 1e-6; times in ms, best of repeats; analysis = first prepare - later prepare"
    );
    println!(
        "{:>7} {:>5} {:<22} {:>9} {:>9} {:>9} {:>9} {:>6} {:>9} {:>9}",
        "n", "h ms", "solver", "analysis", "factor", "solve", "sum", "its", "residual", "MB"
    );
    for n in [400, 1_600, 4_900, 10_000, 30_000, 90_000]
        .into_iter()
        .filter(|n| *n >= smallest)
    {
        if n > largest {
            break;
        }
        for h in [1e-3, 3e-3, 1e-2] {
            let case = cases::sewn_cloth(n, 4, h);
            let rows = case.matrix.n();
            let cg = |order: Order, storage| -> Box<dyn LinearSolver> {
                Box::new(ConjugateGradients::new(Box::new(IncompleteCholesky::new(
                    order, storage,
                ))))
            };
            let seams = || Order::Priorities(case.priorities.clone());
            let solvers: Vec<(&str, Box<dyn LinearSolver>)> = vec![
                ("cholesky", Box::new(Direct::new(&Workers::default()))),
                (
                    "cg cholesky",
                    Box::new(ConjugateGradients::new(Box::new(SingleFactor::new(
                        DROPPED,
                        &Workers::default(),
                    )))),
                ),
                (
                    "cg jacobi",
                    Box::new(ConjugateGradients::new(Box::new(BlockJacobi::new()))),
                ),
                ("cg ic0 natural f64", cg(Order::Natural, Storage::F64)),
                ("cg ic0 rcm f64", cg(Order::CuthillMckee, Storage::F64)),
                ("cg ic0 seams f64", cg(seams(), Storage::F64)),
                ("cg ic0 seams f32", cg(seams(), Storage::F32)),
            ];
            for (name, mut solver) in solvers {
                let b = cases::forces(rows, 7);
                let mut x = vec![Vec3::zeros(); rows];
                let start = Instant::now();
                let prepared = solver.prepare(&case.matrix);
                let first = start.elapsed().as_secs_f64();
                if let Err(error) = prepared {
                    println!("{rows:>7} {:>5} {name:<22} {error:?}", h * 1e3);
                    continue;
                }
                let repeats = if n < 5_000 { 5 } else { 2 };
                let (mut factor, mut solve) = (f64::INFINITY, f64::INFINITY);
                let mut outcome = Ok(0);
                for _ in 0..repeats {
                    let start = Instant::now();
                    outcome = solver.prepare(&case.matrix).and_then(|()| {
                        factor = factor.min(start.elapsed().as_secs_f64());
                        let start = Instant::now();
                        let its = solver.solve(&case.matrix, &b, &mut x, 1e-6);
                        solve = solve.min(start.elapsed().as_secs_f64());
                        its
                    });
                }
                match outcome {
                    Ok(its) => println!(
                        "{rows:>7} {:>5} {name:<22} {:>9.2} {:>9.2} {:>9.2} {:>9.2} {its:>6} {:>9.1e} {:>9.1}",
                        h * 1e3,
                        (first - factor).max(0.0) * 1e3,
                        factor * 1e3,
                        solve * 1e3,
                        (factor + solve) * 1e3,
                        cases::residual(&case.matrix, &b, &x),
                        solver.bytes() as f64 / 1e6
                    ),
                    Err(error) => println!("{rows:>7} {:>5} {name:<22} {error:?}", h * 1e3),
                }
            }
        }
    }
}
