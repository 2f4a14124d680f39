//! Points that ride on others: what the assembly makes of their energies.
#![allow(clippy::unwrap_used, clippy::expect_used, reason = "a test may panic")]

use nalgebra::{DMatrix, DVector};
use toile::blend::{Rider, Riders};
use toile::math::parallel::Workers;
use toile::math::{Mat3, Vec3};
use toile::system::assemble::{Assembler, Products, energy};
use toile::system::bodies::BodySet;
use toile::system::term::{Configuration, HessianKind, Stencils, Term, World};

/// Numbers in [-1, 1] that follow from a seed.
struct Numbers(u64);

impl Numbers {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1_u64 << 52) as f64 - 1.0
    }
}

/// `V = 1/2 y^T K y` of each stencil's positions `y`, `K` symmetric and else arbitrary.
struct Quadratic {
    stencils: Vec<u32>,
    matrices: Vec<DMatrix<f64>>,
}

const ARITY: usize = 3;

impl Quadratic {
    fn new(stencils: &[[u32; ARITY]], numbers: &mut Numbers) -> Self {
        let matrices = stencils.iter().map(|_| {
            let m = DMatrix::from_fn(3 * ARITY, 3 * ARITY, |_, _| numbers.next());
            &m + m.transpose()
        });
        Self {
            matrices: matrices.collect(),
            stencils: stencils.as_flattened().to_vec(),
        }
    }

    fn place(&self, e: usize, x: &[Vec3]) -> DVector<f64> {
        let points = &self.stencils[ARITY * e..ARITY * (e + 1)];
        DVector::from_iterator(
            3 * ARITY,
            points.iter().flat_map(|p| x[*p as usize].iter().copied()),
        )
    }
}

impl Term for Quadratic {
    fn name(&self) -> &'static str {
        "quadratic"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: ARITY,
            vertices: &self.stencils,
        }
    }

    fn bytes(&self) -> usize {
        0
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let y = self.place(e, at.x);
        0.5 * y.dot(&(&self.matrices[e] * &y))
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let g = &self.matrices[e] * self.place(e, at.x);
        for (k, o) in out.iter_mut().enumerate() {
            *o = Vec3::new(g[3 * k], g[3 * k + 1], g[3 * k + 2]);
        }
    }

    fn hessian(&self, e: usize, _: &Configuration<'_>, _: HessianKind, out: &mut [Mat3]) {
        let mut k = 0;
        for i in 0..ARITY {
            for j in 0..=i {
                out[k] = self.matrices[e].fixed_view::<3, 3>(3 * i, 3 * j).into();
                k += 1;
            }
        }
    }
}

/// Points 0 to 5 are free, 6 to 8 ride; one of them just outside of its triangle, one turned.
fn riders() -> Riders {
    let rider = |point, vertices, weights| Rider {
        point,
        vertices,
        weights,
        turn: match point {
            8 => nalgebra::Rotation3::from_euler_angles(0.3, -0.8, 1.1).into_inner(),
            _ => Mat3::identity(),
        },
    };
    Riders::new(vec![
        rider(6, [0, 1, 2], [0.2, 0.3, 0.5]),
        rider(7, [2, 1, 3], [0.7, 0.4, -0.1]),
        rider(8, [4, 0, 2], [0.1, 0.0, 0.9]),
    ])
    .expect("riders")
}

/// Gradient and Hessian are `B^T g` and `B^T H B`, whatever of a stencil rides, to 1e-13.
#[test]
fn what_belongs_to_riders_goes_to_their_carriers_by_the_transpose() {
    let (free, all) = (6, 9);
    let mut numbers = Numbers(7);
    let stencils = [
        [0, 1, 2],
        [0, 6, 5],
        [6, 7, 8],
        [7, 1, 6],
        [5, 8, 4],
        [8, 7, 2],
        [3, 4, 5],
    ];
    let term = Quadratic::new(&stencils, &mut numbers);
    let mut whole = DMatrix::zeros(3 * all, 3 * all);
    for (e, stencil) in stencils.iter().enumerate() {
        for (i, p) in stencil.iter().enumerate() {
            for (j, q) in stencil.iter().enumerate() {
                let part = term.matrices[e].fixed_view::<3, 3>(3 * i, 3 * j);
                let (p, q) = (3 * *p as usize, 3 * *q as usize);
                let mut target = whole.fixed_view_mut::<3, 3>(p, q);
                target += part;
            }
        }
    }
    let riders = riders();
    let mut b = DMatrix::zeros(3 * all, 3 * free);
    for point in 0..all as u32 {
        for c in 0..3 {
            let row = 3 * point as usize + c;
            match riders.of(point) {
                None => b[(row, row)] = 1.0,
                Some(r) => {
                    for (v, w) in r.vertices.iter().zip(&r.weights) {
                        for d in 0..3 {
                            b[(row, 3 * *v as usize + d)] = *w * r.turn[(c, d)];
                        }
                    }
                }
            }
        }
    }
    let reduced = b.transpose() * &whole * &b;

    let terms: Vec<Box<dyn Term>> = vec![Box::new(term)];
    let mut x: Vec<Vec3> = (0..all)
        .map(|_| Vec3::from_fn(|_, _| numbers.next()))
        .collect();
    riders.carry(&mut x);
    let bodies = BodySet::default();
    let world = World {
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
        bodies: &bodies,
    };
    let at = Configuration {
        x: &x,
        x0: &x,
        u: &[],
        inv_dt: 0.0,
        world: &world,
    };
    let workers = Workers::new(1);
    let mut assembler = Assembler::new(&vec![3; all], &terms, &riders);
    let mut gradient = vec![Vec3::zeros(); all];
    assembler.add(
        &terms,
        &at,
        Some(HessianKind::Exact),
        &workers,
        &mut gradient,
    );
    let v = DVector::from_iterator(3 * free, x[..free].iter().flat_map(|p| p.iter().copied()));
    let expected = &reduced * &v;
    for (point, g) in gradient.iter().enumerate() {
        for c in 0..3 {
            let wanted = if point < free {
                expected[3 * point + c]
            } else {
                0.0
            };
            assert!((g[c] - wanted).abs() < 1e-13, "{point} {g} {wanted}");
        }
    }
    let value = energy(&terms, &at, &workers);
    assert!((value - 0.5 * v.dot(&expected)).abs() < 1e-13);
    let products = Products {
        terms: &terms,
        at,
        kind: HessianKind::Exact,
        riders: &riders,
        workers: &workers,
    };
    let mut work = Vec::new();
    let mut diagonal = Assembler::of_diagonal(&vec![3; all], &terms, &riders);
    diagonal.add(
        &terms,
        &at,
        Some(HessianKind::Exact),
        &workers,
        &mut gradient,
    );
    assert_eq!(diagonal.matrix().blocks.len(), all);
    for (point, block) in diagonal.matrix().blocks.iter().enumerate() {
        let slot = assembler.matrix().pattern.starts[point] as usize;
        assert_eq!(*block, assembler.matrix().blocks[slot]);
    }
    for column in 0..3 * free {
        let mut unit = vec![Vec3::zeros(); all];
        unit[column / 3][column % 3] = 1.0;
        let mut answer = vec![Vec3::zeros(); all];
        assembler.matrix().multiply(&unit, &mut answer);
        let mut product = vec![Vec3::zeros(); all];
        products.add(&unit, &mut product, &mut work);
        for (a, b) in answer.iter().zip(&product) {
            assert!((a - b).norm() < 1e-13, "{column}: {a} {b}");
        }
        for row in 0..3 * all {
            let wanted = if row < 3 * free {
                reduced[(row, column)]
            } else {
                0.0
            };
            let got = answer[row / 3][row % 3];
            assert!(
                (got - wanted).abs() < 1e-13,
                "{row} {column}: {got} {wanted}"
            );
        }
    }
}

/// No chains, no point twice: named.
#[test]
fn riders_on_riders_are_refused() {
    let rider = |point, on| Rider {
        point,
        vertices: [0, 1, on],
        weights: [0.25, 0.25, 0.5],
        turn: Mat3::identity(),
    };
    let error = Riders::new(vec![rider(6, 2), rider(7, 6)]).unwrap_err();
    assert!(error.message.contains("rides itself"), "{}", error.message);
    let error = Riders::new(vec![rider(6, 2), rider(6, 3)]).unwrap_err();
    assert!(error.message.contains("rides twice"), "{}", error.message);
}
