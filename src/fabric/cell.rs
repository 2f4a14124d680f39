//! The periodic cell of a fabric: one repeat of its yarns, endless on all sides, under a given deformation.
//!
//! With the lattice vectors `a_k` of the flat layout and `A_k` of the deformed fabric, an image `n` repeats away is
//!
//! ```text
//! x_image = x + n_1 A_1 + n_2 A_2,   A_k = F a_k,   W = V / (a_1 x a_2),   P = dW/dF = sum_k dV/dA_k a_k^T / (a_1 x a_2)
//! ```
//!
//! Images are riders ([`crate::blend::Riders`]) on their own node and on two further points, which stand for `A_1` and
//! `A_2` as vertices without triangles, held where `F` has them. Every energy is the
//! system's own, with its part in the cell ([`crate::yarn::periodic`]); gravity is off. Layers of a fabric that folds touch
//! each other and their images without friction, as far as there are images.
//!
//! A bent cell lies on a cylinder of radius `1/kappa` about an axis `c` along one of the lattice vectors, `A`:
//!
//! ```text
//! x_image = Q^n (x - c) + c + m A,   Q = turn by kappa |a| about the axis
//! ```
//!
//! Its middle is free to move towards the axis and away from it, so that it is as long as it likes. `W` is per area of the
//! flat layout. SI units.

use super::bend::{Bend, lattice, rider};
use crate::blend::{Coupling, Riders};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::{Mat3, Vec2, Vec3};
use crate::pattern::chart::{Face, Stitch};
use crate::pattern::yarn_fabric::{Knit, Structure, YarnFabric};
use crate::pattern::{Fabric, Garment};
use crate::solve::engine::Engine;
use crate::solve::relax::{End, RelaxOptions, relax};
use crate::solve::settings::Settings;
use crate::system::build::{BuildOptions, System};
use crate::system::state::{Pin, State};
use crate::system::yarn::friction::loose;
use crate::tri::GarmentMesh;
use crate::tri::grid::rectangle;
use crate::yarn::layout::{Layout, lay};
use crate::yarn::periodic::NodeImage;
use crate::yarn::{YarnMaterial, Yarns};
use nalgebra::Matrix3x2;
use std::f64::consts::PI;
use std::sync::Arc;

/// Pitches of fabric laid around the cell.
const MARGIN: f64 = 6.0;
/// Pitches, and repeats, around the cell within which there are images to touch.
const AROUND: [f64; 2] = [4.0, 2.0];
/// Pitches to which a fold is looked for.
const FARTHEST: f64 = 12.0;
/// Corrections of one relaxation.
const STEPS: u64 = 4000;
/// Force that counts as none, over that of a yarn bent to a radius of the pitch.
const NOTHING: f64 = 1e-5;
/// First and largest step of a relaxation [s].
const STEPS_IN_TIME: [f64; 2] = [0.01, 10.0];

/// One repeat, or a few, of a fabric.
pub struct PeriodicCell {
    engine: Engine,
    state: State,
    settings: Settings,
    yarns: Arc<Yarns>,
    images: Vec<NodeImage>,
    size: Vec2,
    /// Distances of neighbouring yarns or loops [m].
    pitch: Vec2,
    /// `B pi R^2 / d^2` of the larger pitch `d` [N].
    scale: f64,
    bend: Option<Bend>,
}

impl PeriodicCell {
    /// A cell of so many repeats across and along, as laid, its lattice held.
    pub fn new(fabric: &YarnFabric, repeats: [usize; 2], settings: &Settings) -> Result<Self> {
        fabric.check()?;
        if let Structure::Knitted(Knit { once: true, .. }) = fabric.structure {
            return Err(Error::material(
                "a chart that is the whole piece has no repeat to test",
            ));
        }
        let pitch = Vec2::from(fabric.structure.pitch());
        let counts = fabric.structure.repeat();
        let counts = [0, 1].map(|k| counts[k] as f64 * repeats[k] as f64);
        let size = pitch.component_mul(&Vec2::from(counts));
        // the cell lies up to half its size off the middle
        let garment = swatch(fabric, size * 2.0 + pitch * (2.0 * MARGIN));
        let layout = Layout {
            max_nodes: settings.max_yarn_nodes as usize,
            ..Layout::default()
        };
        let around = (pitch * AROUND[0]).inf(&(size * AROUND[1]));
        let cell = lay(&garment, &layout)?.periodic(size, around)?;
        let yarns = Arc::new(Yarns::laid(cell.mesh, vec![YarnMaterial::from(fabric)]));
        let engine = engine(&yarns, &cell.images, size, None, settings)?;
        let state = laid_state(&yarns, lattice(size, None));
        let mut cell = Self {
            engine,
            state,
            settings: settings.clone(),
            yarns,
            images: cell.images,
            size,
            pitch,
            scale: fabric.bending * PI * (fabric.radius / pitch.max()).powi(2),
            bend: None,
        };
        cell.settle();
        Ok(cell)
    }

    /// A cell of one repeat; of a knit that folds, since a course has loops of both faces, one of an even number of courses.
    /// They run to and fro, and a course that slides as all others do finds no rest in its folds.
    pub fn one(fabric: &YarnFabric, settings: &Settings) -> Result<Self> {
        let has = |row: &[Stitch], face| row.contains(&Stitch::Plain(face));
        let folds = match &fabric.structure {
            Structure::Woven(_) => false,
            Structure::Knitted(knit) => {
                (knit.chart.rows().iter()).any(|row| has(row, Face::Knit) && has(row, Face::Purl))
            }
        };
        let odd = !fabric.structure.repeat()[1].is_multiple_of(2);
        Self::new(fabric, [1, 1 + usize::from(folds && odd)], settings)
    }

    /// Size of the flat layout, across and along [m].
    pub fn size(&self) -> Vec2 {
        self.size
    }

    /// Its area [m^2].
    pub fn area(&self) -> f64 {
        self.size.x * self.size.y
    }

    /// Mass per area of the flat layout [kg/m^2].
    pub fn density(&self) -> f64 {
        let masses = &self.engine.system.points.masses;
        masses[self.points().0..].iter().sum::<f64>() / self.area()
    }

    /// Yarns, with the images of the cell's nodes.
    pub fn yarns(&self) -> &Yarns {
        &self.yarns
    }

    /// Whether two nodes that were laid a pitch apart or more lie on each other, nearer than yarns are thick.
    pub(super) fn folds(&self) -> bool {
        let mesh = &self.yarns.mesh;
        let thick = 2.0 * self.yarns.materials.first().map_or(0.0, |m| m.radius);
        let x = self.nodes();
        let own = (0..x.len()).filter(|n| mesh.is_inside(*n as u32));
        own.flat_map(|a| (0..x.len()).map(move |b| (a, b)))
            .any(|(a, b)| {
                (mesh.uv[a] - mesh.uv[b]).norm() >= self.pitch.max() && (x[a] - x[b]).norm() < thick
            })
    }

    /// Repeats across and along, as far as yarns reach, after which a node is nearer to another than yarns are thick though
    /// there is no image of it to touch.
    pub(super) fn missing(&self) -> Option<[i32; 2]> {
        let mesh = &self.yarns.mesh;
        let thick = 2.0 * self.yarns.materials.first().map_or(0.0, |m| m.radius);
        let (f, x) = (self.gradient(), self.nodes());
        let own: Vec<u32> = (0..x.len() as u32).filter(|n| mesh.is_inside(*n)).collect();
        let [across, along] =
            [0, 1].map(|k| (FARTHEST * self.pitch[k] / self.size[k]).ceil() as i32);
        for steps in (-across..=across).flat_map(|m| (-along..=along).map(move |n| [m, n])) {
            if steps == [0, 0] {
                continue;
            }
            let by = f * self
                .size
                .component_mul(&Vec2::new(steps[0].into(), steps[1].into()));
            for b in &own {
                let there = self.images.iter().any(|i| i.of == *b && i.steps == steps);
                let place = x[*b as usize] + by;
                if !there && own.iter().any(|a| (x[*a as usize] - place).norm() < thick) {
                    return Some(steps);
                }
            }
        }
        None
    }

    /// Positions of the yarns' nodes [m].
    pub fn nodes(&self) -> &[Vec3] {
        &self.state.positions[self.points().0..]
    }

    /// Numbers of points of the lattice, and of all.
    fn points(&self) -> (usize, usize) {
        let all = self.state.positions.len();
        (all - self.yarns.mesh.uv.len(), all)
    }

    /// Takes this deformation gradient from the flat layout to space; nodes move along with it.
    pub fn stretch(&mut self, to: &Matrix3x2<f64>) {
        let map = frame(to) * frame(&self.gradient()).try_inverse().unwrap_or_default();
        let first = self.points().0;
        for x in &mut self.state.positions[first..] {
            *x = map * *x;
        }
        self.state.positions[0] = to.column(0) * self.size.x;
        self.state.positions[1] = to.column(1) * self.size.y;
        self.settle();
    }

    /// This cell on a cylinder, curved along an axis of the layout (0 across, 1 along), with a curvature [1/m] that is
    /// positive to the front.
    pub fn bent(&self, axis: usize, curvature: f64) -> Result<Self> {
        let plane = self.gradient();
        let bend = Bend {
            axis,
            curvature,
            plane,
        };
        let engine = engine(
            &self.yarns,
            &self.images,
            self.size,
            Some(&bend),
            &self.settings,
        )?;
        let lattice = lattice(self.size, Some(&bend));
        let mut state = self.state.clone();
        let nodes = self.nodes().iter().map(|x| bend.apply(x));
        state.positions = lattice.into_iter().chain(nodes).collect();
        state.velocities = vec![Vec3::zeros(); state.positions.len()];
        let mut cell = Self {
            engine,
            state,
            settings: self.settings.clone(),
            yarns: self.yarns.clone(),
            images: self.images.clone(),
            size: self.size,
            pitch: self.pitch,
            scale: self.scale,
            bend: Some(bend),
        };
        cell.settle();
        Ok(cell)
    }

    /// Puts the images where the nodes and the lattice have them, and holds the lattice there.
    fn settle(&mut self) {
        let coupling = &self.engine.system.points.coupling;
        coupling.carry(&mut self.state.positions);
        let (count, x) = (self.points().0, &self.state.positions);
        let pin = |k: usize| Pin {
            vertex: k as u32,
            target: x[k],
        };
        self.state.pins = (0..count).map(pin).collect();
    }

    /// Deformation gradient from the flat layout; of a bent cell that before it was bent.
    pub fn gradient(&self) -> Matrix3x2<f64> {
        let x = &self.state.positions;
        self.bend.map_or_else(
            || Matrix3x2::from_columns(&[x[0] / self.size.x, x[1] / self.size.y]),
            |bend| bend.plane,
        )
    }

    /// Whether yarns slide where friction does not hold them, or nowhere.
    pub fn set_sliding(&mut self, slides: bool) -> Result<()> {
        self.settings.yarn_sliding = f64::from(u8::from(slides));
        if !slides {
            self.state.sliding.fill(false);
        }
        self.engine.set_settings(&self.settings)
    }

    /// What it is in, to go back to.
    pub fn checkpoint(&self) -> State {
        self.state.clone()
    }

    /// Goes back to a state that it was in.
    pub fn roll_back(&mut self, state: State) {
        self.state = state;
    }

    /// A force that counts as none beside those of the yarns [N].
    pub fn nothing(&self) -> f64 {
        NOTHING * self.scale
    }

    /// Brings everything inside to rest, to a largest force on a node or a lattice vector [N]; the corrections taken.
    pub fn relax(&mut self, force: f64) -> Result<u64> {
        self.engine.begin();
        let options = RelaxOptions {
            force_tolerance: force,
            seam_gap: 0.0,
            max_steps: STEPS,
            first_step: STEPS_IN_TIME[0],
            largest_step: STEPS_IN_TIME[1],
            disturbed: true,
        };
        let done = relax(&mut self.engine, &mut self.state, &options, &mut |_, _| {
            true
        })?;
        if done.end != End::Rest {
            let why = match &done.end {
                End::Stalled(reason) => reason,
                _ => "all corrections allowed are taken",
            };
            return Err(Error::material(format!(
                "a periodic cell does not come to rest: {why}; residual {:.1e} N after {} corrections, asked {force:.1e} N",
                done.totals.residual, done.totals.substeps
            )));
        }
        Ok(done.totals.newton_iterations)
    }

    /// Energy per area of the flat layout [J/m^2].
    pub fn energy(&mut self) -> Result<f64> {
        Ok(self.engine.potential_energy(&self.state)? / self.area())
    }

    /// First Piola-Kirchhoff stress `dW/dF` [N/m].
    pub fn stress(&mut self) -> Result<Matrix3x2<f64>> {
        let forces = self.engine.forces(&self.state)?;
        let [a, b] = [forces[0] / self.size.y, forces[1] / self.size.x];
        Ok(Matrix3x2::from_columns(&[a, b]))
    }
}

/// A gradient with the normal that belongs to it.
fn frame(f: &Matrix3x2<f64>) -> Mat3 {
    let [a, b]: [Vec3; 2] = [f.column(0).into(), f.column(1).into()];
    Mat3::from_columns(&[a, b, a.cross(&b).normalize()])
}

fn engine(
    yarns: &Arc<Yarns>,
    images: &[NodeImage],
    size: Vec2,
    bend: Option<&Bend>,
    settings: &Settings,
) -> Result<Engine> {
    let points = lattice(size, bend);
    let count = points.len();
    let riders = images
        .iter()
        .map(|image| rider(image, count as u32, size, bend))
        .collect::<Result<Vec<_>>>()?;
    let coupling = Coupling {
        riders: Riders::new(riders)?,
        filter: None,
    };
    let yarn = |y: usize| yarns.mesh.yarn(y).last().map_or(0.0, |last| last.u);
    let mass: f64 = (0..yarns.mesh.yarn_count())
        .map(|y| yarns.material(y).density * yarn(y))
        .sum();
    let cloth = Cloth {
        mesh: GarmentMesh {
            uv: vec![Vec2::zeros(); count],
            placed: points,
            vertex_panel: vec![0; count],
            panel_starts: vec![0, count as u32],
            ..GarmentMesh::default()
        },
        // layers that rubbed would have an energy of their path
        fabrics: vec![Fabric {
            friction: 0.0,
            ..Fabric::default()
        }],
        panel_fabric: vec![0],
        panel_grain: vec![0.0],
        // they move unless they are held
        vertex_areas: vec![size.x * size.y; count],
        masses: vec![mass; count],
        ..Cloth::default()
    };
    let build = BuildOptions::from(settings);
    let system = System::with_yarns(cloth, Some(yarns.clone()), coupling, &build)?;
    Ok(Engine::new(system, settings))
}

fn laid_state(yarns: &Yarns, mut positions: Vec<Vec3>) -> State {
    let mesh = &yarns.mesh;
    let u: Vec<f64> = mesh.incidences.iter().map(|i| i.u).collect();
    let middle = mesh.uv.iter().sum::<Vec2>() / mesh.uv.len() as f64;
    let nodes = mesh.uv.iter().zip(&mesh.lift);
    positions.extend(nodes.map(|(uv, z)| Vec3::new(uv.x - middle.x, uv.y - middle.y, *z)));
    State {
        time: 0.0,
        velocities: vec![Vec3::zeros(); positions.len()],
        positions,
        topology: Default::default(),
        u_rates: vec![0.0; u.len()],
        sliding: vec![false; u.len()],
        strands: loose(mesh, &u),
        yarn_normals: vec![Vec3::zeros(); mesh.uv.len()],
        u,
        pins: Vec::new(),
        bodies: Vec::new(),
        body_anchors: Vec::new(),
        pair_anchors: Vec::new(),
        step_size: f64::MAX,
        gravity: Vec3::zeros(),
        wind: Vec3::zeros(),
        pressure: 0.0,
    }
}

/// A garment of one rectangle of the fabric.
fn swatch(fabric: &YarnFabric, size: Vec2) -> Garment {
    Garment {
        name: "cell".into(),
        panels: vec![rectangle("cell", size.x, size.y)],
        fabrics: vec![Fabric {
            yarns: Some(fabric.clone()),
            ..Fabric::default()
        }],
        ..Garment::default()
    }
}
