//! Linear solvers under the constraints of blended rings: preconditioner x ratio of triangles to yarns x step.
//!
//! The system of `tests/ring_cases`, with yarns that slide nowhere, through all their contacts, or that and on a plane. Iterations until all positions err
//! by 1e-3, 1e-6 and 1e-8 against the direct solution, root mean squares. `cargo bench --bench rings`, or
//! `make bench-mixed`; `--ratio 5` or `--ratio 20` takes one square.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

#[path = "../tests/ring_cases/mod.rs"]
mod ring_cases;

use ring_cases::{Case, Yarning, case};
use std::time::Instant;
use toile::math::Vec3;
use toile::math::parallel::Workers;
use toile::solve::linear::LinearSolver;
use toile::solve::linear::constrained::Constrained;
use toile::solve::linear::filtered::{Beside, Filtered};
use toile::solve::linear::pcg::ConjugateGradients;

const CAP: u32 = 1500;
const ERRORS: [f64; 3] = [1e-3, 1e-6, 1e-8];

fn norm(v: &[Vec3]) -> f64 {
    v.iter().map(Vec3::norm_squared).sum::<f64>().sqrt()
}

fn main() {
    println!(
        "iterations to errors of 1e-3, 1e-6, 1e-8 of all positions, seconds to prepare and for the last; - beyond {CAP}"
    );
    let only = std::env::args().skip_while(|a| a != "--ratio").nth(1);
    let squares = [
        (0.1, 5.0, [0.0285, 0.0715], &[1e-4, 1e-3, 1e-2][..]),
        (0.2, 20.0, [0.056, 0.144], &[1e-3, 1e-2]),
    ];
    for (side, ratio, range, steps) in squares {
        if only.as_ref().is_some_and(|o| *o != ratio.to_string()) {
            continue;
        }
        let all = [Yarning::Tied, Yarning::Slides, Yarning::SlidesAndTouches];
        for (yarning, h) in (all.into_iter()).flat_map(|y| steps.iter().map(move |h| (y, h))) {
            let case = case(side, ratio, range, *h, yarning);
            let workers = Workers::new(1);
            let n = case.matrix.n();
            let mut expected = vec![Vec3::zeros(); n];
            let mut direct = Constrained::new(&case.filter, &workers);
            direct.hold(&case.fixed);
            let start = Instant::now();
            direct.prepare(&case.matrix).expect("factor");
            direct
                .solve(&case.matrix, &case.right, &mut expected, 0.0)
                .expect("solution");
            let first = start.elapsed().as_secs_f64();
            let start = Instant::now();
            direct.prepare(&case.matrix).expect("factor");
            direct
                .solve(&case.matrix, &case.right, &mut expected, 0.0)
                .expect("solution");
            println!(
                "ratio {ratio}, step {} ms, {}: {n} blocks, {} touch, {} in rings, {} vertices there; direct {:.3} s, {first:.3} s with the analysis",
                1e3 * h,
                match yarning {
                    Yarning::Tied => "yarns do not slide",
                    Yarning::Slides | Yarning::SlidesAndTouches => "yarns slide",
                },
                case.touching,
                case.filter.nodes().len(),
                case.filter.kept().len(),
                start.elapsed().as_secs_f64()
            );
            for (beside, second) in [
                (Beside::Mass(case.masses.clone()), false),
                (Beside::Blocks, false),
                (Beside::Blocks, true),
                (Beside::Parts, true),
            ] {
                run(&case, beside, second, &expected, &workers);
            }
        }
    }
}

/// One row of the table.
fn run(case: &Case, beside: Beside, second: bool, expected: &[Vec3], workers: &Workers) {
    let whole = norm(expected);
    let preconditioner = Filtered::new(&case.filter, beside, second, workers);
    let mut cg = ConjugateGradients::new(Box::new(preconditioner));
    cg.hold(&case.fixed);
    let start = Instant::now();
    cg.prepare(&case.matrix).expect("preconditioner");
    let prepared = start.elapsed().as_secs_f64();
    let name = cg.name();
    let mut cg = Some(cg);
    let mut seconds = 0.0;
    let mut error = |limit: u32| {
        let mut limited = cg.take().expect("solver").with_limit(limit);
        let start = Instant::now();
        let mut x = vec![Vec3::zeros(); expected.len()];
        // ends at the limit, with what it has
        let _ = limited.solve(&case.matrix, &case.right, &mut x, 1e-16);
        seconds = start.elapsed().as_secs_f64();
        cg = Some(limited);
        let difference: Vec<Vec3> = x.iter().zip(expected).map(|(a, b)| a - b).collect();
        norm(&difference) / whole
    };
    let (mut low, mut high) = (0, 4);
    let mut found = Vec::new();
    for wanted in ERRORS {
        while high <= CAP && error(high) > wanted {
            low = high;
            high = (high as f64 * 1.4) as u32 + 1;
        }
        if high > CAP {
            break;
        }
        while high - low > 1 + low / 25 {
            let middle = low.midpoint(high);
            if error(middle) > wanted {
                low = middle;
            } else {
                high = middle;
            }
        }
        found.push(high.to_string());
        low = high - 1;
    }
    found.resize(ERRORS.len(), "-".to_owned());
    println!(
        "  {name:<32} {:>18}  {prepared:.3} + {seconds:.3} s",
        found.join(" / ")
    );
}
