//! Bodies of a scene go where its keyframes and frames say, and the cloth feels it.
//!
//! Expected places are written out from the scene's numbers here, not taken from the library's own
//! interpolation.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    reason = "the functions under test take the pointers of C"
)]

use super::capi_support::scene::{array, capsule_mesh, ok};
use serde_json::{Value, json};
use std::f64::consts::PI;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::ptr;
use toile::capi::*;
use toile::math::{Rotation, Vec3};
use toile::sim::Sim;
use toile::sim_scene::{Driver, sim_from_json};

pub struct Folder(pub PathBuf);

impl Folder {
    pub fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("toile-motion-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn write(&self, name: &str, text: &str) -> PathBuf {
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

/// A box of 0.2 m about the origin, its upper half moved by `shift` along x.
pub fn box_obj(shift: f64) -> String {
    let mut text = String::new();
    for corner in 0..8 {
        let c = |bit: u32| if corner >> bit & 1 == 1 { 0.1 } else { -0.1 };
        let x = c(0) + if c(1) > 0.0 { shift } else { 0.0 };
        text += &format!("v {x} {} {}\n", c(1), c(2));
    }
    for f in [
        [0, 2, 3, 1],
        [4, 5, 7, 6],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 4, 6, 2],
        [1, 3, 7, 5],
    ] {
        let [a, b, c, d] = f.map(|v| v + 1);
        text += &format!("f {a} {b} {c}\nf {a} {c} {d}\n");
    }
    text
}

/// A small sheet held by two corners far from the bodies given.
pub fn scene(bodies: Value, run: Value) -> Value {
    json!({
        "toile": 1,
        "garment": {
            "toile_garment": 1,
            "edge_length": 0.05,
            "panels": [{
                "name": "sheet",
                "vertices": [[0, 0], [0.1, 0], [0.1, 0.1], [0, 0.1]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
                "placement": {"translation": [0, 5, 0]}
            }]
        },
        "bodies": bodies,
        "pins": [{"panel": "sheet", "edge": 2}],
        "run": run
    })
}

/// A turn by a right angle while going along x, held before 0.04 s and after 0.12 s.
fn turning() -> Value {
    json!({"keyframes": [
        {"time": 0.04, "position": [0, 0, 0]},
        {"time": 0.08, "position": [0.4, 0, 0], "rotation_deg": [0, 0, 90]},
        {"time": 0.12, "position": [0.4, 0.2, 0], "rotation_deg": [0, 0, 90]}
    ]})
}

/// Position and angle about z that [`turning`] means.
fn turned(time: f64) -> (Vec3, f64) {
    if time <= 0.04 {
        (Vec3::zeros(), 0.0)
    } else if time <= 0.08 {
        let s = (time - 0.04) / 0.04;
        (Vec3::new(0.4 * s, 0.0, 0.0), 0.5 * PI * s)
    } else {
        let s = ((time - 0.08) / 0.04).min(1.0);
        (Vec3::new(0.4, 0.2 * s, 0.0), 0.5 * PI)
    }
}

fn assert_at(points: &[Vec3], expected: impl Fn(usize) -> Vec3, tolerance: f64, what: &str) {
    for (i, p) in points.iter().enumerate() {
        let e = expected(i);
        assert!(
            (p - e).norm() < tolerance,
            "{what}: vertex {i} at {p}, not {e}"
        );
    }
}

/// Every frame of a part of a .glb file, in metres, with its time.
fn glb_frames(path: &Path, part: &str) -> Vec<(f64, Vec<Vec3>)> {
    let bytes = std::fs::read(path).unwrap();
    let word = |i: usize| u32::from_le_bytes(bytes[i..i + 4].try_into().unwrap()) as usize;
    let n = word(12);
    let root: Value = serde_json::from_slice(&bytes[20..20 + n]).unwrap();
    let data = &bytes[28 + n..];
    let floats = |accessor: &Value| -> Vec<f64> {
        let a = &root["accessors"][accessor.as_u64().unwrap() as usize];
        let view = &root["bufferViews"][a["bufferView"].as_u64().unwrap() as usize];
        let from = view["byteOffset"].as_u64().unwrap() as usize;
        let length = view["byteLength"].as_u64().unwrap() as usize;
        data[from..from + length]
            .chunks_exact(4)
            .map(|b| f64::from(f32::from_le_bytes(b.try_into().unwrap())))
            .collect()
    };
    let points = |accessor: &Value| -> Vec<Vec3> {
        let flat = floats(accessor);
        flat.chunks_exact(3)
            .map(|p| Vec3::new(p[0], p[1], p[2]))
            .collect()
    };
    let nodes = root["nodes"].as_array().unwrap();
    let node = nodes.iter().position(|n| n["name"] == part).unwrap();
    let mesh = &root["meshes"][nodes[node]["mesh"].as_u64().unwrap() as usize];
    let primitive = &mesh["primitives"][0];
    let base = points(&primitive["attributes"]["POSITION"]);
    let animation = &root["animations"][0];
    let channel = animation["channels"]
        .as_array()
        .unwrap()
        .iter()
        .find(|c| c["target"]["node"] == node)
        .unwrap_or_else(|| panic!("{part} does not move"));
    let sampler = &animation["samplers"][channel["sampler"].as_u64().unwrap() as usize];
    let times = floats(&sampler["input"]);
    let targets = primitive["targets"].as_array().unwrap();
    assert_eq!(times.len(), targets.len());
    times
        .into_iter()
        .zip(targets)
        .map(|(t, target)| {
            let delta = points(&target["POSITION"]);
            (t, base.iter().zip(delta).map(|(x, d)| x + d).collect())
        })
        .collect()
}

pub fn run(scene: &Path, out: &Path) -> std::process::Output {
    Command::new(env!("CARGO_BIN_EXE_toile"))
        .arg("run")
        .arg(scene)
        .arg("--out")
        .arg(out)
        .arg("--quiet")
        .output()
        .unwrap()
}

#[test]
fn a_run_shows_bodies_at_their_keyframes_and_frames() {
    let folder = Folder::new("run");
    for (k, shift) in [(0, 0.0), (1, 0.08), (2, -0.04)] {
        folder.write(&format!("f{k}.obj"), &box_obj(shift));
    }
    let frames = json!(["f0.obj", "f1.obj", "f2.obj"]);
    let bodies = json!([
        {"name": "ball", "shape": "sphere", "radius": 0.1, "motion": turning()},
        {"name": "still", "shape": "sphere", "radius": 0.1, "pose": {"position": [3, 0, 0]}},
        {"name": "held", "shape": "mesh", "file": "f0.obj", "cell_size": 0.02,
         "motion": {"frames": frames, "rate": 20,
                    "keyframes": [{"time": 0, "position": [0, 0, 1]},
                                  {"time": 0.2, "position": [0, 0, 2]}]}},
        {"name": "again", "shape": "mesh", "file": "f0.obj", "cell_size": 0.02,
         "motion": {"frames": frames, "rate": 20, "repeat": true}}
    ]);
    let plan = json!({"drape": false, "duration": 0.16, "dt": 0.01, "frame_every": 1});
    let file = folder.write("scene.json", &scene(bodies, plan).to_string());
    let out = folder.0.join("out");
    let output = run(&file, &out);
    assert!(
        output.status.success(),
        "{}",
        String::from_utf8_lossy(&output.stderr)
    );
    let glb = out.join("scene.glb");

    let ball = glb_frames(&glb, "ball");
    assert_eq!(ball.len(), 17);
    let (_, start) = &ball[0];
    for (time, points) in &ball {
        let (p, angle) = turned(*time);
        let r = Rotation::from_axis_angle(&Vec3::z_axis(), angle);
        assert_at(
            points,
            |i| r * start[i] + p,
            1e-6,
            &format!("ball at {time} s"),
        );
    }
    // shift of the upper half at time t: straight between frames at 0, 0.05 and 0.1 s
    let shift = |t: f64| {
        if t <= 0.05 {
            0.08 * t / 0.05
        } else {
            0.08 - 0.12 * ((t - 0.05) / 0.05).min(1.0)
        }
    };
    let shifted = |start: &[Vec3], i: usize, s: f64| {
        start[i] + Vec3::x() * if start[i].y > 0.0 { s } else { 0.0 }
    };
    let held = glb_frames(&glb, "held");
    for (time, points) in &held {
        let start = &held[0].1;
        let away = Vec3::z() * (5.0 * time);
        let expected = |i: usize| shifted(start, i, shift(*time)) + away;
        assert_at(points, expected, 1e-6, &format!("held at {time} s"));
    }
    let again = glb_frames(&glb, "again");
    for (time, points) in &again {
        let expected = |i: usize| shifted(&again[0].1, i, shift(time.rem_euclid(0.1 - 1e-7)));
        // the time in the file is single precision
        assert_at(points, expected, 1e-5, &format!("again at {time} s"));
    }
    // the last frame is the state the run ended in
    let json: Value =
        serde_json::from_slice(&std::fs::read(out.join("summary.json")).unwrap()).unwrap();
    assert_eq!(json["steps"], 16);
}

fn go(sim: &mut Sim, driver: &mut Driver, scene: &toile::scene::Scene, time: f64, dt: f64) {
    driver.set(sim, scene, time).unwrap();
    sim.step(dt).unwrap();
}

#[test]
fn a_driven_body_is_at_its_keyframes_whatever_the_step() {
    for dt in [0.005, 0.02, 0.1] {
        let bodies = json!([{"shape": "sphere", "radius": 0.1, "motion": turning()}]);
        let text = scene(bodies, json!({"drape": false})).to_string();
        let (mut sim, scene) = sim_from_json(&text, None).unwrap();
        let mut driver = Driver::new(&sim, &scene).unwrap();
        let start = sim.body_mesh(0).unwrap().0;
        for step in 1..=(0.2_f64 / dt).round() as u32 {
            let time = f64::from(step) * dt;
            go(&mut sim, &mut driver, &scene, time, dt);
            let (p, angle) = turned(time);
            let r = Rotation::from_axis_angle(&Vec3::z_axis(), angle);
            let now = sim.body_mesh(0).unwrap().0;
            assert_at(&now, |i| r * start[i] + p, 1e-12, &format!("{time} s"));
        }
    }
}

/// A sheet of 0.6 m in the plane x = 0, held by two edges, and a body that flies through that plane.
fn target(body: Value, run: Value) -> Value {
    json!({
        "toile": 1,
        "garment": {
            "toile_garment": 1,
            "edge_length": 0.05,
            "panels": [{
                "name": "sheet",
                "vertices": [[-0.3, -0.3], [0.3, -0.3], [0.3, 0.3], [-0.3, 0.3]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]],
                "placement": {"rotation_deg": [0, 90, 0]}
            }]
        },
        "gravity": [0, 0, 0],
        "bodies": [body],
        "pins": [{"panel": "sheet", "edge": 0}, {"panel": "sheet", "edge": 2}],
        "run": run
    })
}

/// Vertices within the body's shadow along x that are not in front of its middle at `x`.
fn left_behind(sim: &Sim, x: f64) -> usize {
    let near = |p: &&Vec3| p.y.hypot(p.z) < 0.08;
    let all: Vec<&Vec3> = sim.positions().iter().filter(near).collect();
    assert!(all.len() > 3);
    all.into_iter().filter(|p| p.x < x).count()
}

#[test]
fn the_first_step_sweeps_a_body_through_its_way_and_takes_the_cloth_along() {
    // 10 m/s: in the first step the ball goes from one side of the cloth to the other; the mesh,
    // whose frames may be a deformation of any kind, comes half-way through at 4 m/s
    let folder = Folder::new("sweep");
    let (points, triangles) = capsule_mesh(0.02, 0.1);
    let obj = |x: f64| {
        let mut text = String::new();
        for p in points.chunks(3) {
            text += &format!("v {} {} {}\n", p[0] + x, p[1], p[2]);
        }
        for t in triangles.chunks(3) {
            text += &format!("f {} {} {}\n", t[0] + 1, t[1] + 1, t[2] + 1);
        }
        text
    };
    folder.write("left.obj", &obj(-0.15));
    folder.write("right.obj", &obj(-0.03));
    let keyframes = json!([{"time": 0, "position": [-0.15, 0, 0]},
                           {"time": 0.03, "position": [0.15, 0, 0]}]);
    let ball = json!({"shape": "sphere", "radius": 0.1, "motion": {"keyframes": keyframes}});
    let mesh = json!({"shape": "mesh", "file": "left.obj", "cell_size": 0.01,
                      "motion": {"frames": ["left.obj", "right.obj"], "rate": 33.333333333333336}});
    let all = [
        (&ball, 0.15, false),
        (&ball, 0.15, true),
        (&mesh, -0.03, false),
        (&mesh, -0.03, true),
    ];
    for (body, end, drape) in all {
        let plan = json!({"drape": drape, "duration": 0.03, "dt": 0.03});
        let text = target(body.clone(), plan).to_string();
        let (mut sim, scene) = sim_from_json(&text, Some(&folder.0)).unwrap();
        let mut driver = Driver::new(&sim, &scene).unwrap();
        if drape {
            let options = toile::sim::DrapeOptions {
                force_tolerance: 0.0,
                max_steps: 0,
            };
            sim.drape(&options, &mut |_| true).unwrap();
        }
        go(&mut sim, &mut driver, &scene, 0.03, 0.03);
        let what = format!("{}, draped {drape}", body["shape"]);
        assert_eq!(left_behind(&sim, end), 0, "{what}");
        assert!(sim.report().unwrap().min_gap > -1e-3, "{what}");
    }
}

#[test]
fn pins_follow_their_keys_and_let_go() {
    let mut text = scene(json!([]), json!({"drape": false}));
    text["pins"] = json!([
        {"panel": "sheet", "uv": [0, 0.1], "target": [0, 5.2, 0], "motion": [
            {"time": 0, "offset": [0, 0, 0]}, {"time": 0.1, "offset": [0, 0, 0.05]}]},
        {"panel": "sheet", "uv": [0.1, 0.1], "until": 0.05}
    ]);
    let (mut sim, scene) = sim_from_json(&text.to_string(), None).unwrap();
    let mut driver = Driver::new(&sim, &scene).unwrap();
    let moving = sim.locate(0, [0.0, 0.1]).unwrap() as usize;
    let other = sim.locate(0, [0.1, 0.1]).unwrap() as usize;
    let home = sim.positions()[other];
    for step in 1..=15 {
        let time = f64::from(step) * 0.01;
        go(&mut sim, &mut driver, &scene, time, 0.01);
        let expected = Vec3::new(0.0, 5.2, 0.5 * time.min(0.1));
        assert!(
            (sim.positions()[moving] - expected).norm() < 1e-12,
            "{time}"
        );
        let gone = (sim.positions()[other] - home).norm();
        assert_eq!(gone > 0.0, time > 0.05 + 1e-9, "{time}: {gone}");
    }
}

#[test]
fn a_c_host_finds_bodies_at_their_start_and_plays_the_motion_itself() {
    let bodies = json!([{"shape": "sphere", "radius": 0.1, "motion": turning()}]);
    let text = scene(bodies, json!({"drape": false})).to_string();
    let mut handle = ptr::null_mut();
    ok(unsafe { toile_sim_from_scene(text.as_ptr().cast(), text.len(), ptr::null(), &mut handle) });
    let sim = super::capi_support::scene::Sim(handle);
    let points = || -> Vec<Vec3> {
        array(|out, n, needed| unsafe { toile_sim_body_positions(sim.0, 0, out, n, needed) })
            .chunks_exact(3)
            .map(|p| Vec3::new(p[0], p[1], p[2]))
            .collect()
    };
    let start = points();
    let middle = start.iter().sum::<Vec3>() / start.len() as f64;
    assert!(middle.norm() < 0.02, "{middle}");
    for step in 1..=8 {
        let (p, angle) = turned(f64::from(step) * 0.02);
        let (sin, cos) = (0.5 * angle).sin_cos();
        let (position, quaternion) = ([p.x, p.y, p.z], [0.0, 0.0, sin, cos]);
        ok(unsafe { toile_sim_set_body_pose(sim.0, 0, position.as_ptr(), quaternion.as_ptr()) });
        sim.step(0.02);
        let r = Rotation::from_axis_angle(&Vec3::z_axis(), angle);
        assert_at(
            &points(),
            |i| r * start[i] + p,
            1e-12,
            &format!("step {step}"),
        );
    }
}

#[test]
fn before_the_first_step_a_pose_places_and_afterwards_or_after_a_drape_it_moves() {
    for drape in [false, true] {
        let body = json!({"shape": "sphere", "radius": 0.1, "pose": {"position": [-0.15, 0, 0]}});
        let text = target(body, json!({})).to_string();
        let mut handle = ptr::null_mut();
        ok(unsafe {
            toile_sim_from_scene(text.as_ptr().cast(), text.len(), ptr::null(), &mut handle)
        });
        let sim = super::capi_support::scene::Sim(handle);
        let place = |x: f64| {
            ok(unsafe {
                toile_sim_set_body_pose(
                    sim.0,
                    0,
                    [x, 0.0, 0.0].as_ptr(),
                    [0.0, 0.0, 0.0, 1.0].as_ptr(),
                )
            });
        };
        let middle = || {
            let x = array(|out, n, needed| unsafe {
                toile_sim_body_positions(sim.0, 0, out, n, needed)
            });
            x.chunks_exact(3).map(|p| p[0]).sum::<f64>() * 3.0 / x.len() as f64
        };
        // stands there at once
        place(0.4);
        assert!((middle() - 0.4).abs() < 1e-9);
        place(-0.15);
        if drape {
            ok(unsafe { toile_sim_drape(sim.0, ptr::null(), ptr::null_mut()) });
        } else {
            sim.step(0.01);
        }
        place(0.15);
        assert!((middle() + 0.15).abs() < 1e-9, "a motion takes a step");
        sim.step(0.03);
        assert!((middle() - 0.15).abs() < 1e-9);
        // swept: the cloth in its way is in front of it
        let x = sim.positions();
        let near = x.chunks_exact(3).filter(|p| p[1].hypot(p[2]) < 0.08);
        assert!(near.clone().count() > 3);
        assert_eq!(near.filter(|p| p[0] < 0.15).count(), 0, "draped {drape}");
    }
}
