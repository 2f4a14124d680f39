//! Contact: of the cloth with itself, and tests of what contact must prevent.

pub mod crossing;
pub mod self_contact;
pub mod spheres;
pub mod travel;
