//! Plane curves of pattern edges: straight, quadratic and cubic Bezier, circular arc.

use crate::math::Vec2;

/// Shape of an edge between its two corners; control points in panel coordinates [m].
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Curve {
    /// Straight.
    Line,
    /// Quadratic Bezier with one control point.
    Quadratic(Vec2),
    /// Cubic Bezier with two control points.
    Cubic(Vec2, Vec2),
    /// Circular arc: radius [m]; the larger of the two arcs or not; bulging to the right of the
    /// directed edge or to the left.
    Arc {
        /// Radius [m].
        radius: f64,
        /// The arc of more than half a turn.
        large: bool,
        /// Bulges to the right of the directed edge.
        right: bool,
    },
}
