//! What the tests of the C interface share: where things lie, the header's text, the library file.
#![allow(
    dead_code,
    unreachable_pub,
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    clippy::expect_used,
    clippy::unwrap_used,
    reason = "every test file includes this one and uses a part of it; tests may panic, and call \
              functions that take the pointers of C"
)]

pub mod calls;
pub mod scene;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::OnceLock;

/// Top folder of the project.
pub fn root() -> &'static Path {
    Path::new(env!("CARGO_MANIFEST_DIR"))
}

/// Whether nothing may be skipped.
pub fn is_ci() -> bool {
    std::env::var_os("CI").is_some_and(|v| v == "true")
}

/// Says why something is not run; fails where nothing may be skipped.
pub fn skip(reason: &str) {
    assert!(!is_ci(), "CI=true allows no skipping, but: {reason}");
    eprintln!("skipped: {reason}");
}

/// Whether a program can be started.
pub fn has(program: &str) -> bool {
    Command::new(program)
        .arg("--version")
        .output()
        .is_ok_and(|o| o.status.success())
}

/// Source files of the C interface in the order of the header.
pub const SOURCES: [&str; 13] = [
    "status.rs",
    "log.rs",
    "types.rs",
    "garment.rs",
    "garment_readout.rs",
    "body.rs",
    "sim.rs",
    "motion.rs",
    "readout.rs",
    "yarns.rs",
    "suggest.rs",
    "region.rs",
    "array.rs",
];

/// The header as cbindgen makes it from the sources.
pub fn generated_header() -> String {
    let config = cbindgen::Config::from_file(root().join("cbindgen.toml")).expect("cbindgen.toml");
    let mut builder = cbindgen::Builder::new().with_config(config);
    for file in SOURCES {
        builder = builder.with_src(root().join("src/capi").join(file));
    }
    let mut text = Vec::new();
    builder.generate().expect("bindings").write(&mut text);
    let text = String::from_utf8(text).expect("UTF-8");
    // cbindgen takes its own notes out of comments, but leaves the empty line before them
    let mut lines: Vec<&str> = Vec::new();
    for line in text.lines() {
        if line.trim() == "*/" && lines.last().is_some_and(|l| l.trim() == "*") {
            lines.pop();
        }
        lines.push(line);
    }
    lines.join("\n") + "\n"
}

/// The committed header.
pub fn header() -> String {
    std::fs::read_to_string(root().join("include/toile.h")).expect("include/toile.h")
}

/// Names of the functions that the header declares, sorted.
pub fn header_functions() -> Vec<String> {
    let text = without_comments(&header());
    let mut names: Vec<String> = text
        .match_indices("toile_")
        .filter(|&(i, _)| {
            // a declaration begins its line with a type and is no pointer in parentheses
            let before = &text[..i];
            !before.ends_with(|c: char| c.is_alphanumeric() || c == '_')
        })
        .filter_map(|(i, _)| {
            let rest = &text[i..];
            let end = rest.find(|c: char| !(c.is_alphanumeric() || c == '_'))?;
            rest[end..].starts_with('(').then(|| rest[..end].to_owned())
        })
        .collect();
    names.sort();
    names.dedup();
    names
}

/// C text without its comments.
pub fn without_comments(text: &str) -> String {
    let mut out = String::new();
    let mut rest = text;
    while let Some(start) = rest.find("/*") {
        out.push_str(&rest[..start]);
        let end = rest[start..].find("*/").expect("comment ends");
        rest = &rest[start + end + 2..];
    }
    out + rest
}

/// Folder of cargo's output that this test lies in: `target`.
fn target_dir() -> PathBuf {
    let test = std::env::current_exe().expect("own path");
    // target/PROFILE/deps/NAME
    test.ancestors().nth(3).expect("target folder").to_owned()
}

/// Folder with the shared library, built now so that it is never stale. Cargo holds no lock while
/// tests run.
pub fn library_dir() -> &'static Path {
    static DIR: OnceLock<PathBuf> = OnceLock::new();
    DIR.get_or_init(|| {
        let target = target_dir();
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let output = Command::new(cargo)
            .args(["build", "--release", "--lib", "--locked"])
            // with a test among the targets cargo resolves features as for the tests, and
            // nothing is built twice
            .args(["--test", "linear_allocations", "--target-dir"])
            .arg(&target)
            .current_dir(root())
            .output()
            .expect("cargo");
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        target.join("release")
    })
}

/// Compares a text with a committed file; `TOILE_BLESS=1` rewrites the file.
pub fn compare(path: &str, new: &str) {
    let file = root().join(path);
    if std::env::var_os("TOILE_BLESS").is_some_and(|v| v == "1") {
        std::fs::create_dir_all(file.parent().expect("folder")).expect("folder");
        std::fs::write(&file, new).expect("write");
        return;
    }
    let old = std::fs::read_to_string(&file).unwrap_or_default();
    if old == new {
        return;
    }
    let differing = old
        .lines()
        .zip(new.lines())
        .enumerate()
        .find(|(_, (a, b))| a != b);
    panic!(
        "{path} is not what the sources give ({} lines there, {} now; first difference: {differing:?}). \
         If the change is meant, run the test with TOILE_BLESS=1 and review the diff.",
        old.lines().count(),
        new.lines().count()
    );
}
