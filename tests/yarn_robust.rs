//! Yarns in hard cases: fabrics and charts at random, steps of any size, bodies that twist and kick, yarns that are jammed
//! or slack, no friction and much, pins that flatten what has curled.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::sheets::Random;
use crate::yarn_sims::{WHOLE, knit, patch, sim};
use toile::body::Body;
use toile::math::{Rotation, Vec3};
use toile::pattern::yarn_fabric::Mask;
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Sim};

fn grows(sim: &Sim) {
    let (mesh, u) = (sim.yarns().unwrap(), sim.yarn_coordinates());
    for y in 0..mesh.yarn_count() {
        let range = mesh.starts[y] as usize..mesh.starts[y + 1] as usize;
        assert!(u[range].windows(2).all(|w| w[1] > w[0]), "yarn {y}");
    }
}

/// A patch of a fabric at random: weave or knit, any mask that interlaces or chart of knits and purls, stiffness over two orders of
/// magnitude, friction from none to 2.
fn random_patch(seed: u64) -> (String, [f64; 2]) {
    let mut random = Random::new(seed);
    let mut part = || 0.5 + 0.5 * random.signed();
    let young = 1e6 * 100_f64.powf(part());
    let bending = 1e-4 * 100_f64.powf(part());
    let friction = [0.0, 0.1, 0.3, 2.0][(4.0 * part()) as usize % 4];
    let woven = part() < 0.33;
    let pitch = 1e-3 * 4_f64.powf(part());
    let radius = pitch * (0.1 + 0.15 * part());
    let signs = if woven { ['x', '.'] } else { ['-', '.'] };
    let rows = loop {
        let rows: Vec<String> = (0..4)
            .map(|_| (0..4).map(|_| signs[usize::from(part() < 0.5)]).collect())
            .collect();
        let lines: Vec<&str> = rows.iter().map(String::as_str).collect();
        // yarns that do not change sides make no weave
        if !woven || Mask::from_lines(&lines).is_ok() {
            break rows;
        }
    };
    let (key, size) = match woven {
        true => ("weave", "warp_pitch"),
        false => ("chart", "loop_width"),
    };
    let yarns = format!(
        r#"{{"{key}": {rows:?}, "{size}": {pitch}, "radius": {radius}, "young": {young},
            "bending": {bending}, "friction": {friction}}}"#
    );
    let size = match woven {
        true => [6.0 * pitch, 6.0 * pitch],
        false => [4.4 * pitch, 4.005 * pitch],
    };
    (patch(&yarns, size[0], size[1], WHOLE), size)
}

/// Hung by two nodes at its upper corners, each runs 100 steps of 1 ms, whatever comes off.
#[test]
fn fabrics_at_random_run_with_finite_energy() {
    let count = match std::env::var_os("TOILE_SOAK") {
        Some(_) => 100,
        None => 8,
    };
    for seed in 0..count {
        let (text, [width, height]) = random_patch(seed);
        let mut sim = sim(&text, -9.81, &[("solver.newton.relative_tolerance", 1e-2)]);
        let corners = [0.0, width].map(|x| sim.locate_yarn_node(0, [x, height]).unwrap());
        sim.pin_yarn_nodes(&corners, None).unwrap();
        for step in 0..100 {
            let report = match sim.step(1e-3) {
                Ok(report) => report,
                Err(e) => panic!("seed {seed}, step {step}: {}: {text}", e.message),
            };
            let energy = report.kinetic_energy + report.potential_energy;
            assert!(energy.is_finite(), "seed {seed}, step {step}");
        }
        grows(&sim);
        sim.yarns().unwrap().check().unwrap();
    }
}

/// Jersey that lies over a capsule stays on it while the capsule twists about its axis and kicks upwards, and no
/// node gets into it.
#[test]
fn a_knit_stays_on_a_body_that_twists_and_kicks() {
    let rough = [("solver.newton.relative_tolerance", 1e-2)];
    let mut sim = sim(&knit("stockinette", 6), 0.0, &rough);
    sim.set_number("gravity.z", -9.81).unwrap();
    let (radius, thickness) = (0.008, 1e-3);
    let contact = ContactSettings {
        friction: 0.5,
        thickness,
        stiffness: 1e7,
    };
    let body = Body::capsule(0.03, radius).unwrap();
    let body = sim.add_body(&body, &contact).unwrap();
    let axis = [0.0096, 0.0086, -radius - thickness - 2e-4];
    let lying = Rotation::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
    let pose = |sim: &mut Sim, turn: f64, kick: f64| {
        let rotation = Rotation::from_axis_angle(&Vec3::x_axis(), turn) * lying;
        let q = rotation.quaternion();
        let place = [axis[0], axis[1], axis[2] + kick];
        sim.set_body_pose(body, place, [q.i, q.j, q.k, q.w])
            .unwrap();
    };
    pose(&mut sim, 0.0, 0.0);
    let mut gap = f64::INFINITY;
    for step in 0..110 {
        // twice to and fro in 80 ms, after it has settled for 30
        let phase = f64::from((step - 30).max(0)) / 40.0 * std::f64::consts::TAU;
        pose(&mut sim, 0.3 * phase.sin(), 5e-4 * (1.0 - phase.cos()));
        gap = gap.min(sim.step(1e-3).expect("step").min_gap);
    }
    grows(&sim);
    let nodes = sim.yarn_nodes();
    let middle = nodes.iter().sum::<Vec3>() / nodes.len() as f64;
    let off = (nodes.iter())
        .map(|x| Vec3::new(0.0, x.y - axis[1], x.z - axis[2]).norm())
        .fold(0.0, f64::max);
    println!(
        "smallest gap {gap:.2e} m, middle {:.2e} m above the axis, farthest {off:.2e} m from it",
        middle.z - axis[2]
    );
    assert!(gap > 0.0, "{gap}");
    assert!(middle.z - axis[2] > 0.5 * radius, "{middle}");
    assert!(off < 2.5 * radius, "{off}");
}

/// Every contact that was laid is still there; a contact may have passed a node of one yarn.
fn keeps_its_contacts(sim: &Sim) {
    grows(sim);
    let mesh = sim.yarns().unwrap();
    mesh.check().unwrap();
    let changes = sim.yarn_changes();
    assert_eq!(changes.nodes_split, 0, "{changes:?}");
    assert_eq!(changes.passages_gone, changes.nodes_left, "{changes:?}");
    assert!(sim.yarn_nodes().iter().all(|x| x.norm() < 1.0));
}

fn rest(sim: &mut Sim) -> u64 {
    let options = DrapeOptions {
        force_tolerance: 1e-5,
        max_steps: 6000,
    };
    let report = sim.drape(&options, &mut |_| true).expect("drape");
    assert_eq!(report.outcome, Outcome::Converged, "{report:?}");
    report.newton_iterations
}

/// Jersey that has curled, held at its upper edge, gets weight across its plane: steps of 1, 5 and 10 ms (and 0.1 ms in
/// long runs) bring it to the same shape, within what friction leaves open, and no contact is lost.
#[test]
fn steps_of_any_size_bring_a_knit_to_the_same_rest() {
    let yarns = r#""preset": "jersey", "damping": {"mass": 20, "stiffness": 0.01}"#;
    let text = knit("stockinette", 6).replace(r#""preset": "jersey""#, yarns);
    let mut sim = sim(&text, 0.0, &[]);
    let held = sim.yarn_nodes_along(0, 2).unwrap();
    sim.pin_yarn_nodes(&held, None).unwrap();
    let _ = rest(&mut sim);
    sim.set_number("gravity.z", -9.81).unwrap();
    let start = sim.save().unwrap();
    let mut shapes: Vec<(f64, Vec<Option<Vec3>>)> = Vec::new();
    let finest = std::env::var_os("TOILE_SOAK").map(|_| 1e-4_f64);
    for dt in finest.into_iter().chain([1e-3, 5e-3, 1e-2]) {
        sim.restore(&start).unwrap();
        let mut newton = 0;
        let mut last = f64::INFINITY;
        for _ in 0..(0.25 / dt).round() as usize {
            let report = sim.step(dt).expect("step");
            newton += report.newton_iterations;
            last = report.kinetic_energy;
        }
        keeps_its_contacts(&sim);
        assert!(last < 1e-7, "{last} J at {dt} s");
        let mesh = sim.yarns().unwrap();
        let nodes = sim.yarn_nodes().iter().enumerate();
        let shape: Vec<Option<Vec3>> = nodes
            .map(|(n, x)| (!mesh.stack(n).is_empty()).then_some(*x))
            .collect();
        let low = sim
            .yarn_nodes()
            .iter()
            .fold(Vec3::repeat(1.0), |m, x| m.inf(x));
        let high = sim
            .yarn_nodes()
            .iter()
            .fold(Vec3::repeat(-1.0), |m, x| m.sup(x));
        let extent = (high - low).norm();
        let Some((first, reference)) = shapes.first() else {
            println!("{dt} s: {newton} Newton iterations");
            shapes.push((dt, shape));
            continue;
        };
        let apart: Vec<f64> = (shape.iter().zip(reference))
            .filter_map(|(a, b)| Some((a.as_ref()? - b.as_ref()?).norm()))
            .collect();
        let mean = (apart.iter().map(|d| d * d).sum::<f64>() / apart.len() as f64).sqrt();
        println!(
            "{dt} s: {newton} Newton iterations, {:.2} mm from the shape at {first} s, {:.1} % of its extent",
            1e3 * mean,
            1e2 * mean / extent
        );
        assert!(mean < 0.025 * extent, "{dt}: {mean} of {extent}");
    }
}

/// A torso that twists (hips against shoulders) and kicks (its end upwards) as a deforming mesh, faster than the knit can fall:
/// the knit comes to lie on it again, no node gets into it and no contact is lost.
#[test]
fn a_knit_stays_on_a_torso_that_deforms() {
    let rough = [("solver.newton.relative_tolerance", 1e-2)];
    let mut sim = sim(&knit("stockinette", 8), 0.0, &rough);
    sim.set_number("gravity.z", -9.81).unwrap();
    let (half, radius, thickness) = (0.016, 0.009, 1e-3);
    let contact = ContactSettings {
        friction: 0.5,
        thickness,
        stiffness: 1e7,
    };
    let (laid, triangles) = Body::capsule(half, radius).unwrap().display_mesh();
    // the capsule's axis becomes x
    let lying = Rotation::from_axis_angle(&Vec3::z_axis(), std::f64::consts::FRAC_PI_2);
    let laid: Vec<Vec3> = laid.iter().map(|x| lying * x).collect();
    let torso = |twist: f64, kick: f64| -> Vec<[f64; 3]> {
        let moved = |x: &Vec3| {
            let along = x.x / (half + radius);
            let turned = Rotation::from_axis_angle(&Vec3::x_axis(), twist * along) * x;
            // an oval trunk that bends at its middle
            let lift = kick * along.max(0.0).powi(2);
            [turned.x, 1.2 * turned.y, turned.z + lift]
        };
        laid.iter().map(moved).collect()
    };
    let body = Body::mesh(&torso(0.0, 0.0), &triangles, 1e-3).unwrap();
    let body = sim.add_body(&body, &contact).unwrap();
    let axis = [0.0126, 0.0111, -radius - thickness - 2e-4];
    sim.set_body_pose(body, axis, [0.0, 0.0, 0.0, 1.0]).unwrap();
    let mut gap = f64::INFINITY;
    let mut fastest = 0.0_f64;
    let mut before = torso(0.0, 0.0);
    for step in 0..150 {
        // three times to and fro in 90 ms, after it has settled for 30
        let phase = f64::from((step - 30).clamp(0, 90)) / 30.0 * std::f64::consts::TAU;
        let now = torso(0.5 * phase.sin(), 2e-3 * (1.0 - phase.cos()));
        let speed = |(a, b): (&[f64; 3], &[f64; 3])| 1e3 * (Vec3::from(*a) - Vec3::from(*b)).norm();
        fastest = now.iter().zip(&before).map(speed).fold(fastest, f64::max);
        sim.set_body_vertices(body, &now).unwrap();
        before = now;
        gap = gap.min(sim.step(1e-3).expect("step").min_gap);
        grows(&sim);
    }
    keeps_its_contacts(&sim);
    let nodes = sim.yarn_nodes();
    let middle = nodes.iter().sum::<Vec3>() / nodes.len() as f64 - Vec3::from(axis);
    println!("{fastest:.2} m/s, smallest gap {gap:.2e} m, middle {middle:.4?} m from the torso's");
    assert!(fastest > 0.3, "{fastest}");
    assert!(gap > 0.0, "{gap}");
    assert!(
        middle.z > 0.5 * radius && middle.xy().norm() < radius,
        "{middle}"
    );
}

/// Jersey pulled along its courses until its loops jam, let go until they are slack, without friction and with much: energies stay
/// finite, the order of contacts along the yarns is kept, and what jams keeps a part of its length.
#[test]
fn jammed_and_slack_loops_keep_their_order_for_any_friction() {
    for friction in [0.0, 2.0] {
        let yarns = format!(r#""preset": "jersey", "friction": {friction}"#);
        let text = knit("stockinette", 6).replace(r#""preset": "jersey""#, &yarns);
        let mut sim = sim(&text, 0.0, &[("solver.newton.relative_tolerance", 1e-2)]);
        let grips = [3, 1].map(|edge| sim.yarn_nodes_along(0, edge).unwrap());
        let laid = sim.yarns().unwrap().clone();
        let wide = 6.4 * 0.003;
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        // to 1.3 of its width in 30 ms, back to 0.6 in 70
        for step in 1..=100 {
            let t = f64::from(step);
            let stretch = if step <= 30 {
                0.01 * t
            } else {
                0.3 - 0.01 * (t - 30.0)
            };
            for (grip, side) in grips.iter().zip([-0.5, 0.5]) {
                let target = |n: &u32| {
                    let p = laid.uv[*n as usize];
                    [p.x + side * stretch * wide, p.y, 0.0]
                };
                let targets: Vec<[f64; 3]> = grip.iter().map(target).collect();
                sim.pin_yarn_nodes(grip, Some(&targets)).unwrap();
            }
            let report = sim.step(1e-3).expect("step");
            let energy = report.kinetic_energy + report.potential_energy;
            assert!(
                energy.is_finite() && energy < 1.0,
                "{friction}, {step}: {energy}"
            );
            keeps_its_contacts(&sim);
            let (mesh, u) = (sim.yarns().unwrap(), sim.yarn_coordinates());
            for (now, was) in u.windows(2).zip(mesh.incidences.windows(2)) {
                let part = (now[1] - now[0]) / (was[1].u - was[0].u);
                // passages of one yarn follow each other
                if was[1].u > was[0].u {
                    shortest = shortest.min(part);
                }
            }
            longest = sim.yarn_tensions().iter().fold(longest, |m, t| m.max(*t));
        }
        println!(
            "friction {friction}: shortest segment {shortest:.3} of its laid length, largest tension {longest:.2} N"
        );
        // it did jam, and slack yarn bears nothing to speak of
        assert!(longest > 1.0, "{longest}");
        let slack = sim
            .yarn_tensions()
            .iter()
            .fold(0.0_f64, |m, t| m.max(t.abs()));
        println!("largest tension when slack {slack:.4} N");
        assert!(slack < 0.1 * longest, "{slack} {longest}");
        assert!(shortest > 0.05, "{shortest}");
    }
}

/// Pins that flatten the rolled ends of curled jersey by centimetres in one drape bring it to rest, its yarns stretched by no more
/// than what has slid while it curled.
#[test]
fn pins_flatten_what_has_curled_in_one_drape() {
    let mut sim = sim(&knit("stockinette", 8), 0.0, &[]);
    let curl = rest(&mut sim);
    let laid = sim.yarns().unwrap().clone();
    let ends: Vec<u32> = [0, 2]
        .iter()
        .flat_map(|edge| sim.yarn_nodes_along(0, *edge).unwrap())
        .collect();
    let targets: Vec<[f64; 3]> = (ends.iter())
        .map(|n| [laid.uv[*n as usize].x, laid.uv[*n as usize].y, 0.0])
        .collect();
    let way = (ends.iter().zip(&targets))
        .map(|(n, t)| (sim.yarn_nodes()[*n as usize] - Vec3::from(*t)).norm())
        .fold(0.0, f64::max);
    sim.pin_yarn_nodes(&ends, Some(&targets)).unwrap();
    let flat = rest(&mut sim);
    keeps_its_contacts(&sim);
    let tension = sim.yarn_tensions().iter().fold(0.0_f64, |m, t| m.max(*t));
    println!(
        "{curl} Newton iterations to curl, {flat} to flatten by {way:.4} m; largest tension {tension:.1} N"
    );
    assert!(way > 5e-3, "{way}");
    // twice the length of a segment, at most
    assert!(tension < 2.0 * 17.7, "{tension}");
}

/// What hangs by a node of one yarn pulls the next contact towards it, which passes such a node elsewhere: at a pin
/// it stops where the yarns' thickness has no more room.
#[test]
fn contacts_stop_at_pinned_nodes() {
    let yarns = r#"{"chart": [".-o/", ".\\o.", "\\o--", "--.-"], "loop_width": 0.00108, "radius": 0.000153,
        "young": 4.1e6, "bending": 0.004, "friction": 0}"#;
    let (width, height) = (0.00476, 0.00433);
    let mut sim = sim(
        &patch(yarns, width, height, WHOLE),
        -9.81,
        &[("solver.newton.relative_tolerance", 1e-2)],
    );
    let corners = [0.0, width].map(|x| sim.locate_yarn_node(0, [x, height]).unwrap());
    sim.pin_yarn_nodes(&corners, None).unwrap();
    let mut least = 1.0_f64;
    for step in 0..100 {
        if let Err(e) = sim.step(1e-3) {
            panic!("step {step}: {}", e.message);
        }
        let (mesh, u) = (sim.yarns().unwrap(), sim.yarn_coordinates());
        for y in 0..mesh.yarn_count() {
            for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
                let [a, b] = [i - 1, i].map(|i| mesh.incidences[i]);
                if corners.contains(&a.node) || corners.contains(&b.node) {
                    least = least.min((u[i] - u[i - 1]) / (b.u - a.u));
                }
            }
        }
    }
    println!("least {least:.3} of the laid length");
    // the contact has come to the pin and is fixed by the end of the step in which less than a fifth is left
    assert!(least > 0.18 && least < 0.4, "{least}");
}
