//! Runs the tests of the Python package against the library that was just built, and installs it.
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

/// The interpreter, or a reason why not.
fn python() -> Option<std::ffi::OsString> {
    let python = std::env::var_os("TOILE_PYTHON");
    if python.is_none() {
        crate::capi_support::skip("TOILE_PYTHON is unset");
    }
    python
}

/// Runs a command and hands back what it printed; its failure is the test's.
fn run(command: &mut Command) -> String {
    let output = command
        .output()
        .unwrap_or_else(|e| panic!("{}: {e}", command.get_program().display()));
    let text = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    println!("{text}");
    assert!(output.status.success(), "{text}");
    text
}

#[test]
fn python_package_passes_its_tests() {
    let Some(python) = python() else { return };
    let library = library();
    assert!(library.is_file(), "{} is not built", library.display());
    let package = Path::new(env!("CARGO_MANIFEST_DIR")).join("python");
    run(Command::new(&python)
        .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
        .current_dir(&package)
        .env("PYTHONPATH", &package)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("TOILE_LIBRARY", &library));
}

/// What a user does with the installed package: no source tree, no variable, the packaged library.
const USE: &str = r#"
import os, toile
from toile import _ffi
assert "TOILE_LIBRARY" not in os.environ
assert _ffi.library_path().parent == __import__("pathlib").Path(toile.__file__).parent
garment = toile.Garment("square", 0.05)
garment.add_panel("square", [[0, 0], [0.3, 0], [0.3, 0.3], [0, 0.3]])
with toile.Sim(garment) as sim:
    sim.pin([sim.locate(0, (0, 0.3)), sim.locate(0, (0.3, 0.3))])
    report = sim.step(0.01)
    assert 0 < -sim.velocities[:, 1].min() < 0.2, sim.velocities
    print("stepped", report.outcome.name, toile.__file__)
"#;

/// Environments that `scripts/pythons.sh` has made, one for each version of Python that is here.
fn environments() -> Vec<PathBuf> {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("target/pythons");
    let found = std::fs::read_dir(root).into_iter().flatten().flatten();
    let mut found: Vec<PathBuf> = found.map(|e| e.path().join("bin/python")).collect();
    found.retain(|p| p.is_file());
    found.sort();
    found
}

/// One wheel for all versions: what `make wheel` builds passes the package's tests on each.
#[test]
fn a_wheel_passes_the_tests_on_every_python_that_is_here() {
    let Some(python) = python() else { return };
    let environments = environments();
    if environments.is_empty() {
        crate::capi_support::skip("target/pythons is not there: run scripts/pythons.sh");
        return;
    }
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let folder = std::env::temp_dir().join(format!("toile-wheel-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    run(Command::new(&python)
        .args(["-m", "pip", "wheel", "--disable-pip-version-check"])
        .args(["--no-deps", "--wheel-dir"])
        .arg(&folder)
        .arg("./python")
        .current_dir(root)
        .env("PIP_NO_INDEX", "1")
        .env("PIP_FIND_LINKS", root.join("target/wheels"))
        .env("TOILE_LIBRARY", library()));
    let wheels: Vec<PathBuf> = std::fs::read_dir(&folder)
        .unwrap()
        .map(|e| e.unwrap().path())
        .collect();
    let [wheel] = &wheels[..] else {
        panic!("one wheel is expected: {wheels:?}")
    };
    assert!(wheel.to_string_lossy().contains("-py3-none-"), "{wheel:?}");
    for environment in environments {
        run(Command::new(&environment)
            .args(["-m", "pip", "install", "--disable-pip-version-check"])
            .args(["--no-index", "--no-deps", "--force-reinstall", "--quiet"])
            .arg(wheel));
        let told = run(Command::new(&environment)
            .args(["-m", "pytest", "-q", "-p", "no:cacheprovider"])
            // a figure about one machine, not about a version
            .args(["-k", "not ten_thousand_vertices", "."])
            .current_dir(root.join("python/tests"))
            .env("PYTHONDONTWRITEBYTECODE", "1")
            .env_remove("PYTHONPATH")
            .env_remove("TOILE_LIBRARY"));
        assert!(
            told.contains(" passed") && told.contains("deselected"),
            "{told}"
        );
        // what needs packages that are not there is compiled at least
        run(Command::new(&environment)
            .args(["-m", "compileall", "-q", "python/examples", "tests/fmi"])
            .current_dir(root)
            .env("PYTHONPYCACHEPREFIX", folder.join("cache")));
        let said = run(Command::new(&environment)
            .arg("-c")
            .arg(format!("{USE}\nimport toile.fmu\n"))
            .current_dir(&folder)
            .env_remove("PYTHONPATH")
            .env_remove("TOILE_LIBRARY"));
        assert!(said.contains("stepped") && said.contains("site-packages"));
    }
    std::fs::remove_dir_all(&folder).unwrap();
}

#[test]
fn pip_installs_the_package_with_its_library_into_a_clean_environment() {
    let Some(python) = python() else { return };
    let root = Path::new(env!("CARGO_MANIFEST_DIR"));
    let wheels = root.join("target/wheels");
    if !wheels.is_dir() {
        crate::capi_support::skip("target/wheels is not there: run scripts/tools.sh");
        return;
    }
    let folder = std::env::temp_dir().join(format!("toile-pip-{}", std::process::id()));
    let _ = std::fs::remove_dir_all(&folder);
    let venv = folder.join("venv");
    run(Command::new(&python).args(["-m", "venv"]).arg(&venv));
    let bin = venv.join(if cfg!(windows) { "Scripts" } else { "bin" });
    run(Command::new(bin.join("python"))
        .args([
            "-m",
            "pip",
            "install",
            "--disable-pip-version-check",
            "./python",
        ])
        .current_dir(root)
        // from the folder of wheels alone
        .env("PIP_NO_INDEX", "1")
        .env("PIP_FIND_LINKS", &wheels)
        .env("PIP_CONSTRAINT", "")
        .env("TOILE_LIBRARY", library()));
    let said = run(Command::new(bin.join("python"))
        .args(["-c", USE])
        .current_dir(&folder)
        .env_remove("TOILE_LIBRARY")
        .env_remove("PYTHONPATH"));
    assert!(said.contains("stepped") && said.contains("site-packages"));
    // a library that is not there is named, not left out
    let output = Command::new(bin.join("python"))
        .args([
            "-m",
            "pip",
            "install",
            "--disable-pip-version-check",
            "--force-reinstall",
        ])
        .args(["--no-deps", "./python"])
        .current_dir(root)
        .env("PIP_NO_INDEX", "1")
        .env("PIP_FIND_LINKS", &wheels)
        .env("TOILE_LIBRARY", "/nowhere/libtoile.so")
        .output()
        .unwrap();
    assert!(!output.status.success());
    let text = String::from_utf8_lossy(&output.stderr).into_owned();
    let text = text + &String::from_utf8_lossy(&output.stdout);
    assert!(
        text.contains("/nowhere/libtoile.so is not a file"),
        "{text}"
    );
    let _ = std::fs::remove_dir_all(&folder);
}
