//! The mechanical system: degrees of freedom, energy terms, assembly, state.
//!
//! A [`System`](build::System) is compiled from a garment and never changes during a run; the
//! [`State`](state::State) holds everything that the next step's bits depend on.

pub mod air;
pub mod assemble;
pub mod bending_fan;
pub mod bodies;
pub mod build;
pub mod contact;
pub mod gravity;
pub mod hinge;
pub mod membrane;
pub mod points;
pub mod pressure;
pub mod quadratic_bending;
pub mod seam_term;
pub mod snapshot;
pub mod state;
pub mod term;
pub mod yarn;
