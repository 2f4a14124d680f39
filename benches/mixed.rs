//! Yarns everywhere against yarns where they matter, in one run with one step and one tolerance.
//!
//! *Puckering* (Casafranca et al. 2020, figure 4 and table 1): two patches of a plain weave, the one a tenth longer along
//! the seam, which stretches the other; yarns within a strip along the seam, triangles of 12 pitches beyond. *Dress* (figure 9):
//! GarmentCode's pencil dress of a weave, draped on a body as triangles; then yarns are laid on the chest, or everywhere. *Shirt* (figure 1):
//! the same with its shirt and yarns around an armpit. Both need
//! `TOILE_DATA`. Cloth does not touch itself: yarns of different places do not either. Every model goes from the same places through the same steps of 1 ms, on one thread or those of `--threads`. Without rings each is solved
//! in two ways, and the faster one counts; with `--later` it goes on, past the steps in which yarns spring into place. Printed for each: what it is made of,
//! Newton and linear iterations a step, seconds a step by the clock, memory of system and matrix and of the factor, and the
//! distance of the yarns in the region from those of the full model, over the way these moved (root mean squares).
//!
//! `cargo bench --bench mixed`, or `make bench-mixed`; `--quick` takes smaller patches and coarser yarns, `--only shirt` (or
//! `dress`, `puckering`) one scene.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "a benchmark may panic"
)]

mod common;

use common::cpu;
use std::collections::HashMap;
use std::f64::consts::PI;
use std::time::Instant;
use toile::body::Body;
use toile::math::{Vec2, Vec3};
use toile::pattern::import::garment_from_json;
use toile::pattern::{BlendRegion, Garment, Shape};
use toile::sim::{ContactSettings, DrapeOptions, Settings, Sim, SimOptions};

/// Steps, and what one takes [s].
const STEPS: usize = 2;
const DT: f64 = 1e-3;
/// Steps after those with `--later`, of which the second half is counted: by then yarns no longer spring into place.
const LATER: usize = 20;
/// `solver.linear.kind` of factors of overlapping parts, the only one for rings.
const PARTS: f64 = 5.0;
/// Those that models without rings are tried with: the factor of an earlier matrix, and parts.
const SOLVERS: [f64; 2] = [4.0, PARTS];

/// A garment with a plain weave of this pitch and the membrane and bending of its yarns.
fn weave(pitch: f64, panels: &str, seams: &str) -> Garment {
    let radius = 0.25 * pitch;
    let (young, shear, bending, line) = (1e7, 1.6e5, 3e6, 0.15 * pitch);
    let area = PI * radius * radius;
    let text = format!(
        r#"{{"toile_garment": 1, "name": "bench", "edge_length": {edge}, "panels": {panels}, "seams": {seams},
            "fabrics": [{{"name": "y", "density": {density},
                "membrane": {{"warp": {stretch}, "weft": {stretch}, "shear": {slant}, "coupling": 0}},
                "bending": {{"warp": {rigidity}, "weft": {rigidity}}},
                "yarns": {{"weave": "plain", "warp_pitch": {pitch}, "radius": {radius}, "young": {young},
                    "shear": {shear}, "density": {line}, "bending": {yarn_bending}}}}}]}}"#,
        edge = 12.0 * pitch,
        density = 2.0 * line / pitch,
        stretch = young * area / pitch,
        slant = 4.0 * shear * radius * radius / pitch,
        rigidity = bending * PI * radius.powi(4) / 4.0 / pitch,
        yarn_bending = bending * radius * radius / 4.0,
    );
    garment_from_json(&text, None).expect("garment")
}

/// Polygons of regions, by panel.
type Regions = Vec<(u32, Vec<Vec2>)>;

/// What all models of a scene begin with.
struct Scene {
    garment: Garment,
    body: Option<Body>,
    gravity: [f64; 3],
    /// Places of the vertices.
    start: Vec<[f64; 3]>,
    /// Edges whose points are held.
    held: Vec<(u32, u32)>,
}

fn rectangle(low: Vec2, high: Vec2) -> Vec<Vec2> {
    vec![
        low,
        Vec2::new(high.x, low.y),
        high,
        Vec2::new(low.x, high.y),
    ]
}

impl Scene {
    fn sim(&self, regions: &Regions, rings: u32, solver: f64) -> Sim {
        let mut garment = self.garment.clone();
        let list = regions.iter().map(|(panel, polygon)| BlendRegion {
            panel: *panel,
            shape: Shape::Polygon(polygon.clone()),
            rings,
        });
        garment.blend_regions = list.collect();
        let settings = Settings {
            linear_kind: solver,
            self_contact: 0.0,
            ..common::settings()
        };
        let options = SimOptions {
            gravity: Some(self.gravity),
            settings,
            ..SimOptions::default()
        };
        let mut sim = Sim::new(&garment, &options).expect("sim");
        if let Some(body) = &self.body {
            sim.add_body(body, &ContactSettings::default())
                .expect("body");
        }
        sim.set_positions(&self.start, None).expect("positions");
        let active = sim.active_vertices();
        for (panel, edge) in &self.held {
            let along = toile::sim_scene::along(&sim, *panel, *edge).expect("edge");
            if along.iter().all(|v| active[*v as usize]) {
                let along = along.to_vec();
                sim.pin(&along, None).expect("pins");
            } else {
                let nodes = sim.yarn_nodes_along(*panel, *edge).expect("nodes");
                sim.pin_yarn_nodes(&nodes, None).expect("pins");
            }
        }
        sim
    }

    /// Lets triangles alone come to rest: where the models begin.
    fn drape(&mut self) {
        let begin = cpu();
        let mut sim = self.sim(&Vec::new(), 0, 0.0);
        let options = DrapeOptions {
            force_tolerance: 0.0,
            max_steps: 0,
        };
        let report = sim.drape(&options, &mut |_| true).expect("drape");
        println!(
            "{} vertices draped as triangles before: {}, {:.1} CPU s",
            sim.positions().len(),
            report.outcome.name(),
            cpu() - begin
        );
        self.start = sim.positions().iter().map(|p| (*p).into()).collect();
    }

    fn everywhere(&self) -> Regions {
        let panels = 0..self.garment.panels.len() as u32;
        panels
            .map(|p| (p, rectangle(Vec2::new(-9.0, -9.0), Vec2::new(9.0, 9.0))))
            .collect()
    }
}

/// A place of a node on its panel.
type Place = (u32, i64, i64);

/// Where the nodes of yarns that are whole are.
fn nodes(sim: &Sim) -> HashMap<Place, Vec3> {
    let mesh = sim.yarns().expect("yarns");
    let round = |v: f64| (v * 1e9).round() as i64;
    (0..mesh.uv.len())
        .filter(|n| mesh.is_whole(*n as u32))
        .map(|n| {
            let (panel, p) = (mesh.node_panel[n], mesh.uv[n]);
            ((panel, round(p.x), round(p.y)), sim.yarn_nodes()[n])
        })
        .collect()
}

/// What a model came to.
struct Run {
    sim: Sim,
    seconds: f64,
    bytes: [usize; 2],
    /// Places of nodes at the start and at the end.
    places: [HashMap<Place, Vec3>; 2],
    /// Seconds a step after that.
    later: Option<f64>,
}

fn header() {
    println!(
        "model              vertices    nodes in rings unknowns  Newton  linear       s  system  factor  solver"
    );
    println!(
        "                                                         a step  a Newton a step      MB      MB"
    );
}

/// The first steps of a model by the solver that takes least time, and those after by the same.
fn best(name: &str, solvers: &[f64], sim: impl Fn(f64) -> Sim) -> Run {
    let runs = solvers.iter().map(|solver| run(name, sim(*solver)));
    let fastest = runs.min_by(|a, b| a.seconds.total_cmp(&b.seconds));
    let mut run = fastest.expect("a run");
    if std::env::args().any(|a| a == "--later") {
        run.later = Some(later(&mut run.sim));
    }
    run
}

/// Goes on, and tells the seconds that a step takes then.
fn later(sim: &mut Sim) -> f64 {
    let (mut begin, mut newton) = (Instant::now(), 0);
    for k in 0..LATER {
        if k == LATER / 2 {
            (begin, newton) = (Instant::now(), 0);
        }
        newton += sim.step(DT).expect("step").newton_iterations;
    }
    let steps = (LATER - LATER / 2) as f64;
    let seconds = begin.elapsed().as_secs_f64() / steps;
    println!(
        "  {LATER} steps later, {}: {:.1} Newton and {seconds:.2} s a step",
        sim.info().backend,
        newton as f64 / steps,
    );
    seconds
}

fn run(name: &str, mut sim: Sim) -> Run {
    let first = nodes(&sim);
    let begin = Instant::now();
    let (mut newton, mut linear, mut substeps) = (0, 0, 0);
    for _ in 0..STEPS {
        let report = sim.step(DT).expect("step");
        newton += report.newton_iterations;
        linear += report.linear_iterations;
        substeps += report.substeps;
    }
    let seconds = begin.elapsed().as_secs_f64() / STEPS as f64;
    let info = sim.info();
    let moving = sim.active_vertices().iter().filter(|a| **a).count();
    println!(
        "{name:<18} {moving:8} {:8} {:8} {:8} {:7.1} {:9.1} {seconds:7.2} {:7.0} {:7.0}  {}{}",
        info.yarn_nodes - info.carried_nodes,
        info.hybrid_nodes,
        info.unknowns,
        newton as f64 / STEPS as f64,
        linear as f64 / newton as f64,
        1e-6 * info.bytes as f64,
        1e-6 * info.factor_bytes as f64,
        info.backend,
        if substeps as usize > STEPS {
            format!(", {substeps} substeps")
        } else {
            String::new()
        }
    );
    let last = nodes(&sim);
    Run {
        sim,
        seconds,
        bytes: [info.bytes, info.bytes + info.factor_bytes],
        places: [first, last],
        later: None,
    }
}

/// Tells how a model compares with that of all yarns.
fn compare(name: &str, full: &Run, mixed: &Run) {
    let (mut apart, mut moved, mut count) = (0.0, 0.0, 0);
    for (place, x) in &mixed.places[1] {
        if let (Some(before), Some(after)) = (full.places[0].get(place), full.places[1].get(place))
        {
            apart += (x - after).norm_squared();
            moved += (after - before).norm_squared();
            count += 1;
        }
    }
    println!(
        "  {name}: {:.1} times as fast, {:.1} times smaller ({:.1} without the factor); {count} nodes differ by {:.1e} of their motion",
        full.seconds / mixed.seconds,
        full.bytes[1] as f64 / mixed.bytes[1] as f64,
        full.bytes[0] as f64 / mixed.bytes[0] as f64,
        f64::sqrt(apart / moved)
    );
    if let (Some(full), Some(mixed)) = (full.later, mixed.later) {
        println!("  {LATER} steps later: {:.1} times as fast", full / mixed);
    }
}

fn whole(scene: &Scene, regions: &Regions) {
    header();
    let direct = best("mixed, direct", &SOLVERS, |kind| {
        scene.sim(regions, 0, kind)
    });
    let ringed = best("mixed, 1 ring", &[PARTS], |kind| {
        scene.sim(regions, 1, kind)
    });
    let full = best("full", &SOLVERS, |kind| {
        scene.sim(&scene.everywhere(), 0, kind)
    });
    compare("mixed, direct", &full, &direct);
    compare("mixed, 1 ring", &full, &ringed);
}

/// Two patches of `side` and a tenth more with yarns within `reach` of their seam.
fn puckering(side: f64, reach: f64) {
    let (pitch, long) = (1e-3, 1.1 * side);
    let garment = weave(
        pitch,
        &format!(
            r#"[{{"name": "short", "fabric": "y", "vertices": [[0, 0], [{side}, 0], [{side}, {side}], [0, {side}]],
                 "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}},
                {{"name": "long", "fabric": "y", "vertices": [[0, 0], [{side}, 0], [{side}, {long}], [0, {long}]],
                 "placement": {{"translation": [{side}, 0, 0]}},
                 "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}]"#
        ),
        r#"[{"a": ["short", 1], "b": ["long", 3]}]"#,
    );
    let mut scene = Scene {
        start: Vec::new(),
        garment,
        body: None,
        gravity: [0.0; 3],
        held: vec![(0, 3), (1, 1)],
    };
    let flat = Sim::new(&scene.garment, &SimOptions::default()).expect("sim");
    let panels = flat.vertex_panels().iter();
    let start = panels.zip(flat.vertex_uv()).map(|(panel, p)| {
        // a slight wave shows the seam the way out of the plane
        let (x, y) = (
            side * f64::from(*panel) + p.x,
            p.y * if *panel == 0 { 1.1 } else { 1.0 },
        );
        let near = (-(x - side).abs() / reach).exp();
        [x, y, 1e-3 * near * (2.0 * PI * y / 0.04).sin()]
    });
    scene.start = start.collect();
    println!(
        "\npuckering: patches of {side} m and {long} m, yarns of {pitch} m within {reach} m of the seam"
    );
    scene.drape();
    let tall = 2.0 * long;
    let regions = vec![
        (
            0,
            rectangle(Vec2::new(side - reach, -tall), Vec2::new(2.0 * side, tall)),
        ),
        (
            1,
            rectangle(Vec2::new(-side, -tall), Vec2::new(reach, tall)),
        ),
    ];
    whole(&scene, &regions);
}

/// Low and high corner of a region on the panel with this name [m].
type Part = (&'static str, [f64; 2], [f64; 2]);

/// Of the dress: the two halves of the front, mirrored, on the chest.
const CHEST: [Part; 2] = [
    ("left_ftorso", [-0.1, 0.2], [0.12, 0.4]),
    ("right_ftorso", [-0.12, 0.2], [0.1, 0.4]),
];
/// Of the shirt: front, back and both halves of the sleeve around the left armpit.
const ARMPIT: [Part; 4] = [
    ("left_ftorso", [0.19, 0.17], [0.4, 0.4]),
    ("left_btorso", [0.17, 0.17], [0.4, 0.4]),
    ("left_sleeve_f", [-0.4, -0.4], [-0.15, -0.12]),
    ("left_sleeve_b", [-0.4, -0.4], [-0.15, -0.12]),
];

/// A pattern of a weave with this pitch on its body, yarns on some parts of it.
fn worn(name: &str, pitch: f64, parts: &[Part]) {
    let Some((mut garment, body)) = common::garment(name) else {
        return;
    };
    let corner = r#"[{"name": "p", "fabric": "y", "vertices": [[0, 0], [1, 0], [0, 1]], "edges": [[0, 1], [1, 2], [2, 0]]}]"#;
    garment.fabrics = weave(pitch, corner, "[]").fabrics;
    garment.edge_length = 0.024;
    for panel in &mut garment.panels {
        panel.fabric = 0;
        panel.edge_length = None;
    }
    let placed = Sim::new(&garment, &SimOptions::default()).expect("sim");
    let start = placed.positions().iter().map(|p| (*p).into());
    let mut scene = Scene {
        start: start.collect(),
        garment,
        body: Some(body),
        gravity: [0.0, -9.81, 0.0],
        held: Vec::new(),
    };
    println!("\n{name}: a weave with a pitch of {pitch} m");
    scene.drape();
    let region = |(panel, low, high): &Part| {
        let found = scene.garment.panels.iter().position(|p| p.name == *panel);
        let [low, high] = [low, high].map(|[u, v]| Vec2::new(*u, *v));
        (found.expect("panel") as u32, rectangle(low, high))
    };
    whole(&scene, &parts.iter().map(region).collect());
}

fn main() {
    let quick = std::env::args().any(|a| a == "--quick");
    println!(
        "{STEPS} steps of {DT} s each, threads: {}",
        common::settings().threads
    );
    let only = std::env::args().skip_while(|a| a != "--only").nth(1);
    let wanted = |name: &str| only.as_deref().is_none_or(|o| o == name);
    if wanted("puckering") {
        match quick {
            true => puckering(0.1, 0.025),
            // as many nodes as the paper's mixed model
            false => puckering(0.342, 0.0826),
        }
    }
    if wanted("dress") {
        worn("dress_pencil", if quick { 6e-3 } else { 2.5e-3 }, &CHEST);
    }
    if wanted("shirt") {
        worn("shirt_mean", if quick { 6e-3 } else { 2e-3 }, &ARMPIT);
    }
}
