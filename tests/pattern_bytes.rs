//! The readers take any bytes: an error that names a place, or a garment that survives checking.

use serde_json::{Value, json};
use std::path::Path;
use toile::error::Status;
use toile::pattern::export::{garment_to_json, to_svg};
use toile::pattern::import::{fabric_from_json, garment_from_json};
use toile::tri::triangulate;

const CODE: &str = r#"{"pattern": {"panels": {
  "a": {"vertices": [[0, 0], [30, 0], [30, 40], [0, 40]], "translation": [0, 100, 25],
    "rotation": [0, 0, -45], "label": "body", "edges": [
    {"endpoints": [0, 1], "label": "hem"}, {"endpoints": [1, 2], "curvature": [0.5, 0.1]},
    {"endpoints": [2, 3], "curvature": {"type": "cubic", "params": [[0.3, 0.1], [0.7, 0.1]]}},
    {"endpoints": [3, 0], "curvature": {"type": "circle", "params": [30, 0, 1]}}]},
  "b": {"vertices": [[0, 0], [30, 0], [30, 40]], "translation": [0, 100, -25], "rotation": [0, 180, 0],
    "edges": [{"endpoints": [0, 1]}, {"endpoints": [1, 2],
      "curvature": {"type": "quadratic", "params": [[0.5, -0.1]]}}, {"endpoints": [2, 0]}]}},
  "stitches": [[{"panel": "a", "edge": 1}, {"panel": "b", "edge": 2}],
    [{"panel": "a", "edge": 2}, {"panel": "b", "edge": 1}, "right_wrong"]],
  "panel_order": ["a", "b"]},
  "properties": {"units_in_meter": 100, "curvature_coords": "relative"}, "parameters": {}}"#;

const MEASURED: &str = r#"{"density": 0.3, "stretching": [[200, 10, 1000, 50], [210, 40, 1050, -6]],
  "bending": [[6e-5, 5e-5], [7e-5, 6e-5], [9e-5, 8e-5]]}"#;

struct Random(u64);

impl Random {
    fn next(&mut self) -> u64 {
        // xorshift64*
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        self.0.wrapping_mul(0x2545_f491_4f6c_dd1d)
    }

    fn below(&mut self, n: usize) -> usize {
        (self.next() >> 33) as usize % n.max(1)
    }
}

fn sources() -> Vec<String> {
    let mut list = vec![CODE.to_owned(), MEASURED.to_owned()];
    for name in ["tshirt", "skirt", "two_panels"] {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("examples")
            .join(format!("{name}.json"));
        list.push(std::fs::read_to_string(path).unwrap());
    }
    list
}

/// Replaces, removes, repeats or cuts pieces of text.
fn mutate(text: &str, random: &mut Random) -> String {
    let mut bytes = text.as_bytes().to_vec();
    const PARTS: [&str; 22] = [
        "-1",
        "1e308",
        "-1e-308",
        "1e999",
        "null",
        "true",
        "[]",
        "{}",
        "\"x\"",
        "4294967296",
        "0",
        "[[[[",
        "}",
        "]",
        ",",
        ":",
        "\"arc\"",
        "99",
        "1e4",
        "-0.0",
        "\\u0000",
        "\u{fffd}",
    ];
    for _ in 0..=random.below(3) {
        let at = random.below(bytes.len());
        match random.below(6) {
            0 => bytes.truncate(at),
            1 => bytes[at..]
                .iter_mut()
                .take(1)
                .for_each(|b| *b = b'0' + (*b % 10)),
            2 => {
                let end = (at + 1 + random.below(12)).min(bytes.len());
                bytes.drain(at..end);
            }
            3 => {
                let part = PARTS[random.below(PARTS.len())];
                bytes.splice(at..at, part.bytes());
            }
            _ => {
                // a whole number or word replaced: stays valid JSON most of the time
                let digit = |b: u8| b.is_ascii_digit() || b == b'.' || b == b'-';
                let Some(start) = (at..bytes.len()).find(|k| digit(bytes[*k])) else {
                    continue;
                };
                let end = (start..bytes.len())
                    .find(|k| !digit(bytes[*k]))
                    .unwrap_or(bytes.len());
                let part = PARTS[random.below(PARTS.len())];
                bytes.splice(start..end, part.bytes());
            }
        }
        if bytes.is_empty() {
            break;
        }
    }
    String::from_utf8_lossy(&bytes).into_owned()
}

/// Replaces one value somewhere in valid JSON by another of the same or another type.
fn mutate_value(text: &str, random: &mut Random) -> String {
    fn leaves<'a>(value: &'a mut Value, out: &mut Vec<&'a mut Value>) {
        match value {
            Value::Array(items) => items.iter_mut().for_each(|item| leaves(item, out)),
            Value::Object(map) => map.values_mut().for_each(|item| leaves(item, out)),
            leaf => out.push(leaf),
        }
    }
    let mut root: Value = serde_json::from_str(text).unwrap();
    for _ in 0..=random.below(3) {
        let mut list = Vec::new();
        leaves(&mut root, &mut list);
        let pick = random.below(list.len());
        let leaf = &mut *list[pick];
        *leaf = match (random.below(8), leaf.as_f64()) {
            (0, _) => json!(null),
            (1, _) => json!("front"),
            (2, _) => json!(random.below(12)),
            (3, _) => json!([0.0, -1e9, 1e-12, 1e300, 1e4, -0.0][random.below(6)]),
            (_, Some(x)) => json!(x + 0.02 * (random.below(100) as f64 - 50.0) / 50.0),
            _ => continue,
        };
    }
    root.to_string()
}

#[test]
fn mutated_and_truncated_texts_never_panic() {
    let mut random = Random(0x05ee_d701_1e01);
    let sources = sources();
    let (mut read, mut sound, mut meshed) = (0, 0, 0);
    for k in 0..12_000 {
        let source = &sources[k % sources.len()];
        let text = if k % 2 == 0 {
            mutate(source, &mut random)
        } else {
            mutate_value(source, &mut random)
        };
        match fabric_from_json(&text) {
            Ok((fabric, _)) => fabric.check().unwrap(),
            Err(error) => assert!(!error.message.is_empty()),
        }
        let garment = match garment_from_json(&text, None) {
            Ok(garment) => garment,
            Err(error) => {
                assert!(!error.message.is_empty());
                continue;
            }
        };
        read += 1;
        // what can be written comes back the same
        if let Ok(text) = garment_to_json(&garment) {
            assert_eq!(garment_from_json(&text, None).unwrap(), garment);
        }
        if garment.check_within(20_000).is_err() {
            continue;
        }
        sound += 1;
        if k % 9 == 0 {
            let mesh = triangulate(&garment, 4.0, 20_000);
            meshed += usize::from(mesh.is_ok());
            let _ = to_svg(&garment, 0.01);
        }
    }
    println!("12000 texts: {read} read, {sound} sound, {meshed} of every ninth meshed");
    assert!(read > 1000 && sound > 500 && meshed > 50);
}

#[test]
fn every_truncation_is_an_error() {
    for text in sources() {
        for end in (0..text.trim_end().len()).step_by(7) {
            let error = garment_from_json(&text[..end], None).unwrap_err();
            assert_eq!(error.status, Status::Parse);
        }
    }
}

#[test]
fn deep_nesting_and_huge_numbers_are_errors() {
    for part in ["[", "{\"a\":"] {
        assert!(garment_from_json(&part.repeat(200_000), None).is_err());
    }
    assert!(garment_from_json("{\"toile_garment\": 1e999}", None).is_err());
    assert!(garment_from_json("{\"toile_garment\": 2, \"panels\": []}", None).is_err());
    assert!(garment_from_json("", None).is_err());
    assert!(garment_from_json("[]", None).is_err());
}

#[test]
fn errors_name_the_json_path() {
    let edit = |source: usize, from: &str, to: &str| -> String {
        let text = &sources()[source];
        assert!(text.contains(from), "{from}");
        let text = text.replacen(from, to, 1);
        garment_from_json(&text, None).unwrap_err().message
    };
    for (source, from, to, place) in [
        (
            2,
            "\"edge_length\": 0.015",
            "\"edge_length\": \"x\"",
            "edge_length: must be",
        ),
        (
            2,
            "[-0.265, -0.06]",
            "[-0.265]",
            "panels[0].vertices[0]: must have 2",
        ),
        (
            2,
            "\"edge_length\"",
            "\"edgelength\"",
            "edgelength: unknown key",
        ),
        (
            2,
            "\"endpoints\": [0, 1]",
            "\"endpoints\": [0, 77]",
            "panels[0].edges[0].endpoints[1]: corner 77 of 8",
        ),
        (
            2,
            "[\"front\", 1]",
            "[\"frond\", 1]",
            "seams[0].a[0]: no panel is named \"frond\"",
        ),
        (
            3,
            "\"fabric\": \"cotton twill\"",
            "\"fabric\": \"silk\"",
            "panels[0].fabric: no fabric",
        ),
        (
            4,
            "\"radius\": 0.102",
            "\"raduis\": 0.102",
            "panels[0].edges[4].arc.raduis: unknown key",
        ),
        (4, "\"warp\": 1200.0", "\"warp\": -5", "fabrics[0]"),
        (
            0,
            "\"units_in_meter\": 100",
            "\"units_in_meter\": 0",
            "properties.units_in_meter",
        ),
        (
            0,
            "[0, 1], \"label\"",
            "[0, 9], \"label\"",
            "pattern.panels.a.edges[0].endpoints[1]: corner 9",
        ),
        (
            0,
            "\"circle\"",
            "\"circel\"",
            "pattern.panels.a.edges[3].curvature.type",
        ),
        (0, "right_wrong", "wrong_right", "pattern.stitches[1][2]"),
        (
            0,
            "{\"panel\": \"b\", \"edge\": 2}",
            "{\"panel\": \"c\", \"edge\": 2}",
            "pattern.stitches[0][1].panel",
        ),
    ] {
        let message = edit(source, from, to);
        assert!(
            message.starts_with(place),
            "{message} does not start with {place}"
        );
    }
}

#[test]
fn the_garmentcode_dialects_mean_what_they_say() {
    use toile::math::Vec2;
    use toile::pattern::curve::Curve;
    let garment = garment_from_json(CODE, None).unwrap();
    assert!(garment.seams[1].same_direction && !garment.seams[0].same_direction);
    let a = &garment.panels[0];
    // [0.5, 0.1] on the edge (30, 0) -> (30, 40) cm: left of it is -x
    let Curve::Quadratic(c) = a.outline[1].curve else {
        panic!("not quadratic")
    };
    assert!((c - Vec2::new(0.26, 0.2)).norm() < 1e-12);
    assert_eq!(
        a.outline[3].curve,
        Curve::Arc {
            radius: 0.3,
            large: false,
            right: true
        }
    );
    let absolute = CODE
        .replace("\"relative\"", "\"absolute\"")
        .replace("[0.5, 0.1]", "[26, 20]");
    let Curve::Quadratic(d) =
        garment_from_json(&absolute, None).unwrap().panels[0].outline[1].curve
    else {
        panic!("not quadratic")
    };
    assert!((c - d).norm() < 1e-12);
    // R = Rz Ry Rx: with 90 degrees about x then z, v goes to z and u to y
    let turned = CODE.replace("[0, 0, -45]", "[90, 0, 90]");
    let placement = garment_from_json(&turned, None).unwrap().panels[0].placement;
    let t = placement.translation;
    assert!((placement.apply(&Vec2::new(1.0, 0.0)) - t - toile::math::Vec3::y()).norm() < 1e-12);
    assert!((placement.apply(&Vec2::new(0.0, 1.0)) - t - toile::math::Vec3::z()).norm() < 1e-12);
}
