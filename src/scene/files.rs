//! Files that a scene names: found beside the scene, bounded in size, named when missing.

use crate::error::{Error, Result};
use std::path::{Path, PathBuf};

/// Largest file that is read [bytes].
pub const MAX_FILE: u64 = 1 << 30;

/// A path of a scene, relative to the scene's folder; an absolute one stays as it is.
pub fn resolve(base_dir: Option<&Path>, file: &str) -> Result<PathBuf> {
    if file.is_empty() || file.contains('\0') {
        return Err(Error::io("the file name is empty or holds a zero byte"));
    }
    Ok(base_dir.map_or_else(|| PathBuf::from(file), |dir| dir.join(file)))
}

/// The bytes of a regular file.
pub fn read(path: &Path) -> Result<Vec<u8>> {
    let fail =
        |e: &dyn std::fmt::Display| Error::io(format!("cannot read {}: {e}", path.display()));
    let meta = std::fs::metadata(path).map_err(|e| fail(&e))?;
    // a device or a pipe may have no end
    if !meta.is_file() {
        return Err(fail(&"not a regular file"));
    }
    if meta.len() > MAX_FILE {
        return Err(Error::limit(format!(
            "{} has {} bytes, limit {MAX_FILE}",
            path.display(),
            meta.len()
        )));
    }
    std::fs::read(path).map_err(|e| fail(&e))
}

/// The text of a regular file.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path)?).map_err(|e| {
        Error::parse(format!(
            "{} is not UTF-8 text: byte {}",
            path.display(),
            e.utf8_error().valid_up_to()
        ))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn missing_files_folders_and_devices_are_named() {
        let dir = std::env::temp_dir();
        for bad in ["no-such-file.obj", ".", "/dev/zero"] {
            let path = resolve(Some(&dir), bad).unwrap();
            let text = read(&path).unwrap_err().message;
            assert!(text.contains(bad.trim_matches('.')), "{text}");
        }
        assert!(resolve(Some(&dir), "").is_err());
        assert!(resolve(None, "a\0b").is_err());
    }
}
