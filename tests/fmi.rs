//! FMUs as masters see them: archives packed by the program, loaded through C, FMPy and libcosim.
//!
//! The tests are Python, in `tests/fmi`. `TOILE_PYTHON` names an interpreter with NumPy, pytest and
//! FMPy; without it they are skipped with a reason, but not in CI.

use crate::capi_support as support;
use std::process::Command;

fn python(arguments: &[&str]) {
    let Some(python) = std::env::var_os("TOILE_PYTHON") else {
        return support::skip("TOILE_PYTHON is unset");
    };
    let found = Command::new(&python)
        .args(["-c", "import fmpy, lxml, pytest"])
        .output();
    if !found.is_ok_and(|o| o.status.success()) {
        return support::skip("fmpy is not installed: run scripts/tools.sh");
    }
    let root = support::root();
    // built now, so that it is never stale; the program was built with this test
    let library = support::library_dir().join("libtoile.so");
    let path = std::env::join_paths([root.join("python"), root.join("tests/fmi")]).unwrap();
    let output = Command::new(&python)
        .args([
            "-m",
            "pytest",
            "-q",
            "-p",
            "no:cacheprovider",
            "--durations=5",
        ])
        .args(arguments)
        .current_dir(root.join("tests/fmi"))
        .env("PYTHONPATH", path)
        .env("PYTHONDONTWRITEBYTECODE", "1")
        .env("TOILE_PROGRAM", env!("CARGO_BIN_EXE_toile"))
        .env("TOILE_LIBRARY", library)
        .env("LC_ALL", "C.UTF-8")
        .output()
        .unwrap();
    let text = format!(
        "{}{}",
        String::from_utf8_lossy(&output.stdout),
        String::from_utf8_lossy(&output.stderr)
    );
    println!("{text}");
    assert!(output.status.success(), "{text}");
    // nothing found to run is no success
    assert!(text.contains(" passed"), "{text}");
    assert!(
        !(support::is_ci() && text.contains(" skipped")),
        "CI=true allows no skipping: {text}"
    );
}

#[test]
fn archives_hold_what_fmi_asks_for() {
    python(&["test_archive.py"]);
}

#[test]
fn calls_in_and_out_of_order_are_answered() {
    python(&["test_calls.py"]);
}

#[test]
fn results_are_the_same_bits_for_every_master() {
    python(&["test_same_bits.py"]);
}

#[test]
fn states_come_back_and_damaged_ones_do_no_harm() {
    python(&["test_states.py"]);
}

#[test]
fn nothing_stays_in_the_process() {
    python(&["test_process.py"]);
}

#[test]
fn ball_and_cloth_exchange_pose_and_force() {
    python(&["test_coupling.py"]);
}
