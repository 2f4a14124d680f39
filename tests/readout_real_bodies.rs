//! Pictures and crossings of real bodies with a real, not yet draped T-shirt.

use std::path::{Path, PathBuf};
use toile::math::Vec3;
use toile::readout::picture::{PictureOptions, render};
use toile::readout::{Part, crossings, export};

fn data() -> Option<PathBuf> {
    let found = std::env::var_os("TOILE_DATA").map(PathBuf::from);
    if found.is_none() {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "TOILE_DATA is unset"
        );
        eprintln!("skipped: TOILE_DATA is unset");
    }
    found
}

fn load(path: &Path, scale: f64) -> (Vec<Vec3>, Vec<[u32; 3]>) {
    let options = tobj::LoadOptions {
        triangulate: true,
        ..tobj::LoadOptions::default()
    };
    let (models, _) = tobj::load_obj(path, &options).unwrap();
    let mut x = Vec::new();
    let mut t = Vec::new();
    for m in models {
        let base = x.len() as u32;
        x.extend(
            m.mesh
                .positions
                .chunks(3)
                .map(|p| Vec3::new(p[0].into(), p[1].into(), p[2].into()) * scale),
        );
        t.extend(
            m.mesh
                .indices
                .chunks(3)
                .map(|i| [i[0] + base, i[1] + base, i[2] + base]),
        );
    }
    (x, t)
}

#[test]
fn shirt_on_body_is_drawn_with_both_colours_in_it() {
    let Some(data) = data() else { return };
    for body in ["mean_all.obj", "makehuman_body_closed_m.obj"] {
        let (x, t) = load(&data.join("bodies").join(body), 1.0);
        let (sx, st) = load(&data.join("garmentcode/gen_tshirt_boxmesh_1cm.obj"), 0.01);
        // panels of the box mesh are merged: colour front and back
        let panels: Vec<u32> = sx.iter().map(|p| u32::from(p.z < 0.0)).collect();
        let parts = [
            Part::garment("shirt", &sx, &st, &panels),
            Part::body("body", x.clone(), t.clone()),
        ];
        let start = std::time::Instant::now();
        let picture = render(&parts, &PictureOptions::default()).unwrap();
        let seconds = start.elapsed().as_secs_f64();
        println!(
            "{body}: {seconds:.2} s for {} triangles",
            t.len() + st.len()
        );
        if let Some(dir) = std::env::var_os("TOILE_PICTURES") {
            picture
                .write_png(&PathBuf::from(dir).join(format!("{body}.png")))
                .unwrap();
        }
        assert!(seconds < 10.0, "{seconds} s");
        let shares = |f: &dyn Fn(&[u8]) -> bool| {
            picture.rgb.chunks(3).filter(|p| f(p)).count() as f64
                / (picture.width * picture.height) as f64
        };
        let blue = shares(&|p| i32::from(p[2]) - i32::from(p[0]) > 40);
        let orange = shares(&|p| i32::from(p[0]) - i32::from(p[2]) > 60);
        assert!(blue > 0.02 && orange > 0.02, "{blue} {orange}");
        let glb = export::gltf::to_glb(&parts, &[]).unwrap();
        assert!(glb.len() > 12 * (x.len() + sx.len()) && glb.len().is_multiple_of(4));
        let crossing = crossings::crossing_edges(&sx, &toile::math::topology::edges(&st), &x, &t);
        println!(
            "{body}: {} edges of the flat shirt cross it",
            crossing.len()
        );
        // every edge found does cross: brute force over a few of them
        let edges = toile::math::topology::edges(&st);
        for &e in crossing.iter().take(20) {
            let [a, b] = edges[e].map(|i| sx[i as usize]);
            assert!(
                t.iter()
                    .any(|t| crossings::crosses(&a, &b, &t.map(|i| x[i as usize])))
            );
        }
    }
}
