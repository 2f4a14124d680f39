//! Modules import only from those left of them; nothing that is no part of the product is named.
#![allow(clippy::expect_used, reason = "a test may panic")]

use std::path::{Path, PathBuf};

/// The order of imports; modules that do not exist yet are named too.
const ORDER: [&str; 20] = [
    "error",
    "math",
    "pattern",
    "body",
    "tri",
    "cloth",
    "yarn",
    "blend",
    "system",
    "solve",
    "gpu",
    "fabric",
    "readout",
    "indicate",
    "design",
    "scene",
    "sim",
    "sim_scene",
    "report",
    "capi",
];
/// Side by side at the right end: none imports another, but for the program, which packs FMUs.
const ENDS: [&str; 3] = ["capi", "fmi", "bin"];

fn sources(folder: &Path, out: &mut Vec<PathBuf>) {
    for entry in std::fs::read_dir(folder).expect("folder") {
        let path = entry.expect("entry").path();
        if path.is_dir() {
            sources(&path, out);
        } else if path.extension().is_some_and(|e| e == "rs") {
            out.push(path);
        }
    }
}

fn all_sources() -> Vec<(String, String)> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut files = Vec::new();
    sources(&root, &mut files);
    files.sort();
    files
        .into_iter()
        .map(|f| {
            let name = f.strip_prefix(&root).expect("in src");
            let text = std::fs::read_to_string(&f).expect("source");
            (name.to_string_lossy().into_owned(), text)
        })
        .collect()
}

/// Place in the order; the ends share the last place.
fn rank(module: &str) -> Option<usize> {
    if ENDS.contains(&module) {
        return Some(ORDER.len());
    }
    ORDER.iter().position(|m| *m == module)
}

/// The modules of the crate that a source names: `crate::x` and `crate::{x, y::z}`, in code. Tests
/// inside a file (after `mod tests`) may look wherever they like.
fn imports(text: &str) -> Vec<String> {
    let code: String = text
        .split("#[cfg(test)]")
        .next()
        .expect("first part")
        .lines()
        .filter(|l| !l.trim_start().starts_with("//"))
        .flat_map(|l| [l, "\n"])
        .collect();
    let mut found = Vec::new();
    for prefix in ["crate::", "toile::"] {
        for (i, _) in code.match_indices(prefix) {
            if code[..i].ends_with(|c: char| c.is_alphanumeric() || c == '_' || c == '$') {
                continue;
            }
            let rest = &code[i + prefix.len()..];
            match rest.strip_prefix('{') {
                Some(group) => found.extend(first_words(group)),
                None => found.push(word(rest)),
            }
        }
    }
    found.retain(|m| !m.is_empty() && m.starts_with(char::is_lowercase));
    found
}

fn word(text: &str) -> String {
    text.chars()
        .take_while(|c| c.is_alphanumeric() || *c == '_')
        .collect()
}

/// First word of each entry of a braced list, nested braces aside.
fn first_words(group: &str) -> Vec<String> {
    let (mut depth, mut found, mut fresh) = (1, Vec::new(), true);
    for (i, c) in group.char_indices() {
        match c {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 1 => fresh = true,
            c if fresh && depth == 1 && !c.is_whitespace() => {
                found.push(word(&group[i..]));
                fresh = false;
            }
            _ => {}
        }
        if depth == 0 {
            break;
        }
    }
    found
}

#[test]
fn braces_and_paths_are_read() {
    let text = "use crate::error::Result;\nuse crate::{math::Vec3, body::{Body, Pose}, sim};\n\
                // crate::nothing\nfn f() { crate::tri::go() }\n#[cfg(test)]\nuse crate::capi;";
    assert_eq!(imports(text), ["error", "math", "body", "sim", "tri"]);
}

#[test]
fn modules_import_only_from_the_left() {
    let mut wrong = Vec::new();
    let mut seen = 0;
    for (file, text) in all_sources() {
        let module = word(&file);
        if module == "lib" {
            continue;
        }
        let Some(own) = rank(&module) else {
            wrong.push(format!(
                "src/{file}: '{module}' has no place in the order of imports"
            ));
            continue;
        };
        for import in imports(&text) {
            // a macro of the crate, or an item of a program's own root
            if import == module || (module == "bin" && rank(&import).is_none()) {
                continue;
            }
            seen += 1;
            match rank(&import) {
                Some(other) if other < own => {}
                Some(_) if module == "bin" && import == "fmi" => {}
                _ => wrong.push(format!("src/{file} imports crate::{import}")),
            }
        }
    }
    assert!(seen > 20, "only {seen} imports were found");
    assert!(wrong.is_empty(), "{}", wrong.join("\n"));
}

#[test]
fn unsafe_code_stays_at_the_boundary() {
    let allowed = ["capi", "fmi", "gpu"];
    for (file, text) in all_sources() {
        let uses = text.lines().any(|l| {
            let code = l.split("//").next().unwrap_or_default();
            code.contains("unsafe {") || code.contains("unsafe fn") || code.contains("unsafe impl")
        });
        assert!(
            !uses || allowed.contains(&word(&file).as_str()),
            "src/{file} has unsafe code"
        );
    }
}

#[test]
fn every_source_begins_with_its_subject() {
    for (file, text) in all_sources() {
        assert!(text.starts_with("//! "), "src/{file} has no header");
    }
}
