//! Solvers: Newton with a line search, step control, static drape, linear systems behind one trait.

mod admissible;
mod carry;
pub mod drape;
mod drift;
pub mod engine;
pub mod linear;
mod local;
pub mod newton;
mod pace;
pub mod relax;
pub mod report;
pub mod rest;
pub mod settings;
mod sew;
pub mod step;
