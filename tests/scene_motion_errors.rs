//! Motions that cannot be are refused with the key that is wrong, by the command line and the C
//! interface alike.
#![allow(
    unsafe_code,
    clippy::undocumented_unsafe_blocks,
    reason = "the functions under test take the pointers of C"
)]

use super::capi_support::scene::{fails, last_error};
use super::scene_motion::{Folder, box_obj, run, scene};
use serde_json::{Value, json};
use std::ptr;
use toile::capi::*;

#[test]
fn bad_motions_name_their_key() {
    let folder = Folder::new("bad");
    folder.write("box.obj", &box_obj(0.0));
    folder.write("short.obj", "v 0 0 0\nv 1 0 0\n");
    folder.write("nan.obj", "v 0 nan 0\n");
    let ball = |motion: Value| json!({"shape": "sphere", "radius": 0.1, "motion": motion});
    let mesh = |motion: Value| json!({"shape": "mesh", "file": "box.obj", "cell_size": 0.02, "motion": motion});
    let two = |second: Value| json!({"keyframes": [{"time": 0.5}, second]});
    let cases = [
        (
            ball(json!({"keyframes": []})),
            "motion.keyframes",
            "at least one",
        ),
        (
            ball(two(json!({"time": 0.5}))),
            "motion.keyframes[1]",
            "after",
        ),
        (
            ball(two(json!({"time": 0.1}))),
            "motion.keyframes[1]",
            "after",
        ),
        (ball(two(json!({}))), "motion.keyframes[1]", "time"),
        (
            ball(two(json!({"time": "late"}))),
            "motion.keyframes[1].time",
            "",
        ),
        (
            ball(two(json!({"time": 1, "position": [0, 1]}))),
            "motion.keyframes[1].position",
            "",
        ),
        (
            ball(two(json!({"time": 1, "quaternion_xyzw": [0, 0, 0, 0]}))),
            "motion.keyframes[1].quaternion_xyzw",
            "no rotation",
        ),
        (
            ball(two(json!({"time": 1, "angle": 3}))),
            "motion.keyframes[1].angle",
            "",
        ),
        (ball(json!({"keys": []})), "motion.keys", ""),
        (
            ball(json!({"frames": ["box.obj"], "rate": 1})),
            "motion.frames",
            "mesh",
        ),
        (ball(json!({"rate": 1})), "motion.rate", "frames"),
        (ball(json!({"repeat": true})), "motion.repeat", "frames"),
        (mesh(json!({"frames": ["box.obj"]})), "motion", "rate"),
        (
            mesh(json!({"frames": [], "rate": 1})),
            "motion.frames",
            "at least one",
        ),
        (
            mesh(json!({"frames": ["box.obj"], "rate": 0})),
            "motion.rate",
            "positive",
        ),
        (
            mesh(json!({"frames": ["box.obj", "short.obj"], "rate": 1})),
            "motion.frames[1]",
            "short.obj has 2 vertices, the mesh has 8",
        ),
        (
            mesh(json!({"frames": ["box.obj", "nan.obj"], "rate": 1})),
            "motion.frames[1]",
            "nan",
        ),
        (
            mesh(json!({"frames": ["box.obj", "gone.obj"], "rate": 1})),
            "motion.frames[1]",
            "gone.obj",
        ),
    ];
    let base = std::ffi::CString::new(folder.0.to_str().unwrap()).unwrap();
    for (body, key, words) in &cases {
        let text = scene(json!([body]), json!({})).to_string();
        let key = format!("bodies[0].{key}");
        let file = folder.write("scene.json", &text);
        let output = run(&file, &folder.0.join("out"));
        assert_eq!(output.status.code(), Some(1), "{body}");
        let said = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(said.contains(&key) && said.contains(words), "{key}: {said}");

        let mut handle = ptr::null_mut();
        let status = unsafe {
            toile_sim_from_scene(text.as_ptr().cast(), text.len(), base.as_ptr(), &mut handle)
        };
        let expected = if *words == "gone.obj" {
            TOILE_E_IO
        } else {
            TOILE_E_PARSE
        };
        fails(status, expected);
        assert!(handle.is_null());
        let said = last_error();
        assert!(said.contains(&key) && said.contains(words), "{key}: {said}");
    }
}

#[test]
fn a_frame_that_is_no_body_stops_the_run_and_names_body_and_step() {
    let folder = Folder::new("flat");
    folder.write("box.obj", &box_obj(0.0));
    let flat: String = box_obj(0.0)
        .lines()
        .map(|l| match l.strip_prefix("v ") {
            Some(p) => format!("v {} 0 0\n", p.split(' ').next().unwrap()),
            None => format!("{l}\n"),
        })
        .collect();
    folder.write("flat.obj", &flat);
    let body = json!({"shape": "mesh", "file": "box.obj", "cell_size": 0.02, "motion":
        {"frames": ["box.obj", "box.obj", "flat.obj"], "rate": 100}});
    let plan = json!({"drape": false, "duration": 0.05, "dt": 0.01});
    let file = folder.write("scene.json", &scene(json!([body]), plan).to_string());
    let output = run(&file, &folder.0.join("out"));
    assert_eq!(output.status.code(), Some(1));
    let said = String::from_utf8_lossy(&output.stderr).into_owned();
    for words in ["step 2 of 5", "body 0", "flat"] {
        assert!(said.contains(words), "{words}: {said}");
    }
}
