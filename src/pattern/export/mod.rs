//! Flat patterns to files: toile's own JSON, SVG.

pub mod json;

pub use json::{fabric_to_json, garment_to_json};
