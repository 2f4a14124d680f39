//! Yarns that come out of their contacts: what goes, what stays, what is conserved, what hosts are told.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::sheets::Random;
use crate::yarn_sims::{WHOLE, knit, patch, sim};
use std::sync::Arc;
use toile::math::Vec3;
use toile::math::parallel::Workers;
use toile::pattern::export::garment_to_json;
use toile::pattern::import::garment_from_json;
use toile::scene::Scene;
use toile::sim::{DrapeOptions, Sim, YarnChanges};
use toile::sim_scene::{self, Driver};
use toile::system::state::State;
use toile::system::yarn::YarnOptions;
use toile::system::yarn::contacts::{Contacts, Sliding};
use toile::system::yarn::friction::loose;
use toile::system::yarn::passing::{Passing, passings};
use toile::system::yarn::release::momentum;
use toile::yarn::{Layout, Topology, YarnMaterial, YarnMesh, Yarns, lay};

const PLAIN: &str = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025}"#;
const ROUGH: (&str, f64) = ("solver.newton.relative_tolerance", 1e-3);

/// Balanced garter of so many loops each way, the ends of its yarn not woven in.
fn loose_garter(loops: usize) -> String {
    knit("garter", loops).replace("\"knit\"", "\"fastened\": false, \"knit\"")
}

/// Length of all yarns [m].
fn length(mesh: &YarnMesh, u: &[f64]) -> Vec<f64> {
    (0..mesh.yarn_count())
        .map(|y| u[mesh.starts[y + 1] as usize - 1] - u[mesh.starts[y] as usize])
        .collect()
}

/// Laid nodes whose stacks have lost a yarn.
fn left(laid: &YarnMesh, sim: &Sim) -> Vec<usize> {
    let mesh = sim.yarns().unwrap();
    (0..laid.uv.len())
        .filter(|n| mesh.stack(*n).len() < laid.stack(*n).len())
        .collect()
}

fn order(sim: &Sim) {
    let (mesh, u) = (sim.yarns().unwrap(), sim.yarn_coordinates());
    mesh.check().expect("mesh");
    assert_eq!(u.len(), mesh.incidences.len());
    assert_eq!(sim.yarn_nodes().len(), mesh.uv.len());
    for y in 0..mesh.yarn_count() {
        let range = mesh.starts[y] as usize..mesh.starts[y + 1] as usize;
        assert!(u[range].windows(2).all(|w| w[1] > w[0]), "yarn {y}");
    }
}

/// A plain weave of 8 by 8 yarns held at the ends of its warp, and the weft in the middle.
fn weft() -> (Sim, usize) {
    let mut sim = sim(&patch(PLAIN, 0.008, 0.008, WHOLE), 0.0, &[ROUGH]);
    let mesh = sim.yarns().unwrap().clone();
    let held: Vec<u32> = (0..8)
        .flat_map(|y| [mesh.yarn(y)[0].node, mesh.yarn(y).last().unwrap().node])
        .collect();
    sim.pin_yarn_nodes(&held, None).unwrap();
    (sim, 12)
}

fn pull(sim: &mut Sim, node: u32, way: Vec3) {
    let target = sim.yarn_nodes()[node as usize] + way;
    sim.pin_yarn_nodes(&[node], Some(&[target.into()])).unwrap();
    let _ = sim.step(1e-3).expect("step");
}

/// A weft pulled out of a weave rubs on fewer and fewer warp yarns: the force falls from contact to contact, and
/// nothing else in the cloth lets go.
#[test]
fn a_weft_that_is_pulled_out_rubs_less_with_every_contact_that_it_leaves() {
    let (mut sim, weft) = weft();
    let laid = sim.yarns().unwrap().clone();
    let before = length(&laid, sim.yarn_coordinates());
    let own: Vec<usize> = laid.yarn(weft).iter().map(|i| i.node as usize).collect();
    let end = sim.yarn_end(weft as u32, 1).unwrap();
    // largest force while so many contacts are left
    let mut force = [0.0_f64; 9];
    let mut work = 0.0;
    for _ in 0..110 {
        pull(&mut sim, end, Vec3::x() * 1e-4);
        order(&sim);
        let mesh = sim.yarns().unwrap();
        let contacts = mesh.yarn(weft).len() - 2;
        let reaction = -sim.yarn_forces().unwrap()[end as usize].x;
        let tension = sim.yarn_tensions()[mesh.starts[weft + 1] as usize - 2];
        // what bending at the last contact adds is small
        assert!(
            (reaction - tension).abs() < 1e-4 + 0.01 * tension,
            "{reaction} {tension}"
        );
        force[contacts] = force[contacts].max(tension);
        work += tension * 1e-4;
    }
    println!("largest pull [N] with 0 to 8 contacts: {force:.4?}, work {work:.3e} J");
    // the first contact goes while the pull still grows
    assert!(force[..8].windows(2).all(|w| w[0] < w[1]), "{force:?}");
    assert!(force[7] > 3.0 * force[1], "{force:?}");
    let gone = left(&laid, &sim);
    let expected = &own[1..own.len() - 1];
    assert_eq!(gone.len(), 8);
    assert!(expected.iter().all(|n| gone.contains(n)), "{gone:?}");
    let now = length(sim.yarns().unwrap(), sim.yarn_coordinates());
    assert_eq!(before, now);
    let changes = sim.yarn_changes();
    let told = YarnChanges {
        passages_gone: 8,
        nodes_split: 0,
        nodes_left: 0,
    };
    assert_eq!(changes, told);
}

/// The yarn of balanced garter, pulled at its end while the cast-on is held: the bind-off loops come out
/// one by one, each off its four contacts, and no other contact of the patch lets go.
#[test]
fn pulling_the_yarn_of_garter_unravels_one_row() {
    let mut sim = sim(&loose_garter(5), 0.0, &[ROUGH]);
    let laid = sim.yarns().unwrap().clone();
    let before = length(&laid, sim.yarn_coordinates());
    let low = laid.uv.iter().fold(f64::MAX, |m, p| m.min(p.y));
    let held: Vec<u32> = (0..)
        .zip(&laid.uv)
        .filter(|(_, p)| p.y < low + 1.2e-3)
        .map(|p| p.0)
        .collect();
    sim.pin_yarn_nodes(&held, None).unwrap();
    let end = sim.yarn_end(0, 1).unwrap();
    // the last course: four passages for each loop, before the tail
    let course: Vec<usize> = laid.yarn(0)[laid.incidences.len() - 21..][..20]
        .iter()
        .map(|i| i.node as usize)
        .collect();
    let way = Vec3::new(0.5, 1.0, 0.0).normalize() * 2e-4;
    let mut epoch = sim.yarn_epoch();
    let mut opened = Vec::new();
    for step in 0..200 {
        pull(&mut sim, end, way);
        order(&sim);
        if sim.yarn_epoch() != epoch {
            epoch = sim.yarn_epoch();
            let now: Vec<usize> = left(&laid, &sim)
                .into_iter()
                .filter(|n| laid.stack(*n).len() > 1)
                .collect();
            if now.len() > opened.len() {
                println!("step {step}: {} contacts are left", now.len());
                opened = now;
            }
        }
        if opened.len() >= 20 {
            break;
        }
    }
    // four at a time, the loops of the last course and nothing else
    assert_eq!(opened.len(), 20, "{:?}", sim.yarn_changes());
    assert!(opened.iter().all(|n| course.contains(n)), "{opened:?}");
    assert_eq!(sim.yarn_changes().nodes_split, 20);
    assert_eq!(length(sim.yarns().unwrap(), sim.yarn_coordinates()), before);
    // the loops of two rows below have kept their yarn
    let mesh = sim.yarns().unwrap();
    let slips = sim.yarn_slips();
    let below = (mesh.incidences.iter().zip(&slips))
        .filter(|(i, _)| mesh.uv[i.node as usize].y < low + 6e-3)
        .map(|(_, slip)| slip.abs());
    let most = below.fold(0.0, f64::max);
    println!("two rows below no yarn has slid by more than {most:.2e} m");
    assert!(most < 1.5e-3, "{most}");
}

/// Garter cut at both sides, held above and below: a course in the middle, pulled at its end, slides out of all its
/// contacts, and no other contact lets go. The cloth is two pieces then.
#[test]
fn a_course_that_is_pulled_out_of_garter_leaves_the_rest_intact() {
    // smoother than yarns are: over the turns of a row friction grows exponentially
    let yarns = r#"{"preset": "jersey", "knit": "garter", "friction": 0.05}"#;
    let (width, height) = (0.0132, 0.012_015);
    let whole = patch(yarns, width, height, WHOLE);
    let slanted = whole.replace(
        &format!("[{width}, {height}], [0, {height}]"),
        &format!("[0.0117, {height}], [0.0015, {height}]"),
    );
    assert_ne!(whole, slanted);
    let mut sim = sim(&slanted, 0.0, &[ROUGH]);
    let laid = sim.yarns().unwrap().clone();
    let (low, high) =
        (laid.uv.iter()).fold((f64::MAX, f64::MIN), |(a, b), p| (a.min(p.y), b.max(p.y)));
    let held: Vec<u32> = (0..)
        .zip(&laid.uv)
        .filter(|(_, p)| p.y < low + 1.2e-3 || p.y > high - 1.2e-3)
        .map(|p| p.0)
        .collect();
    sim.pin_yarn_nodes(&held, None).unwrap();
    let course = laid.yarn_count() / 2;
    let before = length(&laid, sim.yarn_coordinates());
    let end = sim.yarn_end(course as u32, 1).unwrap();
    let right = laid.uv[end as usize].x > 0.5 * width;
    let way = Vec3::x() * if right { 3e-4 } else { -3e-4 };
    let mut force = Vec::new();
    for _ in 0..170 {
        pull(&mut sim, end, way);
        order(&sim);
        force.push(sim.yarn_forces().unwrap()[end as usize].norm());
        if sim.yarns().unwrap().yarn(course).len() == 2 {
            break;
        }
    }
    let contacts = laid.yarn(course).len() - 2;
    let most = force.iter().fold(0.0_f64, |m, f| m.max(*f));
    println!(
        "{contacts} contacts left after {} ms, largest pull {most:.3} N, the last one {:.4} N",
        force.len(),
        force[force.len() - 1]
    );
    // solved to the end, short ends of its neighbours at the cuts come off it before it has passed: a node that
    // nothing holds any more
    let YarnChanges {
        passages_gone,
        nodes_split,
        nodes_left,
    } = sim.yarn_changes();
    assert_eq!([passages_gone, nodes_split], [contacts + nodes_left, 0]);
    assert!(nodes_left <= 2, "{nodes_left}");
    let own: Vec<u32> = laid.yarn(course).iter().map(|i| i.node).collect();
    let gone = left(&laid, &sim);
    assert_eq!(gone.len(), contacts);
    assert!(gone.iter().all(|n| own.contains(&(*n as u32))), "{gone:?}");
    assert_eq!(length(sim.yarns().unwrap(), sim.yarn_coordinates()), before);
    assert!(force[force.len() - 1] < 0.5 * most, "{force:?}");
}

/// Yarns as laid with a state that a contact is about to come off in, moving at random.
struct Ready {
    yarns: Arc<Yarns>,
    state: State,
}

fn ready(fabric: &str, wanted: Passing, seed: u64) -> Ready {
    let garment = garment_from_json(&patch(fabric, 0.015, 0.015, WHOLE), None).unwrap();
    let mesh = lay(&garment, &Layout::default()).unwrap();
    let material = YarnMaterial::from(garment.fabrics[0].yarns.as_ref().unwrap());
    let mut random = Random::new(seed);
    let mut state = sim(&patch(fabric, 0.015, 0.015, WHOLE), 0.0, &[]).checkpoint();
    let first = state.positions.len() - mesh.uv.len();
    let list: Vec<usize> = (0..mesh.incidences.len())
        .filter(|i| passings(&mesh)[*i] == wanted)
        .collect();
    let i = list[list.len() / 2];
    for (n, x) in state.positions[first..].iter_mut().enumerate() {
        *x = Vec3::new(mesh.uv[n].x, mesh.uv[n].y, mesh.lift[n]) + random.vec3(1e-6);
    }
    for v in &mut state.velocities[first..] {
        *v = random.vec3(0.1);
    }
    for (rate, incidence) in state.u_rates.iter_mut().zip(&mesh.incidences) {
        *rate = 0.1 * random.signed() * f64::from(u8::from(incidence.slides));
    }
    // short, and the yarn before it pulled away
    let least = 0.1
        * material
            .radius
            .min(mesh.incidences[i + 1].u - mesh.incidences[i].u);
    if wanted == Passing::Loop {
        let middle = 0.5 * (state.u[i] + state.u[i + 1]);
        (state.u[i], state.u[i + 1]) = (middle - 0.5 * least, middle + 0.5 * least);
    } else {
        state.u[i] = state.u[i + 1] - least;
    }
    let before = first + mesh.incidences[i - 1].node as usize;
    let at = state.positions[first + mesh.incidences[i].node as usize];
    let away = (state.positions[before] - at).normalize() * 0.02;
    state.positions[before] += away;
    state.strands = loose(&mesh, &state.u);
    state.sliding = mesh.incidences.iter().map(|i| i.slides).collect();
    Ready {
        yarns: Arc::new(Yarns::laid(mesh, vec![material])),
        state,
    }
}

fn total(yarns: &Yarns, state: &State) -> Vec3 {
    let first = state.positions.len() - yarns.mesh.uv.len();
    let all = 0..yarns.mesh.yarn_count();
    all.map(|y| momentum(yarns, y, first, state)).sum()
}

/// The yarn of a knit whose ends are woven in holds all loops; if they are not, its end and the loops before it come out.
#[test]
fn ends_that_are_woven_in_hold_their_loops() {
    for (fastened, comes) in [(true, false), (false, true)] {
        let yarns = format!(r#"{{"preset": "jersey", "fastened": {fastened}}}"#);
        let garment = garment_from_json(&patch(&yarns, 0.015, 0.015, WHOLE), None).unwrap();
        let back = garment_to_json(&garment).unwrap();
        assert_eq!(garment_from_json(&back, None).unwrap(), garment);
        let mesh = lay(&garment, &Layout::default()).unwrap();
        let list = passings(&mesh);
        let any = |f: fn(&Passing) -> bool| list.iter().any(f);
        assert_eq!(any(|p| matches!(p, Passing::End(_))), comes);
        assert_eq!(any(|p| *p == Passing::Loop), comes);
        assert!(any(|p| matches!(p, Passing::Lone(_))));
    }
}

/// Length, mass and linear momentum of every yarn are what they were when an end slips out of its contact, when a
/// contact passes a node of one yarn, and when a loop comes out.
#[test]
fn what_comes_off_keeps_length_and_momentum() {
    let jersey = r#"{"preset": "jersey", "fastened": false}"#;
    for (fabric, wanted, lost, split) in [
        (PLAIN, Passing::End(1), 1, 0),
        (jersey, Passing::Lone(1), 1, 0),
        (jersey, Passing::Loop, 0, 4),
    ] {
        for seed in 0..5 {
            let Ready { yarns, mut state } = ready(fabric, wanted, seed);
            let (was, lengths) = (total(&yarns, &state), length(&yarns.mesh, &state.u));
            let mut contacts =
                Contacts::new(yarns.clone(), yarns.clone(), &YarnOptions::default()).unwrap();
            let now = contacts
                .follow(Sliding::Everywhere, true, &mut state, &Workers::default())
                .unwrap()
                .expect("something came off");
            let gone = state.topology.gone();
            assert_eq!(
                (gone, state.topology.split.len()),
                (lost, split),
                "{wanted:?}"
            );
            let is = total(&now, &state);
            assert!(
                (is - was).norm() < 1e-12 * was.norm(),
                "{wanted:?}: {was} {is}"
            );
            assert_eq!(length(&now.mesh, &state.u), lengths, "{wanted:?}");
            assert!(state.velocities.iter().all(|v| v.norm() < 10.0));
        }
    }
}

/// Nothing comes off at a node that is held, nor in a relaxation.
#[test]
fn held_contacts_stay() {
    let Ready { yarns, state } = ready(PLAIN, Passing::End(1), 1);
    let mesh = &yarns.mesh;
    let first = (state.positions.len() - mesh.uv.len()) as u32;
    let options = YarnOptions::default();
    let mut contacts = Contacts::new(yarns.clone(), yarns.clone(), &options).unwrap();
    let mut still = state.clone();
    let none = contacts.follow(Sliding::Everywhere, false, &mut still, &Workers::default());
    assert!(none.unwrap().is_none());
    let mut held = state;
    held.pins = (0..mesh.uv.len() as u32)
        .map(|n| toile::system::state::Pin {
            vertex: first + n,
            target: held.positions[(first + n) as usize],
        })
        .collect();
    let none = contacts.follow(Sliding::Everywhere, true, &mut held, &Workers::default());
    assert!(none.unwrap().is_none());
    assert_eq!(held.topology, Topology::default());
}

/// The same bits for any number of threads, from a snapshot taken after contacts have come off, in another simulation,
/// and after going back to before.
#[test]
fn unravelled_states_go_on_bit_by_bit() {
    let start = |threads: f64| {
        let numbers = [ROUGH, ("solver.threads", threads)];
        let mut sim = sim(&loose_garter(4), 0.0, &numbers);
        let mesh = sim.yarns().unwrap().clone();
        let low = mesh.uv.iter().fold(f64::MAX, |m, p| m.min(p.y));
        let held: Vec<u32> = (0..)
            .zip(&mesh.uv)
            .filter(|(_, p)| p.y < low + 1.2e-3)
            .map(|p| p.0)
            .collect();
        sim.pin_yarn_nodes(&held, None).unwrap();
        sim
    };
    let run = |sim: &mut Sim, steps: usize| {
        let end = sim.yarn_end(0, 1).unwrap();
        for _ in 0..steps {
            pull(sim, end, Vec3::new(1e-4, 2e-4, 0.0));
        }
    };
    let same = |a: &Sim, b: &Sim| {
        assert_eq!(a.yarn_nodes(), b.yarn_nodes());
        assert_eq!(a.yarn_coordinates(), b.yarn_coordinates());
        assert_eq!(a.yarns(), b.yarns());
    };
    let (mut one, mut two) = (start(1.0), start(2.0));
    run(&mut one, 50);
    run(&mut two, 50);
    same(&one, &two);
    let halfway = one.yarn_changes();
    assert!(halfway.nodes_split >= 8, "{halfway:?}");
    let (bytes, epoch) = (one.save().unwrap(), one.yarn_epoch());
    let kept = one.checkpoint();
    let mut other = start(1.0);
    other.restore(&bytes).unwrap();
    same(&one, &other);
    assert_eq!(other.save().unwrap(), bytes);
    run(&mut one, 25);
    run(&mut other, 25);
    same(&one, &other);
    assert!(one.yarn_changes() != halfway && one.yarn_epoch() > epoch);
    // back to halfway, and on again
    let epoch = one.yarn_epoch();
    one.roll_back(kept).unwrap();
    assert!(one.yarn_epoch() > epoch);
    assert_eq!(one.save().unwrap(), bytes);
    run(&mut one, 25);
    same(&one, &other);
    // a step that is stopped leaves everything as it was
    let before = one.save().unwrap();
    let end = one.yarn_end(0, 1).unwrap();
    let target = one.yarn_nodes()[end as usize] + Vec3::y() * 5e-3;
    one.pin_yarn_nodes(&[end], Some(&[target.into()])).unwrap();
    let pinned = one.save().unwrap();
    let mut asked = 0;
    let _ = one
        .step_watched(0.025, &mut |_| {
            asked += 1;
            asked < 4
        })
        .unwrap();
    assert_eq!(one.save().unwrap(), pinned);
    assert_ne!(before, pinned);
    order(&one);
}

/// A topology that cannot be is refused, whatever it says.
#[test]
fn topologies_that_cannot_be_are_refused() {
    let garment = garment_from_json(&loose_garter(4), None).unwrap();
    let mesh = lay(&garment, &Layout::default()).unwrap();
    let (nodes, count) = (mesh.uv.len() as u32, mesh.incidences.len() as u32);
    let yarns = Yarns::laid(mesh, vec![YarnMaterial::default()]);
    assert_eq!(yarns.present(&Topology::default()).unwrap(), yarns);
    let refused = |changed: &[(u32, Option<u32>)], split: &[u32]| {
        let topology = Topology {
            changed: changed.to_vec(),
            split: split.to_vec(),
        };
        assert!(yarns.present(&topology).is_err(), "{topology:?}");
    };
    refused(&[(count, None)], &[]);
    refused(&[(5, None), (5, None)], &[]);
    refused(&[(6, None), (5, None)], &[]);
    refused(&[(5, Some(nodes))], &[]);
    refused(&[], &[nodes]);
    refused(&(0..count).map(|i| (i, None)).collect::<Vec<_>>(), &[]);
    // any other change gives a mesh that is whole, or is refused: never a panic
    let mut random = Random::new(3);
    let mut whole = 0;
    for _ in 0..300 {
        let mut below = |n: u32| ((0.5 + 0.5 * random.signed()) * f64::from(n)) as u32;
        let mut changed: Vec<(u32, Option<u32>)> = (0..3)
            .map(|_| {
                let place = [None, Some(below(nodes)), Some(nodes)][below(3).min(2) as usize];
                (below(count), place)
            })
            .collect();
        changed.sort_unstable();
        let topology = Topology {
            changed,
            split: vec![below(nodes)],
        };
        if let Ok(present) = yarns.present(&topology) {
            present.mesh.check().unwrap();
            whole += 1;
        }
    }
    assert!(whole > 20, "{whole}");
}

/// Pins of a scene hold nodes of yarns: nearest to a point, on an edge, at a yarn's end, along a whole yarn; what they
/// bear is the weight.
#[test]
fn scenes_hold_yarns_by_place_and_by_number() {
    let fabric = r#"{"weave": "plain", "warp_pitch": 0.001, "radius": 0.00025, "density": 2e-4}"#;
    let scene = |pins: &str| {
        let garment = patch(fabric, 0.01, 0.012, WHOLE);
        format!(r#"{{"toile": 1, "garment": {garment}, "pins": [{pins}]}}"#)
    };
    let build = |pins: &str| {
        let scene = Scene::from_json(&scene(pins), None).unwrap();
        let sim = sim_scene::build(&scene).unwrap();
        (sim, scene)
    };
    let nodes = |sim: &Sim| -> Vec<u32> {
        let first = sim.point_of_node(0);
        let all = 0..sim.yarn_nodes().len() as u32;
        all.filter(|n| sim.is_pinned(first + n)).collect()
    };
    let (sim, _) = build(r#"{"panel": "p", "uv": [0.0045, 0.0062]}"#);
    let node = nodes(&sim)[0] as usize;
    let uv = sim.yarns().unwrap().uv[node];
    assert!(
        (uv.x - 0.0045).abs() < 1e-9 && (uv.y - 0.0065).abs() < 1e-9,
        "{uv}"
    );
    let (sim, _) = build(r#"{"yarn": 3, "end": "last"}"#);
    assert_eq!(nodes(&sim), [sim.yarn_end(3, 1).unwrap()]);
    let (sim, _) = build(r#"{"yarn": 13}"#);
    let mut whole = sim.yarn(13).unwrap();
    whole.sort_unstable();
    assert_eq!(nodes(&sim), whole);
    for (pins, text) in [
        (r#"{"yarn": 99}"#, "yarn 99 does not exist"),
        (r#"{"yarn": 3, "end": "middle"}"#, "first"),
        (r#"{"yarn": 3, "panel": "p"}"#, "number alone"),
        (r#"{"panel": "p", "edge": 0, "end": "last"}"#, "with yarn"),
        (r#"{"yarn": 3, "target": [0, 0, 0]}"#, "no single target"),
    ] {
        let error = sim_scene::sim_from_json(&scene(pins), None).err().unwrap();
        assert!(error.message.contains(text), "{}", error.message);
    }
    // the upper rim, which lets go at last
    let rim = r#"{"panel": "p", "edge": 2, "motion": [{"time": 0, "offset": [0, 0, 0]}, {"time": 1, "offset": [0, 1, 0]}],
        "until": 0.004}"#;
    let (mut sim, scene) = build(rim);
    assert_eq!(nodes(&sim).len(), 10);
    let options = DrapeOptions {
        force_tolerance: 1e-8,
        max_steps: 0,
    };
    let _ = sim.drape(&options, &mut |_| true).unwrap();
    let mesh = sim.yarns().unwrap();
    let weight = 2e-4 * 9.81 * length(mesh, sim.yarn_coordinates()).iter().sum::<f64>();
    let forces = sim.yarn_forces().unwrap();
    let borne: Vec3 = nodes(&sim).iter().map(|n| forces[*n as usize]).sum();
    println!("the pins bear {:.6e} N of {weight:.6e} N", -borne.y);
    assert!((borne.y / weight + 1.0).abs() < 1e-3, "{borne}");
    let mut driver = Driver::new(&sim, &scene).unwrap();
    let (from, node) = (sim.yarn_nodes().to_vec(), nodes(&sim)[0] as usize);
    for step in 1..=5 {
        driver
            .set(&mut sim, &scene, 1e-3 * f64::from(step))
            .unwrap();
        let _ = sim.step(1e-3).unwrap();
        if step == 4 {
            assert!((sim.yarn_nodes()[node] - from[node] - Vec3::y() * 4e-3).norm() < 1e-12);
        }
    }
    assert!(nodes(&sim).is_empty());
}

/// The first end of lace torn away in one step takes stitches with it, until two strands of one contact share the node that
/// they turn at: the mesh that is left holds, and every yarn keeps its length.
#[test]
fn an_end_torn_off_in_one_step_leaves_a_mesh_that_holds() {
    let lace = r#"{"chart": ["./o.", "...."], "loop_width": 0.004, "radius": 0.001, "fastened": false, "friction": 0}"#;
    let mut sim = sim(&patch(lace, 0.0291, 0.0175, WHOLE), 0.0, &[]);
    let before = length(sim.yarns().unwrap(), sim.yarn_coordinates());
    let end = sim.yarn_end(0, 0).unwrap();
    let way = Vec3::new(0.3456, 0.8216, 0.3304).normalize() * 0.064;
    let target = sim.yarn_nodes()[end as usize] + way;
    sim.pin_yarn_nodes(&[end], Some(&[target.into()])).unwrap();
    sim.step(8e-3).expect("step");
    order(&sim);
    let changes = sim.yarn_changes();
    assert!(changes.passages_gone > 0 && changes.nodes_split > 0);
    let now = length(sim.yarns().unwrap(), sim.yarn_coordinates());
    assert_eq!(before, now);
}

/// A step that fails leaves the state, the memory that hosts look at, and the epoch.
#[test]
fn a_step_that_fails_leaves_everything() {
    let mut sim = sim(
        &patch(r#"{"preset": "jersey"}"#, 0.0192, 0.0171, WHOLE),
        0.0,
        &[
            ("solver.newton.max_iterations", 1.0),
            ("solver.step.min", 1e-3),
        ],
    );
    let end = sim.yarn_end(0, 1).unwrap();
    let target = sim.yarn_nodes()[end as usize] + Vec3::new(0.2, 0.2, 0.0);
    sim.pin_yarn_nodes(&[end], Some(&[target.into()])).unwrap();
    let before = (sim.save().unwrap(), sim.epoch(), sim.yarn_epoch());
    let at = sim.positions().as_ptr();
    sim.step(1e-3).expect_err("one iteration cannot do it");
    assert_eq!(before, (sim.save().unwrap(), sim.epoch(), sim.yarn_epoch()));
    assert_eq!(at, sim.positions().as_ptr());
}
