//! Runs the tests of the Python package against the library that was just built.
//!
//! `TOILE_PYTHON` names an interpreter with NumPy and pytest; without it the test is skipped with a
//! reason, but not in CI.

use std::path::{Path, PathBuf};
use std::process::Command;

/// Folder of the built libraries: two above the test's own executable.
fn library() -> PathBuf {
    let exe = std::env::current_exe().unwrap();
    let release = exe.parent().and_then(Path::parent).unwrap();
    let name = if cfg!(target_os = "macos") {
        "libtoile.dylib"
    } else if cfg!(windows) {
        "toile.dll"
    } else {
        "libtoile.so"
    };
    release.join(name)
}

#[test]
fn python_package_passes_its_tests() {
    let Some(python) = std::env::var_os("TOILE_PYTHON") else {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "TOILE_PYTHON is unset"
        );
        eprintln!("skipped: TOILE_PYTHON is unset");
        return;
    };
    let library = library();
    assert!(library.is_file(), "{} is not built", library.display());
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    let output = Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .current_dir(&package)
        .env("PYTHONPATH", &package)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("TOILE_LIBRARY", &library)
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}", Path::new(&python).display()));
    let text = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    println!("{text}");
    assert!(output.status.success(), "{text}");
}
