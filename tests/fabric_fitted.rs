//! Triangles that take the material fitted to the yarns of their fabric: what they take, how knits hang and curl.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::yarn_sims::patch;
use toile::fmi::table::{Sizes, variables};
use toile::math::Vec3;
use toile::pattern::export::fabric_to_json;
use toile::pattern::import::{fabric_from_json, garment_from_json};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome, Sim, SimOptions};
use toile::sim_scene::build;

/// A fabric that asks for it has the fitted material in a simulation, its own rest; one that is not laid at its size at rest is
/// refused beside yarns, one without yarns always.
#[test]
fn triangles_take_the_material_of_their_yarns() {
    let text = |yarns: &str| {
        let middle = "[[0.006, 0.006], [0.014, 0.006], [0.014, 0.014], [0.006, 0.014]]";
        patch(yarns, 0.02, 0.02, middle)
            .replace(r#""name": "y","#, r#""name": "y", "triangles": "fitted","#)
    };
    let made = |text: &str| {
        let garment = garment_from_json(text, None)?;
        Sim::new(&garment, &SimOptions::default())
    };
    let weave = made(&text(r#"{"preset": "plain shirting"}"#)).unwrap();
    let stiffness = 1e7 * std::f64::consts::PI * 1.25e-4_f64.powi(2) / 5e-4;
    let fabric = &weave.garment().fabrics[0];
    assert!((fabric.weft / stiffness - 1.0).abs() < 0.01, "{fabric:?}");
    assert!((fabric.density / 0.1473 - 1.0).abs() < 0.01, "{fabric:?}");
    let error = made(&text(r#"{"preset": "sweater"}"#)).err().unwrap();
    assert!(error.message.contains("compensated"), "{}", error.message);
    let knit = made(&text(r#"{"preset": "sweater", "compensated": true}"#)).unwrap();
    let fabric = &knit.garment().fabrics[0];
    assert!(!fabric.ridges.is_empty() && fabric.curvature_weft != 0.0);
    let (read, _) = fabric_from_json(&fabric_to_json(fabric).unwrap()).unwrap();
    assert_eq!(&read, fabric);
    for text in [
        r#"{"triangles": "fitted"}"#,
        r#"{"triangles": "measured"}"#,
        r#"{"bending": {"model": "quadratic", "curvature_weft": 1}}"#,
    ] {
        assert!(fabric_from_json(text).is_err(), "{text}");
    }
}

/// The example's panel at rest, changed; its mesh is the same in all.
fn hung(change: impl Fn(&mut Scene)) -> Sim {
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(dir.join("knit_panel.json")).unwrap();
    let mut scene = Scene::from_json(&text, Some(&dir)).unwrap();
    change(&mut scene);
    let mut sim = build(&scene).unwrap();
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).unwrap();
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    sim
}

/// Mean place of the vertices laid here.
fn mean(sim: &Sim, here: impl Fn(f64, f64) -> bool) -> Vec3 {
    let laid = sim.mesh().uv.iter().zip(sim.positions());
    let found: Vec<Vec3> = laid
        .filter(|(uv, _)| here(uv.x, uv.y))
        .map(|(_, x)| *x)
        .collect();
    assert!(!found.is_empty());
    found.iter().sum::<Vec3>() / found.len() as f64
}

/// Fitted triangles let a garter panel sag as far as one whose middle is yarns, within a tenth.
#[test]
fn a_knit_hangs_by_its_triangles_as_by_its_yarns() {
    let sag = |sim: &Sim| -mean(sim, |_, v| v < 1e-9).y;
    let mixed = sag(&hung(|_| ()));
    let triangles = sag(&hung(|scene| scene.garment.blend_regions.clear()));
    let given = sag(&hung(|scene| {
        scene.garment.blend_regions.clear();
        scene.garment.fabrics[0].fitted = false;
    }));
    println!("sag {mixed} m mixed, {triangles} m of triangles, {given} m of given ones");
    assert!(triangles > 0.005 && given < 0.001, "{triangles} {given}");
    assert!((triangles / mixed - 1.0).abs() < 0.1, "{triangles} {mixed}");
}

/// Jersey's triangles curl as jersey does: the lower edge to the front, the sides to the back.
#[test]
fn triangles_of_jersey_curl() {
    let sim = hung(|scene| {
        scene.garment.blend_regions.clear();
        let fabric = &mut scene.garment.fabrics[0];
        fabric.yarns = Some(toile::pattern::YarnFabric::preset("jersey").unwrap());
    });
    let depth = |here: &dyn Fn(f64, f64) -> bool| mean(&sim, here).z;
    let halfway = |v: f64| (0.04..0.06).contains(&v);
    let lower = depth(&|_, v| v < 1e-9) - depth(&|_, v| (0.015..0.025).contains(&v));
    let sides = depth(&|u, v| !(1e-9..=0.08 - 1e-9).contains(&u) && halfway(v))
        - depth(&|u, v| (0.02..0.06).contains(&u) && halfway(v));
    println!("lower edge {lower} m, sides {sides} m to the front");
    assert!(lower > 2e-3, "{lower}");
    assert!(sides < -1e-3, "{sides}");
}

/// What the fit decides is no parameter of an FMU; what is given still is.
#[test]
fn an_fmu_has_no_parameters_that_the_fit_decides() {
    let dir = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(dir.join("knit_panel.json")).unwrap();
    for (fitted, has) in [("fitted", false), ("given", true)] {
        let text = text.replace(
            "\"triangles\": \"fitted\"",
            &format!("\"triangles\": \"{fitted}\""),
        );
        let scene = Scene::from_json(&text, Some(&dir)).unwrap();
        let sizes = Sizes {
            vertices: 3,
            triangles: 1,
            nodes: 0,
            probes: Vec::new(),
        };
        let list = variables(&scene, &sizes);
        let known = |name: &str| {
            list.iter()
                .any(|v| v.name == format!("fabric.garter.{name}"))
        };
        assert!(known("friction"));
        for name in ["density", "membrane.warp", "bending.weft"] {
            assert_eq!(known(name), has, "{name}");
        }
    }
}
