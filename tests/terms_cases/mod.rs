//! Cloth, terms and states on which every term is tried: at rest, random, crumpled and nearly
//! degenerate, in four sewn pieces of four fabrics.
#![allow(clippy::expect_used, reason = "a test may stop here")]

use crate::sheets::{Flat, Pattern, Random, mesh, panel, rectangle};
use nalgebra::DMatrix;
use toile::cloth::Cloth;
use toile::math::{Mat3, Rotation, Vec2, Vec3};
use toile::pattern::{BendingModel, Fabric, Garment, Ridge};
use toile::system::air::Air;
use toile::system::gravity::Gravity;
use toile::system::hinge::Hinge;
use toile::system::membrane::Membrane;
use toile::system::pressure::Pressure;
use toile::system::quadratic_bending::QuadraticBending;
use toile::system::seam_term::{SeamHinge, SeamSprings};
use toile::system::term::{Configuration, HessianKind, MAX_ARITY, MAX_BLOCKS, Term};
use toile::tri::{SeamLink, SeamMesh};

pub const H: f64 = 0.02;

/// Ridges in the plane and in shear, that stiffen, soften and vanish. The strain at rest is none of theirs: there third derivatives
/// jump, and differences agree to first order only.
fn ridges() -> Vec<Ridge> {
    let ridge = |d: [f64; 3], strains: &[f64], stiffness: &[f64]| {
        Ridge::new(d.into(), strains.to_vec(), stiffness.to_vec()).expect("valid ridge")
    };
    vec![
        ridge([1.0, 1.0, 0.0], &[-0.2, 0.05, 0.4], &[100.0, 300.0, 2000.0]),
        ridge([1.0, 0.0, 0.5], &[-0.02, 0.3], &[400.0, 0.0]),
        ridge([0.0, 1.0, -0.5], &[-0.5, 0.1, 0.5], &[300.0, 0.0, 700.0]),
    ]
}

pub fn fabrics() -> Vec<Fabric> {
    let hinge = Fabric {
        warp: 900.0,
        weft: 600.0,
        coupling: 150.0,
        shear: 120.0,
        bending_warp: 3e-5,
        bending_weft: 1e-5,
        curvature_warp: -8.0,
        curvature_weft: 5.0,
        damping_stiffness: 0.02,
        ..Fabric::default()
    };
    let quadratic = Fabric {
        bending_model: BendingModel::Quadratic,
        bending_weft: 5e-5,
        curvature_warp: 0.0,
        curvature_weft: 0.0,
        ridges: ridges(),
        ..hinge.clone()
    };
    vec![hinge, quadratic]
}

/// Rates of every number of a fabric that a term may depend on.
pub fn fabric_rate(random: &mut Random) -> Fabric {
    Fabric {
        density: 0.1 * random.signed(),
        warp: 300.0 * random.signed(),
        weft: 300.0 * random.signed(),
        coupling: 100.0 * random.signed(),
        shear: 100.0 * random.signed(),
        bending_warp: 1e-5 * random.signed(),
        bending_weft: 1e-5 * random.signed(),
        curvature_warp: 5.0 * random.signed(),
        curvature_weft: 5.0 * random.signed(),
        damping_stiffness: 0.01 * random.signed(),
        ..Fabric::default()
    }
}

pub fn moved_fabric(f: &Fabric, rate: &Fabric, s: f64) -> Fabric {
    // quadratic bending is flat
    let bent = f64::from(u8::from(f.bending_model == BendingModel::Hinge));
    Fabric {
        density: f.density + s * rate.density,
        warp: f.warp + s * rate.warp,
        weft: f.weft + s * rate.weft,
        coupling: f.coupling + s * rate.coupling,
        shear: f.shear + s * rate.shear,
        bending_warp: f.bending_warp + s * rate.bending_warp,
        bending_weft: f.bending_weft + s * rate.bending_weft,
        curvature_warp: f.curvature_warp + s * bent * rate.curvature_warp,
        curvature_weft: f.curvature_weft + s * bent * rate.curvature_weft,
        damping_stiffness: f.damping_stiffness + s * rate.damping_stiffness,
        ..f.clone()
    }
}

/// Four pieces, two of each bending model; the second pair runs clockwise in its flat coordinates.
/// Pieces 0 and 1 are sewn together along their long sides.
pub fn cloth(duv: Option<&[Vec2]>, rates: &[Fabric], s: f64) -> Cloth {
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

pub fn terms(cloth: &Cloth) -> Vec<Box<dyn Term>> {
    let mut all: Vec<Box<dyn Term>> = vec![
        Box::new(Membrane::new(cloth, 1.0)),
        Box::new(SeamSprings::new(cloth, 5e4, 60.0)),
        Box::new(SeamHinge::new(cloth)),
        Box::new(Gravity::new(cloth)),
        Box::new(Air::new(cloth, 1.1, 0.05)),
        Box::new(Pressure::new(cloth)),
    ];
    for t in Hinge::terms(cloth) {
        all.push(Box::new(t));
    }
    for t in QuadraticBending::terms(cloth) {
        all.push(Box::new(t));
    }
    all
}

pub struct Case {
    pub name: &'static str,
    pub x: Vec<Vec3>,
    pub x0: Vec<Vec3>,
    pub inv_dt: f64,
    pub regular: bool,
}

pub fn cases(cloth: &Cloth) -> Vec<Case> {
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

pub fn gradient(term: &dyn Term, e: usize, at: &Configuration<'_>) -> Vec<Vec3> {
    let mut g = vec![Vec3::repeat(f64::NAN); term.stencils().arity];
    term.gradient(e, at, &mut g);
    g
}

/// Adds the gradient of all stencils of a term to that of the unknowns.
pub fn add(term: &dyn Term, at: &Configuration<'_>, out: &mut [Vec3]) {
    for e in 0..term.stencils().count() {
        let g = gradient(term, e, at);
        for (g, &v) in g.iter().zip(term.stencils().get(e)) {
            out[v as usize] += g;
        }
    }
}

pub fn hessian(
    term: &dyn Term,
    e: usize,
    at: &Configuration<'_>,
    kind: HessianKind,
) -> DMatrix<f64> {
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
pub fn rounding(term: &dyn Term, e: usize, at: &Configuration<'_>) -> f64 {
    1e-13 * hessian(term, e, at, HessianKind::Exact).amax() + 1e-20
}

pub fn flat(v: &[Vec3]) -> Vec<f64> {
    v.iter().flat_map(|v| [v.x, v.y, v.z]).collect()
}

/// Stencils looked at: about thirty, spread over all.
pub fn sample(term: &dyn Term) -> impl Iterator<Item = usize> {
    let count = term.stencils().count();
    (0..count).step_by(count.div_ceil(30).max(1))
}

pub const STEPS: [f64; 5] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6];

pub fn every(mut check: impl FnMut(&dyn Term, &Case)) {
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
