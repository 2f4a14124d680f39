//! What yarns and triangles of one system have to do with each other, whichever way they were joined.

use super::filter::Filter;
use super::riders::Riders;
use crate::math::Vec3;
use crate::yarn::YarnMesh;
use std::sync::Arc;

/// Points whose places follow from others, and constraints between points.
#[derive(Clone, Debug, Default)]
pub struct Coupling {
    /// Nodes that ride on triangles.
    pub riders: Riders,
    /// The constraints of blended rings, if there are any.
    pub filter: Option<Arc<Filter>>,
}

/// Yarns of a region and how they are joined to the triangles around it.
#[derive(Clone, Debug, Default)]
pub struct Joined {
    /// The yarns.
    pub yarns: YarnMesh,
    /// Number that each of their nodes has in the yarns of whole panels.
    pub nodes: Vec<u32>,
    /// And each of their passages.
    pub passages: Vec<u32>,
    /// What joins them, by points (vertices, then nodes).
    pub coupling: Coupling,
    /// For each triangle of the whole mesh whether yarns stand for it.
    pub full: Vec<bool>,
    /// Part of the membrane of each triangle of the whole mesh that is its own, along weft and warp.
    pub share: Vec<[f64; 2]>,
    /// Part of its other energies.
    pub own: Vec<f64>,
    /// Mass of each triangle that yarns cover in part [kg], by triangle of the whole mesh.
    pub masses: Vec<Option<f64>>,
}

impl Coupling {
    /// Brings values of points to those that the coupling admits: nodes of rings keep what the triangles cannot
    /// say, riders take what their vertices make.
    pub fn carry(&self, values: &mut [Vec3]) {
        if let Some(filter) = &self.filter {
            filter.project(values);
        }
        self.riders.carry(values);
    }

    /// Visits the points that do not move by themselves: those that ride, those of rings, and the vertices that carry either.
    pub fn joined(&self, mut visit: impl FnMut(u32)) {
        let blended = self.filter.as_deref().map_or(&[][..], Filter::nodes);
        for rider in self.riders.list().iter().chain(blended) {
            visit(rider.point);
            rider.vertices.into_iter().for_each(&mut visit);
        }
    }

    /// Turns a gradient by points that move independently into one by vertices, with what hangs on them, and by what
    /// nodes do beside that.
    pub fn gather(&self, gradient: &mut [Vec3]) {
        if let Some(filter) = &self.filter {
            filter.gather(gradient);
        }
    }
}
