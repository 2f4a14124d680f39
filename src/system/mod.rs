//! The mechanical system: degrees of freedom, energy terms, assembly, state.
//!
//! A [`System`](build::System) is compiled from a garment and never changes during a run; the
//! [`State`](state::State) holds everything that the next step's bits depend on.

pub mod contact;
pub mod state;
pub mod term;
