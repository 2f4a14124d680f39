//! Model files: Wavefront OBJ, glTF 2.0 (.glb), legacy VTK, PC2 point caches.

pub mod gltf;
pub mod obj;
pub mod pc2;
pub mod vtk;

use crate::error::{Error, Result};
use std::path::Path;

/// Writes a whole file; the error names it.
pub fn write(path: &Path, bytes: &[u8]) -> Result<()> {
    std::fs::write(path, bytes).map_err(|e| Error::io(format!("{}: {e}", path.display())))
}
