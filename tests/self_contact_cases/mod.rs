//! Small garments and a world without bodies.

#![allow(dead_code, reason = "shared by several test programs")]
#![allow(clippy::expect_used, clippy::unwrap_used, reason = "test code")]

use toile::body::Distance;
use toile::cloth::Cloth;
use toile::math::{Vec2, Vec3};
use toile::system::state::State;
use toile::system::term::{Bodies, Configuration, ContactSettings, World};
use toile::tri::{GarmentMesh, SeamLink, SeamMesh};

pub(crate) struct NoBodies;

impl Bodies for NoBodies {
    fn count(&self) -> usize {
        0
    }
    fn distance(&self, _: usize, _: &Vec3) -> Distance {
        unreachable!("there is no body")
    }
    fn value(&self, _: usize, _: &Vec3) -> f64 {
        f64::INFINITY
    }
    fn carried(&self, _: usize, point: &Vec3) -> Vec3 {
        *point
    }
    fn contact(&self, _: usize) -> &ContactSettings {
        unreachable!("there is no body")
    }
}

pub(crate) const WORLD: World<'static> = World {
    gravity: Vec3::new(0.0, -9.81, 0.0),
    wind: Vec3::new(0.0, 0.0, 0.0),
    pressure: 0.0,
    bodies: &NoBodies,
};

pub(crate) fn at<'a>(x: &'a [Vec3], x0: &'a [Vec3], dt: f64) -> Configuration<'a> {
    Configuration {
        x,
        x0,
        u: &[],
        inv_dt: 1.0 / dt,
        world: &WORLD,
    }
}

/// Square panels of `cells` x `cells` squares of side `spacing`, cut along both diagonals in turn.
pub(crate) fn squares(panels: usize, cells: usize, spacing: f64) -> Cloth {
    let side = cells + 1;
    let mut mesh = GarmentMesh::default();
    for panel in 0..panels as u32 {
        let first = mesh.uv.len() as u32;
        mesh.panel_starts.push(first);
        for i in 0..side {
            for j in 0..side {
                mesh.uv.push(Vec2::new(i as f64, j as f64) * spacing);
                mesh.vertex_panel.push(panel);
            }
        }
        let at = |i: usize, j: usize| first + (i * side + j) as u32;
        for i in 0..cells {
            for j in 0..cells {
                let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                let pair = if (i + j) % 2 == 0 {
                    [[a, b, c], [a, c, d]]
                } else {
                    [[a, b, d], [b, c, d]]
                };
                for t in pair {
                    mesh.triangles.push(t);
                    mesh.triangle_panel.push(panel);
                }
            }
        }
    }
    mesh.panel_starts.push(mesh.uv.len() as u32);
    let mut cloth = Cloth {
        vertex_areas: vec![0.0; mesh.uv.len()],
        masses: vec![0.0; mesh.uv.len()],
        panel_fabric: vec![0; panels],
        fabrics: vec![toile::pattern::Fabric::default()],
        mesh,
        ..Cloth::default()
    };
    for t in cloth.mesh.triangles.clone() {
        let area = 0.5 * spacing * spacing;
        cloth.areas.push(area);
        for v in t {
            cloth.vertex_areas[v as usize] += area / 3.0;
            cloth.masses[v as usize] += 0.2 * area / 3.0;
        }
    }
    cloth
}

/// Sews the last column of panel 0 to the first column of panel 1, half an edge apart.
pub(crate) fn sew(cloth: &mut Cloth, cells: usize) {
    let side = cells as u32 + 1;
    let length = 1.0;
    let links = (0..cells as u32)
        .map(|j| SeamLink {
            vertex: side * side + j,
            edge: [side * (side - 1) + j, side * (side - 1) + j + 1],
            t: 0.5,
            length,
        })
        .collect();
    cloth.mesh.seams.push(SeamMesh {
        links,
        rest_angle: 0.0,
    });
}

pub(crate) fn state(positions: Vec<Vec3>) -> State {
    State {
        time: 0.0,
        velocities: vec![Vec3::zeros(); positions.len()],
        positions,
        topology: Default::default(),
        u: Vec::new(),
        u_rates: Vec::new(),
        sliding: Vec::new(),
        strands: Vec::new(),
        yarn_normals: Vec::new(),
        pins: Vec::new(),
        bodies: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        step_size: f64::INFINITY,
        gravity: WORLD.gravity,
        wind: Vec3::zeros(),
        pressure: 0.0,
    }
}

/// SplitMix64 in (-1, 1).
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn signed(&mut self) -> f64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }

    pub(crate) fn vector(&mut self) -> Vec3 {
        Vec3::new(self.signed(), self.signed(), self.signed())
    }
}
