//! Rest after a small change: what pins and bodies take along, and that rest is a minimum.

use toile::body::Body;
use toile::math::Vec3;
use toile::pattern::Fabric;
use toile::sim::{ContactSettings, DrapeOptions, Outcome, Settings, Sim, SimOptions};
use toile::tri::grid::{SheetPattern, sheet_garment, structured_sheet};

const WHOLE: DrapeOptions = DrapeOptions {
    force_tolerance: 0.0,
    max_steps: 0,
};

fn sheet(cells: usize, place: impl Fn(&Vec3) -> Vec3) -> Sim {
    let mut mesh = structured_sheet(1.0, 1.0, cells, cells, SheetPattern::Alternating).unwrap();
    for p in &mut mesh.placed {
        *p = place(p);
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
    let mut sim = sheet(39, |p| Vec3::new(p.x - 0.5, 0.35, p.y - 0.5));
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

#[test]
fn a_hung_sheet_has_no_memory_of_where_its_pin_has_been() {
    let mut sim = sheet(19, |p| *p);
    sim.pin(&[19 * 20, 20 * 20 - 1], None).unwrap();
    let first = sim.drape(&WHOLE, &mut |_| true).unwrap();
    let rest = sim.positions().to_vec();
    let mut last = first;
    for shift in [1e-3, 0.0] {
        sim.pin(&[20 * 20 - 1], Some(&[[1.0 - shift, 1.0, 0.0]]))
            .unwrap();
        last = sim.drape(&WHOLE, &mut |_| true).unwrap();
        assert_eq!(last.outcome, Outcome::Converged);
        assert!(last.newton_iterations <= 20, "{last:?}");
    }
    let error = furthest(sim.positions(), &rest, &Vec3::zeros());
    assert!(error < 1e-4, "{error} m beside");
    let change = last.potential_energy - first.potential_energy;
    assert!(change.abs() < 1e-7, "{change} J");
    let before = sim.positions().to_vec();
    for _ in 0..30 {
        sim.step(1.0 / 30.0).unwrap();
    }
    let moved = furthest(sim.positions(), &before, &Vec3::zeros());
    assert!(moved < 1e-4, "moves by {moved} m in a second");
}
