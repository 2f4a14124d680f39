//! Regions of yarns that come, move and go while a simulation lives.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::mixed_hard::{garment, make, weave};
use crate::sheets::Random;
use crate::yarn_sims::{WHOLE, knit, sim};
use std::collections::BTreeMap;
use toile::body::Body;
use toile::error::Status;
use toile::math::{Vec2, Vec3};
use toile::pattern::import::garment_from_json;
use toile::pattern::{BlendRegion, Shape};
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Sim, SimOptions};

const LONG: f64 = 0.06;
const WIDE: f64 = 0.016;

/// A strip of a weave, one yarn to a millimetre, and of triangles like it, held at one end.
fn strip(gravity: f64) -> Sim {
    strip_with(gravity, Vec::new())
}

/// The same with regions from the start.
fn strip_with(gravity: f64, regions: Vec<BlendRegion>) -> Sim {
    let text = format!(
        r#"{{"toile_garment": 1, "name": "strip", "edge_length": 4e-3,
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{LONG}, 0], [{LONG}, {WIDE}], [0, {WIDE}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "density": 0.3,
                "membrane": {{"warp": 1963.5, "weft": 1963.5, "shear": 40, "coupling": 0}},
                "bending": {{"warp": 9.2e-6, "weft": 9.2e-6}},
                "yarns": {{"weave": "plain", "warp_pitch": 1e-3, "radius": 0.25e-3,
                    "young": 1e7, "shear": 1.6e5, "density": 1.5e-4, "bending": 4.69e-2}}}}]}}"#
    );
    let mut garment = garment_from_json(&text, None).expect("garment");
    garment.blend_regions = regions;
    let options = SimOptions {
        gravity: Some([0.0, 0.0, gravity]),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("sim");
    hold(&mut sim, 0.0, Vec3::zeros());
    sim
}

/// Holds the end of the strip at `u`, moved on.
fn hold(sim: &mut Sim, u: f64, by: Vec3) {
    let held: Vec<u32> = (0..sim.positions().len() as u32)
        .filter(|v| (sim.vertex_uv()[*v as usize].x - u).abs() < 1e-9)
        .collect();
    let place = |v: &u32| (sim.positions()[*v as usize] + by).into();
    let targets: Vec<[f64; 3]> = held.iter().map(place).collect();
    sim.pin(&held, Some(&targets)).expect("pin");
}

/// The strip between two places along it.
fn between(from: f64, to: f64, rings: u32) -> Vec<BlendRegion> {
    let corners = [[from, -1.0], [to, -1.0], [to, 1.0], [from, 1.0]];
    vec![BlendRegion {
        panel: 0,
        shape: Shape::Polygon(corners.map(Vec2::from).to_vec()),
        rings,
    }]
}

/// Mass and momentum.
fn motion(sim: &Sim) -> (f64, Vec3) {
    let (masses, state) = (sim.point_masses(), sim.checkpoint());
    let momentum = state.velocities.iter().zip(&masses).map(|(v, m)| v * *m);
    (masses.iter().sum(), momentum.sum())
}

/// Kinetic and elastic energy.
fn energies(sim: &Sim) -> [f64; 2] {
    let e = sim.energies().expect("energies");
    [e.kinetic, e.membrane + e.bending + e.yarn]
}

/// Places, velocities and coordinates of nodes that move by themselves, by flat place.
fn nodes(sim: &Sim) -> BTreeMap<[u64; 2], Vec<u64>> {
    let (Some(mesh), state) = (sim.yarns(), sim.checkpoint()) else {
        return BTreeMap::new();
    };
    let first = sim.positions().len();
    let blended = sim.info().hybrid_nodes > 0;
    let active = sim.active_yarn_nodes();
    (0..mesh.uv.len())
        .filter(|n| active[*n] && (!blended || mesh.is_whole(*n as u32)))
        .map(|n| {
            let points = [state.positions[first + n], state.velocities[first + n]];
            let stack = mesh.stack(n).iter().enumerate();
            let strands = stack.flat_map(|(k, s)| {
                let strand = state.strands[mesh.stack_starts[n] as usize + k];
                let u = state.u[s.incidence as usize];
                [u, strand.anchor, strand.contact]
            });
            let all = points.iter().flat_map(|p| p.iter().copied()).chain(strands);
            let uv = [mesh.uv[n].x, mesh.uv[n].y].map(f64::to_bits);
            (uv, all.map(f64::to_bits).collect())
        })
        .collect()
}

fn steps(sim: &mut Sim, count: usize, most: u64) {
    for k in 0..count {
        let report = sim.step(2e-3).expect("step");
        assert_eq!(report.outcome, Outcome::Converged, "step {k}: {report:?}");
        assert!(report.newton_iterations <= most, "step {k}: {report:?}");
    }
}

/// A change of regions after which every vertex, and every node that was there and moves by itself, is where it was, with its
/// velocity; what it says of masses is so.
fn change(sim: &mut Sim, regions: Vec<BlendRegion>, what: &str) {
    let (epoch, time) = ((sim.epoch(), sim.yarn_epoch()), sim.time());
    let (x, v, before) = (
        sim.positions().to_vec(),
        sim.velocities().to_vec(),
        nodes(sim),
    );
    let ((m0, p0), e0) = (motion(sim), energies(sim));
    let done = sim.set_blend_regions(regions).expect(what);
    let ((m1, p1), e1) = (motion(sim), energies(sim));
    println!(
        "{what}: {done:?}; mass {:+.2e}, momentum {:.2e} beside it; kinetic {:+.2e}, elastic {:.3e} J from {:.3e} J",
        m1 / m0 - 1.0,
        (p1 / m1 - p0 / m0).norm() / (p0 / m0).norm(),
        e1[0] / e0[0] - 1.0,
        e1[1],
        e0[1],
    );
    assert_eq!(
        (sim.positions(), sim.velocities()),
        (&x[..], &v[..]),
        "{what}"
    );
    assert!(sim.constraint_violation() < 1e-12, "{what}");
    let after = nodes(sim);
    let same = after.iter().filter(|(uv, _)| before.contains_key(*uv));
    for (uv, node) in same {
        assert_eq!(node, &before[uv], "{what}");
    }
    assert!(sim.epoch() > epoch.0 && sim.yarn_epoch() > epoch.1);
    assert!((sim.time() - time).abs() == 0.0);
    assert_eq!(done.laid + done.kept, sim.yarn_nodes().len());
    assert!(
        ((done.masses[0] - m0) / m0).abs() < 1e-15 && ((done.masses[1] - m1) / m1).abs() < 1e-15
    );
    // yarns do not weigh exactly what triangles do
    assert!((m1 / m0 - 1.0).abs() < 5e-3, "{what}");
    assert!(
        (p1 - p0).norm() < 1e-2 * (2.0 * m0 * e0[0]).sqrt(),
        "{what}"
    );
    assert!((e1[0] / e0[0] - 1.0).abs() < 2e-2, "{what}");
    assert!(e1[1] < 4.0 * e0[1], "{what}");
}

/// A strip swings while yarns come into its middle, move on by a half of their length, and go: no step finds it hard.
#[test]
fn yarns_come_move_and_go_in_a_strip_that_swings() {
    for rings in [0, 1] {
        let mut sim = strip(-9.81);
        steps(&mut sim, 40, 8);
        change(&mut sim, between(0.0199, 0.0401, rings), "on");
        steps(&mut sim, 8, 6);
        change(&mut sim, between(0.0239, 0.0501, rings), "moved");
        steps(&mut sim, 8, 6);
        change(&mut sim, Vec::new(), "off");
        assert!(sim.yarns().is_none() && sim.yarn_nodes().is_empty());
        steps(&mut sim, 8, 6);
    }
}

/// A cloth that moves as one goes on so, with all of its momentum but for the mass that has come or gone.
#[test]
fn a_rigid_motion_goes_over_exactly() {
    for rings in [0, 2] {
        let mut sim = strip(0.0);
        let turn = toile::math::Rotation::from_euler_angles(0.3, -0.5, 1.1);
        let (rate, way) = (Vec3::new(0.7, -2.0, 3.0), Vec3::new(0.2, 0.1, -0.4));
        let x: Vec<Vec3> = sim.positions().iter().map(|p| turn * p + way).collect();
        let v: Vec<[f64; 3]> = x.iter().map(|p| (way + rate.cross(p)).into()).collect();
        let places: Vec<[f64; 3]> = x.iter().map(|p| (*p).into()).collect();
        sim.set_positions(&places, Some(&v)).expect("positions");
        let exact = |sim: &Sim| {
            let state = sim.checkpoint();
            let pairs = state.positions.iter().zip(&state.velocities);
            let off = pairs.map(|(x, v)| (v - way - rate.cross(x)).norm());
            let masses = sim.point_masses();
            let mass: f64 = masses.iter().sum();
            let of = state.positions.iter().zip(&masses).map(|(x, m)| x * *m);
            let center = of.sum::<Vec3>() / mass;
            // the velocity of the centre of mass
            let whole = (motion(sim).1 / mass - way - rate.cross(&center)).norm();
            (off.fold(0.0, f64::max), whole)
        };
        for (k, regions) in [
            between(0.0199, 0.0401, rings),
            between(-1.0, 0.031, 0),
            Vec::new(),
        ]
        .into_iter()
        .enumerate()
        {
            let free: Vec<u32> = (0..sim.positions().len() as u32)
                .filter(|v| sim.is_pinned(*v))
                .collect();
            if k == 1 {
                sim.unpin(&free).expect("unpin");
            }
            sim.set_blend_regions(regions).expect("change");
            let (off, whole) = exact(&sim);
            println!("{rings} rings, change {k}: off by {off:.1e}, as a whole by {whole:.1e} m/s");
            assert!(off < 1e-13 && whole < 1e-13, "{off} {whole}");
        }
    }
}

/// The same triangles as another polygon, or the same again: the state keeps its bits, and goes on as one that nobody
/// touched. Woven and knitted, joined either way, half unravelled.
#[test]
fn the_same_region_again_changes_no_bit() {
    let swinging = |rings| {
        let mut sim = strip(-9.81);
        sim.set_blend_regions(between(0.0199, 0.0401, rings))
            .expect("on");
        steps(&mut sim, 20, 8);
        sim
    };
    let unravelling = || {
        let garter = knit("garter", 5).replace("\"knit\"", "\"fastened\": false, \"knit\"");
        let mut sim = sim(&garter, 0.0, &[("solver.newton.relative_tolerance", 1e-3)]);
        let uv = sim.yarns().unwrap().uv.clone();
        let low = uv.iter().fold(f64::MAX, |m, p| m.min(p.y));
        let list = (0..).zip(&uv).filter(|(_, p)| p.y < low + 1.2e-3);
        let held: Vec<u32> = list.map(|p| p.0).collect();
        sim.pin_yarn_nodes(&held, None).unwrap();
        for _ in 0..50 {
            unravel(&mut sim);
        }
        assert!(sim.yarn_changes().nodes_split >= 8);
        sim
    };
    let whole = between(-2.0, 2.0, 0);
    let cases: [Case; 4] = [
        ("direct", &|| swinging(0), between(0.0195, 0.0405, 0)),
        ("rings", &|| swinging(1), between(0.0195, 0.0405, 1)),
        ("triangles", &|| strip(-9.81), Vec::new()),
        ("unravelled", &unravelling, whole),
    ];
    for (what, start, regions) in cases {
        let (mut one, mut two) = (start(), start());
        assert_eq!(one.checkpoint(), two.checkpoint(), "{what}");
        let slid = one.yarn_slips().iter().fold(0.0_f64, |m, s| m.max(s.abs()));
        let done = one.set_blend_regions(regions).expect(what);
        println!("{what}: {done:?}, slid by {slid:.1e} m");
        assert_eq!((done.laid, done.gone), (0, 0), "{what}");
        assert_eq!(done.masses[0].to_bits(), done.masses[1].to_bits());
        assert_eq!(one.checkpoint(), two.checkpoint(), "{what}");
        for _ in 0..4 {
            for sim in [&mut one, &mut two] {
                if what == "unravelled" {
                    unravel(sim);
                } else {
                    let _ = sim.step(2e-3).expect("step");
                }
            }
            assert_eq!(one.checkpoint(), two.checkpoint(), "{what}");
        }
    }
}

/// What it is, the simulation, and its region in other words.
type Case<'a> = (&'a str, &'a dyn Fn() -> Sim, Vec<BlendRegion>);

fn unravel(sim: &mut Sim) {
    let end = sim.yarn_end(0, 1).unwrap();
    let target = sim.yarn_nodes()[end as usize] + Vec3::new(1e-4, 2e-4, 0.0);
    sim.pin_yarn_nodes(&[end], Some(&[target.into()])).unwrap();
    let _ = sim.step(1e-3).expect("step");
}

fn rest(sim: &mut Sim) {
    let options = DrapeOptions {
        force_tolerance: 1e-8,
        max_steps: 4000,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
}

/// Yarns that come into cloth at rest find the rest that they have when they were there from the start; and so do
/// triangles, when the yarns go. Where yarns slide they remember how they came there by their friction.
#[test]
fn the_rest_is_that_of_yarns_that_were_there_from_the_start() {
    let farthest_vertex = |a: &Sim, b: &Sim| {
        let pairs = a.positions().iter().zip(b.positions());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    let farthest = |a: &Sim, b: &Sim| {
        let pairs = a.points().iter().zip(b.points());
        pairs.map(|(a, b)| (a - b).norm()).fold(0.0, f64::max)
    };
    for (rings, slides, most) in [(0, false, 1e-6), (1, false, 1e-6), (0, true, 5e-4)] {
        let start = |regions| {
            let mut sim = strip_with(-9.81, regions);
            // where yarns keep the coordinates that they were laid with there is one rest
            sim.set_number("yarn.sliding", f64::from(u8::from(slides)))
                .expect("number");
            let sag = |u: f64| -0.017 * (std::f64::consts::PI * u / LONG).sin();
            let places: Vec<[f64; 3]> = (sim.vertex_uv().iter())
                .map(|p| [0.8 * p.x, p.y, sag(p.x)])
                .collect();
            sim.set_positions(&places, None).expect("positions");
            hold(&mut sim, LONG, Vec3::zeros());
            sim
        };
        let region = || between(0.0199, 0.0401, rings);
        let mut triangles = start(Vec::new());
        rest(&mut triangles);
        let mut from_start = start(region());
        rest(&mut from_start);
        let mut sim = start(Vec::new());
        rest(&mut sim);
        sim.set_blend_regions(region()).expect("on");
        rest(&mut sim);
        let with = farthest(&sim, &from_start);
        let apart = farthest_vertex(&sim, &triangles);
        sim.set_blend_regions(Vec::new()).expect("off");
        rest(&mut sim);
        let without = farthest(&sim, &triangles);
        println!(
            "{rings} rings, slides {slides}: {with:.2e} m with yarns, {without:.2e} m without; {apart:.2e} m between the two"
        );
        assert!(with < most && without < 1e-6 && apart > 10.0 * with);
    }
}

/// A strip that is pushed together buckles and folds onto itself; yarns come in there as well.
#[test]
fn yarns_come_into_folded_cloth() {
    for rings in [0, 1] {
        let mut sim = strip(-1.0);
        let places: Vec<[f64; 3]> = sim
            .vertex_uv()
            .iter()
            .map(|p| [p.x, p.y, 1e-3 * (100.0 * p.x).sin()])
            .collect();
        sim.set_positions(&places, None).expect("positions");
        hold(&mut sim, 0.0, Vec3::zeros());
        for _ in 0..100 {
            hold(&mut sim, LONG, Vec3::new(-2e-4, 0.0, 0.0));
            let _ = sim.step(2e-3).expect("step");
        }
        steps(&mut sim, 50, 30);
        let low = |sim: &Sim| sim.positions().iter().fold(0.0_f64, |m, p| m.min(p.z));
        println!("lowest {:.4}", low(&sim));
        change(&mut sim, between(0.0079, 0.0521, rings), "folded");
        steps(&mut sim, 30, 20);
        println!("lowest {:.4}", low(&sim));
        assert!(sim.report().unwrap().max_edge_strain < 0.02);
        change(&mut sim, Vec::new(), "off");
        steps(&mut sim, 30, 20);
        assert!(sim.report().unwrap().max_edge_strain < 0.02);
    }
}

/// Flat place of a node in the middle of the strip that is farther than a pitch from every vertex.
fn far_from_vertices(sim: &Sim) -> [f64; 2] {
    let far = |p: &&Vec2| {
        let near = |v: &Vec2| (v - **p).norm() < 1.2e-3;
        (**p - Vec2::new(0.03, 0.008)).norm() < 3e-3 && !sim.vertex_uv().iter().any(near)
    };
    let nodes = &sim.yarns().unwrap().uv;
    (*nodes.iter().find(far).expect("such a node")).into()
}

/// Where the held end of the strip is, in both models: vertices, or the nodes on its edge.
fn held_end(sim: &Sim) -> Vec<(Vec2, Vec3)> {
    let vertices = sim.vertex_uv().iter().zip(sim.positions());
    let held = |k: usize| sim.is_pinned(k as u32);
    let mut list: Vec<(Vec2, Vec3)> = (vertices.enumerate())
        .filter(|(k, _)| held(*k))
        .map(|(_, (uv, x))| (*uv, *x))
        .collect();
    if let Some(yarns) = sim.yarns() {
        let nodes = yarns.uv.iter().zip(sim.yarn_nodes());
        let held = |n: usize| sim.is_pinned(sim.point_of_node(n as u32));
        list.extend(
            (nodes.enumerate())
                .filter(|(n, _)| held(*n))
                .map(|(_, (uv, x))| (*uv, *x)),
        );
    }
    list
}

/// Yarns that come into the held end of a strip hold it there, all along the edge; and when they go the vertices do again. A pin that is
/// on its way goes on.
#[test]
fn pins_pass_from_vertices_to_yarns_and_back() {
    let by = Vec3::new(0.0, 0.0, 4e-3);
    for (from, to, rings) in [(-1.0, 0.0201, 0), (-1.0, 1.0, 0), (-1.0, 0.0201, 1)] {
        let mut sim = strip(-9.81);
        steps(&mut sim, 5, 20);
        let first = held_end(&sim);
        let vertices: Vec<u32> = sim.checkpoint().pins.iter().map(|p| p.vertex).collect();
        // targets that the next step is to reach
        hold(&mut sim, 0.0, by);
        change_holding(&mut sim, between(from, to, rings));
        let edge = sim.yarn_nodes_along(0, 3).unwrap();
        assert!(edge.len() > 12, "{}", edge.len());
        for n in &edge {
            assert!(sim.is_pinned(sim.point_of_node(*n)), "{n}");
        }
        assert_eq!(sim.checkpoint().pins.len(), edge.len());
        steps(&mut sim, 5, 60);
        let yarns = held_end(&sim);
        for (uv, x) in &yarns {
            let end = Vec3::new(0.0, uv.y, 0.0) + by;
            assert!(uv.x < 5e-4 && (x - end).norm() < 5e-4, "{uv:?} {x:?}");
        }
        change_holding(&mut sim, Vec::new());
        let again: Vec<u32> = sim.checkpoint().pins.iter().map(|p| p.vertex).collect();
        assert_eq!(again, vertices, "{from} {to} {rings}");
        steps(&mut sim, 20, 60);
        for ((uv, x), (was, y)) in held_end(&sim).iter().zip(&first) {
            assert_eq!(uv, was);
            assert!((x - y - by).norm() < 3e-4, "{uv:?} {x:?} {y:?}");
        }
    }
    // a single held corner passes to the node beside it, and back
    let mut sim = strip(0.0);
    let corner = sim.locate(0, [0.0, 0.0]).unwrap();
    let others: Vec<u32> = (sim.checkpoint().pins.iter().map(|p| p.vertex))
        .filter(|v| *v != corner)
        .collect();
    sim.unpin(&others).unwrap();
    change_holding(&mut sim, between(-1.0, 0.0201, 0));
    let pins = sim.checkpoint().pins;
    assert_eq!(pins.len(), 1);
    let uv = held_end(&sim)[0].0;
    assert!(uv.norm() < 1e-3, "{uv:?}");
    change_holding(&mut sim, Vec::new());
    assert_eq!(sim.checkpoint().pins[0].vertex, corner);
}

/// A change of regions after which nothing has jumped.
fn change_holding(sim: &mut Sim, regions: Vec<BlendRegion>) {
    let x = sim.positions().to_vec();
    sim.set_blend_regions(regions).expect("regions");
    for (a, b) in x.iter().zip(sim.positions()) {
        assert!((a - b).norm() < 5e-5, "{a:?} {b:?}");
    }
}

/// What cannot go over is refused by name, and the simulation is as it was.
#[test]
fn changes_that_cannot_be_leave_everything_as_it_was() {
    let mut sim = strip(-9.81);
    steps(&mut sim, 3, 20);
    let triangles = sim.save().unwrap();
    sim.set_blend_regions(between(0.0199, 0.0401, 0)).unwrap();
    let mixed = sim.save().unwrap();
    let refused = |sim: &mut Sim, regions, status, text: &str| {
        let before = (sim.save().unwrap(), sim.epoch(), sim.yarn_epoch());
        let error = sim.set_blend_regions(regions).expect_err(text);
        assert_eq!(error.status, status, "{error}");
        assert!(error.message.contains(text), "{error}");
        assert_eq!((sim.save().unwrap(), sim.epoch(), sim.yarn_epoch()), before);
        assert!(sim.report().is_ok());
    };
    let state = Status::State;
    refused(
        &mut sim,
        between(0.0199, 0.0201, 0),
        Status::Argument,
        "holds no triangle",
    );
    refused(
        &mut sim,
        between(0.0199, 0.0401, 4),
        Status::Argument,
        "rings",
    );
    let mut two = between(0.0, 0.0201, 0);
    two.extend(between(0.0399, 0.0601, 1));
    refused(&mut sim, two, Status::Unsupported, "same number");
    // a held node would go, or ride, with no vertex near
    let uv = far_from_vertices(&sim);
    let node = sim.locate_yarn_node(0, uv).unwrap();
    sim.pin_yarn_nodes(&[node], None).unwrap();
    refused(&mut sim, Vec::new(), state, "would not move by itself");
    refused(
        &mut sim,
        between(0.0039, 0.0281, 0),
        state,
        "would not move by itself",
    );
    // where it stays it is held on, under its new number
    let place = sim.yarn_nodes()[node as usize];
    let uv = sim.yarns().unwrap().uv[node as usize];
    sim.set_blend_regions(between(0.0119, 0.0401, 0)).unwrap();
    let now = sim.locate_yarn_node(0, uv.into()).unwrap();
    assert_ne!(now, node);
    assert!(sim.is_pinned(sim.point_of_node(now)));
    steps(&mut sim, 2, 30);
    assert_eq!(sim.yarn_nodes()[now as usize], place);
    sim.unpin_yarn_nodes(&[now]).unwrap();
    // states belong to their regions
    for bytes in [&triangles, &mixed] {
        let error = sim.restore(bytes).expect_err("another region");
        assert!(error.message.contains("blend region"), "{error}");
    }
    sim.set_blend_regions(between(0.0199, 0.0401, 0)).unwrap();
    sim.restore(&mixed).unwrap();
    sim.set_blend_regions(Vec::new()).unwrap();
    sim.restore(&triangles).unwrap();
    assert_eq!(sim.save().unwrap(), triangles);
}

/// Yarns that have come out of contacts stay so while the region grows around them; a region that leaves them out is
/// refused.
#[test]
fn what_has_come_apart_stays_apart() {
    let weave = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025}"#;
    let text = crate::yarn_sims::patch(weave, 0.016, 0.008, WHOLE);
    let text = text.replace("0.0032,", "0.002,");
    let mut sim = sim(&text, 0.0, &[("solver.newton.relative_tolerance", 1e-3)]);
    sim.set_blend_regions(between(0.0079, 0.1, 0))
        .expect("half");
    let held: Vec<u32> = (0..sim.positions().len() as u32)
        .filter(|v| sim.active_vertices()[*v as usize] && sim.vertex_uv()[*v as usize].x < 0.0041)
        .collect();
    sim.pin(&held, None).unwrap();
    // warp yarns pass from end to end; one is pulled at its end out of the wefts
    let end = sim.locate_yarn_node(0, [0.0125, 0.008]).unwrap();
    let rim: Vec<u32> = [0.0085, 0.0095, 0.0105, 0.0115, 0.0135, 0.0145, 0.0155]
        .iter()
        .flat_map(|u| [[*u, 0.0], [*u, 0.008]])
        .map(|uv| sim.locate_yarn_node(0, uv).unwrap())
        .collect();
    sim.pin_yarn_nodes(&rim, None).unwrap();
    for _ in 0..25 {
        let target = sim.yarn_nodes()[end as usize] + Vec3::y() * 1e-4;
        sim.pin_yarn_nodes(&[end], Some(&[target.into()])).unwrap();
        let _ = sim.step(1e-3).expect("step");
    }
    let changes = sim.yarn_changes();
    assert!(changes.passages_gone >= 2, "{changes:?}");
    sim.unpin_yarn_nodes(&rim).unwrap();
    sim.unpin_yarn_nodes(&[end]).unwrap();
    let before = nodes(&sim);
    let epoch = sim.yarn_epoch();
    let done = sim
        .set_blend_regions(between(0.0039, 0.1, 0))
        .expect("more");
    assert!(done.gone == 0 && done.laid > 0, "{done:?}");
    assert_eq!(sim.yarn_changes(), changes);
    assert!(sim.yarn_epoch() > epoch);
    let after = nodes(&sim);
    assert!(before.iter().all(|(uv, node)| after[uv] == *node));
    sim.yarns().unwrap().check().expect("mesh");
    let _ = sim.step(1e-3).expect("step");
    // above the middle every contact of the yarn has slid by more than a pitch
    let slips = sim.yarn_slips();
    let slid = slips.iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    assert!(slid > 1.5e-3, "{slid}");
    let low = |top| BlendRegion {
        shape: Shape::Polygon(vec![
            Vec2::new(0.0039, -1.0),
            Vec2::new(1.0, -1.0),
            Vec2::new(1.0, top),
            Vec2::new(0.0039, top),
        ]),
        ..between(0.0, 1.0, 0).remove(0)
    };
    let saved = sim.save().unwrap();
    sim.set_blend_regions(vec![low(0.0061)]).expect("low");
    assert_eq!(sim.yarn_changes(), changes);
    // what comes in beside yarns that have slid goes on from them: nowhere is there more or less yarn than laid
    sim.set_blend_regions(vec![low(1.0)]).expect("slid");
    assert_eq!(sim.yarn_changes(), changes);
    let (mesh, state) = (sim.yarns().unwrap(), sim.checkpoint());
    let mut slid: f64 = 0.0;
    for y in 0..mesh.yarn_count() {
        for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
            let laid = [i - 1, i].map(|i| mesh.incidences[i].u);
            let now = [state.u[i - 1], state.u[i]];
            slid = slid.max((now[1] - laid[1]).abs());
            let part = (now[1] - now[0]) / (laid[1] - laid[0]);
            assert!((0.2..1.8).contains(&part), "yarn {y}, passage {i}: {part}");
        }
    }
    assert!(slid > 1.5e-3, "{slid}");
    let _ = sim.step(1e-3).expect("step");
    crate::mixed_hard::is_sound(&sim, "slid");
    assert!(sim.restore(&saved).is_err());
    let mut sim = {
        // as it was before
        let mut again =
            crate::yarn_sims::sim(&text, 0.0, &[("solver.newton.relative_tolerance", 1e-3)]);
        again
            .set_blend_regions(between(0.0039, 0.1, 0))
            .expect("same");
        again.restore(&saved).expect("state");
        again
    };
    for regions in [Vec::new(), between(0.0039, 0.0121, 0)] {
        let saved = sim.save().unwrap();
        let error = sim.set_blend_regions(regions).expect_err("left out");
        assert!(
            error.message.contains("come out of contacts near"),
            "{error}"
        );
        assert_eq!(sim.save().unwrap(), saved);
    }
}

/// Regions that come one after the other on two sides of a seam, over a ball on which the cloth rubs: rods of seams lie on
/// another side then, and nothing slips.
#[test]
fn regions_cross_seams_and_bodies() {
    let fabric =
        weave(1e-3, 1.0).replace("\"density\": 0.3,", "\"density\": 0.3, \"friction\": 0.5,");
    let seam = r#"{"a": ["p0", 1], "b": ["p1", 3]}"#;
    let text = garment(&fabric, 5e-3, &[(0.0, &[]), (0.03, &[])], seam);
    let mut sim = make(&text, -9.81).expect("sim");
    let far = |v: &u32| (sim.placed(*v).x - 0.03).abs() > 0.03 - 1e-9;
    let held: Vec<u32> = (0..sim.positions().len() as u32).filter(far).collect();
    sim.pin(&held, None).unwrap();
    let ball = Body::sphere(0.012).unwrap();
    let contact = ContactSettings::default();
    let number = sim.add_body(&ball, &contact).unwrap();
    sim.set_body_pose(number, [0.03, 0.015, -0.0125], [0.0, 0.0, 0.0, 1.0])
        .unwrap();
    for _ in 0..30 {
        let _ = sim.step(5e-3).expect("step");
    }
    let rectangle = |panel, from: f64, to: f64| BlendRegion {
        panel,
        ..between(from, to, 0).remove(0)
    };
    let load = |sim: &Sim| sim.body_wrench(number).unwrap().0[2];
    let borne = load(&sim);
    let right = rectangle(1, -1.0, 0.0151);
    let left = rectangle(0, 0.0149, 1.0);
    for (what, regions) in [
        ("right", vec![right.clone()]),
        ("both", vec![left.clone(), right]),
        ("left", vec![left]),
        ("none", Vec::new()),
    ] {
        let done = sim.set_blend_regions(regions).expect(what);
        for _ in 0..6 {
            let _ = sim.step(5e-3).expect(what);
        }
        let report = sim.report().unwrap();
        println!(
            "{what}: {done:?}, seam {:.1e} m, load {:.3e} of {borne:.3e} N",
            report.max_seam_gap,
            load(&sim)
        );
        crate::mixed_hard::is_sound(&sim, what);
        assert!(
            report.max_seam_gap < 1e-3 && report.min_gap > -1e-3,
            "{what}: {report:?}"
        );
        assert!((load(&sim) / borne - 1.0).abs() < 0.3, "{what}");
    }
}

/// Of two patches of yarns the longer one is gathered along the seam. The vertices of both sides lie on the seam's rod, and stay
/// there when triangles come back in one patch and rings in the other: springs of the seam have nothing to close.
#[test]
fn sides_of_a_seam_meet_when_triangles_come_back() {
    let scene: serde_json::Value =
        serde_json::from_str(include_str!("../examples/pucker.json")).unwrap();
    let garment = garment_from_json(&scene["garment"].to_string(), None).unwrap();
    let options = SimOptions {
        gravity: Some([0.0; 3]),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).unwrap();
    sim.set_number("yarn.sliding", 0.0).unwrap();
    let along = |sim: &Sim, panel: u32, u: f64| {
        let uv = sim.vertex_uv();
        let mut side: Vec<u32> = (0..uv.len() as u32)
            .filter(|v| sim.vertex_panels()[*v as usize] == panel)
            .filter(|v| (uv[*v as usize].x - u).abs() < 1e-9)
            .collect();
        side.sort_by(|a, b| uv[*a as usize].y.total_cmp(&uv[*b as usize].y));
        side
    };
    let ends = [along(&sim, 0, 0.0), along(&sim, 1, 0.06)].concat();
    sim.pin(&ends, None).unwrap();
    rest(&mut sim);
    let apart = |sim: &Sim| {
        let [short, long] = [along(sim, 0, 0.06), along(sim, 1, 0.0)];
        assert_eq!(short.len(), long.len());
        let place = |v: &u32| sim.positions()[*v as usize];
        let gaps = short.iter().zip(&long);
        gaps.map(|(a, b)| (place(a) - place(b)).norm())
            .fold(0.0, f64::max)
    };
    assert!(apart(&sim) < 1e-12, "{:.2e} m", apart(&sim));
    let before = sim.positions().to_vec();
    let corners = [[-0.1, 0.03], [0.03, 0.03], [0.03, 0.05], [-0.1, 0.05]];
    let ringed = BlendRegion {
        panel: 1,
        shape: Shape::Polygon(corners.map(Vec2::from).to_vec()),
        rings: 2,
    };
    sim.set_blend_regions(vec![ringed]).unwrap();
    assert_eq!(sim.positions(), &before[..]);
    let now = sim.energies().unwrap();
    println!("{now:?}");
    assert!(now.seam < 0.01 * (now.membrane + now.yarn), "{now:?}");
}

/// A knit that is laid at its size at rest comes into a fitted sheet.
#[test]
fn a_compensated_knit_comes_into_triangles() {
    let text = knit("stockinette", 6).replace("\"preset\"", "\"compensated\": true, \"preset\"");
    let mut sim = sim(&text, -9.81, &[]);
    assert!(sim.yarns().is_some());
    let whole = sim.garment().blend_regions.clone();
    let laid = sim.yarn_coordinates().to_vec();
    sim.set_blend_regions(Vec::new()).expect("off");
    let _ = sim.step(1e-3).expect("step");
    sim.set_number("solver.newton.max_iterations", 50.0)
        .unwrap();
    sim.set_blend_regions(whole).expect("on");
    // a number that was set later changes nothing of how the fabric is laid
    assert_eq!(sim.yarn_coordinates(), laid);
    for _ in 0..5 {
        let report = sim.step(1e-3).expect("step");
        assert!(report.newton_iterations < 60, "{report:?}");
    }
}

/// A weave that hangs and slips, its region moved to and fro thirty times: yarns stay as good as unstretched and where
/// they are. Slip and the places of points that come to follow triangles would else become strain in every change, and strain slip.
#[test]
fn changes_again_and_again_pump_nothing() {
    let text = r#"{"toile_garment": 1, "name": "patch", "edge_length": 6e-3,
        "panels": [{"name": "p", "fabric": "y", "vertices": [[0, 0], [0.06, 0], [0.06, 0.06], [0, 0.06]],
            "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}],
        "fabrics": [{"name": "y", "density": 0.589, "membrane": {"warp": 3902, "weft": 3902, "shear": 0.5},
            "bending": {"warp": 1.18e-7, "weft": 1.18e-7},
            "yarns": {"weave": "plain", "warp_pitch": 2e-3, "radius": 0.5e-3}}]}"#;
    let regions = [0.01, 0.02].map(|from| {
        let corners = [
            [from, 0.01],
            [from + 0.03, 0.01],
            [from + 0.03, 0.045],
            [from, 0.045],
        ];
        vec![BlendRegion {
            panel: 0,
            shape: Shape::Polygon(corners.map(Vec2::from).to_vec()),
            rings: 0,
        }]
    });
    let mut garment = garment_from_json(text, None).expect("garment");
    garment.blend_regions.clone_from(&regions[0]);
    let options = SimOptions {
        gravity: Some([0.0, -9.81, 0.0]),
        ..SimOptions::default()
    };
    let mut sim = Sim::new(&garment, &options).expect("sim");
    let top: Vec<u32> = (0..sim.positions().len() as u32)
        .filter(|v| sim.vertex_uv()[*v as usize].y > 0.06 - 1e-9)
        .collect();
    sim.pin(&top, None).expect("pin");
    let mut strain: f64 = 0.0;
    for change in 1..31 {
        for _ in 0..5 {
            strain = strain.max(sim.step(2e-3).expect("step").max_edge_strain);
        }
        sim.set_blend_regions(regions[change % 2].clone())
            .expect("change");
    }
    let slip = sim.yarn_slips().iter().fold(0.0_f64, |m, s| m.max(s.abs()));
    println!("strain {strain:.1e}, slip {slip:.1e} m");
    assert!(strain < 5e-3 && slip < 2e-4, "{strain} {slip}");
}

/// Regions of any kind in any order, with steps between them: whatever is accepted is sound, whatever is refused has changed nothing.
#[test]
fn regions_in_any_order_stay_sound() {
    let seam = r#"{"a": ["p0", 1], "b": ["p1", 3]}"#;
    let text = garment(&weave(1e-3, 1.0), 3e-3, &[(0.0, &[]), (0.03, &[])], seam);
    let mut random = Random::new(7);
    let mut unit = || 0.5 * (random.signed() + 1.0);
    let mut sim = make(&text, -9.81).expect("sim");
    let held: Vec<u32> = (0..sim.positions().len() as u32)
        .filter(|v| sim.placed(*v).x < 1e-9)
        .collect();
    sim.pin(&held, None).unwrap();
    let mass: f64 = sim.point_masses().iter().sum();
    let mut accepted = 0;
    for k in 0..14 {
        let rings = (3.0 * unit()) as u32;
        let mut regions = Vec::new();
        for panel in 0..2 {
            let radius = 0.004 + 0.008 * unit();
            let center = Vec2::new(0.006 + 0.024 * unit(), 0.03 * unit());
            let shape = match (3.0 * unit()) as u32 {
                0 => Shape::Disc { center, radius },
                1 => Shape::Edge {
                    edge: if panel == 0 { 1 } else { 3 },
                    width: radius,
                },
                _ => continue,
            };
            regions.push(BlendRegion {
                panel,
                shape,
                rings,
            });
        }
        let what = format!("{k}: {rings} rings, {regions:?}");
        let before = sim.save().unwrap();
        match sim.set_blend_regions(regions) {
            Ok(done) => {
                accepted += 1;
                println!("{what}: {done:?}");
            }
            Err(error) => {
                println!("{what}: {error}");
                assert_eq!(sim.save().unwrap(), before);
            }
        }
        if let Some(mesh) = sim.yarns() {
            mesh.check().expect("mesh");
        }
        let _ = sim.step(3e-3).expect(&what);
        let _ = sim.step(3e-3).expect(&what);
        crate::mixed_hard::is_sound(&sim, &what);
        let now: f64 = sim.point_masses().iter().sum();
        assert!((now / mass - 1.0).abs() < 0.03, "{what}: {now} {mass}");
    }
    assert!(accepted >= 8, "{accepted}");
}

/// What hosts may ask of rings is taken when yarns come in.
#[test]
fn means_of_rings_and_enriched_yarns_come_in_as_well() {
    let cases = [
        ("blend.means", between(0.0199, 0.0401, 1)),
        ("blend.enrich_everywhere", between(-1.0, 1.0, 0)),
    ];
    for (name, region) in cases {
        let mut sim = strip(-9.81);
        steps(&mut sim, 20, 8);
        let held: Vec<u32> = (0..sim.positions().len() as u32)
            .filter(|v| sim.is_pinned(*v))
            .collect();
        sim.unpin(&held).unwrap();
        sim.set_number(name, 1.0).expect(name);
        change(&mut sim, region, name);
        steps(&mut sim, 5, 10);
        let error = sim.set_number(name, 0.0).expect_err(name);
        assert!(error.message.contains("when yarns come in"), "{error}");
        change(&mut sim, Vec::new(), name);
        steps(&mut sim, 5, 10);
    }
}
