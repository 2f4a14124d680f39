//! The command line: results, exit codes, texts, closed pipes.

use serde_json::{Value, json};
use std::io::Read;
use std::path::{Path, PathBuf};
use std::process::{Command, Output, Stdio};

struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("toile-cli-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) -> PathBuf {
        let path = self.0.join(name);
        std::fs::write(&path, text).unwrap();
        path
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

fn toile(args: &[&str]) -> Output {
    Command::new(env!("CARGO_BIN_EXE_toile"))
        .args(args)
        .output()
        .unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

fn code(output: &Output) -> i32 {
    output.status.code().expect("ended by a signal")
}

/// A small square hung by one edge above a sphere.
fn scene() -> Value {
    json!({
        "toile": 1,
        "name": "hanging",
        "garment": {
            "toile_garment": 1,
            "name": "square",
            "edge_length": 0.04,
            "panels": [{
                "name": "square",
                "vertices": [[0, 0], [0.3, 0], [0.3, 0.3], [0, 0.3]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
                "placement": {"translation": [-0.15, 0.5, 0]}
            }]
        },
        "bodies": [{"name": "ball", "shape": "sphere", "radius": 0.1,
                    "pose": {"position": [0, 0.3, 0.3]}}],
        "pins": [{"panel": "square", "edge": 2}],
        "run": {"duration": 0.1, "dt": 0.02, "frame_every": 1}
    })
}

fn path(p: &Path) -> &str {
    p.to_str().unwrap()
}

#[test]
fn run_writes_a_complete_summary_models_pattern_and_picture() {
    let folder = Folder::new("run");
    let scene = folder.write("scene.json", &scene().to_string());
    let out = folder.0.join("a/b");
    let more = ["--verify", "--picture-size", "320x200"];
    let output = toile(&[&["run", path(&scene), "--out", path(&out)], &more[..]].concat());
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("hanging"));
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    for key in [
        "vertices",
        "triangles",
        "yarn_nodes",
        "full_nodes",
        "hybrid_nodes",
        "carried_nodes",
        "active_triangles",
        "unknowns",
        "peak_memory_bytes",
        "steps",
        "newton_iterations",
        "linear_iterations",
        "wall_seconds",
        "simulated_seconds",
        "max_edge_strain",
        "min_gap",
        "kinetic_energy",
        "potential_energy",
        "residual",
        "threads",
        "max_seam_gap",
        "further_second_motion",
        "body_crossings",
        "self_crossings",
    ] {
        assert!(summary[key].is_number(), "{key}: {}", summary[key]);
    }
    for key in ["outcome", "backend", "version", "name"] {
        assert!(summary[key].is_string(), "{key}");
    }
    assert_eq!(summary["steps"], 5);
    assert!((summary["simulated_seconds"].as_f64().unwrap() - 0.1).abs() < 1e-12);
    assert!(summary["vertices"].as_u64().unwrap() > 50);
    assert_eq!(summary["body_crossings"], 0);
    assert_eq!(summary["self_crossings"], 0);
    // it hangs at rest: five steps later and a second later it hangs there still
    assert!(summary["further_second_motion"].as_f64().unwrap() < 1e-3);
    let read = |name: &str| std::fs::read(out.join(name)).unwrap();
    let obj = text(&read("garment.obj"));
    let lines = |p: &str| obj.lines().filter(|l| l.starts_with(p)).count() as u64;
    assert_eq!(lines("v "), summary["vertices"].as_u64().unwrap());
    assert_eq!(lines("f "), summary["triangles"].as_u64().unwrap());
    assert_eq!(&read("scene.glb")[..4], b"glTF");
    let picture = read("picture.png");
    assert_eq!(&picture[1..4], b"PNG");
    assert_eq!(picture[16..24], [0, 0, 1, 64, 0, 0, 0, 200], "320 by 200");
    assert_eq!(&read("garment.pc2")[..11], b"POINTCACHE2");
    assert!(text(&read("pattern.svg")).contains("<svg"));

    // the results start another run: from the saved state and from the model's positions
    for initial in [
        json!({"snapshot": "a/b/state.bin"}),
        json!({"file": "a/b/garment.obj"}),
    ] {
        let mut again = self::scene();
        again["initial"] = initial.clone();
        again["run"] = json!({"drape": false, "duration": 0.02, "dt": 0.02});
        let again = folder.write("again.json", &again.to_string());
        let out = folder.0.join("again");
        let output = toile(&["run", path(&again), "--out", path(&out), "--quiet"]);
        assert_eq!(code(&output), 0, "{initial}: {}", text(&output.stderr));
        assert!(output.stdout.is_empty());
    }
}

/// Cloth pulled to four times its length is simulated, and the report says what that is worth.
#[test]
fn what_is_torn_in_truth_is_noted() {
    let folder = Folder::new("torn");
    let mut torn = scene();
    torn["bodies"] = json!([]);
    let notes = |scene: &Value, name: &str| {
        let file = folder.write(&format!("{name}.json"), &scene.to_string());
        let output = toile(&["run", path(&file), "--out", path(&folder.0.join(name))]);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        text(&output.stdout)
    };
    assert!(!notes(&torn, "whole").contains("as long as at rest"));
    torn["pins"] = json!([{"panel": "square", "edge": 2}, {"panel": "square", "edge": 0, "motion": [
        {"time": 0.0, "offset": [0, 0, 0]}, {"time": 0.1, "offset": [0, -0.9, 0]}]}]);
    assert!(notes(&torn, "torn").contains("times as long as at rest"));
}

/// One that stops before it is at rest ends with a code of its own, its results written.
#[test]
fn a_drape_that_stops_at_its_limit_has_an_exit_code() {
    let folder = Folder::new("limit");
    let mut short = scene();
    short["numbers"] = json!({"solver.drape.max_steps": 1});
    short["run"] = json!({"drape": true, "duration": 0.02, "dt": 0.02});
    let scene = folder.write("scene.json", &short.to_string());
    let out = folder.0.join("out");
    let output = toile(&["run", path(&scene), "--out", path(&out)]);
    assert_eq!(code(&output), 5, "{}", text(&output.stderr));
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["outcome"], "iteration_limit");
    assert!(text(&output.stdout).contains("yarn nodes"));
    let help = toile(&["--help"]);
    assert!(text(&help.stdout).contains("5 a drape did not come to rest"));
}

#[test]
fn a_garment_that_nothing_holds_ends_its_drape_and_the_summary_says_so() {
    let folder = Folder::new("falling");
    let mut free = scene();
    for key in ["pins", "bodies"] {
        free[key] = json!([]);
    }
    free["run"] = json!({"drape": true, "duration": 0.0, "dt": 0.02});
    let scene = folder.write("scene.json", &free.to_string());
    let out = folder.0.join("out");
    let output = toile(&["run", path(&scene), "--out", path(&out)]);
    assert_eq!(code(&output), 5, "{}", text(&output.stderr));
    assert!(text(&output.stdout).contains("fall for ever"));
    let summary: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(summary["outcome"], "falling");
    let reason = summary["reason"].as_str().unwrap();
    assert!(reason.contains("'square'"), "{reason}");
    // what the solver will take is not known before it runs, and is not said to be nothing
    let output = toile(&["info", path(&scene)]);
    let factor = text(&output.stdout);
    let line = factor.lines().find(|l| l.starts_with("factor")).unwrap();
    assert!(!line.contains("0.00"), "{line}");
}

#[test]
fn numbers_of_the_command_line_reach_the_simulation() {
    let folder = Folder::new("set");
    let scene = folder.write("scene.json", &scene().to_string());
    let vertices = |args: &[&str]| {
        let output = toile(&[&["info", path(&scene)], args].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let all = text(&output.stdout);
        let line = all.lines().find(|l| l.starts_with("vertices")).unwrap();
        line.split_whitespace()
            .last()
            .unwrap()
            .parse::<usize>()
            .unwrap()
    };
    let coarse = vertices(&["--edge-length", "0.1"]);
    let fine = vertices(&["--set", "edge_length=0.02"]);
    assert!(fine > 4 * coarse, "{coarse} {fine}");
    for bad in [
        &["--set", "solver.newton.max_iterations=-3"][..],
        &["--set", "no.such.name=1"],
        &["--edge-length", "NaN"],
        &["--threads", "0"],
    ] {
        let output = toile(&[&["info", path(&scene)], bad].concat());
        assert_eq!(code(&output), 1, "{bad:?}");
        let error = text(&output.stderr);
        assert!(error.starts_with("toile: error: "), "{error}");
    }
}

#[test]
fn a_run_takes_every_core_unless_told_and_its_bits_do_not_depend_on_it() {
    let folder = Folder::new("threads");
    let cores = std::thread::available_parallelism().unwrap().get() as u64;
    let mut fixed = scene();
    fixed["numbers"] = json!({"solver.threads": 3});
    let plain = folder.write("plain.json", &scene().to_string());
    let fixed = folder.write("fixed.json", &fixed.to_string());
    let mut states = Vec::new();
    for (file, more, threads) in [
        (&plain, &[][..], cores.min(256)),
        (&plain, &["--threads", "1"], 1),
        (&plain, &["--set", "solver.threads=2"], 2),
        (&fixed, &[], 3),
        (&fixed, &["--threads", "1"], 1),
    ] {
        let out = folder.0.join("out");
        let args = ["run", path(file), "--out", path(&out)];
        let output = toile(&[&args, more].concat());
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        let table = text(&output.stdout);
        let row = table
            .lines()
            .find(|l| l.trim().starts_with("threads"))
            .unwrap();
        assert!(row.ends_with(&format!(" {threads}")), "{row}");
        let summary: Value =
            serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
        assert_eq!(summary["threads"], threads, "{more:?}");
        states.push(std::fs::read(out.join("state.bin")).unwrap());
    }
    assert!(states.iter().all(|s| *s == states[0]));
}

#[test]
fn refusals_have_their_exit_code_and_name_file_and_place() {
    let folder = Folder::new("refused");
    let mut broken = scene();
    broken["bodies"][0]["radius"] = json!(-1);
    broken["pins"][0]["edge"] = json!(44);
    let broken = folder.write("broken.json", &broken.to_string());
    let out = folder.0.join("out");

    let output = toile(&["check", path(&broken)]);
    assert_eq!(code(&output), 1);
    let all = text(&output.stdout);
    for words in [
        "bodies[0]",
        "pins[0].edge",
        "44",
        "2 problems",
        "broken.json",
    ] {
        assert!(all.contains(words), "{words}: {all}");
    }
    let fine = folder.write("fine.json", &scene().to_string());
    let output = toile(&["check", path(&fine)]);
    assert_eq!(code(&output), 0, "{}", text(&output.stdout));

    let output = toile(&["run", path(&broken), "--out", path(&out)]);
    assert_eq!(code(&output), 1);
    let error = text(&output.stderr);
    assert!(
        error.starts_with("toile: error: ") && error.contains("broken.json: bodies[0]"),
        "{error}"
    );
    let output = toile(&["run", "gone.json", "--out", path(&out)]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("gone.json"));
    let output = toile(&[
        "run",
        path(&fine),
        "--out",
        path(&out),
        "--body",
        "gone.obj",
    ]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("gone.obj"));
    // a file stands where the folder should be
    let output = toile(&["run", path(&fine), "--out", path(&fine)]);
    assert_eq!(code(&output), 4, "{}", text(&output.stderr));
    // wrong command lines
    for args in [&["run"][..], &["fly"], &["info", "--set", "x"], &[]] {
        assert_eq!(code(&toile(args)), 2, "{args:?}");
    }
    assert_eq!(code(&toile(&["--version"])), 0);
}

#[test]
fn schema_prints_every_key_and_parses_as_json() {
    let output = toile(&["schema"]);
    let all = text(&output.stdout);
    for key in [
        "bodies[].contact",
        "friction",
        "solver.newton.max_iterations",
        "frame_every",
    ] {
        assert!(all.contains(key), "{key}");
    }
    let output = toile(&["schema", "--json"]);
    let schema: Value = serde_json::from_slice(&output.stdout).unwrap();
    assert_eq!(
        schema["properties"]["bodies"]["items"]["properties"]["radius"]["type"],
        "number"
    );
}

#[test]
fn a_closed_pipe_ends_output_quietly() {
    let mut child = Command::new(env!("CARGO_BIN_EXE_toile"))
        .args(["schema", "--json"])
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    drop(child.stdout.take());
    let mut error = String::new();
    child
        .stderr
        .take()
        .unwrap()
        .read_to_string(&mut error)
        .unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(error, "");
}

#[test]
fn mannequin_is_a_closed_surface() {
    let folder = Folder::new("mannequin");
    let file = folder.0.join("m.obj");
    let output = toile(&["mannequin", path(&file), "--cell", "0.02"]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let obj = std::fs::read_to_string(&file).unwrap();
    let mut edges: Vec<[u32; 2]> = Vec::new();
    for line in obj.lines().filter(|l| l.starts_with("f ")) {
        let v: Vec<u32> = line[2..]
            .split_whitespace()
            .map(|w| w.split('/').next().unwrap().parse().unwrap())
            .collect();
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            edges.push([a.min(b), a.max(b)]);
        }
    }
    edges.sort_unstable();
    assert!(edges.len() > 1000);
    assert!(edges.chunk_by(|a, b| a == b).all(|run| run.len() == 2));
    let output = toile(&["mannequin", path(&file), "--cell", "nan"]);
    assert_eq!(code(&output), 1);
}

#[test]
fn picture_draws_model_files_and_names_what_it_cannot() {
    let folder = Folder::new("picture");
    let square = folder.write("g.obj", "v 0 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf 1 2 3 4\n");
    let body = folder.write("b.obj", "v 0 0 0\nv 100 0 0\nv 0 100 0\nf 1 2 3\n");
    let draw = |name: &str, more: &[&str]| {
        let out = folder.0.join(name);
        let mut args = vec!["picture", path(&square), "--out", path(&out)];
        args.extend(more);
        let output = toile(&args);
        assert_eq!(code(&output), 0, "{}", text(&output.stderr));
        std::fs::read(&out).unwrap()
    };
    let alone = draw("alone.png", &[]);
    assert!(alone.starts_with(b"\x89PNG"));
    let with_body = draw("body.png", &["--body", path(&body), "--body-scale", "0.01"]);
    assert_ne!(alone, with_body, "the body is not drawn");
    // width and height in the header, as in the PNG specification
    let size =
        |png: &[u8]| [16, 20].map(|at| u32::from_be_bytes(png[at..at + 4].try_into().unwrap()));
    assert_eq!(size(&alone), [1200, 900]);
    assert_eq!(size(&draw("small.png", &["--size", "320x200"])), [320, 200]);
    for (wrong, exit) in [
        ("320", 2),
        ("320x-1", 2),
        ("0x200", 1),
        ("9999999x9999999", 1),
    ] {
        let out = folder.0.join("wrong.png");
        let output = toile(&[
            "picture",
            path(&square),
            "--out",
            path(&out),
            "--size",
            wrong,
        ]);
        assert_eq!(code(&output), exit, "{}", text(&output.stderr));
    }

    let out = folder.0.join("none.png");
    let points = folder.write("p.obj", "v 0 0 0\n");
    for (garment, words) in [
        (&points, "no faces"),
        (&folder.0.join("missing.obj"), "missing.obj"),
    ] {
        let output = toile(&["picture", path(garment), "--out", path(&out)]);
        assert_eq!(code(&output), 1);
        assert!(
            text(&output.stderr).contains(words),
            "{}",
            text(&output.stderr)
        );
        assert!(!out.exists());
    }
    let nowhere = folder.0.join("no/folder/p.png");
    let output = toile(&["picture", path(&square), "--out", path(&nowhere)]);
    assert_eq!(code(&output), 4);
}

#[test]
fn a_real_pattern_on_a_real_body_is_built() {
    let Some(data) = std::env::var_os("TOILE_DATA").map(PathBuf::from) else {
        assert_ne!(
            std::env::var("CI").as_deref(),
            Ok("true"),
            "TOILE_DATA is unset"
        );
        eprintln!("skipped: TOILE_DATA is unset");
        return;
    };
    let pattern = data.join("garmentcode/gen_tshirt_specification.json");
    let body = data.join("bodies/mean_all.obj");
    let output = toile(&[
        "info",
        path(&pattern),
        "--body",
        path(&body),
        "--edge-length",
        "0.03",
    ]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let all = text(&output.stdout);
    assert!(
        all.contains("mean_all") && all.contains("gen_tshirt_specification"),
        "{all}"
    );
}

#[test]
fn yarns_are_laid_counted_and_drawn() {
    let folder = Folder::new("yarns");
    let mut scene = scene();
    let garment = &mut scene["garment"];
    garment["fabrics"] = json!([{"yarns": {
        "weave": "twill 2/2", "warp_pitch": 0.01, "radius": 0.002,
    }}]);
    let file = folder.write("woven.json", &scene.to_string());
    let svg = folder.0.join("yarns.svg");
    let args = [
        "yarns",
        file.to_str().unwrap(),
        "--out",
        svg.to_str().unwrap(),
    ];
    let output = toile(&args);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    // 30 x 30 crossings, two ends to each of 60 yarns
    let printed = text(&output.stdout);
    let has = |name: &str, count: usize| {
        let row = format!("{name:<22} {count}\n");
        assert!(printed.contains(&row), "{printed}");
    };
    has("nodes", 900 + 120);
    has("yarns", 60);
    has("corners", 3600);
    assert!(std::fs::read_to_string(&svg).unwrap().contains("<svg"));
    // no yarns, and too coarse ones
    let bare = folder.write("bare.json", &self::scene().to_string());
    let output = toile(&[
        "yarns",
        bare.to_str().unwrap(),
        "--out",
        svg.to_str().unwrap(),
    ]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("no fabric has yarns"));
    scene["garment"]["fabrics"][0]["yarns"]["radius"] = json!(0.02);
    let file = folder.write("coarse.json", &scene.to_string());
    let output = toile(&[
        "yarns",
        file.to_str().unwrap(),
        "--out",
        svg.to_str().unwrap(),
    ]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("two radii"));
}

#[test]
fn a_body_stands_where_the_command_line_says() {
    let folder = Folder::new("offset");
    let mut scene = scene();
    scene["bodies"] = json!([]);
    let file = folder.write("scene.json", &scene.to_string());
    let body = folder.0.join("body.obj");
    assert_eq!(code(&toile(&["mannequin", path(&body)])), 0);
    let run = |offset: &[&str]| {
        let out = folder.0.join("out");
        let fixed = ["run", path(&file), "--out", path(&out), "--quiet"];
        let body = ["--body", path(&body), "--set", "run.duration=0.01"];
        let output = toile(&[&fixed[..], &body, &["--set", "gravity.y=0"], offset].concat());
        (code(&output), out)
    };
    let gap = |offset: &[&str]| {
        let (code, out) = run(offset);
        assert_eq!(code, 0);
        let text = std::fs::read_to_string(out.join("summary.json")).expect("summary");
        let summary: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        summary["min_gap"].as_f64().expect("a gap")
    };
    let (near, far) = (
        gap(&["--body-offset", "0,-10,0"]),
        gap(&["--body-offset", "0,-13,0"]),
    );
    assert!((far - near - 3.0).abs() < 0.05, "{near} {far}");
    for wrong in ["1,2", "1,2,nan", "up"] {
        assert_eq!(run(&["--body-offset", wrong]).0, 2, "{wrong}");
    }
}

#[test]
fn every_problem_of_a_garment_is_told() {
    let folder = Folder::new("problems");
    let mut scene = scene();
    let mut panels = scene["garment"]["panels"]
        .as_array()
        .expect("panels")
        .clone();
    let mut second = panels[0].clone();
    second["name"] = json!("second");
    second["edge_length"] = json!(-1.0);
    panels[0]["vertices"][0] = json!([1e9, 0.0]);
    panels.push(second);
    scene["garment"]["panels"] = json!(panels);
    let file = folder.write("scene.json", &scene.to_string());
    let output = toile(&["check", path(&file)]);
    assert_eq!(code(&output), 1);
    let all = text(&output.stdout);
    assert!(
        all.contains("second") && all.contains("1000000000"),
        "{all}"
    );
    assert!(all.contains("2 problems"), "{all}");
}

#[test]
fn a_clockwise_outline_is_noted() {
    let folder = Folder::new("clockwise");
    let mut scene = scene();
    let panel = &mut scene["garment"]["panels"][0];
    let mut edges = panel["edges"].as_array().expect("edges").clone();
    edges.reverse();
    for edge in &mut edges {
        edge.as_array_mut().expect("ends").reverse();
    }
    panel["edges"] = json!(edges);
    scene.as_object_mut().expect("object").remove("pins");
    let file = folder.write("scene.json", &scene.to_string());
    let output = toile(&["check", path(&file)]);
    let all = text(&output.stdout);
    assert!(all.contains("clockwise"), "{all}");
}

/// `report` leaves its three files, and lists what it could not compare.
#[test]
fn report_compares_models_and_leaves_its_files() {
    let folder = Folder::new("report");
    let square = json!([[0, 0], [0.02, 0], [0.02, 0.02], [0, 0.02]]);
    let scene = json!({
        "toile": 1,
        "name": "swatch",
        "garment": {
            "toile_garment": 1,
            "name": "g",
            "edge_length": 0.005,
            "panels": [{"name": "p", "fabric": "y", "vertices": square,
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
            "fabrics": [{"name": "y", "yarns": {"weave": "plain", "warp_pitch": 0.002, "radius": 0.0005}}],
            "blend_regions": [{"panel": "p", "polygon": [[-1, -1], [1, -1], [1, 0.011], [-1, 0.011]]}],
        },
        "pins": [{"panel": "p", "edge": 2}],
        "numbers": {"yarn.sliding": 0, "solver.drape.max_steps": 1},
    });
    let file = folder.write("scene.json", &scene.to_string());
    let out = folder.0.join("out");
    let done = toile(&["report", path(&file), "--out", path(&out)]);
    assert_eq!(code(&done), 0, "{}", text(&done.stderr));
    assert!(text(&done.stdout).contains("mixed, regions x 1"));
    let report: Value =
        serde_json::from_slice(&std::fs::read(out.join("report.json")).unwrap()).unwrap();
    assert_eq!(report["models"].as_array().unwrap().len(), 7);
    assert!(text(&std::fs::read(out.join("report.csv")).unwrap()).starts_with("name,kind"));
    assert!(text(&std::fs::read(out.join("report.html")).unwrap()).contains("swatch"));
}

/// `fabric` prints a material, writes plots and a fabric that is read again with it; what has no yarns is refused.
#[test]
fn a_fabric_gets_the_material_of_its_yarns() {
    let folder = Folder::new("fabric");
    let yarns = json!({"name": "shirting", "yarns": {"preset": "plain shirting"}});
    let file = folder.write("shirting.json", &yarns.to_string());
    let out = folder.0.join("out");
    let output = toile(&["fabric", path(&file), "--out", path(&out)]);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    let printed = text(&output.stdout);
    assert!(printed.contains("membrane.weft"), "{printed}");
    let made = std::fs::read_to_string(out.join("fabric.json")).unwrap();
    let (fabric, _) = toile::pattern::import::fabric_from_json(&made).unwrap();
    assert!((fabric.weft / 981.7 - 1.0).abs() < 0.01, "{}", fabric.weft);
    assert!(fabric.yarns.is_some() && fabric.name == "shirting");
    for plot in ["membrane.svg", "bending.svg"] {
        assert!(
            std::fs::read_to_string(out.join(plot))
                .unwrap()
                .contains("<svg")
        );
    }
    let bare = folder.write("bare.json", r#"{"name": "bare"}"#);
    let output = toile(&["fabric", path(&bare)]);
    assert_eq!(code(&output), 1);
    assert!(text(&output.stderr).contains("no yarns"));
}

/// The written garment is the scene's with the suggested region, and the scene reads it.
#[test]
fn a_region_is_suggested_drawn_and_written_as_a_garment() {
    let folder = Folder::new("suggest");
    let pucker = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples/pucker.json");
    let out = path(&folder.0).to_owned();
    let base = ["suggest", path(&pucker), "--out", &out];
    let output = toile(&[&base[..], &["--budget", "900", "--picture-size", "120x60"]].concat());
    let said = text(&output.stdout);
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    for word in ["wrinkle", "seam", "tolerance", "suggested", "yarn nodes"] {
        assert!(said.contains(word), "{said}");
    }
    assert!(folder.0.join("picture.png").is_file());
    let read = |name: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(folder.0.join(name)).unwrap()).unwrap()
    };
    let region = read("region.json");
    assert_eq!(
        region["blend_regions"],
        read("garment.json")["blend_regions"]
    );
    let alpha = region["alpha"].as_array().unwrap();
    assert!(
        alpha.contains(&json!(1.0)) && alpha.len() == region["error"].as_array().unwrap().len()
    );
    let mut scene: Value =
        serde_json::from_str(&std::fs::read_to_string(&pucker).unwrap()).unwrap();
    scene["garment"] = json!({"file": "garment.json"});
    let mixed = folder.write("scene.json", &scene.to_string());
    let info = text(&toile(&["info", path(&mixed)]).stdout);
    assert!(info.contains("carried nodes"), "{info}");
    // each error by its own name, each criterion of each vertex
    assert!(said.contains("rms over area") && said.contains("those that are left"));
    let criteria = region["criteria"].as_object().unwrap();
    assert_eq!(criteria.len(), 6);
    for values in criteria.values() {
        assert_eq!(values.as_array().unwrap().len(), alpha.len());
    }
    assert!(region["suggested"]["cost"]["yarn_nodes"].as_u64().unwrap() <= 900);
    assert_eq!(region["left_out"], json!([]));
    let seam_only = ["wrinkle", "mesh", "curvature", "strain", "stress"];
    let without: Vec<&str> = seam_only.iter().flat_map(|c| ["--without", *c]).collect();
    let output = toile(&[&base[..], &["--tolerance", "0.3"], &without].concat());
    assert_eq!(code(&output), 0, "{}", text(&output.stderr));
    assert_eq!(read("region.json")["left_out"], json!(seam_only));
    assert_eq!(read("region.json")["blend_regions"], json!([]));
    // neither tolerance nor budget, and one that is none
    assert_eq!(code(&toile(&base)), 2);
    assert_eq!(
        code(&toile(
            &[&base[..], &["--budget", "9", "--without", "bend"]].concat()
        )),
        2
    );
    let refused = toile(&[&base[..], &["--tolerance", "0"]].concat());
    assert_eq!(code(&refused), 1);
    assert!(
        text(&refused.stderr).contains("from 0.001"),
        "{}",
        text(&refused.stderr)
    );
}

/// Of a scene that moves the largest errors of its run are judged, or of the part of it that is asked for, and it is said which; a scene
/// that pulls yarns cannot be judged by triangles.
#[test]
fn suggestions_say_which_states_they_judged() {
    let folder = Folder::new("suggest_motion");
    let out = path(&folder.0).to_owned();
    let example = |name: &str| {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
        path(&file.join(name)).to_owned()
    };
    let swing = example("swing.json");
    let full = |more: &[&str]| {
        let base = ["suggest", &swing, "--out", &out, "--picture-size", "60x60"];
        let done = toile(&[&base[..], &["--tolerance", "0.02"], more].concat());
        assert_eq!(code(&done), 0, "{}", text(&done.stderr));
        let region = std::fs::read_to_string(folder.0.join("region.json")).unwrap();
        let region: Value = serde_json::from_str(&region).unwrap();
        let error = region["triangles"]["errors"]["largest"].as_f64().unwrap();
        (text(&done.stdout).to_owned(), error)
    };
    let (said, still) = full(&["--until", "0"]);
    assert!(said.contains("the scene's run of 0.15 s is not judged") && still < 1e-9);
    let (said, half) = full(&["--until", "0.0749"]);
    assert!(said.contains("every step to 0.0725 s"), "{said}");
    let (said, all) = full(&[]);
    assert!(said.contains("every step to 0.15 s"), "{said}");
    assert!(
        still < half && half <= all && all > 0.02,
        "{still} {half} {all}"
    );
    let base = ["suggest", &swing, "--out", &out, "--budget", "99"];
    let late = toile(&[&base[..], &["--until", "0.2"]].concat());
    assert_eq!(code(&late), 1);
    assert!(text(&late.stderr).contains("ends at 0.15 s"));
    let pulled = toile(&[
        "suggest",
        &example("pull_out.json"),
        "--budget",
        "99",
        "--out",
        &out,
    ]);
    assert_eq!(code(&pulled), 1);
    let said = text(&pulled.stderr);
    assert!(
        said.contains("triangles alone") && said.contains("pins[1]"),
        "{said}"
    );
}

/// `--compare` compares the region that it writes, whether it is asked for by numbers or costs what the drawn one does, and leaves a report.
#[test]
fn a_comparison_is_of_the_region_that_was_asked_for() {
    let folder = Folder::new("suggest_compare");
    let out = path(&folder.0).to_owned();
    let square = json!([[0, 0], [0.03, 0], [0.03, 0.03], [0, 0.03]]);
    let middle = json!([
        [0.0045, 0.0045],
        [0.0255, 0.0045],
        [0.0255, 0.0255],
        [0.0045, 0.0255]
    ]);
    let scene = json!({
        "toile": 1, "name": "hung",
        "garment": {
            "toile_garment": 1, "name": "g", "edge_length": 0.003,
            "panels": [{"name": "p", "fabric": "y", "vertices": square,
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
            "fabrics": [{"name": "y", "density": 0.3,
                "membrane": {"warp": 1963.5, "weft": 1963.5, "shear": 40, "coupling": 0},
                "yarns": {"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025,
                    "young": 1e7, "shear": 1.6e5, "density": 1.5e-4}}],
            "blend_regions": [{"panel": "p", "polygon": middle}],
        },
        "gravity": [0, 0, -9.81],
        "pins": [{"panel": "p", "edge": 1}, {"panel": "p", "uv": [0, 0], "target": [0.003, 0, 0]}],
        "numbers": {"yarn.sliding": 0, "solver.drape.force_tolerance": 1e-9, "solver.drape.max_steps": 2000},
    });
    let file = folder.write("scene.json", &scene.to_string());
    let read = |name: &str| -> Value {
        serde_json::from_str(&std::fs::read_to_string(folder.0.join(name)).unwrap()).unwrap()
    };
    let base = [
        "suggest",
        path(&file),
        "--compare",
        "--out",
        &out,
        "--picture-size",
        "60x60",
    ];
    for (more, asked) in [(&[][..], None), (&["--budget", "300"], Some(300))] {
        let done = toile(&[&base[..], more].concat());
        assert_eq!(code(&done), 0, "{}", text(&done.stderr));
        let models = read("report.json")["models"].clone();
        let nodes = |k: usize| models[k]["yarn_nodes"].as_u64().unwrap();
        let names = [0, 1, 2, 3].map(|k| models[k]["name"].clone());
        assert_eq!(names, ["triangles", "drawn", "suggested", "yarns"]);
        let told = &read("region.json")["suggested"]["cost"]["yarn_nodes"];
        assert_eq!(told.as_u64().unwrap(), nodes(2));
        let most = asked.unwrap_or_else(|| nodes(1));
        assert!(
            nodes(2) <= most && nodes(2) > most / 2,
            "{} of {most}",
            nodes(2)
        );
        assert!(text(&std::fs::read(folder.0.join("report.html")).unwrap()).contains("hung"));
        assert!(folder.0.join("report.csv").is_file());
    }
    let late = toile(&[&base[..], &["--until", "0"]].concat());
    assert_eq!(code(&late), 2);
}
