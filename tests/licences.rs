//! `docs/licences.txt`, which every FMU carries, names each crate that is linked with its licence.

use crate::capi_support as support;
use serde_json::Value;
use std::collections::{BTreeMap, BTreeSet};
use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

/// Packages that the library and the program link, on the platform that the tests run on.
fn linked() -> BTreeMap<String, Value> {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["metadata", "--format-version", "1", "--locked", "--offline"])
        .args(["--filter-platform", "x86_64-unknown-linux-gnu"])
        .current_dir(support::root())
        .output()
        .unwrap();
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let value: Value = serde_json::from_slice(&output.stdout).unwrap();
    let packages: BTreeMap<&str, &Value> = value["packages"]
        .as_array()
        .unwrap()
        .iter()
        .map(|p| (p["id"].as_str().unwrap(), p))
        .collect();
    let nodes: BTreeMap<&str, &Value> = value["resolve"]["nodes"]
        .as_array()
        .unwrap()
        .iter()
        .map(|n| (n["id"].as_str().unwrap(), n))
        .collect();
    let mut open = vec![value["resolve"]["root"].as_str().unwrap()];
    let mut seen = BTreeSet::new();
    while let Some(id) = open.pop() {
        if !seen.insert(id) {
            continue;
        }
        // what runs while building is not linked, nor is what its macros are made of
        let is_macro = packages[id]["targets"].as_array().unwrap().iter().any(|t| {
            t["kind"]
                .as_array()
                .unwrap()
                .contains(&Value::from("proc-macro"))
        });
        if is_macro {
            seen.remove(id);
            continue;
        }
        for dep in nodes[id]["deps"].as_array().unwrap() {
            let kinds = dep["dep_kinds"].as_array().unwrap();
            if kinds.iter().any(|k| k["kind"].is_null()) {
                open.push(dep["pkg"].as_str().unwrap());
            }
        }
    }
    seen.into_iter()
        .map(|id| packages[id])
        .filter(|p| p["name"] != "toile")
        .map(|p| {
            let name = format!(
                "{} {}",
                p["name"].as_str().unwrap(),
                p["version"].as_str().unwrap()
            );
            (name, p.clone())
        })
        .collect()
}

/// Licence files of a package: the MIT one if there is a choice, else all of them.
fn texts(package: &Value) -> Vec<String> {
    let folder = Path::new(package["manifest_path"].as_str().unwrap())
        .parent()
        .unwrap();
    let mut files: Vec<_> = std::fs::read_dir(folder)
        .unwrap()
        .flatten()
        .filter(|e| {
            let name = e.file_name().to_string_lossy().to_uppercase();
            [
                "LICENSE",
                "LICENCE",
                "COPYING",
                "UNLICENSE",
                "NOTICE",
                "COPYRIGHT",
            ]
            .iter()
            .any(|p| name.starts_with(p))
                && e.path().is_file()
        })
        .map(|e| e.path())
        .collect();
    files.sort();
    let upper = |p: &Path| p.file_name().unwrap().to_string_lossy().to_uppercase();
    if let Some(mit) = files.iter().find(|p| upper(p).contains("MIT")).cloned() {
        files.retain(|p| *p == mit || upper(p).starts_with("NOTICE"));
    }
    let read = |p: &std::path::PathBuf| {
        let text = String::from_utf8_lossy(&std::fs::read(p).unwrap()).into_owned();
        let lines: Vec<&str> = text.lines().map(str::trim_end).collect();
        lines.join("\n").trim().to_owned()
    };
    files.iter().map(read).collect()
}

fn document() -> String {
    let root = support::root();
    let own = |file: &str| std::fs::read_to_string(root.join(file)).unwrap();
    let mut out = format!(
        "toile: MIT OR Apache-2.0\n\n{}\n\n{}\n\nLinked with it: the Rust standard library (MIT OR \
         Apache-2.0) and these crates.\n\n",
        own("LICENSE-MIT").trim(),
        own("LICENSE-APACHE").trim()
    );
    let linked = linked();
    let mut by_text: BTreeMap<String, Vec<&str>> = BTreeMap::new();
    for (name, package) in &linked {
        let licence = package["license"].as_str().unwrap_or("see below");
        let _ = writeln!(out, "{name}: {licence}");
        for text in texts(package) {
            by_text.entry(text).or_default().push(name);
        }
    }
    // the longest lists first, then by text: a fixed order
    let mut groups: Vec<_> = by_text.into_iter().collect();
    groups.sort_by(|a, b| {
        b.1.len()
            .cmp(&a.1.len())
            .then(a.1.cmp(&b.1))
            .then(a.0.cmp(&b.0))
    });
    for (text, names) in groups {
        let _ = write!(
            out,
            "\n{}\n{}:\n\n{text}\n",
            "-".repeat(78),
            names.join(", ")
        );
    }
    out
}

#[test]
fn licences_of_all_linked_crates_are_the_committed_ones() {
    support::compare("docs/licences.txt", &document());
}

#[test]
fn every_linked_crate_has_a_licence() {
    let linked = linked();
    assert!(linked.len() > 30, "{}", linked.len());
    for (name, package) in linked {
        assert!(
            package["license"].is_string() || !texts(&package).is_empty(),
            "{name}"
        );
    }
}
