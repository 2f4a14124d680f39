//! The readers against the tables that GarmentCode's own tools printed.

use crate::common_data::data_dir;
use std::collections::BTreeMap;
use std::path::Path;
use toile::pattern::curve::Curve;
use toile::pattern::import::garment_from_file;
use toile::pattern::{Garment, Panel};

fn find(data: &Path, file: &str) -> Garment {
    let path = ["garmentcode", "gpg"]
        .iter()
        .map(|folder| data.join(folder).join(file))
        .find(|path| path.exists())
        .unwrap_or_else(|| panic!("{file} is not in {}", data.display()));
    let (garment, notes) = garment_from_file(&path).unwrap();
    assert!(notes.is_empty());
    garment.check().unwrap();
    garment
}

fn rows(data: &Path, table: &str) -> Vec<Vec<String>> {
    std::fs::read_to_string(data.join("garmentcode").join(table))
        .unwrap()
        .lines()
        .skip(1)
        .map(|line| line.split(',').map(str::to_owned).collect())
        .collect()
}

fn number(text: &str) -> f64 {
    text.trim().parse().unwrap()
}

/// The reference areas are those of polygons with 64 chords for every curve.
fn sampled_area(panel: &Panel, chords: usize) -> f64 {
    let mut points = Vec::new();
    for segment in panel.segments().unwrap() {
        let n = match segment.curve {
            Curve::Line => 1,
            _ => chords,
        };
        points.extend((0..n).map(|k| segment.point(k as f64 / n as f64)));
    }
    (0..points.len())
        .map(|k| {
            let (p, q) = (points[k], points[(k + 1) % points.len()]);
            0.5 * (p.x * q.y - p.y * q.x)
        })
        .sum()
}

/// Half a unit of the last printed digit, and rounding.
const CM4: f64 = 0.6e-4;
const CM3: f64 = 0.6e-3;

#[test]
fn panels_have_the_reference_areas_perimeters_and_boxes() {
    let Some(data) = data_dir() else { return };
    let mut garments: BTreeMap<String, Garment> = BTreeMap::new();
    let table = rows(&data, "reference_panels.csv");
    assert_eq!(table.len(), 32);
    let mut worst = [0.0_f64; 3];
    for row in &table {
        let garment = garments
            .entry(row[0].clone())
            .or_insert_with(|| find(&data, &row[0]));
        let panel = garment.panels.iter().find(|p| p.name == row[1]).unwrap();
        let place = format!("{} {}", row[0], row[1]);
        assert_eq!(panel.edge_count(), row[2].parse::<usize>().unwrap());
        let polygon = sampled_area(panel, 64);
        let area = (polygon.abs() * 1e4 - number(&row[3])).abs();
        // the polygon's error falls with the square of its step
        let limit = (4.0 * sampled_area(panel, 128) - polygon) / 3.0;
        let exact = panel.signed_outline_area().unwrap();
        assert!(
            (exact - limit).abs() < 1e-7 * exact.abs(),
            "{place} {exact} {limit}"
        );
        let perimeter = (panel.perimeter().unwrap() * 1e2 - number(&row[4])).abs();
        worst[0] = worst[0].max(area);
        worst[1] = worst[1].max(perimeter);
        let sign = panel.signed_outline_area().unwrap();
        assert_eq!(if sign > 0.0 { "ccw" } else { "cw" }, row[5], "{place}");
        let [low, high] = panel.placed_bounds().unwrap().unwrap();
        for (corner, text) in [(low, &row[6]), (high, &row[7])] {
            for (x, reference) in corner.iter().zip(text.split_whitespace()) {
                let error = (x * 1e2 - number(reference)).abs();
                worst[2] = worst[2].max(error);
                if error >= CM3 {
                    println!("{place} {x} {reference} {error}");
                }
            }
        }
    }
    println!(
        "largest differences: area {} cm^2, perimeter {} cm, box {} cm",
        worst[0], worst[1], worst[2]
    );
    assert!(worst[0] < CM4 && worst[1] < CM4 && worst[2] < CM3);
    assert_eq!(garments.len(), 5);
}

#[test]
fn seams_join_the_reference_edges_of_the_reference_lengths() {
    let Some(data) = data_dir() else { return };
    let mut garments: BTreeMap<String, Garment> = BTreeMap::new();
    let table = rows(&data, "reference_stitches.csv");
    assert_eq!(table.len(), 77);
    for row in &table {
        let garment = garments
            .entry(row[0].clone())
            .or_insert_with(|| find(&data, &row[0]));
        let seam = garment.seams[row[1].parse::<usize>().unwrap()];
        assert_eq!(seam.same_direction, row[8] == "1");
        let side = |edge: toile::pattern::EdgeRef| {
            let panel: &Panel = &garment.panels[edge.panel as usize];
            let e = panel.edge(edge.edge as usize).unwrap();
            (panel, panel.segment(e).unwrap())
        };
        let (pa, a) = side(seam.a);
        let (pb, b) = side(seam.b);
        assert_eq!((&pa.name, &pb.name), (&row[2], &row[5]));
        assert_eq!(seam.a.edge.to_string(), row[3]);
        assert_eq!(seam.b.edge.to_string(), row[6]);
        assert!((a.length() * 1e2 - number(&row[4])).abs() < CM4, "{row:?}");
        assert!((b.length() * 1e2 - number(&row[7])).abs() < CM4, "{row:?}");
        let gap = |p, q| (pa.placement.apply(&p) - pb.placement.apply(&q)).norm() * 1e2;
        let reversed = 0.5 * (gap(a.start, b.end) + gap(a.end, b.start));
        let direct = 0.5 * (gap(a.start, b.start) + gap(a.end, b.end));
        assert!(
            (reversed - number(&row[9])).abs() < CM3,
            "{row:?} {reversed}"
        );
        assert!((direct - number(&row[10])).abs() < CM3, "{row:?} {direct}");
    }
    let count: usize = garments.values().map(|g| g.seams.len()).sum();
    assert_eq!(count, 77);
}
