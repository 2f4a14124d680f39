//! What moves in space: vertices of triangles, then nodes of yarns, as masses and contacts see them.
//!
//! A vertex stands for a third of the triangles around it, a node for half of the yarn between it
//! and its neighbours; a yarn of radius `R` covers `2 R` of the surface. A vertex without triangles
//! does not move by itself: it follows the yarns laid where it is. Nor does a node that rides on
//! triangles. Where both are in part, each stands for its part.

use crate::blend::{Coupling, Filter};
use crate::cloth::Cloth;
use crate::yarn::Yarns;
use std::sync::Arc;

/// Numbers of every point, vertices first.
#[derive(Clone, Debug, Default)]
pub struct Points {
    /// Lumped mass [kg].
    pub masses: Vec<f64>,
    /// Area of surface that it stands for [m^2].
    pub areas: Vec<f64>,
    /// Mass-proportional damping [1/s].
    pub damping: Vec<f64>,
    /// Radius of the yarn, 0 for a vertex [m].
    pub radii: Vec<f64>,
    /// Number of vertices.
    pub vertex_count: usize,
    /// What joins yarns and triangles.
    pub coupling: Coupling,
}

impl Points {
    /// Points of a cloth and, if there are any, of yarns, joined by nothing.
    pub fn new(cloth: &Cloth, yarns: Option<&Yarns>) -> Self {
        let n = cloth.mesh.uv.len();
        let mut points = Self {
            masses: cloth.masses.clone(),
            areas: cloth.vertex_areas.clone(),
            damping: vec![0.0; n],
            radii: vec![0.0; n],
            vertex_count: n,
            coupling: Coupling::default(),
        };
        for (d, panel) in points.damping.iter_mut().zip(&cloth.mesh.vertex_panel) {
            *d = cloth.fabrics[cloth.panel_fabric[*panel as usize]].damping_mass;
        }
        if let Some(yarns) = yarns {
            points.add(yarns);
        }
        points
    }

    fn add(&mut self, yarns: &Yarns) {
        let all = self.vertex_count + yarns.mesh.uv.len();
        for list in [
            &mut self.masses,
            &mut self.areas,
            &mut self.damping,
            &mut self.radii,
        ] {
            list.resize(all, 0.0);
        }
        for y in 0..yarns.mesh.yarn_count() {
            let material = yarns.material(y);
            let yarn = yarns.mesh.yarn(y);
            for pair in yarn.windows(2) {
                if !yarns.mesh.reaches(&[pair[0].node, pair[1].node]) {
                    continue;
                }
                let part = yarns.mesh.weight(&[pair[0].node, pair[1].node]);
                let half = 0.5 * (pair[1].u - pair[0].u) * part;
                for end in pair {
                    let p = self.vertex_count + end.node as usize;
                    self.masses[p] += material.density * half;
                    self.areas[p] += 2.0 * material.radius * half;
                    self.damping[p] = material.damping_mass;
                    self.radii[p] = self.radii[p].max(material.radius);
                }
            }
        }
        // an image stands for nothing more than its own does, but is as thick
        for image in &yarns.mesh.images {
            let [p, own] = [image.incidence, image.of]
                .map(|i| self.vertex_count + yarns.mesh.incidences[i as usize].node as usize);
            self.radii[p] = self.radii[own];
        }
    }

    /// Number of points.
    pub fn count(&self) -> usize {
        self.masses.len()
    }

    /// Whether the point moves by itself.
    pub fn moves(&self, point: usize) -> bool {
        let free = |f: &Arc<Filter>| f.keeps(point as u32);
        (self.areas[point] > 0.0 || self.coupling.filter.as_ref().is_some_and(free))
            && !self.coupling.riders.rides(point as u32)
    }
}
