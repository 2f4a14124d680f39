//! Where yarns and triangles describe the same cloth: which triangles give way to yarns, nodes that
//! ride on triangles, vertices that follow yarns.

pub mod direct;
pub mod embed;
pub mod follow;
pub mod region;
pub mod riders;

pub use direct::Direct;
pub use follow::Follow;
pub use riders::{Rider, Riders};
