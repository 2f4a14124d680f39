//! Solvers: Newton with a line search, step control, static drape, linear systems behind one trait.

pub mod linear;
pub mod report;
pub mod settings;
