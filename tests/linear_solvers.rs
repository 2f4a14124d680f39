//! Laws of the linear solvers.

#![allow(clippy::expect_used, reason = "test code")]

use crate::linear_cases::{Random, add, forces, residual, sewn_cloth};
use toile::math::block::{BlockMatrix, BlockPattern};
use toile::math::parallel::Workers;
use toile::math::{Mat3, Vec3};
use toile::solve::linear::choose::{Made, solver};
use toile::solve::linear::direct::Direct;
use toile::solve::linear::graph::Graph;
use toile::solve::linear::ic0::{IncompleteCholesky, Order, Storage};
use toile::solve::linear::jacobi::BlockJacobi;
use toile::solve::linear::ordering::{ORDINARY, reverse_cuthill_mckee};
use toile::solve::linear::pcg::{ConjugateGradients, Preconditioner};
use toile::solve::linear::schwarz::Schwarz;
use toile::solve::linear::{LinearError, LinearSolver};

fn all(priorities: &[u8]) -> Vec<Box<dyn LinearSolver>> {
    let cg = |p: Box<dyn Preconditioner>| -> Box<dyn LinearSolver> {
        Box::new(ConjugateGradients::new(p).with_limit(20_000))
    };
    let ic = |o, s| cg(Box::new(IncompleteCholesky::new(o, s)));
    vec![
        Box::new(Direct::new(&Workers::default())),
        cg(Box::new(BlockJacobi::new())),
        cg(Box::new(Schwarz::with_parts(&Workers::new(2), 20))),
        cg(Box::new(Schwarz::new(&Workers::default()))),
        ic(Order::Natural, Storage::F64),
        ic(Order::CuthillMckee, Storage::F32),
        ic(Order::Priorities(priorities.to_vec()), Storage::F64),
        ic(Order::Priorities(priorities.to_vec()), Storage::F32),
    ]
}

fn dense(matrix: &BlockMatrix) -> nalgebra::DMatrix<f64> {
    let n = matrix.n();
    let mut full = nalgebra::DMatrix::zeros(3 * n, 3 * n);
    for j in 0..n {
        for k in matrix.pattern.starts[j] as usize..matrix.pattern.starts[j + 1] as usize {
            let i = matrix.pattern.rows[k] as usize;
            for r in 0..3 {
                for c in 0..3 {
                    full[(3 * i + r, 3 * j + c)] = matrix.blocks[k][(r, c)];
                    full[(3 * j + c, 3 * i + r)] = matrix.blocks[k][(r, c)];
                }
            }
        }
    }
    full
}

/// A chain of random symmetric positive definite couplings.
fn chain(n: usize, seed: u64, anchored: bool) -> BlockMatrix {
    let mut random = Random(seed);
    let pattern = BlockPattern::from_stencils(n, |sink| {
        for i in 1..n as u32 {
            sink(&[i - 1, i]);
        }
    });
    let mut matrix = BlockMatrix::zeros(pattern);
    for i in 1..n as u32 {
        let a = Mat3::from_fn(|_, _| random.signed());
        let k = a * a.transpose() + Mat3::identity();
        add(&mut matrix, &[i - 1, i], &[k, -k, -k, k]);
    }
    if anchored {
        matrix.blocks[0] += Mat3::identity() * 0.5;
    }
    matrix
}

/// Every solver gives the dense solution to 1e-10 of its norm.
#[test]
fn every_solver_agrees_with_the_dense_solution() {
    let case = sewn_cloth(100, 2, 3e-3);
    let n = case.matrix.n();
    let b = forces(n, 3);
    let flat = nalgebra::DVector::from_iterator(3 * n, b.iter().flat_map(|v| v.iter().copied()));
    let reference = dense(&case.matrix)
        .cholesky()
        .expect("positive definite")
        .solve(&flat);
    for mut solver in all(&case.priorities) {
        solver.prepare(&case.matrix).expect("prepares");
        let mut x = vec![Vec3::repeat(f64::NAN); n];
        let its = solver
            .solve(&case.matrix, &b, &mut x, 1e-13)
            .expect("solves");
        let mut error = 0.0;
        for (i, v) in x.iter().enumerate() {
            error += (v - reference.fixed_rows::<3>(3 * i)).norm_squared();
        }
        let error = error.sqrt() / reference.norm();
        println!(
            "{:<10} {its:>4} iterations, error {error:.1e}",
            solver.name()
        );
        assert!(error < 1e-10, "{}: {error:e}", solver.name());
    }
}

/// Scalars of a block row that are no unknowns have the row of the identity, for every solver and in factors that are cut.
#[test]
fn scalars_that_are_no_unknowns_keep_the_right_hand_side() {
    for (n, exact_only) in [(100, false), (6_000, true)] {
        let mut case = sewn_cloth(n, 2, 3e-3);
        let n = case.matrix.n();
        let pattern = &mut case.matrix.pattern;
        pattern.widths = (0..n).map(|i| 1 + (i * 7 % 3) as u8).collect();
        for j in 0..n {
            for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
                let i = pattern.rows[k];
                let (height, width) = (pattern.width(i), pattern.width(j as u32));
                let block = &mut case.matrix.blocks[k];
                *block = Mat3::from_fn(|r, c| {
                    if r < usize::from(height) && c < usize::from(width) {
                        block[(r, c)]
                    } else {
                        f64::from(u8::from(i as usize == j && r == c))
                    }
                });
            }
        }
        let b = forces(n, 3);
        for mut solver in all(&case.priorities) {
            if exact_only && solver.name() != "cholesky" {
                continue;
            }
            solver.prepare(&case.matrix).expect("prepares");
            let mut x = vec![Vec3::repeat(f64::NAN); n];
            solver
                .solve(&case.matrix, &b, &mut x, 1e-12)
                .expect("solves");
            let left = residual(&case.matrix, &b, &x);
            assert!(left < 1e-11, "{}: {left:e}", solver.name());
            for (i, (x, b)) in x.iter().zip(&b).enumerate() {
                for c in usize::from(case.matrix.pattern.widths[i])..3 {
                    assert!((x[c] - b[c]).abs() < 1e-9, "{}", solver.name());
                }
            }
        }
    }
}

/// At a coarser tolerance the reported solution meets it, in the true residual.
#[test]
fn the_tolerance_holds_for_the_true_residual() {
    let case = sewn_cloth(1_600, 4, 1e-2);
    let b = forces(case.matrix.n(), 11);
    let mut x = vec![Vec3::zeros(); b.len()];
    for mut solver in all(&case.priorities) {
        solver.prepare(&case.matrix).expect("prepares");
        for tolerance in [1e-2, 1e-6, 1e-9] {
            solver
                .solve(&case.matrix, &b, &mut x, tolerance)
                .expect("solves");
            assert!(
                residual(&case.matrix, &b, &x) <= tolerance,
                "{}",
                solver.name()
            );
        }
    }
}

/// A block tridiagonal matrix has no fill, so IC(0) is its Cholesky factor: CG ends at once.
#[test]
fn incomplete_cholesky_is_exact_on_tridiagonal_matrices() {
    for order in [
        Order::Natural,
        Order::CuthillMckee,
        Order::Given((0..40).rev().collect()),
    ] {
        let matrix = chain(40, 5, true);
        let b = forces(40, 1);
        let mut factor = IncompleteCholesky::new(order.clone(), Storage::F64);
        factor.prepare(&matrix).expect("prepares");
        assert_eq!(factor.shift(), 0.0);
        let mut x = vec![Vec3::zeros(); 40];
        factor.apply(&mut |x, y| matrix.multiply(x, y), &b, &mut x);
        let error = residual(&matrix, &b, &x);
        assert!(error < 1e-11, "{order:?}: residual {error:e}");
    }
}

/// Singular (free to translate), indefinite and non-finite matrices are refused, not solved.
#[test]
fn matrices_that_are_not_positive_definite_are_refused() {
    let free = chain(30, 9, false);
    let mut negative = chain(30, 9, true);
    let slot = negative.pattern.starts[17] as usize;
    negative.blocks[slot][(1, 1)] = -1.0;
    let mut indefinite = chain(30, 9, true);
    let slot = indefinite.pattern.starts[17] as usize;
    indefinite.blocks[slot] -= Mat3::identity() * 3.0;
    let mut nan = chain(30, 9, true);
    nan.blocks[4][(2, 0)] = f64::NAN;
    let mut b = forces(30, 2);
    let mut x = vec![Vec3::zeros(); 30];
    for matrix in [&free, &negative, &indefinite, &nan] {
        let mut direct = Direct::new(&Workers::default());
        assert_eq!(
            direct.prepare(matrix),
            Err(LinearError::NotPositiveDefinite)
        );
        assert!(direct.solve(matrix, &b, &mut x, 1e-6).is_err());
    }
    // Conjugate gradients notice on the way; a free chain has no solution under a net force.
    for (what, matrix) in [
        ("free", &free),
        ("negative", &negative),
        ("indefinite", &indefinite),
        ("nan", &nan),
    ] {
        for mut solver in all(&[ORDINARY; 30]).into_iter().skip(1) {
            let result = solver
                .prepare(matrix)
                .and_then(|()| solver.solve(matrix, &b, &mut x, 1e-9));
            assert!(result.is_err(), "{what}: {} gave {result:?}", solver.name());
        }
    }
    b[3].x = f64::INFINITY;
    let sound = chain(30, 9, true);
    for mut solver in all(&[ORDINARY; 30]) {
        solver.prepare(&sound).expect("prepares");
        assert!(
            solver.solve(&sound, &b, &mut x, 1e-9).is_err(),
            "{}",
            solver.name()
        );
    }
}

/// After a refused matrix a solver works again, and a changed pattern is noticed.
#[test]
fn a_solver_follows_changes_of_values_and_pattern() {
    let cases = [
        sewn_cloth(100, 2, 1e-3),
        sewn_cloth(100, 2, 1e-2),
        sewn_cloth(150, 3, 1e-3),
    ];
    let bad = chain(30, 9, false);
    let priorities = vec![ORDINARY; 200];
    for (mut kept, k) in all(&priorities).into_iter().zip(0..) {
        for case in &cases {
            let b = forces(case.matrix.n(), 4);
            let mut x = vec![Vec3::zeros(); b.len()];
            let mut y = x.clone();
            kept.prepare(&case.matrix).expect("prepares");
            kept.solve(&case.matrix, &b, &mut x, 1e-9).expect("solves");
            let mut fresh = all(&priorities).swap_remove(k);
            fresh.prepare(&case.matrix).expect("prepares");
            fresh.solve(&case.matrix, &b, &mut y, 1e-9).expect("solves");
            let same = x.iter().zip(&y).all(|(x, y)| {
                x.iter()
                    .zip(y.iter())
                    .all(|(x, y)| x.to_bits() == y.to_bits())
            });
            assert!(
                same,
                "{}: bits depend on what was solved before",
                kept.name()
            );
            let _ = kept.prepare(&bad);
        }
    }
}

/// Empty and single-vertex systems are no special case for the caller.
#[test]
fn the_smallest_systems_are_solved() {
    for n in [0, 1] {
        let mut matrix = BlockMatrix::zeros(BlockPattern::from_stencils(n, |_| {}));
        matrix.blocks.fill(Mat3::identity() * 2.0);
        let b = vec![Vec3::new(2.0, 4.0, 6.0); n];
        for mut solver in all(&[]) {
            let mut x = vec![Vec3::zeros(); n];
            solver.prepare(&matrix).expect("prepares");
            solver.solve(&matrix, &b, &mut x, 1e-12).expect("solves");
            for v in x {
                assert!((v - Vec3::new(1.0, 2.0, 3.0)).norm() < 1e-14);
            }
        }
    }
}

/// The order is a permutation, priorities come first, and neighbours stay near in it.
#[test]
fn cuthill_mckee_is_a_permutation_of_small_bandwidth() {
    let case = sewn_cloth(900, 1, 1e-3);
    let n = case.matrix.n();
    let mut shuffle: Vec<u32> = (0..n as u32).collect();
    let mut random = Random(17);
    for i in (1..n).rev() {
        shuffle.swap(i, (random.next() % (i as u64 + 1)) as usize);
    }
    let old = &case.matrix.pattern;
    let pattern = BlockPattern::from_stencils(n, |sink| {
        for j in 0..n {
            for k in old.starts[j] as usize..old.starts[j + 1] as usize {
                sink(&[shuffle[old.rows[k] as usize], shuffle[j]]);
            }
        }
    });
    let order = reverse_cuthill_mckee(&pattern, None);
    let mut place = vec![usize::MAX; n];
    for (new, &v) in order.iter().enumerate() {
        assert_eq!(std::mem::replace(&mut place[v as usize], new), usize::MAX);
    }
    let mut bandwidth = 0;
    for j in 0..n {
        for k in pattern.starts[j] as usize..pattern.starts[j + 1] as usize {
            bandwidth = bandwidth.max(place[pattern.rows[k] as usize].abs_diff(place[j]));
        }
    }
    // A 30 x 30 grid whose stencil reaches two rows.
    assert!(bandwidth < 4 * 30, "bandwidth {bandwidth}");
    let case = sewn_cloth(400, 3, 1e-3);
    let order = reverse_cuthill_mckee(&case.matrix.pattern, Some(&case.priorities));
    assert!(
        order
            .windows(2)
            .all(|w| case.priorities[w[0] as usize] <= case.priorities[w[1] as usize])
    );
    assert!(case.priorities.contains(&0) && case.priorities.contains(&1));
}

/// Where incomplete factors take many iterations, kept factors follow until the host's next call.
#[test]
fn slow_incomplete_factors_are_left() {
    let case = sewn_cloth(1_600, 4, 1e-2);
    let b = forces(case.matrix.n(), 1);
    let mut x = vec![Vec3::zeros(); b.len()];
    let mut automatic = solver(
        0,
        2_000,
        Made::Triangles(Some(&case.priorities)),
        &Workers::default(),
    );
    for _ in 0..2 {
        automatic.prepare(&case.matrix).expect("prepares");
        assert_eq!(automatic.name(), "cg_ic0");
        let quick = automatic.solve(&case.matrix, &b, &mut x, 1e-1);
        assert!(quick.expect("solves") <= 50);
        automatic.prepare(&case.matrix).expect("prepares");
        assert_eq!(automatic.name(), "cg_ic0");
        let slow = automatic.solve(&case.matrix, &b, &mut x, 1e-12);
        assert!(slow.expect("solves") > 50);
        automatic.prepare(&case.matrix).expect("prepares");
        assert_eq!(automatic.name(), "cg_cholesky");
        automatic.forget();
    }
}

/// Numbers in the settings choose what they say; the automatic choice follows the stiffness.
#[test]
fn the_choice_follows_its_number() {
    let sheet = Made::Triangles(Some(&[0; 10]));
    for (kind, n, made, name) in [
        (1, 2_000, sheet, "cholesky"),
        (2, 2_000, sheet, "cg_jacobi"),
        (3, 2_000, sheet, "cg_ic0"),
        (4, 2_000, sheet, "cg_cholesky"),
        (5, 2_000, sheet, "cg_schwarz"),
        (0, 200, sheet, "cholesky"),
    ] {
        assert_eq!(solver(kind, n, made, &Workers::default()).name(), name);
    }
    for (n, made, h, expected) in [
        (1_600, Made::Knits, 1e-2, "cholesky"),
        (9_000, Made::Weaves, 1e-2, "cg_cholesky"),
        (9_000, Made::Knits, 1e2, "cholesky"),
        (21_000, Made::Knits, 1e2, "cg_cholesky"),
        (122_500, Made::Weaves, 1e-2, "cg_schwarz"),
    ] {
        let case = sewn_cloth(n, 4, h);
        let mut automatic = solver(0, n, made, &Workers::default());
        automatic.prepare(&case.matrix).expect("prepares");
        assert_eq!(automatic.name(), expected, "{n} blocks of yarns, step {h}");
        if n > 100_000 {
            continue;
        }
        let mut matrix = case.matrix;
        let diagonal = matrix.pattern.starts[n / 2] as usize;
        matrix.blocks[diagonal] = -matrix.blocks[diagonal];
        let refused = automatic.prepare(&matrix);
        assert_eq!(refused, Err(LinearError::NotPositiveDefinite));
    }
    for (n, h, expected) in [
        (1_600, 1e-2, "cg_ic0"),
        (4_900, 1e-3, "cg_ic0"),
        (1_600, 1.0, "cg_cholesky"),
    ] {
        let case = sewn_cloth(n, 4, h);
        let b = forces(case.matrix.n(), 1);
        let mut x = vec![Vec3::zeros(); b.len()];
        let mut automatic = solver(
            0,
            2_000,
            Made::Triangles(Some(&case.priorities)),
            &Workers::default(),
        );
        automatic.prepare(&case.matrix).expect("prepares");
        assert_eq!(automatic.name(), expected, "{n} vertices, step {h}");
        automatic
            .solve(&case.matrix, &b, &mut x, 1e-6)
            .expect("solves");
        assert!(residual(&case.matrix, &b, &x) <= 1e-6);
    }
}

#[test]
fn subtrees_side_by_side_give_the_same_bits_and_the_solution() {
    let case = sewn_cloth(6_000, 3, 0.1);
    let b = forces(case.matrix.n(), 3);
    let solve = |threads: usize| {
        let mut direct = Direct::new(&Workers::new(threads));
        direct.prepare(&case.matrix).expect("prepares");
        // small factors are not cut
        assert!(direct.factor_length() > 1_000_000);
        let mut x = vec![Vec3::zeros(); b.len()];
        direct.solve(&case.matrix, &b, &mut x, 0.0).expect("solves");
        x
    };
    let one = solve(1);
    let left = residual(&case.matrix, &b, &one);
    assert!(left < 1e-8, "residual {left:.1e}");
    for threads in [2, 3, 8] {
        let x = solve(threads);
        for (p, q) in one.iter().zip(&x) {
            assert_eq!(p.map(f64::to_bits), q.map(f64::to_bits));
        }
    }
}

/// A matrix that is not positive definite is refused and changes nothing for the ones after it, nor does one of another pattern.
#[test]
fn a_refused_matrix_leaves_no_trace() {
    let case = sewn_cloth(6_000, 3, 0.1);
    let n = case.matrix.n();
    let b = forces(n, 3);
    let mut bad = case.matrix.clone();
    let last = bad.pattern.starts[n - 1] as usize;
    let most = bad.blocks[last].norm();
    bad.blocks[last] -= Mat3::identity() * (2.0 * most);
    let other = sewn_cloth(1_600, 3, 0.1);
    let solve = |before: &[&BlockMatrix]| {
        let mut direct = Direct::new(&Workers::new(2));
        for matrix in before {
            let refused = std::ptr::eq(*matrix, &raw const bad);
            assert_eq!(direct.prepare(matrix).is_err(), refused);
        }
        direct.prepare(&case.matrix).expect("prepares");
        let mut x = vec![Vec3::zeros(); n];
        direct.solve(&case.matrix, &b, &mut x, 0.0).expect("solves");
        x
    };
    let alone = solve(&[]);
    assert_eq!(alone, solve(&[&bad]));
    assert_eq!(alone, solve(&[&other.matrix, &bad, &other.matrix]));
}

/// Parts have one order: what they add up to is the same for any number of threads, and of use.
#[test]
fn overlapping_parts_give_the_same_bits_and_few_iterations() {
    let case = sewn_cloth(1_600, 3, 1e-3);
    let b = forces(case.matrix.n(), 3);
    let solve = |preconditioner: Box<dyn Preconditioner>| {
        let mut cg = ConjugateGradients::new(preconditioner);
        cg.prepare(&case.matrix).expect("prepares");
        let mut x = vec![Vec3::zeros(); b.len()];
        let count = cg.solve(&case.matrix, &b, &mut x, 1e-8).expect("solves");
        (count, x)
    };
    let parted = |threads: usize| {
        let parts = Schwarz::with_parts(&Workers::new(threads), 200);
        solve(Box::new(parts))
    };
    let (count, one) = parted(1);
    let (jacobi, _) = solve(Box::new(BlockJacobi::new()));
    assert!(4 * count < jacobi, "{count} and {jacobi} iterations");
    for threads in [2, 3] {
        for (p, q) in one.iter().zip(&parted(threads).1) {
            assert_eq!(p.map(f64::to_bits), q.map(f64::to_bits));
        }
    }
}

/// Every row of a graph, joined or not, is in one set of its halves.
#[test]
fn halves_have_every_row_once() {
    let pattern = BlockPattern::from_stencils(1_000, |sink| {
        // a band, cut in two, and rows alone
        for i in (0..899).filter(|i| *i != 400) {
            sink(&[i, i + 1, (i + 7).min(899)]);
        }
    });
    let sets = Graph::new(&pattern).halved(64);
    let mut rows: Vec<u32> = sets.iter().flatten().copied().collect();
    rows.sort_unstable();
    assert_eq!(rows, (0..1_000).collect::<Vec<u32>>());
    assert!(sets.iter().all(|set| (32..=64).contains(&set.len())));
}
