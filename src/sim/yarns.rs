//! Yarns of a simulation: where they are, what holds them, and the vertices that follow them.

use super::Sim;
use crate::blend::blended::{self, BlendOptions};
use crate::blend::embed::carried_along;
use crate::blend::{Coupling, Filter, Follow, Joined, Region, direct};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::fabric::rest::cells;
use crate::math::Vec3;
use crate::pattern::Garment;
use crate::readout::yarns::{Curve, curves};
use crate::solve::settings::Settings;
use crate::system::state::State;
use crate::system::yarn::friction::loose;
use crate::tri::GarmentMesh;
use crate::yarn::border::{Border, borders};
use crate::yarn::layout::Layout;
use crate::yarn::{Incidence, Names, Topology, YarnMaterial, YarnMesh, Yarns, lay};
use std::sync::{Arc, PoisonError};

/// Yarns, what they ride on, and the vertices that they carry.
pub(super) struct YarnPart {
    /// Yarns as they pass their nodes now.
    pub(super) now: Arc<Yarns>,
    /// What is not as laid, in `now`.
    pub(super) topology: Topology,
    /// What the laid nodes and passages are called.
    pub(super) names: Names,
    /// Laid nodes that are the border of the yarns along edges of the panels, sorted.
    borders: Vec<Border>,
    /// What joins them to the triangles.
    pub(super) coupling: Coupling,
    /// Triangles that the yarns stand for.
    pub(super) left_out: Vec<bool>,
    share: Vec<[f64; 2]>,
    own: Vec<f64>,
    masses: Vec<Option<f64>>,
    follow: Follow,
}

impl YarnPart {
    /// Lays the yarns of the triangles that the garment's blend regions hold; `found` are the settings that fabrics are
    /// found with.
    pub(super) fn new(
        garment: &Garment,
        mesh: &GarmentMesh,
        settings: &Settings,
        found: &Settings,
    ) -> Result<Option<Self>> {
        let region = Region::new(garment, mesh)?;
        let mut wanted: Vec<u32> = (region.full.iter().zip(&mesh.triangle_panel))
            .filter(|(full, _)| **full)
            .map(|p| *p.1)
            .collect();
        wanted.sort_unstable();
        wanted.dedup();
        if wanted.is_empty() {
            return Ok(None);
        }
        let used =
            |fabric: usize| (wanted.iter()).any(|p| garment.panels[*p as usize].fabric == fabric);
        let cells = cells(garment, used, found)?;
        let layout = Layout {
            panels: Some(&wanted),
            cells: &cells,
            max_nodes: settings.max_yarn_nodes as usize,
        };
        let laid = lay(garment, &layout)?;
        let names = laid.names();
        let borders = borders(garment, &laid)?;
        let materials: Vec<YarnMaterial> = garment
            .fabrics
            .iter()
            .map(|f| f.yarns.as_ref().map(YarnMaterial::from).unwrap_or_default())
            .collect();
        let options = BlendOptions {
            means: settings.blend_means > 0.5,
            everywhere: settings.blend_enrich > 0.5,
        };
        let joined = if options.everywhere || region.hybrid.contains(&true) {
            blended::join(garment, mesh, &region, laid, &materials, options)?
        } else {
            direct::join(garment, mesh, &region.full, laid, &materials)?
        };
        let Joined {
            yarns,
            nodes,
            passages,
            coupling,
            full: left_out,
            share,
            own,
            masses,
        } = joined;
        yarns.check()?;
        let mut number = vec![None; names.nodes.len()];
        for (here, laid) in (0_u32..).zip(&nodes) {
            number[*laid as usize] = Some(here);
        }
        let here = |b: Border| number[b.node as usize].map(|node| Border { node, ..b });
        let borders = borders.into_iter().filter_map(here).collect();
        let mut follows = vec![false; mesh.uv.len()];
        for gone in [true, false] {
            let list = mesh.triangles.iter().zip(&left_out);
            for (tri, _) in list.filter(|(_, left_out)| **left_out == gone) {
                for v in tri {
                    follows[*v as usize] = gone;
                }
            }
        }
        for v in coupling.filter.iter().flat_map(|f| f.bare()) {
            follows[*v as usize] = false;
        }
        let name_and_reach = |panel: usize| {
            let panel = &garment.panels[panel];
            (panel.name.clone(), garment.panel_edge_length(panel))
        };
        let follow = Follow::new(mesh, &yarns, &follows, name_and_reach)?;
        Ok(Some(Self {
            now: Arc::new(Yarns::laid(yarns, materials)),
            topology: Topology::default(),
            names: names.part(&nodes, &passages),
            borders,
            coupling,
            left_out,
            share,
            own,
            masses,
            follow,
        }))
    }

    /// The cloth without the triangles that the yarns stand for.
    pub(super) fn rest_of(&self, garment: &Garment, mesh: &GarmentMesh) -> Result<Cloth> {
        let kept: Vec<usize> = (0..self.left_out.len())
            .filter(|t| !self.left_out[*t])
            .collect();
        let share: Vec<[f64; 2]> = kept.iter().map(|t| self.share[*t]).collect();
        let own: Vec<f64> = kept.iter().map(|t| self.own[*t]).collect();
        let masses: Vec<_> = kept.iter().map(|t| self.masses[*t]).collect();
        let mesh = mesh.without_triangles(&self.left_out);
        Cloth::covered(garment, mesh, share, own, &masses)
    }

    /// Adds the nodes, where the panels are placed, to a state of the vertices.
    pub(super) fn place(&self, garment: &Garment, state: &mut State) {
        let mesh = &self.now.mesh;
        for node in 0..mesh.uv.len() {
            let placement = &garment.panels[mesh.node_panel[node] as usize].placement;
            let (uv, lift) = (mesh.uv[node], mesh.lift[node]);
            let local = Vec3::new(uv.x, uv.y, lift);
            state
                .positions
                .push(placement.rotation * local + placement.translation);
            state.velocities.push(Vec3::zeros());
        }
        state.u = mesh.incidences.iter().map(|i| i.u).collect();
        state.u_rates = vec![0.0; mesh.incidences.len()];
        state.sliding = vec![false; mesh.incidences.len()];
        state.strands = loose(mesh, &state.u);
        state.yarn_normals = vec![Vec3::zeros(); mesh.uv.len()];
        // vertices stay exactly where they are placed: a drape asks whether they do
        self.coupling.carry(&mut state.positions);
    }

    /// Puts points where their coupling has them and lets vertices follow.
    pub(super) fn carry(&self, state: &mut State) {
        let first = state.positions.len() - self.now.mesh.uv.len();
        for values in [&mut state.positions, &mut state.velocities] {
            // constraints hold already: projected again, states that did not change would
            self.coupling.riders.carry(values);
            let (vertices, nodes) = values.split_at_mut(first);
            self.follow.apply(nodes, vertices);
        }
    }

    /// Puts the nodes where the vertices say.
    pub(super) fn take(&self, mesh: &GarmentMesh, state: &mut State) -> Result<()> {
        let first = mesh.uv.len();
        let [x, v] = [&state.positions[..first], &state.velocities[..first]];
        let (places, rates) = carried_along(mesh, x, v, &self.now.mesh)?;
        for (values, nodes) in [
            (&mut state.positions, places),
            (&mut state.velocities, rates),
        ] {
            values.truncate(first);
            values.extend(nodes);
            self.coupling.carry(values);
        }
        Ok(())
    }

    /// Whether hosts may hold a point; nodes are counted on after `first`.
    pub(super) fn lets_hold(&self, point: u32, first: u32) -> bool {
        let Some(node) = point.checked_sub(first) else {
            return !self.follows(point);
        };
        let placed = self
            .coupling
            .filter
            .as_ref()
            .is_some_and(|f| f.places(point));
        let passed = !self.now.mesh.stack(node as usize).is_empty();
        passed && !placed && !self.coupling.riders.rides(point)
    }

    /// Nodes along an edge of a panel that yarns pass, those that came out of laid ones there among them.
    pub(super) fn along(&self, panel: u32, edge: u32) -> Vec<u32> {
        let mesh = &self.now.mesh;
        let laid = mesh.uv.len() - self.now.split.len();
        let origin = |n: u32| match (n as usize).checked_sub(laid) {
            Some(split) => self.now.split[split],
            None => n,
        };
        let borders = |node: u32| {
            let border = Border { panel, edge, node };
            self.borders.binary_search(&border).is_ok()
        };
        (0..mesh.uv.len() as u32)
            .filter(|n| !mesh.stack(*n as usize).is_empty() && borders(origin(*n)))
            .collect()
    }

    /// Whether a vertex follows.
    pub(super) fn follows(&self, vertex: u32) -> bool {
        let bare = |f: &Arc<Filter>| f.bare().binary_search(&vertex).is_ok();
        self.follow.vertices.binary_search(&vertex).is_ok()
            || self.coupling.filter.as_ref().is_some_and(bare)
    }
}

/// What is not as laid.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct YarnChanges {
    /// Laid passages of yarns through nodes that are gone.
    pub passages_gone: usize,
    /// Nodes that came out of others, counted on after the laid ones.
    pub nodes_split: usize,
    /// Nodes that no yarn passes any more.
    pub nodes_left: usize,
}

impl Sim {
    /// The yarns as they pass their nodes now, if there are any; coordinates are those of the layout.
    pub fn yarns(&self) -> Option<&YarnMesh> {
        self.yarns.as_ref().map(|part| &part.now.mesh)
    }

    /// Positions of the yarns' nodes [m].
    pub fn yarn_nodes(&self) -> &[Vec3] {
        &self.state.positions[self.mesh.uv.len()..]
    }

    /// Material coordinate of every incidence [m].
    pub fn yarn_coordinates(&self) -> &[f64] {
        &self.state.u
    }

    /// Unit normal at each node from the back to the front of the cloth; that of the placed panel where
    /// no step has told it yet, zero at nodes of one yarn.
    pub fn yarn_normals(&self) -> Vec<Vec3> {
        let Some(mesh) = self.yarns() else {
            return Vec::new();
        };
        let panel = |n: usize| &self.garment.panels[mesh.node_panel[n] as usize];
        (self.state.yarn_normals.iter().enumerate())
            .map(|(n, known)| {
                if mesh.stack(n).len() > 1 && *known == Vec3::zeros() {
                    panel(n).placement.rotation * Vec3::z()
                } else {
                    *known
                }
            })
            .collect()
    }

    /// Where the points of each yarn begin in its curves of `samples` pieces to a segment, one after the other; the last is
    /// their number.
    pub fn yarn_curve_offsets(&self, samples: usize) -> Result<Vec<u32>> {
        let mut offsets = vec![0];
        let mut total = 0_usize;
        for range in self.yarns().map_or(&[][..], |mesh| &mesh.starts).windows(2) {
            total += (range[1] - range[0] - 1) as usize * samples + 1;
            offsets.push(u32::try_from(total).map_err(|_| {
                Error::limit(format!(
                    "yarns of {samples} pieces to a segment have more than {} points",
                    u32::MAX
                ))
            })?);
        }
        Ok(offsets)
    }

    /// Radius of each yarn [m].
    pub fn yarn_radii(&self) -> Vec<f64> {
        self.yarns.as_ref().map_or_else(Vec::new, |part| {
            let yarns = 0..part.now.mesh.yarn_count();
            yarns.map(|y| part.now.material(y).radius).collect()
        })
    }

    /// Panel in which each yarn was laid.
    pub fn yarn_panels(&self) -> Vec<u32> {
        self.yarns().map_or_else(Vec::new, |mesh| {
            let yarns = 0..mesh.yarn_count();
            yarns.map(|y| mesh.panel_of(y) as u32).collect()
        })
    }

    /// Smooth centre lines of the yarns, `samples` pieces to a segment.
    pub fn yarn_curves(&self, samples: usize) -> Vec<Curve> {
        let Some(part) = &self.yarns else {
            return Vec::new();
        };
        let radius = |y| part.now.material(y).radius;
        let normals = self.yarn_normals();
        curves(&part.now.mesh, self.yarn_nodes(), &normals, radius, samples)
    }

    /// Tension between each incidence and the next of its yarn [N]; 0 at the last, and where triangles
    /// stand for the yarn.
    pub fn yarn_tensions(&self) -> Vec<f64> {
        let Some(part) = &self.yarns else {
            return Vec::new();
        };
        let (mesh, x) = (&part.now.mesh, self.yarn_nodes());
        let mut out = vec![0.0; mesh.incidences.len()];
        for y in 0..mesh.yarn_count() {
            let stiffness = part.now.material(y).stretch;
            for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
                let nodes = [i - 1, i].map(|i| mesh.incidences[i].node);
                if !mesh.reaches(&nodes) {
                    continue;
                }
                let [a, b] = nodes.map(|n| x[n as usize]);
                let du = self.state.u[i] - self.state.u[i - 1];
                out[i - 1] = stiffness * ((b - a).norm() / du - 1.0);
            }
        }
        out
    }

    /// Largest normal force between two yarns at each node in the last accepted step [N].
    pub fn yarn_compressions(&self) -> Vec<f64> {
        let Some(mesh) = self.yarns() else {
            return Vec::new();
        };
        (0..mesh.uv.len())
            .map(|n| {
                let range = mesh.stack_starts[n] as usize..mesh.stack_starts[n + 1] as usize;
                self.state.strands[range]
                    .iter()
                    .map(|s| s.contact)
                    .fold(0.0, f64::max)
            })
            .collect()
    }

    /// How far each yarn has slid at its incidences since it was laid [m].
    pub fn yarn_slips(&self) -> Vec<f64> {
        let laid = self.yarns().map_or(&[][..], |mesh| &mesh.incidences);
        let moved = |(u, laid): (&f64, &Incidence)| u - laid.u;
        self.state.u.iter().zip(laid).map(moved).collect()
    }

    /// For each vertex whether it moves by itself; the others follow yarns.
    pub fn active_vertices(&self) -> Vec<bool> {
        let count = self.mesh.uv.len() as u32;
        let follows = |v| self.yarns.as_ref().is_some_and(|part| part.follows(v));
        (0..count).map(|v| !follows(v)).collect()
    }

    /// For each node of the yarns whether it moves by itself; triangles carry the others.
    pub fn active_yarn_nodes(&self) -> Vec<bool> {
        let nodes = self.mesh.uv.len() as u32..self.state.positions.len() as u32;
        let rides = |n| {
            self.yarns
                .as_ref()
                .is_some_and(|part| part.coupling.riders.rides(n))
        };
        nodes.map(|n| !rides(n)).collect()
    }

    /// Grows whenever yarns have left contacts, or have come back to them with an earlier state, and when regions change: the
    /// numbers of passages change then, and nodes come in. 0 where there never were yarns.
    pub fn yarn_epoch(&self) -> u64 {
        self.yarn_epoch
    }

    /// Numbers of what has changed since the yarns were laid.
    pub fn yarn_changes(&self) -> YarnChanges {
        let left = self.yarns().map_or(0, |mesh| {
            (0..mesh.uv.len())
                .filter(|n| mesh.stack(*n).is_empty())
                .count()
        });
        YarnChanges {
            passages_gone: self.state.topology.gone(),
            nodes_split: self.state.topology.split.len(),
            nodes_left: left,
        }
    }

    /// Takes the yarns of a state whose topology is another one.
    pub(super) fn take_yarns(&mut self) -> Result<()> {
        let Some(part) = &mut self.yarns else {
            return Ok(());
        };
        if part.topology != self.state.topology {
            let mut engine = self.engine.lock().unwrap_or_else(PoisonError::into_inner);
            engine.take_contacts(&self.state)?;
            if let Some(now) = &engine.system.yarns {
                part.now = now.clone();
            }
            part.topology.clone_from(&self.state.topology);
            self.yarn_epoch += 1;
        }
        Ok(())
    }

    /// Refuses coordinates that do not grow along every yarn.
    pub(super) fn check_coordinates(&self) -> Result<()> {
        let u = &self.state.u;
        let starts = self.yarns().map_or(&[][..], |mesh| &mesh.starts);
        for (y, range) in starts.windows(2).enumerate() {
            let yarn = &u[range[0] as usize..range[1] as usize];
            if let Some(i) = yarn.windows(2).position(|w| !(w[1] > w[0])) {
                return Err(Error::parse(format!(
                    "yarn {y}: u goes from {} to {} m after passage {i}",
                    yarn[i],
                    yarn[i + 1]
                )));
            }
        }
        Ok(())
    }

    /// Lets the vertices under yarns follow them.
    pub(super) fn carry_vertices(&mut self) {
        if let Some(part) = &self.yarns {
            part.carry(&mut self.state);
        }
    }
}
