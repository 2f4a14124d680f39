//! Triangulation of the project's own and of awkward garments.

use crate::tri_common::{check_mesh, check_transfer};
use std::path::Path;
use toile::error::Status;
use toile::math::Vec2;
use toile::pattern::curve::Curve;
use toile::pattern::import::garment_from_file;
use toile::pattern::{Edge, EdgeRef, Fabric, Garment, Panel, Seam};
use toile::tri::grid::{rectangle, sheet_garment};
use toile::tri::triangulate;

fn example(name: &str) -> Garment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(format!("{name}.json"));
    garment_from_file(&path).unwrap().0
}

fn polygon(points: &[[f64; 2]]) -> Panel {
    let n = points.len() as u32;
    Panel {
        vertices: points.iter().map(|p| Vec2::new(p[0], p[1])).collect(),
        outline: (0..n)
            .map(|k| Edge {
                start: k,
                end: (k + 1) % n,
                curve: Curve::Line,
                label: None,
            })
            .collect(),
        ..rectangle("piece", 1.0, 1.0)
    }
}

fn garment(panels: Vec<Panel>, seams: Vec<Seam>, h: f64) -> Garment {
    Garment {
        panels,
        seams,
        ..sheet_garment(1.0, 1.0, h, Fabric::default())
    }
}

fn seam(a: (u32, u32), b: (u32, u32), same_direction: bool) -> Seam {
    let edge = |(panel, edge)| EdgeRef { panel, edge };
    Seam {
        a: edge(a),
        b: edge(b),
        same_direction,
        rest_angle: 0.25,
    }
}

#[test]
fn own_garments_keep_the_laws_of_meshes_on_all_levels() {
    for name in ["tshirt", "skirt", "two_panels"] {
        let garment = example(name);
        let fine = triangulate(&garment, 1.0, 100_000).unwrap();
        check_mesh(&garment, &fine);
        for scale in [0.5, 2.0, 4.0, 8.0] {
            let other = triangulate(&garment, scale, 100_000).unwrap();
            check_mesh(&garment, &other);
            check_transfer(&garment, &other, &fine);
        }
    }
}

#[test]
fn the_same_garment_gives_the_same_bits() {
    let garment = example("skirt");
    let first = triangulate(&garment, 1.0, 100_000).unwrap();
    for _ in 0..3 {
        assert_eq!(first, triangulate(&garment, 1.0, 100_000).unwrap());
    }
}

#[test]
fn a_clockwise_loop_gives_triangles_facing_the_other_way() {
    let mut panel = rectangle("back", 0.3, 0.2);
    panel.outline.reverse();
    for edge in &mut panel.outline {
        std::mem::swap(&mut edge.start, &mut edge.end);
    }
    let garment = garment(vec![panel], vec![], 0.02);
    let mesh = triangulate(&garment, 1.0, 10_000).unwrap();
    check_mesh(&garment, &mesh);
    for t in &mesh.triangles {
        let [a, b, c] = t.map(|v| mesh.placed[v as usize]);
        assert!((b - a).cross(&(c - a)).z < 0.0);
    }
}

#[test]
fn slits_slivers_and_sharp_corners_do_not_break_refinement() {
    let shapes: [&[[f64; 2]]; 6] = [
        // a dart with a mouth of 0.2 mm
        &[
            [0.0, 0.0],
            [0.3, 0.0],
            [0.3, 0.2],
            [0.1501, 0.2],
            [0.15, 0.08],
            [0.1499, 0.2],
            [0.0, 0.2],
        ],
        // a needle of 1 degree
        &[[0.0, 0.0], [0.5, 0.0], [0.5, 0.009]],
        // a ribbon 2 mm wide at edges of 20 mm
        &[[0.0, 0.0], [1.0, 0.0], [1.0, 0.002], [0.0, 0.002]],
        // an edge of 0.1 mm between long ones
        &[
            [0.0, 0.0],
            [0.3, 0.0],
            [0.3, 0.2],
            [0.2999, 0.2001],
            [0.0, 0.2],
        ],
        // nearly straight corner
        &[[0.0, 0.0], [0.2, 1e-7], [0.4, 0.0], [0.2, 0.3]],
        // a star of sharp corners
        &[
            [0.0, 0.0],
            [0.2, 0.01],
            [0.4, 0.0],
            [0.21, 0.02],
            [0.2, 0.3],
            [0.19, 0.02],
        ],
    ];
    for (k, shape) in shapes.iter().enumerate() {
        for h in [0.005, 0.02, 0.2] {
            let garment = garment(vec![polygon(shape)], vec![], h);
            let mesh = triangulate(&garment, 1.0, 200_000).unwrap();
            println!(
                "shape {k} h {h}: {} vertices, {:.2} degrees",
                mesh.uv.len(),
                mesh.min_angle.to_degrees()
            );
            check_mesh(&garment, &mesh);
        }
    }
}

#[test]
fn gathers_darts_and_same_direction_seams_tie_vertex_to_vertex() {
    // 3 : 1 gathering between two panels, a dart whose sides differ, a tube sewn to itself
    let wide = rectangle("wide", 0.9, 0.1);
    let narrow = rectangle("narrow", 0.3, 0.1);
    let dart = polygon(&[
        [0.0, 0.0],
        [0.3, 0.0],
        [0.3, 0.2],
        [0.17, 0.2],
        [0.15, 0.08],
        [0.12, 0.2],
        [0.0, 0.2],
    ]);
    let named = |mut panel: Panel, name: &str| {
        panel.name = name.into();
        panel
    };
    let garment = garment(
        vec![wide, narrow, named(dart, "dart")],
        vec![
            seam((0, 2), (1, 0), false),
            seam((0, 1), (0, 3), false),
            seam((2, 3), (2, 4), false),
            seam((1, 2), (2, 0), true),
        ],
        0.01,
    );
    for scale in [1.0, 3.0, 10.0] {
        let mesh = triangulate(&garment, scale, 100_000).unwrap();
        check_mesh(&garment, &mesh);
        assert!(mesh.seams.iter().all(|s| s.rest_angle == 0.25));
    }
}

#[test]
fn holes_beside_a_curve_are_cut_finer_instead_of_crossing() {
    // at a coarse level the chords of the neck line would cut through the hole
    let mut panel = rectangle("yoke", 0.4, 0.3);
    panel.outline[2].curve = Curve::Quadratic(Vec2::new(0.2, -0.15));
    let first = panel.vertices.len() as u32;
    panel
        .vertices
        .extend([Vec2::new(0.19, 0.055), Vec2::new(0.21, 0.055)]);
    let arc = |start, end| Edge {
        start,
        end,
        curve: Curve::Arc {
            radius: 0.01,
            large: false,
            right: true,
        },
        label: None,
    };
    panel.holes = vec![vec![arc(first, first + 1), arc(first + 1, first)]];
    let garment = garment(vec![panel], vec![], 0.01);
    garment.check().unwrap();
    for scale in [1.0, 5.0, 20.0] {
        let mesh = triangulate(&garment, scale, 100_000).unwrap();
        check_mesh(&garment, &mesh);
    }
}

#[test]
fn sizes_are_refused_before_memory_is_taken() {
    let garment = example("tshirt");
    for scale in [1e-6, 1e-300, f64::MIN_POSITIVE] {
        let error = triangulate(&garment, scale, 1_000_000).unwrap_err();
        assert_eq!(error.status, Status::Limit, "{error}");
    }
    // the text names the panel that asks for most, and whose length it is
    let mut own = garment.clone();
    own.panels[1].edge_length = Some(1e-5);
    let error = triangulate(&own, 1.0, 1_000_000).unwrap_err().to_string();
    let wanted = format!("panel '{}'", own.panels[1].name);
    assert!(error.contains(&wanted), "{error}");
    assert!(
        error.contains("its own edge length of 0.00001 m"),
        "{error}"
    );
    own.panels[1].edge_length = None;
    own.edge_length = 1e-5;
    let error = triangulate(&own, 1.0, 1_000_000).unwrap_err().to_string();
    assert!(
        error.contains("the garment's edge length of 0.00001 m"),
        "{error}"
    );
    let error = own.check().unwrap_err().to_string();
    assert!(error.contains("the garment's"), "{error}");
    for scale in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let error = triangulate(&garment, scale, 1_000_000).unwrap_err();
        assert_eq!(error.status, Status::Argument, "{error}");
    }
    let error = triangulate(&garment, 1.0, 100).unwrap_err();
    assert!(error.message.contains("limit 100"), "{error}");
    // a scale far above the garment still gives a mesh of it
    let mesh = triangulate(&garment, 1e6, 10_000).unwrap();
    check_mesh(&garment, &mesh);
}

#[test]
fn a_panel_that_cannot_be_refined_as_asked_is_named() {
    // room for fewer vertices than good angles need: refinement gives in angle by angle. Which of
    // these shapes can do with fewer is for the refinement to say; one at least must.
    let shapes: [&[[f64; 2]]; 3] = [
        &[
            [0.0, 0.0],
            [0.3, 0.0],
            [0.3, 0.2],
            [0.299, 0.201],
            [0.0, 0.2],
        ],
        &[[0.0, 0.0], [0.5, 0.0], [0.5, 0.05]],
        &[
            [0.0, 0.0],
            [0.2, 0.01],
            [0.4, 0.0],
            [0.21, 0.02],
            [0.2, 0.3],
            [0.19, 0.02],
        ],
    ];
    let mut found = None;
    for shape in shapes {
        for h in [0.2, 0.05, 0.02] {
            let mut sewn = garment(vec![polygon(shape)], vec![], h);
            sewn.panels[0].name = "needle".into();
            let free = triangulate(&sewn, 1.0, 200_000).unwrap();
            assert_eq!(free.lowered, []);
            for limit in free.uv.len() / 2..free.uv.len() {
                let mesh = triangulate(&sewn, 1.0, limit);
                if let Ok(mesh) = mesh.map_err(|e| assert_eq!(e.status, Status::Limit)) {
                    println!("{h} m: {limit} of {} vertices", free.uv.len());
                    found = Some((sewn.clone(), mesh, limit));
                }
            }
        }
    }
    let (sewn, tight, limit) = found.unwrap();
    assert_eq!(tight.lowered.len(), 1);
    let lowered = tight.lowered[0];
    assert_eq!(lowered.panel, 0);
    assert!((lowered.asked.to_degrees() - 30.0).abs() < 1e-9);
    assert!(lowered.kept < lowered.asked);

    let settings = toile::sim::Settings {
        max_vertices: limit as f64,
        ..Default::default()
    };
    let options = toile::sim::SimOptions {
        settings,
        ..Default::default()
    };
    let notes = toile::sim::Sim::new(&sewn, &options).unwrap().info().notes;
    assert_eq!(notes.len(), 1);
    for words in ["panel 0 'needle'", "30 were asked"] {
        assert!(notes[0].contains(words), "{words}: {notes:?}");
    }
}
