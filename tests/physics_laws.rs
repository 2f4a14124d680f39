//! Laws that the whole simulator must keep: friction, energy, momentum, order in the time step,
//! statics, and the same bits whatever the number of threads or the way to a state.

use crate::sheets::Random;
use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::{BendingModel, Fabric};
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions};
use toile::tri::grid::{SheetPattern, sheet_garment, structured_sheet};

const G: f64 = 9.81;

/// A square sheet of `n` x `n` cells in the plane z = 0, without air and self-contact.
fn sheet(size: f64, n: usize, fabric: Fabric, gravity: [f64; 3], tolerance: f64) -> Sim {
    let settings = Settings {
        newton_velocity_tolerance: tolerance,
        self_contact: 0.0,
        air_drag: 0.0,
        air_lift: 0.0,
        ..Settings::default()
    };
    sheet_with(size, n, fabric, gravity, settings)
}

fn sheet_with(size: f64, n: usize, fabric: Fabric, gravity: [f64; 3], settings: Settings) -> Sim {
    let mesh = structured_sheet(size, size, n, n, SheetPattern::Alternating).unwrap();
    let garment = sheet_garment(size, size, size / n as f64, fabric);
    let options = SimOptions {
        gravity: Some(gravity),
        settings,
        ..SimOptions::default()
    };
    Sim::from_mesh(&garment, mesh, &options).unwrap()
}

fn default_tolerance() -> f64 {
    Settings::default().newton_velocity_tolerance
}

fn arrays(points: &[Vec3]) -> Vec<[f64; 3]> {
    points.iter().map(|p| (*p).into()).collect()
}

fn mean(points: &[Vec3], masses: &[f64]) -> Vec3 {
    let sum: Vec3 = points.iter().zip(masses).map(|(p, m)| p * *m).sum();
    sum / masses.iter().sum::<f64>()
}

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(p, q)| (p - q).norm())
        .fold(0.0, f64::max)
}

/// Umetani et al. 2011, Fig. 6, in small; `cargo bench --bench umetani` is the whole of it.
#[test]
fn a_tangle_unfolds_to_the_drape_of_the_flat_sheet() {
    for (n, bending) in [(16, 1e-5), (12, 1e-3)] {
        let hung = || {
            let fabric = Fabric {
                bending_warp: bending,
                bending_weft: bending,
                bending_model: BendingModel::Quadratic,
                ..Fabric::default()
            };
            let mut sim = sheet(1.0, n, fabric, [0.0, -G, 0.0], default_tolerance());
            let last = ((n + 1) * (n + 1) - 1) as u32;
            sim.pin(&[last - n as u32, last], None).unwrap();
            sim
        };
        let options = DrapeOptions {
            force_tolerance: 0.0,
            max_steps: 0,
        };
        let want = hung().drape(&options, &mut |_| true).unwrap();
        for seed in 1..=3 {
            let mut sim = hung();
            let mut random = Random::new(seed);
            let corner = sim.positions()[0];
            let mut positions: Vec<[f64; 3]> = sim
                .positions()
                .iter()
                .map(|_| (corner + random.vec3(1.0)).into())
                .collect();
            for pin in [(n + 1) * (n + 1) - 1 - n, (n + 1) * (n + 1) - 1] {
                positions[pin] = sim.positions()[pin].into();
            }
            sim.set_positions(&positions, None).unwrap();
            let mut fraction = 0.0;
            let got = sim
                .drape(&options, &mut |p| {
                    assert!(p.fraction >= fraction);
                    fraction = p.fraction;
                    true
                })
                .unwrap();
            println!(
                "{n} x {n}, {bending} N m, seed {seed}: {} iterations, {:.6} J of {:.6} J",
                got.newton_iterations, got.potential_energy, want.potential_energy
            );
            assert_eq!(got.outcome, Outcome::Converged);
            assert!((got.potential_energy / want.potential_energy - 1.0).abs() < 0.01);
        }
    }
}

/// A patch at rest on a plane whose weight is then tilted by an angle of the given tangent:
/// distance slid after `duration`, and the speed at its end.
fn slide(mu: f64, tangent: f64, dt: f64, duration: f64) -> (f64, f64) {
    let mut sim = sheet(
        0.1,
        4,
        Fabric::default(),
        [0.0, 0.0, -G],
        default_tolerance(),
    );
    let contact = ContactSettings {
        friction: mu,
        ..ContactSettings::default()
    };
    sim.add_body(&Body::plane([0.0, 0.0, 1.0], 0.0).unwrap(), &contact)
        .unwrap();
    let flat: Vec<[f64; 3]> = sim
        .positions()
        .iter()
        .map(|p| [p.x, p.y, contact.thickness])
        .collect();
    sim.set_positions(&flat, None).unwrap();
    for _ in 0..20 {
        sim.step(dt).unwrap();
    }
    let angle = tangent.atan();
    sim.set_number("gravity.x", G * angle.sin()).unwrap();
    sim.set_number("gravity.z", -G * angle.cos()).unwrap();
    let start = sim.positions().to_vec();
    for _ in 0..(duration / dt).round() as usize {
        sim.step(dt).unwrap();
    }
    let velocity = mean(sim.velocities(), sim.masses());
    (furthest(sim.positions(), &start), velocity.x)
}

#[test]
fn a_patch_slides_on_an_incline_iff_its_tangent_exceeds_the_friction() {
    for mu in [0.2, 1.0] {
        for dt in [0.004, 0.01] {
            let (stuck, _) = slide(mu, 0.99 * mu, dt, 1.0);
            let tangent = 1.01 * mu;
            let (slid, speed) = slide(mu, tangent, dt, 1.0);
            let angle = tangent.atan();
            let want = G * (angle.sin() - mu * angle.cos());
            println!(
                "mu {mu} dt {dt}: below {:.3e} m, above {slid:.4} m, acceleration {speed:.5} of {want:.5}",
                stuck
            );
            assert!(stuck < 1e-4, "slid {stuck} m below the angle of friction");
            assert!(
                (speed / want - 1.0).abs() < 0.1,
                "acceleration {speed}, {want} expected"
            );
            assert!((slid / (0.5 * want) - 1.0).abs() < 0.1, "slid {slid} m");
        }
    }
}

#[test]
fn energy_never_grows_without_work() {
    for dt in [0.001_f64, 0.005, 0.02] {
        let mut sim = sheet(
            0.3,
            8,
            Fabric::default(),
            [0.0, -G, 0.0],
            default_tolerance(),
        );
        // horizontal, held at two corners
        let placed: Vec<[f64; 3]> = sim.positions().iter().map(|p| [p.x, 0.0, p.y]).collect();
        sim.set_positions(&placed, None).unwrap();
        sim.pin(&[0, 8], None).unwrap();
        let first = sim.report().unwrap();
        let mut energy = first.potential_energy + first.kinetic_energy;
        let (start, scale) = (energy, sim.masses().iter().sum::<f64>() * G * 0.3);
        let mut growth = 0.0_f64;
        for _ in 0..(0.3 / dt).round() as usize {
            let report = sim.step(dt).unwrap();
            let now = report.potential_energy + report.kinetic_energy;
            growth = growth.max(now - energy);
            energy = now;
        }
        println!(
            "dt {dt}: lost {:.4} of m g L, largest growth {:.2e} of it",
            (start - energy) / scale,
            growth / scale
        );
        assert!(growth <= 1e-9 * scale, "energy grew by {growth} J");
        assert!(start - energy > 0.0);
    }
}

#[test]
fn the_error_is_of_order_one_in_the_time_step() {
    // a soft sheet, so that its fastest wave is resolved by every step
    let soft = Fabric {
        warp: 6.0,
        weft: 6.0,
        shear: 2.0,
        ..Fabric::default()
    };
    let at = |dt: f64| {
        let mut sim = sheet(0.5, 4, soft.clone(), [0.0, -G, 0.0], 1e-9);
        let placed: Vec<[f64; 3]> = sim.positions().iter().map(|p| [p.x, 0.0, p.y]).collect();
        sim.set_positions(&placed, None).unwrap();
        sim.pin(&[0, 4], None).unwrap();
        for _ in 0..(0.2 / dt).round() as usize {
            let report = sim.step(dt).unwrap();
            assert_eq!(report.substeps, 1);
        }
        sim.positions().to_vec()
    };
    let reference = at(5e-5);
    let errors: Vec<f64> = [4e-3, 2e-3, 1e-3]
        .iter()
        .map(|&dt| furthest(&at(dt), &reference))
        .collect();
    let orders: Vec<f64> = errors.windows(2).map(|e| (e[0] / e[1]).log2()).collect();
    println!("errors {errors:.6?} m, orders {orders:.3?}");
    for order in orders {
        assert!((0.8..1.3).contains(&order), "order {order}");
    }
}

#[test]
fn a_free_sheet_falls_as_backward_euler_falls() {
    let (dt, steps) = (0.01, 50);
    let mut sim = sheet(
        0.3,
        6,
        Fabric::default(),
        [1.0, -G, 0.5],
        default_tolerance(),
    );
    let start = sim.positions().to_vec();
    let gravity = Vec3::new(1.0, -G, 0.5);
    for n in 1..=steps {
        sim.step(dt).unwrap();
        let fall = gravity * (dt * dt * 0.5 * f64::from(n * (n + 1)));
        for ((p, q), v) in sim.positions().iter().zip(&start).zip(sim.velocities()) {
            assert!((p - q - fall).norm() < 1e-11, "{:e}", (p - q - fall).norm());
            assert!((v - gravity * (dt * f64::from(n))).norm() < 1e-9);
        }
    }
}

#[test]
fn a_free_sheet_keeps_its_momentum() {
    let mut sim = sheet(0.3, 6, Fabric::default(), [0.0; 3], default_tolerance());
    // tumbling, bent and stretched
    let omega = Vec3::new(3.0, 5.0, 4.0);
    let positions: Vec<[f64; 3]> = sim
        .positions()
        .iter()
        .map(|p| [1.01 * p.x, p.y, 0.3 * p.x * p.x])
        .collect();
    let velocities: Vec<[f64; 3]> = positions
        .iter()
        .map(|p| (omega.cross(&Vec3::from(*p)) + Vec3::new(1.0, 0.0, 0.5)).into())
        .collect();
    sim.set_positions(&positions, Some(&velocities)).unwrap();
    let before = mean(sim.velocities(), sim.masses());
    for _ in 0..50 {
        sim.step(0.01).unwrap();
    }
    let after = mean(sim.velocities(), sim.masses());
    println!(
        "momentum per mass changed by {:.2e} m/s",
        (after - before).norm()
    );
    assert!((after - before).norm() < 1e-9 * before.norm());
}

#[test]
fn a_draped_sheet_hangs_as_long_as_its_weight_pulls_it() {
    let (size, n) = (0.5, 20);
    for stiffness in [20.0, 100.0, 1000.0] {
        let fabric = Fabric {
            warp: stiffness,
            weft: stiffness,
            ..Fabric::default()
        };
        let q = fabric.density * G * size / stiffness;
        let mut sim = sheet(size, n, fabric, [0.0, -G, 0.0], default_tolerance());
        let top: Vec<u32> = (0..=n).map(|i| (n * (n + 1) + i) as u32).collect();
        sim.pin(&top, None).unwrap();
        let options = DrapeOptions {
            force_tolerance: 1e-7,
            max_steps: 0,
        };
        let report = sim.drape(&options, &mut |_| true).unwrap();
        let lowest = sim.positions().iter().map(|p| p.y).fold(f64::MAX, f64::min);
        let stretch = -lowest / size;
        // lambda (lambda^2 - 1) / 2 = q s, integrated over s by Simpson's rule
        let lambda = |s: f64| {
            let mut l = 1.0_f64;
            for _ in 0..50 {
                l -= (0.5 * l * (l * l - 1.0) - q * s) / (1.5 * l * l - 0.5);
            }
            l
        };
        let cells = 1000;
        let want: f64 = (0..cells)
            .map(|i| {
                let [a, m, b] = [0.0, 0.5, 1.0].map(|t| (f64::from(i) + t) / f64::from(cells));
                (lambda(a) + 4.0 * lambda(m) + lambda(b)) / 6.0 / f64::from(cells)
                    - 1.0 / f64::from(cells)
            })
            .sum();
        println!(
            "{stiffness} N/m: stretch {stretch:.6} of {want:.6}, {:?}, residual {:.1e} N",
            report.outcome, report.residual
        );
        assert!((stretch / want - 1.0).abs() < 5e-3);
    }
}

/// A sheet folded over itself with a gap that closes, falling on a ball.
fn folded_on_a_ball(threads: f64, self_contact: f64) -> Sim {
    let n = 24;
    let settings = Settings {
        threads,
        self_contact,
        ..Settings::default()
    };
    let mut sim = sheet_with(0.4, n, Fabric::default(), [0.0, -G, 0.0], settings);
    sim.add_body(&Body::sphere(0.1).unwrap(), &ContactSettings::default())
        .unwrap();
    // the fold is a half circle of radius r around the middle line
    let r = 0.018;
    let arc = std::f64::consts::PI * r;
    let mut velocities = Vec::new();
    let positions: Vec<[f64; 3]> = sim
        .positions()
        .iter()
        .map(|p| {
            let s = p.x - 0.2;
            let (x, y) = if s < -0.5 * arc {
                (s + 0.5 * arc, 0.0)
            } else if s > 0.5 * arc {
                (0.5 * arc - s, 2.0 * r)
            } else {
                let a = s / r;
                (r * a.cos(), r + r * a.sin())
            };
            velocities.push([0.0, if y > r { -1.0 } else { 0.0 }, 0.0]);
            [x + 0.1, y + 0.104, p.y - 0.2]
        })
        .collect();
    sim.set_positions(&positions, Some(&velocities)).unwrap();
    sim
}

fn bits(sim: &Sim) -> Vec<u64> {
    sim.positions()
        .iter()
        .chain(sim.velocities())
        .flat_map(|p| [p.x.to_bits(), p.y.to_bits(), p.z.to_bits()])
        .collect()
}

#[test]
fn one_and_two_threads_give_the_same_bits() {
    let run = |threads, self_contact| {
        let mut sim = folded_on_a_ball(threads, self_contact);
        for _ in 0..6 {
            sim.step(0.005).unwrap();
        }
        assert!(sim.energies().unwrap().contact > 0.0);
        (bits(&sim), sim.save().unwrap())
    };
    let one = run(1.0, 1.0);
    assert!(one == run(2.0, 1.0), "bits depend on the number of threads");
    assert!(one.0 != run(1.0, 0.0).0, "self-contact did not act");
}

#[test]
fn a_restored_snapshot_continues_bitwise() {
    let mut sim = folded_on_a_ball(1.0, 1.0);
    for _ in 0..4 {
        sim.step(0.005).unwrap();
    }
    let bytes = sim.save().unwrap();
    let mut other = folded_on_a_ball(2.0, 1.0);
    other.restore(&bytes).unwrap();
    assert_eq!(bytes, other.save().unwrap());
    for k in 0..3 {
        sim.step(0.005).unwrap();
        other.step(0.005).unwrap();
        assert!(sim.save().unwrap() == other.save().unwrap(), "step {k}");
    }
}

#[test]
fn a_refused_or_failed_call_leaves_the_state_as_it_was() {
    let build = || {
        let mut sim = folded_on_a_ball(1.0, 1.0);
        for _ in 0..4 {
            sim.step(0.005).unwrap();
        }
        sim
    };
    let mut sim = build();
    let before = sim.save().unwrap();
    let mut bad = arrays(sim.positions());
    bad[7][1] = f64::NAN;
    let good = arrays(sim.positions());
    let nan = [f64::NAN; 3];
    let options = DrapeOptions {
        force_tolerance: f64::NAN,
        max_steps: 1,
    };
    let mut errors = vec![
        sim.set_positions(&bad, None).unwrap_err(),
        sim.set_positions(&good, Some(&bad)).unwrap_err(),
        sim.set_positions(&good[1..], None).unwrap_err(),
        sim.pin(&[0, 1], Some(&[[0.0; 3], nan])).unwrap_err(),
        sim.pin(&[0, 1 << 20], None).unwrap_err(),
        sim.unpin(&[0]).unwrap_err(),
        sim.set_body_pose(0, nan, [0.0, 0.0, 0.0, 1.0]).unwrap_err(),
        sim.set_body_pose(0, [0.0; 3], [0.0; 4]).unwrap_err(),
        sim.set_body_pose(1, [0.0; 3], [0.0, 0.0, 0.0, 1.0])
            .unwrap_err(),
        sim.set_number("gravity.y", f64::INFINITY).unwrap_err(),
        sim.set_number("solver.step.min", -1.0).unwrap_err(),
        sim.set_number("no.such.number", 1.0).unwrap_err(),
        sim.drape(&options, &mut |_| true).unwrap_err(),
        sim.restore(&before[..before.len() / 2]).unwrap_err(),
        sim.restore(&[]).unwrap_err(),
    ];
    for dt in [f64::NAN, 0.0, -0.01, f64::INFINITY] {
        errors.push(sim.step(dt).unwrap_err());
    }
    assert!(sim.save().unwrap() == before);
    // a step that cannot be cut as far as it would have to be
    sim.set_number("solver.step.min", 0.02).unwrap();
    sim.set_number("solver.newton.max_iterations", 1.0).unwrap();
    // a snapshot has the tunables too
    let before = sim.save().unwrap();
    errors.push(sim.step(0.03).unwrap_err());
    assert!(sim.save().unwrap() == before, "a failed step left a trace");
    for error in &errors {
        assert!(!error.to_string().is_empty());
    }
    // and nothing hidden has changed either
    let defaults = Settings::default();
    sim.set_number("solver.step.min", defaults.min_step)
        .unwrap();
    sim.set_number(
        "solver.newton.max_iterations",
        defaults.newton_max_iterations,
    )
    .unwrap();
    let mut fresh = build();
    for _ in 0..3 {
        sim.step(0.005).unwrap();
        fresh.step(0.005).unwrap();
    }
    assert!(sim.save().unwrap() == fresh.save().unwrap());
}

#[test]
fn a_stopped_drape_keeps_what_it_did_and_goes_on() {
    let path = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("examples");
    let text = std::fs::read_to_string(path.join("tshirt.json")).unwrap();
    let garment = toile::pattern::import::garment_from_json(&text, Some(&path)).unwrap();
    let body = toile::body::mannequin::body(0.01).unwrap();
    let mut sim = Sim::new(&garment, &SimOptions::default()).unwrap();
    sim.add_body(&body, &ContactSettings::default()).unwrap();
    let whole = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    // stopped on the coarse mesh, first while it sews, then while it settles on the fine one
    let mut gap = sim.report().unwrap().max_seam_gap;
    for calls in [60, 120] {
        let mut count = 0;
        let before = sim.positions().to_vec();
        let report = sim
            .drape(&whole, &mut |_| {
                count += 1;
                count < calls
            })
            .unwrap();
        assert_eq!(report.outcome, Outcome::Cancelled);
        assert!(furthest(&before, sim.positions()) > 1e-3);
        assert!(report.max_seam_gap < gap, "{} m", report.max_seam_gap);
        gap = report.max_seam_gap;
        let now = sim.report().unwrap();
        assert_eq!(now.outcome, Outcome::IterationLimit);
        assert!((now.residual / report.residual - 1.0).abs() < 1e-9);
    }
    let report = sim.drape(&whole, &mut |_| true).unwrap();
    println!("{report:?}");
    assert_eq!(report.outcome, Outcome::Converged);
    assert!(report.max_seam_gap < 2e-3 && report.min_gap > -1e-3);
    assert_eq!(sim.report().unwrap().outcome, Outcome::Converged);
}

#[test]
fn a_relative_tolerance_spares_iterations_and_keeps_the_motion() {
    let fall = |relative: f64| {
        let settings = Settings {
            newton_velocity_tolerance: 1e-9,
            newton_relative_tolerance: relative,
            self_contact: 0.0,
            ..Settings::default()
        };
        let mut sim = sheet_with(0.3, 8, Fabric::default(), [0.0, -G, 0.0], settings);
        let lying: Vec<[f64; 3]> = sim.positions().iter().map(|p| [p.x, 0.0, p.y]).collect();
        sim.set_positions(&lying, None).unwrap();
        sim.pin(&[0, 8], None).unwrap();
        let mut iterations = 0;
        for _ in 0..10 {
            iterations += sim.step(0.02).unwrap().newton_iterations;
        }
        (sim.positions().to_vec(), iterations)
    };
    let (exact, most) = fall(0.0);
    let way = exact.iter().map(|p| -p.y).fold(0.0, f64::max);
    for (relative, part) in [(1e-3, 1e-2), (1e-6, 1e-4)] {
        let (near, fewer) = fall(relative);
        let off = furthest(&exact, &near) / way;
        println!("{relative}: {fewer} of {most} iterations, {off:.1e} of the way beside");
        assert!(fewer < most, "{fewer} of {most} iterations");
        assert!(off < part, "{off} of the way beside");
    }
}
