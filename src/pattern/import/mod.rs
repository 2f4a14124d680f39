//! Patterns and fabrics from JSON: toile's own garment object, GarmentCode specifications, toile's
//! own fabrics and ARCSim's measured ones. Units are converted here; inside all is SI.
//!
//! Readers take any bytes: what is wrong is told with its JSON path. They do not judge geometry;
//! `Garment::check` does.

pub mod fabric;
pub mod garmentcode;
pub mod json;
pub mod read;
pub mod schema;
pub mod yarns;

pub use fabric::fabric_from_json;

use super::Garment;
use crate::error::{Error, Result};
use read::{Node, keep, parse};
use std::path::Path;

/// Target edge length of garments whose file names none [m].
pub const DEFAULT_EDGE_LENGTH: f64 = 0.015;

/// Reads a garment: toile's own object (key `toile_garment`) or a GarmentCode specification (key
/// `pattern`). `base_dir` is where fabric files named in it are looked up.
pub fn garment_from_json(text: &str, base_dir: Option<&Path>) -> Result<Garment> {
    Ok(garment_with_notes(text, base_dir)?.0)
}

/// [`garment_from_json`] with notes on what the fabrics' files said that was dropped.
pub fn garment_with_notes(text: &str, base_dir: Option<&Path>) -> Result<(Garment, Vec<String>)> {
    let mut problems = Vec::new();
    let read = garment_from_node(&Node::new(&parse(text)?, ""), base_dir, &mut problems);
    match (problems.into_iter().next(), read) {
        (None, Some(read)) => Ok(read),
        (Some(problem), _) => Err(problem),
        (None, None) => Err(Error::parse("no garment could be read")),
    }
}

/// Reads a garment that stands inside another JSON text. What is wrong is put aside, all of a garment of
/// toile's own and the first of a specification; nothing is read then.
pub fn garment_from_node(
    node: &Node<'_>,
    base_dir: Option<&Path>,
    problems: &mut Vec<Error>,
) -> Option<(Garment, Vec<String>)> {
    let object = keep(problems, node.object())?;
    if object.has("toile_garment") {
        json::read_garment(&object, base_dir, problems)
    } else if object.has("pattern") {
        let garment = keep(problems, garmentcode::read_specification(&object))?;
        Some((garment, Vec::new()))
    } else {
        problems.push(object.error(
            "neither a toile garment (key 'toile_garment') nor a GarmentCode specification (key 'pattern')",
        ));
        None
    }
}

/// Reads a garment file; fabric files are looked up beside it. A GarmentCode garment takes its name
/// from the file.
pub fn garment_from_file(path: &Path) -> Result<(Garment, Vec<String>)> {
    let text = std::fs::read_to_string(path)
        .map_err(|e| Error::io(format!("cannot read {}: {e}", path.display())))?;
    let (mut garment, notes) =
        garment_with_notes(&text, path.parent()).map_err(|e| e.at(path.display()))?;
    if garment.name.is_empty() {
        garment.name = path
            .file_stem()
            .map(|stem| stem.to_string_lossy().into_owned())
            .unwrap_or_default();
    }
    Ok((garment, notes))
}
