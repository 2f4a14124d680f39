//! Cloth against cloth: spheres on the vertices press each other apart and rub.
//!
//! For a pair at `w = x_b - x_a + c`, `d = |w|`, `d0 = r_a + r_b`:
//!
//! * Pressure: `V = 1/2 k (d0 - d)^2` for `d < d0`, else 0. `k` is the stiffness [Pa/m] times the
//!   mean of the two vertex areas. The force is continuous. Exact Hessian by `x_b`:
//!   `k n n^T - k (d0 - d) / d (I - n n^T)`; the second part is never positive and is left out of the
//!   semi-definite one.
//! * Friction is that of [`friction`](super::friction), with the tangential offset
//!   `s = (I - n0 n0^T) (x_b - x_a - o)` from the anchor `o` and the direction `n0` at the start of the
//!   step. A pair rubs from its second step on. The anchor does not turn with the cloth: a fold
//!   turning as a whole feels friction up to the same bound.
//!
//! A pair that overlaps without having come there in steps (panels placed on one another) has no
//! business with `d0` yet: in motion it presses from the distance that it is found at, and that
//! distance grows to `d0` by `SEPARATION`. The whole of the energy at once would become speed.
//!
//! `c` is zero except for pairs that meet in a plane: coincident panels have no side to be pushed
//! to. Then `c` points along the outside normal of the cloth at `a` (or against it, where `b` already
//! is on that side by 0.001 `d0`), 0.02 `d0` long: enough for the forces to have a way out, and the same
//! way for all neighbours, however a relaxation disturbs them. Nodes of yarns have it only where they are nearer than that.
//!
//! Spheres do not slip off each other's cloth as planes would: layers feel a bumpy surface, with
//! bumps of the order of the square of the edge length over the radius. Layers lie `d0` apart at
//! most. Crossed cloth is not uncrossed.

use super::friction::{Friction, kept};
use super::spheres::{Grid, Spheres};
use super::travel::{self, COINCIDENT};
use crate::cloth::Cloth;
use crate::error::{Error, Result};
use crate::math::{Mat3, Vec3};
use crate::system::points::Points;
use crate::system::state::{PairAnchor, State};
use crate::system::term::{Configuration, HessianKind, MaxStep, Stencils, Term};
use crate::yarn::Yarns;

/// Reserve of the spheres, see [`Spheres`].
pub const RESERVE: f64 = 0.15;
/// Height of `w` over the tangent plane, by `d0`, below which a pair counts as meeting in a plane.
const FLAT: f64 = 0.02;
/// Part of a radius that a vertex may move in a step beside what its velocity tells.
const SLACK: f64 = 0.15;

/// Speed at which pairs that began in each other are pushed apart [m/s].
const SEPARATION: f64 = 0.1;

/// One pair of spheres.
#[derive(Clone, Copy, Debug)]
struct Pair {
    /// Distance that it presses from: `d0`, or less while it is separated [m].
    distance: f64,
    /// `k` [N/m].
    stiffness: f64,
    /// `c` [m].
    bias: Vec3,
    /// `n0`, at the start of the step.
    normal: Vec3,
    /// `o` [m].
    anchor: Vec3,
    friction: Option<Friction>,
}

/// The term.
pub struct SelfContact {
    spheres: Spheres,
    triangles: Vec<[u32; 3]>,
    areas: Vec<f64>,
    stiffness: f64,
    friction: f64,
    stencils: Vec<u32>,
    pairs: Vec<Pair>,
    // Work memory of `begin_step`.
    grid: Grid,
    reach: Vec<f64>,
    normals: Vec<Vec3>,
    found: Vec<[u32; 2]>,
}

impl SelfContact {
    /// `stiffness` is pressure per depth [Pa/m], `friction` Coulomb's.
    pub fn new(
        cloth: &Cloth,
        points: &Points,
        yarns: Option<&Yarns>,
        stiffness: f64,
        friction: f64,
    ) -> Result<Self> {
        for (what, value) in [("stiffness", stiffness), ("friction", friction)] {
            if !(value.is_finite() && value >= 0.0) {
                return Err(Error::argument(format!(
                    "{what} of cloth on cloth {value} must not be negative"
                )));
            }
        }
        Ok(Self {
            spheres: Spheres::new(cloth, points, yarns, RESERVE)?,
            triangles: cloth.mesh.triangles.clone(),
            areas: points.areas.clone(),
            stiffness,
            friction,
            stencils: Vec::new(),
            pairs: Vec::new(),
            grid: Grid::default(),
            reach: Vec::new(),
            normals: Vec::new(),
            found: Vec::new(),
        })
    }

    /// Radii and excluded pairs.
    pub fn spheres(&self) -> &Spheres {
        &self.spheres
    }

    /// Largest part (0 to 1) of the way from `x0` to `x` on which no cloth can have passed through
    /// cloth.
    pub fn max_travel(&self, x0: &[Vec3], x: &[Vec3]) -> MaxStep {
        let count = self.spheres.radii.len();
        travel::max_travel(&self.spheres, &x0[..count], &x[..count])
    }

    /// Bytes held.
    pub fn bytes(&self) -> usize {
        self.spheres.bytes()
            + self.grid.bytes()
            + 12 * self.triangles.len()
            + 8 * (self.areas.len() + self.reach.len() + self.found.len())
            + 24 * self.normals.len()
            + 4 * self.stencils.len()
            + size_of::<Pair>() * self.pairs.len()
    }

    /// `w`, its length and its direction; along the bias, or the lagged normal, where `w` vanishes.
    fn offset(&self, e: usize, x: &[Vec3]) -> (f64, Vec3) {
        let pair = &self.pairs[e];
        let w = self.plain_offset(e, x) + pair.bias;
        let d = w.norm();
        if d > 1e-12 * pair.distance {
            (d, w / d)
        } else {
            (d, pair.normal)
        }
    }

    fn plain_offset(&self, e: usize, x: &[Vec3]) -> Vec3 {
        x[self.stencils[2 * e + 1] as usize] - x[self.stencils[2 * e] as usize]
    }

    /// Friction and the tangential offset from the anchor.
    fn rub(&self, e: usize, x: &[Vec3]) -> Option<(&Friction, Vec3)> {
        let pair = &self.pairs[e];
        let friction = pair.friction.as_ref()?;
        Some((
            friction,
            friction.slip(&(self.plain_offset(e, x) - pair.anchor)),
        ))
    }

    /// Outside normals at the vertices, weighted by area; zero where there is none.
    fn update_normals(&mut self, x: &[Vec3]) {
        self.normals.clear();
        self.normals.resize(x.len(), Vec3::zeros());
        for &t in &self.triangles {
            let [a, b, c] = t.map(|v| x[v as usize]);
            let n = (b - a).cross(&(c - a));
            for v in t {
                self.normals[v as usize] += n;
            }
        }
        for n in &mut self.normals {
            *n = n.try_normalize(1e-30).unwrap_or_else(Vec3::zeros);
        }
    }

    /// Pairs that may touch within the step, sorted.
    fn find_pairs(&mut self, state: &State, dt: f64) {
        let (x, v) = (&state.positions, &state.velocities);
        let mean = v.iter().sum::<Vec3>() / (v.len().max(1) as f64);
        self.reach.clear();
        for (r, v) in self.spheres.radii.iter().zip(v) {
            let travel = 1.5 * (v - mean).norm() * dt + SLACK * r;
            self.reach.push(r + travel.min(*r));
        }
        let (spheres, found) = (&self.spheres, &mut self.found);
        found.clear();
        self.grid.pairs(x, &self.reach, |a, b| {
            let [ra, rb] = [a, b].map(|i| spheres.radii[i as usize]);
            let approach = 1.5 * (v[b as usize] - v[a as usize]).norm() * dt;
            let margin = (approach + SLACK * (ra + rb)).min(ra + rb);
            let far = ra + rb + margin;
            if (x[b as usize] - x[a as usize]).norm_squared() < far * far && !spheres.excluded(a, b)
            {
                found.push([a, b]);
            }
        });
        found.sort_unstable();
    }

    /// A pair at the start of a step of `dt` [s], 0 in statics.
    fn pair(&self, [a, b]: [u32; 2], x: &[Vec3], anchor: Option<&PairAnchor>, dt: f64) -> Pair {
        let distance = self.spheres.rest_distance(a, b);
        let w = x[b as usize] - x[a as usize];
        // nodes of yarns have no side: they meet in a plane only where they coincide
        let (outside, height) = match self.normals[a as usize] {
            n if n == Vec3::zeros() => (Vec3::y(), w.norm()),
            n => (n, w.dot(&n)),
        };
        let bias = if height.abs() < FLAT * distance && w.norm() < distance {
            let below = height < -COINCIDENT * distance;
            outside * (FLAT * distance * if below { -1.0 } else { 1.0 })
        } else {
            Vec3::zeros()
        };
        let stiffness = self.stiffness * 0.5 * (self.areas[a as usize] + self.areas[b as usize]);
        let normal = (w + bias).try_normalize(1e-300).unwrap_or(outside);
        let from = anchor.map_or((w + bias).norm(), |p| p.rest);
        Pair {
            distance: if dt > 0.0 {
                distance.min(from + SEPARATION * dt)
            } else {
                distance
            },
            stiffness,
            bias,
            normal,
            anchor: anchor.map_or(w, |p| p.offset),
            friction: anchor
                .and_then(|p| Friction::new(normal, self.friction * p.normal_force, stiffness)),
        }
    }
}

impl Term for SelfContact {
    fn name(&self) -> &'static str {
        "self_contact"
    }

    fn stencils(&self) -> Stencils<'_> {
        Stencils {
            arity: 2,
            vertices: &self.stencils,
        }
    }

    fn bytes(&self) -> usize {
        size_of_val(&self.stencils[..])
            + size_of_val(&self.pairs[..])
            + size_of_val(&self.normals[..])
    }

    fn value(&self, e: usize, at: &Configuration<'_>) -> f64 {
        let pair = &self.pairs[e];
        let (d, _) = self.offset(e, at.x);
        let depth = (pair.distance - d).max(0.0);
        let mut energy = 0.5 * pair.stiffness * depth * depth;
        if let Some((friction, s)) = self.rub(e, at.x) {
            energy += friction.energy(&s);
        }
        energy
    }

    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]) {
        let pair = &self.pairs[e];
        let (d, n) = self.offset(e, at.x);
        let mut g = n * (-pair.stiffness * (pair.distance - d).max(0.0));
        if let Some((friction, s)) = self.rub(e, at.x) {
            g += friction.force(&s);
        }
        out[0] = -g;
        out[1] = g;
    }

    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]) {
        let pair = &self.pairs[e];
        let k = pair.stiffness;
        let (d, n) = self.offset(e, at.x);
        let mut h = Mat3::zeros();
        if d < pair.distance {
            let along = n * n.transpose();
            h += along * k;
            // At d = 0 the force has no derivative; the part that would be infinite is left out.
            if d > 1e-12 * pair.distance {
                let bend = kind.exactness() * k * (pair.distance - d) / d;
                h -= (Mat3::identity() - along) * bend;
            }
        }
        if let Some((friction, s)) = self.rub(e, at.x) {
            h += friction.hessian(&s);
        }
        out[0] = h;
        out[1] = -h;
        out[2] = h;
    }

    /// Friction anchors do not turn with the cloth.
    fn max_step(&self, at: &Configuration<'_>) -> MaxStep {
        self.max_travel(at.x0, at.x)
    }

    fn is_internal(&self) -> bool {
        false
    }

    fn begin_step(&mut self, state: &State, at: &Configuration<'_>) -> bool {
        let dt = if at.inv_dt > 0.0 {
            1.0 / at.inv_dt
        } else {
            0.0
        };
        self.spheres.follow(&state.u);
        self.update_normals(&state.positions);
        self.find_pairs(state, dt);
        let changed = self.stencils.as_slice() != self.found.as_flattened();
        if changed {
            self.stencils.clear();
            self.stencils.extend_from_slice(self.found.as_flattened());
        }
        let found = std::mem::take(&mut self.found);
        self.pairs.clear();
        let mut anchors = state.pair_anchors.iter().peekable();
        for &[a, b] in &found {
            while anchors.next_if(|p| (p.a, p.b) < (a, b)).is_some() {}
            let anchor = anchors.next_if(|p| (p.a, p.b) == (a, b));
            self.pairs
                .push(self.pair([a, b], &state.positions, anchor, dt));
        }
        self.found = found;
        changed
    }

    fn accept(&mut self, at: &Configuration<'_>, state: &mut State) {
        state.pair_anchors.clear();
        for e in 0..self.pairs.len() {
            let pair = &self.pairs[e];
            let (d, _) = self.offset(e, at.x);
            if d >= pair.distance {
                continue;
            }
            let w = self.plain_offset(e, at.x);
            let normal_force = pair.stiffness * (pair.distance - d);
            let mut offset = w;
            if let Some((_, s)) = self.rub(e, at.x) {
                offset -= kept(&s, self.friction * normal_force, pair.stiffness);
            }
            state.pair_anchors.push(PairAnchor {
                a: self.stencils[2 * e],
                b: self.stencils[2 * e + 1],
                offset,
                normal_force,
                rest: pair.distance,
            });
        }
    }
}
