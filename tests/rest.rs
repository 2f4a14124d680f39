//! Rest after a small change: what bodies take along.

use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::Fabric;
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions};
use toile::tri::grid::{SheetPattern, sheet_garment, structured_sheet};

const WHOLE: DrapeOptions = DrapeOptions {
    force_tolerance: 0.0,
    max_steps: 0,
};

/// A sheet of 40 x 40 vertices above the origin.
fn sheet() -> Sim {
    let mut mesh = structured_sheet(1.0, 1.0, 39, 39, SheetPattern::Alternating).unwrap();
    for p in &mut mesh.placed {
        *p = Vec3::new(p.x - 0.5, 0.35, p.y - 0.5);
    }
    let settings = Settings {
        self_contact: 0.0,
        ..Settings::default()
    };
    let options = SimOptions {
        settings,
        ..SimOptions::default()
    };
    let garment = sheet_garment(1.0, 1.0, 0.025, Fabric::default());
    Sim::from_mesh(&garment, mesh, &options).unwrap()
}

/// Largest distance of `a` from `b` moved by `way` [m].
fn furthest(a: &[Vec3], b: &[Vec3], way: &Vec3) -> f64 {
    a.iter()
        .zip(b)
        .map(|(p, q)| (p - q - way).norm())
        .fold(0.0, f64::max)
}

#[test]
fn a_sheet_at_rest_goes_with_the_ball_that_it_lies_on() {
    let mut sim = sheet();
    let ball = Body::sphere(0.3).unwrap();
    sim.add_body(&ball, &ContactSettings::default()).unwrap();
    let first = sim.drape(&WHOLE, &mut |_| true).unwrap();
    let rest = sim.positions().to_vec();
    let way = Vec3::new(1e-3, 0.0, 5e-4);
    sim.set_body_pose(0, way.into(), [0.0, 0.0, 0.0, 1.0])
        .unwrap();
    let again = sim.drape(&WHOLE, &mut |_| true).unwrap();
    assert_eq!(again.outcome, Outcome::Converged);
    // the scene is the same but for its place, friction included
    let error = furthest(sim.positions(), &rest, &way);
    assert!(error < 1e-4, "{error} m beside");
    let change = again.potential_energy - first.potential_energy;
    assert!(change.abs() < 1e-6, "{change} J");
    assert!(again.newton_iterations <= 20, "{again:?}");
}
