//! Laws that single energies of yarns obey: closed forms of physics, conservation while material slides.

use crate::sheets::Random;
use crate::terms_cases::gradient;
use crate::yarn_cases::{MATERIAL, P, WORLD, cloth, lay, stitch, weave};
use nalgebra::{SMatrix, SVector};
use std::f64::consts::{FRAC_PI_2, PI, TAU};
use toile::math::{Vec2, Vec3};
use toile::system::term::{Configuration, Term};
use toile::system::yarn::inertia::{Mass, inertia_force};
use toile::system::yarn::kernel::{Damped, Kernel, Local};
use toile::system::yarn::shear::{Shear, lock};
use toile::yarn::Family;

fn at<'a>(x: &'a [Vec3], u: &'a [f64]) -> Configuration<'a> {
    Configuration {
        x,
        x0: x,
        u,
        inv_dt: 0.0,
        world: &WORLD,
    }
}

fn energy(terms: &[Box<dyn Term>], name: &str, at: &Configuration<'_>) -> f64 {
    let mut sum = 0.0;
    for term in terms.iter().filter(|t| t.name() == name) {
        sum += (0..term.stencils().count())
            .map(|e| term.value(e, at))
            .sum::<f64>();
    }
    sum
}

/// A ring of `n` nodes has the bending energy of a circle, `pi EI / R`, times `(t/2)/sin(t/2)`, `t = 2 pi/n`.
#[test]
fn a_closed_ring_has_the_energy_of_a_circle() {
    let radius = 5e-3;
    for (n, printed) in [(8_u32, 1.026), (16, 1.0065), (64, 1.0004)] {
        let uv: Vec<Vec2> = (0..n)
            .map(|k| {
                let (s, c) = (TAU * f64::from(k) / f64::from(n)).sin_cos();
                Vec2::new(radius * c, radius * s)
            })
            .collect();
        let around: Vec<u32> = (0..n + 2).map(|k| k % n).collect();
        let ring = cloth(
            "ring",
            lay(uv, &[(Family::Course, around)], |_| vec![]),
            |_| false,
        );
        let u = ring.u();
        let x = ring.blocks(&ring.laid(), &u);
        let v = energy(&ring.terms, "yarn_bending", &at(&x, &u));
        let half = PI / f64::from(n);
        let ratio = v / (PI * MATERIAL.bending / radius);
        assert!((ratio - half / half.sin()).abs() < 1e-12, "{n}: {ratio}");
        assert!((ratio - printed).abs() < 1e-3);
        assert!(energy(&ring.terms, "yarn_stretch", &at(&x, &u)) < 1e-25);
    }
}

/// The forces of gravity sum to the weight of the yarns.
#[test]
fn gravity_is_the_weight_of_all_material() {
    let cloth = cloth("weave", weave(6, 5), |_| true);
    let u = cloth.u();
    let x = cloth.blocks(&cloth.laid(), &u);
    let at = at(&x, &u);
    let mut force = Vec3::zeros();
    for term in cloth.terms.iter().filter(|t| t.name() == "yarn_gravity") {
        for e in 0..term.stencils().count() {
            let g = gradient(term.as_ref(), e, &at);
            for (g, &v) in g.iter().zip(term.stencils().get(e)) {
                if cloth.is_position(v) {
                    force -= g;
                }
            }
        }
    }
    let length = P * (5.0 * 5.0 + 6.0 * 4.0);
    let weight = WORLD.gravity * (MATERIAL.density * length);
    assert!((force - weight).norm() < 1e-12 * weight.norm());
}

fn random_segment(random: &mut Random) -> ([f64; 8], [f64; 8]) {
    let mut q: [f64; 8] = std::array::from_fn(|_| random.signed());
    q[7] = q[6] + 1.0 + 0.5 * random.signed();
    (q, std::array::from_fn(|_| random.signed()))
}

/// Kinetic energy is the integral over the material (Gauss, exact for this degree); a node that moves along
/// the yarn while the material stands still has none; the rank is six.
#[test]
fn the_mass_matrix_is_the_kinetic_energy_of_the_material() {
    let mut random = Random::new(4);
    for _ in 0..50 {
        let (q, y) = random_segment(&mut random);
        let density = 0.7;
        let mass = Mass::new(&q, density, 0.0);
        let [a, b] = mass.material(&y);
        let g = 0.5 / 3.0_f64.sqrt();
        let gauss: f64 = [0.5 - g, 0.5 + g]
            .map(|t| 0.25 * density * (q[7] - q[6]) * a.lerp(&b, t).norm_squared())
            .iter()
            .sum();
        let t = mass.energy(&y);
        assert!((t - gauss).abs() < 1e-13 * gauss);
        let matrix = SMatrix::<f64, 8, 8>::from_fn(|i, j| {
            let unit: [f64; 8] = std::array::from_fn(|k| f64::from(u8::from(k == j)));
            mass.times(&unit)[i]
        });
        assert!((matrix - matrix.transpose()).amax() < 1e-15);
        let mut eigen: Vec<f64> = matrix.symmetric_eigenvalues().iter().copied().collect();
        eigen.sort_by(f64::total_cmp);
        assert!(eigen[1].abs() < 1e-14 && eigen[2] > 1e-3, "{eigen:?}");
        let w: Vec3 =
            std::array::from_fn::<f64, 3, _>(|c| (q[3 + c] - q[c]) / (q[7] - q[6])).into();
        let still = mass.times(&[w.x, w.y, w.z, w.x, w.y, w.z, 1.0, 1.0]);
        assert!(still.iter().all(|m| m.abs() < 1e-14));
    }
}

/// Three segments of one yarn, free in space, the two inner material coordinates sliding.
const N: usize = 14;

fn segment(q: &SVector<f64, N>, k: usize, ends: [f64; 2]) -> [f64; 8] {
    let u = |i: usize| match i {
        0 => ends[0],
        3 => ends[1],
        i => q[11 + i],
    };
    std::array::from_fn(|c| if c < 6 { q[3 * k + c] } else { u(k + c - 6) })
}

fn place(k: usize, c: usize) -> Option<usize> {
    if c < 6 {
        return Some(3 * k + c);
    }
    let i = k + c - 6;
    (i == 1 || i == 2).then_some(11 + i)
}

/// Acceleration, momentum and kinetic energy of the free yarn.
fn motion(q: &SVector<f64, N>, y: &SVector<f64, N>, forces: bool) -> (SVector<f64, N>, Vec3, f64) {
    let density = 0.3;
    let mut m = SMatrix::<f64, N, N>::zeros();
    let mut f = SVector::<f64, N>::zeros();
    let (mut momentum, mut energy) = (Vec3::zeros(), 0.0);
    for k in 0..3 {
        let (s, r) = (segment(q, k, [0.0, 3.0]), segment(y, k, [0.0, 0.0]));
        let mass = Mass::new(&s, density, 0.0);
        let [a, b] = mass.material(&r);
        momentum += (a + b) * (0.5 * density * (s[7] - s[6]));
        energy += mass.energy(&r);
        let inertia = inertia_force(&s, &r, density);
        for c in 0..8 {
            let Some(i) = place(k, c) else { continue };
            let unit: [f64; 8] = std::array::from_fn(|d| f64::from(u8::from(d == c)));
            for (d, v) in mass.times(&unit).into_iter().enumerate() {
                if let Some(j) = place(k, d) {
                    m[(j, i)] += v;
                }
            }
            if forces {
                f[i] += inertia[c];
            }
        }
    }
    (
        m.lu().solve(&f).expect("a regular mass matrix"),
        momentum,
        energy,
    )
}

/// With the inertia forces, and only with them, a free yarn whose material slides through its nodes keeps
/// momentum and energy; the error is that of the integrator (fourth order).
#[test]
fn momentum_and_energy_are_kept_while_material_slides() {
    let mut random = Random::new(8);
    let mut q = SVector::<f64, N>::zeros();
    let mut y = SVector::<f64, N>::zeros();
    let bent = [(0.0, 0.0), (1.0, 0.3), (1.7, 1.1), (2.6, 0.9)];
    for (k, (a, b)) in bent.into_iter().enumerate() {
        (q[3 * k], q[3 * k + 1], q[3 * k + 2]) = (a, b, 0.2 * random.signed());
    }
    (q[12], q[13]) = (1.0, 2.1);
    y.iter_mut().for_each(|v| *v = random.signed());
    let run = |steps: usize, forces: bool| -> (f64, f64) {
        let h = 0.2 / steps as f64;
        let (mut q, mut y) = (q, y);
        let (_, p0, e0) = motion(&q, &y, forces);
        for _ in 0..steps {
            let a1 = motion(&q, &y, forces).0;
            let (q2, y2) = (q + y * (h / 2.0), y + a1 * (h / 2.0));
            let a2 = motion(&q2, &y2, forces).0;
            let (q3, y3) = (q + y2 * (h / 2.0), y + a2 * (h / 2.0));
            let a3 = motion(&q3, &y3, forces).0;
            let (q4, y4) = (q + y3 * h, y + a3 * h);
            let a4 = motion(&q4, &y4, forces).0;
            q += (y + (y2 + y3) * 2.0 + y4) * (h / 6.0);
            y += (a1 + (a2 + a3) * 2.0 + a4) * (h / 6.0);
        }
        let (_, p, e) = motion(&q, &y, forces);
        ((p - p0).norm() / p0.norm(), (e / e0 - 1.0).abs())
    };
    let (coarse, fine, without) = (run(100, true), run(200, true), run(200, false));
    println!("momentum, energy: {coarse:?}, {fine:?}, without inertia forces {without:?}");
    assert!(fine.0 < 1e-7 && fine.1 < 1e-7);
    assert!(without.0 > 1e-2 && without.1 > 1e-2);
    assert!(fine.0 < coarse.0 / 8.0 || fine.0 < 1e-12);
}

/// Crossings of a weave lock where neighbouring yarns touch: at the pitch 1 mm and the radius 0.3 mm after 55
/// degrees; the stiffness by the angle is then a thousand times that before.
#[test]
fn shear_locks_where_yarns_touch() {
    let angle = lock(0.3e-3, 1e-3);
    assert!((angle.to_degrees() - 55.08).abs() < 0.01);
    assert!((angle - (FRAC_PI_2 - 2.0 * 0.3_f64.asin())).abs() < 1e-15);
    let corner = Shear::new(9e-5, 0.3e-3, 1e-3, 0.0);
    let moment = |g: f64| {
        let (s, c) = (FRAC_PI_2 + g).sin_cos();
        let q = [0.0, 0.0, 0.0, P, 0.0, 0.0, P * c, P * s, 0.0];
        let local = Local {
            q: &q,
            q0: &q,
            start: Damped::default(),
            inv_dt: 0.0,
            gravity: Vec3::zeros(),
        };
        let mut out = [0.0; 9];
        corner.gradient(&local, &mut out);
        // torque of the force on the second neighbour
        P * (c * out[7] - s * out[6])
    };
    let stiffness = |g: f64| (moment(g + 1e-5) - moment(g - 1e-5)) / 2e-5;
    for sign in [1.0, -1.0] {
        assert!((stiffness(sign * (angle - 0.05)) / 9e-8 - 1.0).abs() < 1e-6);
        assert!((stiffness(sign * (angle + 0.15)) / 9e-5 - 1.0).abs() < 1e-6);
        let small = moment(sign * 1e-3) / (9e-8 * 1e-3 * sign);
        assert!((small - 1.0).abs() < 1e-9);
    }
}

/// In the flat fabric no contact is wrapped. Unwrapping the left contact of a knit stitch drives the wings along the
/// wales to the front and those along the courses to the back; so does the right contact, its mirror image, with
/// the other handedness; a purl stitch does the reverse.
#[test]
fn stitches_unwrap_legs_to_the_front_and_heads_to_the_back() {
    for mirrored in [1.0, -1.0] {
        for purl in [1.0, -1.0] {
            let mut mesh = stitch();
            mesh.uv.iter_mut().for_each(|p| p.x *= mirrored);
            for wrap in &mut mesh.wraps {
                wrap.sign *= mirrored * purl;
            }
            let cloth = cloth("", mesh, |_| false);
            let u = cloth.u();
            let flat = |p: &Vec2| Vec3::new(p.x, p.y, 0.0);
            let x = cloth.blocks(&cloth.mesh.uv.iter().map(flat).collect::<Vec<_>>(), &u);
            let mut force = vec![Vec3::zeros(); x.len()];
            let at = at(&x, &u);
            for term in cloth.terms.iter().filter(|t| t.name() == "stitch_wrapping") {
                for e in 0..term.stencils().count() {
                    let v = term.stencils().get(e);
                    let g = gradient(term.as_ref(), e, &at);
                    g.iter().zip(v).for_each(|(g, &v)| force[v as usize] -= g);
                    // the energy of the flat contact is that of a quarter turn, but for the guard
                    let quarter =
                        0.5 * MATERIAL.wrapping * cloth.mesh.wraps[e].length * FRAC_PI_2.powi(2);
                    let part = term.value(e, &at) / quarter;
                    assert!((0.7..=1.0 + 1e-12).contains(&part), "{part}");
                }
            }
            let out = |node: usize| force[crate::yarn_cases::BEFORE as usize + node].z * purl;
            // legs up and down, then sinker and head
            assert!(out(2) > 0.0 && out(5) > 0.0, "{} {}", out(2), out(5));
            assert!(out(3) < 0.0 && out(4) < 0.0, "{} {}", out(3), out(4));
        }
    }
}
