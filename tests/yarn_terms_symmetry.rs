//! Symmetries of the yarns' energies: no net force, no torque, rigid motion costs nothing and is not damped;
//! sliding unknowns or constants give the same forces; no state gives anything but numbers.

use crate::terms_cases::{gradient, hessian, rounding, sample};
use crate::yarn_cases::{BEFORE, P, WORLD, cloth, every, lay, stitch, weave};
use toile::math::{Rotation, Vec2, Vec3};
use toile::system::term::{Configuration, HessianKind};
use toile::system::yarn::unknowns::Unknowns;
use toile::yarn::Family;

#[test]
fn internal_terms_have_no_net_force_and_no_torque() {
    every(|cloth, term, case| {
        if !term.is_internal() {
            return;
        }
        let at = case.at();
        for e in sample(term) {
            let g = gradient(term, e, &at);
            let v = term.stencils().get(e);
            let noise = rounding(term, e, &at);
            let size = g.iter().map(|g| g.norm()).fold(0.0, f64::max);
            let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
            let origin = case.x[v[0] as usize];
            for (g, &v) in g.iter().zip(v).filter(|(_, v)| cloth.is_position(**v)) {
                force += g;
                torque += (case.x[v as usize] - origin).cross(g);
            }
            let name = term.name();
            assert!(
                force.norm() < 1e-9 * size + noise,
                "{name} {}: {force}",
                case.name
            );
            assert!(
                torque.norm() < (1e-8 * size + noise) * P,
                "{name} {}: {torque}",
                case.name
            );
        }
    });
}

#[test]
fn internal_energies_are_invariant_under_rigid_motion() {
    let turn = Rotation::from_euler_angles(-0.8, 0.5, 1.9);
    let shift = Vec3::new(0.2, 0.1, -0.4);
    every(|cloth, term, case| {
        if !term.is_internal() {
            return;
        }
        let first = cloth.unknowns.first_slide as usize;
        let moved = |x: &[Vec3]| -> Vec<Vec3> {
            let place = |(b, p): (usize, &Vec3)| if b < first { turn * p + shift } else { *p };
            x.iter().enumerate().map(place).collect()
        };
        let (mx, mx0) = (moved(&case.x), moved(&case.x0));
        let at = case.at();
        let after = Configuration {
            x: &mx,
            x0: &mx0,
            ..at
        };
        for e in sample(term) {
            let (a, b) = (term.value(e, &at), term.value(e, &after));
            let noise = P * rounding(term, e, &at);
            assert!(
                (a - b).abs() <= 1e-9 * a.abs() + noise,
                "{} {}: {a} {b}",
                term.name(),
                case.name
            );
        }
        // a rigid motion during the step is not damped
        let still = Configuration { inv_dt: 0.0, ..at };
        let slow = Configuration {
            x: &mx,
            x0: &case.x,
            inv_dt: 100.0,
            ..at
        };
        for e in sample(term) {
            let (a, b) = (gradient(term, e, &slow), gradient(term, e, &still));
            let size = b.iter().map(|g| g.norm()).fold(0.0, f64::max);
            let noise = rounding(term, e, &slow);
            for ((a, b), &v) in a.iter().zip(&b).zip(term.stencils().get(e)) {
                let b = if cloth.is_position(v) { turn * b } else { *b };
                assert!(
                    (a - b).norm() < 1e-6 * size + noise,
                    "{} is damped at {}: {a} {b}",
                    term.name(),
                    case.name
                );
            }
        }
    });
}

/// Forces on the nodes do not depend on which coordinates are unknowns.
#[test]
fn frozen_and_sliding_coordinates_give_the_same_forces() {
    for mesh in [weave(5, 4), stitch()] {
        let mut reference: Option<Vec<Vec3>> = None;
        for stride in [0, 1, 2, 3] {
            let cloth = cloth("", mesh.clone(), |i| stride > 0 && i % stride == 0);
            let mut random = crate::sheets::Random::new(3);
            let x: Vec<Vec3> = cloth
                .laid()
                .iter()
                .map(|p| p + random.vec3(0.2 * P))
                .collect();
            let u: Vec<f64> = cloth
                .u()
                .iter()
                .map(|u| u + 0.1 * P * random.signed())
                .collect();
            let blocks = cloth.blocks(&x, &u);
            let at = Configuration {
                x: &blocks,
                x0: &blocks,
                u: &u,
                inv_dt: 0.0,
                world: &WORLD,
            };
            let mut sum = vec![Vec3::zeros(); blocks.len()];
            for term in cloth.terms.iter().filter(|t| !t.is_idle(&at)) {
                for e in 0..term.stencils().count() {
                    let g = gradient(term.as_ref(), e, &at);
                    for (g, &v) in g.iter().zip(term.stencils().get(e)) {
                        sum[v as usize] += g;
                    }
                }
            }
            sum.truncate(cloth.unknowns.first_slide as usize);
            let size = sum.iter().map(|g| g.norm()).fold(0.0, f64::max);
            match &reference {
                None => reference = Some(sum),
                Some(first) => {
                    for (a, b) in first.iter().zip(&sum) {
                        assert!((a - b).norm() <= 1e-12 * size);
                    }
                }
            }
        }
    }
}

#[test]
fn totally_degenerate_states_stay_finite() {
    every(|cloth, term, case| {
        let first = cloth.unknowns.first_slide as usize;
        let point: Vec<Vec3> = with(&case.x, first, |_| Vec3::new(0.1, 0.2, 0.3));
        let line = with(&case.x, first, |k| Vec3::new(k as f64 * P, 0.0, 0.0));
        // back and forth: every yarn is folded onto itself
        let fold = with(&case.x, first, |k| Vec3::new((k % 2) as f64 * P, 0.0, 0.0));
        for x in [&point, &line, &fold] {
            let at = Configuration {
                x,
                x0: &point,
                ..case.at()
            };
            for e in 0..term.stencils().count() {
                let finite = term.value(e, &at).is_finite()
                    && gradient(term, e, &at)
                        .iter()
                        .all(|g| g.iter().all(|v| v.is_finite()));
                assert!(finite, "{} of {}", term.name(), cloth.name);
                for kind in [HessianKind::Psd, HessianKind::Exact] {
                    let h = hessian(term, e, &at, kind);
                    assert!(h.iter().all(|v| v.is_finite()), "{}", term.name());
                }
            }
        }
    });
}

fn with(x: &[Vec3], first: usize, f: impl Fn(usize) -> Vec3) -> Vec<Vec3> {
    let place = |(b, p): (usize, &Vec3)| if b < first { f(b) } else { *p };
    x.iter().enumerate().map(place).collect()
}

/// A node's coordinates fill blocks of three in the order of its stack; what cannot slide is refused.
#[test]
fn coordinates_of_a_node_share_blocks_of_three() {
    let uv = vec![Vec2::zeros(); 9];
    let yarns: Vec<(Family, Vec<u32>)> = (0..4)
        .map(|y| (Family::Course, vec![2 * y + 1, 0, 2 * y + 2]))
        .collect();
    let mesh = lay(uv, &yarns, |n| match n {
        0 => vec![(2, 0), (0, 0), (3, 1), (1, 1)],
        _ => vec![],
    });
    let mut wanted: Vec<bool> = mesh.incidences.iter().map(|i| i.slides).collect();
    let all = Unknowns::new(&mesh, 5, 20, &wanted).expect("unknowns");
    assert_eq!((all.slide_blocks(), all.sliding()), (2, 4));
    assert_eq!((&all.owners[..], &all.used[..]), (&[0, 0][..], &[3, 1][..]));
    let middle = [1, 4, 7, 10].map(|i| all.slides[i]);
    assert_eq!(
        middle,
        [Some((20, 1)), Some((21, 0)), Some((20, 0)), Some((20, 2))]
    );
    wanted[0] = true;
    let refused = Unknowns::new(&mesh, 5, 20, &wanted).expect_err("an end cannot slide");
    assert!(
        refused.to_string().contains("passage 0 at node 1"),
        "{refused}"
    );
    assert!(Unknowns::new(&mesh, 5, 20, &wanted[1..]).is_err());
}

/// A step must leave a fifth of each segment's material in it; a segment without material has no finite energy.
#[test]
fn segments_keep_material() {
    let mut cloth = cloth("", weave(5, 4), |_| true);
    let (x, u) = (cloth.laid(), cloth.u());
    let start = cloth.blocks(&x, &u);
    let mut now = u.clone();
    // the second passage of the first yarn moves half a pitch beyond its neighbour
    now[1] += 1.5 * P;
    let moved = cloth.blocks(&x, &now);
    let at = Configuration {
        x: &moved,
        x0: &start,
        u: &u,
        inv_dt: 0.0,
        world: &WORLD,
    };
    let (mut part, mut between) = (1.0_f64, [0; 2]);
    let mut highest = 0.0_f64;
    for term in &mut cloth.terms {
        let most = term.max_step(&at);
        if most.part < part {
            (part, between) = (most.part, most.points);
        }
        for e in 0..term.stencils().count() {
            highest = highest.max(term.value(e, &at));
        }
    }
    assert!((part - 0.8 / 1.5).abs() < 1e-9, "{part}");
    let nodes = [1, 2].map(|i| BEFORE + cloth.mesh.incidences[i].node);
    assert_eq!(between, nodes, "of the segment that has none left");
    assert!(highest.is_infinite());
}
