//! Fabrics of yarns in stretch tests: force against length, loading and unloading, in equilibrium at every length.
//!
//! Patches of 16 by 16 loops of the sweater's yarn (loops of 3 mm, radius 0.75 mm, friction 0.3), their grips as wide as laid:
//! rib 2x2 along its courses, jersey along courses and wales; and a strip of plain weave on the bias. Prints for
//! each length the force, the residual and the Newton iterations. Then openwork at rest: the hole of a yarn-over, the scallops of
//! feather and fan.
//! Arguments: `--quick` for 8 by 8 loops, `--lace` for the openwork alone, `--plot FILE.svg` for a picture of the curves of the knits.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

#[path = "../tests/yarn_pull/mod.rs"]
mod yarn_pull;

use toile::readout::plot::{Curve, Plot};
use yarn_pull::lace::{self, openings, scallops};
use yarn_pull::{Reading, Swatch, stretch_at};

/// Up and down.
const RIB: &[f64] = &[0.8, 0.9, 1.0, 1.1, 1.15, 1.2, 1.3, 1.2, 1.1, 1.0];
const COURSES: &[f64] = &[1.0, 1.05, 1.1, 1.15, 1.2, 1.25, 1.3, 1.2, 1.1, 1.0];
const WALES: &[f64] = &[1.0, 1.05, 1.1, 1.15, 1.2, 1.1, 1.0];
const BIAS: &[f64] = &[1.0, 1.05, 1.1, 1.2, 1.25, 1.3, 1.2, 1.1, 1.0];
/// Tension at which stretches are compared [N/m].
const TENSION: f64 = 100.0;

/// Pulls a swatch; its curve, and the readings.
fn run(name: &str, mut swatch: Swatch, width: f64, path: &[f64]) -> (Curve, Vec<Reading>) {
    println!(
        "\n{name}, {:.1} mm long\nstretch   force [N]  residual  Newton",
        1e3 * swatch.laid
    );
    let mut all = Vec::new();
    for s in path {
        let reading = swatch.pull(*s);
        println!(
            "{:7.3} {:11.4e} {:9.1e} {:7}",
            reading.stretch, reading.force, reading.residual, reading.newton
        );
        all.push(reading);
    }
    let points = all.iter().map(|r| [r.stretch, r.force / width]).collect();
    let curve = Curve {
        name: name.to_owned(),
        points,
    };
    (curve, all)
}

/// Openwork at rest between two grips: what a yarn-over opens, and how feather and fan scallops its edges.
fn lace(n: usize) {
    for hole in [false, true] {
        let mut swatch = lace::eyelet(n, hole);
        let reading = swatch.pull(1.0);
        let areas = openings(&swatch.sim, Swatch::knit_size(n, n));
        println!(
            "\njersey, yarn-over {hole}: largest openings {:.2?} mm2, residual {:.1e} N, Newton {}",
            areas.iter().take(2).map(|a| 1e6 * a).collect::<Vec<_>>(),
            reading.residual,
            reading.newton
        );
    }
    for fan in [false, true] {
        let mut swatch = lace::feather_and_fan(n, fan);
        let (residual, newton) = swatch.rest();
        println!(
            "36 by {n} loops, feather and fan {fan}: scallops of {:.4} of their length, residual {residual:.1e} N, Newton {newton}",
            scallops(&swatch.sim)
        );
    }
}

fn main() {
    let mut args = std::env::args().skip(1);
    let (mut quick, mut open, mut plot) = (false, false, None);
    while let Some(arg) = args.next() {
        match arg.as_str() {
            "--quick" => quick = true,
            "--lace" => open = true,
            "--plot" => plot = args.next(),
            _ => {}
        }
    }
    let n = if quick { 8 } else { 16 };
    lace(n);
    if open {
        return;
    }
    let size = Swatch::knit_size(n, n);
    let knit = |chart: &str, axis| Swatch::knit(&format!("\"knit\": \"{chart}\""), n, n, axis);
    let rib = run("rib 2x2, courses", knit("rib 2x2", 0), size[1], RIB);
    let courses = run("jersey, courses", knit("stockinette", 0), size[1], COURSES);
    let wales = run("jersey, wales", knit("stockinette", 1), size[0], WALES);
    let a = stretch_at(&courses.1, TENSION * size[1]);
    let b = stretch_at(&wales.1, TENSION * size[0]);
    let ratio = (a - 1.0) / (b - 1.0);
    println!("\njersey at {TENSION} N/m: courses {a:.3}, wales {b:.3}, ratio {ratio:.2}");
    let weave = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.0003}"#;
    run(
        "plain weave, bias",
        Swatch::new(weave, [0.006, 0.018], 45.0, 1),
        0.006,
        BIAS,
    );
    if let Some(file) = plot {
        let picture = Plot {
            title: format!("Knits of {n} by {n} loops, pulled and let back"),
            x: "length over laid length".into(),
            y: "tension [N/m]".into(),
            log_x: false,
            log_y: true,
            curves: vec![rib.0, courses.0, wales.0],
        };
        std::fs::write(&file, picture.to_svg().expect("curves")).expect("file");
        println!("{file}");
    }
}
