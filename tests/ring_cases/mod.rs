//! Newton's first system in a step of a weave with yarns in its middle and one ring around them.
//!
//! A square hangs from two corners in a gentle wave, at rest before, and may touch a plane beneath its trough.

use std::f64::consts::PI;
use std::sync::Arc;
use toile::blend::blended::{self, BlendOptions};
use toile::blend::{Filter, Region};
use toile::body::Body;
use toile::cloth::Cloth;
use toile::math::Vec3;
use toile::math::block::BlockMatrix;
use toile::math::parallel::Workers;
use toile::pattern::import::garment_from_json;
use toile::sim::{ContactSettings, Settings};
use toile::system::assemble::{Assembler, complete, fix_rows};
use toile::system::bodies::BodySet;
use toile::system::build::{BuildOptions, System};
use toile::system::state::State;
use toile::system::term::{Configuration, HessianKind, World};
use toile::system::yarn::contacts::Sliding;
use toile::system::yarn::friction::loose;
use toile::tri::triangulate;
use toile::yarn::{Layout, Topology, YarnMaterial, Yarns, lay};

const PITCH: f64 = 1e-3;
/// Height of the wave over the side.
const WAVE: f64 = 0.03;
/// Gap over the plane that is kept free [m].
const GAP: f64 = 5e-4;

/// What yarns do.
#[derive(Clone, Copy, PartialEq)]
pub(crate) enum Yarning {
    /// They slide nowhere.
    Tied,
    /// They slide everywhere in the full region.
    Slides,
    /// They do, and the lowest part of the wave lies on a plane.
    SlidesAndTouches,
}

/// One Newton system.
pub(crate) struct Case {
    /// The constraints.
    pub(crate) filter: Arc<Filter>,
    /// Lumped masses over the square of the step, by point [N/m].
    #[allow(dead_code, reason = "only a benchmark takes them")]
    pub(crate) masses: Vec<f64>,
    pub(crate) matrix: BlockMatrix,
    /// Blocks that are held.
    pub(crate) fixed: Vec<bool>,
    pub(crate) right: Vec<Vec3>,
    /// Points that touch the plane.
    pub(crate) touching: usize,
}

/// A square of `side` with triangles of `ratio` pitches, yarns in `[low, high]` squared; steps of `h` [s].
pub(crate) fn case(side: f64, ratio: f64, [low, high]: [f64; 2], h: f64, yarning: Yarning) -> Case {
    let sliding = yarning != Yarning::Tied;
    let radius = 0.25 * PITCH;
    let area = PI * radius * radius;
    let stretch = 1e7 * area / PITCH;
    let text = format!(
        r#"{{"toile_garment": 1, "name": "bench", "edge_length": {},
            "panels": [{{"name": "p", "fabric": "y",
                "vertices": [[0, 0], [{side}, 0], [{side}, {side}], [0, {side}]],
                "edges": [[0, 1], [1, 2], [2, 3], [3, 0]]}}],
            "fabrics": [{{"name": "y", "density": 0.3,
                "membrane": {{"warp": {stretch}, "weft": {stretch}, "shear": 40, "coupling": 0}},
                "yarns": {{"weave": "plain", "warp_pitch": {PITCH}, "radius": {radius},
                    "young": 1e7, "bending": {}, "shear": {}, "density": {}}}}}],
            "blend_regions": [{{"panel": "p", "rings": 1,
                "polygon": [[{low}, {low}], [{high}, {low}], [{high}, {high}], [{low}, {high}]]}}]}}"#,
        ratio * PITCH,
        1e6 * radius * radius / 4.0,
        10.0 * PITCH / (radius * radius),
        0.15 * PITCH
    );
    let garment = garment_from_json(&text, None).expect("garment");
    let mesh = triangulate(&garment, 1.0, 100_000).expect("mesh");
    let region = Region::new(&garment, &mesh).expect("region");
    let laid = lay(&garment, &Layout::default()).expect("yarns");
    let materials = vec![YarnMaterial::from(
        garment.fabrics[0].yarns.as_ref().expect("yarns"),
    )];
    let options = BlendOptions::default();
    let joined =
        blended::join(&garment, &mesh, &region, laid, &materials, options).expect("joined");
    let filter = joined.coupling.filter.clone().expect("filter");
    let kept: Vec<usize> = (0..region.full.len())
        .filter(|t| !region.full[*t])
        .collect();
    let cloth = Cloth::covered(
        &garment,
        mesh.without_triangles(&region.full),
        kept.iter().map(|t| joined.share[*t]).collect(),
        kept.iter().map(|t| joined.own[*t]).collect(),
        &kept.iter().map(|t| joined.masses[*t]).collect::<Vec<_>>(),
    )
    .expect("cloth");
    let yarns = Arc::new(Yarns::laid(joined.yarns, materials));
    let build = BuildOptions {
        self_contact: false,
        sliding: if sliding {
            Sliding::Everywhere
        } else {
            Sliding::Nowhere
        },
        ..BuildOptions::from(&Settings::default())
    };
    let mut system =
        System::with_yarns(cloth, Some(yarns.clone()), joined.coupling, &build).expect("system");
    let all = mesh.uv.iter().chain(&yarns.mesh.uv);
    let mut positions: Vec<Vec3> = all
        .map(|p| Vec3::new(p.x, p.y, WAVE * side * (2.0 * PI * p.x / side).sin()))
        .collect();
    system.points.coupling.carry(&mut positions);
    let u: Vec<f64> = yarns.mesh.incidences.iter().map(|i| i.u).collect();
    let mut state = State {
        time: 0.0,
        velocities: vec![Vec3::zeros(); positions.len()],
        positions,
        topology: Topology::default(),
        u_rates: vec![0.0; u.len()],
        sliding: (yarns.mesh.incidences.iter())
            .map(|i| sliding && i.slides)
            .collect(),
        strands: loose(&yarns.mesh, &u),
        yarn_normals: vec![Vec3::zeros(); yarns.mesh.uv.len()],
        u,
        pins: Vec::new(),
        bodies: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        step_size: f64::MAX,
        gravity: Vec3::new(0.0, -9.81, 0.0),
        wind: Vec3::zeros(),
        pressure: 0.0,
    };
    let mut bodies = BodySet::default();
    let deep = 0.9 * WAVE * side;
    if yarning == Yarning::SlidesAndTouches {
        let plane = Body::plane([0.0, 0.0, 1.0], -deep - GAP).expect("plane");
        let contact = ContactSettings {
            thickness: GAP,
            ..ContactSettings::default()
        };
        let body = bodies.add(&plane, &contact);
        state.bodies.push(body);
        (bodies.prepare(&state, 1.0, &Workers::new(1))).expect("bodies");
    }
    let world = World {
        gravity: state.gravity,
        wind: state.wind,
        pressure: 0.0,
        bodies: &bodies,
    };
    let _ = system.take_contacts(&state).expect("contacts");
    let mut x = Vec::new();
    system.pack(&state, &mut x);
    let at = Configuration {
        x: &x,
        x0: &x,
        u: &state.u,
        inv_dt: 1.0 / h,
        world: &world,
    };
    for term in &mut system.terms {
        let _ = term.begin_step(&state, &at);
    }
    let n = system.block_count();
    let workers = Workers::new(1);
    let mut assembler = Assembler::new(
        &system.widths(),
        &system.terms,
        &system.points.coupling.riders,
    );
    for v in 0..system.points.vertex_count {
        let matrix = assembler.matrix_mut();
        let slot = matrix.pattern.starts[v] as usize;
        for c in 0..3 {
            matrix.blocks[slot][(c, c)] = system.points.masses[v] / (h * h);
        }
    }
    let mut gradient = vec![Vec3::zeros(); n];
    assembler.add(
        &system.terms,
        &at,
        Some(HessianKind::Psd),
        &workers,
        &mut gradient,
    );
    let points = &system.points;
    let mut fixed: Vec<bool> = (0..n)
        .map(|p| p < points.count() && !points.moves(p))
        .collect();
    for (v, p) in mesh.uv.iter().enumerate() {
        fixed[v] |= p.y > side - 1e-9 && (p.x < 1e-9 || p.x > side - 1e-9);
    }
    let matrix = assembler.matrix_mut();
    fix_rows(matrix, &fixed, &workers);
    complete(matrix);
    let right = (gradient.iter().zip(&fixed))
        .map(|(g, fixed)| if *fixed { Vec3::zeros() } else { -g })
        .collect();
    let low = |p: &usize| points.areas[*p] > 0.0 && x[*p].z < -deep;
    Case {
        touching: if state.bodies.is_empty() {
            0
        } else {
            (0..points.count()).filter(low).count()
        },
        filter,
        masses: (system.points.masses.iter())
            .map(|m| m.max(1e-15) / (h * h))
            .collect(),
        matrix: assembler.matrix().clone(),
        fixed,
        right,
    }
}
