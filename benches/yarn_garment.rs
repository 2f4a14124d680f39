//! A knitted garment on a body, every yarn simulated, with as many loops as the garments of Cirio et al. 2017.
//!
//! GarmentCode's T-shirt is draped as triangles on the body that it was drawn for; then yarns of garter stitch are laid on all of its panels,
//! tied at the seams, and taken to where the triangles lie. Loops are as wide as gives their number: 56 000 for the
//! sweater of figure 1, 325 000 for the T-shirt of figure 10; the yarn is the sweater's, as thick for its loops. Every yarn springs from its flat layout
//! in the first steps of 1 ms; cloth does not touch itself, since a node may come near others by 0.15 radii a
//! substep only, which made 33 to 38 substeps of each step with 5 000 loops. Prints what is laid and its memory, and for each step Newton and linear iterations, microseconds
//! a node and step by the clock and of processors, memory a node with the matrix and its factor, the seams' largest gap, and the smallest gap
//! to the body. Wants `TOILE_DATA`; one thread, or those of `--threads`.
//!
//! `cargo bench --bench yarn_garment -- --loops 56000 --steps 3`; 0 steps lay the yarns and make the system alone, `--solver` takes
//! another `solver.linear.kind`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::{cpu, given};
use std::time::Instant;
use toile::math::Vec2;
use toile::pattern::yarn_fabric::{Structure, YarnFabric};
use toile::pattern::{BlendRegion, Garment, Shape};
use toile::sim::{ContactSettings, DrapeOptions, Settings, Sim, SimOptions};
use toile::yarn::{Layout, lay};

const DT: f64 = 1e-3;
/// Length of the triangles' edges [m].
const EDGE: f64 = 0.02;

/// The sweater's fabric with so many loops on the garment.
fn knit(garment: &Garment, loops: f64) -> YarnFabric {
    let areas = garment.panels.iter().map(|p| p.area().expect("area"));
    let mut fabric = YarnFabric::preset("sweater").expect("fabric");
    let Structure::Knitted(knit) = &mut fabric.structure else {
        unreachable!("a sweater is knitted");
    };
    let height = knit.loop_height / knit.loop_width;
    let thickness = fabric.radius / knit.loop_width;
    knit.loop_width = (areas.sum::<f64>() / loops / height).sqrt();
    knit.loop_height = height * knit.loop_width;
    fabric.radius = thickness * knit.loop_width;
    fabric.derive();
    fabric
}

fn main() {
    let Some((mut garment, body)) = common::garment("gen_tshirt") else {
        return;
    };
    let (loops, steps) = (given("--loops", 56e3), given("--steps", 3.0) as usize);
    garment.edge_length = EDGE;
    let yarns = knit(&garment, loops);
    for fabric in &mut garment.fabrics {
        fabric.yarns = Some(yarns.clone());
    }
    let simulated = |garment: &Garment| {
        let options = SimOptions {
            settings: Settings {
                self_contact: 0.0,
                linear_kind: given("--solver", 0.0),
                ..common::settings()
            },
            ..SimOptions::default()
        };
        let mut sim = Sim::new(garment, &options).expect("sim");
        let contact = ContactSettings::default();
        sim.add_body(&body, &contact).expect("body");
        sim
    };
    let mut triangles = simulated(&garment);
    let begin = cpu();
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let report = triangles.drape(&options, &mut |_| true).expect("drape");
    let start: Vec<[f64; 3]> = triangles.positions().iter().map(|p| (*p).into()).collect();
    drop(triangles);
    println!(
        "{} vertices draped as triangles: {}, {:.1} CPU s, seams open by {:.1e} m",
        start.len(),
        report.outcome.name(),
        cpu() - begin,
        report.max_seam_gap
    );
    let whole = [[-9.0, -9.0], [9.0, -9.0], [9.0, 9.0], [-9.0, 9.0]];
    let region = |panel| BlendRegion {
        panel,
        shape: Shape::Polygon(whole.map(|[u, v]| Vec2::new(u, v)).to_vec()),
        rings: 0,
    };
    let panels = 0..garment.panels.len() as u32;
    garment.blend_regions = panels.map(region).collect();
    let begin = cpu();
    let counts = lay(&garment, &Layout::default()).expect("yarns").counts();
    println!(
        "{loops} loops of {:.2} mm: {} nodes, {} yarns, {} ties, laid in {:.1} CPU s, {} bytes a node",
        1e3 * yarns.structure.pitch()[0],
        counts.nodes,
        counts.yarns,
        counts.ties,
        cpu() - begin,
        counts.bytes / counts.nodes
    );
    let begin = cpu();
    let mut sim = simulated(&garment);
    sim.set_positions(&start, None).expect("positions");
    println!(
        "system made in {:.1} CPU s, {:.0} MB",
        cpu() - begin,
        1e-6 * sim.info().bytes as f64
    );
    let report = sim.report().expect("report");
    println!(
        "seams of yarns open by {:.1e} m, gap to the body {:.1e} m",
        report.max_seam_gap, report.min_gap
    );
    println!("step substeps Newton linear  us/node us/node bytes/node  seams/mm  gap/mm");
    println!("                              clock     CPU");
    for step in 1..=steps {
        let (clock, begin) = (Instant::now(), cpu());
        let report = sim.step(DT).expect("a step");
        let (clock, seconds) = (clock.elapsed().as_secs_f64(), cpu() - begin);
        let info = sim.info();
        println!(
            "{step:4} {:8} {:6} {:6} {:8.1} {:7.1} {:10} {:9.2} {:7.2}",
            report.substeps,
            report.newton_iterations,
            report.linear_iterations,
            1e6 * clock / info.yarn_nodes as f64,
            1e6 * seconds / info.yarn_nodes as f64,
            (info.bytes + info.factor_bytes) / info.yarn_nodes,
            1e3 * report.max_seam_gap,
            1e3 * report.min_gap
        );
    }
}
