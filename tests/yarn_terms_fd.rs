//! Every energy of yarns against finite differences, with all kinds of frozen and sliding
//! coordinates; positive semi-definite parts.

use crate::sheets::Random;
use crate::terms_cases::{flat, gradient, hessian, sample};
use crate::yarn_cases::{P, every};
use toile::math::Vec3;
use toile::math::diff::compare;
use toile::system::term::{Configuration, HessianKind};

#[test]
fn gradients_and_exact_hessians_are_the_derivatives() {
    let mut random = Random::new(11);
    let mut worst = std::collections::BTreeMap::new();
    every(|cloth, term, case| {
        for e in sample(term) {
            let v: Vec<usize> = term.stencils().get(e).iter().map(|&v| v as usize).collect();
            let d: Vec<Vec3> = v.iter().map(|_| random.vec3(1.0)).collect();
            let mut x = case.x.clone();
            let mut at = |s: f64, f: &mut dyn FnMut(&Configuration<'_>) -> Vec<f64>| {
                for (k, &v) in v.iter().enumerate() {
                    x[v] = case.x[v] + d[k] * s;
                }
                f(&Configuration { x: &x, ..case.at() })
            };
            let g = at(0.0, &mut |c| flat(&gradient(term, e, c)));
            let h = at(0.0, &mut |c| {
                let h = hessian(term, e, c, HessianKind::Exact);
                (h * nalgebra::DVector::from_vec(flat(&d)))
                    .as_slice()
                    .to_vec()
            });
            let curvature = h.iter().map(|h| h.abs()).fold(0.0, f64::max);
            // damped bends have a scale of 0.01 rad where yarns are straight
            let thin = matches!(case.name, "laid" | "folded" | "axis" | "straight");
            let unit = P * if thin { 0.01 } else { 1.0 };
            let steps = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6].map(|s| s * unit);
            let slope = flat(&d).iter().zip(&g).map(|(a, b)| a * b).sum::<f64>();
            let size = g.iter().map(|g| g.abs()).fold(0.0, f64::max);
            let value = at(0.0, &mut |c| vec![term.value(e, c)])[0].abs();
            let first = compare(
                &[slope],
                |s| at(s, &mut |c| vec![term.value(e, c)]),
                &steps,
                size + 1e-3 * (value / P + curvature * P) + 1e-20,
            );
            let scale = curvature + size / P + 1e-20;
            let second = compare(
                &h,
                |s| at(s, &mut |c| flat(&gradient(term, e, c))),
                &steps,
                1e-3 * scale,
            );
            let limit = if thin { 1e-6 } else { 1e-7 };
            for (what, a) in [("gradient", first), ("hessian", second)] {
                assert!(
                    a.error < limit,
                    "{} {what} {e} of {} at {} (1/dt {}): {a:?}",
                    term.name(),
                    cloth.name,
                    case.name,
                    case.inv_dt
                );
                let w = worst.entry((term.name(), what)).or_insert(0.0_f64);
                *w = w.max(a.error);
            }
        }
    });
    for ((name, what), error) in &worst {
        println!("{name:18} {what:9} largest relative error {error:.1e}");
    }
}

#[test]
fn psd_hessians_have_no_negative_eigenvalue() {
    every(|cloth, term, case| {
        for e in sample(term) {
            let eigen = hessian(term, e, &case.at(), HessianKind::Psd).symmetric_eigenvalues();
            assert!(
                eigen.min() >= -1e-10 * eigen.amax(),
                "{} of {} at {}: {} of {}",
                term.name(),
                cloth.name,
                case.name,
                eigen.min(),
                eigen.amax()
            );
        }
    });
}

/// Friction is apart: short of the exact one it keeps its majorant.
#[test]
fn parts_lie_on_the_line_between_psd_and_exact() {
    every(|_, term, case| {
        let friction = ["sliding_friction", "parallel_friction"].contains(&term.name());
        for e in sample(term) {
            let [psd, part, exact] = [HessianKind::Psd, HessianKind::Part(0.3), HessianKind::Exact]
                .map(|kind| hessian(term, e, &case.at(), kind));
            let line = if friction {
                psd.clone()
            } else {
                &psd + (&exact - &psd) * 0.3
            };
            assert!(
                (&part - line).amax() <= 1e-12 * (psd.amax() + exact.amax()),
                "{} at {}",
                term.name(),
                case.name
            );
        }
    });
}

/// The semi-definite part is what there is to keep: along its own range it is the exact one where nothing is
/// stressed.
#[test]
fn psd_and_exact_agree_at_rest() {
    every(|_, term, case| {
        let stressed = ["yarn_gravity", "stitch_wrapping"].contains(&term.name());
        if case.name != "laid" || case.inv_dt > 0.0 || stressed {
            return;
        }
        for e in sample(term) {
            let exact = hessian(term, e, &case.at(), HessianKind::Exact);
            let psd = hessian(term, e, &case.at(), HessianKind::Psd);
            let bent = gradient(term, e, &case.at())
                .iter()
                .any(|g| g.norm() > 1e-9);
            assert!(
                bent || (&exact - &psd).norm() <= 1e-6 * exact.norm(),
                "{} {e}: {exact} {psd}",
                term.name()
            );
        }
    });
}
