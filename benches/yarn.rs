//! Knits in motion and at rest, every yarn simulated.
//!
//! Swatches of the sweater's jersey (loops of 3 mm, radius 0.75 mm) hang from their top course. After 20 steps
//! of 1 ms out of the flat layout, 50 more are counted. Prints for each size and step: Newton iterations a step,
//! microseconds per node and step by the clock and of processors, those per node and Newton iteration, and per node and linear one, seconds per
//! simulated second by the clock, bytes per node with the matrix and its factor, and the exponent of cost against nodes;
//! and the distance of the motion after 20 counted steps to that solved 30 times as exactly, over the way moved. Then swatches
//! without weight that relax from their layout to a residual of 1e-5 N.
//! Arguments: `--threads N`; `--quick` leaves out the larger sizes; `--sweater` takes instead, alone, a swatch with the loops of the
//! sweater of Cirio et al. 2017 (56 000, 224 000 nodes), and counts its first [`FIRST`] steps out of the flat layout.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{cpu, exponent};
use std::time::Instant;
use toile::math::Vec3;
use toile::pattern::import::garment_from_json;
use toile::sim::{DrapeOptions, Sim, SimOptions};

const W: f64 = 0.003;
const H: f64 = 0.85 * W;
const WARM: usize = 20;
const COUNTED: usize = 50;
/// Steps of the sweater.
const FIRST: usize = 3;
/// Loops in a row and a column of a square with as many as the sweater.
const SWEATER: usize = 237;

fn swatch(loops: usize, gravity: f64) -> Sim {
    let n = loops as f64;
    let (width, height) = ((n + 0.4) * W, (n + 0.5) * H + 0.18 * W);
    let text = format!(
        r#"{{"toile_garment": 1, "name": "swatch", "edge_length": {},
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{width}, 0], [{width}, {height}], [0, {height}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "yarns": {{"preset": "jersey"}}}}],
            "blend_regions": [{{"panel": "p", "polygon": [[-1, -1], [9, -1], [9, 9], [-1, 9]]}}]}}"#,
        width / 8.0
    );
    let garment = garment_from_json(&text, None).expect("garment");
    let options = SimOptions {
        gravity: Some([0.0, gravity, 0.0]),
        settings: common::settings(),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("sim");
    if gravity != 0.0 {
        let mesh = sim.yarns().expect("yarns");
        let top: Vec<u32> = (0..mesh.uv.len() as u32)
            .filter(|&k| mesh.uv[k as usize].y > height - H)
            .collect();
        sim.pin_yarn_nodes(&top, None).expect("pins");
    }
    sim
}

/// Distance of two motions from the same start, over the way moved, root mean squares.
fn apart(start: &[Vec3], a: &[Vec3], b: &[Vec3]) -> f64 {
    let sum = |p: &[Vec3], q: &[Vec3]| -> f64 {
        p.iter().zip(q).map(|(p, q)| (p - q).norm_squared()).sum()
    };
    (sum(a, b) / sum(start, b)).sqrt()
}

fn motion(loops: usize, dt: f64) -> Option<(f64, f64)> {
    let mut sim = swatch(loops, -9.81);
    for _ in 0..WARM {
        sim.step(1e-3).ok()?;
    }
    let start = sim.yarn_nodes().to_vec();
    let saved = sim.save().expect("snapshot");
    let mut exact = swatch(loops, -9.81);
    let error = exact.restore(&saved).ok().and_then(|()| {
        exact
            .set_number("yarn.relative_velocity", 1e-3 / 30.0)
            .ok()?;
        let mut fast = swatch(loops, -9.81);
        fast.restore(&saved).ok()?;
        for _ in 0..20 {
            fast.step(dt).ok()?;
            exact.step(dt).ok()?;
        }
        Some(apart(&start, fast.yarn_nodes(), exact.yarn_nodes()))
    });
    let (clock, begin) = (Instant::now(), cpu());
    let (mut newton, mut linear) = (0, 0);
    for _ in 0..COUNTED {
        let report = sim.step(dt).ok()?;
        newton += report.newton_iterations;
        linear += report.linear_iterations;
    }
    let (clock, seconds) = (clock.elapsed().as_secs_f64(), cpu() - begin);
    let info = sim.info();
    let nodes = info.yarn_nodes as f64;
    let each = |seconds: f64, times: f64| 1e6 * seconds / nodes / times;
    let steps = COUNTED as f64;
    let text = match error {
        Some(error) => format!("{error:9.1e}"),
        None => "      none".to_owned(),
    };
    println!(
        "{loops:5} {:7} {:8} {:5.0} {:7.1} {:7.1} {:8.1} {:8.1} {:9.1} {:9.2} {:9.1} {:7} {text}",
        info.yarn_nodes,
        info.unknowns,
        1e3 * dt,
        newton as f64 / steps,
        linear as f64 / steps,
        each(clock, steps),
        each(seconds, steps),
        each(seconds, newton as f64),
        each(seconds, linear as f64),
        clock / (steps * dt),
        (info.bytes + info.factor_bytes) / info.yarn_nodes,
    );
    Some((nodes, seconds))
}

/// The first steps of as many loops as a sweater has, one line for each.
fn sweater() {
    let begin = Instant::now();
    let mut sim = swatch(SWEATER, -9.81);
    let nodes = sim.info().yarn_nodes;
    println!(
        "{nodes} nodes laid in {:.1} s",
        begin.elapsed().as_secs_f64()
    );
    println!("step substeps Newton linear  us/node  us/node bytes/");
    println!("                               clock      CPU   node");
    for step in 1..=FIRST {
        let (begin, used) = (Instant::now(), cpu());
        let report = sim.step(1e-3).expect("a step");
        let each = |seconds: f64| 1e6 * seconds / nodes as f64;
        let info = sim.info();
        println!(
            "{step:4} {:8} {:6} {:6} {:8.1} {:8.1} {:6}",
            report.substeps,
            report.newton_iterations,
            report.linear_iterations,
            each(begin.elapsed().as_secs_f64()),
            each(cpu() - used),
            (info.bytes + info.factor_bytes) / nodes,
        );
    }
}

fn main() {
    let given = |name: &str| std::env::args().any(|a| a == name);
    if given("--sweater") {
        return sweater();
    }
    let quick = given("--quick");
    let sizes: &[usize] = if quick { &[8, 16] } else { &[8, 16, 32, 64] };
    println!(
        "loops   nodes unknowns dt/ms  Newton  linear  us/node  us/node   us/node   us/node  clock s  bytes/  error"
    );
    println!(
        "                              a step  a step    clock      CPU  a Newton  a linear  a sim s    node"
    );
    for dt in [1e-3, 5e-3, 1e-2] {
        let points: Vec<(f64, f64)> = sizes.iter().filter_map(|&n| motion(n, dt)).collect();
        println!("cost ~ nodes^{:.2}", exponent(&points));
    }
    println!("\nloops   nodes Newton  CPU s residual outcome");
    for &loops in &sizes[..sizes.len() - 1] {
        let mut sim = swatch(loops, 0.0);
        let begin = cpu();
        let options = DrapeOptions {
            force_tolerance: 1e-5,
            max_steps: 10_000,
        };
        let report = sim.drape(&options, &mut |_| true).expect("drape");
        println!(
            "{loops:5} {:7} {:6} {:6.1} {:8.1e} {:?}",
            sim.info().yarn_nodes,
            report.newton_iterations,
            cpu() - begin,
            report.residual,
            report.outcome
        );
    }
}
