//! A pulse that runs through a strip of a weave from triangles into yarns, or the other way, and what of it comes back.
//!
//! The strip is two equal halves; a pulse `a exp(-s^2/2 w^2)` begins in the middle of one half and runs to the other, along the strip
//! (`c^2 = C/rho`) or, where this is stretched by one part in a hundred between its ends, across its plane (`c^2 = T/rho`), until what passed is in the
//! middle of that. What is reflected is then in the middle of the first half. With the kinetic energy of the motion in the pulse's direction
//!
//! ```text
//! reflected = energy of the first half / energy
//! ```
//!
//! Each of two travelling pulses has as much kinetic as elastic energy, and backward Euler damps both alike. No air, no damping, yarns do not slide.

use toile::math::Vec2;
use toile::pattern::import::garment_from_json;
use toile::pattern::{BlendRegion, Shape};
use toile::sim::{Settings, Sim, SimOptions};

/// Pitch, radius [m], Young's modulus [Pa] and mass of a yarn [kg/m].
const PITCH: f64 = 1e-3;
const RADIUS: f64 = 0.25e-3;
const YOUNG: f64 = 1e7;
const LINE: f64 = 1.5e-4;
/// Length of the triangles' edges, width of the strip [m].
const EDGE: f64 = 4e-3;
const WIDE: f64 = 8e-3;
/// Strain that it is held at for pulses across its plane.
const STRETCH: f64 = 0.01;
/// Height of the pulse over its width.
const HEIGHT: f64 = 2e-3;

/// Where yarns are.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Cloth {
    Triangles,
    #[allow(dead_code, reason = "only a benchmark takes it")]
    Yarns,
    /// In one half, with so many rings; 0 is direct coupling.
    Half(u32),
}

/// A pulse.
#[derive(Clone, Copy)]
pub(crate) struct Pulse {
    /// Along the strip, or across its plane.
    pub(crate) along: bool,
    /// Whether it begins in the half of the yarns.
    pub(crate) from_yarns: bool,
    /// Its width `w` [m].
    pub(crate) width: f64,
}

fn strip(long: f64, cloth: Cloth) -> Sim {
    let stretch = YOUNG * std::f64::consts::PI * RADIUS * RADIUS / PITCH;
    let text = format!(
        r#"{{"toile_garment": 1, "name": "strip", "edge_length": {EDGE},
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{long}, 0], [{long}, {WIDE}], [0, {WIDE}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "density": {}, "damping": {{"mass": 0, "stiffness": 0}},
                "membrane": {{"warp": {stretch}, "weft": {stretch}, "shear": 40, "coupling": 0}},
                "bending": {{"warp": 1e-7, "weft": 1e-7}},
                "yarns": {{"weave": "plain", "warp_pitch": {PITCH}, "radius": {RADIUS}, "young": {YOUNG},
                    "shear": 1.6e5, "density": {LINE}, "bending": 5e-4,
                    "damping": {{"mass": 0, "stiffness": 0}}}}}}]}}"#,
        2.0 * LINE / PITCH
    );
    let mut garment = garment_from_json(&text, None).expect("garment");
    let from = match cloth {
        Cloth::Triangles => long,
        Cloth::Yarns => -1.0,
        Cloth::Half(_) => 0.5 * long - 1e-5,
    };
    if cloth != Cloth::Triangles {
        let corners = [
            [from, -1.0],
            [2.0 * long, -1.0],
            [2.0 * long, 1.0],
            [from, 1.0],
        ];
        garment.blend_regions = vec![BlendRegion {
            panel: 0,
            shape: Shape::Polygon(corners.map(Vec2::from).to_vec()),
            rings: if let Cloth::Half(rings) = cloth {
                rings
            } else {
                0
            },
        }];
    }
    let mut settings = Settings::default();
    for (name, value) in [
        ("yarn.sliding", 0.0),
        ("air.drag", 0.0),
        ("air.tangential", 0.0),
        ("contact.self.enabled", 0.0),
        ("solver.linear.kind", 1.0),
        ("solver.newton.velocity_tolerance", 1e-6),
        ("yarn.relative_velocity", 1e-6),
    ] {
        settings.set(name, value).expect("number");
    }
    let options = SimOptions {
        gravity: Some([0.0; 3]),
        settings,
        ..SimOptions::default()
    };
    Sim::new(&garment, &options).expect("sim")
}

/// The part of a pulse's energy that is reflected in a strip of this length in so many steps.
pub(crate) fn reflected(long: f64, cloth: Cloth, pulse: &Pulse, steps: u32) -> f64 {
    let mut sim = strip(long, cloth);
    let stiffness = YOUNG * std::f64::consts::PI * RADIUS * RADIUS / PITCH;
    let density = 2.0 * LINE / PITCH;
    let (k, strain) = if pulse.along { (0, 0.0) } else { (2, STRETCH) };
    let stiff = if pulse.along {
        stiffness
    } else {
        stiffness * strain
    };
    let speed = (stiff / density).sqrt();
    // yarns lie in the second half
    let (begin, way) = if pulse.from_yarns {
        (0.75, -1.0)
    } else {
        (0.25, 1.0)
    };
    let (w, a) = (pulse.width, HEIGHT * pulse.width);
    let (mut x, mut v) = (Vec::new(), Vec::new());
    for p in sim.vertex_uv() {
        let s = p.x - begin * long;
        let value = a * (-0.5 * (s / w).powi(2)).exp();
        // a pulse f(s - way c t) has the velocity -way c f'
        let rate = way * speed * s / (w * w) * value;
        let mut place = [(1.0 + strain) * p.x, p.y, 0.0];
        let mut velocity = [0.0; 3];
        place[k] += value;
        velocity[k] = rate;
        x.push(place);
        v.push(velocity);
    }
    sim.set_positions(&x, Some(&v)).expect("positions");
    for (edge, end) in [(3, 0.0), (1, long)] {
        let active = sim.active_vertices();
        let held: Vec<u32> = (0..active.len() as u32)
            .filter(|n| active[*n as usize] && (sim.vertex_uv()[*n as usize].x - end).abs() < 1e-9)
            .collect();
        sim.pin(&held, None).expect("pins");
        if sim.yarns().is_some() {
            let nodes = sim.yarn_nodes_along(0, edge).expect("nodes");
            sim.pin_yarn_nodes(&nodes, None).expect("pins");
        }
    }
    let dt = 0.5 * long / speed / f64::from(steps);
    for _ in 0..steps {
        sim.step(dt).expect("step");
    }
    let state = sim.checkpoint();
    let nodes = sim.yarns().map_or(&[][..], |mesh| &mesh.uv);
    let places = sim.vertex_uv().iter().chain(nodes);
    let (mut first, mut all) = (0.0, 0.0);
    for ((p, m), v) in places.zip(sim.point_masses()).zip(&state.velocities) {
        let energy = m * v[k] * v[k];
        all += energy;
        if (p.x > 0.5 * long) == pulse.from_yarns {
            first += energy;
        }
    }
    first / all
}
