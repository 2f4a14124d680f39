//! The fuzz targets build on stable Rust, and each runs for a moment without finding anything.
//!
//! Without the coverage that `make fuzz` adds, libFuzzer mutates the seeds blindly; what it finds
//! stops the program with a text and the bytes.

use super::capi_support::root;
use std::path::PathBuf;
use std::process::Command;

/// Each target with a seed of its kind.
const TARGETS: [(&str, &str); 3] = [
    ("calls", "src/capi/sim.rs"),
    ("text", "examples/two_panels.json"),
    ("scene", "examples/sphere_scene.json"),
];

/// `target` of the build that this test belongs to.
fn target() -> PathBuf {
    let test = std::env::current_exe().unwrap();
    test.ancestors().nth(3).unwrap().to_owned()
}

#[test]
fn every_fuzz_target_builds_and_runs() {
    let target = target();
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let output = Command::new(cargo)
        .args(["build", "--release", "--locked", "--manifest-path"])
        .arg(root().join("fuzz/Cargo.toml"))
        .arg("--target-dir")
        .arg(&target)
        .output()
        .unwrap();
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    assert!(output.status.success(), "{said}");
    let folder = std::env::temp_dir().join(format!("toile-fuzz-{}", std::process::id()));
    for (name, seed) in TARGETS {
        let corpus = folder.join(name);
        std::fs::create_dir_all(&corpus).unwrap();
        std::fs::copy(root().join(seed), corpus.join("seed")).unwrap();
        let output = Command::new(target.join("release").join(name))
            .args([
                "-max_total_time=5",
                "-timeout=60",
                "-max_len=4096",
                "-seed=1",
            ])
            .arg(format!("-artifact_prefix={}/", folder.display()))
            .arg(&corpus)
            .output()
            .unwrap();
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(output.status.success(), "{name}: {said}");
        let done = said.lines().rfind(|l| l.starts_with("Done ")).unwrap();
        println!("{name}: {done}");
        let runs: u64 = done.split_whitespace().nth(1).unwrap().parse().unwrap();
        assert!(runs > 50, "{name}: {done}");
    }
    let _ = std::fs::remove_dir_all(&folder);
}
