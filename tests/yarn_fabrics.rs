//! What knitted fabrics do when they relax to a residual below 1e-5 N: patches of 16 by 16 loops.
//!
//! The curl of a rim is the angle by which the line of wales (or courses) turns over its outer loops, towards
//! the front, from the direction that it has further in. Whole-rim offsets lose meaning once a patch rolls up; so the
//! other two rims are held straight.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::math::Vec3;
use toile::pattern::import::garment_from_json;
use toile::sim::{DrapeOptions, Outcome, Settings, Sim, SimOptions};

const LOOPS: usize = 16;
const W: f64 = 0.003;
const H: f64 = 0.85 * W;

#[derive(Clone, Copy, PartialEq)]
enum Held {
    Nothing,
    /// The bottom and the top.
    Ends,
    /// The left and the right.
    Sides,
}

/// A relaxed patch of a knit structure.
fn relaxed(structure: &str, held: Held) -> Sim {
    let n = LOOPS as f64;
    // the finished size of so many wales and courses
    let (width, height) = ((n + 0.4) * W, (n + 0.5) * H + 0.18 * W);
    let text = format!(
        r#"{{"toile_garment": 1, "name": "patch", "edge_length": 0.01,
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{width}, 0], [{width}, {height}], [0, {height}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "yarns": {{"preset": "jersey", "knit": "{structure}"}}}}],
            "blend_regions": [{{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}}]}}"#
    );
    let garment = garment_from_json(&text, None).expect("garment");
    let options = SimOptions {
        gravity: Some([0.0; 3]),
        settings: Settings::default(),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("sim");
    let mesh = sim.yarns().expect("yarns");
    let rim: Vec<u32> = (0..mesh.uv.len() as u32)
        .filter(|&k| {
            let p = mesh.uv[k as usize];
            match held {
                Held::Nothing => false,
                Held::Ends => p.y < H || p.y > height - H,
                Held::Sides => p.x < W || p.x > width - W,
            }
        })
        .collect();
    if !rim.is_empty() {
        sim.pin_yarn_nodes(&rim, None).expect("pins");
    }
    let options = DrapeOptions {
        force_tolerance: 1e-5,
        max_steps: 6000,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    println!(
        "{structure}: {:?}, residual {:.1e} N after {} Newton iterations",
        report.outcome, report.residual, report.newton_iterations
    );
    assert_eq!(report.outcome, Outcome::Converged, "{structure}");
    assert!(report.residual < 1e-5);
    sim
}

/// Mean place of the nodes of wale (or course) `k` in the middle third of the other direction.
fn line(sim: &Sim, across: bool, k: usize) -> Vec3 {
    let mesh = sim.yarns().expect("yarns");
    let third = LOOPS as f64 / 3.0;
    let inside: Vec<Vec3> = mesh
        .uv
        .iter()
        .zip(sim.yarn_nodes())
        .filter(|(p, _)| {
            let (wale, course) = (p.x / W, p.y / H);
            let (own, other) = if across {
                (wale, course)
            } else {
                (course, wale)
            };
            own >= k as f64 && own < k as f64 + 1.0 && other > third && other < 2.0 * third
        })
        .map(|(_, x)| *x)
        .collect();
    assert!(!inside.is_empty());
    inside.iter().sum::<Vec3>() / inside.len() as f64
}

/// Turning of the outer two loops of both rims towards the front [degrees], mean; `across` for the sides.
fn curl(sim: &Sim, across: bool) -> f64 {
    let along = if across { Vec3::y() } else { Vec3::x() };
    let mut sum = 0.0;
    for first in [true, false] {
        let at = |k: usize| line(sim, across, if first { k } else { LOOPS - 1 - k });
        let (inner, outer) = (at(3) - at(6), at(0) - at(2));
        // the front lies to the left of a line that goes to the right, seen along the other direction
        let mut front = along.cross(&inner);
        if front.z < 0.0 {
            front = -front;
        }
        let front = front / front.norm();
        let outer = outer - along * outer.dot(&along);
        let turned = outer.dot(&front).atan2(outer.dot(&inner) / inner.norm());
        sum += 0.5 * turned.to_degrees();
    }
    sum
}

/// Jersey rolls its top and bottom to the front and its sides to the back.
#[test]
fn stockinette_curls_its_ends_to_the_front_and_its_sides_to_the_back() {
    let ends = curl(&relaxed("stockinette", Held::Sides), false);
    let sides = curl(&relaxed("stockinette", Held::Ends), true);
    println!("stockinette: ends {ends:.0} degrees to the front, sides {sides:.0}");
    assert!(ends > 20.0, "{ends}");
    assert!(sides < -10.0, "{sides}");
}

/// All purl is jersey seen from the back.
#[test]
fn purl_jersey_curls_the_other_way() {
    let ends = curl(&relaxed("reverse stockinette", Held::Sides), false);
    let sides = curl(&relaxed("reverse stockinette", Held::Ends), true);
    println!("reverse: ends {ends:.0} degrees to the front, sides {sides:.0}");
    assert!(ends < -20.0, "{ends}");
    assert!(sides > 10.0, "{sides}");
}

/// Rows of knit and purl in balance hold each other flat.
#[test]
fn balanced_garter_lies_flat() {
    let ends = curl(&relaxed("garter", Held::Sides), false);
    println!("garter: ends {ends:.1} degrees to the front");
    assert!(ends.abs() < 15.0, "{ends}");
}

/// Wales of knit and purl fold: a rib draws in.
#[test]
fn rib_draws_in() {
    let sim = relaxed("rib 2x2", Held::Nothing);
    // between wales that are alike, and so lie at the same height
    let (from, to) = (2, LOOPS - 2);
    let width = (line(&sim, true, to) - line(&sim, true, from)).norm();
    let part = width / ((to - from) as f64 * W);
    println!("rib 2x2: {part:.3} of its laid width");
    assert!(part < 0.85, "{part}");
}
