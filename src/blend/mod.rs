//! Where yarns and triangles of one panel describe the same cloth: nodes inside of triangles, and
//! vertices among nodes.

pub mod embed;
pub mod follow;
pub mod region;

pub use follow::Follow;
