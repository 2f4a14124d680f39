//! What single terms promise in plain mechanics.

#![allow(clippy::expect_used, reason = "a test may stop here")]

use crate::sheets::{NoBodies, Pattern, mesh, panel, rectangle};
use toile::cloth::Cloth;
use toile::math::Vec3;
use toile::pattern::{Fabric, Garment};
use toile::system::air::Air;
use toile::system::gravity::Gravity;
use toile::system::pressure::Pressure;
use toile::system::seam_term::{SeamHinge, SeamSprings};
use toile::system::state::State;
use toile::system::term::{Configuration, Term, World};
use toile::tri::{SeamLink, SeamMesh};

fn total(term: &dyn Term, at: &Configuration<'_>) -> Vec3 {
    let s = term.stencils();
    let mut g = vec![Vec3::zeros(); s.arity];
    let mut sum = Vec3::zeros();
    for e in 0..s.count() {
        term.gradient(e, at, &mut g);
        sum -= g.iter().sum::<Vec3>();
    }
    sum
}

fn sheet() -> (Cloth, Vec<Vec3>) {
    let cloth = crate::sheets::sheet(Pattern::Squares, 0.5, 0.3, 6, Fabric::default());
    let x = cloth.mesh.placed.clone();
    (cloth, x)
}

fn world(wind: Vec3, pressure: f64) -> World<'static> {
    World {
        gravity: Vec3::new(0.0, 0.0, -10.0),
        wind,
        pressure,
        bodies: &NoBodies,
    }
}

fn state(positions: &[Vec3]) -> State {
    State {
        time: 0.0,
        positions: positions.to_vec(),
        velocities: vec![Vec3::zeros(); positions.len()],
        topology: Default::default(),
        u: Vec::new(),
        u_rates: Vec::new(),
        sliding: Vec::new(),
        strands: Vec::new(),
        yarn_normals: Vec::new(),
        pins: Vec::new(),
        bodies: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        step_size: f64::INFINITY,
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
    }
}

#[test]
fn weight_pressure_and_wind_add_up_to_their_resultants() {
    let (cloth, x) = sheet();
    let area = 0.15;
    let wind = Vec3::new(3.0, 0.0, 4.0);
    let w = world(wind, 20.0);
    let at = Configuration {
        x: &x,
        x0: &x,
        u: &[],
        inv_dt: 0.0,
        world: &w,
    };
    let close = |a: Vec3, b: Vec3| assert!((a - b).norm() < 1e-12 * b.norm().max(1.0), "{a} {b}");
    close(
        total(&Gravity::new(&cloth), &at),
        Vec3::new(0.0, 0.0, -10.0 * 0.2 * area),
    );
    close(
        total(&Pressure::new(&cloth), &at),
        Vec3::new(0.0, 0.0, 20.0 * area),
    );
    let air = Air::new(&cloth, 1.2, 0.1);
    let want = Vec3::new(0.1 * 3.0 * 3.0, 0.0, 1.2 * 4.0 * 4.0) * area;
    close(total(&air, &at), want);
    // a step that begins at rest feels the same wind, one that moves with it none
    let dt = 0.01;
    let step = Configuration {
        inv_dt: 1.0 / dt,
        ..at
    };
    close(total(&air, &step), want);
    let along: Vec<Vec3> = x.iter().map(|p| p + wind * dt).collect();
    let drifting = Configuration { x: &along, ..step };
    assert!(total(&air, &drifting).norm() < 1e-12);
}

/// Two strips side by side, `gap` apart, sewn along their facing borders.
fn pair(gap: f64) -> (Cloth, Vec<Vec3>) {
    let n = 4;
    let pieces = [
        rectangle(Pattern::Squares, 0.1, 0.05, n),
        rectangle(Pattern::Squares, 0.1, 0.05, n),
    ];
    let first = pieces[0].points.len() as u32;
    let row = 2 * (n as u32 + 1);
    let links = (0..=n as u32)
        .map(|k| {
            let from = k.min(n as u32 - 1);
            SeamLink {
                vertex: row + k,
                edge: [first + from, first + from + 1],
                t: f64::from(k - from),
                length: 0.02,
            }
        })
        .collect();
    let mut m = mesh(
        &pieces,
        vec![SeamMesh {
            links,
            rest_angle: 0.0,
        }],
    );
    for (k, p) in m.placed.iter_mut().enumerate().skip(first as usize) {
        assert!(k >= first as usize);
        p.y += 0.05 + gap;
    }
    let x = m.placed.clone();
    let garment = Garment {
        panels: vec![panel("a", 0, 0.0), panel("b", 0, 0.0)],
        fabrics: vec![Fabric::default()],
        ..Garment::default()
    };
    (Cloth::new(&garment, m).expect("valid pair"), x)
}

#[test]
fn an_open_seam_pulls_with_a_bounded_force_and_a_sewn_one_holds() {
    let (stiffness, pull) = (1e5, 50.0);
    let w = world(Vec3::zeros(), 0.0);
    let force = |term: &SeamSprings, x: &[Vec3]| {
        let at = Configuration {
            x,
            x0: x,
            u: &[],
            inv_dt: 0.0,
            world: &w,
        };
        let mut g = [Vec3::zeros(); 3];
        (0..term.stencils().count())
            .map(|e| {
                term.gradient(e, &at, &mut g);
                g[0].norm()
            })
            .sum::<f64>()
    };
    let length = 5.0 * 0.02;
    let (cloth, open) = pair(0.5);
    let (_, nearly) = pair(0.002);
    let (_, shut) = pair(0.0);
    let mut term = SeamSprings::new(&cloth, stiffness, pull);
    assert!((term.largest_gap(&open) - 0.5).abs() < 1e-12);
    assert!((force(&term, &open) - pull * length).abs() < 1e-9);
    let at = Configuration {
        x: &open,
        x0: &open,
        u: &[],
        inv_dt: 0.0,
        world: &w,
    };
    assert!(!term.begin_step(&state(&open), &at));
    assert!((force(&term, &nearly) - pull * length).abs() < 1e-9);
    assert!(!term.begin_step(&state(&shut), &at));
    assert!((force(&term, &nearly) - stiffness * 0.002 * length).abs() < 1e-9);
    assert!(force(&term, &shut) < 1e-9);
}

#[test]
fn the_angle_across_a_seam_acts_when_it_is_closed() {
    let (cloth, shut) = pair(0.0);
    let (_, open) = pair(0.5);
    let mut term = SeamHinge::new(&cloth);
    assert_eq!(term.stencils().count(), 4);
    let w = world(Vec3::zeros(), 0.0);
    // side b folded up by a right angle about the seam
    let folded: Vec<Vec3> = shut
        .iter()
        .map(|p| {
            if p.y > 0.05 + 1e-9 {
                Vec3::new(p.x, 0.05, p.y - 0.05)
            } else {
                *p
            }
        })
        .collect();
    let energy = |term: &SeamHinge| {
        let at = Configuration {
            x: &folded,
            x0: &folded,
            u: &[],
            inv_dt: 0.0,
            world: &w,
        };
        (0..4).map(|e| term.value(e, &at)).sum::<f64>()
    };
    let at = Configuration {
        x: &shut,
        x0: &shut,
        u: &[],
        inv_dt: 0.0,
        world: &w,
    };
    term.begin_step(&state(&open), &at);
    assert!(energy(&term) == 0.0);
    term.begin_step(&state(&shut), &at);
    // k theta^2 / 2 with k = B l^2 / (A_a + A_b), squares of 25 mm
    let one = 0.5 * 1e-5 * (std::f64::consts::FRAC_PI_2).powi(2);
    assert!(
        (energy(&term) / (4.0 * one) - 1.0).abs() < 1e-9,
        "{}",
        energy(&term) / one
    );
}
