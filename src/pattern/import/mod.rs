//! Patterns from files: toile's own JSON, GarmentCode specifications.

pub mod read;
pub mod schema;

use super::{Edge, Fabric, Garment, Panel, Placement, curve::Curve};
use crate::error::{Error, Result};
use crate::math::Vec2;

/// Temporary stub: a square, whatever object the text holds.
pub fn garment_from_json(text: &str, _base_dir: Option<&std::path::Path>) -> Result<Garment> {
    let v: serde_json::Value =
        serde_json::from_str(text).map_err(|e| Error::parse(e.to_string()))?;
    if !v.is_object() {
        return Err(Error::parse("garment must be an object"));
    }
    let edge = |a, b| Edge {
        start: a,
        end: b,
        curve: Curve::Line,
        label: None,
    };
    Ok(Garment {
        name: "square".into(),
        panels: vec![Panel {
            name: "square".into(),
            vertices: vec![
                Vec2::new(0.0, 0.0),
                Vec2::new(1.0, 0.0),
                Vec2::new(1.0, 1.0),
                Vec2::new(0.0, 1.0),
            ],
            outline: vec![edge(0, 1), edge(1, 2), edge(2, 3), edge(3, 0)],
            holes: vec![],
            placement: Placement::default(),
            fabric: 0,
            grain: 0.0,
            edge_length: None,
            label: None,
        }],
        seams: vec![],
        fabrics: vec![Fabric::default()],
        edge_length: 0.02,
        blend_regions: vec![],
    })
}

/// Temporary stub.
pub fn fabric_from_json(text: &str) -> Result<(Fabric, Vec<String>)> {
    let v: serde_json::Value =
        serde_json::from_str(text).map_err(|e| Error::parse(e.to_string()))?;
    if !v.is_object() {
        return Err(Error::parse("fabric must be an object"));
    }
    Ok((Fabric::default(), vec![]))
}

/// Temporary stub.
pub fn garment_from_node(
    node: &read::Node<'_>,
    base_dir: Option<&std::path::Path>,
) -> Result<(Garment, Vec<String>)> {
    let object = node.object()?;
    if !object.has("toile_garment") && !object.has("pattern") {
        return Err(object.error("neither a toile garment nor a GarmentCode specification"));
    }
    Ok((
        garment_from_json(&node.value.to_string(), base_dir)?,
        vec![],
    ))
}

/// Temporary stub.
pub fn garment_with_notes(
    text: &str,
    base_dir: Option<&std::path::Path>,
) -> Result<(Garment, Vec<String>)> {
    let value = read::parse(text)?;
    garment_from_node(&read::Node::new(&value, ""), base_dir)
}
