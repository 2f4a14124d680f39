//! Yarns joined to triangles directly: no blending, no filter.
//!
//! Triangles of the region are taken out. Every energy of the yarns with a node in the region is there as a whole; its
//! nodes outside ride on the triangles they lie in, `p = B v`. So the yarns reach over the border, and what they do
//! there is taken from the triangles. With the mass `m_T` of all yarn that could be laid in triangle `T` of area `A`,
//! `c_T` that of the segments that are there, and `m`, `c` the same with each piece weighted by the square of its direction's
//! component along the weft or along the warp,
//!
//! ```text
//! mass of T = m_T - c_T,   share of its membrane along an axis s = max(1 - c / (A m/A of the panel), 0.01)
//! ```
//!
//! where `c_T > 0`, and the fabric's own elsewhere: every piece of yarn weighs once, as yarn or as triangle, and an even
//! stretch pulls evenly on both sides of the border. Bending is left as it is. A rod of a seam between yarns and
//! triangles rides on the edge of the triangles; where both sides are yarns it is free.

use super::riders::{Rider, Riders};
use crate::error::Result;
use crate::math::Vec2;
use crate::math::geometry::cross2;
use crate::pattern::Garment;
use crate::tri::{GarmentMesh, Transfer};
use crate::yarn::{Family, YarnMaterial, YarnMesh};

/// Least part of a triangle's membrane that is left to it.
const LEAST: f64 = 0.01;
/// Pieces of a segment that ends in another triangle than it begins in.
const PIECES: usize = 16;

/// Yarns of a region and how they hang on the triangles around it.
#[derive(Clone, Debug)]
pub struct Direct {
    /// The yarns.
    pub yarns: YarnMesh,
    /// Points (vertices, then nodes) that ride on triangles.
    pub riders: Riders,
    /// Part of the membrane of each triangle of the whole mesh that is its own, along weft and warp.
    pub share: Vec<[f64; 2]>,
    /// Mass of each triangle that yarns cover in part [kg], by triangle of the whole mesh.
    pub masses: Vec<Option<f64>>,
}

/// Where nodes are among the triangles.
struct Places {
    map: Transfer,
    /// Same on the other side of a seam: node and position in `map`.
    across: Vec<(u32, usize)>,
}

impl Direct {
    /// Cuts out of `laid`, the yarns of whole panels, what the triangles with `full` give way to.
    pub fn new(
        garment: &Garment,
        mesh: &GarmentMesh,
        full: &[bool],
        laid: YarnMesh,
        materials: &[YarnMaterial],
    ) -> Result<Self> {
        let places = Places::new(mesh, &laid)?;
        let mut inside: Vec<bool> = places
            .own(&laid)
            .iter()
            .map(|t| full[*t as usize])
            .collect();
        for (node, k) in &places.across {
            inside[*node as usize] |= full[places.map.triangle[*k] as usize];
        }
        let list = places.riders(mesh, full, &laid);
        let cover = Cover::new(mesh, &laid, &inside, places.own(&laid), |y| {
            let fabric = laid.yarn_fabric[y] as usize;
            (
                materials[fabric].density,
                garment.panels[laid.panel_of(y)].grain,
            )
        })?;
        let (share, masses) = cover.left(mesh, full);
        if inside.iter().all(|i| *i) && list.is_empty() {
            return Ok(Self {
                yarns: laid,
                riders: Riders::default(),
                share,
                masses,
            });
        }
        let (yarns, nodes) = laid.part(&inside);
        let first = mesh.uv.len() as u32;
        let mut riders = Vec::new();
        let mut all = list.into_iter().peekable();
        for (id, node) in (first..).zip(&nodes) {
            while all.next_if(|r| r.point < *node).is_some() {}
            if let Some(rider) = all.next_if(|r| r.point == *node) {
                riders.push(Rider { point: id, ..rider });
            }
        }
        Ok(Self {
            yarns,
            riders: Riders::new(riders)?,
            share,
            masses,
        })
    }
}

impl Places {
    fn new(mesh: &GarmentMesh, laid: &YarnMesh) -> Result<Self> {
        let n = laid.uv.len();
        let mut panels = laid.node_panel.clone();
        let mut uv: Vec<Vec2> = laid.uv.clone();
        panels.extend(laid.across.iter().map(|a| a.panel));
        uv.extend(laid.across.iter().map(|a| a.uv));
        let nodes = laid.across.iter().map(|a| a.node);
        Ok(Self {
            map: Transfer::of_points(mesh, &panels, &uv)?,
            across: nodes.zip(n..).collect(),
        })
    }

    /// Triangle of each node.
    fn own(&self, laid: &YarnMesh) -> &[u32] {
        &self.map.triangle[..laid.uv.len()]
    }

    /// Nodes that lie in a triangle that stays, on either side of a seam; by node.
    fn riders(&self, mesh: &GarmentMesh, full: &[bool], laid: &YarnMesh) -> Vec<Rider> {
        let across = self.across.iter().copied();
        let mut places: Vec<(u32, usize)> = (0..).zip(0..laid.uv.len()).chain(across).collect();
        // of two places that stay a node rides on its own
        places.sort_by_key(|p| p.0);
        let mut list: Vec<Rider> = places
            .into_iter()
            .filter(|(_, k)| !full[self.map.triangle[*k] as usize])
            .map(|(node, k)| Rider {
                point: node,
                vertices: mesh.triangles[self.map.triangle[k] as usize],
                weights: self.map.weights[k],
            })
            .collect();
        list.dedup_by_key(|r| r.point);
        list
    }
}

/// Mass of yarn [kg] in a triangle: all, and weighted along weft and warp.
#[derive(Clone, Copy, Default)]
struct Amount {
    mass: f64,
    along: [f64; 2],
}

/// Yarn in each triangle.
struct Cover {
    laid: Vec<Amount>,
    /// Of that what yarns of the region reach over.
    taken: Vec<Amount>,
}

impl Cover {
    /// `of(yarn)` is its mass per length and the grain of its panel.
    fn new(
        mesh: &GarmentMesh,
        yarns: &YarnMesh,
        inside: &[bool],
        triangle: &[u32],
        of: impl Fn(usize) -> (f64, f64),
    ) -> Result<Self> {
        let mut cover = Self {
            laid: vec![Amount::default(); mesh.triangles.len()],
            taken: vec![Amount::default(); mesh.triangles.len()],
        };
        let mut pieces = (Vec::new(), Vec::new(), Vec::new());
        for y in (0..yarns.yarn_count()).filter(|y| yarns.yarn_family[*y] != Family::Seam) {
            let (density, grain) = of(y);
            let (sin, cos) = grain.sin_cos();
            for pair in yarns.yarn(y).windows(2) {
                let nodes = [pair[0].node, pair[1].node].map(|n| n as usize);
                let reaches = nodes.iter().any(|n| inside[*n]);
                let [a, b] = nodes.map(|n| yarns.uv[n]);
                let d = (b - a).try_normalize(0.0).unwrap_or_else(Vec2::zeros);
                let axes = [Vec2::new(cos, sin), Vec2::new(-sin, cos)];
                let mass = density * (pair[1].u - pair[0].u);
                let whole = Amount {
                    mass,
                    along: axes.map(|axis| mass * axis.dot(&d).powi(2)),
                };
                let [from, to] = nodes.map(|n| triangle[n] as usize);
                if from == to {
                    cover.add(from, &whole, 1.0, reaches);
                    continue;
                }
                for k in 0..PIECES {
                    pieces.0.push(yarns.node_panel[nodes[0]]);
                    pieces.1.push(a.lerp(&b, (k as f64 + 0.5) / PIECES as f64));
                    pieces.2.push((whole, reaches));
                }
            }
        }
        let map = Transfer::of_points(mesh, &pieces.0, &pieces.1)?;
        for (t, (whole, reaches)) in map.triangle.iter().zip(&pieces.2) {
            cover.add(*t as usize, whole, 1.0 / PIECES as f64, *reaches);
        }
        Ok(cover)
    }

    fn add(&mut self, triangle: usize, whole: &Amount, part: f64, reaches: bool) {
        let lists = [&mut self.laid, &mut self.taken];
        for list in lists.into_iter().take(1 + usize::from(reaches)) {
            let amount = &mut list[triangle];
            amount.mass += part * whole.mass;
            for k in 0..2 {
                amount.along[k] += part * whole.along[k];
            }
        }
    }

    /// What is left to each triangle of its membrane, and of its mass where yarns cover it.
    fn left(&self, mesh: &GarmentMesh, full: &[bool]) -> (Vec<[f64; 2]>, Vec<Option<f64>>) {
        let panels = mesh.panel_starts.len() - 1;
        let area = |t: usize| {
            let [a, b, c] = mesh.triangles[t].map(|v| mesh.uv[v as usize]);
            0.5 * cross2(&(b - a), &(c - a)).abs()
        };
        let mut areas = vec![0.0; panels];
        let mut sums = vec![[0.0; 2]; panels];
        for (t, panel) in mesh.triangle_panel.iter().enumerate() {
            areas[*panel as usize] += area(t);
            for k in 0..2 {
                sums[*panel as usize][k] += self.laid[t].along[k];
            }
        }
        let mut share = vec![[1.0; 2]; full.len()];
        let mut masses = vec![None; full.len()];
        for t in (0..full.len()).filter(|t| !full[*t] && self.taken[*t].mass > 0.0) {
            let panel = mesh.triangle_panel[t] as usize;
            for k in 0..2 {
                let laid = area(t) * sums[panel][k] / areas[panel];
                if laid > 0.0 {
                    share[t][k] = (1.0 - self.taken[t].along[k] / laid).clamp(LEAST, 1.0);
                }
            }
            masses[t] = Some((self.laid[t].mass - self.taken[t].mass).max(0.0));
        }
        (share, masses)
    }
}
