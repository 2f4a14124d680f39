//! Structured meshes of a rectangle, for benchmarks and tests.

use super::{GarmentMesh, quality};
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3};
use crate::pattern::curve::Curve;
use crate::pattern::{Edge, Fabric, Garment, Panel, Placement};

/// How the cells of a grid are cut into triangles.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum SheetPattern {
    /// One diagonal, the same in all cells.
    #[default]
    Diagonal,
    /// One diagonal, alternating from cell to cell (union jack).
    Alternating,
    /// Both diagonals and a vertex in the middle of the cell: edges along the axes and at 45 degrees.
    Crossed,
}

/// A rectangular panel `width` x `height` [m] with its corner in the origin; edges 0 bottom, 1 right,
/// 2 top, 3 left, counter-clockwise.
pub fn rectangle(name: &str, width: f64, height: f64) -> Panel {
    Panel {
        name: name.into(),
        vertices: vec![
            Vec2::new(0.0, 0.0),
            Vec2::new(width, 0.0),
            Vec2::new(width, height),
            Vec2::new(0.0, height),
        ],
        outline: (0..4)
            .map(|k| Edge {
                start: k,
                end: (k + 1) % 4,
                curve: Curve::Line,
                label: None,
            })
            .collect(),
        holes: Vec::new(),
        placement: Placement::default(),
        fabric: 0,
        grain: 0.0,
        edge_length: None,
        label: None,
    }
}

/// A garment of one rectangle, to go with [`structured_sheet`].
pub fn sheet_garment(width: f64, height: f64, edge_length: f64, fabric: Fabric) -> Garment {
    Garment {
        name: "sheet".into(),
        panels: vec![rectangle("sheet", width, height)],
        seams: Vec::new(),
        fabrics: vec![fabric],
        edge_length,
        blend_regions: Vec::new(),
    }
}

/// A grid of `nx` x `ny` cells over `width` x `height` [m] in one panel, placed at `(u, v, 0)`.
///
/// Vertex `(i, j)` has number `j (nx + 1) + i`; the middles of crossed cells follow, row by row.
/// Normals point along +z.
pub fn structured_sheet(
    width: f64,
    height: f64,
    nx: usize,
    ny: usize,
    pattern: SheetPattern,
) -> Result<GarmentMesh> {
    if !(width.is_finite() && height.is_finite() && width > 0.0 && height > 0.0) {
        return Err(Error::argument(format!(
            "sheet of {width} m x {height} m must be finite and positive"
        )));
    }
    if nx == 0 || ny == 0 || nx.max(ny) > 20_000 || nx * ny > 20_000_000 {
        return Err(Error::argument(format!(
            "{nx} x {ny} cells must be at least 1 x 1 and at most 2e7 in all"
        )));
    }
    let at = |i: usize, j: usize| (j * (nx + 1) + i) as u32;
    let mut uv = Vec::new();
    for j in 0..=ny {
        for i in 0..=nx {
            uv.push(Vec2::new(
                width * (i as f64 / nx as f64),
                height * (j as f64 / ny as f64),
            ));
        }
    }
    let mut triangles = Vec::new();
    for j in 0..ny {
        for i in 0..nx {
            let (a, b, c, d) = (at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1));
            match pattern {
                SheetPattern::Alternating if (i + j) % 2 == 1 => {
                    triangles.extend([[a, b, d], [b, c, d]]);
                }
                SheetPattern::Diagonal | SheetPattern::Alternating => {
                    triangles.extend([[a, b, c], [a, c, d]]);
                }
                SheetPattern::Crossed => {
                    let m = uv.len() as u32;
                    uv.push(0.5 * (uv[a as usize] + uv[c as usize]));
                    triangles.extend([[a, b, m], [b, c, m], [c, d, m], [d, a, m]]);
                }
            }
        }
    }
    let edge_vertices = vec![
        (0..=nx).map(|i| at(i, 0)).collect(),
        (0..=ny).map(|j| at(nx, j)).collect(),
        (0..=nx).rev().map(|i| at(i, ny)).collect(),
        (0..=ny).rev().map(|j| at(0, j)).collect(),
    ];
    let mut mesh = GarmentMesh {
        placed: uv.iter().map(|p| Vec3::new(p.x, p.y, 0.0)).collect(),
        vertex_panel: vec![0; uv.len()],
        triangle_panel: vec![0; triangles.len()],
        panel_starts: vec![0, uv.len() as u32],
        edge_vertices: vec![edge_vertices],
        uv,
        triangles,
        seams: Vec::new(),
        min_angle: 0.0,
        lowered: Vec::new(),
    };
    mesh.min_angle = quality::min_angle(&mesh);
    Ok(mesh)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sheets_cover_their_area_and_have_euler_characteristic_one() {
        for pattern in [
            SheetPattern::Diagonal,
            SheetPattern::Alternating,
            SheetPattern::Crossed,
        ] {
            let mesh = structured_sheet(2.0, 1.0, 6, 4, pattern).unwrap();
            let area: f64 = mesh
                .triangles
                .iter()
                .map(|t| {
                    let [a, b, c] = t.map(|v| mesh.uv[v as usize]);
                    0.5 * ((b - a).x * (c - a).y - (b - a).y * (c - a).x)
                })
                .sum();
            assert!((area - 2.0).abs() < 1e-12, "{pattern:?} {area}");
            let edges = crate::math::topology::edges(&mesh.triangles);
            let hinges = quality::hinges(&mesh);
            assert_eq!(mesh.uv.len() + mesh.triangles.len() - edges.len(), 1);
            assert_eq!(edges.len() - hinges.len(), 2 * (6 + 4));
            for [v0, v1, v2, v3] in hinges {
                let has = |t: [u32; 3]| {
                    mesh.triangles
                        .iter()
                        .any(|s| (0..3).any(|k| [s[k], s[(k + 1) % 3], s[(k + 2) % 3]] == t))
                };
                assert!(has([v0, v1, v2]) && has([v1, v0, v3]));
            }
        }
        assert!(structured_sheet(1.0, f64::NAN, 1, 1, SheetPattern::Diagonal).is_err());
        assert!(structured_sheet(1.0, 1.0, 0, 1, SheetPattern::Diagonal).is_err());
        assert!(structured_sheet(1.0, 1.0, usize::MAX, 2, SheetPattern::Diagonal).is_err());
    }
}
