//! Regions of yarns that come, move and go while a simulation lives.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::math::{Vec2, Vec3};
use toile::pattern::BlendRegion;
use toile::pattern::import::garment_from_json;
use toile::sim::{Sim, SimOptions};

const LONG: f64 = 0.06;
const WIDE: f64 = 0.016;

/// A strip of a weave, one yarn to a millimetre, and of triangles like it.
fn strip() -> Sim {
    let text = format!(
        r#"{{"toile_garment": 1, "name": "strip", "edge_length": 4e-3,
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{LONG}, 0], [{LONG}, {WIDE}], [0, {WIDE}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "density": 0.3,
                "membrane": {{"warp": 1963.5, "weft": 1963.5, "shear": 40, "coupling": 0}},
                "bending": {{"warp": 9.2e-6, "weft": 9.2e-6}},
                "yarns": {{"weave": "plain", "warp_pitch": 1e-3, "radius": 0.25e-3,
                    "young": 1e7, "shear": 1.6e5, "density": 1.5e-4, "bending": 4.69e-2}}}}]}}"#
    );
    let garment = garment_from_json(&text, None).expect("garment");
    let options = SimOptions {
        gravity: Some([0.0, 0.0, -9.81]),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("sim");
    let held: Vec<u32> = (0..sim.positions().len() as u32)
        .filter(|v| sim.vertex_uv()[*v as usize].x < 1e-9)
        .collect();
    sim.pin(&held, None).expect("pin");
    sim
}

fn rectangle(u: [f64; 2], rings: u32) -> Vec<BlendRegion> {
    let polygon = vec![
        Vec2::new(u[0], -1.0),
        Vec2::new(u[1], -1.0),
        Vec2::new(u[1], 1.0),
        Vec2::new(u[0], 1.0),
    ];
    vec![BlendRegion { panel: 0, polygon, rings }]
}

fn momentum(sim: &Sim) -> Vec3 {
    let state = sim.checkpoint();
    state.velocities.iter().zip(sim.point_masses()).map(|(v, m)| v * m).sum()
}

fn energy(sim: &Sim) -> f64 {
    let report = sim.report().expect("report");
    report.kinetic_energy + report.potential_energy
}

#[test]
fn explore() {
    for rings in [0, 1] {
        let mut sim = strip();
        for _ in 0..40 {
            sim.step(2e-3).expect("step");
        }
        let tell = |sim: &Sim, what: &str| {
            let p = momentum(sim);
            let e = sim.energies().unwrap();
            println!("{what}: momentum {p:?} mass {:.6e} energy {:.6e} {e:?}", sim.point_masses().iter().sum::<f64>(), energy(sim));
        };
        tell(&sim, "before");
        let x = sim.positions().to_vec();
        println!("{:?}", sim.set_blend_regions(rectangle([0.0199, 0.0401], rings)));
        println!("info {:?}", sim.info());
        assert_eq!(x, sim.positions());
        tell(&sim, "on");
        for _ in 0..10 {
            let r = sim.step(2e-3).expect("step");
            println!("{:?} newton {} sub {}", r.outcome, r.newton_iterations, r.substeps);
        }
        tell(&sim, "10 steps");
        println!("{:?}", sim.set_blend_regions(rectangle([0.0239, 0.0501], rings)));
        tell(&sim, "moved");
        for _ in 0..10 {
            let r = sim.step(2e-3).expect("step");
            println!("{:?} newton {} sub {}", r.outcome, r.newton_iterations, r.substeps);
        }
        tell(&sim, "10 steps");
        println!("{:?}", sim.set_blend_regions(Vec::new()));
        tell(&sim, "off");
        for _ in 0..5 {
            let r = sim.step(2e-3).expect("step");
            println!("{:?} newton {} sub {}", r.outcome, r.newton_iterations, r.substeps);
        }
        tell(&sim, "5 steps");
    }
}
