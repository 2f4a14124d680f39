//! Where yarns and triangles describe the same cloth: which triangles give way to yarns, how the two are joined, nodes
//! that ride on triangles, vertices that follow yarns.

pub mod blended;
pub mod coupling;
mod cover;
pub mod direct;
pub mod embed;
pub mod filter;
pub mod follow;
pub mod region;
pub mod riders;
mod support;
pub mod trace;

pub use coupling::{Coupling, Joined};
pub use filter::Filter;
pub use follow::Follow;
pub use region::Region;
pub use riders::{Rider, Riders};
