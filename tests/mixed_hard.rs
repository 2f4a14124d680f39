//! Regions of yarns where they are hard: tiny, many, at pins, at bodies, across seams. Nothing is lost, nothing
//! becomes NaN, and what cannot work is refused by name.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::blend::trace;
use toile::body::Body;
use toile::error::{Error, Status};
use toile::math::Vec3;
use toile::pattern::export::garment_to_json;
use toile::pattern::import::garment_from_json;
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Sim, SimOptions};

/// A weave of this pitch with a membrane like it, `factor` times as stiff.
pub(crate) fn weave(pitch: f64, factor: f64) -> String {
    let radius = 0.25 * pitch;
    let area = std::f64::consts::PI * radius * radius;
    let stretch = factor * 1e7 * area / pitch;
    format!(
        r#"{{"name": "y", "density": 0.3,
            "membrane": {{"warp": {stretch}, "weft": {stretch}, "shear": {}, "coupling": 0}},
            "yarns": {{"weave": "plain", "warp_pitch": {pitch}, "radius": {radius},
                "young": 1e7, "shear": {}, "density": {}}}}}"#,
        40.0 * factor,
        10.0 * pitch / (radius * radius),
        0.15 * pitch
    )
}

/// Panels, each a square of 3 cm at an offset along x [m], with the polygons of its regions.
pub(crate) fn garment(fabric: &str, edge: f64, panels: &[(f64, &[&str])], seams: &str) -> String {
    let mut regions = Vec::new();
    let mut squares = Vec::new();
    for (k, (x, polygons)) in panels.iter().enumerate() {
        squares.push(format!(
            r#"{{"name": "p{k}", "fabric": "y", "placement": {{"translation": [{x}, 0, 0]}},
                "vertices": [[0, 0], [0.03, 0], [0.03, 0.03], [0, 0.03]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}"#
        ));
        for polygon in *polygons {
            regions.push(format!(r#"{{"panel": "p{k}", "polygon": {polygon}}}"#));
        }
    }
    format!(
        r#"{{"toile_garment": 1, "name": "hard", "edge_length": {edge}, "panels": [{}],
            "fabrics": [{fabric}], "seams": [{seams}], "blend_regions": [{}]}}"#,
        squares.join(","),
        regions.join(",")
    )
}

pub(crate) fn make(text: &str, gravity: f64) -> Result<Sim, Error> {
    let garment = garment_from_json(text, None).expect("garment");
    let options = SimOptions {
        gravity: Some([0.0, 0.0, gravity]),
        ..SimOptions::default()
    };
    Sim::new(&garment, &options)
}

/// Holds the corners of the first panel that move by themselves.
pub(crate) fn hold_corners(sim: &mut Sim) {
    let active = sim.active_vertices();
    let corners = [[0.0, 0.0], [0.03, 0.0], [0.03, 0.03], [0.0, 0.03]];
    let held: Vec<u32> = corners
        .iter()
        .map(|uv| sim.locate(0, *uv).expect("vertex"))
        .filter(|v| active[*v as usize])
        .collect();
    sim.pin(&held, None).expect("pin");
}

pub(crate) fn is_sound(sim: &Sim, what: &str) {
    let near = |p: &Vec3| p.iter().all(|c| c.is_finite() && c.abs() < 1.0);
    assert!(sim.positions().iter().all(near), "{what}");
    assert!(sim.yarn_nodes().iter().all(near), "{what}");
    let strain = sim.report().expect("report").max_edge_strain;
    assert!(strain < 0.3, "{what}: strain {strain}");
}

pub(crate) fn fall(text: &str, what: &str, steps: usize) -> Sim {
    let mut sim = make(text, -9.81).expect(what);
    hold_corners(&mut sim);
    for _ in 0..steps {
        let _ = sim.step(5e-3).expect(what);
    }
    is_sound(&sim, what);
    sim
}

/// Regions of any shape and number move on as one cloth.
#[test]
fn regions_of_any_shape_stay_sound() {
    let fabric = weave(1e-3, 1.0);
    let cases: &[(&str, &[&str])] = &[
        (
            "middle",
            &["[[0.009, 0.009], [0.021, 0.009], [0.021, 0.021], [0.009, 0.021]]"],
        ),
        (
            "at a rim",
            &["[[-1, -1], [0.0101, -1], [0.0101, 1], [-1, 1]]"],
        ),
        (
            "at a corner that is held",
            &["[[-1, -1], [0.0151, -1], [0.0151, 0.0151], [-1, 0.0151]]"],
        ),
        (
            "two that may touch",
            &[
                "[[0.004, 0.004], [0.0151, 0.004], [0.0151, 0.0151], [0.004, 0.0151]]",
                "[[0.0149, 0.0149], [0.026, 0.0149], [0.026, 0.026], [0.0149, 0.026]]",
            ],
        ),
        (
            "all but a hole",
            &[
                "[[-1, -1], [1, -1], [1, 0.0101], [-1, 0.0101]]",
                "[[-1, 0.0199], [1, 0.0199], [1, 1], [-1, 1]]",
                "[[-1, -1], [0.0101, -1], [0.0101, 1], [-1, 1]]",
                "[[0.0199, -1], [1, -1], [1, 1], [0.0199, 1]]",
            ],
        ),
    ];
    for (what, regions) in cases {
        let text = garment(&fabric, 0.005, &[(0.0, regions)], "");
        let sim = fall(&text, what, 8);
        let info = sim.info();
        println!(
            "{what}: {} nodes, {} carried, {} of {} triangles",
            info.yarn_nodes, info.carried_nodes, info.active_triangles, info.triangles
        );
        assert!(
            info.carried_nodes > 0 && info.active_triangles > 0,
            "{what}"
        );
    }
}

/// Regions that leave a corner of a panel, all of whose yarns they reach, take it in: a vertex without any mass could not move.
#[test]
fn corners_that_a_region_cuts_off_are_taken_in() {
    let region = |width: f64| format!(r#"{{"panel": "p", "edge": 2, "width": {width}}}"#);
    let text = |region: &str| {
        format!(
            r#"{{"toile_garment": 1, "name": "tip", "edge_length": 3e-3,
                "fabrics": [{{"name": "f", "yarns": {{"preset": "sweater"}}}}],
                "panels": [{{"name": "p", "fabric": "f", "vertices": [[0, 0], [0.024, 0], [0.0096, 0.016]],
                    "edges": [[0, 1], [1, 2], [2, 0]]}}],
                "blend_regions": [{region}]}}"#
        )
    };
    let mut random = crate::sheets::Random::new(5);
    for k in 0..24 {
        let region = if k < 12 {
            region(0.015 + 4e-4 * f64::from(k))
        } else {
            let [x, y] = [
                0.012 + 0.012 * random.signed(),
                0.008 + 0.008 * random.signed(),
            ];
            let radius = 0.014 + 0.008 * random.signed();
            format!(r#"{{"panel": "p", "disc": {{"center": [{x}, {y}], "radius": {radius}}}}}"#)
        };
        let mut sim = match make(&text(&region), -9.81) {
            Ok(sim) => sim,
            // a disc that hardly meets the panel
            Err(e) => {
                assert!(
                    k >= 12 && e.message.contains("holds no triangle"),
                    "{region}: {e}"
                );
                continue;
            }
        };
        let masses = sim.point_masses();
        let active = sim.active_vertices();
        for (v, mass) in masses.iter().enumerate().take(active.len()) {
            assert!(!active[v] || *mass > 0.0, "{region}: vertex {v}");
        }
        for _ in 0..3 {
            let _ = sim.step(1e-3).expect(&region);
        }
        is_sound(&sim, &region);
    }
}

/// Regions of random vertices, ragged and with holes, come in and move on by steps of 0.1 to 20 ms.
#[test]
fn regions_of_noise_stay_sound() {
    let mut random = crate::sheets::Random::new(11);
    let mut accepted = 0;
    for case in 0..8 {
        let mut sim =
            make(&garment(&weave(1e-3, 1.0), 0.005, &[(0.0, &[])], ""), -9.81).expect("sim");
        let mut held: Vec<u32> = (0..sim.positions().len() as u32).collect();
        held.retain(|v| sim.vertex_uv()[*v as usize].y > 0.03 - 1e-9);
        sim.pin(&held, None).expect("pin");
        let alpha: Vec<f64> = (0..sim.positions().len())
            .map(|_| (0.5 + random.signed()).clamp(0.0, 1.0))
            .collect();
        let rings = case % 3;
        let what = format!("case {case}, {rings} rings");
        let Ok(regions) = trace::from_alpha(sim.mesh(), &alpha, rings) else {
            assert!(
                (0..sim.triangles().len())
                    .all(|t| { sim.triangles()[t].iter().any(|v| alpha[*v as usize] < 1.0) })
            );
            continue;
        };
        match sim.set_blend_regions(regions) {
            Ok(change) => assert!(change.laid > 0, "{what}"),
            // too few nodes in a ring, or nothing that can take a pin's place
            Err(e) => {
                let refused = [Status::Geometry, Status::State].contains(&e.status);
                assert!(refused && rings > 0, "{what}: {e}");
                continue;
            }
        }
        accepted += 1;
        for dt in [1e-4, 1e-3, 5e-3, 0.02] {
            let _ = sim.step(dt).expect(&what);
        }
        is_sound(&sim, &what);
    }
    assert!(accepted >= 4, "{accepted}");
}

/// Every single triangle may be the region, whatever the ratio of triangles to yarns, and its fabric may
/// be a hundred times softer or stiffer than its yarns.
#[test]
fn a_region_of_one_triangle_stays_sound() {
    for (pitch, factor) in [
        (1e-3, 1.0),
        (4e-3, 1.0),
        (5e-4, 1.0),
        (4e-4, 1.0),
        (1e-3, 0.01),
        (1e-3, 100.0),
    ] {
        let fabric = weave(pitch, factor);
        let edge = 0.012;
        let plain = make(&garment(&fabric, edge, &[(0.0, &[])], ""), 0.0).expect("plain");
        for (t, triangle) in plain.triangles().iter().enumerate() {
            let corners = triangle.map(|v| plain.vertex_uv()[v as usize]);
            let polygon: Vec<String> = corners
                .iter()
                .map(|p| format!("[{}, {}]", p.x, p.y))
                .collect();
            let region = format!("[{}]", polygon.join(","));
            let text = garment(&fabric, edge, &[(0.0, &[&region])], "");
            let what = format!("triangle {t}, pitch {pitch}, factor {factor}");
            match make(&text, -9.81) {
                Ok(_) => {
                    let sim = fall(&text, &what, 3);
                    assert_eq!(sim.info().active_triangles + 1, sim.info().triangles);
                }
                // coarse yarns may not pass a triangle at all, or too few to carry a vertex of its own
                Err(e) => {
                    assert!(pitch > 3e-3, "{what}: {e}");
                    assert_eq!(e.status, Status::Geometry, "{what}: {e}");
                }
            }
        }
    }
}

/// Mixed cloth lies on a ball that reaches under both its parts.
#[test]
fn mixed_cloth_lies_on_a_ball() {
    let region = "[[-1, -1], [0.0151, -1], [0.0151, 1], [-1, 1]]";
    let text = garment(&weave(1e-3, 1.0), 0.005, &[(0.0, &[region])], "");
    let mut sim = make(&text, -9.81).expect("sim");
    let body = Body::sphere(0.02).expect("ball");
    let contact = ContactSettings {
        thickness: 1e-3,
        ..ContactSettings::default()
    };
    let ball = sim.add_body(&body, &contact).expect("body");
    let below = [0.015, 0.015, -0.0215];
    sim.set_body_pose(ball, below, [0.0, 0.0, 0.0, 1.0])
        .expect("pose");
    for _ in 0..20 {
        let report = sim.step(5e-3).expect("step");
        assert!(report.min_gap > -1e-3, "{report:?}");
    }
    is_sound(&sim, "ball");
    let (force, _) = sim.body_wrench(ball).expect("wrench");
    println!("the ball bears {:.3e} N", -force[2]);
    assert!(force[2] < 0.0, "{force:?}");
}

/// A panel of yarns sewn to one of triangles, side by side and pulled by half a percent: the seam holds, and the far
/// side moves on as it does between triangles, however the region lies.
#[test]
fn a_seam_joins_yarns_to_triangles() {
    let fabric = weave(1e-3, 1.0);
    let strain = 0.005;
    let whole = "[[-1, -1], [1, -1], [1, 1], [-1, 1]]";
    let lower = "[[-1, -1], [1, -1], [1, 0.0151], [-1, 0.0151]]";
    let upper = "[[-1, 0.0149], [1, 0.0149], [1, 1], [-1, 1]]";
    let near = "[[0.0149, -1], [1, -1], [1, 1], [0.0149, 1]]";
    let middle = "[[0.009, 0.009], [1, 0.009], [1, 0.021], [0.009, 0.021]]";
    let run = |left: &[&str], right: &[&str], what: &str| {
        let seam = r#"{"a": ["p0", 1], "b": ["p1", 3]}"#;
        let text = garment(&fabric, 0.005, &[(0.0, left), (0.03, right)], seam);
        let mut sim = make(&text, 0.0).expect(what);
        let active = sim.active_vertices();
        let mesh = sim.yarns().cloned().unwrap_or_default();
        // both far rims are held, be they vertices or nodes
        let pull = |p: Vec3| [p.x + strain * 0.06 * (p.x / 0.06), p.y, p.z];
        let far = |panel: u32, x: f64| (panel == 0 && x < 1e-9) || (panel == 1 && x > 0.03 - 1e-9);
        let vertices: Vec<u32> = (0..active.len())
            .filter(|v| active[*v] && far(sim.vertex_panels()[*v], sim.vertex_uv()[*v].x))
            .map(|v| v as u32)
            .collect();
        let nodes: Vec<u32> = (0..mesh.uv.len())
            .filter(|n| sim.active_yarn_nodes()[*n] && far(mesh.node_panel[*n], mesh.uv[*n].x))
            .map(|n| n as u32)
            .collect();
        let places = |list: &[u32], from: &[Vec3]| -> Vec<[f64; 3]> {
            list.iter().map(|i| pull(from[*i as usize])).collect()
        };
        let (a, b) = (
            places(&vertices, sim.positions()),
            places(&nodes, sim.yarn_nodes()),
        );
        sim.pin(&vertices, Some(&a)).expect(what);
        sim.pin_yarn_nodes(&nodes, Some(&b)).expect(what);
        let options = DrapeOptions {
            force_tolerance: 1e-6,
            max_steps: 0,
        };
        let report = sim.drape(&options, &mut |_| true).expect(what);
        assert_eq!(report.outcome, Outcome::Converged, "{what}: {report:?}");
        is_sound(&sim, what);
        // mean displacement of the right panel away from its rims
        let moved: Vec<f64> = (0..active.len())
            .filter(|v| {
                let x = sim.vertex_uv()[*v].x;
                sim.vertex_panels()[*v] == 1 && x > 4e-3 && x < 0.026
            })
            .map(|v| sim.positions()[v].x - sim.vertex_uv()[v].x - 0.03)
            .collect();
        let mean = moved.iter().sum::<f64>() / moved.len() as f64;
        println!(
            "{what}: right side moved by {:.2} um, gap {:.2} um, {} carried",
            1e6 * mean,
            1e6 * report.max_seam_gap,
            sim.info().carried_nodes
        );
        (mean, report.max_seam_gap)
    };
    let (plain, gap) = run(&[], &[], "triangles");
    let cases: &[(&str, &[&str], &[&str])] = &[
        ("yarns left", &[whole], &[]),
        ("yarns right", &[], &[whole]),
        ("yarns beside the seam", &[near], &[]),
        ("lower part left", &[lower], &[]),
        ("crosswise", &[lower], &[upper]),
        ("across", &[lower], &[lower]),
        ("middle of the seam", &[middle], &[]),
    ];
    for (what, left, right) in cases {
        let (moved, open) = run(left, right, what);
        // to a twentieth of what the strain makes of a panel
        assert!(
            (moved - plain).abs() < 0.05 * strain * 0.03,
            "{what}: {moved} {plain}"
        );
        assert!(open < 3.0 * gap, "{what}: {open} {gap}");
    }
}

/// What cannot work is refused, with place and reason.
#[test]
fn regions_that_cannot_be_are_refused() {
    let fabric = weave(1e-3, 1.0);
    let refused = |text: &str| make(text, 0.0).err().expect("refused");
    let tiny = "[[0.0101, 0.0101], [0.0102, 0.0101], [0.0101, 0.0102]]";
    let error = refused(&garment(&fabric, 0.005, &[(0.0, &[tiny])], ""));
    assert_eq!(error.status, Status::Argument);
    assert!(
        error.message.contains("holds no triangle of panel 'p0'"),
        "{error}"
    );
    assert!(error.message.contains("blend_regions[0]"), "{error}");
    let half = "[[-1, -1], [0.0151, -1], [0.0151, 1], [-1, 1]]";
    let text = garment(&fabric, 0.005, &[(0.0, &[half])], "");
    let mut sim = make(&text, 0.0).expect("sim");
    let carried = sim
        .active_yarn_nodes()
        .iter()
        .position(|a| !a)
        .expect("carried");
    let error = sim
        .pin_yarn_nodes(&[carried as u32], None)
        .expect_err("carried");
    assert!(error.message.contains("rides on triangles"), "{error}");
    let follower = sim
        .active_vertices()
        .iter()
        .position(|a| !a)
        .expect("follower");
    assert!(sim.pin(&[follower as u32], None).is_err());
}

/// Discs, and what is near an edge or on both sides of a seam: the triangles whose corners are, as a garment that is written and read
/// again says too.
#[test]
fn regions_are_discs_and_what_is_beside_edges_and_seams() {
    let seam = r#"{"a": ["p0", 1], "b": ["p1", 3]}"#;
    let text = garment(&weave(1e-3, 1.0), 3e-3, &[(0.0, &[]), (0.03, &[])], seam);
    let with = |regions: &str| {
        let place = r#""blend_regions": ["#;
        text.replace(place, &format!("{place}{regions}"))
    };
    let disc = r#"{"panel": "p0", "disc": {"center": [0.012, 0.011], "radius": 0.0081}}"#;
    let edge = r#"{"panel": "p0", "edge": 0, "width": 0.007}"#;
    let both = r#"{"seam": 0, "width": 0.0091, "rings": 0}"#;
    type Holds<'a> = &'a dyn Fn(u32, f64, f64) -> bool;
    let far = 1e-9;
    let cases: [(&str, Holds<'_>); 3] = [
        (disc, &|p, u, v| {
            p == 0 && (u - 0.012).hypot(v - 0.011) <= 0.0081 + far
        }),
        (edge, &|p, _, v| p == 0 && v <= 0.007 + far),
        (both, &|p, u, _| {
            if p == 0 {
                u >= 0.03 - 0.0091 - far
            } else {
                u <= 0.0091 + far
            }
        }),
    ];
    for (region, holds) in cases {
        let sim = make(&with(region), 0.0).expect(region);
        let mesh = sim.mesh();
        let inside = |v: &u32| {
            let (panel, uv) = (mesh.vertex_panel[*v as usize], mesh.uv[*v as usize]);
            holds(panel, uv.x, uv.y)
        };
        let whole = mesh.triangles.iter().filter(|t| t.iter().all(inside));
        let left = sim.info().active_triangles;
        let taken = sim.info().triangles - left;
        assert!(taken > 3 && taken == whole.count(), "{region}: {taken}");
        let json = garment_to_json(sim.garment()).expect("json");
        let again = garment_from_json(&json, None).expect("garment");
        assert_eq!(again.blend_regions, sim.garment().blend_regions);
        let twice = make(&json, 0.0).expect("again");
        assert_eq!(twice.save().unwrap(), sim.save().unwrap(), "{region}");
    }
    let refused = [
        (r#"{"panel": "p0"}"#, "one of 'polygon'"),
        (
            r#"{"panel": "p0", "edge": 0, "seam": 0, "width": 1}"#,
            "not 2",
        ),
        (r#"{"panel": "p0", "edge": 0}"#, "'width' is missing"),
        (
            r#"{"panel": "p0", "edge": 4, "width": 0.01}"#,
            "edge 4 of 4",
        ),
        (
            r#"{"panel": "p0", "edge": 0, "width": 0}"#,
            "must be positive",
        ),
        (r#"{"seam": 1, "width": 0.01}"#, "seam 1 of 1"),
        (r#"{"panel": "p0", "seam": 0, "width": 0.01}"#, "no meaning"),
        (
            r#"{"panel": "p0", "width": 1, "disc": {"center": [0, 0], "radius": 1}}"#,
            "no meaning",
        ),
        (
            r#"{"panel": "p0", "disc": {"center": [0, 0], "radius": -1}}"#,
            "must be positive",
        ),
        (
            r#"{"panel": "p0", "disc": {"center": [0, 0]}}"#,
            "'radius' is missing",
        ),
    ];
    for (region, words) in refused {
        let read = garment_from_json(&with(region), None);
        let error = read.and_then(|g| g.check_geometry()).expect_err(region);
        assert!(error.message.contains(words), "{region}: {error}");
    }
}
