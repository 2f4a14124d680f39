//! Yarns in hard cases: fabrics and charts at random, knits on a body that twists and kicks.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use crate::sheets::Random;
use crate::yarn_sims::{WHOLE, knit, patch, sim};
use toile::body::Body;
use toile::math::{Rotation, Vec3};
use toile::sim::{ContactSettings, Sim};

fn grows(sim: &Sim) {
    let (mesh, u) = (sim.yarns().unwrap(), sim.yarn_coordinates());
    for y in 0..mesh.yarn_count() {
        let range = mesh.starts[y] as usize..mesh.starts[y + 1] as usize;
        assert!(u[range].windows(2).all(|w| w[1] > w[0]), "yarn {y}");
    }
}

/// A patch of a fabric at random: weave or knit, any mask or chart of knits and purls, stiffness over two orders of
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
    let rows: Vec<String> = (0..4)
        .map(|_| (0..4).map(|_| signs[usize::from(part() < 0.5)]).collect())
        .collect();
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
