//! Reports of speed against error: what is compared, and what is not.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::pattern::BlendRegion;
use toile::report::{Kind, Report, rivals, run, same_cost};
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Outcome};
use toile::sim_scene::build;

/// A square held at two edges that sags between them, with a region of yarns in its middle.
fn scene(max_steps: u32, region: &str) -> Scene {
    let text = format!(
        r#"{{"toile": 1, "name": "hung <square>",
            "garment": {{"toile_garment": 1, "name": "g", "edge_length": 0.005,
                "panels": [{{"name": "p", "fabric": "y",
                    "vertices": [[0, 0], [0.03, 0], [0.03, 0.03], [0, 0.03]],
                    "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
                "fabrics": [{{"name": "y", "density": 0.3,
                    "membrane": {{"warp": 1963.5, "weft": 1963.5, "shear": 40, "coupling": 0}},
                    "yarns": {{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025,
                        "young": 1e7, "shear": 1.6e5, "density": 1.5e-4}}}}],
                "blend_regions": [{region}]}},
            "gravity": [0, 0, -9.81],
            "pins": [{{"panel": "p", "edge": 1}}, {{"panel": "p", "edge": 3}}],
            "numbers": {{"yarn.sliding": 0, "solver.drape.force_tolerance": 1e-9,
                "solver.drape.max_steps": {max_steps}}}}}"#
    );
    Scene::from_json(&text, None).expect("scene")
}

const MIDDLE: &str = r#"{"panel": "p", "polygon": [[0.0045, 0.0045], [0.0255, 0.0045],
    [0.0255, 0.0255], [0.0045, 0.0255]]}"#;

fn check(report: &Report) {
    let lines: Vec<String> = report.to_csv().lines().map(str::to_owned).collect();
    assert_eq!(lines.len(), 1 + report.rows.len());
    let columns = lines[0].split(',').count();
    for (line, row) in lines[1..].iter().zip(&report.rows) {
        let quotes = |text: &str| text.matches('"').count();
        // a comma between quotes parts nothing
        let fields = (0..line.len())
            .filter(|i| line[*i..].starts_with(',') && quotes(&line[..*i]) % 2 == 0)
            .count();
        assert_eq!(fields + 1, columns, "{line}");
        assert!(line.starts_with(&format!("\"{}\",", row.name)), "{line}");
    }
    let json = report.to_json();
    assert_eq!(
        json["models"].as_array().expect("models").len(),
        report.rows.len()
    );
    let page = report.to_html();
    assert!(page.contains("hung &lt;square&gt;") && !page.contains("<square>"));
    for row in &report.rows {
        // what did not come to rest, and only that, has a reason and no error
        assert_eq!(
            row.deviation.is_some(),
            row.reason.is_empty() && !row.reference,
            "{row:?}"
        );
        assert!(!row.front || row.deviation.is_some());
        assert!(page.contains(&row.name));
    }
}

/// Models of one scene are compared with the one of most yarns that came to rest; full yarn here.
#[test]
fn models_are_compared_with_the_most_detailed_one_at_rest() {
    let mut names = Vec::new();
    let report = run(&scene(2000, MIDDLE), &mut |name| {
        names.push(name.to_owned())
    })
    .expect("report");
    check(&report);
    for row in &report.rows {
        println!(
            "{} {:?} {} {:?}",
            row.name, row.outcome, row.reason, row.deviation
        );
    }
    assert_eq!(names.len(), report.rows.len());
    let reference: Vec<_> = report.rows.iter().filter(|r| r.reference).collect();
    assert_eq!(reference.len(), 1);
    let most = report.rows.iter().map(|r| r.yarn_nodes).max();
    assert_eq!(Some(reference[0].yarn_nodes), most);
    assert_eq!(reference[0].kind, Kind::Yarns);
    let compared: Vec<_> = report
        .rows
        .iter()
        .filter(|r| r.deviation.is_some())
        .collect();
    assert!(compared.len() >= 3);
    for row in &compared {
        // what sags little does so nearly alike by every model
        let error = row.deviation.unwrap().error;
        assert!(error < 1e-3, "{row:?}");
    }
    for a in compared.iter().filter(|a| a.front) {
        for b in &compared {
            let better =
                b.seconds < a.seconds && b.deviation.unwrap().error < a.deviation.unwrap().error;
            assert!(!better, "{} beats {}", b.name, a.name);
        }
    }
    assert!(compared.iter().any(|r| r.front));
}

/// Drapes that were cut short are listed, and not compared.
#[test]
fn drapes_that_did_not_come_to_rest_are_not_compared() {
    let mut report = run(&scene(1, MIDDLE), &mut |_| ()).expect("report");
    check(&report);
    let mut short = 0;
    for row in &report.rows {
        if row.outcome != Some(Outcome::Converged) {
            assert!(
                row.deviation.is_none() && !row.front && !row.reference,
                "{row:?}"
            );
            assert!(!row.reason.is_empty());
        }
        short += usize::from(row.reason == "not at rest: iteration_limit");
    }
    assert!(short >= 3, "{report:?}");
    for row in &mut report.rows {
        row.deviation = None;
    }
    assert!(report.to_html().contains("No two models to compare"));
}

/// A scene without regions, or without a drape, is refused.
#[test]
fn scenes_with_nothing_to_compare_are_refused() {
    let error = run(&scene(1, ""), &mut |_| ()).unwrap_err();
    assert!(error.message.contains("blend regions"), "{error}");
    let mut moving = scene(1, MIDDLE);
    moving.run.drape = false;
    let error = run(&moving, &mut |_| ()).unwrap_err();
    assert!(error.message.contains("drapes"), "{error}");
}

/// The drape of a scene by triangles alone, and what is suggested for no more nodes than its own regions have.
fn suggested(scene: &Scene) -> Vec<BlendRegion> {
    let mut bare = scene.clone();
    bare.garment.blend_regions.clear();
    let mut sim = build(&bare).expect("sim");
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    sim.drape(&options, &mut |_| true).expect("drape");
    let wish = same_cost(scene).expect("wish");
    sim.suggest_region(&wish).expect("suggestion").regions
}

/// Where a seam puckers, yarns in a suggested region err less than in the strips that the example has, with no more nodes.
#[test]
fn a_suggested_region_beats_a_drawn_one_of_the_same_cost() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pucker.json");
    let scene = Scene::from_file(&path).expect("scene");
    let report = rivals(&scene, &suggested(&scene), &mut |_| ()).expect("report");
    let [triangles, drawn, suggested, yarns] = &report.rows[..] else {
        panic!("{} models", report.rows.len());
    };
    let error = |row: &toile::report::Row| row.deviation.unwrap().error;
    println!("{} {} {}", error(triangles), error(drawn), error(suggested));
    assert!(suggested.yarn_nodes <= drawn.yarn_nodes && yarns.reference);
    assert!(error(suggested) < error(drawn));
    assert!(error(suggested) < 0.2 * error(triangles));
    let refused = same_cost(&self::scene(1, "")).unwrap_err();
    assert!(refused.message.contains("it has none"), "{refused}");
}
