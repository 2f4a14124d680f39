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
    python(&["test_calls.py", "test_random_calls.py"]);
}

#[test]
fn results_are_the_same_bits_for_every_master() {
    python(&["test_same_bits.py"]);
}

#[test]
fn deforming_bodies_are_driven_by_arrays() {
    python(&["test_deforming.py"]);
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

#[test]
fn python_helpers_sweep_over_parameters() {
    python(&["test_package.py"]);
}

/// A panic in a call ends that call and the run, not the process; a reset builds the simulation anew.
#[test]
fn a_panic_inside_is_an_error_and_a_reset_leads_back() {
    use std::sync::{Arc, Mutex};
    use toile::fmi::instance::Instance;
    use toile::fmi::log::{Log, Sink, Status};
    use toile::fmi::model::{About, Model};
    use toile::fmi::table::fingerprint;

    let folder = std::env::temp_dir().join(format!("toile-fmi-panic-{}", std::process::id()));
    std::fs::create_dir_all(&folder).unwrap();
    let scene = support::root().join("examples/sphere_scene.json");
    std::fs::copy(&scene, folder.join("scene.json")).unwrap();
    let read = toile::scene::Scene::from_file(&scene).unwrap();
    let (model, _) = Model::new(read).unwrap();
    let about = About {
        token: "token".into(),
        variables: fingerprint(&model.variables),
    };
    std::fs::write(folder.join("fmu.json"), about.to_json()).unwrap();
    let heard = Arc::new(Mutex::new(Vec::new()));
    let own = Arc::clone(&heard);
    let sink: Sink = Box::new(move |_, _, text| own.lock().unwrap().push(text.to_owned()));
    let log = Log::new(Some(sink), false);
    let mut cloth = Instance::new("cloth", "token", &folder, log).unwrap();
    let step = |cloth: &mut Instance| {
        assert_eq!(
            cloth.call("enter", Instance::enter_initialization),
            Status::Ok
        );
        assert_eq!(
            cloth.call("exit", Instance::exit_initialization),
            Status::Ok
        );
        assert_eq!(cloth.call("step", |i| i.do_step(0.0, 0.002)), Status::Ok);
        cloth.save().unwrap()
    };
    let first = step(&mut cloth);
    let status = cloth.call("boom", |_| panic!("number {}", 7));
    assert_eq!(status, Status::Error);
    assert!(heard.lock().unwrap()[0].contains("number 7"));
    assert!(cloth.is_terminated() && cloth.save().is_err());
    assert_eq!(cloth.call("step", |i| i.do_step(0.0, 0.01)), Status::Error);
    assert!(heard.lock().unwrap()[1].contains("internal error"));
    assert_eq!(cloth.call_anyway("reset", Instance::reset), Status::Ok);
    assert!(step(&mut cloth) == first);
    let _ = cloth.call("boom", |_| panic!("again"));
    assert_eq!(cloth.call_anyway("load", |i| i.load(&first)), Status::Ok);
    assert!(cloth.save().unwrap() == first);
    std::fs::remove_dir_all(&folder).unwrap();
}
