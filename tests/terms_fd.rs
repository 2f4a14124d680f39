//! Every term against finite differences: gradients, Hessians, derivatives by rest shape and fabric.
#![allow(clippy::expect_used, reason = "a test may stop here")]

use crate::sheets::{Random, windy};
use crate::terms_cases::{
    H, STEPS, cases, cloth, every, fabric_rate, flat, gradient, hessian, sample, terms,
};
use toile::math::diff::compare;
use toile::math::{Vec2, Vec3};
use toile::pattern::Fabric;
use toile::system::term::{Configuration, HessianKind, RestChange, Term};

#[test]
fn gradients_and_exact_hessians_are_the_derivatives() {
    let world = windy();
    let mut random = Random::new(11);
    let (mut worst, mut orders) = (std::collections::BTreeMap::new(), Vec::new());
    every(|term, case| {
        for e in sample(term) {
            let v: Vec<usize> = term.stencils().get(e).iter().map(|&v| v as usize).collect();
            let d: Vec<Vec3> = v.iter().map(|_| random.vec3(1.0)).collect();
            let mut x = case.x.clone();
            let mut at = |s: f64, f: &mut dyn FnMut(&Configuration<'_>) -> Vec<f64>| {
                for (k, &v) in v.iter().enumerate() {
                    x[v] = case.x[v] + d[k] * s;
                }
                f(&Configuration {
                    x: &x,
                    x0: &case.x0,
                    u: &[],
                    inv_dt: case.inv_dt,
                    world: &world,
                })
            };
            let g = at(0.0, &mut |c| flat(&gradient(term, e, c)));
            let h = at(0.0, &mut |c| {
                let h = hessian(term, e, c, HessianKind::Exact);
                (h * nalgebra::DVector::from_vec(flat(&d)))
                    .as_slice()
                    .to_vec()
            });
            let curvature = h.iter().map(|h| h.abs()).fold(0.0, f64::max);
            let steps = STEPS.map(|s| s * H * if case.name == "thin" { 0.01 } else { 1.0 });
            let slope = flat(&d).iter().zip(&g).map(|(a, b)| a * b).sum::<f64>();
            let size = g.iter().map(|g| g.abs()).fold(0.0, f64::max);
            let value = at(0.0, &mut |c| vec![term.value(e, c)])[0].abs();
            let first = compare(
                &[slope],
                |s| at(s, &mut |c| vec![term.value(e, c)]),
                &steps,
                size + 1e-3 * (value / H + curvature * H) + 1e-20,
            );
            let scale = curvature + size / H + 1e-20;
            let second = compare(
                &h,
                |s| at(s, &mut |c| flat(&gradient(term, e, c))),
                &steps,
                1e-3 * scale,
            );
            let limit = if case.name == "thin" { 1e-6 } else { 1e-7 };
            for (what, a) in [("gradient", first), ("hessian", second)] {
                assert!(
                    a.error < limit,
                    "{} {what} {e} at {} (1/dt {}): {a:?}",
                    term.name(),
                    case.name,
                    case.inv_dt
                );
                let w = worst.entry((term.name(), what)).or_insert(0.0_f64);
                *w = w.max(a.error);
                if case.regular && a.order.is_finite() {
                    orders.push((a.order, a.error, term.name(), what));
                }
            }
        }
    });
    for ((name, what), error) in &worst {
        println!("{name:18} {what:9} largest relative error {error:.1e}");
    }
    // where the differences are limited by their step and not by rounding, the order is two
    let visible: Vec<f64> = orders.iter().filter(|o| o.0 > 0.5).map(|o| o.0).collect();
    let near_two = visible.iter().filter(|o| (**o - 2.0).abs() < 0.2).count();
    println!(
        "order two in {near_two} of {} visible slopes",
        visible.len()
    );
    assert!(near_two * 10 > visible.len() * 9);
}

#[test]
fn psd_hessians_have_no_negative_eigenvalue() {
    let world = windy();
    every(|term, case| {
        let at = Configuration {
            x: &case.x,
            x0: &case.x0,
            u: &[],
            inv_dt: case.inv_dt,
            world: &world,
        };
        for e in sample(term) {
            let eigen = hessian(term, e, &at, HessianKind::Psd).symmetric_eigenvalues();
            let largest = eigen.amax();
            assert!(
                eigen.min() >= -1e-10 * largest,
                "{} at {}: {} of {largest}",
                term.name(),
                case.name,
                eigen.min()
            );
        }
    });
}

#[test]
fn psd_and_exact_agree_at_rest() {
    let world = windy();
    every(|term, case| {
        if case.name != "rest" || term.name() == "seam_hinge" || term.name() == "hinge" {
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
            let exact = hessian(term, e, &at, HessianKind::Exact);
            let psd = hessian(term, e, &at, HessianKind::Psd);
            assert!(
                (&exact - &psd).norm() <= 1e-9 * exact.norm(),
                "{}",
                term.name()
            );
        }
    });
}

#[test]
fn rest_gradients_are_the_derivatives_by_shape_and_fabric() {
    let world = windy();
    let mut random = Random::new(23);
    let base = cloth(None, &[], 0.0);
    let duv: Vec<Vec2> = base.mesh.uv.iter().map(|_| random.vec2(0.3 * H)).collect();
    let rates: Vec<Fabric> = (0..2).map(|_| fabric_rate(&mut random)).collect();
    let steps = [1e-2, 1e-3, 1e-4, 1e-5];
    let built: Vec<Vec<[Box<dyn Term>; 2]>> = steps
        .iter()
        .map(|&s| {
            let plus = terms(&cloth(Some(&duv), &rates, s));
            let minus = terms(&cloth(Some(&duv), &rates, -s));
            plus.into_iter().zip(minus).map(|(p, m)| [p, m]).collect()
        })
        .collect();
    let all = terms(&base);
    let change = RestChange {
        uv: &duv,
        fabrics: &rates,
    };
    for case in cases(&base) {
        let at = Configuration {
            x: &case.x,
            x0: &case.x0,
            u: &[],
            inv_dt: case.inv_dt,
            world: &world,
        };
        for (t, term) in all.iter().enumerate() {
            for e in sample(term.as_ref()) {
                let mut analytic = vec![Vec3::repeat(f64::NAN); term.stencils().arity];
                term.rest_gradient(e, &at, &change, &mut analytic);
                let size = gradient(term.as_ref(), e, &at)
                    .iter()
                    .map(|g| g.norm())
                    .fold(1e-12, f64::max);
                let a = compare(
                    &flat(&analytic),
                    |s| {
                        let k = steps.iter().position(|&q| q == s.abs()).expect("a step");
                        let side = usize::from(s < 0.0);
                        flat(&gradient(built[k][t][side].as_ref(), e, &at))
                    },
                    &steps,
                    0.01 * size,
                );
                assert!(
                    a.error < 1e-7,
                    "{} {e} at {}: {a:?}",
                    term.name(),
                    case.name
                );
            }
        }
    }
}
