//! Rest data of the triangle part: the flat mesh, its fabrics, lumped areas and masses.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::{Fabric, Garment};
use crate::tri::GarmentMesh;

/// Everything that the triangle energies are built from.
#[derive(Clone, Debug, Default)]
pub struct Cloth {
    /// The triangulated garment.
    pub mesh: GarmentMesh,
    /// Fabrics of the garment.
    pub fabrics: Vec<Fabric>,
    /// Fabric of each panel.
    pub panel_fabric: Vec<usize>,
    /// Warp direction of each panel, angle from `+v` [rad].
    pub panel_grain: Vec<f64>,
    /// Rest area of each triangle [m^2].
    pub areas: Vec<f64>,
    /// Mass per area of each triangle [kg/m^2].
    pub densities: Vec<f64>,
    /// Part of each triangle's membrane along weft and warp that is its own: 1, or less where yarns
    /// lie over it.
    pub share: Vec<[f64; 2]>,
    /// Part of its bending and of what acts on its surface that is its own.
    pub own: Vec<f64>,
    /// A third of the area of the triangles around each vertex, as far as it is their own [m^2].
    pub vertex_areas: Vec<f64>,
    /// Lumped mass of each vertex [kg].
    pub masses: Vec<f64>,
}

impl Cloth {
    /// Rest data of a garment on one of its meshes. A triangle without area is refused.
    pub fn new(garment: &Garment, mesh: GarmentMesh) -> Result<Self> {
        let count = mesh.triangles.len();
        let (share, own) = (vec![[1.0; 2]; count], vec![1.0; count]);
        Self::covered(garment, mesh, share, own, &vec![None; count])
    }

    /// Same where yarns cover some of the triangles: with the part of each membrane and of other energies that
    /// is left, and the mass of the triangles that do not have their fabric's [kg].
    pub fn covered(
        garment: &Garment,
        mesh: GarmentMesh,
        share: Vec<[f64; 2]>,
        own: Vec<f64>,
        covered_masses: &[Option<f64>],
    ) -> Result<Self> {
        for fabric in &garment.fabrics {
            fabric.check()?;
        }
        let mut cloth = Self {
            fabrics: garment.fabrics.clone(),
            panel_fabric: garment.panels.iter().map(|p| p.fabric).collect(),
            panel_grain: garment.panels.iter().map(|p| p.grain).collect(),
            areas: Vec::with_capacity(mesh.triangles.len()),
            densities: Vec::with_capacity(mesh.triangles.len()),
            share,
            own,
            vertex_areas: vec![0.0; mesh.uv.len()],
            masses: vec![0.0; mesh.uv.len()],
            mesh,
        };
        for (t, tri) in cloth.mesh.triangles.iter().enumerate() {
            let [a, b, c] = tri.map(|v| cloth.mesh.uv[v as usize]);
            let area = 0.5 * cross(&(b - a), &(c - a)).abs();
            if area.is_nan() || area <= 0.0 {
                return Err(Error::geometry(format!("triangle {t} has area {area}")));
            }
            let panel = cloth.mesh.triangle_panel[t] as usize;
            let plain = cloth.fabrics[cloth.panel_fabric[panel]].density;
            let density = covered_masses[t].map_or(plain, |mass| mass / area);
            for &v in tri {
                cloth.vertex_areas[v as usize] += area * cloth.own[t] / 3.0;
                cloth.masses[v as usize] += area * density / 3.0;
            }
            cloth.areas.push(area);
            cloth.densities.push(density);
        }
        Ok(cloth)
    }

    /// Rest area of the whole cloth [m^2].
    pub fn area(&self) -> f64 {
        self.areas.iter().sum()
    }

    /// Membrane stiffness along warp and weft without strain, mean over the area [N/m].
    pub fn mean_stiffness(&self) -> f64 {
        let sum: f64 = (self.areas.iter().enumerate())
            .map(|(t, area)| {
                let [weft, warp] = self.fabric_of(t).along();
                0.5 * area * (warp + weft)
            })
            .sum();
        sum / self.area()
    }

    /// Fabric of a triangle.
    pub fn fabric_of(&self, triangle: usize) -> &Fabric {
        &self.fabrics[self.panel_fabric[self.mesh.triangle_panel[triangle] as usize]]
    }
}

fn cross(a: &Vec2, b: &Vec2) -> f64 {
    a.x * b.y - a.y * b.x
}
