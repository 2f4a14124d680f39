//! Triangulation of real patterns: quality, size, area, seams, transfer.

use crate::common_data::data_dir;
use crate::tri_common::{check_mesh, check_transfer};
use toile::pattern::import::garment_from_file;
use toile::tri::quality::edge_lengths;
use toile::tri::triangulate;

const FILES: [&str; 5] = [
    "garmentcode/gen_tshirt_specification.json",
    "garmentcode/shirt_mean_specification.json",
    "garmentcode/dress_pencil_specification.json",
    "gpg/skirt_4_panels.json",
    "gpg/tee.json",
];

#[test]
fn real_patterns_triangulate_well_at_one_and_three_centimetres() {
    let Some(data) = data_dir() else { return };
    for file in FILES {
        let (mut garment, _) = garment_from_file(&data.join(file)).unwrap();
        for (h, least) in [(0.01, 20.0), (0.03, 18.0), (0.06, 13.0)] {
            garment.edge_length = h;
            let start = std::time::Instant::now();
            let mesh = triangulate(&garment, 1.0, 1_000_000).unwrap();
            let seconds = start.elapsed().as_secs_f64();
            let e = edge_lengths(&mesh, 8);
            let angle = mesh.min_angle.to_degrees();
            println!(
                "{file} h {h} m: {} vertices, angle {angle:.1}, edges {:.4} {:.4} {:.4} m, {:.1} ms",
                mesh.uv.len(),
                e.min,
                e.mean,
                e.max,
                1e3 * seconds
            );
            assert!(angle > least, "{file} {h}: {angle}");
            check_mesh(&garment, &mesh);
            if h < 0.02 {
                assert!((e.mean / h - 1.0).abs() < 0.05, "{file}: {}", e.mean);
                let estimate = garment.estimated_vertices(1.0).unwrap();
                assert!((mesh.uv.len() as f64 / estimate - 1.0).abs() < 0.05);
            }
        }
    }
}

#[test]
fn transfer_between_levels_of_real_patterns_is_linearly_exact() {
    let Some(data) = data_dir() else { return };
    for file in FILES {
        let (mut garment, _) = garment_from_file(&data.join(file)).unwrap();
        garment.edge_length = 0.012;
        let fine = triangulate(&garment, 1.0, 100_000).unwrap();
        for scale in [1.0, 2.0, 5.0] {
            let coarse = triangulate(&garment, scale, 100_000).unwrap();
            check_transfer(&garment, &coarse, &fine);
        }
    }
}
