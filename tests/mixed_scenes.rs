//! Small scenes of mixed cloth, after the figures of Casafranca et al. 2020: each does what its figure shows.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use std::path::Path;
use toile::math::{Vec2, Vec3};
use toile::pattern::{BlendRegion, Shape};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Sim, StepReport};
use toile::sim_scene::{Driver, along, build};

fn example(name: &str) -> Scene {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(folder.join(format!("{name}.json"))).expect("scene");
    Scene::from_json(&text, Some(&folder)).expect("scene")
}

/// The same scene with yarns everywhere.
fn full(mut scene: Scene) -> Scene {
    let corners = [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]];
    let region = |panel| BlendRegion {
        panel,
        shape: Shape::Polygon(corners.map(|[u, v]| Vec2::new(u, v)).to_vec()),
        rings: 0,
    };
    let panels = 0..scene.garment.panels.len() as u32;
    scene.garment.blend_regions = panels.map(region).collect();
    scene
}

/// Runs a scene as `toile run` does.
fn play(scene: &Scene, what: &str, mut watch: impl FnMut(&Sim, &StepReport)) -> Sim {
    let mut sim = build(scene).expect(what);
    let mut driver = Driver::new(&sim, scene).expect(what);
    let begin = std::time::Instant::now();
    if scene.run.drape {
        let options = DrapeOptions {
            force_tolerance: 0.0,
            max_steps: 0,
        };
        sim.drape(&options, &mut |_| true).expect(what);
    }
    let (origin, mut newton) = (sim.time(), 0);
    for step in 1..=scene.run.steps() {
        let time = origin + scene.run.time_after(step);
        driver.set(&mut sim, scene, time).expect(what);
        let report = sim.step(scene.run.dt).expect(what);
        newton += report.newton_iterations;
        watch(&sim, &report);
    }
    let info = sim.info();
    println!(
        "{what}: {} unknowns, {newton} Newton iterations, {:.1} s",
        info.unknowns,
        begin.elapsed().as_secs_f64()
    );
    sim
}

/// Flat places of the nodes that are simulated whole, with the nodes.
fn whole(sim: &Sim) -> Vec<(usize, Vec2)> {
    let mesh = sim.yarns().expect("yarns");
    let list = (0..).zip(&mesh.uv);
    list.filter(|(n, _)| mesh.is_whole(*n as u32))
        .map(|(n, p)| (n, *p))
        .collect()
}

fn node(sim: &Sim, at: Vec2) -> usize {
    sim.locate_yarn_node(0, at.into()).expect("node") as usize
}

fn rms(parts: impl Iterator<Item = Vec3>) -> f64 {
    let (sum, count) = parts.fold((0.0, 0), |(s, n), d| (s + d.norm_squared(), n + 1));
    (sum / f64::from(count)).sqrt()
}

/// How far the whole nodes of a model are from those of yarns everywhere, and how far they came.
fn apart(start: &Sim, mixed: &Sim, yarns: &Sim) -> [f64; 2] {
    let nodes = whole(mixed);
    let apart = |a: &Sim, b: &Sim| {
        rms(nodes.iter().map(|(_, p)| {
            let place = |sim: &Sim| sim.yarn_nodes()[node(sim, *p)];
            place(a) - place(b)
        }))
    };
    [apart(mixed, yarns), apart(start, yarns)]
}

/// Figure 2: yarns swing with the triangles around them, as they do among yarns; neither coupling adds energy.
#[test]
fn yarns_swing_with_the_triangles_around_them() {
    let scene = example("swing");
    let all = full(scene.clone());
    let start = build(&all).unwrap();
    let yarns = play(&all, "yarns", |_, _| ());
    let energy = |r: &StepReport| r.kinetic_energy + r.potential_energy;
    for rings in [0, 1] {
        let mut scene = scene.clone();
        for region in &mut scene.garment.blend_regions {
            region.rings = rings;
        }
        let first = energy(&build(&scene).unwrap().report().unwrap());
        let (mut gained, mut fastest) = (f64::NEG_INFINITY, 0.0_f64);
        let sim = play(&scene, &format!("{rings} rings"), |_, r| {
            gained = gained.max(energy(r) - first);
            fastest = fastest.max(r.kinetic_energy);
        });
        let [error, way] = apart(&start, &sim, &yarns);
        println!(
            "  {error:.2e} m from yarns everywhere after {way:.3} m; gained {gained:.1e} of {fastest:.1e} J"
        );
        assert!(way > 0.03, "{way}");
        assert!(error < 0.01 * way, "{error} {way}");
        assert!(gained < 1e-3 * fastest, "{gained} {fastest}");
    }
}

/// Figure 8: a ball moves yarns among triangles as it moves yarns everywhere, and gets into neither.
#[test]
fn a_ball_hits_yarns_among_triangles() {
    let scene = example("ball");
    let all = full(scene.clone());
    let start = build(&all).unwrap();
    let [mixed, yarns] = [(&scene, "mixed"), (&all, "yarns")].map(|(scene, what)| {
        let mut gap = f64::INFINITY;
        let sim = play(scene, what, |_, r| gap = gap.min(r.min_gap));
        assert!(gap > 0.0, "{what}: {gap}");
        sim
    });
    let [error, way] = apart(&start, &mixed, &yarns);
    println!("  {error:.2e} m from yarns everywhere after {way:.3} m");
    assert!(way > 0.01, "{way}");
    assert!(error < 0.03 * way, "{error} {way}");
}

/// Height of a strip's upper end, of triangles or of yarns [m].
fn upper_end(sim: &Sim) -> f64 {
    let vertices = along(sim, 0, 2).unwrap().iter().copied();
    let nodes = sim.yarn_nodes_along(0, 2).unwrap().into_iter();
    let points = vertices.chain(nodes.map(|n| sim.point_of_node(n)));
    let free = points.filter(|p| sim.moves_by_itself(*p));
    let heights: Vec<f64> = free.map(|p| sim.points()[p as usize].y).collect();
    heights.iter().sum::<f64>() / heights.len() as f64
}

/// Figure 6: a strip pulled and let go stays longer if its yarns slide, in its middle or everywhere, and else returns; what stays
/// is in the yarns and not in the triangles.
#[test]
fn friction_keeps_what_has_slid_in_a_strip() {
    let scene = example("friction_set");
    let mut held = scene.clone();
    held.settings.set("yarn.sliding", 0.0).unwrap();
    let mut triangles = scene.clone();
    triangles.garment.blend_regions.clear();
    let all = full(scene.clone());
    let models = [
        (&scene, "mixed"),
        (&all, "yarns"),
        (&held, "mixed, held"),
        (&triangles, "triangles"),
    ];
    let sets = models.map(|(scene, what)| {
        let length = upper_end(&build(scene).unwrap());
        let (mut pulled, mut strain) = (0.0_f64, 0.0);
        let sim = play(scene, what, |sim, r| {
            pulled = pulled.max(upper_end(sim) - length);
            strain = r.max_edge_strain;
        });
        let set = (upper_end(&sim) - length) / pulled;
        println!(
            "  pulled by {pulled:.4} m, keeps {set:.3} of it; triangles strained by {strain:.4}"
        );
        assert!(strain < 0.005, "{what}: {strain}");
        set
    });
    assert!(
        sets[0] > 0.3 && (sets[0] - sets[1]).abs() < 0.2 * sets[1],
        "{sets:?}"
    );
    assert!(sets[2].abs() < 0.03 && sets[3].abs() < 0.03, "{sets:?}");
}

/// Figure 7: two yarns pulled out of a cloth to opposite sides stay out as far among triangles as in a cloth of yarns, and others
/// stay where they were.
#[test]
fn yarns_pulled_to_opposite_sides_stay_out() {
    let scene = example("plastic_yield");
    let all = full(scene.clone());
    let [mixed, yarns] = [(&scene, "mixed"), (&all, "yarns")].map(|(scene, what)| {
        let start = build(scene).unwrap();
        let sim = play(scene, what, |_, _| ());
        let rise = |u: f64, v: f64| {
            let n = node(&start, Vec2::new(u, v));
            sim.yarn_nodes()[n].y - start.yarn_nodes()[n].y
        };
        let ends = [rise(0.023, 0.048), rise(0.025, 0.0)];
        let beside = [0.017, 0.019, 0.021, 0.027, 0.029, 0.031].map(|u| rise(u, 0.024).abs());
        let beside = beside.into_iter().fold(0.0, f64::max);
        println!("  ends stay out by {ends:?} m, neighbours moved by {beside:.1e} m");
        assert!(beside < 1e-4, "{what}: {beside}");
        ends
    });
    for (a, b) in mixed.iter().zip(yarns) {
        // the way that they were pulled
        assert!(b.abs() > 0.4 * 0.006, "{yarns:?}");
        assert!((a - b).abs() < 0.1 * b.abs(), "{mixed:?} {yarns:?}");
    }
    assert!(yarns[0] > 0.0 && yarns[1] < 0.0, "{yarns:?}");
}

/// Figure 5: the sleeve stays on the arm and folds where the elbow bends; no yarn that crosses the border of the region is strained more than
/// those inside.
#[test]
fn a_sleeve_folds_at_the_elbow() {
    let scene = example("elbow");
    let mut gap = f64::INFINITY;
    let mut seam = 0.0;
    let sim = play(&scene, "sleeve", |_, r| {
        gap = gap.min(r.min_gap);
        seam = r.max_seam_gap;
    });
    assert!(gap > 0.0 && seam < 1e-3, "{gap} {seam}");
    let mesh = sim.yarns().unwrap();
    // from the upper to the lower end of the region along the middle of a panel, over the flat length
    let chord = |panel: u32| {
        let [low, high] = [0.068, 0.132].map(|v| {
            let n = sim.locate_yarn_node(panel, [0.042, v]).unwrap() as usize;
            (mesh.uv[n], sim.yarn_nodes()[n])
        });
        (high.1 - low.1).norm() / (high.0 - low.0).norm()
    };
    let chords = [chord(0), chord(1)];
    let mut strains = [0.0_f64; 2];
    for y in 0..mesh.yarn_count() {
        for pair in mesh.yarn(y).windows(2) {
            let ends = [pair[0].node, pair[1].node];
            let [a, b] = ends.map(|n| sim.yarn_nodes()[n as usize]);
            let strain = (b - a).norm() / (pair[1].u - pair[0].u) - 1.0;
            let inside = ends.iter().filter(|n| mesh.is_whole(**n)).count();
            if inside > 0 {
                let border = usize::from(inside == 1);
                strains[border] = strains[border].max(strain);
            }
        }
    }
    println!(
        "  gap {gap:.1e} m, seams open by {seam:.1e} m, chords {chords:.3?} inside and outside of the elbow, strains {strains:.3?} inside and at the border"
    );
    assert!(chords[0] < 0.75 && chords[1] > 0.9, "{chords:?}");
    assert!(strains[1] < 2.0 * strains[0], "{strains:?}");
}
