//! What a region costs, before it is built.
//!
//! A weave has a node for each crossing, a knit four for each loop. Inside of a region nodes move by themselves; energies reach `b`
//! nodes beyond its border along every yarn that crosses it, and those ride on triangles. At the outline of a panel yarns have ends, and a
//! seam's rod has nodes for those of one of its sides:
//!
//! ```text
//! nodes = sum_T A_T rho + sum_outline n_yarns + 1/2 sum_sewn n_yarns + b sum_border n_yarns
//! unknowns = 3 (nodes that move + vertices with triangles of their own)
//! ```
//!
//! Time is what a Newton iteration takes, and how many there are. With `u` the unknowns over those of triangles alone,
//!
//! ```text
//! iteration = 1.25 u,   drape = 1 + 2.6 iteration
//! ```
//!
//! both over those of triangles alone. The first holds within a factor of 1.5 on `examples/pucker.json`, `sleeve.json` and `doll_skirt.json`, with suggested
//! regions and with yarns everywhere, 780 to 8 500 unknowns, as steps after yarns were laid have it: factors of such sizes grow
//! as the unknowns do, and so do those of parts up to 800 000 (`docs/benchmarks.md`). The second counts the triangles' drape and from where they rest the one with
//! yarns, which took 0.9 to 7 times the triangles' iterations there and lies within a factor of 2.3, up or down, of nine drapes. No time of a
//! step is predicted, as nothing in the triangles' state tells its iterations: `examples/swing.json` takes 3 a step by every model, while the first ten
//! steps after yarns were laid in the gathers of those three took 6 to 81 where triangles took one or two.
//!
//! Memory is a line through the models of `examples/pucker.json`. Unknowns of sliding are left out: they come and go with the contacts that slide.

use crate::blend::Region;
use crate::math::{Vec2, topology};
use crate::pattern::Garment;
use crate::pattern::yarn_fabric::Structure;
use crate::tri::GarmentMesh;
use crate::yarn::Cell;
use std::collections::BTreeSet;

/// Nodes of a loop.
const LOOP_NODES: f64 = 4.0;
/// Nodes beyond the border along each yarn of a weave, and rows of loops beyond that of a knit, as counted at borders of regions.
const BEYOND: [f64; 2] = [1.6, 0.8];
/// Nodes of a seam's rod for each yarn that ends there, on either side.
const ROD: f64 = 0.5;
/// Time of a Newton iteration by unknowns where yarns are, over that by those of triangles.
const ITERATION: f64 = 1.25;
/// Newton iterations of a drape with yarns that begins where triangles rest, over those that triangles took to it.
const ITERATIONS: f64 = 2.6;
/// Memory [bytes]: of what every simulation has, and of each unknown with its terms, matrix and factor.
const BYTES: [f64; 2] = [3.7e6, 4300.0];

/// Predicted cost; numbers of nodes and unknowns are counted where yarns were laid to tell.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Cost {
    /// Nodes of yarns, carried ones included.
    pub yarn_nodes: u64,
    /// Nodes among them that triangles carry.
    pub carried_nodes: u64,
    /// Triangles that are simulated.
    pub triangles: u64,
    /// Scalar unknowns.
    pub unknowns: u64,
    /// Time of a drape over that of triangles alone, which it begins with.
    pub time_ratio: f64,
    /// Time of a Newton iteration over that of triangles alone.
    pub iteration_ratio: f64,
    /// Memory [bytes].
    pub bytes: u64,
}

/// What yarns cost on a mesh.
pub struct Predictor<'a> {
    mesh: &'a GarmentMesh,
    /// Nodes in each triangle.
    inside: Vec<f64>,
    /// Edges of two triangles: these, and nodes that yarns have beyond the edge.
    borders: Vec<([u32; 2], f64)>,
}

/// How densely yarns lie in a panel.
struct Density {
    /// Direction across the cloth.
    across: Vec2,
    /// Distances of yarns or loops as laid, across and along [m].
    pitch: [f64; 2],
    /// Nodes for each of them.
    nodes: f64,
    /// How many of them energies reach beyond a border.
    beyond: f64,
}

impl Density {
    fn of(garment: &Garment, panel: usize, cells: &[Cell]) -> Option<Self> {
        let panel = &garment.panels[panel];
        let yarns = garment.fabrics[panel.fabric].yarns.as_ref()?;
        let cell = cells.get(panel.fabric).copied().unwrap_or_default();
        let [a, b] = yarns.structure.pitch();
        let (nodes, beyond) = match yarns.structure {
            Structure::Woven(_) => (1.0, BEYOND[0]),
            Structure::Knitted(_) => (LOOP_NODES, BEYOND[1]),
        };
        Some(Self {
            across: Vec2::new(panel.grain.cos(), panel.grain.sin()),
            pitch: [a * cell.across, b * cell.along],
            nodes,
            beyond,
        })
    }

    /// Yarns or loops that an edge crosses.
    fn crossed(&self, edge: Vec2) -> f64 {
        let across = edge.dot(&self.across).abs() / self.pitch[0];
        let along = edge.perp(&self.across).abs() / self.pitch[1];
        across + along
    }
}

impl<'a> Predictor<'a> {
    /// For a garment's mesh; `cells` says how its fabrics are laid.
    pub fn new(garment: &Garment, mesh: &'a GarmentMesh, cells: &[Cell]) -> Self {
        let densities: Vec<Option<Density>> = (0..garment.panels.len())
            .map(|p| Density::of(garment, p, cells))
            .collect();
        let density = |t: usize| densities[mesh.triangle_panel[t] as usize].as_ref();
        let outline: BTreeSet<[u32; 2]> = topology::boundary_edges(&mesh.triangles)
            .into_iter()
            .collect();
        let sewn = mesh.sewn();
        let inside = (mesh.triangles.iter().enumerate()).map(|(t, tri)| {
            let Some(density) = density(t) else {
                return 0.0;
            };
            let [a, b, c] = tri.map(|v| mesh.uv[v as usize]);
            let area = 0.5 * (b - a).perp(&(c - a)).abs();
            let ends: f64 = (0..3)
                .map(|k| [tri[k], tri[(k + 1) % 3]])
                .filter(|[a, b]| outline.contains(&[*a.min(b), *a.max(b)]))
                .map(|side| {
                    let [a, b] = side.map(|v| mesh.uv[v as usize]);
                    let rod = if side.iter().all(|v| sewn[*v as usize]) {
                        ROD
                    } else {
                        0.0
                    };
                    (1.0 + rod) * density.crossed(b - a)
                })
                .sum();
            ends + density.nodes * area / (density.pitch[0] * density.pitch[1])
        });
        let borders = (topology::inner_edges(&mesh.triangles).into_iter()).map(|(edge, beside)| {
            let [a, b] = edge.map(|v| mesh.uv[v as usize]);
            let beyond = |d: &Density| d.beyond * d.nodes * d.crossed(b - a);
            (beside, density(beside[0] as usize).map_or(0.0, beyond))
        });
        Self {
            inside: inside.collect(),
            borders: borders.collect(),
            mesh,
        }
    }

    /// Of a region.
    pub fn cost(&self, region: &Region) -> Cost {
        let triangles = 0..self.mesh.triangles.len();
        let own: f64 = (triangles.clone().filter(|t| region.has_yarns(*t)))
            .map(|t| self.inside[t])
            .sum();
        let has = |t: u32| region.has_yarns(t as usize);
        let beyond: f64 = (self.borders.iter())
            .filter(|([a, b], _)| has(*a) != has(*b))
            .map(|(_, nodes)| nodes)
            .sum();
        let mut bare = vec![true; self.mesh.uv.len()];
        let kept: Vec<usize> = triangles.filter(|t| !region.full[*t]).collect();
        for v in kept.iter().flat_map(|t| self.mesh.triangles[*t]) {
            bare[v as usize] = false;
        }
        let vertices = bare.iter().filter(|bare| !**bare).count();
        let unknowns = 3.0 * (own + vertices as f64);
        let cost = Cost {
            yarn_nodes: (own + beyond).ceil() as u64,
            carried_nodes: beyond.ceil() as u64,
            triangles: kept.len() as u64,
            ..Cost::default()
        };
        cost.with_unknowns(unknowns.ceil() as u64, self.mesh.uv.len())
    }
}

impl Cost {
    /// The same with so many unknowns on a mesh of so many vertices, and what follows from them.
    #[must_use]
    pub fn with_unknowns(self, unknowns: u64, vertices: usize) -> Self {
        let more = unknowns as f64 / (3 * vertices.max(1)) as f64;
        let [iteration_ratio, time_ratio] = if self.yarn_nodes == 0 {
            [1.0; 2]
        } else {
            [ITERATION * more, 1.0 + ITERATIONS * ITERATION * more]
        };
        Self {
            unknowns,
            time_ratio,
            iteration_ratio,
            bytes: (BYTES[0] + unknowns as f64 * BYTES[1]) as u64,
            ..self
        }
    }
}
