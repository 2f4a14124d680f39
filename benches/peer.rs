//! The peer scene: a square sheet of 1 m and 0.2 kg/m^2 falls from 5 cm above a fixed sphere of
//! radius 0.3 m, friction 0.3, no self-contact; 40 x 40 vertices for 2 s, 100 x 100 for 1 s.
//!
//! Prints processor seconds per simulated second on one thread, the largest edge strain on the way and at
//! the end, and the distance at t = 1 s (RMS over all vertices) to toile's own solution with
//! dt = 0.5 ms, for solutions of every step to the velocity tolerance ("full") and for the settings of
//! quicker previews ("quick" and "rough"). The skirt buckles, and where its folds come to lie depends on everything:
//! the rows "start" repeat a run from positions that differ by a micrometre, and print the distance
//! that this alone makes. MuJoCo 4.0's edge-equality flex takes 7.2 and 59 processor seconds per
//! simulated second on these grids, with 24 % and 162 % strain.
//!
//! `--quick` leaves out the larger grid, `--no-reference` the solutions with dt = 0.5 ms.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{Random, cpu};
use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::{BendingModel, Fabric, Garment};
use toile::sim::{ContactSettings, Settings, Sim, SimOptions};
use toile::tri::grid::{SheetPattern, rectangle, structured_sheet};

/// How well each step is solved.
#[derive(Clone, Copy, PartialEq)]
enum Solve {
    Full,
    Quick,
    Rough,
}

fn scene(n: usize, solve: Solve, disturbance: f64) -> Sim {
    let mut mesh =
        structured_sheet(1.0, 1.0, n - 1, n - 1, SheetPattern::Alternating).expect("mesh");
    let mut random = Random::new(1);
    for p in &mut mesh.placed {
        let offset = Vec3::from_fn(|_, _| random.next() - 0.5) * disturbance;
        *p = Vec3::new(p.x - 0.5, 0.35, p.y - 0.5) + offset;
    }
    let fabric = Fabric {
        density: 0.2,
        warp: 1000.0,
        weft: 1000.0,
        shear: 200.0,
        bending_warp: 1e-5,
        bending_weft: 1e-5,
        bending_model: BendingModel::Quadratic,
        ..Fabric::default()
    };
    let garment = Garment {
        fabrics: vec![fabric],
        edge_length: 0.02,
        panels: vec![rectangle("sheet", 1.0, 1.0)],
        ..Garment::default()
    };
    let mut settings = Settings {
        self_contact: 0.0,
        linear_kind: 3.0,
        linear_tolerance: 1e-2,
        ..Settings::default()
    };
    if solve != Solve::Full {
        settings.newton_relative_tolerance = if solve == Solve::Quick { 0.005 } else { 0.02 };
        settings.linear_tolerance = 5e-2;
    }
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
    last_strain: f64,
    newton: u64,
    linear: u64,
    substeps: u64,
    at_one: Vec<Vec3>,
}

fn run(mut sim: Sim, duration: f64, steps: usize) -> Run {
    let dt = duration / steps as f64;
    let started = cpu();
    let mut out = Run {
        cpu: 0.0,
        strain: 0.0,
        last_strain: 0.0,
        newton: 0,
        linear: 0,
        substeps: 0,
        at_one: Vec::new(),
    };
    for k in 1..=steps {
        let report = sim.step(dt).expect("step");
        out.last_strain = report.max_edge_strain;
        out.strain = out.strain.max(report.max_edge_strain);
        out.newton += report.newton_iterations;
        out.linear += report.linear_iterations;
        out.substeps += report.substeps;
        if k == (1.0 / dt).round() as usize {
            out.at_one = sim.positions().to_vec();
        }
    }
    out.cpu = (cpu() - started) / duration;
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

fn row(n: usize, what: &str, dt: f64, r: &Run, distance: Option<f64>) {
    let distance = distance.map_or("-".into(), |d| format!("{:.2}", 1e3 * d));
    println!(
        "{n:>4}^2 {what:<6} {:>6.2} {:>8.2} {:>8.2} {:>8.2} {distance:>8} {:>7} {:>7} {:>8}",
        1e3 * dt,
        r.cpu,
        100.0 * r.strain,
        100.0 * r.last_strain,
        r.newton,
        r.linear,
        r.substeps
    );
}

fn main() {
    let has = |name: &str| std::env::args().any(|a| a == name);
    let cases: &[(usize, f64)] = if has("--quick") {
        &[(40, 2.0)]
    } else {
        &[(40, 2.0), (100, 1.0)]
    };
    println!(
        "{:>6} {:<6} {:>6} {:>8} {:>8} {:>8} {:>8} {:>7} {:>7} {:>8}",
        "grid",
        "solve",
        "dt ms",
        "cpu s/s",
        "strain %",
        "at end %",
        "RMS mm",
        "newton",
        "linear",
        "substeps"
    );
    for &(n, duration) in cases {
        let reference = (!has("--no-reference")).then(|| {
            let r = run(scene(n, Solve::Full, 0.0), 1.0, 2000);
            row(n, "full", 5e-4, &r, None);
            r.at_one
        });
        for (name, solve, rate) in [
            ("full", Solve::Full, 100.0),
            ("quick", Solve::Quick, 100.0),
            ("quick", Solve::Quick, 50.0),
            ("quick", Solve::Quick, 30.0),
            ("rough", Solve::Rough, 20.0),
        ] {
            let steps = (duration * rate) as usize;
            let r = run(scene(n, solve, 0.0), duration, steps);
            let distance = reference.as_ref().map(|x| rms(&r.at_one, x));
            row(n, name, 1.0 / rate, &r, distance);
            if solve == Solve::Full || rate == 30.0 {
                let other = run(scene(n, solve, 1e-6), duration, steps);
                row(
                    n,
                    "start",
                    1.0 / rate,
                    &other,
                    Some(rms(&r.at_one, &other.at_one)),
                );
            }
        }
    }
}
