//! Scene files: the reader and its table agree, every refusal names its place, no bytes do harm.

use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use toile::scene::{PinPlace, Scene, schema};

/// A folder of its own for each test, removed at the end.
struct Folder(PathBuf);

impl Folder {
    fn new(name: &str) -> Self {
        let path = std::env::temp_dir().join(format!("toile-{}-{name}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    fn write(&self, name: &str, text: &str) {
        std::fs::write(self.0.join(name), text).unwrap();
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

const TETRAHEDRON: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\n\
    f 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n";

fn square() -> Value {
    json!({
        "toile_garment": 1,
        "name": "square",
        "panels": [{
            "name": "square",
            "vertices": [[0, 0], [1, 0], [1, 1], [0, 1]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]
        }]
    })
}

/// A scene with every key of the tables.
fn full(folder: &Folder) -> Value {
    folder.write("square.json", &square().to_string());
    folder.write("body.obj", TETRAHEDRON);
    folder.write("frame.obj", TETRAHEDRON);
    folder.write("start.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\n");
    folder.write("cloth.json", r#"{"density": 0.3}"#);
    let pose = json!({"position": [0, 1, 0], "quaternion_xyzw": [0, 0, 0, 1]});
    json!({
        "toile": 1,
        "name": "everything",
        "about": "every key once",
        "garment": {"file": "square.json"},
        "edge_length": 0.25,
        "fabrics": {"*": {"file": "cloth.json"}, "square": {"density": 0.1}},
        "gravity": [0, -1.6, 0],
        "wind": [1, 0, 0],
        "pressure": 0.5,
        "numbers": {"solver.newton.max_iterations": 40, "air.drag": 1},
        "bodies": [
            {"name": "ball", "shape": "sphere", "radius": 0.2, "pose": pose,
             "contact": {"friction": 0.5, "thickness": 0.002, "stiffness": 1e6}},
            {"shape": "capsule", "radius": 0.1, "half_length": 0.3,
             "pose": {"rotation_deg": [0, 0, 90]}},
            {"shape": "plane", "normal": [0, 1, 0], "offset": -1,
             "motion": {"keyframes": [
                {"time": 0, "position": [0, 0, 0], "rotation_deg": [0, 0, 0]},
                {"time": 1, "position": [0, 1, 0], "quaternion_xyzw": [0, 0, 0, 2]}]}},
            {"shape": "grid", "counts": [2, 2, 2], "origin": [0, 0, 0], "cell_size": 0.5,
             "values": [0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8]},
            {"shape": "mesh", "file": "body.obj", "scale": 0.1, "cell_size": 0.02,
             "motion": {"frames": ["frame.obj", "frame.obj"], "rate": 30, "repeat": true}}
        ],
        "pins": [
            {"panel": "square", "uv": [0, 1], "target": [0, 1, 0], "until": 2.5},
            {"panel": 0, "edge": 2, "motion": [{"time": 0, "offset": [0, 0, 0]},
                                               {"time": 1, "offset": [0, 0, 0.1]}]},
            {"yarn": 3, "end": "last"}
        ],
        "probes": [{"name": "corner", "panel": "square", "uv": [1, 1]},
                   {"name": "hem", "panel": 0, "edge": 1}],
        "initial": {"file": "start.obj", "velocity": [0, 0, 1]},
        "run": {"drape": false, "duration": 1, "dt": 0.01, "frame_every": 5}
    })
}

/// Table path of a place in the document: list indices become `[]`, fabric names `<panel>`.
fn table_path(path: &[String]) -> String {
    let mut out = String::new();
    for (i, part) in path.iter().enumerate() {
        if part.starts_with('[') {
            out.push_str("[]");
        } else if i == 1 && path[0] == "fabrics" {
            out.push_str(".<panel>");
        } else {
            if !out.is_empty() {
                out.push('.');
            }
            out.push_str(part);
        }
    }
    out
}

/// Calls `f` with the path of every value below the root.
fn walk(value: &Value, path: &mut Vec<String>, f: &mut dyn FnMut(&[String])) {
    let mut visit = |key: String, child: &Value, path: &mut Vec<String>| {
        path.push(key);
        f(path);
        walk(child, path, f);
        path.pop();
    };
    match value {
        Value::Object(map) => map.iter().for_each(|(k, v)| visit(k.clone(), v, path)),
        Value::Array(items) => {
            for (i, v) in items.iter().enumerate() {
                visit(format!("[{i}]"), v, path);
            }
        }
        _ => {}
    }
}

fn at<'a>(value: &'a mut Value, path: &[String]) -> &'a mut Value {
    path.iter().fold(value, |v, part| {
        match part.strip_prefix('[').and_then(|p| p.strip_suffix(']')) {
            Some(index) => &mut v[index.parse::<usize>().unwrap()],
            None => &mut v[part.as_str()],
        }
    })
}

/// A path as errors show it.
fn shown(path: &[String]) -> String {
    path.iter().fold(String::new(), |s, p| {
        if s.is_empty() || p.starts_with('[') {
            s + p
        } else {
            s + "." + p
        }
    })
}

#[test]
fn the_reader_reads_exactly_the_keys_of_the_table() {
    let folder = Folder::new("table");
    let scene = full(&folder);
    let (read, problems) = Scene::read_all(&scene.to_string(), Some(&folder.0));
    assert!(problems.is_empty(), "{problems:?}");
    assert_eq!(read.unwrap().bodies.len(), 5);

    let mut places: Vec<Vec<String>> = Vec::new();
    walk(&scene, &mut Vec::new(), &mut |p| places.push(p.to_vec()));
    // a snapshot excludes the other keys of `initial`
    let elsewhere = ["initial.snapshot"];
    for (table, keys) in schema::TABLES {
        for key in *keys {
            let wanted = if table.is_empty() {
                key.name.to_owned()
            } else {
                format!("{table}.{}", key.name)
            };
            if elsewhere.contains(&wanted.as_str()) {
                continue;
            }
            let place = places
                .iter()
                .find(|p| table_path(p) == wanted)
                .unwrap_or_else(|| panic!("{wanted}: the full scene does not have it"));
            if wanted == "about" {
                continue;
            }
            // a value of a kind that no key takes must be refused at its place
            let mut broken = scene.clone();
            let old = at(&mut broken, place);
            *old = if old.is_array() {
                json!(true)
            } else {
                json!([[[]]])
            };
            let (_, problems) = Scene::read_all(&broken.to_string(), Some(&folder.0));
            let text = problems
                .iter()
                .map(|e| e.message.as_str())
                .collect::<Vec<_>>()
                .join("\n");
            assert!(text.contains(&shown(place)), "{}: {text:?}", shown(place));
        }
    }
    // an unknown key is refused in every object
    places.push(Vec::new());
    for place in &places {
        let mut broken = scene.clone();
        let Some(map) = at(&mut broken, place).as_object_mut() else {
            continue;
        };
        map.insert("zzz".into(), json!(1));
        let (_, problems) = Scene::read_all(&broken.to_string(), Some(&folder.0));
        assert!(
            problems.iter().any(|e| e.message.contains("zzz")),
            "{}: {problems:?}",
            shown(place)
        );
    }
}

#[test]
fn a_scene_holds_what_the_file_says() {
    let folder = Folder::new("values");
    let scene = Scene::from_json(&full(&folder).to_string(), Some(&folder.0)).unwrap();
    assert_eq!(scene.name, "everything");
    assert_eq!(scene.gravity, [0.0, -1.6, 0.0]);
    assert_eq!(scene.wind, [1.0, 0.0, 0.0]);
    assert_eq!(scene.settings.newton_max_iterations, 40.0);
    assert_eq!(scene.garment.edge_length, 0.25);
    assert_eq!(scene.bodies[0].name, "ball");
    assert_eq!(scene.bodies[0].contact.friction, 0.5);
    assert_eq!(scene.bodies[0].motion.pose(7.0).position.y, 1.0);
    assert!((scene.bodies[2].motion.pose(0.5).position.y - 0.5).abs() < 1e-12);
    assert_eq!(scene.bodies[1].name, "body 1");
    assert_eq!(scene.bodies[4].motion.frames[1][1], [0.1, 0.0, 0.0]);
    assert_eq!(scene.pins[0].place, PinPlace::Point([0.0, 1.0]));
    assert_eq!(scene.pins[0].until, Some(2.5));
    assert_eq!(scene.pins[1].place, PinPlace::Edge(2));
    assert_eq!(scene.probes[0].place, PinPlace::Point([1.0, 1.0]));
    assert_eq!(scene.probes[1].name, "hem");
    assert_eq!(scene.initial.positions.as_ref().map(Vec::len), Some(3));
    assert_eq!(scene.initial.velocity, [0.0, 0.0, 1.0]);
    assert_eq!(scene.run.steps(), 100);
    // "*" is put on before the panel's own
    let fabric = &scene.garment.fabrics[scene.garment.panels[0].fabric];
    assert_eq!(fabric.density, 0.1);
}

#[test]
fn every_problem_of_a_garment_is_listed() {
    let garment = json!({
        "toile_garment": 1,
        "edge_length": "fine",
        "fabrics": [{"name": "lawn", "density": -1.0}, {"name": "twill", "thick": 2}],
        "panels": [
            {"name": "front", "fabric": "twill", "vertices": [[0, 0], [1, 0], [0]], "edges": [[0, 1]]},
            {"name": "back", "vertices": [[0, 0], [1, 0], [1, 1]], "edges": [[0, 1], [1, 7], [2, 0]]},
        ],
        "seams": [
            {"a": ["front", 0], "b": ["back", 0]},
            {"a": ["front", 0], "b": ["sleeve", 0]},
        ],
        "blend_regions": [{"panel": "collar", "polygon": []}],
        "colour": "red",
    });
    let places = [
        ("edge_length", "fine"),
        ("fabrics[0]", "-1"),
        ("fabrics[1]", "thick"),
        ("panels[0].vertices[2]", "2"),
        ("panels[1].edges[1][1]", "corner 7 of 3"),
        ("seams[1].b[0]", "sleeve"),
        ("blend_regions[0].panel", "collar"),
        ("", "colour"),
    ];
    let scene = json!({"toile": 1, "garment": garment});
    for (text, at) in [(garment.to_string(), ""), (scene.to_string(), "garment.")] {
        let (read, problems) = Scene::read_all(&text, None);
        assert!(read.is_none());
        for (place, words) in places {
            let place = format!("{at}{place}");
            let named = |e: &&toile::error::Error| {
                e.message.contains(place.trim_end_matches('.')) && e.message.contains(words)
            };
            assert!(problems.iter().any(|e| named(&e)), "{place}: {problems:#?}");
        }
        assert_eq!(problems.len(), places.len(), "{problems:#?}");
    }
}

#[test]
fn every_problem_is_listed_with_its_place_and_value() {
    let folder = Folder::new("problems");
    let mut scene = full(&folder);
    scene["toile"] = json!(7);
    scene["bodies"][0]["radius"] = json!(-2);
    scene["bodies"][4]["file"] = json!("gone.obj");
    scene["bodies"][1]["offset"] = json!(0.1);
    scene["pins"][0]["panel"] = json!("sleeve");
    scene["pins"][1]["edge"] = json!(99);
    scene["run"]["dt"] = json!(0);
    scene["numbers"]["solver.newton.max_iterations"] = json!(-1);
    scene["fabrics"]["collar"] = json!({"density": 0.1});
    scene["bodies"][2]["motion"]["keyframes"][1]["time"] = json!(0);
    let (_, problems) = Scene::read_all(&scene.to_string(), Some(&folder.0));
    let text = problems
        .iter()
        .map(|e| e.message.clone())
        .collect::<Vec<_>>()
        .join("\n");
    for words in [
        &["toile: ", "version 7"][..],
        &["bodies[0]", "-2"],
        &["bodies[4].file", "gone.obj"],
        &["bodies[1].offset", "capsule"],
        &["pins[0].panel", "sleeve"],
        &["pins[1].edge", "99"],
        &["run.dt", "0"],
        &["numbers.solver.newton.max_iterations", "-1"],
        &["fabrics.collar", "square"],
        &["bodies[2].motion.keyframes[1]", "after"],
    ] {
        assert!(
            text.lines().any(|l| words.iter().all(|w| l.contains(w))),
            "{words:?} not in\n{text}"
        );
    }
    assert_eq!(problems.len(), 10, "{text}");
}

#[test]
fn a_bare_garment_is_a_scene_without_bodies() {
    let scene = Scene::from_json(&square().to_string(), None).unwrap();
    assert_eq!(scene.garment.panels.len(), 1);
    assert!(scene.bodies.is_empty() && scene.run.drape);
    let text = Scene::from_json("{}", None).unwrap_err().message;
    assert!(text.contains("toile"), "{text}");
}

/// xorshift64*, so that failures repeat.
struct Random(u64);

impl Random {
    fn below(&mut self, n: usize) -> usize {
        self.0 ^= self.0 >> 12;
        self.0 ^= self.0 << 25;
        self.0 ^= self.0 >> 27;
        ((self.0.wrapping_mul(0x2545_f491_4f6c_dd1d) >> 33) as usize) % n.max(1)
    }
}

/// One mutation of a document: bytes cut, flipped, doubled; values replaced, removed, moved.
fn mutate(text: &str, value: &Value, places: &[Vec<String>], random: &mut Random) -> Vec<u8> {
    let odd = [
        json!(null),
        json!(-1),
        json!(1e308),
        json!(-0.0),
        json!(1e-320),
        json!(4294967296_u64),
        json!(""),
        json!("\u{0}"),
        json!("\u{202e}"),
        json!([]),
        json!({}),
        json!([[]]),
        json!(true),
        json!([0, 0, 0]),
        json!("../../../../etc/hostname"),
        json!(2147483648_u64),
        json!([1e200, 1e200, 1e200, 1e200]),
    ];
    match random.below(6) {
        0 => text.as_bytes()[..random.below(text.len())].to_vec(),
        1 => {
            let mut bytes = text.as_bytes().to_vec();
            for _ in 0..=random.below(4) {
                let i = random.below(bytes.len());
                bytes[i] = random.below(256) as u8;
            }
            bytes
        }
        2 => {
            let (a, b) = (random.below(text.len()), random.below(text.len()));
            let mut bytes = text.as_bytes().to_vec();
            let piece = bytes[a.min(b)..a.max(b)].to_vec();
            let at = random.below(bytes.len());
            bytes.splice(at..at, piece);
            bytes
        }
        kind => {
            let mut value = value.clone();
            for _ in 0..=random.below(3) {
                let place = &places[random.below(places.len())];
                // an earlier mutation may have removed the place
                let mut node = Some(&mut value);
                for part in place {
                    node = node.and_then(|n| {
                        match part.strip_prefix('[').and_then(|p| p.strip_suffix(']')) {
                            Some(i) => n.get_mut(i.parse::<usize>().unwrap()),
                            None => n.get_mut(part.as_str()),
                        }
                    });
                }
                if let Some(node) = node {
                    *node = match (kind, node.as_f64()) {
                        (3, Some(x)) => json!(x * [-1.0, 1e-9, 1e9, 0.0][random.below(4)]),
                        _ => odd[random.below(odd.len())].clone(),
                    };
                }
            }
            value.to_string().into_bytes()
        }
    }
}

#[test]
fn ten_thousand_broken_scenes_give_a_text_and_no_panic() {
    let folder = Folder::new("mutated");
    let mut scene = full(&folder);
    // bodies whose field takes long stay out; the sphere stays so that bodies are read
    scene["bodies"].as_array_mut().unwrap().truncate(4);
    scene["garment"] = square();
    let text = scene.to_string();
    let mut places = Vec::new();
    walk(&scene, &mut Vec::new(), &mut |p| places.push(p.to_vec()));
    let mut random = Random(0x5eed_0001);
    let (mut refused, mut read) = (0, 0);
    for round in 0..10_000 {
        let bytes = mutate(&text, &scene, &places, &mut random);
        let broken = String::from_utf8_lossy(&bytes);
        let base: &Path = &folder.0;
        let (scene, problems) = Scene::read_all(&broken, Some(base));
        match problems.first() {
            None => {
                read += 1;
                assert!(scene.is_some(), "round {round}: neither scene nor problem");
            }
            Some(_) => {
                refused += 1;
                for e in &problems {
                    assert!(!e.message.is_empty(), "round {round}");
                    assert!(e.status as i32 != -100, "round {round}: {e}");
                }
            }
        }
    }
    println!("{refused} refused, {read} still scenes");
    assert!(refused > 5_000 && read > 100, "{refused} {read}");
}

#[test]
fn the_last_step_takes_what_is_left_of_a_duration() {
    let plan = |duration, dt| toile::scene::RunPlan {
        duration,
        dt,
        ..toile::scene::RunPlan::default()
    };
    for (duration, dt, steps) in [
        (0.05, 1.0, 1),
        (0.05, 0.03, 2),
        (0.3, 0.01, 30),
        (1.0, 1.0 / 60.0, 60),
        (0.0, 0.01, 0),
        (0.7, 0.1, 7),
    ] {
        let plan = plan(duration, dt);
        assert_eq!(plan.steps(), steps, "{duration} {dt}");
        assert!((plan.time_after(steps) - duration).abs() <= 1e-15 * steps as f64);
        for k in 1..steps {
            assert_eq!(plan.time_after(k), k as f64 * dt);
        }
    }
}

#[test]
fn a_pin_far_beside_its_panel_is_refused() {
    let scene = |uv: Value| {
        json!({"toile": 1, "garment": square(), "edge_length": 0.3,
            "pins": [{"panel": 0, "uv": uv}]})
    };
    let read = |uv: Value| Scene::read_all(&scene(uv).to_string(), None).1;
    assert!(read(json!([-0.1, 1.2])).is_empty());
    for uv in [json!([50, 50]), json!([0.5, -2.0])] {
        let problems = read(uv);
        assert_eq!(problems.len(), 1, "{problems:#?}");
        let text = &problems[0].message;
        assert!(
            text.contains("pins[0].uv") && text.contains("'square'"),
            "{text}"
        );
    }
}
