//! Where the nodes of yarns lie among triangles, and how much of each triangle's yarn there is.
//!
//! A segment of yarn of mass `m` whose energies have the weight `a` takes `a m` from the triangles that it lies in: with
//! the mass `m_T` of all yarn that could be laid in a triangle, `m_T - sum a m` is left to it, and every piece of
//! yarn weighs once. A segment that ends in another triangle than it begins in is cut into pieces.

use super::riders::Rider;
use crate::error::Result;
use crate::math::geometry::cross2;
use crate::math::{Mat3, Vec2};
use crate::pattern::Garment;
use crate::tri::{GarmentMesh, Transfer};
use crate::yarn::{Family, YarnMaterial, YarnMesh};

/// Least part of a triangle's membrane that is left to it.
const LEAST: f64 = 0.01;
/// Part of a triangle's yarn below which what is left of it is no mass.
const NO_MASS: f64 = 1e-6;
/// Pieces of a segment that ends in another triangle than it begins in.
const PIECES: usize = 16;

/// Where nodes are among the triangles.
pub(super) struct Places {
    pub(super) map: Transfer,
    /// Same on the other side of a seam: node and position in `map`.
    pub(super) across: Vec<(u32, usize)>,
}

impl Places {
    pub(super) fn new(mesh: &GarmentMesh, laid: &YarnMesh) -> Result<Self> {
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
    pub(super) fn own(&self, laid: &YarnMesh) -> &[u32] {
        &self.map.triangle[..laid.uv.len()]
    }

    /// For each node whether it or its place on the other side of a seam lies in a triangle with yarns.
    pub(super) fn inside(&self, laid: &YarnMesh, has_yarns: impl Fn(usize) -> bool) -> Vec<bool> {
        let own = self.own(laid).iter();
        let mut inside: Vec<bool> = own.map(|t| has_yarns(*t as usize)).collect();
        for (node, k) in &self.across {
            inside[*node as usize] |= has_yarns(self.map.triangle[*k] as usize);
        }
        inside
    }

    /// What a node at place `k` of the map is carried by.
    pub(super) fn rider(&self, mesh: &GarmentMesh, node: u32, k: usize) -> Rider {
        Rider {
            point: node,
            vertices: mesh.triangles[self.map.triangle[k] as usize],
            weights: self.map.weights[k],
            turn: Mat3::identity(),
        }
    }

    /// Nodes of which a place is such (`rides(node, triangle)`), on either side of a seam; by node.
    pub(super) fn riders(
        &self,
        mesh: &GarmentMesh,
        laid: &YarnMesh,
        rides: impl Fn(u32, usize) -> bool,
    ) -> Vec<Rider> {
        let across = self.across.iter().copied();
        let mut places: Vec<(u32, usize)> = (0..).zip(0..laid.uv.len()).chain(across).collect();
        // of two places that stay a node rides on its own
        places.sort_by_key(|p| p.0);
        let mut list: Vec<Rider> = places
            .into_iter()
            .filter(|(node, k)| rides(*node, self.map.triangle[*k] as usize))
            .map(|(node, k)| self.rider(mesh, node, k))
            .collect();
        list.dedup_by_key(|r| r.point);
        list
    }
}

/// The riders among `list`, by laid node, that are in the part of the yarns with these `nodes`, numbered as points
/// from `first` on.
pub(super) fn in_part(list: Vec<Rider>, nodes: &[u32], first: u32) -> Vec<Rider> {
    let mut riders = Vec::new();
    let mut all = list.into_iter().peekable();
    for (id, node) in (first..).zip(nodes) {
        while all.next_if(|r| r.point < *node).is_some() {}
        if let Some(rider) = all.next_if(|r| r.point == *node) {
            riders.push(Rider { point: id, ..rider });
        }
    }
    riders
}

/// Laid numbers of a part's passages, from the numbers that laid passages have in the part.
pub(super) fn laid_passages(numbers: &[u32]) -> Vec<u32> {
    let there = (0..).zip(numbers).filter(|(_, n)| **n != u32::MAX);
    there.map(|(laid, _)| laid).collect()
}

/// Mass of yarn [kg] in a triangle: all, and weighted along weft and warp.
#[derive(Clone, Copy, Default)]
struct Amount {
    mass: f64,
    along: [f64; 2],
}

/// Yarn in each triangle.
pub(super) struct Cover {
    laid: Vec<Amount>,
    /// Of that what simulated yarns take.
    taken: Vec<Amount>,
}

impl Cover {
    /// `taken(nodes)` is the part of a segment that is simulated. What is left of one in a `full` triangle goes to that of
    /// its other end.
    pub(super) fn new(
        garment: &Garment,
        mesh: &GarmentMesh,
        full: &[bool],
        yarns: &YarnMesh,
        materials: &[YarnMaterial],
        triangle: &[u32],
        taken: impl Fn([u32; 2]) -> f64,
    ) -> Result<Self> {
        let mut cover = Self {
            laid: vec![Amount::default(); mesh.triangles.len()],
            taken: vec![Amount::default(); mesh.triangles.len()],
        };
        let mut pieces = (Vec::new(), Vec::new(), Vec::new());
        for y in (0..yarns.yarn_count()).filter(|y| yarns.yarn_family[*y] != Family::Seam) {
            let density = materials[yarns.yarn_fabric[y] as usize].density;
            let (sin, cos) = garment.panels[yarns.panel_of(y)].grain.sin_cos();
            for pair in yarns.yarn(y).windows(2) {
                let part = taken([pair[0].node, pair[1].node]);
                let nodes = [pair[0].node, pair[1].node].map(|n| n as usize);
                let [a, b] = nodes.map(|n| yarns.uv[n]);
                let d = (b - a).try_normalize(0.0).unwrap_or_else(Vec2::zeros);
                let axes = [Vec2::new(cos, sin), Vec2::new(-sin, cos)];
                let mass = density * (pair[1].u - pair[0].u);
                let whole = Amount {
                    mass,
                    along: axes.map(|axis| mass * axis.dot(&d).powi(2)),
                };
                let [from, to] = nodes.map(|n| triangle[n] as usize);
                let home = if full[from] { to } else { from };
                if from == to {
                    cover.add(from, &whole, 1.0, part);
                    continue;
                }
                for k in 0..PIECES {
                    pieces.0.push(yarns.node_panel[nodes[0]]);
                    pieces.1.push(a.lerp(&b, (k as f64 + 0.5) / PIECES as f64));
                    pieces.2.push((whole, part, home));
                }
            }
        }
        let map = Transfer::of_points(mesh, &pieces.0, &pieces.1)?;
        for (t, (whole, part, home)) in map.triangle.iter().zip(&pieces.2) {
            let (t, piece) = (*t as usize, 1.0 / PIECES as f64);
            cover.add(t, whole, piece, *part);
            if full[t] && *part > 0.0 && !full[*home] {
                cover.laid[*home].mass += piece * (1.0 - part) * whole.mass;
            }
        }
        Ok(cover)
    }

    fn add(&mut self, triangle: usize, whole: &Amount, piece: f64, taken: f64) {
        let lists = [(&mut self.laid, piece), (&mut self.taken, piece * taken)];
        for (list, part) in lists {
            let amount = &mut list[triangle];
            amount.mass += part * whole.mass;
            for k in 0..2 {
                amount.along[k] += part * whole.along[k];
            }
        }
    }

    /// Mass that is left to a triangle from which yarns take some [kg].
    pub(super) fn mass(&self, triangle: usize) -> Option<f64> {
        let taken = self.taken[triangle].mass;
        (taken > 0.0).then(|| (self.laid[triangle].mass - taken).max(0.0))
    }

    /// Triangles that are not `full` at a vertex to which none of its triangles leaves any mass.
    pub(super) fn bare(&self, mesh: &GarmentMesh, full: &[bool]) -> Vec<usize> {
        let mut heavy = vec![false; mesh.uv.len()];
        let kept = || (0..full.len()).filter(|t| !full[*t]);
        for t in kept() {
            let least = NO_MASS * self.laid[t].mass;
            if self.mass(t).is_none_or(|mass| mass > least) {
                for v in mesh.triangles[t] {
                    heavy[v as usize] = true;
                }
            }
        }
        let bare = |t: &usize| mesh.triangles[*t].iter().any(|v| !heavy[*v as usize]);
        kept().filter(bare).collect()
    }

    /// What is left to each triangle of its membrane along weft and warp.
    pub(super) fn share(&self, mesh: &GarmentMesh, full: &[bool]) -> Vec<[f64; 2]> {
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
        for t in (0..full.len()).filter(|t| !full[*t] && self.taken[*t].mass > 0.0) {
            let panel = mesh.triangle_panel[t] as usize;
            for k in 0..2 {
                let laid = area(t) * sums[panel][k] / areas[panel];
                if laid > 0.0 {
                    share[t][k] = (1.0 - self.taken[t].along[k] / laid).clamp(LEAST, 1.0);
                }
            }
        }
        share
    }
}
