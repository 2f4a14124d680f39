//! What hosts hold: vertices and nodes of yarns, where they are, and what their holders bear.
//!
//! Points are vertices and, counted on, nodes.

use super::{MAX_COMPONENT, Sim, finite, within};
use crate::error::{Error, Result};
use crate::math::{Vec2, Vec3};
use crate::system::state::Pin;

impl Sim {
    /// Holds vertices; targets are reached at the end of the next step, `None` holds them where
    /// they are. A vertex that is already pinned takes the new target.
    pub fn pin(&mut self, vertices: &[u32], targets: Option<&[[f64; 3]]>) -> Result<()> {
        self.check_vertices(vertices)?;
        self.pin_points(vertices, targets)
    }

    /// Lets vertices go; one that is not pinned is refused.
    pub fn unpin(&mut self, vertices: &[u32]) -> Result<()> {
        self.check_vertices(vertices)?;
        self.unpin_points(vertices)
    }

    /// Holds nodes of yarns as [`Sim::pin`] holds vertices; yarns do not slide where they are held, and no contact
    /// comes off there.
    pub fn pin_yarn_nodes(&mut self, nodes: &[u32], targets: Option<&[[f64; 3]]>) -> Result<()> {
        let points = self.node_points(nodes)?;
        self.pin_points(&points, targets)
    }

    /// Lets nodes of yarns go; one that is not held is refused.
    pub fn unpin_yarn_nodes(&mut self, nodes: &[u32]) -> Result<()> {
        let points = self.node_points(nodes)?;
        self.unpin_points(&points)
    }

    /// Holds points, whether vertices or nodes.
    pub fn pin_points(&mut self, points: &[u32], targets: Option<&[[f64; 3]]>) -> Result<()> {
        for point in points {
            self.check_point(*point)?;
        }
        if let Some(targets) = targets {
            if targets.len() != points.len() {
                return Err(Error::argument(format!(
                    "{} points but {} targets",
                    points.len(),
                    targets.len()
                )));
            }
            for (p, t) in points.iter().zip(targets) {
                within(&format!("target of {}", self.name(*p)), t, MAX_COMPONENT)?;
            }
            let mut order: Vec<usize> = (0..points.len()).collect();
            order.sort_by_key(|k| points[*k]);
            let differ =
                |w: &&[usize]| points[w[0]] == points[w[1]] && targets[w[0]] != targets[w[1]];
            if let Some(w) = order.windows(2).find(differ) {
                let [a, b] = [targets[w[0]], targets[w[1]]];
                return Err(Error::argument(format!(
                    "{} has two targets: ({}, {}, {}) and ({}, {}, {}) m",
                    self.name(points[w[0]]),
                    a[0],
                    a[1],
                    a[2],
                    b[0],
                    b[1],
                    b[2]
                )));
            }
        }
        for (k, point) in points.iter().enumerate() {
            let now = self.state.positions[*point as usize];
            let target = targets.map_or(now, |t| Vec3::from(t[k]));
            self.hold(*point, target);
        }
        self.epoch += 1;
        Ok(())
    }

    /// Lets points go; one that is not held is refused.
    pub fn unpin_points(&mut self, points: &[u32]) -> Result<()> {
        if let Some(p) = points.iter().find(|p| !self.is_pinned(**p)) {
            return Err(Error::argument(format!("{} is not pinned", self.name(*p))));
        }
        self.state.pins.retain(|p| !points.contains(&p.vertex));
        self.epoch += 1;
        Ok(())
    }

    /// Whether a point is held.
    pub fn is_pinned(&self, point: u32) -> bool {
        let pins = &self.state.pins;
        pins.binary_search_by_key(&point, |p| p.vertex).is_ok()
    }

    /// Position of every point [m].
    pub fn points(&self) -> &[Vec3] {
        &self.state.positions
    }

    /// Where a point is when its panel is placed [m].
    pub fn placed(&self, point: u32) -> Vec3 {
        let p = point as usize;
        match (p.checked_sub(self.mesh.uv.len()), self.yarns()) {
            (Some(node), Some(yarns)) => {
                let placement = &self.garment.panels[yarns.node_panel[node] as usize].placement;
                let (uv, lift) = (yarns.uv[node], yarns.lift[node]);
                placement.rotation * Vec3::new(uv.x, uv.y, lift) + placement.translation
            }
            _ => self.mesh.placed[p],
        }
    }

    /// Point number of a node of yarns.
    pub fn point_of_node(&self, node: u32) -> u32 {
        self.mesh.uv.len() as u32 + node
    }

    fn hold(&mut self, point: u32, target: Vec3) {
        let pins = &mut self.state.pins;
        match pins.binary_search_by_key(&point, |p| p.vertex) {
            Ok(i) => pins[i].target = target,
            Err(i) => pins.insert(
                i,
                Pin {
                    vertex: point,
                    target,
                },
            ),
        }
        let Some(node) = (point as usize).checked_sub(self.mesh.uv.len()) else {
            return;
        };
        if let Some(part) = &self.yarns {
            for strand in part.now.mesh.stack(node) {
                self.state.sliding[strand.incidence as usize] = false;
                self.state.u_rates[strand.incidence as usize] = 0.0;
            }
        }
    }

    pub(super) fn name(&self, point: u32) -> String {
        match point.checked_sub(self.mesh.uv.len() as u32) {
            None => format!("vertex {point}"),
            Some(node) => format!("yarn node {node}"),
        }
    }

    fn check_point(&self, point: u32) -> Result<()> {
        let Some(node) = point.checked_sub(self.mesh.uv.len() as u32) else {
            return self.check_vertices(&[point]);
        };
        let passed = |mesh: &crate::yarn::YarnMesh| {
            let n = node as usize;
            n < mesh.uv.len() && !mesh.stack(n).is_empty()
        };
        if self.yarns().is_some_and(passed) {
            let filter = self.yarns.as_ref().and_then(|y| y.coupling.filter.as_ref());
            return if filter.is_some_and(|f| f.places(point)) {
                Err(Error::argument(format!(
                    "yarn node {node} lies in a hybrid ring: hold vertices there"
                )))
            } else if self.moves_by_itself(point) {
                Ok(())
            } else {
                Err(Error::argument(format!(
                    "yarn node {node} rides on triangles: hold vertices there"
                )))
            };
        }
        let count = self.yarn_nodes().len();
        Err(Error::argument(if (node as usize) < count {
            format!("no yarn passes yarn node {node} any more")
        } else {
            format!("yarn node {node} does not exist: the simulation has {count}")
        }))
    }

    fn check_vertices(&self, vertices: &[u32]) -> Result<()> {
        let n = self.mesh.uv.len();
        if let Some(part) = &self.yarns
            && let Some(v) = vertices.iter().find(|v| part.follows(**v))
        {
            return Err(Error::argument(format!(
                "vertex {v} follows the yarns of its panel: hold nodes of yarns there"
            )));
        }
        match vertices.iter().find(|&&v| v as usize >= n) {
            Some(v) => Err(Error::argument(format!(
                "vertex {v} does not exist; there are {n} vertices"
            ))),
            None => Ok(()),
        }
    }

    /// Points of nodes, all of which must be there.
    fn node_points(&self, nodes: &[u32]) -> Result<Vec<u32>> {
        let count = self.yarn_nodes().len();
        match nodes.iter().find(|&&n| n as usize >= count) {
            Some(n) => Err(Error::argument(format!(
                "yarn node {n} does not exist: the simulation has {count}"
            ))),
            None => Ok(nodes.iter().map(|n| self.point_of_node(*n)).collect()),
        }
    }

    /// Vertex of a panel nearest to a flat point [m].
    pub fn locate(&self, panel: u32, uv: [f64; 2]) -> Result<u32> {
        finite("uv", &uv)?;
        let p = self.panel(panel)?;
        let starts = &self.mesh.panel_starts;
        let point = Vec2::from(uv);
        (starts[p]..starts[p + 1])
            .min_by(|a, b| {
                let d = |v: &u32| (self.mesh.uv[*v as usize] - point).norm_squared();
                d(a).total_cmp(&d(b))
            })
            .ok_or_else(|| Error::argument(format!("panel {panel} has no vertices")))
    }

    fn panel(&self, panel: u32) -> Result<usize> {
        let count = self.garment.panels.len();
        if panel as usize >= count {
            return Err(Error::argument(format!(
                "panel {panel} does not exist; there are {count}"
            )));
        }
        Ok(panel as usize)
    }

    /// Whether a point moves by itself: it follows no yarns and rides on no triangles.
    pub fn moves_by_itself(&self, point: u32) -> bool {
        self.yarns.as_ref().is_none_or(|part| {
            let follows = (point as usize) < self.mesh.uv.len() && part.follows(point);
            !follows && !part.coupling.riders.rides(point)
        })
    }

    /// Nodes of a panel that yarns pass.
    fn nodes_of(&self, panel: u32) -> impl Iterator<Item = (u32, Vec2)> + '_ {
        self.yarns().into_iter().flat_map(move |mesh| {
            (0..mesh.uv.len())
                .filter(move |n| mesh.node_panel[*n] == panel && !mesh.stack(*n).is_empty())
                .map(|n| (n as u32, mesh.uv[n]))
        })
    }

    /// Node of a panel's yarns that was laid nearest to a flat point [m].
    pub fn locate_yarn_node(&self, panel: u32, uv: [f64; 2]) -> Result<u32> {
        finite("uv", &uv)?;
        self.panel(panel)?;
        let point = Vec2::from(uv);
        self.nodes_of(panel)
            .min_by(|a, b| {
                let d = |n: &(u32, Vec2)| (n.1 - point).norm_squared();
                d(a).total_cmp(&d(b))
            })
            .map(|n| n.0)
            .ok_or_else(|| Error::argument(format!("no yarns are simulated on panel {panel}")))
    }

    /// Nodes that are the border of a panel's yarns along one of its edges, as laid ([`crate::yarn::border`]); none where
    /// no yarns are simulated there.
    pub fn yarn_nodes_along(&self, panel: u32, edge: u32) -> Result<Vec<u32>> {
        let shape = &self.garment.panels[self.panel(panel)?];
        let count = shape.edge_count();
        if edge as usize >= count {
            return Err(Error::argument(format!(
                "panel {panel} has no edge {edge}: it has {count}"
            )));
        }
        let part = self.yarns.as_ref();
        Ok(part.map_or_else(Vec::new, |part| part.along(panel, edge)))
    }

    /// Nodes of a yarn, in its order.
    pub fn yarn(&self, yarn: u32) -> Result<Vec<u32>> {
        let count = self.yarns().map_or(0, |mesh| mesh.yarn_count());
        match self.yarns() {
            Some(mesh) if (yarn as usize) < count => {
                let passages = mesh.yarn(yarn as usize).iter();
                Ok(passages.map(|i| i.node).collect())
            }
            _ => Err(Error::argument(format!(
                "yarn {yarn} does not exist; there are {count}"
            ))),
        }
    }

    /// Node at the first (0) or the last (1) end of a yarn.
    pub fn yarn_end(&self, yarn: u32, end: u32) -> Result<u32> {
        let nodes = self.yarn(yarn)?;
        let node = match end {
            0 => nodes.first(),
            1 => nodes.last(),
            _ => None,
        };
        let node = node.copied();
        node.ok_or_else(|| Error::argument(format!("end {end} of yarn {yarn}: 0 or 1")))
    }

    /// Force on each node of the yarns and of what acts on them [N]: on a held node what its holder bears.
    pub fn yarn_forces(&self) -> Result<Vec<Vec3>> {
        let forces = self.point_forces()?;
        let nodes = &forces[self.mesh.uv.len()..];
        Ok(nodes.iter().map(|g| -g).collect())
    }

    /// Gradient of elastic, contact and outer energies in the present state by every point [N], as
    /// [`Sim::forces`] by vertices.
    pub fn point_forces(&self) -> Result<Vec<Vec3>> {
        let mut forces = self.engine().forces(&self.state)?;
        forces.truncate(self.state.positions.len());
        Ok(forces)
    }
}
