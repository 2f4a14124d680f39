//! Speed against error: one scene by several models, compared where the scene wants yarns.
//!
//! The models are triangles alone with edges of twice, once and half the scene's length; mixed cloth with the
//! scene's regions, and with those scaled about their middles; and yarns on all of every panel that has a region. Gathered or
//! folded cloth has many equilibria, so all begin at the same one: where triangles with the scene's edges, draped first,
//! came to rest, if they did. The time of that counts for all. The reference is the most detailed model, with the
//! most nodes of yarns, that came to rest. Points of comparison are the nodes of yarns inside the scene's own regions, wherever
//! a model has them: as nodes of its own, or carried by its triangles. With `x` and `y` their places in a model and
//! in the reference, and `h` the heights over the plane that fits the reference's points of a panel best,
//!
//! ```text
//! error = sqrt(mean |x - y|^2),   height = rms(h_x) / rms(h_y),   correlation = cor(h_x, h_y)
//! ```
//!
//! heights and correlations less their means, over all panels. What did not come to rest is listed with the reason, and never
//! compared: its distance from the reference says nothing about the model.

mod page;
mod rivals;

pub use rivals::{rivals, same_cost};

use crate::blend::embed::carried;
use crate::error::{Error, Result};
use crate::math::{Mat3, Vec2, Vec3};
use crate::pattern::{BlendRegion, Garment, Shape};
use crate::scene::Scene;
use crate::sim::{DrapeOptions, Outcome, Sim};
use crate::sim_scene::build;
use crate::tri::{GarmentMesh, Transfer};
use crate::yarn::YarnMesh;
use std::time::Instant;

/// Scales of the triangles' edges; the first model is where the others begin.
const EDGES: [f64; 3] = [1.0, 2.0, 0.5];
/// Scales of the regions.
const REGIONS: [f64; 3] = [0.75, 1.0, 1.5];

/// What cloth is made of in a model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kind {
    /// Triangles alone.
    Triangles,
    /// Yarns in regions.
    Mixed,
    /// Yarns on all of the panels with regions.
    Yarns,
}

impl Kind {
    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::Triangles => "triangles",
            Self::Mixed => "mixed",
            Self::Yarns => "yarns",
        }
    }
}

/// How far a model is from the reference.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Deviation {
    /// Root mean square of the distances [m].
    pub error: f64,
    /// Height of wrinkles over that of the reference.
    pub height: f64,
    /// Correlation of the heights, -1 to 1.
    pub correlation: f64,
}

/// One model and what it came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Row {
    /// Name for people.
    pub name: String,
    /// What cloth is made of.
    pub kind: Kind,
    /// How its drape ended; none if it could not be built or run.
    pub outcome: Option<Outcome>,
    /// Why there is nothing to compare; empty where there is.
    pub reason: String,
    /// Vertices.
    pub vertices: usize,
    /// Nodes of yarns.
    pub yarn_nodes: usize,
    /// Scalar unknowns.
    pub unknowns: usize,
    /// Memory of system, matrix and factor [bytes].
    pub bytes: usize,
    /// Newton iterations.
    pub newton_iterations: u64,
    /// Largest force on a free point at the end [N].
    pub residual: f64,
    /// Time of the drape and of what it begins with [s].
    pub seconds: f64,
    /// Against the reference, if both came to rest; the reference itself has none.
    pub deviation: Option<Deviation>,
    /// Whether the others are compared with this one.
    pub reference: bool,
    /// Whether no other compared model is both as fast and as near to the reference.
    pub front: bool,
}

/// What came of a scene.
#[derive(Clone, Debug, PartialEq)]
pub struct Report {
    /// Name of the scene.
    pub name: String,
    /// Number of points that are compared.
    pub points: usize,
    /// The models.
    pub rows: Vec<Row>,
}

/// Runs every model of a scene. `watch` is told the name of each before it runs.
pub fn run(scene: &Scene, watch: &mut dyn FnMut(&str)) -> Result<Report> {
    if scene.garment.blend_regions.is_empty() {
        return Err(Error::argument(
            "a report compares where the garment has blend regions; it has none",
        ));
    }
    check(scene)?;
    let points = Points::new(&build(scene)?)?;
    compared(scene, points, models(&scene.garment)?, watch)
}

/// Refuses scenes whose models cannot all be draped.
fn check(scene: &Scene) -> Result<()> {
    if !scene.run.drape {
        return Err(Error::argument(
            "a report compares drapes; the scene does not drape",
        ));
    }
    if scene.initial.positions.is_some() || scene.initial.snapshot.is_some() {
        return Err(Error::argument(
            "a report runs several meshes; the scene begins with a state of one",
        ));
    }
    Ok(())
}

/// Drapes models and compares each with the most detailed one at rest.
fn compared(
    scene: &Scene,
    points: Points,
    models: Vec<(String, Kind, Garment)>,
    watch: &mut dyn FnMut(&str),
) -> Result<Report> {
    let mut rows = Vec::new();
    let mut places: Vec<Option<Vec<Vec3>>> = Vec::new();
    let mut start: Option<Start> = None;
    for (name, kind, garment) in models {
        watch(&name);
        let scene = Scene {
            garment,
            ..scene.clone()
        };
        let mut row = Row::new(name, kind);
        let place = match drape(&scene, start.as_ref(), &mut row) {
            Ok(sim) => {
                let place = points.places(&sim)?;
                if rows.is_empty() {
                    start = Some(Start {
                        mesh: sim.mesh().clone(),
                        positions: sim.positions().to_vec(),
                        seconds: row.seconds,
                    });
                }
                Some(place)
            }
            Err(reason) => {
                row.reason = reason;
                None
            }
        };
        rows.push(row);
        places.push(place);
    }
    let reference = (0..rows.len())
        .filter(|k| places[*k].is_some() && rows[*k].kind != Kind::Triangles)
        .max_by_key(|k| rows[*k].yarn_nodes);
    if let Some(r) = reference {
        rows[r].reference = true;
        for k in (0..rows.len()).filter(|k| *k != r) {
            if let (Some(x), Some(y)) = (&places[k], &places[r]) {
                rows[k].deviation = Some(points.deviation(x, y));
            }
        }
    } else {
        for row in rows.iter_mut().filter(|row| row.reason.is_empty()) {
            row.reason = "no model with yarns came to rest: nothing to compare with".into();
        }
    }
    mark_front(&mut rows);
    Ok(Report {
        name: scene.name.clone(),
        points: points.nodes.uv.len(),
        rows,
    })
}

/// Names, kinds and garments of the models.
fn models(garment: &Garment) -> Result<Vec<(String, Kind, Garment)>> {
    let mut list = Vec::new();
    for scale in EDGES {
        let mut g = garment.clone();
        g.blend_regions.clear();
        g.edge_length *= scale;
        for panel in &mut g.panels {
            panel.edge_length = panel.edge_length.map(|h| h * scale);
        }
        list.push((format!("triangles, edges x {scale}"), Kind::Triangles, g));
    }
    for scale in REGIONS {
        let mut g = garment.clone();
        for region in &mut g.blend_regions {
            *region = region.scaled(scale);
        }
        list.push((format!("mixed, regions x {scale}"), Kind::Mixed, g));
    }
    let mut panels: Vec<u32> = garment.blend_regions.iter().map(|r| r.panel).collect();
    panels.sort_unstable();
    panels.dedup();
    list.push(("yarns".into(), Kind::Yarns, whole(garment, panels)?));
    Ok(list)
}

/// The garment with yarns on all of some panels.
fn whole(garment: &Garment, panels: Vec<u32>) -> Result<Garment> {
    let mut g = garment.clone();
    g.blend_regions.clear();
    for panel in panels {
        let bounds = g.panels[panel as usize].bounds()?;
        let [low, high] = bounds.unwrap_or([Vec2::zeros(); 2]);
        let room = high - low;
        let (low, high) = (low - room, high + room);
        g.blend_regions.push(BlendRegion {
            panel,
            shape: Shape::Polygon(vec![
                low,
                Vec2::new(high.x, low.y),
                high,
                Vec2::new(low.x, high.y),
            ]),
            rings: 0,
        });
    }
    Ok(g)
}

impl Row {
    fn new(name: String, kind: Kind) -> Self {
        Self {
            name,
            kind,
            outcome: None,
            reason: String::new(),
            vertices: 0,
            yarn_nodes: 0,
            unknowns: 0,
            bytes: 0,
            newton_iterations: 0,
            residual: f64::INFINITY,
            seconds: 0.0,
            deviation: None,
            reference: false,
            front: false,
        }
    }
}

/// Where drapes begin.
struct Start {
    mesh: GarmentMesh,
    positions: Vec<Vec3>,
    /// Time that it took [s].
    seconds: f64,
}

/// Drapes one model to rest, or says why it is not there.
fn drape(scene: &Scene, start: Option<&Start>, row: &mut Row) -> std::result::Result<Sim, String> {
    let mut sim = build(scene).map_err(|e| format!("not built: {}", e.message))?;
    if let Some(start) = start {
        let begun = Transfer::new(&start.mesh, sim.mesh()).and_then(|map| {
            let x = map.apply(&start.mesh.triangles, &start.positions);
            let x: Vec<[f64; 3]> = x.into_iter().map(Into::into).collect();
            sim.set_positions(&x, None)
        });
        begun.map_err(|e| format!("not begun: {}", e.message))?;
        row.seconds = start.seconds;
    }
    let clock = Instant::now();
    let options = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let draped = sim.drape(&options, &mut |_| true);
    row.seconds += clock.elapsed().as_secs_f64();
    let info = sim.info();
    row.vertices = info.vertices;
    row.yarn_nodes = info.yarn_nodes;
    row.unknowns = info.unknowns;
    row.bytes = info.bytes + info.factor_bytes;
    let report = draped.map_err(|e| format!("failed: {}", e.message))?;
    row.outcome = Some(report.outcome);
    row.newton_iterations = report.newton_iterations;
    row.residual = report.residual;
    if report.outcome != Outcome::Converged {
        return Err(format!("not at rest: {}", report.outcome.name()));
    }
    Ok(sim)
}

/// Marks the compared rows that no other one beats in time and error at once.
fn mark_front(rows: &mut [Row]) {
    let list: Vec<Option<[f64; 2]>> = rows
        .iter()
        .map(|r| r.deviation.map(|d| [r.seconds, d.error]))
        .collect();
    for (k, row) in rows.iter_mut().enumerate() {
        row.front = list[k].is_some_and(|[t, e]| {
            let beats =
                |other: &[f64; 2]| other[0] <= t && other[1] <= e && (other[0] < t || other[1] < e);
            !list.iter().flatten().any(beats)
        });
    }
}

/// Nodes of yarns at which models are compared.
struct Points {
    nodes: YarnMesh,
}

fn key(panel: u32, p: &Vec2) -> (u32, i64, i64) {
    (
        panel,
        (p.x * 1e9).round() as i64,
        (p.y * 1e9).round() as i64,
    )
}

impl Points {
    /// The nodes inside the regions of a simulation.
    fn new(sim: &Sim) -> Result<Self> {
        let mut nodes = YarnMesh::default();
        if let Some(mesh) = sim.yarns() {
            for n in (0..mesh.uv.len()).filter(|n| mesh.is_whole(*n as u32)) {
                nodes.uv.push(mesh.uv[n]);
                nodes.lift.push(mesh.lift[n]);
                nodes.node_panel.push(mesh.node_panel[n]);
            }
        }
        if nodes.uv.is_empty() {
            return Err(Error::argument("the regions of the garment hold no yarns"));
        }
        Ok(Self { nodes })
    }

    /// Where they are in a simulation [m].
    fn places(&self, sim: &Sim) -> Result<Vec<Vec3>> {
        let mut x = carried(sim.mesh(), sim.positions(), &self.nodes)?;
        let Some(mesh) = sim.yarns() else {
            return Ok(x);
        };
        let mut own: Vec<_> = (0..mesh.uv.len())
            .map(|n| (key(mesh.node_panel[n], &mesh.uv[n]), n))
            .collect();
        own.sort_unstable();
        for (k, place) in x.iter_mut().enumerate() {
            let wanted = key(self.nodes.node_panel[k], &self.nodes.uv[k]);
            if let Ok(at) = own.binary_search_by_key(&wanted, |p| p.0) {
                *place = sim.yarn_nodes()[own[at].1];
            }
        }
        Ok(x)
    }

    /// How far places `x` are from the reference's `y`.
    fn deviation(&self, x: &[Vec3], y: &[Vec3]) -> Deviation {
        let n = x.len() as f64;
        let squares: f64 = x.iter().zip(y).map(|(x, y)| (x - y).norm_squared()).sum();
        let mut panels = self.nodes.node_panel.clone();
        panels.sort_unstable();
        panels.dedup();
        let [mut xx, mut xy, mut yy] = [0.0; 3];
        for panel in panels {
            let list: Vec<usize> = (0..x.len())
                .filter(|k| self.nodes.node_panel[*k] == panel)
                .collect();
            let mean = |of: &[Vec3]| list.iter().map(|k| of[*k]).sum::<Vec3>() / list.len() as f64;
            let (mx, my) = (mean(x), mean(y));
            let spread: Mat3 = list
                .iter()
                .map(|k| (y[*k] - my) * (y[*k] - my).transpose())
                .sum();
            let eigen = spread.symmetric_eigen();
            let normal = eigen
                .eigenvectors
                .column(eigen.eigenvalues.imin())
                .into_owned();
            for k in list {
                let (a, b) = (normal.dot(&(x[k] - mx)), normal.dot(&(y[k] - my)));
                xx += a * a;
                xy += a * b;
                yy += b * b;
            }
        }
        Deviation {
            error: (squares / n).sqrt(),
            height: (xx / yy).sqrt(),
            correlation: xy / (xx * yy).sqrt(),
        }
    }
}
