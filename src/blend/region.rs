//! Which triangles give way to yarns.
//!
//! A vertex is in the region if a shape of its panel ([`crate::pattern::blend_region`]) holds it, within a millionth of the panel's size; a
//! triangle is if its three vertices are. So the region is as fine as the triangles: a polygon that holds none is
//! refused, and between shapes that meet within a triangle there is no gap.
//!
//! Around full triangles may lie rings in which both models act. With `w` rings a vertex that is `k` rings away from
//! the nearest full triangle has `alpha = 1 - k/w`; `alpha` is linear in the triangles of the rings, 1 in full
//! ones, 0 in the others (Casafranca et al. 2020, section 6.1).

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::{BlendRegion, Garment};
use crate::tri::GarmentMesh;

/// Tolerance over the size of the panel.
const TOLERANCE: f64 = 1e-6;

/// Which triangles are which.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Region {
    /// Triangles in whose place every yarn is simulated.
    pub full: Vec<bool>,
    /// Triangles that are simulated together with their yarns.
    pub hybrid: Vec<bool>,
    /// `alpha` at each vertex.
    pub alpha: Vec<f64>,
}

impl Region {
    /// The triangles that a garment's blend regions hold and the rings around them. A region whose fabric has
    /// no yarns, one that holds no triangle, and rings that differ or are too many are refused.
    pub fn new(garment: &Garment, mesh: &GarmentMesh) -> Result<Self> {
        garment.check_yarns()?;
        let mut within = vec![false; mesh.uv.len()];
        for region in &garment.blend_regions {
            let panel = &garment.panels[region.panel as usize];
            let [low, high] = panel.bounds()?.unwrap_or([Vec2::zeros(); 2]);
            let tolerance = TOLERANCE * (high - low).norm();
            let holds = region.holds(panel, tolerance)?;
            for vertex in vertices(mesh, region) {
                within[vertex] = within[vertex] || holds(mesh.uv[vertex]);
            }
        }
        let full: Vec<bool> = mesh
            .triangles
            .iter()
            .map(|t| t.iter().all(|v| within[*v as usize]))
            .collect();
        let rings = garment.blend_regions.first().map_or(0, |r| r.rings);
        for (k, region) in garment.blend_regions.iter().enumerate() {
            let panel = &garment.panels[region.panel as usize];
            let mut of_panel = full.iter().zip(&mesh.triangle_panel);
            if !of_panel.any(|(f, p)| *f && *p == region.panel) {
                return Err(Error::argument(format!(
                    "the region holds no triangle of panel '{}', whose edges are {} m long: make it larger \
                     or the triangles smaller",
                    panel.name,
                    garment.panel_edge_length(panel)
                ))
                .at(place(k)));
            }
            if region.rings != rings {
                return Err(Error::unsupported(format!(
                    "{} hybrid rings around the region of panel '{}', {rings} around the first one: all \
                     regions of a garment have the same number, and change it at once by the vertices' alpha",
                    region.rings, panel.name
                ))
                .at(place(k)));
            }
        }
        Ok(Self::around(mesh, full, rings))
    }

    /// The rings around full triangles.
    pub fn around(mesh: &GarmentMesh, full: Vec<bool>, rings: u32) -> Self {
        let mut level = vec![u32::MAX; mesh.uv.len()];
        for (tri, _) in mesh.triangles.iter().zip(&full).filter(|(_, full)| **full) {
            for v in tri {
                level[*v as usize] = 0;
            }
        }
        let mut hybrid = vec![false; full.len()];
        for ring in 0..rings {
            for (t, tri) in mesh.triangles.iter().enumerate() {
                hybrid[t] |= !full[t] && tri.iter().any(|v| level[*v as usize] <= ring);
            }
            for (tri, _) in mesh.triangles.iter().zip(&hybrid).filter(|(_, h)| **h) {
                for v in tri {
                    level[*v as usize] = level[*v as usize].min(ring + 1);
                }
            }
        }
        let alpha = level.iter().map(|l| match l {
            0 => 1.0,
            l if *l < rings => 1.0 - f64::from(*l) / f64::from(rings),
            _ => 0.0,
        });
        Self {
            alpha: alpha.collect(),
            full,
            hybrid,
        }
    }

    /// Whether yarns of their own lie in a triangle.
    pub fn has_yarns(&self, triangle: usize) -> bool {
        self.full[triangle] || self.hybrid[triangle]
    }

    /// `alpha` at a point of a triangle with these barycentric weights.
    pub fn at(&self, mesh: &GarmentMesh, triangle: usize, weights: &[f64; 3]) -> f64 {
        if self.full[triangle] {
            return 1.0;
        }
        if !self.hybrid[triangle] {
            return 0.0;
        }
        let corners = mesh.triangles[triangle].iter().zip(weights);
        let sum: f64 = corners.map(|(v, w)| self.alpha[*v as usize] * w).sum();
        sum.clamp(0.0, 1.0)
    }
}

fn place(region: usize) -> String {
    format!("blend_regions[{region}]")
}

fn vertices(mesh: &GarmentMesh, region: &BlendRegion) -> std::ops::Range<usize> {
    let panel = region.panel as usize;
    mesh.panel_starts[panel] as usize..mesh.panel_starts[panel + 1] as usize
}
