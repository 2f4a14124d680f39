//! Contact of vertices and edge mid-points with bodies: derivatives, friction, wrench.

use toile::body::Body;
use toile::cloth::Cloth;
use toile::math::{Mat3, Vec3};
use toile::pattern::Fabric;
use toile::system::bodies::BodySet;
use toile::system::contact::body::BodyContact;
use toile::system::contact::edge::EdgeContact;
use toile::system::points::Points;
use toile::system::state::{BodyAnchor, State};
use toile::system::term::{Configuration, ContactSettings, HessianKind, Term, World};
use toile::tri::grid::{SheetPattern, sheet_garment, structured_sheet};

const RADIUS: f64 = 0.1;

struct Case {
    bodies: BodySet,
    state: State,
    x: Vec<Vec3>,
}

/// A sheet bent over the top of a sphere, a little too deep everywhere.
fn case() -> (Cloth, Case) {
    let garment = sheet_garment(0.06, 0.06, 0.02, Fabric::default());
    let mesh = structured_sheet(0.06, 0.06, 3, 3, SheetPattern::Alternating).expect("mesh");
    let cloth = Cloth::new(&garment, mesh).expect("cloth");
    let x: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .enumerate()
        .map(|(i, p)| {
            let n = Vec3::new(p.x - 0.03, 0.1, p.y - 0.03).normalize();
            n * (RADIUS + 2e-4 * ((i * 7 % 5) as f64))
        })
        .collect();
    let mut bodies = BodySet::default();
    let entry = bodies.add(
        &Body::sphere(RADIUS).expect("sphere"),
        &ContactSettings::default(),
    );
    let anchors = (0..x.len())
        .map(|i| BodyAnchor {
            vertex: i as u32,
            body: 0,
            point: x[i] + Vec3::new(1e-4 * (i % 3) as f64, 0.0, 3e-5 * i as f64),
            normal_force: 2.0 + i as f64,
        })
        .collect();
    let state = State {
        time: 0.0,
        positions: x.clone(),
        velocities: vec![Vec3::zeros(); x.len()],
        topology: Default::default(),
        u: Vec::new(),
        u_rates: Vec::new(),
        sliding: Vec::new(),
        strands: Vec::new(),
        yarn_normals: Vec::new(),
        pins: Vec::new(),
        bodies: vec![entry],
        body_anchors: anchors,
        pair_anchors: Vec::new(),
        step_size: 1.0,
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
    };
    let workers = toile::math::parallel::Workers::new(1);
    bodies.prepare(&state, 1.0, &workers).expect("prepare");
    (cloth, Case { bodies, state, x })
}

fn configuration<'a>(x: &'a [Vec3], x0: &'a [Vec3], world: &'a World<'a>) -> Configuration<'a> {
    Configuration {
        x,
        x0,
        u: &[],
        inv_dt: 0.0,
        world,
    }
}

fn check(term: &mut dyn Term, case: &Case) {
    let world = World {
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
        bodies: &case.bodies,
    };
    term.begin_step(&case.state, &configuration(&case.x, &case.x, &world));
    let count = term.stencils().count();
    let arity = term.stencils().arity;
    let mut active = 0;
    for e in 0..count {
        let vertices: Vec<usize> = term.stencils().get(e).iter().map(|v| *v as usize).collect();
        let gradient = |x: &[Vec3]| {
            let mut g = vec![Vec3::zeros(); arity];
            term.gradient(e, &configuration(x, &case.x, &world), &mut g);
            g
        };
        let g = gradient(&case.x);
        let mut h = vec![Mat3::zeros(); arity * (arity + 1) / 2];
        term.hessian(
            e,
            &configuration(&case.x, &case.x, &world),
            HessianKind::Exact,
            &mut h,
        );
        let scale = g.iter().map(|g| g.norm()).fold(1e-6, f64::max);
        let stiffness = h.iter().map(|h| h.norm()).fold(1.0, f64::max);
        active += usize::from(scale > 1e-3);
        let step = 1e-7;
        for (i, &v) in vertices.iter().enumerate() {
            for d in 0..3 {
                let moved = |s: f64| {
                    let mut x = case.x.clone();
                    x[v][d] += s;
                    x
                };
                let (plus, minus) = (moved(step), moved(-step));
                let slope = (term.value(e, &configuration(&plus, &case.x, &world))
                    - term.value(e, &configuration(&minus, &case.x, &world)))
                    / (2.0 * step);
                assert!(
                    (slope - g[i][d]).abs() < 1e-5 * scale,
                    "{} {e}",
                    term.name()
                );
                let (gp, gm) = (gradient(&plus), gradient(&minus));
                for j in 0..arity {
                    let column = (gp[j] - gm[j]) / (2.0 * step);
                    let block = if j >= i {
                        h[j * (j + 1) / 2 + i].column(d).into_owned()
                    } else {
                        h[i * (i + 1) / 2 + j].row(d).transpose()
                    };
                    assert!(
                        (column - block).norm() < 1e-4 * stiffness,
                        "{} {e}",
                        term.name()
                    );
                }
            }
        }
    }
    assert!(
        active > count / 4,
        "{}: only {active} of {count} stencils act",
        term.name()
    );
}

#[test]
fn vertex_contact_forces_are_derivatives_of_the_energy() {
    let (cloth, case) = case();
    check(&mut BodyContact::new(&Points::new(&cloth, None)), &case);
}

#[test]
fn edge_contact_forces_are_derivatives_of_the_energy() {
    let (cloth, case) = case();
    check(&mut EdgeContact::new(&cloth), &case);
}

#[test]
fn wrench_on_a_body_is_the_reaction_of_the_cloth() {
    // force on the body is the sum of the gradients, its torque their moment about the origin
    let (cloth, case) = case();
    let world = World {
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
        bodies: &case.bodies,
    };
    let at = Configuration {
        x: &case.x,
        x0: &case.x,
        u: &[],
        inv_dt: 0.0,
        world: &world,
    };
    let terms: [Box<dyn Term>; 2] = [
        Box::new(BodyContact::new(&Points::new(&cloth, None))),
        Box::new(EdgeContact::new(&cloth)),
    ];
    for mut term in terms {
        term.begin_step(&case.state, &at);
        let (mut force, mut torque) = (Vec3::zeros(), Vec3::zeros());
        term.add_wrench(0, &at, &Vec3::zeros(), &mut force, &mut torque);
        let mut expected = (Vec3::zeros(), Vec3::zeros());
        let stencils = term.stencils();
        for e in 0..stencils.count() {
            let mut g = vec![Vec3::zeros(); stencils.arity];
            term.gradient(e, &at, &mut g);
            for (v, g) in stencils.get(e).iter().zip(&g) {
                expected.0 += g;
                expected.1 += case.x[*v as usize].cross(g);
            }
        }
        assert!(expected.0.norm() > 0.1, "{}", term.name());
        assert!((force - expected.0).norm() < 1e-9 * expected.0.norm());
        assert!((torque - expected.1).norm() < 1e-9 * expected.0.norm());
    }
}

#[test]
fn a_long_path_through_a_thin_body_is_refused() {
    // a plate of 3 cm, crossed by 20 m within one substep, beside it and through it
    let mut bodies = BodySet::default();
    let mut values = Vec::new();
    for i in 0..40 {
        for j in 0..12 {
            for k in 0..40 {
                let p = Vec3::new(
                    0.01 * f64::from(i) - 0.195,
                    0.01 * f64::from(j) - 0.055,
                    0.01 * f64::from(k) - 0.195,
                );
                let q = p.abs() - Vec3::new(0.1, 0.015, 0.1);
                values.push(q.map(|c| c.max(0.0)).norm() + q.max().min(0.0));
            }
        }
    }
    let body = Body::grid([40, 12, 40], [-0.195, -0.055, -0.195], 0.01, &values).expect("plate");
    let entry = bodies.add(&body, &ContactSettings::default());
    let (_, case) = case();
    let state = State {
        bodies: vec![entry],
        ..case.state
    };
    let workers = toile::math::parallel::Workers::new(1);
    bodies.prepare(&state, 1.0, &workers).expect("prepare");
    let path = |x: f64, y: f64, length: f64| {
        let from = Vec3::new(x, y, 0.013);
        (from, from - Vec3::new(0.0, length, 0.0))
    };
    for i in 0..2000 {
        let y = 0.1 + 0.009 * f64::from(i);
        let (a, b) = path(0.03, y, 20.0);
        assert!(bodies.passes_through(0, &a, &b, 4e-3), "{y}");
        let (a, b) = path(0.13, y, 20.0);
        assert!(!bodies.passes_through(0, &a, &b, 4e-3), "{y}");
        let (a, b) = path(0.03, y, 0.05);
        assert!(!bodies.passes_through(0, &a, &b, 4e-3), "{y}");
    }
}
