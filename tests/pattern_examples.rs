//! The garments that the project ships: sound, sewable, round trip, drawn.

use std::path::Path;
use toile::pattern::export::{garment_to_json, to_svg};
use toile::pattern::import::{garment_from_file, garment_from_json};
use toile::pattern::{EdgeRef, Garment};
use toile::tri::triangulate;

const NAMES: [&str; 3] = ["tshirt", "skirt", "two_panels"];

fn example(name: &str) -> Garment {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("examples")
        .join(format!("{name}.json"));
    garment_from_file(&path).unwrap().0
}

#[test]
fn examples_are_sound_and_triangulate_well() {
    for name in NAMES {
        let garment = example(name);
        garment.check().unwrap();
        for scale in [1.0, 2.0, 4.0] {
            let mesh = triangulate(&garment, scale, 100_000).unwrap();
            println!(
                "{name} x{scale}: {} vertices, smallest angle {:.1} degrees",
                mesh.uv.len(),
                mesh.min_angle.to_degrees()
            );
            assert!(mesh.min_angle.to_degrees() > 15.0);
        }
    }
}

#[test]
fn examples_stand_clear_of_a_body_and_normals_face_away_from_it() {
    for name in NAMES {
        let mesh = triangulate(&example(name), 1.0, 100_000).unwrap();
        for p in &mesh.placed {
            assert!(p.z.abs() > 0.17, "{name} {p}");
            assert!(p.y > 0.4 && p.y < 1.55, "{name} {p}");
        }
        for t in &mesh.triangles {
            let [a, b, c] = t.map(|v| mesh.placed[v as usize]);
            let normal = (b - a).cross(&(c - a));
            assert!(normal.z * a.z > 0.0, "{name}: inside out at {a}");
        }
    }
}

#[test]
fn seam_ends_of_examples_lie_near_each_other() {
    // a seam sewn the wrong way round would cross itself over
    for name in NAMES {
        let garment = example(name);
        for (k, seam) in garment.seams.iter().enumerate() {
            let ends = |e: EdgeRef| {
                let panel = &garment.panels[e.panel as usize];
                let edge = panel.edge(e.edge as usize).unwrap();
                let at = |v: u32| panel.placement.apply(&panel.vertices[v as usize]);
                [at(edge.start), at(edge.end)]
            };
            let ([a, b], [c, d]) = (ends(seam.a), ends(seam.b));
            let flat = |v: toile::math::Vec3| (v.x * v.x + v.y * v.y).sqrt();
            let right = flat(a - d) + flat(b - c);
            let wrong = flat(a - c) + flat(b - d);
            assert!(right < wrong, "{name} seam {k}: {right} {wrong}");
        }
    }
}

#[test]
fn the_skirt_has_a_dart_and_a_gathered_seam_and_the_tunic_a_hole() {
    let skirt = example("skirt");
    assert!(skirt.seams.iter().any(|s| s.a.panel == s.b.panel));
    let length = |e: EdgeRef| {
        let panel = &skirt.panels[e.panel as usize];
        let segments = panel.segments().unwrap();
        segments[e.edge as usize].length()
    };
    let gather = skirt
        .seams
        .iter()
        .map(|s| length(s.b) / length(s.a))
        .fold(0.0, f64::max);
    assert!((gather - 1.4).abs() < 0.01, "{gather}");
    let tunic = example("two_panels");
    let hole = std::f64::consts::PI * 0.03 * 0.03;
    let front = &tunic.panels[0];
    let without = front.signed_outline_area().unwrap();
    assert!((without - front.area().unwrap() - hole).abs() < 1e-12);
}

#[test]
fn examples_come_back_from_their_own_json_bit_for_bit() {
    for name in NAMES {
        let garment = example(name);
        let text = garment_to_json(&garment).unwrap();
        let back = garment_from_json(&text, None).unwrap();
        assert_eq!(garment, back);
        assert_eq!(text, garment_to_json(&back).unwrap());
    }
}

#[test]
fn svg_is_true_to_scale_and_closed() {
    for name in NAMES {
        let garment = example(name);
        let svg = to_svg(&garment, 0.01).unwrap();
        if let Some(folder) = std::env::var_os("TOILE_SVG") {
            std::fs::write(Path::new(&folder).join(format!("{name}.svg")), &svg).unwrap();
        }
        assert_eq!(svg.matches("<g ").count(), garment.panels.len());
        let lines: Vec<Vec<[f64; 2]>> = svg
            .lines()
            .filter_map(|line| line.strip_prefix("<path class=\"cut\" d=\"M"))
            .map(|d| {
                d.trim_end_matches("\"/>")
                    .split('L')
                    .map(|p| {
                        let mut xy = p.split(' ').map(|x| x.parse().unwrap());
                        [xy.next().unwrap(), xy.next().unwrap()]
                    })
                    .collect()
            })
            .collect();
        let holes: usize = garment.panels.iter().map(|p| p.holes.len()).sum();
        assert_eq!(lines.len(), garment.panels.len() + holes, "{name}");
        for line in &lines {
            let (a, b) = (line[0], line[line.len() - 1]);
            assert!(
                (a[0] - b[0]).hypot(a[1] - b[1]) < 0.01,
                "{name}: open cut line"
            );
        }
        // the cut line's box is the panel's box and twice the allowance
        let [low, high] = garment.panels[0].bounds().unwrap().unwrap();
        let xs = lines[0].iter().map(|p| p[0]);
        let width = xs.clone().fold(f64::MIN, f64::max) - xs.fold(f64::MAX, f64::min);
        assert!(
            (width - 1e3 * (high.x - low.x) - 20.0).abs() < 0.2,
            "{name} {width}"
        );
        assert!(to_svg(&garment, f64::NAN).is_err() && to_svg(&garment, 0.0).is_ok());
    }
}
