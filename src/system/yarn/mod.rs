//! The mechanics of yarns: energies over nodes and material coordinates.

pub mod unknowns;

pub use unknowns::Unknowns;
