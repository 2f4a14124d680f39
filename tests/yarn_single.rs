//! A single yarn in equilibrium, against closed forms: the hanging chain, cantilevers, the buckled strut.
//!
//! The yarn is a chain of `n` equal segments with the energies of yarns that toile builds, brought to rest by a dense
//! Newton method with the exact second derivative.

use crate::sheets::NoBodies;
use crate::terms_cases::{add, hessian};
use crate::yarn_cases::{MATERIAL, lay};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::{FRAC_PI_2, PI};
use toile::math::{Vec2, Vec3};
use toile::system::term::{Configuration, HessianKind, Term, World};
use toile::system::yarn::unknowns::Unknowns;
use toile::system::yarn::{YarnOptions, terms};
use toile::yarn::{Family, YarnMaterial};

/// Length of every yarn here [m].
const LENGTH: f64 = 0.1;

struct Chain {
    terms: Vec<Box<dyn Term>>,
    u: Vec<f64>,
    world: World<'static>,
    /// Forces from outside [N].
    loads: Vec<Vec3>,
    /// Nodes that do not move.
    held: Vec<usize>,
    /// Forces that rounding of stretch makes [N].
    rounding: f64,
}

impl Chain {
    /// `n` segments of equal length, nodes `held`.
    fn new(n: usize, material: YarnMaterial, gravity: f64, held: &[usize]) -> Self {
        let h = LENGTH / n as f64;
        let uv = (0..=n).map(|k| Vec2::new(k as f64 * h, 0.0)).collect();
        let mesh = lay(
            uv,
            &[(Family::Course, (0..=n as u32).collect())],
            |_| vec![],
        );
        let still = vec![false; mesh.incidences.len()];
        let unknowns = Unknowns::new(&mesh, 0, n as u32 + 1, &still).expect("unknowns");
        let options = YarnOptions::default();
        let mut terms = terms(&mesh, &[material], &unknowns, &options).expect("terms");
        terms.retain(|t| ["yarn_stretch", "yarn_bending", "yarn_gravity"].contains(&t.name()));
        assert_eq!(terms.len(), 3);
        Self {
            terms,
            u: mesh.incidences.iter().map(|i| i.u).collect(),
            world: World {
                gravity: Vec3::new(0.0, -gravity, 0.0),
                wind: Vec3::zeros(),
                pressure: 0.0,
                bodies: &NoBodies,
            },
            loads: vec![Vec3::zeros(); n + 1],
            held: held.to_vec(),
            rounding: 5e-14 * material.stretch,
        }
    }

    fn at<'a>(&'a self, x: &'a [Vec3]) -> Configuration<'a> {
        Configuration {
            x,
            x0: x,
            u: &self.u,
            inv_dt: 0.0,
            world: &self.world,
        }
    }

    fn energy(&self, x: &[Vec3]) -> f64 {
        let at = self.at(x);
        let of = |t: &dyn Term| {
            (0..t.stencils().count())
                .map(|e| t.value(e, &at))
                .sum::<f64>()
        };
        let inside: f64 = self.terms.iter().map(|t| of(t.as_ref())).sum();
        inside
            - x.iter()
                .zip(&self.loads)
                .map(|(x, f)| x.dot(f))
                .sum::<f64>()
    }

    /// Gradient of the energy, loads included: on nodes that are held, the force of their holder.
    fn gradient(&self, x: &[Vec3]) -> Vec<Vec3> {
        let mut g: Vec<Vec3> = self.loads.iter().map(|f| -f).collect();
        for term in &self.terms {
            add(term.as_ref(), &self.at(x), &mut g);
        }
        g
    }

    /// Exact second derivative by what moves, node by node.
    fn hessian(&self, x: &[Vec3]) -> DMatrix<f64> {
        let free: Vec<usize> = (0..x.len()).filter(|k| !self.held.contains(k)).collect();
        let place: Vec<Option<usize>> = (0..x.len()).map(|k| free.binary_search(&k).ok()).collect();
        let at = self.at(x);
        let mut out = DMatrix::zeros(3 * free.len(), 3 * free.len());
        for term in self
            .terms
            .iter()
            .filter(|t| t.has_hessian(HessianKind::Exact))
        {
            for e in 0..term.stencils().count() {
                let h = hessian(term.as_ref(), e, &at, HessianKind::Exact);
                let nodes = term.stencils().get(e);
                for (i, a) in nodes.iter().enumerate() {
                    for (j, b) in nodes.iter().enumerate() {
                        let (a, b) = (place[*a as usize], place[*b as usize]);
                        if let (Some(a), Some(b)) = (a, b) {
                            let mut block = out.view_mut((3 * a, 3 * b), (3, 3));
                            block += h.view((3 * i, 3 * j), (3, 3));
                        }
                    }
                }
            }
        }
        out
    }

    /// The equilibrium near `x`, up to rounding.
    fn rest(&self, mut x: Vec<Vec3>) -> Vec<Vec3> {
        let free: Vec<usize> = (0..x.len()).filter(|k| !self.held.contains(k)).collect();
        for _ in 0..2000 {
            let g = self.gradient(&x);
            let r = DVector::from_fn(3 * free.len(), |i, _| -g[free[i / 3]][i % 3]);
            if r.amax() < self.rounding {
                return x;
            }
            let h = self.hessian(&x);
            let mut shift = 1e-12 * h.amax();
            let d = loop {
                let shifted = &h + DMatrix::identity(h.nrows(), h.ncols()) * shift;
                match shifted.cholesky() {
                    Some(factor) => break factor.solve(&r),
                    None => shift *= 4.0,
                }
            };
            let before = self.energy(&x);
            let mut part = (0.5 * self.u[1] / d.amax()).min(1.0);
            loop {
                let mut to = x.clone();
                for (k, node) in free.iter().enumerate() {
                    to[*node] += part * Vec3::new(d[3 * k], d[3 * k + 1], d[3 * k + 2]);
                }
                // near rest differences of energy are rounding
                if self.energy(&to) <= before + 1e-14 * before.abs() || part < 1e-10 {
                    x = to;
                    break;
                }
                part *= 0.5;
            }
        }
        panic!("no equilibrium: {:?}", self.gradient(&x));
    }
}

/// `f` brackets a root between `a` and `b`.
fn root(mut a: f64, mut b: f64, f: impl Fn(f64) -> f64) -> f64 {
    let rises = f(b) > 0.0;
    for _ in 0..200 {
        let m = 0.5 * (a + b);
        if (f(m) > 0.0) == rises {
            b = m;
        } else {
            a = m;
        }
    }
    0.5 * (a + b)
}

/// A yarn without bending stiffness, hung at two points, is the chain of rods whose slopes grow evenly; that tends to the catenary
/// `L = 2a sinh(D/2a)` with the sag `a (cosh(D/2a) - 1)`, with the square of the spacing.
#[test]
fn a_slack_yarn_hangs_as_a_catenary() {
    let span = 0.8 * LENGTH;
    let a = root(0.01, 1.0, |a| 2.0 * a * (0.5 * span / a).sinh() - LENGTH);
    let sag = a * ((0.5 * span / a).cosh() - 1.0);
    assert!((sag - 26.544e-3).abs() < 1e-6);
    let mut errors = Vec::new();
    for n in [20, 40, 80] {
        let material = YarnMaterial {
            stretch: 200.0,
            bending: 0.0,
            ..MATERIAL
        };
        let chain = Chain::new(n, material, 9.81, &[0, n]);
        let start = (0..=n)
            .map(|k| {
                let t = k as f64 / n as f64;
                Vec3::new(span * t, -0.03 * (PI * t).sin(), 0.0)
            })
            .collect();
        let x = chain.rest(start);
        let h = LENGTH / n as f64;
        // slopes of the rods: those of each half carry what hangs below them
        let slope = |k: usize, pull: f64| (k as f64 + 0.5 - 0.5 * n as f64) * h / pull;
        let wide = |pull: f64| -> f64 {
            let cosine = |k| 1.0 / f64::hypot(1.0, slope(k, pull));
            (0..n).map(|k| h * cosine(k)).sum::<f64>() - span
        };
        let pull = root(1e-4, 1.0, wide);
        let sine = |k| slope(k, pull) / f64::hypot(1.0, slope(k, pull));
        let rods: f64 = (0..n / 2).map(|k| -h * sine(k)).sum();
        println!(
            "catenary of {n}: sag {:.4} mm, rods {:.4} mm, catenary {:.4} mm",
            -1e3 * x[n / 2].y,
            1e3 * rods,
            1e3 * sag
        );
        assert!((-x[n / 2].y / rods - 1.0).abs() < 1e-5);
        errors.push((-x[n / 2].y - sag).abs());
    }
    assert!(errors[1] < 1e-3 * sag);
    assert!(
        errors
            .windows(2)
            .all(|e| (3.5..4.5).contains(&(e[0] / e[1]))),
        "{errors:?}"
    );
}

/// Two nodes hold a yarn like a clamp half a segment before the second: with a small load at its tip it sinks by
/// `F L^3/(3 EI)` up to the square of the spacing, and just as far as hinges of stiffness `EI/h` do.
#[test]
fn a_yarn_that_is_clamped_sinks_under_a_load_at_its_tip() {
    for n in [10, 20, 40] {
        let material = YarnMaterial {
            stretch: 0.02,
            ..MATERIAL
        };
        let mut chain = Chain::new(n, material, 0.0, &[0, 1]);
        let load = 1e-2 * MATERIAL.bending / LENGTH.powi(2);
        chain.loads[n] = Vec3::new(0.0, -load, 0.0);
        let h = LENGTH / n as f64;
        let x = chain.rest((0..=n).map(|k| Vec3::new(k as f64 * h, 0.0, 0.0)).collect());
        let sunk = -x[n].y;
        let hinges: f64 = (1..n).map(|k| load * h.powi(3) * (k as f64).powi(2)).sum();
        let beam = |length: f64| load * length.powi(3) / (3.0 * MATERIAL.bending);
        let (near, half) = (beam(LENGTH - h), beam(LENGTH - 0.5 * h));
        println!(
            "cantilever of {n}: {:.4} from node 1, {:.6} from half a segment before",
            sunk / near,
            sunk / half
        );
        assert!((sunk * MATERIAL.bending / hinges - 1.0).abs() < 2e-5);
        assert!((sunk / half - 1.0).abs() < 0.3 / (n * n) as f64);
    }
}

/// A clamped yarn that hangs by its own weight is the heavy elastica `t'' = -G (1 - s) cos t`, `t(0) = 0`, `t'(1) = 0`,
/// `G = w L^3/EI`, integrated here by Runge and Kutta's method from the root on.
#[test]
fn a_yarn_that_is_clamped_hangs_as_the_heavy_elastica() {
    for (weight, printed) in [(1.0, 0.123_471_402), (10.0, 0.700_199_716)] {
        let shape = |curvature: f64| -> [f64; 4] {
            let rate = |s: f64, y: [f64; 4]| {
                [
                    y[1],
                    weight * (1.0 - s) * y[0].cos(),
                    y[0].cos(),
                    y[0].sin(),
                ]
            };
            let (mut y, steps) = ([0.0, -curvature, 0.0, 0.0], 400);
            let h = 1.0 / f64::from(steps);
            for k in 0..steps {
                let s = f64::from(k) * h;
                let on = |d: [f64; 4], t: f64| std::array::from_fn(|i| y[i] + t * d[i]);
                let a = rate(s, y);
                let b = rate(s + 0.5 * h, on(a, 0.5 * h));
                let c = rate(s + 0.5 * h, on(b, 0.5 * h));
                let d = rate(s + h, on(c, h));
                y = std::array::from_fn(|i| y[i] + h / 6.0 * (a[i] + 2.0 * (b[i] + c[i]) + d[i]));
            }
            y
        };
        let drop = -shape(root(0.0, 0.5 * weight, |c| -shape(c)[1]))[3];
        assert!((drop - printed).abs() < 1e-7, "{drop}");
        let mut errors = Vec::new();
        for n in [20, 40, 80] {
            // the clamp is half a segment before node 1
            let length = LENGTH * (1.0 - 0.5 / n as f64);
            let gravity = weight * MATERIAL.bending / (MATERIAL.density * length.powi(3));
            let chain = Chain::new(n, MATERIAL, gravity, &[0, 1]);
            let h = LENGTH / n as f64;
            let x = chain.rest((0..=n).map(|k| Vec3::new(k as f64 * h, 0.0, 0.0)).collect());
            println!(
                "elastica {weight} of {n}: drop {:.5}, {drop:.5}",
                -x[n].y / length
            );
            errors.push((-x[n].y / length - drop).abs());
        }
        assert!(errors[1] < 1e-3, "{errors:?}");
        assert!(errors.windows(2).all(|e| e[1] < 0.35 * e[0]), "{errors:?}");
    }
}

/// A straight yarn between pins loses its stability at `4 EI/h^2 sin^2(pi/2n)`, which tends to Euler's `pi^2 EI/L^2`; further on
/// it is the elastica whose ends turn by 60 degrees, `P = (2 K/pi)^2 P_c` at the distance `(2 E/K - 1) L`.
#[test]
fn a_yarn_between_pins_buckles_as_euler_says() {
    let euler = PI.powi(2) * MATERIAL.bending / LENGTH.powi(2);
    for n in [10, 40] {
        let h = LENGTH / n as f64;
        let chain = Chain::new(n, MATERIAL, 0.0, &[0, n]);
        let straight = |load: f64| -> Vec<Vec3> {
            let shorter = 1.0 - load / MATERIAL.stretch;
            (0..=n)
                .map(|k| Vec3::new(k as f64 * h * shorter, 0.0, 0.0))
                .collect()
        };
        let stable = |load: f64| chain.hessian(&straight(load)).cholesky().is_some();
        let critical = root(
            0.5 * euler,
            2.0 * euler,
            |p| if stable(p) { -1.0 } else { 1.0 },
        );
        let hinges = (2.0 * n as f64 / PI * (FRAC_PI_2 / n as f64).sin()).powi(2);
        println!(
            "strut of {n}: buckles at {:.6} of Euler's load, hinges {hinges:.6}",
            critical / euler
        );
        assert!((critical / (hinges * euler) - 1.0).abs() < 1e-5);
    }
    // complete elliptic integrals of the modulus sin(30 degrees)
    let (k, e) = (1.685_750_354_812_596, 1.467_462_209_339_427);
    let expected = (2.0 * k / PI).powi(2);
    let mut errors = Vec::new();
    for n in [20, 40, 80] {
        let chain = Chain::new(n, MATERIAL, 0.0, &[0, n]);
        let apart = (2.0 * e / k - 1.0) * LENGTH;
        let start = (0..=n)
            .map(|k| {
                let t = k as f64 / n as f64;
                Vec3::new(apart * t, 0.3 * LENGTH * (PI * t).sin(), 0.0)
            })
            .collect();
        let x = chain.rest(start);
        let load = chain.gradient(&x)[0].x;
        println!(
            "strut of {n}, ends at 60 degrees: {:.5} of Euler's load, elastica {expected:.5}",
            load / euler
        );
        errors.push((load / euler - expected).abs());
    }
    assert!(errors[1] < 1e-3, "{errors:?}");
    assert!(
        errors
            .windows(2)
            .all(|e| (3.0..5.0).contains(&(e[0] / e[1]))),
        "{errors:?}"
    );
}
