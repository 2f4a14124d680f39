//! Normal forces at contacts, and the elastic forces along the yarns there.
//!
//! A contact has no freedom along its normal, so its compression is estimated from equilibrium: with the
//! stretch, bending and wrapping forces of each yarn on a node, projected on the normal,
//! [`stack`](super::stack) gives the forces between neighbours in the stack (Cirio et al. 2017, section 4.3).
//!
//! * The normal is that of the plane fitted to a node and its neighbours along all its yarns. It points from the
//!   back of the stack to the front: as in the last step, and at first as the yarns cross in the flat panels.
//! * Yarns of radius `R` lie at `(2k - n - 1) R` along the normal. A segment pulls with its tension in the direction
//!   between these places, so that a planar weave presses its crossings together. The places enter nothing else.
//! * A wrapping spring's triangle of one wing loads the yarn of that wing.
//! * At a node that is held the reaction takes part.
//!
//! The force along a yarn at a contact, `-dV/du` of all but friction, says whether a contact that does not
//! slide would. SI units.

use super::super::state::StrandState;
use super::bending::Bending;
use super::kernel::{Damped, Kernel, Local};
use super::normals::{Plane, Turn};
use super::spacing::Spacing;
use super::stack::{MAX_STACK, StackRule, held_normal_forces, normal_forces};
use super::stitch::StitchLength;
use super::wrapping::Wrapping;
use super::{YarnOptions, material_of, springs};
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::parallel::Workers;
use crate::yarn::{Strand, YarnMaterial, YarnMesh};

const CHUNK: usize = 256;

/// What one incidence's segment and bend do to the yarn.
#[derive(Clone, Copy, Default)]
struct Load {
    /// Pull of the segment to the next incidence on this one [N].
    pull: Vec3,
    /// Force of that segment along the yarn on the next one, its negative on this one [N].
    slide: f64,
    /// Bending forces of this incidence on the one before and on the one after [N].
    bend: [Vec3; 2],
    /// Force of the bend along the yarn on the one after, its negative on the one before [N].
    bend_slide: f64,
}

struct Passage {
    node: u32,
    before: bool,
    after: bool,
    /// Offset along the node's normal [m].
    offset: f64,
    stretch: f64,
    bending: f64,
    density: f64,
}

struct WrapLoad {
    kernel: Wrapping,
    nodes: [u32; 4],
    /// Incidences at `(q0, q1, wing)` of the yarn of each wing.
    incidences: [[Option<u32>; 3]; 2],
}

/// Estimates compression; rest data and work memory.
pub struct Compression {
    passages: Vec<Passage>,
    stack_starts: Vec<u32>,
    stacks: Vec<Strand>,
    turns: Vec<Option<Turn>>,
    /// Nodes that are images of others in a periodic cell, which have only some of their neighbours.
    images: Vec<[u32; 2]>,
    wraps: Vec<WrapLoad>,
    stitches: Vec<([u32; 2], StitchLength)>,
    spacings: Vec<([u32; 2], Spacing)>,
    rule: StackRule,
    loads: Vec<Load>,
    wrap_loads: Vec<[[Vec3; 3]; 2]>,
    forces: Vec<Vec3>,
    sliding: Vec<f64>,
}

/// Positions and coordinates to estimate at.
#[derive(Clone, Copy)]
pub struct YarnPlace<'a> {
    /// Position of each node [m].
    pub x: &'a [Vec3],
    /// Material coordinate of each incidence [m].
    pub u: &'a [f64],
    /// Nodes that are held.
    pub held: &'a [bool],
    /// Acceleration of gravity [m/s^2].
    pub gravity: Vec3,
}

impl Compression {
    /// Rest data of the contacts of a mesh, whose yarn `y` is `materials[yarn_fabric[y]]`.
    pub fn new(
        mesh: &YarnMesh,
        materials: &[YarnMaterial],
        options: &YarnOptions,
        rule: StackRule,
    ) -> Result<Self> {
        let mut passages = Vec::with_capacity(mesh.incidences.len());
        let mut radii = Vec::with_capacity(mesh.incidences.len());
        for y in 0..mesh.yarn_count() {
            let m = material_of(mesh, materials, y)?;
            let yarn = mesh.yarn(y);
            for (k, incidence) in yarn.iter().enumerate() {
                radii.push(m.radius);
                passages.push(Passage {
                    node: incidence.node,
                    before: k > 0,
                    after: k + 1 < yarn.len(),
                    offset: 0.0,
                    stretch: m.stretch,
                    bending: m.bending,
                    density: m.density,
                });
            }
        }
        for node in 0..mesh.uv.len() {
            let stack = mesh.stack(node);
            if stack.len() > MAX_STACK {
                return Err(Error::argument(format!(
                    "node {node} has {} yarns, at most {MAX_STACK} can be stacked",
                    stack.len()
                )));
            }
            let mut height = 0.0;
            for (k, strand) in stack.iter().enumerate() {
                let i = strand.incidence as usize;
                if k > 0 {
                    height += radii[stack[k - 1].incidence as usize] + radii[i];
                }
                passages[i].offset = height;
            }
            for strand in stack {
                passages[strand.incidence as usize].offset -= 0.5 * height;
            }
        }
        let turns = (0..mesh.uv.len())
            .map(|node| Turn::new(mesh, node))
            .collect();
        let wraps: Vec<WrapLoad> = springs::wraps(mesh, materials, options)?
            .into_iter()
            .map(|s| WrapLoad {
                incidences: [0, 1].map(|k| wrapped(&passages, &s.nodes, s.incidences[k], k)),
                nodes: s.nodes,
                kernel: s.kernel,
            })
            .collect();
        let node = |i: u32| mesh.incidences[i as usize].node;
        let images = mesh.images.iter().map(|i| [node(i.incidence), node(i.of)]);
        let images = images.collect();
        let n = passages.len();
        Ok(Self {
            stack_starts: mesh.stack_starts.clone(),
            stacks: mesh.stacks.clone(),
            turns,
            images,
            wrap_loads: vec![[[Vec3::zeros(); 3]; 2]; wraps.len()],
            wraps,
            stitches: springs::stitches(mesh, materials)?
                .into_iter()
                .map(|s| (s.incidences, s.kernel))
                .collect(),
            spacings: springs::spacings(mesh, materials)?
                .into_iter()
                .map(|s| (s.incidences, s.kernel))
                .collect(),
            passages,
            rule,
            loads: vec![Load::default(); n],
            forces: vec![Vec3::zeros(); n],
            sliding: vec![0.0; n],
        })
    }

    /// Estimates the normals of all nodes (zero: not known yet; nodes with one yarn have none) and the
    /// normal force of each strand with the next one of its stack, 0 for the last.
    pub fn update(
        &mut self,
        at: &YarnPlace<'_>,
        workers: &Workers,
        normals: &mut [Vec3],
        strands: &mut [StrandState],
    ) {
        workers.chunks(normals, CHUNK, |c, chunk| {
            for (k, normal) in chunk.iter_mut().enumerate() {
                *normal = self.normal(c * CHUNK + k, at.x, normal);
            }
        });
        for [image, of] in &self.images {
            normals[*image as usize] = normals[*of as usize];
        }
        let mut loads = std::mem::take(&mut self.loads);
        workers.chunks(&mut loads, CHUNK, |c, chunk| {
            for (k, load) in chunk.iter_mut().enumerate() {
                *load = self.load(c * CHUNK + k, at, normals);
            }
        });
        self.loads = loads;
        let mut wrap_loads = std::mem::take(&mut self.wrap_loads);
        workers.chunks(&mut wrap_loads, CHUNK, |c, chunk| {
            for (k, load) in chunk.iter_mut().enumerate() {
                let wrap = &self.wraps[c * CHUNK + k];
                *load = wrap.kernel.sides(&wrap.nodes.map(|n| at.x[n as usize]));
            }
        });
        self.wrap_loads = wrap_loads;
        self.gather();
        self.slide(at);
        for node in 0..self.stack_starts.len() - 1 {
            self.press(node, at.held[node], &normals[node], strands);
        }
    }

    /// Force along the yarn at each incidence, `-dV/du` without friction [N], of the last update.
    pub fn sliding_forces(&self) -> &[f64] {
        &self.sliding
    }

    /// Elastic force of its yarn on the node of each incidence [N], of the last update.
    pub fn forces(&self) -> &[Vec3] {
        &self.forces
    }

    fn stack(&self, node: usize) -> &[Strand] {
        &self.stacks[self.stack_starts[node] as usize..self.stack_starts[node + 1] as usize]
    }

    fn normal(&self, node: usize, x: &[Vec3], last: &Vec3) -> Vec3 {
        let stack = self.stack(node);
        if stack.len() < 2 {
            return Vec3::zeros();
        }
        let mut plane = Plane::new(x[node]);
        for strand in stack {
            let i = strand.incidence as usize;
            if self.passages[i].before {
                plane.add(&x[self.passages[i - 1].node as usize]);
            }
            if self.passages[i].after {
                plane.add(&x[self.passages[i + 1].node as usize]);
            }
        }
        let normal = plane.normal();
        let reference = if *last == Vec3::zeros() {
            self.turns[node].as_ref().map_or(normal, |t| t.front(x))
        } else {
            *last
        };
        if normal.dot(&reference) < 0.0 {
            -normal
        } else {
            normal
        }
    }

    fn load(&self, i: usize, at: &YarnPlace<'_>, normals: &[Vec3]) -> Load {
        let here = &self.passages[i];
        let mut load = Load::default();
        if !here.after {
            return load;
        }
        let next = &self.passages[i + 1];
        let (x0, x1) = (at.x[here.node as usize], at.x[next.node as usize]);
        let du = at.u[i + 1] - at.u[i];
        let stretch = (x1 - x0).norm() / du;
        let apart = x1 + normals[next.node as usize] * next.offset
            - x0
            - normals[here.node as usize] * here.offset;
        let length = apart.norm();
        if length > 0.0 {
            load.pull = apart * (here.stretch * (stretch - 1.0) / length);
        }
        load.slide = 0.5 * here.stretch * (stretch * stretch - 1.0)
            + 0.5 * here.density * at.gravity.dot(&(x0 + x1));
        if here.before {
            let x = at.x[self.passages[i - 1].node as usize];
            let q = [
                x.x,
                x.y,
                x.z,
                x0.x,
                x0.y,
                x0.z,
                x1.x,
                x1.y,
                x1.z,
                at.u[i - 1],
                at.u[i + 1],
            ];
            let bend = Bending {
                stiffness: here.bending,
                damping: 0.0,
            };
            let mut g = [0.0; 11];
            bend.gradient(&still(&q), &mut g);
            load.bend = [-Vec3::new(g[0], g[1], g[2]), -Vec3::new(g[6], g[7], g[8])];
            load.bend_slide = -g[10];
        }
        load
    }

    /// Forces of each incidence's yarn on its node.
    fn gather(&mut self) {
        for (i, passage) in self.passages.iter().enumerate() {
            let own = &self.loads[i];
            let mut force = own.pull - own.bend[0] - own.bend[1];
            if passage.before {
                let before = &self.loads[i - 1];
                force += before.bend[1] - before.pull;
            }
            if passage.after {
                force += self.loads[i + 1].bend[0];
            }
            self.forces[i] = force;
        }
        for (wrap, loads) in self.wraps.iter().zip(&self.wrap_loads) {
            for (incidences, loads) in wrap.incidences.iter().zip(loads) {
                for (incidence, load) in incidences.iter().zip(loads) {
                    if let Some(i) = incidence {
                        self.forces[*i as usize] -= load;
                    }
                }
            }
        }
    }

    fn slide(&mut self, at: &YarnPlace<'_>) {
        for (i, passage) in self.passages.iter().enumerate() {
            let own = &self.loads[i];
            let mut force = -own.slide;
            if passage.before {
                force += self.loads[i - 1].slide + self.loads[i - 1].bend_slide;
            }
            if passage.after {
                force -= self.loads[i + 1].bend_slide;
            }
            self.sliding[i] = force;
        }
        for (incidences, kernel) in &self.stitches {
            along(incidences, kernel, at.u, &mut self.sliding);
        }
        for (incidences, kernel) in &self.spacings {
            along(incidences, kernel, at.u, &mut self.sliding);
        }
    }

    fn press(&self, node: usize, held: bool, normal: &Vec3, strands: &mut [StrandState]) {
        let stack = self.stack(node);
        let n = stack.len();
        if n == 0 {
            return;
        }
        let mut b = [0.0; MAX_STACK];
        for (b, strand) in b.iter_mut().zip(stack) {
            *b = normal.dot(&self.forces[strand.incidence as usize]);
        }
        let mut lambda = [0.0; MAX_STACK];
        if held && n > 1 {
            held_normal_forces(&b[..n], self.rule, &mut lambda[..n - 1]);
        } else {
            normal_forces(&b[..n], self.rule, &mut lambda[..n - 1]);
        }
        let first = self.stack_starts[node] as usize;
        for (k, strand) in strands[first..first + n].iter_mut().enumerate() {
            strand.contact = lambda[k];
        }
    }
}

fn still<const N: usize>(q: &[f64; N]) -> Local<'_, N> {
    Local {
        q,
        q0: q,
        start: Damped::default(),
        inv_dt: 0.0,
        gravity: Vec3::zeros(),
    }
}

fn along(incidences: &[u32; 2], kernel: &impl Kernel<2>, u: &[f64], out: &mut [f64]) {
    let q = incidences.map(|i| u[i as usize]);
    let mut g = [0.0; 2];
    kernel.gradient(&still(&q), &mut g);
    for (i, g) in incidences.iter().zip(g) {
        out[*i as usize] -= g;
    }
}

/// Incidences of the yarn of wing `k` at `q0`, `q1` and the wing's end.
fn wrapped(passages: &[Passage], nodes: &[u32; 4], wing: u32, k: usize) -> [Option<u32>; 3] {
    let (near, far) = if k == 0 { (0, 1) } else { (1, 0) };
    let w = wing as usize;
    let at = |i: Option<usize>, node: u32| i.filter(|&i| passages[i].node == node);
    let mut out = [None, None, Some(wing)];
    let up = passages[w].after.then_some(w + 1);
    let down = passages[w].before.then(|| w - 1);
    if let Some(i) = at(up, nodes[near]) {
        out[near] = Some(i as u32);
        let next = passages[i].after.then_some(i + 1);
        out[far] = at(next, nodes[far]).map(|i| i as u32);
    } else if let Some(i) = at(down, nodes[near]) {
        out[near] = Some(i as u32);
        let next = passages[i].before.then(|| i - 1);
        out[far] = at(next, nodes[far]).map(|i| i as u32);
    }
    out
}
