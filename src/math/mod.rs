//! Mathematics without cloth words: small dense algebra, geometry with derivatives, plane curves,
//! block-sparse matrices, deterministic parallel loops, finite differences, edges of
//! triangles.

pub mod block;
pub mod boxtree;
pub mod diff;
pub mod geometry;
pub mod hash;
pub mod parallel;
pub mod spd;
pub mod topology;

/// Point or vector in space, in metres unless said otherwise.
pub type Vec3 = nalgebra::Vector3<f64>;
/// Point or vector in the plane of a flat panel [m].
pub type Vec2 = nalgebra::Vector2<f64>;
/// Dense 3x3 matrix.
pub type Mat3 = nalgebra::Matrix3<f64>;
/// Dense 2x2 matrix.
pub type Mat2 = nalgebra::Matrix2<f64>;
/// Rotation.
pub type Rotation = nalgebra::UnitQuaternion<f64>;
