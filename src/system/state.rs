//! Everything that the next step's bits depend on.

use crate::body::Pose;
use crate::math::Vec3;
use crate::yarn::Topology;
use serde::{Deserialize, Serialize};

/// The mutable part of a simulation; a snapshot is exactly this.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct State {
    /// Simulated time [s].
    pub time: f64,
    /// Positions of the vertices, then of the yarns' nodes [m].
    pub positions: Vec<Vec3>,
    /// Their velocities [m/s].
    pub velocities: Vec<Vec3>,
    /// Passages of yarns that are not as laid.
    pub topology: Topology,
    /// Material coordinate of each passage of a yarn through a node [m]; empty without yarns.
    pub u: Vec<f64>,
    /// Their rates [m/s].
    pub u_rates: Vec<f64>,
    /// Whether the yarn slides there now, so that the coordinate is an unknown.
    pub sliding: Vec<bool>,
    /// What each strand of the stacks has of friction.
    pub strands: Vec<StrandState>,
    /// Normal of each node with several yarns, from the back to the front; zero elsewhere and before
    /// it is known.
    pub yarn_normals: Vec<Vec3>,
    /// Pinned vertices, sorted by vertex.
    pub pins: Vec<Pin>,
    /// One for each body of the world.
    pub bodies: Vec<BodyState>,
    /// Friction anchors against bodies, sorted by (vertex, body).
    pub body_anchors: Vec<BodyAnchor>,
    /// Friction anchors of cloth on cloth, sorted by (a, b).
    pub pair_anchors: Vec<PairAnchor>,
    /// Step size that the controller tries next [s]; infinite before the first step.
    pub step_size: f64,
    /// Acceleration of gravity [m/s^2].
    pub gravity: Vec3,
    /// Velocity of the air [m/s].
    pub wind: Vec3,
    /// Pressure along the cloth's normal [Pa].
    pub pressure: f64,
}

/// Friction of a strand at a node, carried from step to step.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StrandState {
    /// Anchor of its material coordinate [m].
    pub anchor: f64,
    /// Anchor of its material coordinate less that of the next strand in the stack, where the two
    /// lie beside each other [m].
    pub beside: f64,
    /// Normal force with the next strand in the stack in the last accepted step [N].
    pub contact: f64,
}

/// A point held at a place: a vertex or, counted on, a node of the yarns.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct Pin {
    /// The vertex.
    pub vertex: u32,
    /// Where it is to be at the end of the next step [m].
    pub target: Vec3,
}

/// A body's motion over the next step.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyState {
    /// Pose at the present time.
    pub pose: Pose,
    /// Pose at the end of the next step.
    pub target: Pose,
    /// Deforming mesh: vertices at the present time, body frame [m]. Empty: as created.
    pub vertices: Vec<Vec3>,
    /// Deforming mesh: vertices at the end of the next step. Empty: no change.
    pub target_vertices: Vec<Vec3>,
    /// Whether a step or a drape has run since the body came in; before that a new pose is a
    /// placement, afterwards a motion.
    pub moved_with_time: bool,
}

/// Anchor of the moving-anchor friction spring of a vertex on a body.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct BodyAnchor {
    /// The vertex.
    pub vertex: u32,
    /// The body.
    pub body: u32,
    /// World position at the present time [m].
    pub point: Vec3,
    /// Normal force of the last accepted step [N].
    pub normal_force: f64,
}

/// Anchor of the friction between two vertices of the cloth.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct PairAnchor {
    /// Smaller vertex.
    pub a: u32,
    /// Larger vertex.
    pub b: u32,
    /// Anchored value of `x_b - x_a` [m].
    pub offset: Vec3,
    /// Normal force of the last accepted step [N].
    pub normal_force: f64,
    /// Distance that the pair pressed from in that step [m].
    pub rest: f64,
}
