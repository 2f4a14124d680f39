//! Triangulation of real patterns: quality, size, area, seams.

#[path = "common_data/mod.rs"]
mod common_data;

use common_data::data_dir;
use toile::pattern::Garment;
use toile::pattern::import::garment_from_file;
use toile::tri::quality::{edge_lengths, edges};
use toile::tri::{GarmentMesh, triangulate};

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
        for h in [0.01, 0.03, 0.06] {
            garment.edge_length = h;
            let start = std::time::Instant::now();
            let mesh = triangulate(&garment, 1.0, 1_000_000).unwrap();
            let e = edge_lengths(&mesh, 8);
            println!(
                "{file} h={h} v={} est={:.0} t={} angle={:.1} edges {:.4} {:.4} {:.4} {:?} {:?}",
                mesh.uv.len(),
                garment.estimated_vertices(1.0).unwrap(),
                mesh.triangles.len(),
                mesh.min_angle.to_degrees(),
                e.min,
                e.mean,
                e.max,
                e.histogram,
                start.elapsed()
            );
        }
    }
}
