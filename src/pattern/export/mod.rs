//! Flat patterns to files: toile's own JSON, SVG.

pub mod json;
pub mod offset;
pub mod svg;

pub use json::{blend_regions, fabric_to_json, garment_to_json};
pub use svg::to_svg;
