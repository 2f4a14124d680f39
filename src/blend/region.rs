//! Which triangles give way to yarns.
//!
//! A vertex is in the region if a polygon of its panel holds it, within a millionth of the panel's size; a
//! triangle is if its three vertices are. So the region is as fine as the triangles: a polygon that holds none is
//! refused, and between polygons that meet within a triangle there is no gap.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::outline::{Piece, inside, point_distance};
use crate::pattern::{BlendRegion, Garment};
use crate::tri::GarmentMesh;

/// Tolerance over the size of the panel.
const TOLERANCE: f64 = 1e-6;

/// For each triangle whether every yarn of it is simulated in its place. A region whose fabric has
/// no yarns, one that holds no triangle, and hybrid rings where there is a border are refused.
pub fn yarn_triangles(garment: &Garment, mesh: &GarmentMesh) -> Result<Vec<bool>> {
    let mut within = vec![false; mesh.uv.len()];
    for (k, region) in garment.blend_regions.iter().enumerate() {
        let panel = &garment.panels[region.panel as usize];
        if garment.fabrics[panel.fabric].yarns.is_none() {
            return Err(Error::argument(format!(
                "panel '{}' has fabric '{}', which has no yarns",
                panel.name, garment.fabrics[panel.fabric].name
            ))
            .at(place(k)));
        }
        let [low, high] = panel.bounds()?.unwrap_or([Vec2::zeros(); 2]);
        let tolerance = TOLERANCE * (high - low).norm();
        let polygon = sides(region);
        for vertex in vertices(mesh, region) {
            within[vertex] = within[vertex] || holds(&polygon, mesh.uv[vertex], tolerance);
        }
    }
    let full: Vec<bool> = mesh
        .triangles
        .iter()
        .map(|t| t.iter().all(|v| within[*v as usize]))
        .collect();
    for (k, region) in garment.blend_regions.iter().enumerate() {
        let panel = &garment.panels[region.panel as usize];
        let of_panel = || {
            let all = full.iter().zip(&mesh.triangle_panel);
            all.filter(|(_, p)| **p == region.panel).map(|(f, _)| *f)
        };
        if !of_panel().any(|f| f) {
            return Err(Error::argument(format!(
                "the region holds no triangle of panel '{}', whose edges are {} m long: make it larger \
                 or the triangles smaller",
                panel.name,
                garment.panel_edge_length(panel)
            ))
            .at(place(k)));
        }
        if region.rings > 0 && !of_panel().all(|f| f) {
            return Err(Error::unsupported(format!(
                "{} hybrid rings around the region of panel '{}'; this version joins yarns to \
                 triangles directly, with 0 rings",
                region.rings, panel.name
            ))
            .at(place(k)));
        }
    }
    Ok(full)
}

fn place(region: usize) -> String {
    format!("blend_regions[{region}]")
}

fn vertices(mesh: &GarmentMesh, region: &BlendRegion) -> std::ops::Range<usize> {
    let panel = region.panel as usize;
    mesh.panel_starts[panel] as usize..mesh.panel_starts[panel + 1] as usize
}

fn sides(region: &BlendRegion) -> Vec<Piece> {
    let n = region.polygon.len();
    (0..n)
        .map(|i| Piece {
            a: region.polygon[i],
            b: region.polygon[(i + 1) % n],
            edge: i,
            ring: 0,
            next: (i + 1) % n,
        })
        .collect()
}

fn holds(polygon: &[Piece], p: Vec2, tolerance: f64) -> bool {
    inside(p, polygon, 0)
        || polygon
            .iter()
            .any(|piece| point_distance(p, piece.a, piece.b) <= tolerance)
}
