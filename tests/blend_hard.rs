//! Blended rings where they are hard: tiny, many, touching, at pins, at seams, with triangles of any size.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::mixed_hard::{fall, garment, hold_corners, is_sound, make, weave};
use toile::error::Status;
use toile::sim::{DrapeOptions, Outcome};

fn ringed(text: &str, rings: u32) -> String {
    text.replace(r#""polygon""#, &format!(r#""rings": {rings}, "polygon""#))
}

/// Regions of any shape and number, with one to three rings, move on as one cloth.
#[test]
fn rings_around_regions_of_any_shape_stay_sound() {
    let fabric = weave(1e-3, 1.0);
    let cases: &[(&str, &[&str])] = &[
        (
            "middle",
            &["[[0.009, 0.009], [0.021, 0.009], [0.021, 0.021], [0.009, 0.021]]"],
        ),
        (
            "at a rim",
            &["[[-1, -1], [0.0101, -1], [0.0101, 1], [-1, 1]]"],
        ),
        (
            "at a corner that is held",
            &["[[-1, -1], [0.0151, -1], [0.0151, 0.0151], [-1, 0.0151]]"],
        ),
        (
            "two that may touch",
            &[
                "[[0.004, 0.004], [0.0151, 0.004], [0.0151, 0.0151], [0.004, 0.0151]]",
                "[[0.0149, 0.0149], [0.026, 0.0149], [0.026, 0.026], [0.0149, 0.026]]",
            ],
        ),
        (
            "all but a hole",
            &[
                "[[-1, -1], [1, -1], [1, 0.0101], [-1, 0.0101]]",
                "[[-1, 0.0199], [1, 0.0199], [1, 1], [-1, 1]]",
                "[[-1, -1], [0.0101, -1], [0.0101, 1], [-1, 1]]",
                "[[0.0199, -1], [1, -1], [1, 1], [0.0199, 1]]",
            ],
        ),
    ];
    for (what, regions) in cases {
        for rings in [1, 3] {
            let text = ringed(&garment(&fabric, 0.005, &[(0.0, regions)], ""), rings);
            let what = format!("{what}, {rings} rings");
            let sim = fall(&text, &what, 4);
            let info = sim.info();
            println!(
                "{what}: {} nodes, {} blended, {} carried, {} of {} triangles, |B^+| {:.1}",
                info.yarn_nodes,
                info.hybrid_nodes,
                info.carried_nodes,
                info.active_triangles,
                info.triangles,
                info.amplification
            );
            assert!(info.hybrid_nodes > 0 && info.active_triangles > 0, "{what}");
            assert!(sim.constraint_violation() <= 1e-10 * 0.03, "{what}");
        }
    }
}

/// Every single triangle may be the region, and its fabric may be a hundred times softer or stiffer than its yarns;
/// triangles of 1.25 to 30 pitches, those with too few nodes being refused by name.
#[test]
fn a_ring_around_one_triangle_stays_sound() {
    for (pitch, factor) in [
        (1e-3, 1.0),
        (4e-4, 1.0),
        (1e-3, 0.01),
        (1e-3, 100.0),
        (4e-3, 1.0),
        (9.6e-3, 1.0),
    ] {
        let fabric = weave(pitch, factor);
        let edge = 0.012;
        let plain = make(&garment(&fabric, edge, &[(0.0, &[])], ""), 0.0).expect("plain");
        let mut refused = 0;
        for (t, triangle) in plain.triangles().iter().enumerate().step_by(8) {
            let corners = triangle.map(|v| plain.vertex_uv()[v as usize]);
            let polygon: Vec<String> = (corners.iter())
                .map(|p| format!("[{}, {}]", p.x, p.y))
                .collect();
            let region = format!("[{}]", polygon.join(","));
            let text = ringed(&garment(&fabric, edge, &[(0.0, &[&region])], ""), 1);
            let what = format!("triangle {t}, pitch {pitch}, factor {factor}");
            match make(&text, -9.81) {
                Ok(_) => {
                    let sim = fall(&text, &what, 2);
                    assert_eq!(sim.info().active_triangles + 1, sim.info().triangles);
                    assert!(sim.info().amplification <= 30.0, "{what}");
                }
                Err(e) => {
                    assert!(pitch > 3e-3, "{what}: {e}");
                    assert_eq!(e.status, Status::Geometry, "{what}: {e}");
                    refused += 1;
                }
            }
        }
        println!("pitch {pitch}, factor {factor}: {refused} refused");
    }
}

/// A seam between blended cloth and others holds, however the region lies, and blended cloth comes to rest.
#[test]
fn seams_hold_beside_rings() {
    let fabric = weave(1e-3, 1.0);
    let near = "[[0.0149, -1], [1, -1], [1, 1], [0.0149, 1]]";
    let lower = "[[-1, -1], [1, -1], [1, 0.0151], [-1, 0.0151]]";
    let cases: &[(&str, &[&str], &[&str])] = &[
        ("beside the seam", &[near], &[]),
        ("across", &[lower], &[lower]),
        (
            "crosswise",
            &[lower],
            &["[[-1, 0.0149], [1, 0.0149], [1, 1], [-1, 1]]"],
        ),
    ];
    for (what, left, right) in cases {
        let seam = r#"{"a": ["p0", 1], "b": ["p1", 3]}"#;
        let text = garment(&fabric, 0.005, &[(0.0, left), (0.03, right)], seam);
        let mut sim = make(&ringed(&text, 1), -9.81).expect(what);
        hold_corners(&mut sim);
        for _ in 0..4 {
            let report = sim.step(5e-3).expect(what);
            assert!(report.max_seam_gap < 1e-3, "{what}: {report:?}");
        }
        is_sound(&sim, what);
    }
}

/// The bodiless drape of blended cloth ends at rest, with time steps of 0.1 ms to 20 ms before it.
#[test]
fn blended_cloth_comes_to_rest_after_steps_of_any_size() {
    let region = "[[0.009, 0.009], [0.021, 0.009], [0.021, 0.021], [0.009, 0.021]]";
    let text = ringed(
        &garment(&weave(1e-3, 1.0), 0.005, &[(0.0, &[region])], ""),
        1,
    );
    let mut sim = make(&text, -9.81).expect("sim");
    hold_corners(&mut sim);
    for dt in [1e-4, 1e-3, 5e-3, 0.02] {
        let _ = sim.step(dt).expect("step");
        is_sound(&sim, "step");
    }
    let options = DrapeOptions {
        force_tolerance: 1e-6,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    println!(
        "{:?} after {} Newton",
        report.outcome, report.newton_iterations
    );
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    is_sound(&sim, "rest");
}

/// What cannot be is refused by name: rings that differ, too many, nodes in rings held.
#[test]
fn rings_that_cannot_be_are_refused() {
    let fabric = weave(1e-3, 1.0);
    let half = "[[-1, -1], [0.0151, -1], [0.0151, 1], [-1, 1]]";
    let far = "[[0.0249, -1], [1, -1], [1, 1], [0.0249, 1]]";
    let text = garment(&fabric, 0.005, &[(0.0, &[half, far])], "");
    let error = make(&ringed(&text, 4), 0.0).err().expect("refused");
    assert!(error.message.contains("at most 3"), "{error}");
    let differs = text.replacen(r#""polygon""#, r#""rings": 2, "polygon""#, 1);
    let error = make(&differs, 0.0).err().expect("refused");
    assert_eq!(error.status, Status::Unsupported);
    assert!(error.message.contains("blend_regions[1]"), "{error}");
    let mut sim = make(&ringed(&text, 1), 0.0).expect("sim");
    let node = (0..sim.yarn_nodes().len() as u32)
        .find(|n| {
            sim.yarns()
                .is_some_and(|y| !y.is_whole(*n) && y.is_inside(*n))
        })
        .expect("blended");
    let error = sim.pin_yarn_nodes(&[node], None).expect_err("blended");
    assert!(error.message.contains("hybrid ring"), "{error}");
    let error = sim.set_number("blend.means", 1.0).expect_err("later");
    assert!(error.message.contains("when yarns come in"), "{error}");
}
