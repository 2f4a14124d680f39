//! Sheets thrown at each other do not cross, and edges through triangles are found.

#![allow(clippy::expect_used, reason = "test code")]

use crate::self_contact_cases::{Random, at, squares, state};
use std::time::Instant;
use toile::cloth::Cloth;
use toile::math::block::{BlockMatrix, BlockPattern};
use toile::math::parallel::Workers;
use toile::math::topology::edges;
use toile::math::{Mat3, Vec3};
use toile::solve::linear::choose::{Made, solver};
use toile::system::contact::crossing::{crossings, crossings_with, passes};
use toile::system::contact::self_contact::SelfContact;
use toile::system::points::Points;
use toile::system::state::State;
use toile::system::term::{HessianKind, Term};

const CELLS: usize = 10;
const SPACING: f64 = 0.02;

struct Outcome {
    crossed: usize,
    touched: usize,
    cuts: usize,
    steps: usize,
    /// Whether the upper sheet ended below the lower one.
    passed: bool,
}

/// Two panels, the lower one held at its border, the upper one above it and shifted.
struct Sheets {
    cloth: Cloth,
    held: Vec<bool>,
    springs: Vec<([u32; 2], f64)>,
    state: State,
}

fn sheets(speed: f64) -> Sheets {
    let cloth = squares(2, CELLS, SPACING);
    let half = cloth.mesh.uv.len() / 2;
    let far = CELLS as f64 * SPACING - 1e-9;
    let mut random = Random(4);
    let mut x = Vec::new();
    let mut held = Vec::new();
    for (i, p) in cloth.mesh.uv.iter().enumerate() {
        let up = if i >= half {
            Vec3::new(0.37, 1.5, 0.21) * SPACING
        } else {
            Vec3::zeros()
        };
        x.push(Vec3::new(p.x, 0.0, p.y) + up + random.vector() * (0.01 * SPACING));
        held.push(i < half && (p.x < 1e-9 || p.y < 1e-9 || p.x > far || p.y > far));
    }
    let springs = edges(&cloth.mesh.triangles)
        .into_iter()
        .map(|e| {
            (
                e,
                (cloth.mesh.uv[e[0] as usize] - cloth.mesh.uv[e[1] as usize]).norm(),
            )
        })
        .collect();
    let mut state = state(x);
    for v in &mut state.velocities[half..] {
        *v = Vec3::new(0.0, -speed, 0.0);
    }
    Sheets {
        cloth,
        held,
        springs,
        state,
    }
}

/// Three Newton iterations of backward Euler, springs of 100 N/m along edges.
fn implicit(sheets: &Sheets, contact: &SelfContact, dt: f64) -> Vec<Vec3> {
    let x0 = &sheets.state.positions;
    let n = x0.len();
    let pattern = BlockPattern::from_stencils(n, |sink| {
        for (e, _) in &sheets.springs {
            sink(e);
        }
        for e in 0..contact.stencils().count() {
            sink(contact.stencils().get(e));
        }
    });
    let mut solver = solver(0, n, Made::Triangles(None), &Workers::default());
    let mut x: Vec<Vec3> = x0.clone();
    let mut dx = vec![Vec3::zeros(); n];
    for _ in 0..3 {
        let mut matrix = BlockMatrix::zeros(pattern.clone());
        let mut force = vec![Vec3::zeros(); n];
        for i in 0..n {
            // A held vertex is a very heavy one at rest.
            let mass = sheets.cloth.masses[i] * if sheets.held[i] { 1e6 } else { 1.0 };
            let start = if sheets.held[i] {
                Vec3::zeros()
            } else {
                sheets.state.velocities[i] * dt
            };
            matrix.blocks[matrix.pattern.starts[i] as usize] +=
                Mat3::identity() * (mass / (dt * dt));
            force[i] = (x0[i] + start - x[i]) * (mass / (dt * dt));
            force[i].y -= 9.81 * sheets.cloth.masses[i];
        }
        let mut add = |[a, b]: [u32; 2], g: Vec3, h: Mat3| {
            for v in [a, b] {
                matrix.blocks[matrix.pattern.starts[v as usize] as usize] += h;
            }
            let slot = matrix
                .pattern
                .slot(a.max(b), a.min(b))
                .expect("in the pattern");
            matrix.blocks[slot] -= h;
            force[a as usize] += g;
            force[b as usize] -= g;
        };
        for &(e, rest) in &sheets.springs {
            let w = x[e[1] as usize] - x[e[0] as usize];
            let n = w.normalize();
            let tension = 100.0 * (w.norm() - rest);
            let across = Mat3::identity() - n * n.transpose();
            add(
                e,
                n * tension,
                n * n.transpose() * 100.0 + across * (tension.max(0.0) / w.norm()),
            );
        }
        for e in 0..contact.stencils().count() {
            let here = at(&x, x0, dt);
            let mut g = [Vec3::zeros(); 2];
            let mut h = [Mat3::zeros(); 3];
            contact.gradient(e, &here, &mut g);
            contact.hessian(e, &here, HessianKind::Psd, &mut h);
            let pair = contact.stencils().get(e);
            add([pair[0], pair[1]], -g[0], h[0]);
        }
        solver.prepare(&matrix).expect("positive definite");
        solver
            .solve(&matrix, &force, &mut dx, 1e-8)
            .expect("solves");
        for (x, dx) in x.iter_mut().zip(&dx) {
            *x += dx;
        }
    }
    x
}

/// A sheet thrown down onto the other, steps cut by `max_travel`.
fn throw(speed: f64, stiffness: f64, dt: f64, time: f64) -> Outcome {
    let mut sheets = sheets(speed);
    let mut contact = SelfContact::new(
        &sheets.cloth,
        &Points::new(&sheets.cloth, None),
        None,
        stiffness,
        0.3,
    )
    .expect("valid");
    let mut outcome = Outcome {
        crossed: 0,
        touched: 0,
        cuts: 0,
        steps: 0,
        passed: false,
    };
    let mut now = 0.0;
    while now < time {
        let x0 = sheets.state.positions.clone();
        let mut step = dt;
        let x = loop {
            contact.begin_step(&sheets.state, &at(&x0, &x0, step));
            let x = implicit(&sheets, &contact, step);
            if stiffness == 0.0 || contact.max_travel(&x0, &x).part >= 1.0 {
                break x;
            }
            step *= 0.5;
            outcome.cuts += 1;
            assert!(step > 1e-8, "the step is cut for ever");
        };
        let touched = (0..contact.stencils().count())
            .filter(|&e| contact.value(e, &at(&x, &x0, step)) > 0.0)
            .count();
        outcome.touched = outcome.touched.max(touched);
        outcome.steps += 1;
        for (v, (x, x0)) in sheets.state.velocities.iter_mut().zip(x.iter().zip(&x0)) {
            *v = (x - x0) / step;
        }
        sheets.state.positions.clone_from(&x);
        contact.accept(&at(&x, &x0, step), &mut sheets.state);
        now += step;
        let found = crossings(&sheets.cloth.mesh.triangles, &x, &[], 1_000).expect("finite");
        outcome.crossed = outcome.crossed.max(found.len());
    }
    let (lower, upper) = sheets.state.positions.split_at(sheets.held.len() / 2);
    let height = |part: &[Vec3]| part.iter().map(|p| p.y).sum::<f64>() / part.len() as f64;
    outcome.passed = height(upper) < height(lower);
    outcome
}

/// At 1 to 20 m/s, with steps in which they would pass each other, sheets meet and do not cross;
/// without contact they do.
#[test]
fn sheets_thrown_at_each_other_do_not_cross() {
    for (speed, dt, time) in [(1.0, 5e-3, 0.2), (5.0, 5e-3, 0.1), (20.0, 2e-3, 0.03)] {
        let with = throw(speed, 1e6, dt, time);
        let without = throw(speed, 0.0, dt, time);
        println!(
            "{speed} m/s: {} pairs touch, {} steps, {} cuts, {} crossings; without contact {}, passed {}",
            with.touched, with.steps, with.cuts, with.crossed, without.crossed, without.passed
        );
        assert!(with.touched > 50);
        assert_eq!(with.crossed, 0, "at {speed} m/s");
        assert!(!with.passed, "at {speed} m/s");
        assert!(without.passed, "nothing to prevent at {speed} m/s");
    }
}

/// A step that jumps to the other side is cut to before the contact; common motion is free.
#[test]
fn travel_is_cut_where_sheets_would_pass() {
    let cloth = squares(2, CELLS, SPACING);
    let half = cloth.mesh.uv.len() / 2;
    let contact =
        SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
    let place = |height: f64| -> Vec<Vec3> {
        cloth
            .mesh
            .uv
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let up = if i < half { 0.0 } else { height };
                Vec3::new(p.x, up, p.y)
            })
            .collect()
    };
    let x0 = place(0.1);
    let part = contact.max_travel(&x0, &place(-0.1)).part;
    let safe = contact.spheres().safe_distance(0, half as u32);
    assert!(
        (part * 0.2 - (0.1 - safe)).abs() < 1e-3,
        "part {part}, safe distance {safe}"
    );
    let moved: Vec<Vec3> = x0.iter().map(|p| p + Vec3::new(3.0, -5.0, 1.0)).collect();
    assert_eq!(contact.max_travel(&x0, &moved).part, 1.0);
    assert_eq!(contact.max_travel(&x0, &x0).part, 1.0);
    let apart = contact.max_travel(&place(1e-3), &place(0.2)).part;
    assert_eq!(apart, 1.0, "parting layers are never held");
    let pressed = contact.max_travel(&place(1e-3), &place(-1e-3)).part;
    assert!(pressed > 0.1 && pressed < 0.2, "{pressed}");
}

/// Travel agrees with following all pairs in small steps.
#[test]
fn travel_agrees_with_brute_force() {
    let cloth = squares(2, 4, SPACING);
    let contact =
        SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
    let spheres = contact.spheres();
    let mut cut = 0;
    for seed in 0..30 {
        let mut random = Random(seed);
        let n = cloth.mesh.uv.len();
        let x0: Vec<Vec3> = cloth
            .mesh
            .uv
            .iter()
            .enumerate()
            .map(|(i, p)| {
                let up = if i < n / 2 { 0.0 } else { 0.03 };
                Vec3::new(p.x, up, p.y) + random.vector() * 0.002
            })
            .collect();
        let x: Vec<Vec3> = x0.iter().map(|p| p + random.vector() * 0.02).collect();
        let mut expected = 1.0_f64;
        for a in 0..n {
            for b in a + 1..n {
                if spheres.excluded(a as u32, b as u32) {
                    continue;
                }
                let limit = spheres
                    .safe_distance(a as u32, b as u32)
                    .min(0.7 * (x0[b] - x0[a]).norm());
                for s in 0..=2_000 {
                    let t = f64::from(s) / 2_000.0;
                    let d = (x0[b].lerp(&x[b], t) - x0[a].lerp(&x[a], t)).norm();
                    if d < limit {
                        expected = expected.min(t);
                        break;
                    }
                }
            }
        }
        let part = contact.max_travel(&x0, &x).part;
        cut += usize::from(part < 1.0);
        assert!((part - expected).abs() < 2e-3, "{part} {expected}");
    }
    assert!(cut > 5, "only {cut} of 30 were cut");
}

/// Every crossing that comparing all with all finds is found, and glue is respected.
#[test]
fn crossings_agree_with_brute_force() {
    let cloth = squares(2, 8, SPACING);
    let t = &cloth.mesh.triangles;
    let mut random = Random(12);
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .map(|p| Vec3::new(p.x, 0.0, p.y) + random.vector() * SPACING)
        .collect();
    let glued = [[3_u32, 90], [40, 41], [100, 20]];
    let mut expected = Vec::new();
    for e in edges(t) {
        for (k, tri) in t.iter().enumerate() {
            let ignored = e.iter().any(|v| {
                tri.contains(v)
                    || glued.iter().any(|g| {
                        (g[0] == *v && tri.contains(&g[1])) || (g[1] == *v && tri.contains(&g[0]))
                    })
            });
            if !ignored && passes(&e.map(|v| x[v as usize]), &tri.map(|v| x[v as usize])) {
                expected.push((e, k as u32));
            }
        }
    }
    let found = crossings(t, &x, &glued, usize::MAX).expect("finite");
    assert!(found.len() > 100);
    assert_eq!(found, expected);
    assert_eq!(crossings(t, &x, &glued, 7).expect("finite"), expected[..7]);
    let other: Vec<Vec3> = x
        .iter()
        .map(|p| p + Vec3::new(0.003, 0.001, 0.002))
        .collect();
    let mut expected = Vec::new();
    for e in edges(t) {
        for (k, tri) in t.iter().enumerate() {
            if passes(&e.map(|v| x[v as usize]), &tri.map(|v| other[v as usize])) {
                expected.push((e, k as u32));
            }
        }
    }
    assert_eq!(
        crossings_with(t, &x, t, &other, usize::MAX).expect("finite"),
        expected
    );
    assert!(crossings(&[[0, 1, 9]], &x[..3], &[], 1).is_err());
    assert!(crossings(&[[0, 1, 2]], &[Vec3::repeat(f64::NAN); 3], &[], 1).is_err());
}

/// A line through an edge or a corner of a surface is found; coplanar and touching from above is
/// not; a hair's breadth decides exactly.
#[test]
fn degenerate_crossings_are_decided() {
    let [a, b, c] = [Vec3::zeros(), Vec3::x(), Vec3::z()];
    let down = |x: f64, z: f64, from: f64, to: f64| [Vec3::new(x, from, z), Vec3::new(x, to, z)];
    assert!(passes(&down(0.2, 0.2, 1.0, -1.0), &[a, b, c]));
    assert!(
        passes(&down(0.5, 0.0, 1.0, -1.0), &[a, b, c]),
        "through an edge"
    );
    assert!(
        passes(&down(0.0, 0.0, 1.0, -1.0), &[a, b, c]),
        "through a corner"
    );
    assert!(!passes(&down(0.6, 0.6, 1.0, -1.0), &[a, b, c]));
    assert!(
        !passes(&down(0.2, -1e-17, 1.0, -1.0), &[a, b, c]),
        "outside by a hair"
    );
    assert!(
        passes(&down(0.2, 1e-17, 1.0, -1.0), &[a, b, c]),
        "inside by a hair"
    );
    assert!(
        !passes(
            &[Vec3::new(-1.0, 0.0, 0.2), Vec3::new(2.0, 0.0, 0.2)],
            &[a, b, c]
        ),
        "coplanar"
    );
    assert!(!passes(&down(0.2, 0.2, 1.0, 1e-300), &[a, b, c]));
    assert!(!passes(&down(0.2, 0.2, 1.0, -1.0), &[a, a, b]), "no area");
    // A chain p - v - q through the triangle with v exactly on it is found once.
    let v = Vec3::new(0.2, 0.0, 0.2);
    let [p, q] = down(0.2, 0.2, 1.0, -1.0);
    assert!(passes(&[p, v], &[a, b, c]) != passes(&[v, q], &[a, b, c]));
}

/// The whole cloth of a garment is checked fast. Prints the time; asserts only the answer.
#[test]
fn twenty_thousand_triangles_are_searched() {
    let cloth = squares(2, 71, 0.01);
    let half = cloth.mesh.uv.len() / 2;
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let wave = 0.02 * (9.0 * p.x).sin() * (7.0 * p.y).cos();
            Vec3::new(p.x, wave + if i < half { 0.0 } else { 0.05 }, p.y)
        })
        .collect();
    let start = Instant::now();
    let found = crossings(&cloth.mesh.triangles, &x, &[], 1_000).expect("finite");
    let checked = start.elapsed();
    assert!(found.is_empty());
    let start = Instant::now();
    let mut contact =
        SelfContact::new(&cloth, &Points::new(&cloth, None), None, 1e6, 0.3).expect("valid");
    let built = start.elapsed();
    let mut state = state(x.clone());
    for (v, p) in state.velocities.iter_mut().zip(&x) {
        *v = Vec3::new(p.z, -3.0, p.x);
    }
    contact.begin_step(&state, &at(&x, &x, 1e-2));
    let start = Instant::now();
    contact.begin_step(&state, &at(&x, &x, 1e-2));
    let begun = start.elapsed();
    let end: Vec<Vec3> = x
        .iter()
        .zip(&state.velocities)
        .map(|(x, v)| x + v * 0.01)
        .collect();
    let start = Instant::now();
    let part = contact.max_travel(&x, &end).part;
    let travelled = start.elapsed();
    assert_eq!(part, 1.0);
    println!(
        "{} triangles: crossings {checked:.1?}, build {built:.1?}, begin_step {begun:.1?} ({} pairs), travel {travelled:.1?}, {} bytes a vertex",
        cloth.mesh.triangles.len(),
        contact.stencils().count(),
        contact.bytes() / x.len()
    );
}
