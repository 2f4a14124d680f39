//! How drapes end that do not come to rest by the way that they were begun: garments that nothing
//! holds, dead ends, garments that are at rest already.

use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::{Fabric, Garment, Placement};
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions, StepReport};
use toile::tri::grid::rectangle;

const IDENTITY: [f64; 4] = [0.0, 0.0, 0.0, 1.0];
const WHOLE: DrapeOptions = DrapeOptions {
    force_tolerance: 0.0,
    max_steps: 0,
};

/// A square of 0.3 m that lies at a height [m], its middle above the origin.
fn lying(name: &str, height: f64) -> toile::pattern::Panel {
    let mut panel = rectangle(name, 0.3, 0.3);
    let flat = toile::math::Rotation::from_axis_angle(
        &nalgebra::Vector3::x_axis(),
        -std::f64::consts::FRAC_PI_2,
    );
    panel.placement = Placement {
        translation: Vec3::new(0.0, height, 0.0) - flat * Vec3::new(0.15, 0.15, 0.0),
        rotation: flat,
    };
    panel
}

fn sim_of(panels: Vec<toile::pattern::Panel>) -> Sim {
    let garment = Garment {
        panels,
        fabrics: vec![Fabric::default()],
        edge_length: 0.03,
        ..Garment::default()
    };
    Sim::new(&garment, &SimOptions::default()).unwrap()
}

fn drape(sim: &mut Sim) -> StepReport {
    let report = sim.drape(&WHOLE, &mut |_| true).unwrap();
    println!("{report:?}");
    report
}

fn lowest(sim: &Sim) -> f64 {
    sim.positions().iter().map(|p| p.y).fold(f64::MAX, f64::min)
}

#[test]
fn a_garment_that_nothing_holds_is_told_to_fall_and_stays_near() {
    let mut sim = sim_of(vec![lying("flag", 1.0)]);
    let report = drape(&mut sim);
    assert_eq!(report.outcome, Outcome::Falling);
    assert!(report.reason.contains("'flag'"), "{}", report.reason);
    assert!(lowest(&sim) > -10.0, "{} m", lowest(&sim));
    // without weight it has nowhere to fall
    let mut sim = sim_of(vec![lying("flag", 1.0)]);
    sim.set_number("gravity.y", 0.0).unwrap();
    assert_eq!(drape(&mut sim).outcome, Outcome::Converged);
}

#[test]
fn a_garment_that_slips_off_its_body_is_told_to_fall() {
    let smooth = ContactSettings {
        friction: 0.0,
        ..ContactSettings::default()
    };
    let mut sim = sim_of(vec![lying("scarf", 1.0)]);
    sim.add_body(&Body::sphere(0.1).unwrap(), &smooth).unwrap();
    // its middle lies beside the ball's
    sim.set_body_pose(0, [0.09, 0.85, 0.0], IDENTITY).unwrap();
    let report = drape(&mut sim);
    assert_eq!(report.outcome, Outcome::Falling);
    assert!(lowest(&sim) > -10.0, "{} m", lowest(&sim));
}

#[test]
fn a_garment_on_an_endless_slope_is_told_to_fall() {
    let smooth = ContactSettings {
        friction: 0.0,
        ..ContactSettings::default()
    };
    let mut sim = sim_of(vec![lying("scarf", 0.1)]);
    let slope = Body::plane([1.0, 1.0, 0.0], 0.0).unwrap();
    sim.add_body(&slope, &smooth).unwrap();
    let report = drape(&mut sim);
    assert_eq!(report.outcome, Outcome::Falling);
    assert!(lowest(&sim) > -1e5, "{} m", lowest(&sim));
}

#[test]
fn a_long_fall_onto_the_ground_or_onto_held_cloth_is_none() {
    let mut sim = sim_of(vec![lying("flag", 5.0)]);
    let ground = Body::plane([0.0, 1.0, 0.0], 0.0).unwrap();
    sim.add_body(&ground, &ContactSettings::default()).unwrap();
    assert_eq!(drape(&mut sim).outcome, Outcome::Converged);
    assert!(lowest(&sim) > 0.0 && lowest(&sim) < 0.1);

    let mut sim = sim_of(vec![lying("net", 0.0), lying("flag", 1.0)]);
    let starts = sim.mesh().panel_starts.clone();
    let held: Vec<u32> = (starts[0]..starts[1])
        .filter(|&v| {
            let uv = sim.vertex_uv()[v as usize];
            uv.x.min(uv.y).min(0.3 - uv.x).min(0.3 - uv.y) < 1e-6
        })
        .collect();
    sim.pin(&held, None).unwrap();
    let report = sim
        .drape(
            &DrapeOptions {
                max_steps: 300,
                ..WHOLE
            },
            &mut |_| true,
        )
        .unwrap();
    println!("{report:?}");
    assert_ne!(report.outcome, Outcome::Falling);
    assert!(lowest(&sim) > -0.2, "{} m", lowest(&sim));
    // beside it there is no net
    let mut beside = lying("flag", 1.0);
    beside.placement.translation.x += 2.0;
    let mut sim = sim_of(vec![lying("net", 0.0), beside]);
    sim.pin(&held, None).unwrap();
    let report = drape(&mut sim);
    assert_eq!(report.outcome, Outcome::Falling);
    assert!(report.reason.contains("'flag'"), "{}", report.reason);
}

#[test]
fn a_drape_that_cannot_move_at_all_says_why() {
    let mut sim = sim_of(vec![lying("flag", 1.0)]);
    sim.add_body(&Body::sphere(0.1).unwrap(), &ContactSettings::default())
        .unwrap();
    // held where no vertex may be
    let corner = sim.locate(0, [0.0, 0.0]).unwrap();
    sim.pin(&[corner], Some(&[[0.0, 0.0, 0.0]])).unwrap();
    let report = drape(&mut sim);
    assert_eq!(report.outcome, Outcome::Stalled);
    assert!(report.reason.contains("deep"), "{}", report.reason);
}

#[test]
fn a_garment_at_rest_is_left_there_bit_by_bit() {
    let mut sim = sim_of(vec![lying("cloth", 0.2)]);
    sim.add_body(&Body::sphere(0.1).unwrap(), &ContactSettings::default())
        .unwrap();
    assert_eq!(drape(&mut sim).outcome, Outcome::Converged);
    let rested = sim.positions().to_vec();
    let again = drape(&mut sim);
    assert_eq!(again.outcome, Outcome::Converged);
    assert_eq!(again.newton_iterations, 0);
    assert_eq!(sim.positions(), rested);
    // a change brings it to another rest
    sim.set_number("gravity.y", -9.0).unwrap();
    let again = drape(&mut sim);
    assert_eq!(again.outcome, Outcome::Converged);
    assert!(again.newton_iterations > 0);
}

#[test]
fn settings_that_are_counts_take_whole_numbers_only() {
    let mut sim = sim_of(vec![lying("flag", 1.0)]);
    for key in Settings::KEYS.iter().filter(|k| k.whole) {
        let before = sim.number(key.name).unwrap();
        let value = key.min + 0.5 * (key.max - key.min).min(1.0);
        let error = sim.set_number(key.name, value).unwrap_err().to_string();
        assert!(
            error.contains(key.name) && error.contains("whole"),
            "{error}"
        );
        assert_eq!(sim.number(key.name).unwrap(), before);
    }
    let counts = Settings::KEYS.iter().filter(|k| k.whole).count();
    assert_eq!(counts, 12);
    sim.set_number("solver.step.min", 1.5e-7).unwrap();
}
