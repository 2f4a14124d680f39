//! Sheets thrown at each other do not cross, and edges through triangles are found.

mod self_contact_cases;

use self_contact_cases::{Random, at, squares, state};
use std::time::Instant;
use toile::math::Vec3;
use toile::system::contact::crossing::{crossings, crossings_with, edges, passes};
use toile::system::contact::self_contact::SelfContact;
use toile::system::term::Term;

const CELLS: usize = 10;
const SPACING: f64 = 0.02;

struct Outcome {
    crossed: usize,
    touched: usize,
    substeps: usize,
}

/// A sheet thrown down onto one whose border is held: springs along edges, symplectic Euler, the
/// step cut by `max_travel`.
fn throw(speed: f64, stiffness: f64, dt: f64, time: f64) -> Outcome {
    let cloth = squares(2, CELLS, SPACING);
    let half = cloth.mesh.uv.len() / 2;
    let mut random = Random(4);
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let up = i >= half;
            let shift = if up {
                Vec3::new(0.37, 1.5, 0.21) * SPACING
            } else {
                Vec3::zeros()
            };
            Vec3::new(p.x, 0.0, p.y) + shift + random.vector() * (0.01 * SPACING)
        })
        .collect();
    let held: Vec<bool> = cloth
        .mesh
        .uv
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let far = CELLS as f64 * SPACING - 1e-9;
            i < half && (p.x < 1e-9 || p.y < 1e-9 || p.x > far || p.y > far)
        })
        .collect();
    let springs: Vec<([u32; 2], f64)> = edges(&cloth.mesh.triangles)
        .into_iter()
        .map(|e| {
            (
                e,
                (cloth.mesh.uv[e[0] as usize] - cloth.mesh.uv[e[1] as usize]).norm(),
            )
        })
        .collect();
    let mut contact = SelfContact::new(&cloth, stiffness, 0.3).expect("valid");
    let mut state = state(x);
    for v in &mut state.velocities[half..] {
        *v = Vec3::new(0.0, -speed, 0.0);
    }
    let mut outcome = Outcome {
        crossed: 0,
        touched: 0,
        substeps: 0,
    };
    let mut now = 0.0;
    let mut check = 0.0;
    while now < time {
        let mut step = dt;
        let x0 = state.positions.clone();
        contact.begin_step(&state, &at(&x0, &x0, step));
        let mut force: Vec<Vec3> = cloth
            .masses
            .iter()
            .map(|m| Vec3::new(0.0, -9.81 * m, 0.0))
            .collect();
        for &([a, b], rest) in &springs {
            let (a, b) = (a as usize, b as usize);
            let w = x0[b] - x0[a];
            let v = state.velocities[b] - state.velocities[a];
            let n = w.normalize();
            let pull = n * (100.0 * (w.norm() - rest) + 2e-3 * n.dot(&v));
            force[a] += pull;
            force[b] -= pull;
        }
        let mut touched = 0;
        for e in 0..contact.stencils().count() {
            let mut g = [Vec3::zeros(); 2];
            contact.gradient(e, &at(&x0, &x0, step), &mut g);
            touched += usize::from(g[0] != Vec3::zeros());
            for (i, g) in contact.stencils().get(e).iter().zip(g) {
                force[*i as usize] -= g;
            }
        }
        outcome.touched = outcome.touched.max(touched);
        let mut x = x0.clone();
        let mut v = state.velocities.clone();
        loop {
            for i in 0..x.len() {
                v[i] = if held[i] {
                    Vec3::zeros()
                } else {
                    state.velocities[i] + force[i] * (step / cloth.masses[i])
                };
                x[i] = x0[i] + v[i] * step;
            }
            let part = if stiffness > 0.0 {
                contact.max_travel(&x0, &x)
            } else {
                1.0
            };
            if part >= 1.0 {
                break;
            }
            step *= (0.9 * part).clamp(0.05, 0.9);
            outcome.substeps += 1;
            assert!(step > 1e-9, "the step is cut for ever");
        }
        (state.positions, state.velocities) = (x, v);
        let x = state.positions.clone();
        contact.accept(&at(&x, &x0, step), &mut state);
        now += step;
        if now >= check {
            check += time / 50.0;
            let found = crossings(&cloth.mesh.triangles, &x, &[], 1_000).expect("finite");
            outcome.crossed = outcome.crossed.max(found.len());
        }
    }
    outcome
}

/// At 1 to 20 m/s sheets meet and do not cross; without contact they do.
#[test]
fn sheets_thrown_at_each_other_do_not_cross() {
    for (speed, time, stiffness, dt) in [
        (1.0, 0.06, 1e6, 1e-4),
        (5.0, 0.02, 1e6, 1e-4),
        (20.0, 0.006, 1e6, 1e-4),
        (100.0, 0.001, 1e8, 1.5e-5),
    ] {
        let with = throw(speed, stiffness, dt, time);
        let without = throw(speed, 0.0, dt, time);
        println!(
            "{speed} m/s: {} pairs touch, {} cuts, {} crossings; {} without contact",
            with.touched, with.substeps, with.crossed, without.crossed
        );
        assert!(with.touched > 50);
        assert_eq!(with.crossed, 0, "at {speed} m/s");
        assert!(without.crossed > 20, "nothing to prevent at {speed} m/s");
    }
}

/// A step that jumps to the other side is cut to before the contact; common motion is free.
#[test]
fn travel_is_cut_where_sheets_would_pass() {
    let cloth = squares(2, CELLS, SPACING);
    let half = cloth.mesh.uv.len() / 2;
    let contact = SelfContact::new(&cloth, 1e6, 0.3).expect("valid");
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
    let part = contact.max_travel(&x0, &place(-0.1));
    let safe = contact.spheres().safe_distance(0, half as u32);
    assert!(
        (part * 0.2 - (0.1 - safe)).abs() < 1e-3,
        "part {part}, safe distance {safe}"
    );
    let moved: Vec<Vec3> = x0.iter().map(|p| p + Vec3::new(3.0, -5.0, 1.0)).collect();
    assert_eq!(contact.max_travel(&x0, &moved), 1.0);
    assert_eq!(contact.max_travel(&x0, &x0), 1.0);
    let apart = contact.max_travel(&place(1e-3), &place(0.2));
    assert_eq!(apart, 1.0, "parting layers are never held");
    let pressed = contact.max_travel(&place(1e-3), &place(-1e-3));
    assert!(pressed > 0.1 && pressed < 0.2, "{pressed}");
}

/// Travel agrees with following all pairs in small steps.
#[test]
fn travel_agrees_with_brute_force() {
    let cloth = squares(2, 4, SPACING);
    let contact = SelfContact::new(&cloth, 1e6, 0.3).expect("valid");
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
        let part = contact.max_travel(&x0, &x);
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
    let mut contact = SelfContact::new(&cloth, 1e6, 0.3).expect("valid");
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
    let part = contact.max_travel(&x, &end);
    let travelled = start.elapsed();
    assert_eq!(part, 1.0);
    println!(
        "{} triangles: crossings {checked:.1?}, build {built:.1?}, begin_step {begun:.1?} ({} pairs), travel {travelled:.1?}, {} bytes a vertex",
        cloth.mesh.triangles.len(),
        contact.stencils().count(),
        contact.bytes() / x.len()
    );
}
