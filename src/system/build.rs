//! The only place that sees all terms: builds the ones that a garment and its fabrics call for.

use super::air::Air;
use super::bodies::BodySet;
use super::contact::body::BodyContact;
use super::contact::edge::EdgeContact;
use super::contact::self_contact::SelfContact;
use super::gravity::Gravity;
use super::hinge::Hinge;
use super::membrane::Membrane;
use super::points::Points;
use super::pressure::Pressure;
use super::quadratic_bending::QuadraticBending;
use super::seam_term::{SeamHinge, SeamSprings};
use super::state::State;
use super::term::{Bodies, Term};
use super::yarn::contacts::{Contacts, Sliding};
use super::yarn::unknowns::Unknowns;
use super::yarn::{self, YarnOptions};
use crate::blend::Coupling;
use crate::cloth::Cloth;
use crate::error::Result;
use crate::math::parallel::Workers;
use crate::math::{Vec2, Vec3, topology};
use crate::yarn::{Topology, Yarns};
use std::sync::Arc;

/// A compiled garment.
pub struct System {
    /// Rest data of the triangle part.
    pub cloth: Cloth,
    /// Rest data of the yarns as they are now, if there are any.
    pub yarns: Option<Arc<Yarns>>,
    laid: Option<Arc<Yarns>>,
    topology: Topology,
    /// Vertices and nodes.
    pub points: Points,
    /// Blocks of the yarns' unknowns, after those of the vertices.
    pub unknowns: Unknowns,
    sliding: Vec<bool>,
    contacts: Option<Contacts>,
    /// Energies.
    pub terms: Vec<Box<dyn Term>>,
    /// Bodies of the world.
    pub bodies: BodySet,
    /// Mesh edges, each once, smaller vertex first.
    pub edges: Vec<[u32; 2]>,
    /// Their rest lengths [m].
    pub rest_lengths: Vec<f64>,
    options: BuildOptions,
}

/// What decides which terms are built.
#[derive(Clone, Debug, PartialEq)]
pub struct BuildOptions {
    /// Factor on the stiffness of the membrane; 1 but while a tangle is unfolded.
    pub softening: f64,
    /// Seam stiffness per length [N/m^2].
    pub seam_stiffness: f64,
    /// Largest pull of an open seam per length [N/m].
    pub seam_pull: f64,
    /// Normal drag [kg/m^3].
    pub air_drag: f64,
    /// Tangential drag [kg/m^3].
    pub air_tangential: f64,
    /// Cloth against cloth.
    pub self_contact: bool,
    /// Its stiffness [Pa/m].
    pub self_stiffness: f64,
    /// Where yarns may slide.
    pub sliding: Sliding,
    /// Whether sliding material has inertia forces.
    pub inertia_forces: bool,
}

impl From<&BuildOptions> for YarnOptions {
    fn from(options: &BuildOptions) -> Self {
        Self {
            tie_stiffness: options.seam_stiffness,
            inertia_forces: options.inertia_forces,
            ..Self::default()
        }
    }
}

impl System {
    /// Compiles a garment of triangles alone; bodies come later.
    pub fn new(cloth: Cloth, options: &BuildOptions) -> Result<Self> {
        Self::with_yarns(cloth, None, Coupling::default(), options)
    }

    /// Compiles a garment whose yarns, as laid, are simulated where the cloth has no triangles, and
    /// how they are joined to those there are.
    pub fn with_yarns(
        cloth: Cloth,
        yarns: Option<Arc<Yarns>>,
        coupling: Coupling,
        options: &BuildOptions,
    ) -> Result<Self> {
        let points = Points {
            coupling,
            ..Points::new(&cloth, yarns.as_deref())
        };
        let sliding = vec![false; yarns.as_ref().map_or(0, |y| y.mesh.incidences.len())];
        let unknowns = unknowns(&cloth, yarns.as_deref(), &sliding)?;
        let yarn_options = YarnOptions::from(options);
        let contacts = yarns
            .clone()
            .map(|y| Contacts::new(y.clone(), y, &yarn_options))
            .transpose()?;
        let terms = terms(&cloth, &points, yarns.as_deref(), &unknowns, options)?;
        let edges = topology::edges(&cloth.mesh.triangles);
        let rest_lengths = edges
            .iter()
            .map(|e| (cloth.mesh.uv[e[1] as usize] - cloth.mesh.uv[e[0] as usize]).norm())
            .collect();
        Ok(Self {
            cloth,
            laid: yarns.clone(),
            yarns,
            topology: Topology::default(),
            points,
            unknowns,
            sliding,
            contacts,
            terms,
            bodies: BodySet::default(),
            edges,
            rest_lengths,
            options: options.clone(),
        })
    }

    /// Takes changed options; terms that carry them are built anew.
    pub fn set_options(&mut self, options: &BuildOptions) -> Result<()> {
        if *options != self.options {
            self.terms = terms(
                &self.cloth,
                &self.points,
                self.yarns.as_deref(),
                &self.unknowns,
                options,
            )?;
            self.options = options.clone();
        }
        Ok(())
    }

    /// Number of blocks of unknowns: points, then sliding coordinates.
    pub fn block_count(&self) -> usize {
        self.points.count() + self.unknowns.slide_blocks()
    }

    /// Unknown scalars of each block, the first ones.
    pub fn widths(&self) -> Vec<u8> {
        let mut widths = vec![3; self.points.count()];
        widths.extend(&self.unknowns.used);
        widths
    }

    /// Takes the contacts that a state's yarns are in and where they slide; true if unknowns have come or gone.
    pub fn take_contacts(&mut self, state: &State) -> Result<bool> {
        match &self.laid {
            Some(laid) if state.topology != self.topology => {
                let now = laid.present(&state.topology)?;
                self.set_yarns(laid.clone(), now, &state.topology)?;
            }
            _ if *state.sliding == *self.sliding => return Ok(false),
            _ => {}
        }
        self.unknowns = unknowns(&self.cloth, self.yarns.as_deref(), &state.sliding)?;
        self.sliding.clone_from(&state.sliding);
        self.terms = terms(
            &self.cloth,
            &self.points,
            self.yarns.as_deref(),
            &self.unknowns,
            &self.options,
        )?;
        Ok(true)
    }

    fn set_yarns(&mut self, laid: Arc<Yarns>, now: Yarns, topology: &Topology) -> Result<()> {
        let now = Arc::new(now);
        let options = YarnOptions::from(&self.options);
        self.contacts = Some(Contacts::new(laid, now.clone(), &options)?);
        // nodes that come in are counted on after those that are joined to triangles
        let coupling = std::mem::take(&mut self.points.coupling);
        self.points = Points {
            coupling,
            ..Points::new(&self.cloth, Some(&now))
        };
        self.yarns = Some(now);
        self.topology.clone_from(topology);
        self.sliding.clear();
        Ok(())
    }

    /// After an accepted step: the normal forces of the yarns' contacts, what slides next, and, if it was one in time
    /// (`releases`), which contacts have come off; true if some have and unknowns have come or gone.
    pub fn follow_contacts(
        &mut self,
        releases: bool,
        state: &mut State,
        workers: &Workers,
    ) -> Result<bool> {
        let (Some(contacts), Some(laid)) = (&mut self.contacts, &self.laid) else {
            return Ok(false);
        };
        let Some(now) = contacts.follow(self.options.sliding, releases, state, workers)? else {
            return Ok(false);
        };
        self.set_yarns(laid.clone(), now, &state.topology)?;
        self.take_contacts(state)
    }

    /// Values of all blocks in a state, points where their coupling has them.
    pub fn pack(&self, state: &State, x: &mut Vec<Vec3>) {
        x.clear();
        x.extend_from_slice(&state.positions);
        self.points.coupling.carry(x);
        x.resize(self.block_count(), Vec3::zeros());
        for (i, (u, slot)) in state.u.iter().zip(&self.unknowns.slides).enumerate() {
            if let (Some((block, c)), None) = (slot, self.unknowns.shift(i)) {
                x[*block as usize][usize::from(*c)] = *u;
            }
        }
    }

    /// Writes blocks that have moved from `start` to `x` in the time `h` [s] back into a state.
    pub fn unpack(&self, start: &[Vec3], x: &[Vec3], h: f64, state: &mut State) {
        for i in 0..self.points.count() {
            state.positions[i] = x[i];
            state.velocities[i] = (x[i] - start[i]) / h;
        }
        for (i, slot) in self.unknowns.slides.iter().enumerate() {
            state.u_rates[i] = 0.0;
            if let Some((block, c)) = slot {
                let (block, c) = (*block as usize, usize::from(*c));
                if let Some(shift) = self.unknowns.shift(i) {
                    state.u[i] = x[block][c] + shift;
                    continue;
                }
                state.u[i] = x[block][c];
                state.u_rates[i] = (x[block][c] - start[block][c]) / h;
            }
        }
    }

    /// Bytes of the mesh, of the rest data and of the terms.
    pub fn bytes(&self) -> usize {
        let n = self.cloth.mesh.uv.len();
        let terms: usize = self.terms.iter().map(|term| term.bytes()).sum();
        terms
            + n * (16 + 24 + 4 + 8 + 8 + 8)
            + self.cloth.mesh.triangles.len() * 24
            + self.edges.len() * 16
    }

    /// How deep a vertex may be in a body after an accepted substep [m].
    pub fn depth_limit(&self, body: usize) -> f64 {
        (2.0 * self.bodies.contact(body).thickness).max(4e-3)
    }

    /// Panel of a point.
    pub fn panel_of(&self, point: u32) -> u32 {
        let p = point as usize;
        match (&self.yarns, p.checked_sub(self.points.vertex_count)) {
            (Some(yarns), Some(node)) => yarns.mesh.node_panel[node],
            _ => self.cloth.mesh.vertex_panel[p],
        }
    }

    /// Flat coordinates of a point in its panel [m].
    pub fn flat_place(&self, point: u32) -> Vec2 {
        let p = point as usize;
        match (&self.yarns, p.checked_sub(self.points.vertex_count)) {
            (Some(yarns), Some(node)) => yarns.mesh.uv[node],
            _ => self.cloth.mesh.uv[p],
        }
    }

    /// Points of each part that hangs together by triangles, yarns and seams, parts by their first
    /// point. Points that do not move by themselves belong to none.
    pub fn parts(&self) -> Vec<Vec<u32>> {
        let mesh = &self.cloth.mesh;
        let mut root: Vec<u32> = (0..self.points.count() as u32).collect();
        let links = mesh.seams.iter().flat_map(|s| &s.links);
        let sewn = links.flat_map(|l| [[l.vertex, l.edge[0]], [l.vertex, l.edge[1]]]);
        let node = |n| self.unknowns.node(n);
        let coupling = &self.points.coupling;
        let blended = coupling.filter.iter().flat_map(|f| f.nodes());
        let riders = coupling.riders.list().iter().chain(blended);
        let ridden = riders.flat_map(|r| r.vertices.map(|v| [r.point, v]));
        let yarns = self.yarns.iter().flat_map(|y| {
            let ties = y.mesh.ties.iter().map(|t| [t.node, t.segment[0]]);
            (0..y.mesh.yarn_count())
                .flat_map(|k| y.mesh.yarn(k).windows(2))
                .map(|pair| [pair[0].node, pair[1].node])
                .chain(ties)
                .map(|pair| pair.map(node))
        });
        let links = self.edges.iter().copied().chain(sewn).chain(ridden);
        for [a, b] in links.chain(yarns) {
            let (a, b) = (find(&mut root, a), find(&mut root, b));
            root[a.max(b) as usize] = a.min(b);
        }
        let mut parts: Vec<Vec<u32>> = Vec::new();
        let mut place = vec![0; root.len()];
        for v in (0..root.len() as u32).filter(|v| self.points.moves(*v as usize)) {
            let top = find(&mut root, v);
            if top == v {
                place[v as usize] = parts.len();
                parts.push(Vec::new());
            }
            parts[place[top as usize]].push(v);
        }
        parts
    }

    /// Whether yarns are simulated.
    pub fn has_yarns(&self) -> bool {
        self.yarns.is_some()
    }

    /// Mean rest length of the edges, of the yarns' segments where there are no triangles [m].
    pub fn mean_edge(&self) -> f64 {
        match self.mean_segment() {
            Some(length) if self.edges.is_empty() => length,
            _ => self.rest_lengths.iter().sum::<f64>() / self.rest_lengths.len().max(1) as f64,
        }
    }

    /// Mean laid length of the yarns' segments [m].
    pub fn mean_segment(&self) -> Option<f64> {
        let mesh = &self.yarns.as_ref()?.mesh;
        let length: f64 = (0..mesh.yarn_count())
            .filter_map(|y| Some(mesh.yarn(y).last()?.u - mesh.yarn(y).first()?.u))
            .sum();
        Some(length / (mesh.incidences.len() - mesh.yarn_count()).max(1) as f64)
    }

    /// Least force that would stretch a yarn to twice its length, without end where there is none [N].
    pub fn yarn_stiffness(&self) -> f64 {
        let materials = self.yarns.iter().flat_map(|y| &y.materials);
        materials.map(|m| m.stretch).fold(f64::INFINITY, f64::min)
    }

    /// Largest change of an edge's relative length between two configurations, with a vertex of that edge.
    pub fn largest_stretch_change(&self, start: &[Vec3], x: &[Vec3]) -> Option<(u32, f64)> {
        let changes = self.edges.iter().zip(&self.rest_lengths).map(|(e, rest)| {
            let [a, b] = e.map(|v| v as usize);
            let change = (x[b] - x[a]).norm() - (start[b] - start[a]).norm();
            (e[0], change.abs() / rest)
        });
        changes.reduce(|a, b| if b.1 > a.1 { b } else { a })
    }

    /// Root mean square of the edges' relative change of length.
    pub fn rms_stretch(&self, x: &[Vec3]) -> f64 {
        let sum: f64 = self
            .edges
            .iter()
            .zip(&self.rest_lengths)
            .map(|(e, rest)| ((x[e[1] as usize] - x[e[0] as usize]).norm() / rest - 1.0).powi(2))
            .sum();
        (sum / self.edges.len().max(1) as f64).sqrt()
    }

    /// Largest relative stretch of an edge or of a yarn's segment; shortening is not counted.
    pub fn largest_strain(&self, state: &State) -> f64 {
        let x = &state.positions;
        let edges = (self.edges.iter())
            .zip(&self.rest_lengths)
            .map(|(e, rest)| (x[e[1] as usize] - x[e[0] as usize]).norm() / rest - 1.0)
            .fold(0.0, f64::max);
        let Some(yarns) = &self.yarns else {
            return edges;
        };
        let mesh = &yarns.mesh;
        (0..mesh.yarn_count())
            .flat_map(|y| mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize)
            .map(|i| {
                let [a, b] = [i - 1, i].map(|i| {
                    let node = self.unknowns.node(mesh.incidences[i].node);
                    (x[node as usize], state.u[i])
                });
                (b.0 - a.0).norm() / (b.1 - a.1) - 1.0
            })
            .fold(edges, f64::max)
    }

    /// Largest distance between the two points of a seam link or of a yarn end and its rod [m]. Where vertices follow yarns the
    /// yarns' ends tell.
    pub fn largest_seam_gap(&self, x: &[Vec3]) -> f64 {
        let gap = |point: u32, ends: [u32; 2], t: f64| {
            let [a, b] = ends.map(|v| x[v as usize]);
            (x[point as usize] - a.lerp(&b, t)).norm()
        };
        let links = self.cloth.mesh.seams.iter().flat_map(|s| &s.links);
        let sewn = links
            .filter(|l| {
                let mut points = [l.vertex, l.edge[0], l.edge[1]].into_iter();
                points.all(|v| self.points.moves(v as usize))
            })
            .map(|l| gap(l.vertex, l.edge, l.t))
            .fold(0.0, f64::max);
        let node = |n| self.unknowns.node(n);
        let ties = self.yarns.iter().flat_map(|y| &y.mesh.ties);
        ties.map(|t| gap(node(t.node), t.segment.map(node), t.t))
            .fold(sewn, f64::max)
    }

    /// Smallest signed distance of a point to a body [m], infinite without bodies. Nodes that no yarn passes
    /// do not count.
    pub fn smallest_gap(&self, x: &[Vec3]) -> f64 {
        let mut gap = f64::INFINITY;
        let passed = |i: &usize| *i < self.points.vertex_count || self.points.moves(*i);
        for b in 0..self.bodies.count() {
            for i in (0..x.len()).filter(passed) {
                gap = gap.min(self.bodies.value(b, &x[i]));
            }
        }
        gap
    }
}

/// The vertex that stands for the part of `v`.
fn find(root: &mut [u32], v: u32) -> u32 {
    let mut top = v;
    while root[top as usize] != top {
        // halves the way for those who come later
        root[top as usize] = root[root[top as usize] as usize];
        top = root[top as usize];
    }
    top
}

fn unknowns(cloth: &Cloth, yarns: Option<&Yarns>, sliding: &[bool]) -> Result<Unknowns> {
    let Some(yarns) = yarns else {
        return Ok(Unknowns::default());
    };
    let nodes = yarns.mesh.uv.len();
    let first = cloth.mesh.uv.len();
    Unknowns::new(&yarns.mesh, first as u32, (first + nodes) as u32, sliding)
}

fn terms(
    cloth: &Cloth,
    points: &Points,
    yarns: Option<&Yarns>,
    unknowns: &Unknowns,
    options: &BuildOptions,
) -> Result<Vec<Box<dyn Term>>> {
    let mut terms: Vec<Box<dyn Term>> = vec![
        Box::new(Gravity::new(cloth)),
        Box::new(Membrane::new(cloth, options.softening)),
        Box::new(BodyContact::new(points)),
        Box::new(EdgeContact::new(cloth)),
    ];
    for bending in Hinge::terms(cloth) {
        terms.push(Box::new(bending));
    }
    for bending in QuadraticBending::terms(cloth) {
        terms.push(Box::new(bending));
    }
    if cloth.mesh.seams.iter().any(|s| !s.links.is_empty()) {
        terms.push(Box::new(SeamSprings::new(
            cloth,
            options.seam_stiffness,
            options.seam_pull,
        )));
        terms.push(Box::new(SeamHinge::new(cloth)));
    }
    if options.air_drag > 0.0 || options.air_tangential > 0.0 {
        terms.push(Box::new(Air::new(
            cloth,
            options.air_drag,
            options.air_tangential,
        )));
    }
    terms.push(Box::new(Pressure::new(cloth)));
    if let Some(Yarns {
        mesh, materials, ..
    }) = yarns
    {
        terms.extend(yarn::terms(mesh, materials, unknowns, &options.into())?);
    }
    if options.self_contact {
        let friction = cloth.fabrics.iter().map(|f| f.friction).fold(0.0, f64::max);
        terms.push(Box::new(SelfContact::new(
            cloth,
            points,
            yarns,
            options.self_stiffness,
            friction,
        )?));
    }
    Ok(terms)
}
