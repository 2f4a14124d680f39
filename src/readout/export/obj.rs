//! Wavefront OBJ: positions [m], flat coordinates [m] as `vt`, normals, one group for each panel.

use crate::math::{Vec2, Vec3};
use std::fmt::Write;

/// The garment as OBJ text. Vertex numbers in the file are the mesh's plus one, so that the file
/// can be read back as positions. `uv` and `vertex_panels` may be empty.
pub fn to_obj(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    uv: &[Vec2],
    vertex_panels: &[u32],
    panel_names: &[&str],
) -> String {
    let mut out = String::with_capacity(90 * positions.len() + 40 * triangles.len());
    out.push_str("# toile; metres\n");
    // 17 digits bring back the same bits
    for p in positions {
        let _ = writeln!(out, "v {:.17e} {:.17e} {:.17e}", p.x, p.y, p.z);
    }
    let with_uv = uv.len() == positions.len() && !uv.is_empty();
    if with_uv {
        for p in uv {
            let _ = writeln!(out, "vt {} {}", p.x, p.y);
        }
    }
    for n in crate::readout::surface::normals(positions, triangles) {
        let _ = writeln!(out, "vn {:.6} {:.6} {:.6}", n.x, n.y, n.z);
    }
    let mut group = None;
    for t in triangles {
        let panel = vertex_panels.get(t[0] as usize).copied();
        if panel.is_some() && panel != group {
            group = panel;
            let index = panel.unwrap_or(0);
            let name = panel_names.get(index as usize).copied().unwrap_or("");
            // a name with spaces would be read as several groups
            let name: String = name
                .chars()
                .map(|c| {
                    if c.is_whitespace() || c.is_control() {
                        '_'
                    } else {
                        c
                    }
                })
                .collect();
            let _ = writeln!(
                out,
                "g {}",
                if name.is_empty() {
                    format!("panel_{index}")
                } else {
                    name
                }
            );
        }
        let [a, b, c] = t.map(|i| i + 1);
        let _ = if with_uv {
            writeln!(out, "f {a}/{a}/{a} {b}/{b}/{b} {c}/{c}/{c}")
        } else {
            writeln!(out, "f {a}//{a} {b}//{b} {c}//{c}")
        };
    }
    out
}

/// Positions of an OBJ text's `v` lines in file order, as stored; used for frames of a deforming
/// mesh and for initial states.
pub fn read_positions(text: &str) -> crate::error::Result<Vec<[f64; 3]>> {
    use crate::error::Error;
    let mut out = Vec::new();
    for (number, line) in text.lines().enumerate() {
        let mut words = line.split_whitespace();
        if words.next() != Some("v") {
            continue;
        }
        let mut p = [0.0; 3];
        for c in &mut p {
            let word = words.next().unwrap_or("");
            *c = word
                .parse()
                .ok()
                .filter(|v: &f64| v.is_finite())
                .ok_or_else(|| Error::parse(format!("line {}: coordinate '{word}'", number + 1)))?;
        }
        out.push(p);
    }
    Ok(out)
}

/// Centre lines as OBJ text, one polyline for each.
pub fn curves_to_obj(curves: &[crate::readout::yarns::Curve]) -> String {
    let mut out = String::from("# toile; metres\n");
    let mut next = 1;
    for (k, curve) in curves.iter().enumerate() {
        let _ = writeln!(out, "o yarn_{k}");
        for p in &curve.points {
            let _ = writeln!(out, "v {:.17e} {:.17e} {:.17e}", p.x, p.y, p.z);
        }
        out.push('l');
        for i in next..next + curve.points.len() {
            let _ = write!(out, " {i}");
        }
        out.push('\n');
        next += curve.points.len();
    }
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn positions_come_back_bitwise_and_groups_follow_panels() {
        let x: Vec<Vec3> = (0..6)
            .map(|i| Vec3::new(0.1 * f64::from(i), (f64::from(i)).sin() / 3.0, 1e-17))
            .collect();
        let text = to_obj(
            &x,
            &[[0, 1, 2], [3, 4, 5]],
            &[],
            &[0, 0, 0, 1, 1, 1],
            &["a b", "c"],
        );
        let back = read_positions(&text).unwrap();
        for (p, q) in x.iter().zip(&back) {
            assert_eq!([p.x, p.y, p.z].map(f64::to_bits), q.map(f64::to_bits));
        }
        assert!(text.contains("g a_b\nf 1//1 2//2 3//3\ng c\nf 4//4"));
        let e = read_positions("v 0 0 0\nv 1 nan 2\n").unwrap_err().message;
        assert!(e.contains("line 2") && e.contains("nan"), "{e}");
    }

    #[test]
    fn other_readers_read_the_file() {
        let x = [Vec3::zeros(), Vec3::x(), Vec3::y()];
        let uv = [Vec2::zeros(), Vec2::x(), Vec2::y()];
        let text = to_obj(&x, &[[0, 1, 2]], &uv, &[0, 0, 0], &["front"]);
        let (models, _) =
            tobj::load_obj_buf(&mut text.as_bytes(), &tobj::LoadOptions::default(), |_| {
                Ok((Vec::new(), Default::default()))
            })
            .unwrap();
        assert_eq!(models[0].name, "front");
        assert_eq!(models[0].mesh.indices, [0, 1, 2]);
        assert_eq!(models[0].mesh.texcoords.len(), 6);
    }
}
