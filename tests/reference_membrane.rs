//! Membrane against first principles: uniform strain on any mesh, a sheet that hangs by its weight.

#![allow(clippy::expect_used, reason = "a test may stop here")]

use crate::sheets::{NoBodies, PATTERNS, Random};
use toile::math::{Mat2, Mat3, Vec3};
use toile::pattern::{Fabric, Ridge};
use toile::system::gravity::Gravity;
use toile::system::membrane::Membrane;
use toile::system::term::{Configuration, HessianKind, Term, World};

fn world(gravity: Vec3) -> World<'static> {
    World {
        gravity,
        wind: Vec3::zeros(),
        pressure: 0.0,
        bodies: &NoBodies,
    }
}

#[test]
fn uniform_strain_is_exact_on_every_mesh() {
    let fabric = Fabric {
        weft: 700.0,
        warp: 1100.0,
        coupling: 150.0,
        shear: 90.0,
        ..Fabric::default()
    };
    let map = Mat2::new(1.05, 0.02, 0.04, 1.03);
    let c = map.transpose() * map;
    let (e11, e22, g) = (0.5 * (c[(0, 0)] - 1.0), 0.5 * (c[(1, 1)] - 1.0), c[(0, 1)]);
    let want = Vec3::new(
        fabric.weft * e11 + fabric.coupling * e22,
        fabric.coupling * e11 + fabric.warp * e22,
        fabric.shear * g,
    );
    let (l, w, n) = (0.2, 0.15, 8);
    for pattern in PATTERNS {
        let cloth = crate::sheets::sheet(pattern, l, w, n, fabric.clone());
        let mut random = Random::new(3);
        let exact: Vec<Vec3> = cloth
            .mesh
            .uv
            .iter()
            .map(|p| {
                let q = map * p;
                Vec3::new(q.x, q.y, 0.0)
            })
            .collect();
        let fixed: Vec<bool> = cloth
            .mesh
            .uv
            .iter()
            .map(|p| p.x < 1e-9 || p.x > l - 1e-9 || p.y < 1e-9 || p.y > w - 1e-9)
            .collect();
        let mut x: Vec<Vec3> = exact
            .iter()
            .zip(&fixed)
            .map(|(p, f)| if *f { *p } else { p + random.vec3(1e-3) })
            .collect();
        let terms: Vec<Box<dyn Term>> = vec![Box::new(Membrane::new(&cloth, 1.0))];
        let still = world(Vec3::zeros());
        let out = crate::sheets::statics::relax(&terms, &mut x, &fixed, &still, 1e-11, 100);
        assert!(out.residual < 1e-11, "{pattern:?}: {}", out.residual);
        let off = x
            .iter()
            .zip(&exact)
            .map(|(a, b)| (a - b).norm())
            .fold(0.0, f64::max);
        let membrane = Membrane::new(&cloth, 1.0);
        let stress = (0..cloth.areas.len())
            .map(|t| (membrane.stress(t, &x) - want).norm() / want.norm())
            .fold(0.0, f64::max);
        println!("{pattern:?}: position off by {off:.1e} m, stress by {stress:.1e}");
        assert!(off < 1e-11 && stress < 1e-9);
    }
}

/// Ridges of one stiffness are the Saint Venant-Kirchhoff membrane that they add up to, damping, softening and all: energies,
/// forces and Hessians of a random state agree to 1e-12.
#[test]
fn parabolas_along_ridges_are_the_membrane_they_add_up_to() {
    let plain = Fabric {
        weft: 350.0,
        warp: 250.0,
        coupling: 50.0,
        shear: 85.0,
        damping_stiffness: 0.01,
        ..Fabric::default()
    };
    let ridge = |d: [f64; 3], k: f64| Ridge::new(d.into(), vec![0.0], vec![k]).expect("a ridge");
    let ridged = Fabric {
        weft: 100.0,
        warp: 100.0,
        coupling: 0.0,
        shear: 5.0,
        ridges: vec![
            ridge([1.0, 0.0, 0.0], 200.0),
            ridge([0.0, 0.5, 0.0], 400.0),
            ridge([1.0, 1.0, 0.0], 50.0),
            ridge([0.0, 0.0, 2.0], 20.0),
        ],
        ..plain.clone()
    };
    assert_eq!(ridged.along(), plain.along());
    let [a, b] = [plain, ridged].map(|f| {
        let cloth = crate::sheets::sheet(PATTERNS[0], 0.2, 0.15, 6, f);
        (Membrane::new(&cloth, 0.3), cloth)
    });
    let mut random = Random::new(11);
    let mut state = || -> Vec<Vec3> {
        let points = a.1.mesh.uv.iter();
        points
            .map(|p| Vec3::new(p.x, p.y, 0.0) + random.vec3(5e-3))
            .collect()
    };
    let (x, x0) = (state(), state());
    let still = world(Vec3::zeros());
    let at = Configuration {
        x: &x,
        x0: &x0,
        u: &[],
        inv_dt: 50.0,
        world: &still,
    };
    for t in 0..a.1.areas.len() {
        let [[va, ga, ha], [vb, gb, hb]] = [&a.0, &b.0].map(|m| {
            let (mut g, mut h) = ([Vec3::zeros(); 3], [Mat3::zeros(); 6]);
            m.gradient(t, &at, &mut g);
            m.hessian(t, &at, HessianKind::Psd, &mut h);
            let g: Vec<f64> = g.iter().flat_map(|v| v.iter().copied()).collect();
            let h: Vec<f64> = h.iter().flat_map(|m| m.iter().copied()).collect();
            [vec![m.value(t, &at)], g, h]
        });
        for (a, b) in [(va, vb), (ga, gb), (ha, hb)] {
            let size = a.iter().fold(0.0, |m: f64, v| m.max(v.abs()));
            for (a, b) in a.iter().zip(&b) {
                assert!((a - b).abs() < 1e-12 * size, "{t}: {a} {b}");
            }
        }
        assert!((a.0.stress(t, &x) - b.0.stress(t, &x)).norm() < 1e-12 * a.0.stress(t, &x).norm());
    }
}

/// Lengthening of a hanging strip over its length: `lambda (lambda^2 - 1) / 2 = q (1 - s)` with the
/// weight over the stiffness `q`, integrated by the midpoint rule.
fn hanging_stretch(q: f64) -> f64 {
    let n = 20_000;
    (0..n)
        .map(|i| {
            let load = q * (1.0 - (f64::from(i) + 0.5) / f64::from(n));
            let mut l = 1.0;
            for _ in 0..30 {
                l -= (0.5 * l * (l * l - 1.0) - load) / (1.5 * l * l - 0.5);
            }
            (l - 1.0) / f64::from(n)
        })
        .sum()
}

#[test]
fn a_hanging_sheet_stretches_by_its_weight() {
    let (l, w) = (0.4, 0.1);
    let fabric = Fabric {
        density: 1.0,
        weft: 60.0,
        warp: 80.0,
        coupling: 0.0,
        shear: 30.0,
        ..Fabric::default()
    };
    let want = hanging_stretch(fabric.density * 9.81 * l / fabric.weft);
    for pattern in PATTERNS {
        let errors = [8, 16, 32].map(|n| {
            let cloth = crate::sheets::sheet(pattern, l, w, n, fabric.clone());
            let terms: Vec<Box<dyn Term>> = vec![
                Box::new(Membrane::new(&cloth, 1.0)),
                Box::new(Gravity::new(&cloth)),
            ];
            // a slight stretch keeps every triangle in tension from the first iteration on
            let mut x: Vec<Vec3> = cloth
                .mesh
                .uv
                .iter()
                .map(|p| Vec3::new(p.y, 0.0, -1.03 * p.x))
                .collect();
            let fixed: Vec<bool> = cloth.mesh.uv.iter().map(|p| p.x < 1e-9).collect();
            let down = world(Vec3::new(0.0, 0.0, -9.81));
            let out = crate::sheets::statics::relax(&terms, &mut x, &fixed, &down, 1e-10, 200);
            assert!(out.residual < 1e-10, "{pattern:?} {n}: {}", out.residual);
            let tip: Vec<f64> = x
                .iter()
                .zip(&cloth.mesh.uv)
                .filter(|(_, p)| p.x > l - 1e-9)
                .map(|(x, _)| -x.z / l - 1.0)
                .collect();
            (tip.iter().sum::<f64>() / tip.len() as f64) / want - 1.0
        });
        let order = (errors[1] / errors[2]).abs().log2();
        println!("{pattern:?}: stretch {want:.5}, relative errors {errors:.6?}, order {order:.1}");
        assert!(errors[2].abs() < 1e-3, "{pattern:?}: {errors:?}");
        assert!(
            errors[2].abs() < 0.5 * errors[0].abs(),
            "{pattern:?}: {errors:?}"
        );
    }
    // the sheet really stretches
    assert!(want > 0.02);
}
