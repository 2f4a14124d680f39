//! Contact: cloth against bodies, cloth against itself, and the checks that nothing passed through.

pub mod body;
mod clearance;
pub mod crossing;
pub mod edge;
mod friction;
mod rods;
pub mod self_contact;
pub mod spheres;
pub mod travel;
