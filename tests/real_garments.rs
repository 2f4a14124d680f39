//! Real sewing patterns on a real body: sewn shut, at rest, outside the body.

use std::path::PathBuf;
use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::import::garment_from_json;
use toile::sim::{ContactSettings, DrapeOptions, Sim, SimOptions};
use toile::system::contact::crossing::SewnSurface;

fn data() -> Option<PathBuf> {
    match std::env::var_os("TOILE_DATA") {
        Some(folder) => Some(PathBuf::from(folder)),
        None => {
            assert!(
                std::env::var("CI").as_deref() != Ok("true"),
                "TOILE_DATA must be set"
            );
            println!("skipped: TOILE_DATA is not set");
            None
        }
    }
}

fn drapes_to_rest(name: &str, edge_length: f64) {
    let Some(data) = data() else { return };
    let path = data.join(format!("garmentcode/{name}_specification.json"));
    let text = std::fs::read_to_string(&path).expect("pattern");
    let mut garment = garment_from_json(&text, None).expect("garment");
    garment.edge_length = edge_length;
    let body = Body::obj(&data.join("bodies/mean_all.obj"), 1.0, 0.0).expect("body");
    let mut sim = Sim::new(&garment, &SimOptions::default()).expect("sim");
    sim.add_body(&body, &ContactSettings::default())
        .expect("add body");
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    println!("{name}: {} vertices, {report:?}", sim.positions().len());
    assert!(
        report.max_seam_gap < 2e-3,
        "seam gap {} m",
        report.max_seam_gap
    );
    assert!(report.min_gap > -1e-3, "depth {} m", -report.min_gap);
    let rested = sim.positions().to_vec();
    let mut moved = 0.0_f64;
    for _ in 0..30 {
        sim.step(1.0 / 30.0).expect("step");
        let far = |(p, q): (&Vec3, &Vec3)| (p - q).norm();
        moved = moved.max(
            sim.positions()
                .iter()
                .zip(&rested)
                .map(far)
                .fold(0.0, f64::max),
        );
    }
    println!("{name}: moved {:.3} mm in a further second", 1e3 * moved);
    assert!(moved < 1e-3, "a vertex moved {moved} m in a further second");
    let edges: Vec<(Vec3, Vec3)> = toile::math::topology::edges(&sim.mesh().triangles)
        .iter()
        .map(|e| {
            (
                sim.positions()[e[0] as usize],
                sim.positions()[e[1] as usize],
            )
        })
        .collect();
    let crossing = body.intersections(&edges);
    assert!(
        crossing.is_empty(),
        "{} edges cross the body",
        crossing.len()
    );
    let sewn = SewnSurface::new(sim.mesh(), sim.positions());
    let own = sewn.crossings(1000).expect("finite");
    println!(
        "{name}: rims within {:.3} mm of their seams",
        1e3 * sewn.moved
    );
    println!("{name}: {} edges through the garment", own.len());
    assert!(own.is_empty(), "{} edges cross the garment", own.len());
    assert!(sewn.moved < 1e-3, "{} m", sewn.moved);
    let inside = sim
        .positions()
        .iter()
        .filter(|p| body.value(p) < -1e-3)
        .count();
    assert_eq!(inside, 0, "vertices more than 1 mm inside the body");
}

#[test]
fn tshirt_sews_shut_and_comes_to_rest() {
    drapes_to_rest("gen_tshirt", 0.02);
}

#[test]
fn shirt_sews_shut_and_comes_to_rest() {
    drapes_to_rest("shirt_mean", 0.02);
}

#[test]
fn pencil_dress_sews_shut_and_comes_to_rest() {
    drapes_to_rest("dress_pencil", 0.02);
}
