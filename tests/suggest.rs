//! Regions of yarns that the indicator suggests: where they lie, what they cost, what is refused.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use std::f64::consts::PI;
use toile::blend::{Region, trace};
use toile::indicate::indicator::{CRITERIA, LeftOut};
use toile::indicate::{LEAST_TOLERANCE, Suggestion, Wish};
use toile::math::Vec2;
use toile::pattern::Garment;
use toile::pattern::import::garment_from_json;
use toile::sim::{DrapeOptions, Settings, Sim, SimOptions};

const SIDE: f64 = 0.08;
const PITCH: f64 = 1e-3;

/// Two squares of a weave side by side, sewn, one above the other as high as the first.
fn garment() -> Garment {
    let text = format!(
        r#"{{"toile_garment": 1, "name": "g", "edge_length": 0.004,
            "panels": [
                {{"name": "a", "fabric": "y", "vertices": [[0, 0], [{SIDE}, 0], [{SIDE}, {SIDE}], [0, {SIDE}]],
                    "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}},
                {{"name": "b", "fabric": "y", "vertices": [[0, 0], [{SIDE}, 0], [{SIDE}, {SIDE}], [0, {SIDE}]],
                    "edges": [[0, 1], [1, 2], [2, 3], [3, 0]], "placement": {{"translation": [{SIDE}, 0, 0]}}}}],
            "seams": [{{"a": ["a", 1], "b": ["b", 3]}}],
            "fabrics": [{{"name": "y", "density": 0.3,
                "membrane": {{"warp": 1963.5, "weft": 1963.5, "shear": 40, "coupling": 0}},
                "bending": {{"warp": 2e-6, "weft": 2e-6}},
                "yarns": {{"weave": "plain", "warp_pitch": {PITCH}, "radius": 0.00025,
                    "young": 1e7, "shear": 1.6e5, "density": 1.5e-4}}}}]}}"#
    );
    garment_from_json(&text, None).expect("garment")
}

fn sim_with(garment: &Garment, threads: f64) -> Sim {
    let mut settings = Settings::default();
    settings.set("solver.threads", threads).expect("number");
    let options = SimOptions {
        gravity: Some([0.0; 3]),
        settings,
        ..SimOptions::default()
    };
    Sim::new(garment, &options).expect("sim")
}

/// The two squares, each vertex where `place` has it: from its place in the plane of both.
fn placed(place: impl Fn(f64, f64) -> [f64; 3]) -> Sim {
    let mut sim = sim_with(&garment(), 1.0);
    let flat: Vec<[f64; 3]> = (sim.positions().iter()).map(|p| place(p.x, p.y)).collect();
    sim.set_positions(&flat, None).expect("positions");
    sim
}

fn tolerance(tolerance: f64) -> Wish {
    Wish {
        tolerance: Some(tolerance),
        ..Wish::default()
    }
}

fn budget(budget: u64) -> Wish {
    Wish {
        budget: Some(budget),
        ..Wish::default()
    }
}

/// Waves across `u` of half wave length `half` beyond `from`.
fn waves(from: f64, half: f64) -> impl Fn(f64, f64) -> [f64; 3] {
    move |x, y| {
        let height = if x > from { 1e-3 } else { 0.0 };
        [x, y, height * (PI * (x - from) / half).sin()]
    }
}

fn suggested(sim: &Sim, wish: &Wish) -> Suggestion {
    sim.suggest_region(wish).expect("suggestion")
}

/// Where the middles of the region's triangles lie, from the left of the first panel [m].
fn middles(sim: &Sim, found: &Suggestion) -> Vec<Vec2> {
    let place = |v: u32| {
        let at = sim.vertex_uv()[v as usize];
        at + Vec2::new(SIDE * f64::from(sim.vertex_panels()[v as usize]), 0.0)
    };
    (sim.triangles().iter().zip(&found.region.full))
        .filter(|(_, full)| **full)
        .map(|(t, _)| t.iter().map(|v| place(*v)).sum::<Vec2>() / 3.0)
        .collect()
}

/// Flat cloth without stress wants no yarns, wherever it lies, and whatever the budget.
#[test]
fn flat_cloth_without_stress_wants_no_yarns() {
    let (s, c) = 0.7_f64.sin_cos();
    let sim = placed(|x, y| [c * x - s * y, 0.3, s * x + c * y]);
    for wish in [tolerance(LEAST_TOLERANCE), budget(1_000_000)] {
        let found = suggested(&sim, &wish);
        assert!(!found.region.full.contains(&true) && found.regions.is_empty());
        assert!(found.region.alpha.iter().all(|a| *a == 0.0));
        assert_eq!(found.cost, found.triangles);
        assert!(found.whole[0] < 1e-9, "{:?}", found.whole);
    }
}

/// Cloth that is wound around a cylinder of ten times a triangle's edge wants none either, if no seam bears the bend: triangles do that well.
#[test]
fn an_even_bend_wants_few_yarns() {
    let r = 0.04;
    let bent = placed(|x, y| [x, r * (y / r).sin(), r * (1.0 - (y / r).cos())]);
    let seam = placed(|x, y| [r * (x / r).sin(), y, r * (1.0 - (x / r).cos())]);
    let waved = placed(waves(0.0, 0.01));
    let [bent, waved] = [bent, waved].map(|sim| suggested(&sim, &tolerance(0.05)));
    assert!(!bent.region.full.contains(&true), "{:?}", bent.whole);
    assert!(waved.region.full.iter().filter(|f| **f).count() > 100);
    assert!(waved.whole[0] > 10.0 * bent.whole[0]);
    // bent across the seam, they are wanted along it alone
    let found = suggested(&seam, &tolerance(0.05));
    let middles = middles(&seam, &found);
    let near = |p: &Vec2| (p.x - SIDE).abs() < 5.0 * 4e-3;
    assert!(middles.len() > 20 && middles.iter().all(near));
}

/// Yarns are suggested where the cloth has short waves, on both sides of the seam, and not elsewhere.
#[test]
fn yarns_are_suggested_where_the_cloth_is_wrinkled() {
    let from = 0.06;
    let sim = placed(waves(from, 0.01));
    let found = suggested(&sim, &tolerance(0.05));
    let middles = middles(&sim, &found);
    let edge = 4e-3;
    assert!(middles.iter().all(|p| p.x > from - 5.0 * edge));
    let area: f64 = (found.region.full.iter().zip(&found.indicator.areas))
        .filter(|(full, _)| **full)
        .map(|(_, area)| area)
        .sum();
    let wrinkled = SIDE * (2.0 * SIDE - from);
    assert!(area > 0.75 * wrinkled && area < 1.3 * wrinkled, "{area}");
    assert!(found.left[0] < 0.5 * found.whole[0], "{:?}", found.left);
    // one piece to each panel
    assert_eq!(found.regions.len(), 2);
}

/// A strip that is pressed together in its plane by `e` hides waves with the slope `sqrt(2 (e - e_cr))`.
#[test]
fn cloth_pressed_in_its_plane_hides_waves_of_its_slope() {
    let e = 0.02;
    let sim = placed(|x, y| [x * (1.0 - e), y, 0.0]);
    let found = sim.vertex_errors(&LeftOut::default()).expect("errors");
    assert_eq!(CRITERIA[0], "wrinkle");
    let pressed = e - 0.5 * e * e;
    for (v, c) in found.criteria.iter().enumerate() {
        // Euler's strain at edges of 4 mm, of triangles of several sizes
        let critical = 2e-6 * (PI / 4e-3).powi(2) / 1963.5;
        let slope = (2.0 * (pressed - critical)).sqrt();
        assert!((c[0] - slope).abs() < 0.02 * slope, "{v} {} {slope}", c[0]);
    }
    // below Euler's load it is flat
    let sim = placed(|x, y| [x * (1.0 - 1e-4), y, 0.0]);
    let found = sim.vertex_errors(&LeftOut::default()).expect("errors");
    assert!(found.criteria.iter().all(|c| c[0] == 0.0));
}

/// The criterion of curvature is one of the bend and the yarns alone: on triangles of 1 and 2 mm a cylinder within the range of the
/// fit has none, and one beyond it the same.
#[test]
fn the_criterion_of_curvature_knows_no_triangles() {
    let k = CRITERIA
        .iter()
        .position(|c| *c == "curvature")
        .expect("one");
    let mean = |edge: f64, r: f64| {
        let mut cloth = garment();
        cloth.edge_length = edge;
        cloth.seams.clear();
        for panel in &mut cloth.panels {
            for vertex in &mut panel.vertices {
                *vertex *= 0.25;
            }
        }
        let mut sim = sim_with(&cloth, 1.0);
        let bent: Vec<[f64; 3]> = (sim.positions().iter())
            .map(|p| [p.x, r * (p.y / r).sin(), r * (1.0 - (p.y / r).cos())])
            .collect();
        sim.set_positions(&bent, None).expect("positions");
        let found = sim.vertex_errors(&LeftOut::default()).expect("errors");
        let all = found.criteria.iter().map(|c| c[k]);
        all.sum::<f64>() / found.criteria.len() as f64
    };
    for edge in [1e-3, 2e-3] {
        assert_eq!(mean(edge, 0.01).to_bits(), 0.0_f64.to_bits(), "{edge}");
    }
    let r = 4e-3;
    let [fine, coarse] = [1e-3, 2e-3].map(|edge| mean(edge, r));
    let beyond = PITCH / r - 0.15;
    println!("{fine} {coarse} of {beyond}");
    assert!((fine / beyond - 1.0).abs() < 0.1, "{fine} {beyond}");
    assert!((coarse / fine - 1.0).abs() < 0.2, "{coarse} {fine}");
}

/// What is left out does not count, and of two states every vertex has the larger error.
#[test]
fn criteria_can_be_left_out_and_states_put_together() {
    let [sim, pressed] = [placed(waves(0.08, 0.01)), placed(|x, y| [0.98 * x, y, 0.0])];
    let all = sim.vertex_errors(&LeftOut::default()).expect("errors");
    for k in 0..CRITERIA.len() {
        let mut left_out = LeftOut::default();
        left_out[k] = true;
        let found = sim.vertex_errors(&left_out).expect("errors");
        assert_eq!(found.criteria, all.criteria);
        for ((all, rest), c) in all.error.iter().zip(&found.error).zip(&all.criteria) {
            assert!((all * all - rest * rest - c[k] * c[k]).abs() < 1e-12);
        }
    }
    let other = pressed.vertex_errors(&LeftOut::default()).expect("errors");
    let mut both = all.clone();
    both.widen(&other);
    assert_ne!(both, all);
    for v in 0..both.error.len() {
        assert_eq!(
            both.error[v].to_bits(),
            all.error[v].max(other.error[v]).to_bits()
        );
    }
    // what is needed in either state is needed in both
    let [one, two, of_both] = [&all, &other, &both].map(|errors| {
        let found = sim
            .suggest_for(errors, &tolerance(0.1))
            .expect("suggestion");
        found.region.full
    });
    assert!((0..of_both.len()).all(|t| of_both[t] || !(one[t] || two[t])));
    let error = sim
        .suggest_region(&Wish {
            left_out: [true; CRITERIA.len()],
            ..tolerance(0.1)
        })
        .unwrap_err();
    assert!(error.message.contains("every criterion"), "{error}");
}

/// The region of a smaller tolerance holds that of a larger one, and its error is less.
#[test]
fn tighter_tolerances_give_larger_regions() {
    let sim = placed(|x, y| [x, y, 2e-3 * (x / SIDE).powi(3) * (PI * x / 8e-3).sin()]);
    let list: Vec<Suggestion> = [0.5, 0.2, 0.1, 0.05, 0.02, 0.01, 0.003]
        .iter()
        .map(|t| suggested(&sim, &tolerance(*t)))
        .collect();
    let mut sizes = Vec::new();
    for pair in list.windows(2) {
        let [a, b] = [&pair[0], &pair[1]];
        let held = a.region.full.iter().zip(&b.region.full);
        assert!(held.into_iter().all(|(a, b)| !*a || *b));
        assert!(b.left[0] <= a.left[0] && b.cost.yarn_nodes >= a.cost.yarn_nodes);
        sizes.push(b.cost.yarn_nodes);
    }
    sizes.dedup();
    assert!(sizes.len() > 3, "{sizes:?}");
}

/// A budget is kept to and spent, and what is told of nodes and unknowns is what the simulation has that is built, rings included.
#[test]
fn budgets_are_kept_to_and_spent() {
    let sim = placed(|x, y| [x, y, 2e-3 * (x / SIDE).powi(3) * (PI * x / 8e-3).sin()]);
    for (most, rings) in [
        (500, 0),
        (2000, 0),
        (5000, 0),
        (8000, 0),
        (3000, 1),
        (3000, 2),
    ] {
        let wish = Wish {
            rings,
            ..budget(most)
        };
        let found = suggested(&sim, &wish);
        let least = if most < 1000 { most / 4 } else { most * 4 / 5 };
        assert!(found.cost.yarn_nodes <= most && found.cost.yarn_nodes > least);
        let mut garment = garment();
        garment.blend_regions = found.regions;
        let built = sim_with(&garment, 1.0).info();
        let told = [
            found.cost.yarn_nodes,
            found.cost.carried_nodes,
            found.cost.unknowns,
            found.cost.triangles,
        ];
        let counted = [
            built.yarn_nodes,
            built.carried_nodes,
            built.unknowns,
            built.active_triangles,
        ];
        assert_eq!(told.map(|n| n as usize), counted, "{most}, {rings} rings");
    }
    // both wishes: the smaller region
    let both = Wish {
        tolerance: Some(0.1),
        ..budget(8000)
    };
    let [one, other] = [suggested(&sim, &both), suggested(&sim, &tolerance(0.1))];
    let smaller = other.cost.yarn_nodes.min(8000);
    assert!(one.cost.yarn_nodes <= smaller);
    // one that allows no piece of a region
    let none = suggested(&sim, &budget(10));
    assert!(none.regions.is_empty() && none.cost.yarn_nodes == 0);
}

/// A panel of a few triangles that lies flat is no hole of a region: it wants no yarns, whatever the tolerance and the budget.
#[test]
fn a_small_flat_panel_wants_no_yarns() {
    let mut small = garment();
    small.seams.clear();
    for panel in &mut small.panels {
        for vertex in &mut panel.vertices {
            *vertex *= 0.1;
        }
    }
    let sim = sim_with(&small, 1.0);
    assert!(sim.triangles().len() < 24, "{}", sim.triangles().len());
    for wish in [tolerance(1e-3), tolerance(1e3), budget(1)] {
        let found = suggested(&sim, &wish);
        assert!(found.regions.is_empty() && found.cost.yarn_nodes == 0);
        assert!(found.tolerance <= 1e3);
    }
}

/// Cloth that is strained beyond all measure is yarn; positions whose strains would overflow are refused with the vertex.
#[test]
fn what_is_no_cloth_is_yarn_or_refused() {
    // stretched by 5e6, as far as places may be: all of it is far beyond the fit, and the errors are numbers
    let sim = placed(|x, y| [5e6 * x, 5e6 * y, 0.0]);
    let found = suggested(&sim, &tolerance(0.1));
    assert!(found.region.alpha.iter().all(|alpha| *alpha == 1.0));
    let mut sim = placed(|x, y| [x, y, 0.0]);
    let far = vec![[1e200; 3]; sim.positions().len()];
    let error = sim.set_positions(&far, None).unwrap_err();
    assert!(error.message.contains("position of vertex 0"), "{error}");
}

/// The polygons of a suggestion make its region again, with rings, and `alpha` makes the polygons.
#[test]
fn polygons_and_alpha_are_the_region() {
    let sim = placed(|x, y| {
        // a ring of waves around a smooth middle
        let r = (x - SIDE).hypot(y - 0.5 * SIDE);
        let on = f64::from(u8::from((0.018..0.034).contains(&r)));
        [x, y, 1e-3 * on * (PI * r / 6e-3).sin()]
    });
    for rings in [0, 2] {
        let wish = Wish {
            rings,
            ..tolerance(0.15)
        };
        let found = suggested(&sim, &wish);
        let mut garment = garment();
        garment.blend_regions.clone_from(&found.regions);
        let region = Region::new(&garment, sim.mesh()).expect("region");
        assert_eq!(region, found.region);
        let traced = trace::from_alpha(sim.mesh(), &found.region.alpha, rings).expect("regions");
        assert_eq!(traced, found.regions);
    }
    // a whole ring on one panel has a hole
    let mesh = sim.mesh();
    let alpha: Vec<f64> = (mesh.uv.iter().zip(&mesh.vertex_panel))
        .map(|(p, panel)| {
            let r = (p - Vec2::new(0.5, 0.5) * SIDE).norm();
            f64::from(u8::from(*panel == 0 && (0.012..0.033).contains(&r)))
        })
        .collect();
    let mut garment = garment();
    garment.blend_regions = trace::from_alpha(mesh, &alpha, 0).expect("regions");
    assert_eq!(garment.blend_regions.len(), 1);
    let region = Region::new(&garment, mesh).expect("region");
    for (t, tri) in mesh.triangles.iter().enumerate() {
        let all = tri.iter().all(|v| alpha[*v as usize] == 1.0);
        assert_eq!(region.full[t], all, "{t}");
    }
    let middle = region.alpha.iter().zip(&mesh.uv).zip(&mesh.vertex_panel);
    for ((alpha, p), panel) in middle {
        let r = (p - Vec2::new(0.5, 0.5) * SIDE).norm();
        assert!(*panel == 1 || r > 0.01 || *alpha == 0.0);
    }
}

/// Drapes on one thread and on three give the same region, bit by bit.
#[test]
fn regions_do_not_depend_on_threads() {
    let found = [1.0, 3.0].map(|threads| {
        let mut sim = sim_with(&garment(), threads);
        let start: Vec<[f64; 3]> = (sim.positions().iter())
            .map(|p| [0.98 * p.x, p.y, 1e-3 * (PI * p.x / 0.012).sin()])
            .collect();
        sim.set_positions(&start, None).expect("positions");
        let ends: Vec<u32> = (0..start.len() as u32)
            .filter(|v| {
                let x = start[*v as usize][0] / 0.98;
                !(1e-9..=2.0 * SIDE - 1e-9).contains(&x)
            })
            .collect();
        sim.pin(&ends, None).expect("pins");
        let options = DrapeOptions {
            force_tolerance: 1e-6,
            max_steps: 60,
        };
        sim.drape(&options, &mut |_| true).expect("drape");
        suggested(&sim, &budget(3000))
    });
    assert!(found[0].region.full.contains(&true));
    assert_eq!(found[0], found[1]);
}

/// What cannot be answered is refused, with the number and its limit.
#[test]
fn wishes_that_cannot_be_are_refused() {
    let sim = placed(|x, y| [x, y, 0.0]);
    let refused = |wish: Wish, words: &str| {
        let text = sim.suggest_region(&wish).unwrap_err().message;
        assert!(text.contains(words), "{text}");
    };
    refused(Wish::default(), "tolerance or a budget");
    for t in [-0.1, 0.0, 1e-4, f64::NAN, f64::INFINITY] {
        refused(tolerance(t), "from 0.001 to 1000");
    }
    refused(budget(0), "budget of 0");
    let rings = Wish {
        rings: 4,
        ..tolerance(0.1)
    };
    refused(rings, "at most 3");
    let mut yarns = garment();
    yarns.blend_regions =
        trace::from_alpha(sim.mesh(), &vec![1.0; sim.mesh().uv.len()], 0).unwrap();
    let error = sim_with(&yarns, 1.0)
        .suggest_region(&tolerance(0.1))
        .unwrap_err();
    assert!(
        error.message.contains("nodes of yarns in 2 regions"),
        "{error}"
    );
    let mut bare = garment();
    bare.fabrics[0].yarns = None;
    let error = sim_with(&bare, 1.0)
        .suggest_region(&tolerance(0.1))
        .unwrap_err();
    assert!(
        error.message.contains("no panel has a fabric with yarns"),
        "{error}"
    );
    let n = sim.mesh().uv.len();
    for (alpha, words) in [
        (vec![0.0; n - 1], "values of alpha for"),
        (vec![-0.5; n], "alpha[0] = -0.5"),
        (vec![f64::NAN; n], "alpha[0] = NaN"),
        (vec![0.5; n], "no triangle has an alpha of 1"),
    ] {
        let text = trace::from_alpha(sim.mesh(), &alpha, 0)
            .unwrap_err()
            .message;
        assert!(text.contains(words), "{text}");
    }
}
