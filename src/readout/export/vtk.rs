//! Legacy VTK polydata (ASCII), for ParaView: positions [m], triangles, scalars at vertices.

use crate::error::{Error, Result};
use crate::math::Vec3;
use std::fmt::Write;

/// VTK text; each field is a name without spaces and one value for each vertex.
pub fn to_vtk(
    positions: &[Vec3],
    triangles: &[[u32; 3]],
    fields: &[(&str, &[f64])],
) -> Result<String> {
    let mut out = String::with_capacity(60 * positions.len() + 24 * triangles.len());
    out.push_str("# vtk DataFile Version 3.0\ntoile, metres\nASCII\nDATASET POLYDATA\n");
    let _ = writeln!(out, "POINTS {} double", positions.len());
    for p in positions {
        let _ = writeln!(out, "{} {} {}", p.x, p.y, p.z);
    }
    let _ = writeln!(out, "POLYGONS {} {}", triangles.len(), 4 * triangles.len());
    for [a, b, c] in triangles {
        let _ = writeln!(out, "3 {a} {b} {c}");
    }
    if !fields.is_empty() {
        let _ = writeln!(out, "POINT_DATA {}", positions.len());
    }
    for (name, values) in fields {
        if values.len() != positions.len() {
            return Err(Error::argument(format!(
                "VTK field '{name}' has {} values for {} vertices",
                values.len(),
                positions.len()
            )));
        }
        let _ = writeln!(out, "SCALARS {name} double 1\nLOOKUP_TABLE default");
        for v in *values {
            let _ = writeln!(out, "{v}");
        }
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_are_in_the_text_and_a_short_field_is_refused() {
        let x = [Vec3::zeros(), Vec3::x(), Vec3::y()];
        let text = to_vtk(&x, &[[0, 1, 2]], &[("strain", &[0.0, 0.5, 1.0])]).unwrap();
        assert!(text.contains("POINTS 3 double") && text.contains("POLYGONS 1 4"));
        assert!(text.ends_with("default\n0\n0.5\n1\n"));
        assert!(to_vtk(&x, &[], &[("strain", &[0.0])]).is_err());
    }
}
