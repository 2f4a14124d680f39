//! Statics: a shirt from flat panels to rest at several resolutions, and the way back to rest after
//! a small change.
//!
//! First table, for the shipped T-shirt on the mannequin and, where `TOILE_DATA` names the folder,
//! for GarmentCode's T-shirt on a measured body: wall and processor seconds of the whole drape on
//! `threads` (first argument, 2) threads, Newton and linear iterations; then what the result is worth:
//! residual, largest seam gap, smallest gap to the body, edges through triangles of the garment or
//! the body, and how far a vertex moves
//! in a further simulated second. Memory is in bytes per vertex, without the factor and of the factor.
//! The exponent of cost against vertices is fitted over the rows.
//!
//! Second table: a sheet of 1 600 vertices at rest; one pin moves by a millimetre, or the sphere
//! under it does; milliseconds until it is at rest again (median of five), with the residual.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{cpu, exponent, median};
use std::path::Path;
use std::time::Instant;
use toile::body::{Body, mannequin};
use toile::math::{Vec3, topology};
use toile::pattern::import::garment_from_json;
use toile::pattern::{Fabric, Garment};
use toile::sim::{ContactSettings, DrapeOptions, Settings, Sim, SimOptions};
use toile::system::contact::crossing;
use toile::tri::grid::{SheetPattern, sheet_garment, structured_sheet};

const WHOLE: DrapeOptions = DrapeOptions {
    force_tolerance: 0.0,
    max_steps: 0,
};

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(p, q)| (p - q).norm())
        .fold(0.0, f64::max)
}

fn shirt(name: &str, garment: &Garment, body: &Body, edge: f64, threads: f64) -> (f64, f64) {
    let mut garment = garment.clone();
    garment.edge_length = edge;
    for panel in &mut garment.panels {
        panel.edge_length = None;
    }
    let settings = Settings {
        threads,
        ..Settings::default()
    };
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("garment");
    sim.add_body(body, &ContactSettings::default())
        .expect("body");
    let (used, clock) = (cpu(), Instant::now());
    let report = sim.drape(&WHOLE, &mut |_| true).expect("drape");
    let (wall, used) = (clock.elapsed().as_secs_f64(), cpu() - used);
    let info = sim.info();
    let glued = crossing::glued_pairs(sim.mesh());
    let own = crossing::crossings(sim.triangles(), sim.positions(), &glued, 1000).expect("search");
    let edges: Vec<_> = topology::edges(sim.triangles())
        .iter()
        .map(|e| e.map(|v| sim.positions()[v as usize]))
        .map(|[a, b]| (a, b))
        .collect();
    let crossings = own.len() + body.intersections(&edges).len();
    let rest = sim.positions().to_vec();
    for _ in 0..30 {
        sim.step(1.0 / 30.0).expect("step");
    }
    let moved = furthest(&rest, sim.positions());
    let n = info.vertices as f64;
    println!(
        "{name:<12} {:>6} {wall:>8.2} {used:>8.2} {:>7} {:>7}   {:>8.1e} {:>6.2} {:>6.2} {crossings:>6} {:>9.4} {:>8.0} {:>8.0}",
        info.vertices,
        report.newton_iterations,
        report.linear_iterations,
        report.residual,
        1e3 * report.max_seam_gap,
        1e3 * report.min_gap,
        1e3 * moved,
        info.bytes as f64 / n,
        info.factor_bytes as f64 / n,
    );
    (n, used)
}

fn shirts(threads: f64) {
    println!("a shirt from flat panels to rest, {threads} threads");
    println!(
        "{:<12} {:>6} {:>8} {:>8} {:>7} {:>7}   {:>8} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}",
        "garment",
        "vert.",
        "wall s",
        "cpu s",
        "newton",
        "linear",
        "residual",
        "seam",
        "gap",
        "cross.",
        "moves in",
        "bytes",
        "factor"
    );
    println!(
        "{:<12} {:>6} {:>8} {:>8} {:>7} {:>7}   {:>8} {:>6} {:>6} {:>6} {:>9} {:>8} {:>8}",
        "", "", "", "", "", "", "N", "mm", "mm", "", "1 s mm", "/vert.", "/vert."
    );
    let own = Path::new("examples/tshirt.json");
    let text = std::fs::read_to_string(own).expect("examples/tshirt.json");
    let garment = garment_from_json(&text, own.parent()).expect("garment");
    let body = mannequin::body(0.01).expect("mannequin");
    let edges = [0.024, 0.017, 0.012, 0.0085];
    let points: Vec<_> = edges
        .iter()
        .map(|e| shirt("tshirt", &garment, &body, *e, threads))
        .collect();
    println!("cpu seconds grow with vertices^{:.2}", exponent(&points));
    let Some(data) = std::env::var_os("TOILE_DATA") else {
        println!("gen_tshirt on mean_all: TOILE_DATA is not set");
        return;
    };
    let data = Path::new(&data);
    let text = std::fs::read_to_string(data.join("garmentcode/gen_tshirt_specification.json"))
        .expect("gen_tshirt");
    let garment = garment_from_json(&text, None).expect("garment");
    let body = Body::obj(&data.join("bodies/mean_all.obj"), 1.0, 0.0).expect("body");
    let points: Vec<_> = edges
        .iter()
        .map(|e| shirt("gen_tshirt", &garment, &body, *e, threads))
        .collect();
    println!("cpu seconds grow with vertices^{:.2}", exponent(&points));
}

/// A sheet of 40 x 40 vertices, hung at two corners or lying on a sphere.
fn sheet(on_sphere: bool) -> Sim {
    let mut mesh = structured_sheet(1.0, 1.0, 39, 39, SheetPattern::Alternating).expect("mesh");
    if on_sphere {
        for p in &mut mesh.placed {
            *p = Vec3::new(p.x - 0.5, 0.35, p.y - 0.5);
        }
    }
    let garment = sheet_garment(1.0, 1.0, 0.025, Fabric::default());
    let settings = Settings {
        self_contact: 0.0,
        ..Settings::default()
    };
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    let mut sim = Sim::from_mesh(&garment, mesh, &options).expect("sheet");
    if on_sphere {
        let body = Body::sphere(0.3).expect("sphere");
        sim.add_body(&body, &ContactSettings::default())
            .expect("body");
    } else {
        sim.pin(&[39 * 40, 40 * 40 - 1], None).expect("pins");
    }
    sim
}

fn again() {
    println!("\n1 600 vertices at rest, after a change of 1 mm, one thread");
    println!(
        "{:<12} {:>8} {:>7} {:>7} {:>10} {:>9}",
        "sheet", "ms", "newton", "linear", "residual N", "moved mm"
    );
    for on_sphere in [false, true] {
        let mut sim = sheet(on_sphere);
        sim.drape(&WHOLE, &mut |_| true).expect("drape");
        let (mut times, mut newton, mut linear) = (Vec::new(), 0, 0);
        let (mut residual, mut moved) = (0.0_f64, 0.0_f64);
        for k in 1..=5 {
            let shift = if k % 2 == 1 { 1e-3 } else { 0.0 };
            if on_sphere {
                sim.set_body_pose(0, [shift, 0.0, 0.0], [0.0, 0.0, 0.0, 1.0])
                    .expect("pose");
            } else {
                let target = [1.0 - shift, 1.0, 0.0];
                sim.pin(&[40 * 40 - 1], Some(&[target])).expect("pin");
            }
            let before = sim.positions().to_vec();
            let clock = Instant::now();
            let report = sim.drape(&WHOLE, &mut |_| true).expect("drape");
            times.push(1e3 * clock.elapsed().as_secs_f64());
            newton += report.newton_iterations;
            linear += report.linear_iterations;
            residual = residual.max(report.residual);
            moved = moved.max(furthest(&before, sim.positions()));
        }
        println!(
            "{:<12} {:>8.0} {:>7} {:>7} {residual:>10.1e} {:>9.2}",
            if on_sphere { "on sphere" } else { "hung" },
            median(times),
            newton / 5,
            linear / 5,
            1e3 * moved
        );
    }
}

fn main() {
    let threads = std::env::args().filter_map(|a| a.parse().ok()).next();
    again();
    println!();
    shirts(threads.unwrap_or(2.0));
}
