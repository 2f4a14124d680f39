//! toile: garment simulation in which yarns and triangles share one mechanical system.
//!
//! Read `ARCHITECTURE.md` for the shape of the house. Modules import only from modules that stand
//! before them in this list.

pub mod blend;
pub mod body;
pub mod capi;
pub mod cloth;
pub mod error;
pub mod fabric;
pub mod fmi;
pub mod indicate;
pub mod math;
pub mod pattern;
pub mod readout;
pub mod report;
pub mod scene;
pub mod sim;
pub mod sim_scene;
pub mod solve;
pub mod system;
pub mod tri;
pub mod yarn;
