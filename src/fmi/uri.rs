//! The resource location of FMI 2: a `file` URI with percent escapes.

use crate::error::{Error, Result};
use std::path::PathBuf;

/// The path of a `file` URI.
pub(super) fn path(uri: &str) -> Result<PathBuf> {
    let bad = |what: &str| Error::argument(format!("fmuResourceLocation '{uri}' {what}"));
    let (scheme, rest) = uri.split_at_checked(5).unwrap_or(("", ""));
    if !scheme.eq_ignore_ascii_case("file:") {
        return Err(bad("is no file URI"));
    }
    let path = match rest.strip_prefix("//") {
        None => rest,
        Some(after) => {
            let start = after.find('/').ok_or_else(|| bad("has no path"))?;
            if !["", "localhost"].contains(&&after[..start]) {
                return Err(bad("is on another machine"));
            }
            &after[start..]
        }
    };
    let bytes = unescape(path).ok_or_else(|| bad("has an escape that is not % and two digits"))?;
    let path = String::from_utf8(bytes).map_err(|_| bad("is not UTF-8"))?;
    if path.contains('\0') || !path.starts_with('/') {
        return Err(bad("has no absolute path"));
    }
    // file:///C:/folder
    let drive = path.as_bytes().get(2) == Some(&b':') && cfg!(windows);
    Ok(PathBuf::from(if drive { &path[1..] } else { &path }))
}

fn unescape(text: &str) -> Option<Vec<u8>> {
    let mut bytes = text.bytes();
    let mut out = Vec::with_capacity(text.len());
    while let Some(b) = bytes.next() {
        if b != b'%' {
            out.push(b);
            continue;
        }
        let mut digit = || char::from(bytes.next()?).to_digit(16);
        out.push((digit()? * 16 + digit()?) as u8);
    }
    Some(out)
}

#[cfg(test)]
mod tests {
    use super::path;
    use std::path::Path;

    #[test]
    fn file_uris_are_paths_with_their_escapes_undone() {
        for (uri, expected) in [
            ("file:///tmp/a%20b/resources", "/tmp/a b/resources"),
            ("file:/tmp/x", "/tmp/x"),
            ("FILE://localhost/tmp/%C3%A4", "/tmp/ä"),
        ] {
            assert_eq!(path(uri).unwrap(), Path::new(expected));
        }
        for bad in [
            "",
            "/tmp",
            "http://x/y",
            "file://host/x",
            "file:///a%2",
            "file:///%FF",
            "file://",
            "file:x",
            "file:///a%00b",
            "ä",
        ] {
            let text = path(bad).unwrap_err().message;
            assert!(text.contains(bad), "{text}");
        }
    }
}
