//! Conjugate gradients without a matrix: the motion of exact factors in a fraction of their memory.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_sims::{knit, patch, sim};
use toile::math::Vec3;
use toile::sim::Sim;

/// Places of all points after steps of 1 ms, and the bytes of matrix and factor.
fn moved(text: &str, kind: f64) -> (Vec<Vec3>, usize) {
    let mut sim = sim(
        text,
        -9.81,
        &[
            ("solver.linear.kind", kind),
            ("yarn.relative_velocity", 1e-4),
        ],
    );
    let held: Vec<u32> = (0..sim.yarn_nodes().len() as u32)
        .filter(|n| sim.active_yarn_nodes()[*n as usize])
        .take(3)
        .collect();
    sim.pin_yarn_nodes(&held, None).expect("pins");
    for _ in 0..4 {
        let _ = sim.step(1e-3).expect("step");
    }
    (points(&sim), sim.info().bytes + sim.info().factor_bytes)
}

fn points(sim: &Sim) -> Vec<Vec3> {
    sim.positions()
        .iter()
        .chain(sim.yarn_nodes())
        .copied()
        .collect()
}

fn compare(text: &str) {
    let start = points(&sim(text, -9.81, &[]));
    let (exact, bytes) = moved(text, 1.0);
    let (free, least) = moved(text, 6.0);
    let distance = |a: &[Vec3], b: &[Vec3]| -> f64 {
        a.iter()
            .zip(b)
            .map(|(a, b)| (a - b).norm_squared())
            .sum::<f64>()
            .sqrt()
    };
    let error = distance(&free, &exact) / distance(&start, &exact);
    println!("error {error:.1e}, {bytes} and {least} bytes");
    assert!(error < 5e-3, "{error}");
    assert!(least < bytes, "{bytes} {least}");
}

#[test]
fn yarns_move_as_by_exact_factors() {
    compare(&knit("stockinette", 4));
}

/// Turned on and off while the simulation lives: matrix and motion are those of one that never had it.
#[test]
fn it_goes_without_a_matrix_and_back() {
    let motion = |kinds: &[f64]| {
        let mut sim = sim(&knit("stockinette", 4), -9.81, &[]);
        for kind in kinds {
            sim.set_number("solver.linear.kind", *kind).expect("kind");
        }
        for _ in 0..3 {
            let _ = sim.step(1e-3).expect("step");
        }
        (points(&sim), sim.info().bytes)
    };
    assert_eq!(motion(&[]), motion(&[6.0, 0.0]));
}

/// Nodes that ride on triangles, and triangles.
#[test]
fn mixed_cloth_moves_as_by_exact_factors() {
    let weave = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025, "young": 1e7}"#;
    let text = patch(
        weave,
        0.012,
        0.012,
        "[[-1, -1], [0.006, -1], [0.006, 1], [-1, 1]]",
    );
    compare(&text.replace(r#""yarns""#, r#""density": 0.3, "yarns""#));
}
