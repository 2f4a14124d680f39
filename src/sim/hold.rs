//! Pins that pass from vertices to nodes of yarns and back where regions change.
//!
//! Triangles hold what lies between held vertices: an edge that joins two of them, a triangle of three. Nodes that come in there, within
//! [`BESIDE`] of the pitch, are held; and a vertex that follows yarns from now on, with none of them within a pitch, passes its pin to the
//! node nearest to it. On the way back a vertex that followed is held where a node within a pitch was. Targets are as far off as they were,
//! `target = x + sum_k b_k (target_k - x_k)`, so that what was to move in the next step still is. A held node that goes where no
//! held vertex, edge or triangle takes its place is refused.

use super::Sim;
use super::region::Before;
use super::yarns::YarnPart;
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3, topology};
use crate::pattern::Garment;
use crate::pattern::outline::point_distance;
use crate::system::state::{Pin, State};
use crate::tri::GarmentMesh;
use std::collections::BTreeMap;

/// Distance to what is held, over the yarns' pitch, below which a node is held.
const BESIDE: f64 = 0.45;

/// What vertices hold: edges and triangles, with how far each corner is still to go [m].
struct Held<'a> {
    mesh: &'a GarmentMesh,
    ways: BTreeMap<u32, Vec3>,
    edges: Vec<[u32; 2]>,
    triangles: Vec<[u32; 3]>,
}

impl<'a> Held<'a> {
    fn new(mesh: &'a GarmentMesh, ways: BTreeMap<u32, Vec3>) -> Self {
        let edges = if ways.len() > 1 {
            let mut all = topology::edges(&mesh.triangles);
            all.retain(|edge| edge.iter().all(|v| ways.contains_key(v)));
            all
        } else {
            Vec::new()
        };
        let triangles =
            (mesh.triangles.iter().copied()).filter(|t| t.iter().all(|v| ways.contains_key(v)));
        Self {
            triangles: triangles.collect(),
            edges,
            mesh,
            ways,
        }
    }

    /// How far a place of a panel is to go, if it is held.
    fn way(&self, panel: u32, p: Vec2, reach: f64) -> Option<Vec3> {
        let on_panel = |v: u32| self.mesh.vertex_panel[v as usize] == panel;
        let uv = |v: u32| self.mesh.uv[v as usize];
        for t in self.triangles.iter().filter(|t| on_panel(t[0])) {
            let [a, b, c] = t.map(uv);
            let whole = (b - a).perp(&(c - a));
            let weights = [[b, c], [c, a], [a, b]].map(|[q, r]| (q - p).perp(&(r - p)) / whole);
            if weights.iter().all(|w| *w >= 0.0) {
                let parts = t.iter().zip(weights).map(|(v, w)| self.ways[v] * w);
                return Some(parts.sum());
            }
        }
        let near = self.edges.iter().filter(|e| on_panel(e[0]));
        let (edge, distance) = near
            .map(|e| (e, point_distance(p, uv(e[0]), uv(e[1]))))
            .min_by(|a, b| a.1.total_cmp(&b.1))?;
        let [a, b] = edge.map(uv);
        let t = ((p - a).dot(&(b - a)) / (b - a).norm_squared()).clamp(0.0, 1.0);
        let way = self.ways[&edge[0]] * (1.0 - t) + self.ways[&edge[1]] * t;
        (distance <= reach).then_some(way)
    }
}

/// Distance of yarns on each panel [m], 0 without yarns.
fn pitches(garment: &Garment) -> Vec<f64> {
    let pitch = |fabric: usize| {
        let yarns = garment.fabrics[fabric].yarns.as_ref();
        yarns.map_or(0.0, |f| {
            let [a, b] = f.structure.pitch();
            a.max(b)
        })
    };
    garment.panels.iter().map(|p| pitch(p.fabric)).collect()
}

/// The node of a part nearest to a vertex among those with `which`, at most `reach` away.
fn nearest(
    part: &YarnPart,
    mesh: &GarmentMesh,
    vertex: u32,
    reach: f64,
    which: impl Fn(u32) -> bool,
) -> Option<u32> {
    let (yarns, v) = (&part.now.mesh, vertex as usize);
    (0..yarns.uv.len() as u32)
        .filter(|n| yarns.node_panel[*n as usize] == mesh.vertex_panel[v])
        .map(|n| (n, (yarns.uv[n as usize] - mesh.uv[v]).norm()))
        .filter(|(n, d)| *d <= reach && which(*n))
        .min_by(|a, b| a.1.total_cmp(&b.1))
        .map(|p| p.0)
}

impl Sim {
    /// The pins after a change of regions; `there` is what a point is called now, `state` has the new places.
    pub(super) fn carry_pins(
        &self,
        before: &Before,
        part: Option<&YarnPart>,
        there: impl Fn(u32) -> Option<u32>,
        state: &State,
    ) -> Result<Vec<Pin>> {
        let (mesh, count) = (&self.mesh, self.mesh.uv.len() as u32);
        let pitches = pitches(&self.garment);
        let holds = |point: u32| part.is_none_or(|part| part.lets_hold(point, count));
        let way = |pin: &Pin| pin.target - self.state.positions[pin.vertex as usize];
        let pins = &self.state.pins;
        let stays = |pin: &Pin| there(pin.vertex).filter(|p| holds(*p));
        let mut targets: BTreeMap<u32, Vec3> = (pins.iter())
            .filter_map(|pin| stays(pin).map(|p| (p, pin.target)))
            .collect();
        let go = |pin: &&Pin| stays(pin).is_none();
        let vertices = pins.iter().filter(|pin| pin.vertex < count);
        let held = Held::new(mesh, vertices.clone().map(|p| (p.vertex, way(p))).collect());
        if let Some(part) = part {
            let yarns = &part.now.mesh;
            let position = |n: u32| state.positions[(count + n) as usize];
            let come = (0..)
                .zip(&before.nodes)
                .filter(|(_, before)| before.is_none());
            for n in come.map(|p| p.0).filter(|n| holds(count + n)) {
                let panel = yarns.node_panel[n as usize];
                let reach = BESIDE * pitches[panel as usize];
                if let Some(way) = held.way(panel, yarns.uv[n as usize], reach) {
                    targets.insert(count + n, position(n) + way);
                }
            }
            for pin in vertices.filter(go) {
                let pitch = pitches[mesh.vertex_panel[pin.vertex as usize] as usize];
                let is_held = |n| targets.contains_key(&(count + n));
                if nearest(part, mesh, pin.vertex, pitch, is_held).is_some() {
                    continue;
                }
                let node = nearest(part, mesh, pin.vertex, pitch, |n| holds(count + n));
                let node = node.ok_or_else(|| self.held(pin.vertex))?;
                targets.insert(count + node, position(node) + way(pin));
            }
        }
        let nodes: Vec<&Pin> = (pins.iter().filter(|p| p.vertex >= count))
            .filter(go)
            .collect();
        if let (Some(old), false) = (&self.yarns, nodes.is_empty()) {
            self.pins_of_vertices(old, &nodes, holds, &pitches, state, &mut targets)?;
        }
        Ok((targets.into_iter())
            .map(|(vertex, target)| Pin { vertex, target })
            .collect())
    }

    /// Adds the pins of vertices that take the place of those of nodes that go.
    fn pins_of_vertices(
        &self,
        old: &YarnPart,
        gone: &[&Pin],
        holds: impl Fn(u32) -> bool,
        pitches: &[f64],
        state: &State,
        targets: &mut BTreeMap<u32, Vec3>,
    ) -> Result<()> {
        let (mesh, count) = (&self.mesh, self.mesh.uv.len() as u32);
        let place = |pin: &Pin| {
            let n = (pin.vertex - count) as usize;
            (old.now.mesh.node_panel[n], old.now.mesh.uv[n])
        };
        let beside = |v: u32, pin: &Pin| {
            let ((panel, uv), v) = (place(pin), v as usize);
            mesh.vertex_panel[v] == panel && (mesh.uv[v] - uv).norm() <= pitches[panel as usize]
        };
        let mut back = Vec::new();
        for v in (0..count).filter(|v| old.follows(*v) && holds(*v)) {
            if !gone.iter().any(|pin| beside(v, pin)) {
                continue;
            }
            let pitch = pitches[mesh.vertex_panel[v as usize] as usize];
            let pin = |node: u32| {
                let pins = &self.state.pins;
                let at = pins.binary_search_by_key(&(node + count), |p| p.vertex);
                at.ok().map(|at| &pins[at])
            };
            let node = nearest(old, mesh, v, pitch, |n| pin(n).is_some());
            if let Some(pin) = node.and_then(pin) {
                let way = pin.target - self.state.positions[pin.vertex as usize];
                targets.insert(v, state.positions[v as usize] + way);
                back.push(v);
            }
        }
        let vertices = targets.keys().filter(|v| **v < count);
        let held = Held::new(mesh, vertices.map(|v| (*v, Vec3::zeros())).collect());
        for pin in gone {
            let (panel, uv) = place(pin);
            let between = held.way(panel, uv, BESIDE * pitches[panel as usize]);
            if between.is_none() && !back.iter().any(|v| beside(*v, pin)) {
                return Err(self.held(pin.vertex));
            }
        }
        Ok(())
    }

    fn held(&self, point: u32) -> Error {
        let what = self.name(point);
        Error::state(if (point as usize) < self.mesh.uv.len() {
            format!(
                "{what} is held and would follow yarns none of which can be held beside it: let it go first"
            )
        } else {
            format!(
                "{what} is held and would not move by itself, and no vertex or edge takes its place: let it go first, and hold vertices \
                 afterwards"
            )
        })
    }
}
