//! Every term against finite differences and the symmetries of mechanics, at rest, random,
//! crumpled and nearly degenerate states.

#![allow(clippy::expect_used, reason = "a test may stop here")]
#![allow(unreachable_pub, reason = "helpers shared by several test files")]

mod sheets;

use nalgebra::DMatrix;
use sheets::{Flat, Pattern, Random, mesh, panel, rectangle, windy};
use toile::cloth::Cloth;
use toile::math::diff::compare;
use toile::math::geometry::hinges;
use toile::math::{Mat3, Rotation, Vec2, Vec3};
use toile::pattern::{BendingModel, Fabric, Garment};
use toile::system::air::Air;
use toile::system::gravity::Gravity;
use toile::system::hinge::Hinge;
use toile::system::membrane::Membrane;
use toile::system::pressure::Pressure;
use toile::system::quadratic_bending::QuadraticBending;
use toile::system::seam_term::{SeamHinge, SeamSprings};
use toile::system::term::{Configuration, HessianKind, MAX_ARITY, MAX_BLOCKS, RestChange, Term};
use toile::tri::{SeamLink, SeamMesh};

const H: f64 = 0.02;

fn fabrics() -> Vec<Fabric> {
    let hinge = Fabric {
        warp: 900.0,
        weft: 600.0,
        coupling: 150.0,
        shear: 120.0,
        bending_warp: 3e-5,
        bending_weft: 1e-5,
        damping_stiffness: 0.02,
        ..Fabric::default()
    };
    let quadratic = Fabric {
        bending_model: BendingModel::Quadratic,
        bending_weft: 5e-5,
        ..hinge.clone()
    };
    vec![hinge, quadratic]
}

/// Rates of every number of a fabric that a term may depend on.
fn fabric_rate(random: &mut Random) -> Fabric {
    Fabric {
        density: 0.1 * random.signed(),
        warp: 300.0 * random.signed(),
        weft: 300.0 * random.signed(),
        coupling: 100.0 * random.signed(),
        shear: 100.0 * random.signed(),
        bending_warp: 1e-5 * random.signed(),
        bending_weft: 1e-5 * random.signed(),
        damping_stiffness: 0.01 * random.signed(),
        ..Fabric::default()
    }
}

fn moved_fabric(f: &Fabric, rate: &Fabric, s: f64) -> Fabric {
    Fabric {
        density: f.density + s * rate.density,
        warp: f.warp + s * rate.warp,
        weft: f.weft + s * rate.weft,
        coupling: f.coupling + s * rate.coupling,
        shear: f.shear + s * rate.shear,
        bending_warp: f.bending_warp + s * rate.bending_warp,
        bending_weft: f.bending_weft + s * rate.bending_weft,
        damping_stiffness: f.damping_stiffness + s * rate.damping_stiffness,
        ..f.clone()
    }
}

/// Four pieces, two of each bending model; the second pair runs clockwise in its flat coordinates.
/// Pieces 0 and 1 are sewn together along their long sides.
fn cloth(duv: Option<&[Vec2]>, rates: &[Fabric], s: f64) -> Cloth {
    let kinds = [
        Pattern::Squares,
        Pattern::Delaunay,
        Pattern::UnionJack,
        Pattern::Delaunay,
    ];
    let mut pieces: Vec<Flat> = kinds
        .iter()
        .map(|&k| rectangle(k, 5.0 * H, 4.0 * H, 5))
        .collect();
    for piece in &mut pieces[2..] {
        piece.points.iter_mut().for_each(|p| p.x = -p.x);
    }
    let side = |p: usize| -> Vec<u32> {
        let first: usize = pieces[..p].iter().map(|q| q.points.len()).sum();
        let mut on: Vec<usize> = (0..pieces[p].points.len())
            .filter(|&v| pieces[p].points[v].y < 1e-9)
            .collect();
        on.sort_by(|&a, &b| pieces[p].points[a].x.total_cmp(&pieces[p].points[b].x));
        on.iter().map(|v| (v + first) as u32).collect()
    };
    let (a, b) = (side(0), side(1));
    let links = (0..a.len())
        .map(|k| {
            let from = k.min(b.len() - 2);
            SeamLink {
                vertex: a[k],
                edge: [b[from], b[from + 1]],
                t: if k + 1 == a.len() {
                    1.0
                } else {
                    0.07 * k as f64
                },
                length: H,
            }
        })
        .collect();
    let seams = vec![SeamMesh {
        links,
        rest_angle: 0.4,
    }];
    let mut m = mesh(&pieces, seams);
    if let Some(duv) = duv {
        for (p, d) in m.uv.iter_mut().zip(duv) {
            *p += d * s;
        }
    }
    let mut fabrics = fabrics();
    for (f, r) in fabrics.iter_mut().zip(rates) {
        *f = moved_fabric(f, r, s);
    }
    let garment = Garment {
        panels: vec![
            panel("a", 0, 0.3),
            panel("b", 1, -0.7),
            panel("c", 1, 0.0),
            panel("d", 0, 0.2),
        ],
        fabrics,
        ..Garment::default()
    };
    Cloth::new(&garment, m).expect("valid cloth")
}

fn terms(cloth: &Cloth) -> Vec<Box<dyn Term>> {
    let mut all: Vec<Box<dyn Term>> = vec![
        Box::new(Membrane::new(cloth)),
        Box::new(SeamSprings::new(cloth, 5e4, 60.0)),
        Box::new(SeamHinge::new(cloth)),
        Box::new(Gravity::new(cloth)),
        Box::new(Air::new(cloth, 1.1, 0.05)),
        Box::new(Pressure::new(cloth)),
    ];
    let rest: Vec<f64> = (0..hinges(&cloth.mesh.triangles).len())
        .map(|k| 0.3 * (k as f64).sin())
        .collect();
    for t in Hinge::terms(cloth) {
        all.push(Box::new(t));
    }
    for t in Hinge::terms_with_rest_angles(cloth, &rest).expect("one angle for each hinge") {
        all.push(Box::new(t));
    }
    for t in QuadraticBending::terms(cloth) {
        all.push(Box::new(t));
    }
    all
}

struct Case {
    name: &'static str,
    x: Vec<Vec3>,
    x0: Vec<Vec3>,
    inv_dt: f64,
    regular: bool,
}

fn cases(cloth: &Cloth) -> Vec<Case> {
    let turn = Rotation::from_euler_angles(0.3, -1.1, 2.0);
    let offset = Vec3::new(0.4, -0.3, 1.2);
    let rest: Vec<Vec3> = cloth
        .mesh
        .uv
        .iter()
        .map(|p| turn * Vec3::new(p.x, p.y, 0.0) + offset)
        .collect();
    let noisy = |seed: u64, size: f64| -> Vec<Vec3> {
        let mut random = Random::new(seed);
        rest.iter().map(|p| p + random.vec3(size * H)).collect()
    };
    // every third vertex is drawn to within a hundredth of an edge of its successor
    let mut thin = noisy(5, 0.2);
    for v in (0..thin.len() - 1).step_by(3) {
        thin[v] = thin[v + 1] + (thin[v] - thin[v + 1]) * 0.01;
    }
    let mut all = Vec::new();
    for inv_dt in [0.0, 100.0] {
        for (name, x, regular) in [
            ("rest", rest.clone(), true),
            ("random", noisy(1, 0.15), true),
            ("crumpled", noisy(2, 0.8), false),
            ("thin", thin.clone(), false),
        ] {
            let x0 = if name == "rest" {
                x.clone()
            } else {
                noisy(3, 0.1)
            };
            all.push(Case {
                name,
                x,
                x0,
                inv_dt,
                regular,
            });
        }
    }
    all
}

fn gradient(term: &dyn Term, e: usize, at: &Configuration<'_>) -> Vec<Vec3> {
    let mut g = vec![Vec3::repeat(f64::NAN); term.stencils().arity];
    term.gradient(e, at, &mut g);
    g
}

fn hessian(term: &dyn Term, e: usize, at: &Configuration<'_>, kind: HessianKind) -> DMatrix<f64> {
    let n = term.stencils().arity;
    let mut blocks = [Mat3::repeat(f64::NAN); MAX_BLOCKS];
    term.hessian(e, at, kind, &mut blocks[..n * (n + 1) / 2]);
    let mut h = DMatrix::zeros(3 * n, 3 * n);
    for i in 0..n {
        for j in 0..=i {
            let b = blocks[i * (i + 1) / 2 + j];
            h.view_mut((3 * i, 3 * j), (3, 3)).copy_from(&b);
            if i != j {
                h.view_mut((3 * j, 3 * i), (3, 3)).copy_from(&b.transpose());
            }
        }
    }
    // blocks off the diagonal are mirrored; those on it must be symmetric by themselves
    assert!((&h - h.transpose()).amax() <= 1e-12 * h.amax());
    h
}

/// Force that rounding of positions of order one makes: stiffness times 1e-13 m.
fn rounding(term: &dyn Term, e: usize, at: &Configuration<'_>) -> f64 {
    1e-13 * hessian(term, e, at, HessianKind::Exact).amax() + 1e-20
}

fn flat(v: &[Vec3]) -> Vec<f64> {
    v.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// Stencils looked at: about thirty, spread over all.
fn sample(term: &dyn Term) -> impl Iterator<Item = usize> {
    let count = term.stencils().count();
    (0..count).step_by(count.div_ceil(30).max(1))
}

const STEPS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

fn every(mut check: impl FnMut(&dyn Term, &Case)) {
    let cloth = cloth(None, &[], 0.0);
    let all = terms(&cloth);
    let names: Vec<_> = all.iter().map(|t| t.name()).collect();
    for name in [
        "membrane",
        "hinge",
        "quadratic_bending",
        "seam",
        "seam_hinge",
        "air",
    ] {
        assert!(names.contains(&name), "{name} is not built");
    }
    for case in cases(&cloth) {
        for term in &all {
            assert!(term.stencils().count() > 0, "{} is empty", term.name());
            assert!(term.stencils().arity <= MAX_ARITY);
            check(term.as_ref(), &case);
        }
    }
}

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
fn internal_terms_have_no_net_force_and_no_torque() {
    let world = windy();
    every(|term, case| {
        if !term.is_internal() {
            return;
        }
        let at = Configuration {
            x: &case.x,
            x0: &case.x0,
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
            inv_dt: case.inv_dt,
            world: &world,
        };
        let after = Configuration {
            x: &mx,
            x0: &mx0,
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
