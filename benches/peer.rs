//! The peer scene: a square sheet of 1 m and 0.2 kg/m^2 falls from 5 cm above a fixed sphere of
//! radius 0.3 m, friction 0.3, no self-contact; 40 x 40 vertices for 2 s, 100 x 100 for 1 s.
//!
//! Prints CPU seconds per simulated second for several step sizes, the largest edge strain, and the
//! distance at t = 1 s (RMS over all vertices) to toile's own solution with dt = 0.5 ms. MuJoCo 4.0's
//! edge-equality flex takes 7.2 and 59 CPU seconds per simulated second with 24 % and 162 % strain.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

use std::time::Instant;
use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::{Fabric, Garment};
use toile::sim::{ContactSettings, Settings, Sim, SimOptions};
use toile::tri::grid::{SheetPattern, rectangle, structured_sheet};

fn scene(n: usize) -> Sim {
    let mut mesh =
        structured_sheet(1.0, 1.0, n - 1, n - 1, SheetPattern::Alternating).expect("mesh");
    for p in &mut mesh.placed {
        *p = Vec3::new(p.x - 0.5, 0.35, p.y - 0.5);
    }
    let fabric = Fabric {
        density: 0.2,
        ..Fabric::default()
    };
    let garment = Garment {
        fabrics: vec![fabric],
        edge_length: 0.02,
        panels: vec![rectangle("sheet", 1.0, 1.0)],
        ..Garment::default()
    };
    let settings = Settings {
        self_contact: 0.0,
        ..Settings::default()
    };
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    let mut sim = Sim::from_mesh(&garment, mesh, &options).expect("scene");
    let body = Body::sphere(0.3).expect("sphere");
    let contact = ContactSettings {
        friction: 0.3,
        ..ContactSettings::default()
    };
    sim.add_body(&body, &contact).expect("body");
    sim
}

struct Run {
    cpu: f64,
    strain: f64,
    newton: u64,
    substeps: u64,
    at_one: Vec<Vec3>,
}

fn run(n: usize, duration: f64, dt: f64) -> Run {
    let mut sim = scene(n);
    let steps = (duration / dt).round() as usize;
    let clock = Instant::now();
    let mut out = Run {
        cpu: 0.0,
        strain: 0.0,
        newton: 0,
        substeps: 0,
        at_one: Vec::new(),
    };
    for k in 1..=steps {
        let report = sim.step(dt).expect("step");
        out.strain = out.strain.max(report.max_edge_strain);
        out.newton += report.newton_iterations;
        out.substeps += report.substeps;
        if k == (1.0 / dt).round() as usize {
            out.at_one = sim.positions().to_vec();
        }
    }
    out.cpu = clock.elapsed().as_secs_f64() / duration;
    out
}

fn rms(a: &[Vec3], b: &[Vec3]) -> f64 {
    (a.iter()
        .zip(b)
        .map(|(p, q)| (p - q).norm_squared())
        .sum::<f64>()
        / a.len() as f64)
        .sqrt()
}

fn main() {
    let quick = std::env::args().any(|a| a == "--quick");
    let cases: &[(usize, f64)] = if quick {
        &[(40, 1.0)]
    } else {
        &[(40, 2.0), (100, 1.0)]
    };
    println!("  grid      dt   s per s   strain %   RMS to dt 0.5 ms [mm]   newton  substeps");
    for &(n, duration) in cases {
        let reference = run(n, 1.0, 5e-4);
        println!(
            "{n:>4}^2  0.5 ms  {:>8.2}  {:>8.2}                       -  {:>7}  {:>8}",
            reference.cpu,
            100.0 * reference.strain,
            reference.newton,
            reference.substeps
        );
        for dt in [1e-3, 2e-3, 4e-3, 5e-3, 1e-2] {
            let r = run(n, duration, dt);
            println!(
                "{n:>4}^2  {:>4.1} ms  {:>8.2}  {:>8.2}                {:>8.2}  {:>7}  {:>8}",
                1e3 * dt,
                r.cpu,
                100.0 * r.strain,
                1e3 * rms(&r.at_one, &reference.at_one),
                r.newton,
                r.substeps
            );
        }
    }
}
