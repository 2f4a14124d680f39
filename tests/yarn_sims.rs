//! Patches simulated as yarns alone: what fabrics are known to do, and what hosts rely on.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use toile::body::Body;
use toile::cloth::Cloth;
use toile::math::{Rotation, Vec3};
use toile::pattern::import::garment_from_json;
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions};
use toile::system::contact::spheres::Spheres;
use toile::system::points::Points;
use toile::yarn::{Family, Layout, YarnMaterial, Yarns, lay};

/// A rectangle of a fabric of yarns, every yarn simulated.
pub(crate) fn patch(yarns: &str, width: f64, height: f64, region: &str) -> String {
    format!(
        r#"{{"toile_garment": 1, "name": "patch", "edge_length": {},
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{width}, 0], [{width}, {height}], [0, {height}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "yarns": {yarns}}}],
            "blend_regions": [{{"panel": "p", "polygon": {region}}}]}}"#,
        0.2 * width.max(height)
    )
}

pub(crate) const WHOLE: &str = "[[-1, -1], [1, -1], [1, 1], [-1, 1]]";

pub(crate) fn sim(text: &str, gravity: f64, numbers: &[(&str, f64)]) -> Sim {
    let garment = garment_from_json(text, None).expect("garment");
    let mut settings = Settings::default();
    for (name, value) in numbers {
        settings.set(name, *value).expect("number");
    }
    let options = SimOptions {
        gravity: Some([0.0, gravity, 0.0]),
        settings,
        ..SimOptions::default()
    };
    Sim::new(&garment, &options).expect("sim")
}

pub(crate) fn knit(structure: &str, loops: usize) -> String {
    let w = 0.003;
    let n = loops as f64;
    // the finished size of so many wales and courses
    let (width, height) = ((n + 0.4) * w, (n + 0.5) * 0.85 * w + 0.18 * w);
    let yarns = format!(r#"{{"preset": "jersey", "knit": "{structure}"}}"#);
    patch(&yarns, width, height, WHOLE)
}

/// A plain weave pulled along one family is `N` straight yarns: `F = N k_s eps`.
#[test]
fn a_weave_pulled_along_its_yarns_is_as_stiff_as_they_are() {
    let yarns = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025, "young": 1e7}"#;
    let mut sim = sim(&patch(yarns, 0.01, 0.02, WHOLE), 0.0, &[]);
    let mesh = sim.yarns().expect("yarns").clone();
    let high = mesh.uv.iter().fold(mesh.uv[0], |m, p| m.sup(p));
    let strain = 0.005;
    let at = |y: f64| -> Vec<u32> {
        let list = (0..).zip(&mesh.uv);
        list.filter(|(_, p)| (p.y - y).abs() < 1e-6)
            .map(|p| p.0)
            .collect()
    };
    let (bottom, top) = (at(0.0), at(high.y));
    assert!(bottom.len() >= 9 && top.len() == bottom.len(), "{bottom:?}");
    let targets: Vec<[f64; 3]> = top
        .iter()
        .map(|n| {
            let x = sim.yarn_nodes()[*n as usize];
            [x.x, x.y + strain * high.y, x.z]
        })
        .collect();
    sim.pin_yarn_nodes(&bottom, None).expect("pin");
    sim.pin_yarn_nodes(&top, Some(&targets)).expect("pin");
    let options = DrapeOptions {
        force_tolerance: 1e-7,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    let tensions = sim.yarn_tensions();
    let force: f64 = (0..mesh.incidences.len())
        .filter(|i| bottom.contains(&mesh.incidences[*i].node))
        .map(|i| tensions[i])
        .sum();
    let stiffness = 1e7 * std::f64::consts::PI * 0.00025_f64.powi(2);
    let expected = bottom.len() as f64 * stiffness * strain;
    println!("force {force:.6} N, {expected:.6} N expected");
    assert!((force / expected - 1.0).abs() < 1e-3, "{force} {expected}");
    // vertices of the panel follow the yarns
    let top_vertex = sim.locate(0, [0.005, 0.02]).expect("vertex");
    let y = sim.positions()[top_vertex as usize].y;
    assert!((y - 0.02 * (1.0 + strain)).abs() < 2e-5, "{y}");
    assert!(sim.active_vertices().iter().all(|a| !a));
}

/// Contacts that stick need no unknowns. A weft is pulled out of a patch whose warps are held, with coordinates that are unknowns where
/// contacts slip and with all of them unknown, where friction is a spring `k_f`: the coordinates come out the same within
/// `mu lambda / k_f`. Slip is looked for as a step begins, so that it comes late by a part of what is pulled in one step.
#[test]
fn contacts_that_stick_need_no_unknowns() {
    let pulled = |anchor: f64, sliding: f64, way: f64| {
        let yarns = format!(
            r#"{{"weave": "plain", "warp_pitch": 0.002, "radius": 0.0004, "bending": 0.001, "friction": 0.3,
                "anchor": {anchor}}}"#
        );
        let numbers = [
            ("yarn.sliding", sliding),
            ("yarn.relative_velocity", 1e-6),
            ("solver.newton.velocity_tolerance", 1e-7),
        ];
        let mut sim = sim(&patch(&yarns, 0.012, 0.012, WHOLE), 0.0, &numbers);
        let mesh = sim.yarns().expect("yarns").clone();
        let held: Vec<u32> = (0..mesh.uv.len() as u32)
            .filter(|n| (mesh.uv[*n as usize].y - 0.006).abs() > 0.005)
            .collect();
        sim.pin_yarn_nodes(&held, None).expect("pin");
        let off = |y: &usize| (mesh.uv[mesh.yarn(*y)[0].node as usize].y - 0.006).abs();
        let weft = (0..mesh.yarn_count())
            .filter(|y| mesh.yarn_family[*y] == Family::Weft)
            .min_by(|a, b| off(a).total_cmp(&off(b)))
            .expect("a weft");
        let end = mesh.yarn(weft).last().expect("a node").node;
        let (start, steps) = (sim.yarn_nodes()[end as usize], (8e-4 / way).round() as u32);
        let mut unknowns = 0;
        for k in 1..=steps {
            let x = start + Vec3::x() * (way * f64::from(k));
            sim.pin_yarn_nodes(&[end], Some(&[x.into()])).expect("pin");
            let _ = sim.step(1e-3).expect("step");
            unknowns += sim.info().unknowns;
        }
        let force = sim.yarn_compressions().iter().copied().fold(0.0, f64::max);
        let slip = sim.yarn_slips().iter().map(|s| s.abs()).fold(0.0, f64::max);
        (
            sim.checkpoint().u,
            0.3 * force / anchor,
            slip,
            unknowns as f64 / f64::from(steps),
        )
    };
    for (anchor, way, late) in [(1e3, 2e-6, 0.0), (1e4, 1e-6, 0.0), (1e5, 1e-6, 0.25e-6)] {
        let (some, bound, slip, fewer) = pulled(anchor, 1.0, way);
        let (all, _, _, every) = pulled(anchor, 2.0, way);
        let pairs = some.iter().zip(&all);
        let apart = pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        println!(
            "k_f {anchor} N/m: coordinates apart by {apart:.1e} m, mu lambda / k_f {bound:.1e} m, slip {slip:.1e} m, \
             {fewer:.0} of {every:.0} unknowns"
        );
        assert!(apart < bound + late, "{apart:e} m, {bound:e} m");
        assert!(slip > 3e-4, "{slip:e} m");
        assert!(fewer < 0.7 * every, "{fewer} of {every}");
    }
}

/// What hangs weighs what it is made of.
#[test]
fn a_hung_weave_carries_its_weight() {
    let yarns = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025, "density": 2e-4}"#;
    let mut sim = sim(&patch(yarns, 0.01, 0.015, WHOLE), -9.81, &[]);
    let mesh = sim.yarns().expect("yarns").clone();
    let high = mesh.uv.iter().fold(mesh.uv[0], |m, p| m.sup(p));
    let top: Vec<u32> = (0..)
        .zip(&mesh.uv)
        .filter(|(_, p)| p.y > high.y - 1e-6)
        .map(|p| p.0)
        .collect();
    sim.pin_yarn_nodes(&top, None).expect("pin");
    let options = DrapeOptions {
        force_tolerance: 1e-8,
        max_steps: 0,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    let length: f64 = (0..mesh.yarn_count())
        .map(|y| mesh.yarn(y).last().unwrap().u - mesh.yarn(y)[0].u)
        .sum();
    let held: Vec<usize> = top.iter().map(|n| *n as usize).collect();
    let tensions = sim.yarn_tensions();
    // warp yarns run along v and end at the held rim
    let mut pull = 0.0;
    for y in 0..mesh.yarn_count() {
        let range = mesh.starts[y] as usize..mesh.starts[y + 1] as usize;
        let (first, last) = (range.start, range.end - 1);
        if held.contains(&(mesh.incidences[last].node as usize)) {
            pull += tensions[last - 1];
        } else if held.contains(&(mesh.incidences[first].node as usize)) {
            pull += tensions[first];
        }
    }
    let weight = 2e-4 * 9.81 * length;
    println!("pull {pull:.6e} N, weight {weight:.6e} N");
    // half of the topmost segments hangs on the pins itself
    assert!((pull / weight - 1.0).abs() < 0.05, "{pull} {weight}");
}

/// The same bits for any number of threads, and after a snapshot is restored, sliding included.
#[test]
fn sliding_yarns_have_the_same_bits_however_they_are_run() {
    let text = knit("stockinette", 5);
    let run = |threads: f64| {
        let mut sim = sim(&text, 0.0, &[("solver.threads", threads)]);
        for _ in 0..4 {
            let _ = sim.step(1e-3).expect("step");
        }
        sim
    };
    let (one, two) = (run(1.0), run(2.0));
    assert_eq!(one.yarn_nodes(), two.yarn_nodes());
    assert_eq!(one.yarn_coordinates(), two.yarn_coordinates());
    assert!(one.yarn_slips().iter().any(|s| s.abs() > 1e-9));
    let bytes = one.save().expect("bytes");
    let mut again = sim(&text, 0.0, &[("solver.threads", 1.0)]);
    again.restore(&bytes).expect("restore");
    let mut one = one;
    for _ in 0..3 {
        let _ = one.step(1e-3).expect("step");
        let _ = again.step(1e-3).expect("step");
    }
    assert_eq!(one.yarn_nodes(), again.yarn_nodes());
    assert_eq!(one.yarn_coordinates(), again.yarn_coordinates());
}

/// Cloth that is not of yarns, and nodes and vertices that cannot be held, are refused by name.
#[test]
fn what_cannot_be_simulated_is_refused() {
    let text = patch(r#"{"preset": "jersey"}"#, 0.03, 0.03, WHOLE);
    let mut plain = garment_from_json(&text, None).expect("garment");
    plain.fabrics[0].yarns = None;
    let error = Sim::new(&plain, &SimOptions::default()).err().unwrap();
    assert!(error.message.contains("no yarns"), "{}", error.message);
    let mut sim = sim(&knit("garter", 4), 0.0, &[]);
    let count = sim.yarn_nodes().len() as u32;
    let error = sim.pin_yarn_nodes(&[count], None).err().unwrap();
    assert!(
        error.message.contains("does not exist"),
        "{}",
        error.message
    );
    let error = sim.pin(&[0], None).err().unwrap();
    assert!(
        error.message.contains("follows the yarns"),
        "{}",
        error.message
    );
    let places = vec![[f64::NAN; 3]];
    assert!(sim.pin_yarn_nodes(&[0], Some(&places)).is_err());
}

const BURLAP: &str = r#"{"weave": "plain", "warp_pitch": 0.005, "radius": 0.001}"#;

/// Nodes that sliding has brought near each other along a yarn, or around a crossing, are neighbours, whatever was
/// between them when they were laid: self-contact does not keep them apart.
#[test]
fn nodes_that_yarns_have_slid_together_are_neighbours() {
    let garment = garment_from_json(&patch(BURLAP, 0.04, 0.04, WHOLE), None).unwrap();
    let mesh = lay(&garment, &Layout::default()).unwrap();
    let fabric = garment.fabrics[0].yarns.as_ref().unwrap();
    let yarns = Yarns::laid(mesh, vec![YarnMaterial::from(fabric)]);
    let triangles = toile::tri::triangulate(&garment, 1.0, 1000).unwrap();
    let cloth = Cloth::new(&garment, triangles).unwrap();
    let points = Points::new(&cloth, Some(&yarns));
    let mut spheres = Spheres::new(&cloth, &points, Some(&yarns), 0.15).unwrap();
    let point = |passage: usize| points.vertex_count as u32 + yarns.mesh.incidences[passage].node;
    let [end, second, third] = [0, 2, 3].map(point);
    assert!(!spheres.excluded(end, second));
    let laid: Vec<f64> = yarns.mesh.incidences.iter().map(|i| i.u).collect();
    let mut u = laid.clone();
    (u[1], u[2]) = (5e-4, 2e-3);
    spheres.follow(&u);
    assert!(spheres.excluded(end, second) && spheres.excluded(second, end));
    assert!(!spheres.excluded(end, third));
    // from the next yarn's crossing along the weft, which has slid likewise, and on along the first yarn
    let weft = |p: usize| {
        let node = yarns.mesh.incidences[p].node;
        let other = |s: &&toile::yarn::Strand| s.incidence as usize != p;
        let strand = yarns.mesh.stack(node as usize).iter().find(other);
        strand.unwrap().incidence as usize
    };
    let beside = weft(2) + 1;
    assert!(!spheres.excluded(end, point(beside)));
    u[beside] = u[weft(2)] + 1e-3;
    spheres.follow(&u);
    assert!(spheres.excluded(end, point(beside)));
    spheres.follow(&laid);
    assert!(!spheres.excluded(end, second));
}

/// A loose weave that falls onto a drum comes to rest over it, with self-contact, and no yarn leaves the cloth.
#[test]
fn a_loose_weave_falls_onto_a_drum() {
    let rough = [("solver.newton.relative_tolerance", 1e-2)];
    let mut sim = sim(&patch(BURLAP, 0.04, 0.04, WHOLE), 0.0, &rough);
    sim.set_number("gravity.z", -9.81).unwrap();
    let body = Body::capsule(0.1, 0.02).unwrap();
    let body = sim.add_body(&body, &ContactSettings::default()).unwrap();
    let lying = Rotation::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
    let q = lying.quaternion();
    sim.set_body_pose(body, [0.02, 0.02, -0.024], [q.i, q.j, q.k, q.w])
        .unwrap();
    let mut last = f64::INFINITY;
    for _ in 0..30 {
        last = sim.step(0.01).expect("step").kinetic_energy;
    }
    println!("kinetic energy {last:.1e} J at the end");
    assert!(last < 1e-8, "{last}");
    assert_eq!(sim.yarn_changes().passages_gone, 0);
    assert!(sim.yarn_slips().iter().all(|s| s.abs() < 1e-3));
}

/// A point cannot be at two places: two targets for one are refused and hold nothing, the same one twice is taken.
#[test]
fn two_targets_for_one_node_are_refused() {
    let mut sim = sim(
        &patch(r#"{"preset": "jersey"}"#, 0.02, 0.018, WHOLE),
        0.0,
        &[],
    );
    let node = sim.yarn_end(0, 0).unwrap();
    let other = sim.yarn_end(0, 1).unwrap();
    let at = |x: f64| [x, 0.0, 0.0];
    let refused = sim.pin_yarn_nodes(&[node, other, node], Some(&[at(0.0), at(1.0), at(0.001)]));
    let message = refused.unwrap_err().message;
    assert!(message.contains("two targets"), "{message}");
    assert!(message.contains(&format!("yarn node {node}")), "{message}");
    assert!(!sim.is_pinned(sim.point_of_node(node)));
    sim.pin_yarn_nodes(&[node, node], Some(&[at(0.0); 2]))
        .unwrap();
    assert!(sim.is_pinned(sim.point_of_node(node)));
}

/// Hybrid rings of triangles finer than the yarns join nothing, and what was built says so.
#[test]
fn rings_that_join_no_vertex_are_told() {
    let region = "[[0.008, 0.008], [0.016, 0.008], [0.016, 0.016], [0.008, 0.016]]";
    let notes = |edge: f64, rings: u32| {
        let weave = r#"{"weave": "plain", "warp_pitch": 0.002, "radius": 0.0005}"#;
        let text = patch(weave, 0.024, 0.024, region)
            .replace(&format!("{}", 0.2 * 0.024), &format!("{edge}"))
            .replace(r#""polygon""#, &format!(r#""rings": {rings}, "polygon""#));
        sim(&text, 0.0, &[]).info().notes
    };
    let told = notes(0.001, 1);
    assert!(
        told.iter().any(|n| n.contains("join no vertex")),
        "{told:?}"
    );
    for (edge, rings) in [(0.001, 0), (0.004, 1)] {
        let told = notes(edge, rings);
        assert!(
            !told.iter().any(|n| n.contains("rings")),
            "{edge} {rings}: {told:?}"
        );
    }
}
