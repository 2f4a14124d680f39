//! Every path that a page of the project names exists.
#![allow(clippy::expect_used, reason = "a test may panic")]

use std::path::Path;

const PAGES: [&str; 10] = [
    "README.md",
    "ARCHITECTURE.md",
    "CONTRIBUTING.md",
    "CHANGELOG.md",
    "docs/benchmarks.md",
    "docs/fabric.md",
    "docs/fmi.md",
    "docs/gallery.md",
    "docs/mixed.md",
    "docs/yarns.md",
];
/// What the build or a run makes.
const MADE: [&str; 3] = ["target", "out", "build"];
/// First parts of paths that belong to the project.
const TOPS: [&str; 14] = [
    "src",
    "tests",
    "include",
    "examples",
    "examples_c",
    "python",
    "benches",
    "fuzz",
    "scripts",
    "docs",
    ".ci",
    "target",
    "out",
    "assets",
];

/// Text outside of fenced blocks, and the fenced blocks.
fn parts(text: &str) -> (String, String) {
    let (mut prose, mut fenced, mut inside) = (String::new(), String::new(), false);
    for line in text.lines() {
        if line.trim_start().starts_with("```") {
            inside = !inside;
        } else {
            let part = if inside { &mut fenced } else { &mut prose };
            part.push_str(line);
            part.push('\n');
        }
    }
    (prose, fenced)
}

/// Whether a word is a path of the project: it begins with one of its folders.
fn is_path(word: &str) -> bool {
    let top = word.split('/').next().unwrap_or_default();
    word.contains('/') && TOPS.contains(&top)
}

/// A word as written in prose or code, without what surrounds it.
fn bare(word: &str) -> &str {
    let word = word.trim_start_matches("./");
    word.trim_matches(|c: char| !(c.is_alphanumeric() || "/_.-*{}".contains(c)))
        .trim_end_matches(['.', ',', ':'])
}

/// Paths in a text: words that look like one, `a/{b,c}.rs` spread out.
fn paths(text: &str) -> Vec<String> {
    let mut found = Vec::new();
    for word in text.split(|c: char| c.is_whitespace() || "`()[]\"'=|".contains(c)) {
        let word = bare(word);
        if !is_path(word) {
            continue;
        }
        match (word.find('{'), word.find('}')) {
            (Some(a), Some(b)) if a < b => {
                for part in word[a + 1..b].split(',') {
                    found.push(format!("{}{part}{}", &word[..a], &word[b + 1..]));
                }
            }
            _ => found.push(word.to_owned()),
        }
    }
    found
}

fn is_made(path: &str) -> bool {
    MADE.contains(&path.split('/').next().unwrap_or_default())
}

/// Whether a path, which may contain `*`, exists.
fn exists(root: &Path, path: &str) -> bool {
    match path.split_once('*') {
        None => root.join(path).exists(),
        Some((before, after)) => {
            let (folder, start) = before.rsplit_once('/').unwrap_or(("", before));
            std::fs::read_dir(root.join(folder)).is_ok_and(|entries| {
                entries.flatten().any(|e| {
                    let name = e.file_name().to_string_lossy().into_owned();
                    name.starts_with(start) && name.ends_with(after.trim_start_matches('*'))
                })
            })
        }
    }
}

#[test]
fn paths_are_found_in_prose_and_code() {
    let text = "See `src/sim.rs`, (tests/abi.rs). a/b is none; src/{lib,error}.rs, target/x.";
    assert_eq!(
        paths(text),
        [
            "src/sim.rs",
            "tests/abi.rs",
            "src/lib.rs",
            "src/error.rs",
            "target/x"
        ]
    );
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    assert!(exists(root, "src/*.rs") && !exists(root, "src/*.c") && !exists(root, "src/none.rs"));
}

#[test]
fn every_path_named_in_the_pages_exists() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let mut missing = Vec::new();
    let mut count = 0;
    for page in PAGES {
        let text = std::fs::read_to_string(root.join(page))
            .unwrap_or_else(|_| panic!("{page} is missing"));
        let (prose, fenced) = parts(&text);
        for path in paths(&prose).into_iter().chain(paths(&fenced)) {
            count += 1;
            if !is_made(&path) && !exists(root, &path) {
                missing.push(format!("{page}: {path}"));
            }
        }
        // links to files beside the page
        for link in prose.split("](").skip(1) {
            let target = link.split([')', '#']).next().unwrap_or_default();
            let beside = root.join(page).with_file_name(target).exists();
            if !target.is_empty() && !target.contains("://") && !beside {
                missing.push(format!("{page}: link to {target}"));
            }
        }
    }
    assert!(missing.is_empty(), "{}", missing.join("\n"));
    assert!(count > 10, "only {count} paths were found");
}

/// Each picture of the gallery stands below a command that makes it from a scene, which is accepted; all pictures are small.
#[test]
fn the_gallery_is_made_of_scenes_that_run() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let page = std::fs::read_to_string(root.join("docs/gallery.md")).expect("gallery");
    let mut scenes = 0;
    for part in page.split("\n## ").skip(1) {
        let command = part
            .lines()
            .find(|l| l.starts_with("target/release/toile run"));
        let Some(command) = command else {
            // a plot of a benchmark
            assert!(part.contains("cargo bench"), "{part}");
            continue;
        };
        let path = command.split_whitespace().nth(2).expect("scene");
        let name = path
            .trim_start_matches("examples/")
            .trim_end_matches(".json");
        assert!(part.contains(&format!("](images/{name}.png)")), "{part}");
        let text = std::fs::read_to_string(root.join(path)).expect("scene");
        let scene = toile::scene::Scene::from_json(&text, Some(&root.join("examples")));
        let sim = toile::sim_scene::build(&scene.expect("scene")).expect("sim");
        assert!(sim.yarns().is_some(), "{path}");
        scenes += 1;
    }
    assert!(scenes >= 16, "{scenes}");
    for entry in std::fs::read_dir(root.join("docs/images")).expect("images") {
        let entry = entry.expect("image");
        let bytes = entry.metadata().expect("size").len();
        assert!(bytes < 200_000, "{:?}: {bytes} bytes", entry.path());
    }
}
