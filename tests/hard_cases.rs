//! Cases that break simulators: large and small steps, slivers, a fast ball, a packet of folds,
//! overstretched pins, coincident panels, extreme stiffness, bad input.

use std::f64::consts::{FRAC_PI_2, PI};
use toile::body::Body;
use toile::math::{Rotation, Vec2, Vec3};
use toile::pattern::{Fabric, Garment, Panel, Placement};
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions};
use toile::system::contact::crossing::crossings;
use toile::tri::GarmentMesh;
use toile::tri::grid::{SheetPattern, rectangle, sheet_garment, structured_sheet};

const IDENTITY: [f64; 4] = [0.0, 0.0, 0.0, 1.0];

fn sheet(size: [f64; 2], cells: [usize; 2], fabric: Fabric, settings: Settings) -> Sim {
    let mesh = structured_sheet(
        size[0],
        size[1],
        cells[0],
        cells[1],
        SheetPattern::Alternating,
    )
    .unwrap();
    on_mesh(size, mesh, fabric, settings).unwrap()
}

fn on_mesh(
    size: [f64; 2],
    mesh: GarmentMesh,
    fabric: Fabric,
    settings: Settings,
) -> toile::error::Result<Sim> {
    let garment = sheet_garment(size[0], size[1], 0.05, fabric);
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    Sim::from_mesh(&garment, mesh, &options)
}

fn quiet() -> Settings {
    Settings {
        self_contact: 0.0,
        ..Settings::default()
    }
}

fn to_tolerance() -> DrapeOptions {
    DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    }
}

fn array(p: &Vec3) -> [f64; 3] {
    (*p).into()
}

fn furthest(a: &[Vec3], b: &[Vec3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(p, q)| (p - q).norm())
        .fold(0.0, f64::max)
}

fn uncrossed(sim: &Sim) -> usize {
    crossings(sim.triangles(), sim.positions(), &[], 1000)
        .unwrap()
        .len()
}

#[test]
fn steps_from_a_tenth_of_a_millisecond_to_a_frame_come_to_the_same_rest() {
    // held along one edge, it swings down onto a ball and comes to rest against it
    let rest = |dt: f64| {
        let fabric = Fabric {
            damping_mass: 10.0,
            // stiff enough to have one rest only
            bending_warp: 1e-3,
            bending_weft: 1e-3,
            ..Fabric::default()
        };
        let mut sim = sheet([0.3, 0.3], [5, 5], fabric, quiet());
        let contact = ContactSettings {
            friction: 0.0,
            ..ContactSettings::default()
        };
        sim.add_body(&Body::sphere(0.1).unwrap(), &contact).unwrap();
        sim.set_body_pose(0, [0.15, -0.2, -0.05], IDENTITY).unwrap();
        let placed: Vec<[f64; 3]> = sim.positions().iter().map(|p| [p.x, 0.0, p.y]).collect();
        sim.set_positions(&placed, None).unwrap();
        sim.pin(&[0, 1, 2, 3, 4, 5], None).unwrap();
        for _ in 0..(2.0 / dt).round() as usize {
            sim.step(dt).unwrap();
        }
        let report = sim.report().unwrap();
        let speed = sim
            .velocities()
            .iter()
            .map(|v| v.norm())
            .fold(0.0, f64::max);
        println!("dt {dt}: largest speed at the end {speed:.2e} m/s");
        assert!(report.min_gap > 0.0, "inside the ball: {}", report.min_gap);
        sim.positions().to_vec()
    };
    let frame = rest(1.0 / 24.0);
    for dt in [1e-4, 1e-3, 1e-2] {
        let apart = furthest(&frame, &rest(dt));
        println!(
            "dt {dt}: {:.4} mm from the rest with dt 1/24 s",
            1e3 * apart
        );
        assert!(apart < 1e-3, "{apart} m apart");
    }
}

#[test]
fn slivers_do_not_keep_a_sheet_from_rest() {
    for squeeze in [1e-2, 1e-3, 1e-4] {
        let n = 10;
        let mut mesh = structured_sheet(0.3, 0.3, n, n, SheetPattern::Alternating).unwrap();
        // every third column moves up to its neighbour
        let h = 0.3 / n as f64;
        for (p, world) in mesh.uv.iter_mut().zip(&mut mesh.placed) {
            if (p.x / h).round() as usize % 3 == 1 {
                p.x += h * (1.0 - squeeze);
                *world = Vec3::new(p.x, p.y, 0.0);
            }
        }
        mesh.min_angle = toile::tri::quality::min_angle(&mesh);
        let angle = mesh.min_angle.to_degrees();
        let mut sim = on_mesh([0.3, 0.3], mesh, Fabric::default(), quiet()).unwrap();
        let last = ((n + 1) * (n + 1) - 1) as u32;
        sim.pin(&[last - n as u32, last], None).unwrap();
        let report = sim.drape(&to_tolerance(), &mut |_| true).unwrap();
        println!("smallest angle {angle:.4} degrees: {report:?}");
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(report.max_edge_strain < 0.5);
        for _ in 0..5 {
            sim.step(1.0 / 30.0).unwrap();
        }
    }
}

/// How often the segment passes through a surface.
fn pierced(a: Vec3, b: Vec3, sim: &Sim) -> usize {
    let x = sim.positions();
    sim.triangles()
        .iter()
        .filter(|t| {
            let [p, q, r] = t.map(|v| x[v as usize]);
            let side = |p: Vec3, q: Vec3, r: Vec3, s: Vec3| (q - p).cross(&(r - p)).dot(&(s - p));
            let through = [side(a, b, p, q), side(a, b, q, r), side(a, b, r, p)];
            side(p, q, r, a) * side(p, q, r, b) < 0.0
                && (through.iter().all(|s| *s > 0.0) || through.iter().all(|s| *s < 0.0))
        })
        .count()
}

#[test]
fn a_ball_at_20_metres_per_second_pushes_the_cloth_and_does_not_pass_it() {
    for (n, corners) in [(20, 2), (20, 4)] {
        let mut sim = sheet([1.0, 1.0], [n, n], Fabric::default(), quiet());
        let last = ((n + 1) * (n + 1) - 1) as u32;
        let held = [last - n as u32, last, 0, n as u32];
        sim.pin(&held[..corners], None).unwrap();
        let radius = 0.1;
        sim.add_body(&Body::sphere(radius).unwrap(), &ContactSettings::default())
            .unwrap();
        let (frame, speed) = (1.0 / 24.0, 20.0);
        // beside the middle, so that the way of the centre meets no vertex and no edge
        let axis = Vec3::new(0.5037, 0.5013, 0.0);
        let start = axis - Vec3::new(0.0, 0.0, 0.35);
        sim.set_body_pose(0, array(&start), IDENTITY).unwrap();
        // before the first step a pose is a placement, not a motion
        sim.step(1e-3).unwrap();
        let mut center = start;
        // hung at two corners it may slide off later on; at four it cannot
        for k in 1..=(if corners == 2 { 1 } else { 3 }) {
            // one frame at full speed through the cloth, then it stands
            if k == 1 {
                center.z += speed * frame;
            }
            sim.set_body_pose(0, array(&center), IDENTITY).unwrap();
            let report = sim.step(frame).unwrap();
            // the cloth lies between the place where the ball came from and where it is going if
            // the way of its centre meets no triangle: it is in front, not behind
            let passed = pierced(start - Vec3::new(0.0, 0.0, 0.2), center, &sim);
            let behind = sim
                .positions()
                .iter()
                .filter(|p| {
                    let off = (**p - axis).xy().norm();
                    off < 0.9 * radius && p.z < center.z
                })
                .count();
            println!(
                "{n}, {corners} corners: frame {k}: passed {passed}, behind {behind}, gap {:.2e}, strain {:.3}, {} substeps",
                report.min_gap, report.max_edge_strain, report.substeps
            );
            assert_eq!(passed, 0, "the way of the ball's centre meets the cloth");
            assert_eq!(behind, 0, "vertices behind the ball");
            assert!(
                report.min_gap > -1e-3,
                "inside the ball: {}",
                report.min_gap
            );
        }
        // later it may swing around the ball that stands, but not through it: the chords of the
        // vertices' ways over short steps stay near its surface
        let mut nearest = f64::MAX;
        for _ in 0..24 {
            let from = sim.positions().to_vec();
            let report = sim.step(1.0 / 240.0).unwrap();
            assert!(report.min_gap > -1e-3, "inside: {}", report.min_gap);
            for (p, q) in from.iter().zip(sim.positions()) {
                let (a, way) = (p - center, q - p);
                let t = (-a.dot(&way) / way.norm_squared().max(1e-30)).clamp(0.0, 1.0);
                nearest = nearest.min((a + way * t).norm());
            }
        }
        println!("{n}, {corners} corners: ways come to {nearest:.4} m from the centre");
        assert!(nearest > 0.7 * radius, "a vertex changed side: {nearest} m");
    }
}

#[test]
fn a_sheet_folded_over_itself_three_times_does_not_cross_itself() {
    let (length, width, cells) = (0.96, 0.03, [96, 3]);
    let h = length / 96.0;
    let mut sim = sheet(
        [length, width],
        cells,
        Fabric::default(),
        Settings::default(),
    );
    let plane = Body::plane([0.0, 1.0, 0.0], 0.0).unwrap();
    sim.add_body(&plane, &ContactSettings::default()).unwrap();
    let placed: Vec<[f64; 3]> = sim.positions().iter().map(|p| [p.x, 0.003, -p.y]).collect();
    sim.set_positions(&placed, None).unwrap();
    let frames = 24;
    for fold in 0..3 {
        // the creases of the last folds (and one end) go over to where the others lie
        let step = cells[0] >> fold;
        let columns = |odd: usize| -> Vec<u32> {
            (0..sim.positions().len())
                .filter(|v| {
                    let column = v % (cells[0] + 1);
                    column % step == 0 && column / step % 2 == odd
                })
                .map(|v| v as u32)
                .collect()
        };
        let (held, driven) = (columns(0), columns(1));
        let x = sim.positions();
        let middle = |vertices: &[u32]| -> f64 {
            vertices.iter().map(|&v| x[v as usize].x).sum::<f64>() / vertices.len() as f64
        };
        let (low, high) = (middle(&held), middle(&driven));
        let start: Vec<Vec3> = driven.iter().map(|&v| x[v as usize]).collect();
        let top = start.iter().map(|p| p.y).fold(0.0, f64::max);
        // the packet turns about the top of the stack that it will lie on
        let pivot = Vec3::new(0.5 * (low + high), top + 0.6 * h, 0.0);
        sim.pin(&held, None).unwrap();
        for k in 1..=frames {
            let angle = std::f64::consts::PI * f64::from(k) / f64::from(frames);
            let targets: Vec<[f64; 3]> = start
                .iter()
                .map(|p| {
                    let (c, s, d) = (angle.cos(), angle.sin(), p - pivot);
                    array(&(pivot + Vec3::new(c * d.x - s * d.y, s * d.x + c * d.y, d.z)))
                })
                .collect();
            sim.pin(&driven, Some(&targets)).unwrap();
            sim.step(1.0 / 30.0).unwrap();
            let crossed = uncrossed(&sim);
            assert_eq!(crossed, 0, "fold {fold}, frame {k}");
        }
        let x = sim.positions();
        let low = x.iter().map(|p| p.x).fold(f64::MAX, f64::min);
        let high = x.iter().map(|p| p.x).fold(f64::MIN, f64::max);
        println!("fold {fold}: {:.3} m long", high - low);
        // it is folded: about half as long as before
        assert!(high - low < 0.75 * length / f64::from(1 << fold));
        sim.unpin(&held).unwrap();
        sim.unpin(&driven).unwrap();
        for k in 0..6 {
            sim.step(1.0 / 30.0).unwrap();
            assert_eq!(uncrossed(&sim), 0, "fold {fold}, rest {k}");
        }
    }
}

#[test]
fn pins_pulled_three_times_apart_stretch_the_sheet_and_let_it_come_back() {
    let n = 10;
    let mut sim = sheet([0.3, 0.3], [n, n], Fabric::default(), quiet());
    let side = |i: usize| -> Vec<u32> { (0..=n).map(|j| (j * (n + 1) + i) as u32).collect() };
    let (left, right) = (side(0), side(n));
    sim.pin(&left, None).unwrap();
    let start: Vec<Vec3> = right.iter().map(|&v| sim.positions()[v as usize]).collect();
    let pull = |sim: &mut Sim, by: f64| {
        let targets: Vec<[f64; 3]> = start.iter().map(|p| [p.x + by, p.y, p.z]).collect();
        sim.pin(&right, Some(&targets)).unwrap();
        sim.step(1.0 / 24.0).unwrap()
    };
    for k in 1..=12 {
        pull(&mut sim, 0.6 * f64::from(k) / 12.0);
    }
    let report = pull(&mut sim, 0.6);
    println!("pulled: strain {}", report.max_edge_strain);
    assert!(report.max_edge_strain > 1.9 && report.max_edge_strain < 2.6);
    let jerked = pull(&mut sim, 0.0);
    println!("let back: {} substeps", jerked.substeps);
    // and in one frame
    let report = pull(&mut sim, 0.6);
    println!("in one frame: {} substeps", report.substeps);
    for _ in 0..48 {
        pull(&mut sim, 0.0);
    }
    let report = sim.report().unwrap();
    assert!(report.max_edge_strain < 0.02, "{}", report.max_edge_strain);
}

/// Two squares placed so that one is where the other is.
fn coincident(rotations: [Rotation; 2]) -> Garment {
    let panels = ["a", "b"]
        .into_iter()
        .zip(rotations)
        .map(|(name, rotation)| {
            let center = rotation * Vec3::new(0.1, 0.1, 0.0);
            let placement = Placement {
                rotation,
                translation: Vec3::new(0.0, 0.2, 0.0) - center,
            };
            Panel {
                placement,
                ..rectangle(name, 0.2, 0.2)
            }
        });
    Garment {
        panels: panels.collect(),
        fabrics: vec![Fabric::default()],
        edge_length: 0.025,
        ..Garment::default()
    }
}

#[test]
fn coincident_panels_drape_apart() {
    let flat = Rotation::from_axis_angle(&Vec3::x_axis(), -FRAC_PI_2);
    let turned = Rotation::from_axis_angle(&Vec3::y_axis(), PI) * flat;
    let flipped = Rotation::from_axis_angle(&Vec3::x_axis(), FRAC_PI_2);
    for (name, second) in [("alike", flat), ("turned", turned), ("flipped", flipped)] {
        let mut sim = Sim::new(&coincident([flat, second]), &SimOptions::default()).unwrap();
        let ball = Body::sphere(0.08).unwrap();
        sim.add_body(&ball, &ContactSettings::default()).unwrap();
        let report = sim.drape(&to_tolerance(), &mut |_| true).unwrap();
        let crossed = uncrossed(&sim);
        println!(
            "{name}: {:?} after {}, strain {:.4}, crossings {crossed}",
            report.outcome, report.newton_iterations, report.max_edge_strain,
        );
        assert_eq!(report.outcome, Outcome::Converged);
        assert_eq!(crossed, 0);
        assert!(report.max_edge_strain < 0.02);
    }
}

#[test]
fn coincident_panels_come_apart() {
    let mut sim = Sim::new(
        &coincident([Rotation::identity(); 2]),
        &SimOptions::default(),
    )
    .unwrap();
    let half = sim.mesh().panel_starts[1] as usize;
    let gap = |sim: &Sim| {
        let (a, b) = sim.positions().split_at(half);
        a.iter()
            .flat_map(|p| b.iter().map(move |q| (p - q).norm()))
            .fold(f64::MAX, f64::min)
    };
    assert!(gap(&sim) < 1e-12, "the panels do not coincide");
    let mut fastest = 0.0_f64;
    for _ in 0..20 {
        sim.step(1.0 / 30.0).unwrap();
        // seen from the middle, which falls
        let v = sim.velocities();
        let mean = v.iter().sum::<Vec3>() / v.len() as f64;
        fastest = v.iter().map(|v| (v - mean).norm()).fold(fastest, f64::max);
    }
    println!(
        "gap {:.4} m, crossings {}, fastest {fastest:.3} m/s",
        gap(&sim),
        uncrossed(&sim)
    );
    assert!(fastest < 0.5, "the panels fly apart at {fastest} m/s");
    assert!(gap(&sim) > 0.25 * 0.025);
    assert_eq!(uncrossed(&sim), 0);
}

#[test]
fn a_triangle_without_area_is_refused_by_name() {
    let mut mesh = structured_sheet(0.3, 0.3, 3, 3, SheetPattern::Alternating).unwrap();
    let [a, b, _] = mesh.triangles[5];
    mesh.triangles[5] = [a, b, a];
    let error = on_mesh([0.3, 0.3], mesh.clone(), Fabric::default(), quiet())
        .err()
        .expect("refused");
    println!("{error}");
    assert!(error.to_string().contains("triangle 5"));
    // three points on a line
    let mut mesh = structured_sheet(0.3, 0.3, 3, 3, SheetPattern::Alternating).unwrap();
    mesh.triangles[5] = [0, 1, 2];
    mesh.uv[1] = Vec2::new(0.5 * mesh.uv[2].x, 0.0);
    let error = on_mesh([0.3, 0.3], mesh, Fabric::default(), quiet())
        .err()
        .expect("refused");
    assert!(error.to_string().contains("triangle 5"));
}

#[test]
fn stiffness_from_1_to_100_000_newtons_per_metre_drapes_and_moves() {
    for stiffness in [1.0, 10.0, 1e2, 1e3, 1e4, 1e5] {
        let fabric = Fabric {
            warp: stiffness,
            weft: stiffness,
            shear: 0.2 * stiffness,
            ..Fabric::default()
        };
        let n = 10;
        let mut sim = sheet([0.3, 0.3], [n, n], fabric, quiet());
        let last = ((n + 1) * (n + 1) - 1) as u32;
        sim.pin(&[last - n as u32, last], None).unwrap();
        let report = sim.drape(&to_tolerance(), &mut |_| true).unwrap();
        println!(
            "{stiffness} N/m: {:?} after {}, residual {:.1e} N, strain {:.4}",
            report.outcome, report.newton_iterations, report.residual, report.max_edge_strain
        );
        assert_eq!(report.outcome, Outcome::Converged);
        assert!(report.residual <= 1e-5);
        let rested = sim.positions().to_vec();
        for _ in 0..15 {
            sim.step(1.0 / 30.0).unwrap();
        }
        let moved = furthest(&rested, sim.positions());
        assert!(moved < 1e-3, "{stiffness} N/m: moved {moved} m at rest");
    }
}

#[test]
fn a_step_that_cannot_be_taken_names_the_place() {
    let settings = Settings {
        min_step: 1e-3,
        ..quiet()
    };
    let mut sim = sheet([0.4, 0.4], [8, 8], Fabric::default(), settings);
    sim.pin(&[0], Some(&[[1e3, 0.0, 0.0]])).unwrap();
    let error = sim.step(0.01).unwrap_err();
    assert!(error.message.contains("an edge at vertex "), "{error}");
    assert!(error.message.contains("at most 20 %"), "{error}");
    let held = "of what is held vertex 0 of panel 0 is to go farthest, by 1.000e3 m";
    assert!(error.message.contains(held), "{error}");
    let far = sim.pin(&[0], Some(&[[0.0, 1.1e6, 0.0]])).unwrap_err();
    assert!(far.message.contains("target of vertex 0"), "{far}");
}

#[test]
fn places_and_velocities_beyond_all_measure_are_refused_by_vertex() {
    let mut sim = sheet([0.4, 0.4], [2, 2], Fabric::default(), quiet());
    let still: Vec<[f64; 3]> = sim.positions().iter().map(array).collect();
    for wrong in [f64::NAN, f64::NEG_INFINITY, -1e160, 1.1e6] {
        let mut list = still.clone();
        list[3][1] = wrong;
        let place = sim.set_positions(&list, None).unwrap_err().message;
        assert!(place.contains("position of vertex 3"), "{place}");
        let velocity = sim.set_positions(&still, Some(&list)).unwrap_err().message;
        assert!(velocity.contains("velocity of vertex 3"), "{velocity}");
    }
    let now: Vec<[f64; 3]> = sim.positions().iter().map(array).collect();
    assert_eq!(now, still);
}
