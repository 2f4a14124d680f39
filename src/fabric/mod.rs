//! What a fabric of yarns is as a whole: its periodic cell, how it lies at rest, the triangles' material that is like it.

mod bend;
pub mod cell;
pub mod fit;
pub mod fitted;
mod known;
mod nonnegative;
pub mod rest;
pub mod ridges;

pub use cell::PeriodicCell;
