//! The flat truth: panels, seams, fabrics, as plain data without any simulation inside.
//!
//! A panel lives in its own plane with coordinates `(u, v)` [m]: `u` along the weft, `v` along the
//! warp (up). Its edges form one closed outline and any number of closed holes. Seams join two
//! edges (a dart joins two edges of one panel). World placement is a rigid motion of the plane
//! `z = 0`.

pub mod blend_region;
pub mod chart;
pub mod check;
pub mod curve;
pub mod export;
pub mod fabric;
pub mod import;
pub mod measure;
pub mod outline;
pub mod ridge;
pub mod yarn_fabric;

pub use blend_region::{BlendRegion, Shape, check_rings};
pub use fabric::{BendingModel, Fabric};
pub use ridge::Ridge;
pub use yarn_fabric::YarnFabric;

use crate::math::{Rotation, Vec2, Vec3};
use curve::Curve;

/// The sewn thing: what a host edits.
#[derive(Clone, Debug, PartialEq, Default)]
pub struct Garment {
    /// Name for people.
    pub name: String,
    /// Flat pieces.
    pub panels: Vec<Panel>,
    /// Which edges are sewn to which.
    pub seams: Vec<Seam>,
    /// Fabrics; a panel names one by its index. Never empty once built (`Fabric::default()`).
    pub fabrics: Vec<Fabric>,
    /// Default target edge length of the triangulation [m]; a panel may override it.
    pub edge_length: f64,
    /// Where every yarn is wanted.
    pub blend_regions: Vec<BlendRegion>,
}

impl Garment {
    /// Itself in messages: by name, if it has one.
    pub fn title(&self) -> String {
        match &*self.name {
            "" => "the garment".into(),
            name => format!("garment '{name}'"),
        }
    }
}

/// One flat piece of cloth.
#[derive(Clone, Debug, PartialEq)]
pub struct Panel {
    /// Unique name.
    pub name: String,
    /// Corner points [m]; edges index them.
    pub vertices: Vec<Vec2>,
    /// Closed outline, in order; never re-oriented: its direction defines the outside of the cloth
    /// (counter-clockwise seen from the outside).
    pub outline: Vec<Edge>,
    /// Closed loops inside the outline, each in order. Edge numbers of the panel run through the
    /// outline first, then through the holes.
    pub holes: Vec<Vec<Edge>>,
    /// Rigid motion of the plane `z = 0` into the world, before sewing.
    pub placement: Placement,
    /// Index into `Garment::fabrics`.
    pub fabric: usize,
    /// Direction of the warp in the plane, as an angle from `+v`, counter-clockwise [rad].
    pub grain: f64,
    /// Target edge length [m], if not the garment's.
    pub edge_length: Option<f64>,
    /// Free label of the source file ("body", "arm", ...).
    pub label: Option<String>,
}

/// One edge of a panel.
#[derive(Clone, Debug, PartialEq)]
pub struct Edge {
    /// Corner where it starts.
    pub start: u32,
    /// Corner where it ends.
    pub end: u32,
    /// Shape between the two.
    pub curve: Curve,
    /// Free label of the source file.
    pub label: Option<String>,
}

/// Rigid motion `x = rotation * (u, v, 0) + translation` [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placement {
    /// Rotation of the panel's plane.
    pub rotation: Rotation,
    /// World position of the panel's origin [m].
    pub translation: Vec3,
}

impl Default for Placement {
    fn default() -> Self {
        Self {
            rotation: Rotation::identity(),
            translation: Vec3::zeros(),
        }
    }
}

/// An edge of a panel, by number.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EdgeRef {
    /// Panel index.
    pub panel: u32,
    /// Edge number in that panel, outline first.
    pub edge: u32,
}

/// Two edges sewn together, matched by fraction of arc length.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Seam {
    /// First edge.
    pub a: EdgeRef,
    /// Second edge.
    pub b: EdgeRef,
    /// `false` (usual): the start of `a` meets the end of `b`, so that the outsides agree;
    /// `true`: start meets start.
    pub same_direction: bool,
    /// Rest angle across the seam [rad]; 0 is flat.
    pub rest_angle: f64,
}

impl Panel {
    /// All edges: outline first, then hole after hole.
    pub fn edges(&self) -> impl Iterator<Item = &Edge> {
        self.outline.iter().chain(self.holes.iter().flatten())
    }

    /// Number of edges, holes included.
    pub fn edge_count(&self) -> usize {
        self.outline.len() + self.holes.iter().map(Vec::len).sum::<usize>()
    }

    /// Edge by number, outline first.
    pub fn edge(&self, index: usize) -> Option<&Edge> {
        self.edges().nth(index)
    }
}

impl Placement {
    /// World position of a flat point.
    pub fn apply(&self, uv: &Vec2) -> Vec3 {
        self.rotation * Vec3::new(uv.x, uv.y, 0.0) + self.translation
    }
}
