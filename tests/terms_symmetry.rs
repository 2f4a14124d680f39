//! The symmetries of mechanics that every term keeps: no net force, no torque, rigid motion costs
//! nothing; and no state, however degenerate, gives anything but numbers.
#![allow(clippy::expect_used, reason = "a test may stop here")]

use crate::sheets::windy;
use crate::terms_cases::{H, cloth, every, flat, gradient, hessian, rounding, sample, terms};
use toile::math::{Rotation, Vec3};
use toile::system::term::{Configuration, HessianKind};

#[test]
fn internal_terms_have_no_net_force_and_no_torque() {
    let world = windy();
    every(|term, case| {
        if !term.is_internal() {
            return;
        }
        let at = Configuration {
            x: &case.x,
            x0: &case.x0,
            u: &[],
            inv_dt: case.inv_dt,
            world: &world,
        };
        for e in sample(term) {
            let g = gradient(term, e, &at);
            let v = term.stencils().get(e);
            let noise = rounding(term, e, &at);
            let size = g.iter().map(|g| g.norm()).fold(0.0, f64::max);
            let force: Vec3 = g.iter().sum();
            assert!(
                force.norm() < 1e-9 * size + noise,
                "{} {}",
                term.name(),
                case.name
            );
            // the constant Hessian of quadratic bending leaves a torque in its damping
            if term.name() == "quadratic_bending" && case.inv_dt > 0.0 {
                continue;
            }
            let origin = case.x[v[0] as usize];
            let torque: Vec3 = g
                .iter()
                .zip(v)
                .map(|(g, &v)| (case.x[v as usize] - origin).cross(g))
                .sum();
            assert!(
                torque.norm() < (1e-8 * size + noise) * H,
                "{} {}: {torque}",
                term.name(),
                case.name
            );
        }
    });
}

#[test]
fn internal_energies_are_invariant_under_rigid_motion() {
    let world = windy();
    let turn = Rotation::from_euler_angles(-0.8, 0.5, 1.9);
    let shift = Vec3::new(0.2, 0.1, -0.4);
    every(|term, case| {
        if !term.is_internal() {
            return;
        }
        let moved = |x: &[Vec3]| -> Vec<Vec3> { x.iter().map(|p| turn * p + shift).collect() };
        let (mx, mx0) = (moved(&case.x), moved(&case.x0));
        let at = Configuration {
            x: &case.x,
            x0: &case.x0,
            u: &[],
            inv_dt: case.inv_dt,
            world: &world,
        };
        let after = Configuration {
            x: &mx,
            x0: &mx0,
            u: &[],
            ..at
        };
        for e in sample(term) {
            let (a, b) = (term.value(e, &at), term.value(e, &after));
            let noise = 0.1 * H * H * rounding(term, e, &at);
            assert!(
                (a - b).abs() <= 1e-9 * a.abs() + noise,
                "{} {}: {a} {b}",
                term.name(),
                case.name
            );
        }
        // rigid motion during the step is not damped
        if term.name() == "quadratic_bending" {
            return;
        }
        let slow = Configuration {
            x: &mx,
            x0: &case.x,
            u: &[],
            inv_dt: 100.0,
            world: &world,
        };
        let still = Configuration {
            inv_dt: 0.0,
            ..slow
        };
        for e in sample(term) {
            let (a, b) = (gradient(term, e, &slow), gradient(term, e, &still));
            let size = b.iter().map(|g| g.norm()).fold(0.0, f64::max);
            let noise = rounding(term, e, &slow);
            for (a, b) in a.iter().zip(&b) {
                assert!(
                    (a - b).norm() < 1e-6 * size + noise,
                    "{} is damped",
                    term.name()
                );
            }
        }
    });
}

#[test]
fn totally_degenerate_states_stay_finite() {
    let world = windy();
    let cloth = cloth(None, &[], 0.0);
    let n = cloth.mesh.uv.len();
    let point = vec![Vec3::new(0.1, 0.2, 0.3); n];
    let line: Vec<Vec3> = (0..n)
        .map(|k| Vec3::new(k as f64 * 0.01, 0.0, 0.0))
        .collect();
    for term in terms(&cloth) {
        for x in [&point, &line] {
            for inv_dt in [0.0, 1000.0] {
                let at = Configuration {
                    x,
                    x0: &point,
                    u: &[],
                    inv_dt,
                    world: &world,
                };
                for e in 0..term.stencils().count() {
                    assert!(term.value(e, &at).is_finite());
                    let g = gradient(term.as_ref(), e, &at);
                    assert!(flat(&g).iter().all(|v| v.is_finite()), "{}", term.name());
                    for kind in [HessianKind::Psd, HessianKind::Exact] {
                        let h = hessian(term.as_ref(), e, &at, kind);
                        assert!(h.iter().all(|v| v.is_finite()), "{}", term.name());
                    }
                }
            }
        }
    }
}
