//! Knits that are sewn to themselves around a body, every yarn simulated.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome, Sim};
use toile::sim_scene::build;

const LOOP: f64 = 0.01;
const LIMB: f64 = 0.018;

/// Two panels of a knit around a limb, sewn along both sides, at rest without weight.
fn band(structure: &str) -> Sim {
    let (width, height) = (6.4 * LOOP, (8.5 * 0.85 + 0.18) * LOOP);
    let panel = |name: &str, sign: f64, turn: f64| {
        format!(
            r#"{{"name": "{name}", "fabric": "knit", "vertices": [[0, 0], [{width}, 0], [{width}, {height}], [0, {height}]],
                "placement": {{"translation": [{}, {}, {}], "rotation_deg": [0, {turn}, 0]}},
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}"#,
            -sign * 0.5 * width,
            -0.5 * height,
            sign * 1.4 * LIMB
        )
    };
    let whole = |name: &str| {
        format!(r#"{{"panel": "{name}", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}}"#)
    };
    let text = format!(
        r#"{{"toile": 1, "garment": {{"toile_garment": 1, "name": "band", "edge_length": {edge},
            "panels": [{}, {}],
            "fabrics": [{{"name": "knit", "density": 1, "membrane": {{"warp": 100, "weft": 100, "shear": 20, "coupling": 0}},
                "yarns": {{"knit": "{structure}", "loop_width": {LOOP}, "radius": {radius}, "bending": 0.004, "wrapping": 0.012}}}}],
            "seams": [{{"a": ["front", 1], "b": ["back", 3]}}, {{"a": ["front", 3], "b": ["back", 1]}}],
            "blend_regions": [{}, {}]}},
            "gravity": [0, 0, 0], "numbers": {{"solver.drape.force_tolerance": 1e-4}},
            "bodies": [{{"name": "limb", "shape": "capsule", "radius": {LIMB}, "half_length": 0.1,
                "contact": {{"thickness": 0.003}}}}]}}"#,
        panel("front", 1.0, 0.0),
        panel("back", -1.0, 180.0),
        whole("front"),
        whole("back"),
        edge = 1.5 * LOOP,
        radius = 0.25 * LOOP,
    );
    let mut sim = build(&Scene::from_json(&text, None).unwrap()).unwrap();
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).unwrap();
    println!(
        "{structure}: {} nodes, {} Newton iterations, seams open by {:.1e} m, gap {:.1e} m",
        sim.info().yarn_nodes,
        report.newton_iterations,
        report.max_seam_gap,
        report.min_gap
    );
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    assert!(report.max_seam_gap < 0.25 * LOOP, "{report:?}");
    assert!(report.min_gap > 0.0, "{report:?}");
    sim
}

/// How much farther from the limb's axis the ends of a band are than its middle, mean [m].
fn roll(sim: &Sim) -> f64 {
    let mesh = sim.yarns().unwrap();
    let height = mesh.uv.iter().fold(0.0_f64, |h, p| h.max(p.y));
    let mean = |from: f64, to: f64| {
        let list = mesh.uv.iter().zip(sim.yarn_nodes());
        let rows = list.filter(|(p, _)| {
            let away = p.y.min(height - p.y) / LOOP;
            (from..to).contains(&away)
        });
        let radii: Vec<f64> = rows.map(|(_, x)| x.x.hypot(x.z)).collect();
        radii.iter().sum::<f64>() / radii.len() as f64
    };
    mean(0.0, 0.6) - mean(2.5, 9.0)
}

/// Stockinette rolls outwards at its ends, off the limb; purled, the limb keeps it from rolling inwards.
#[test]
fn a_knitted_band_is_sewn_around_a_limb_and_rolls_at_its_ends() {
    let [jersey, purled] = ["stockinette", "reverse stockinette"].map(|s| roll(&band(s)));
    println!("ends stand out by {jersey:.1e} m, purled by {purled:.1e} m");
    // a radius of the yarn
    assert!(jersey > 0.25 * LOOP, "{jersey}");
    assert!(purled < 0.1 * LOOP, "{purled}");
}
