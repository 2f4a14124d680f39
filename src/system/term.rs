//! The contract of an energy term.
//!
//! A term is a list of stencils (tuples of vertices, all of one arity) and pure functions of one
//! stencil. Loops, parallelism and scatter live in `assemble`.

use super::state::State;
use crate::body::Distance;
use crate::math::{Mat3, Vec2, Vec3};
use crate::pattern::Fabric;

/// Largest number of vertices in a stencil (a bending fan: a vertex and its ring).
pub const MAX_ARITY: usize = 16;
/// Blocks of the lower triangle of the largest stencil.
pub const MAX_BLOCKS: usize = MAX_ARITY * (MAX_ARITY + 1) / 2;

/// Which second derivative is wanted.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum HessianKind {
    /// Positive semi-definite blocks.
    Psd,
    /// The exact second derivative.
    Exact,
    /// Between the two: the semi-definite blocks and this part (0 to 1) of what they leave out. Where
    /// blocks are above what an energy with kinks has, so as to bound it, they stay so below 1.
    Part(f64),
}

impl HessianKind {
    /// Part of what the semi-definite blocks leave out: 0 for them, 1 for the exact derivative.
    pub fn exactness(self) -> f64 {
        match self {
            Self::Psd => 0.0,
            Self::Exact => 1.0,
            Self::Part(part) => part,
        }
    }
}

/// Where energies are evaluated.
#[derive(Clone, Copy)]
pub struct Configuration<'a> {
    /// Positions [m].
    pub x: &'a [Vec3],
    /// Positions at the start of the step [m].
    pub x0: &'a [Vec3],
    /// Material coordinate of every passage of a yarn at the start of the step [m]: the value of
    /// those that do not slide now. Empty without yarns.
    pub u: &'a [f64],
    /// One over the step size [1/s]; 0 in statics, where rate terms vanish.
    pub inv_dt: f64,
    /// The world at the end of the step.
    pub world: &'a World<'a>,
}

/// What surrounds the garment.
pub struct World<'a> {
    /// Acceleration of gravity [m/s^2].
    pub gravity: Vec3,
    /// Velocity of the air [m/s].
    pub wind: Vec3,
    /// Pressure of the inside on the outside, along the cloth's normal [Pa].
    pub pressure: f64,
    /// Bodies as they are at the end of the step.
    pub bodies: &'a dyn Bodies,
}

/// Bodies of the world as contacts see them, in world coordinates.
pub trait Bodies: Send + Sync {
    /// Number of bodies.
    fn count(&self) -> usize;
    /// Signed distance to a body at a world point, with world-frame derivatives.
    fn distance(&self, body: usize, point: &Vec3) -> Distance;
    /// Signed distance only.
    fn value(&self, body: usize, point: &Vec3) -> f64;
    /// Where the material point of the body that was at `point` at the start of the step is at
    /// its end.
    fn carried(&self, body: usize, point: &Vec3) -> Vec3;
    /// Contact settings of a body.
    fn contact(&self, body: usize) -> &ContactSettings;
}

/// How cloth meets one body.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
pub struct ContactSettings {
    /// Coulomb friction.
    pub friction: f64,
    /// Gap kept free between the body's surface and the cloth's middle surface [m].
    pub thickness: f64,
    /// Penalty: pressure per depth [Pa/m].
    pub stiffness: f64,
}

impl Default for ContactSettings {
    fn default() -> Self {
        Self {
            friction: 0.3,
            thickness: 3e-3,
            stiffness: 1e7,
        }
    }
}

/// A direction in the space of rest shapes and parameters.
pub struct RestChange<'a> {
    /// Rate of the flat coordinates of every vertex [m].
    pub uv: &'a [Vec2],
    /// Rate of every number of every fabric.
    pub fabrics: &'a [Fabric],
}

/// Stencils of a term: `vertices[arity * e ..][.. arity]` are the vertices of stencil `e`.
#[derive(Clone, Copy)]
pub struct Stencils<'a> {
    /// Vertices per stencil.
    pub arity: usize,
    /// All stencils, flat.
    pub vertices: &'a [u32],
}

impl<'a> Stencils<'a> {
    /// Number of stencils.
    pub fn count(&self) -> usize {
        self.vertices.len() / self.arity.max(1)
    }

    /// Vertices of one stencil.
    pub fn get(&self, e: usize) -> &'a [u32] {
        &self.vertices[self.arity * e..self.arity * (e + 1)]
    }
}

/// How much of a motion is admissible.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MaxStep {
    /// Part of the motion, 1 for all of it.
    pub part: f64,
    /// The two points between which no more is; equal where all is.
    pub points: [u32; 2],
}

impl Default for MaxStep {
    fn default() -> Self {
        Self {
            part: 1.0,
            points: [0; 2],
        }
    }
}

/// An energy (or lagged dissipation potential) as a sum over stencils.
///
/// `gradient` writes one vector, `hessian` writes the lower triangle of blocks row by row
/// (`(0,0), (1,0), (1,1), (2,0), ...`); both overwrite what is there. Block `(i, j)` is
/// `d^2 V / dx_i dx_j^T`.
pub trait Term: Send + Sync {
    /// Stable name, as in reports.
    fn name(&self) -> &'static str;
    /// Its stencils, known at build (contacts: after `begin_step`).
    fn stencils(&self) -> Stencils<'_>;
    /// Bytes of what it holds for its stencils.
    fn bytes(&self) -> usize;
    /// Energy of one stencil [J].
    fn value(&self, e: usize, at: &Configuration<'_>) -> f64;
    /// Its derivative by the stencil's positions [N].
    fn gradient(&self, e: usize, at: &Configuration<'_>, out: &mut [Vec3]);
    /// Its second derivative [N/m].
    fn hessian(&self, e: usize, at: &Configuration<'_>, kind: HessianKind, out: &mut [Mat3]);
    /// Gradient and Hessian together, for terms that save by it.
    fn derivatives(
        &self,
        e: usize,
        at: &Configuration<'_>,
        kind: HessianKind,
        gradient: &mut [Vec3],
        hessian: &mut [Mat3],
    ) {
        self.gradient(e, at, gradient);
        self.hessian(e, at, kind, hessian);
    }
    /// Directional derivative of `gradient` by rest shape and parameters.
    fn rest_gradient(
        &self,
        e: usize,
        at: &Configuration<'_>,
        change: &RestChange<'_>,
        out: &mut [Vec3],
    ) {
        let _ = (e, at, change);
        out.fill(Vec3::zeros());
    }
    /// Whether the term is zero in this configuration's world, wherever the vertices are.
    fn is_idle(&self, at: &Configuration<'_>) -> bool {
        let _ = at;
        false
    }
    /// Whether there is a Hessian of this kind; a linear energy has none.
    fn has_hessian(&self, kind: HessianKind) -> bool {
        let _ = kind;
        true
    }
    /// Whether the energy is internal: no net force, invariant under rotation and translation.
    fn is_internal(&self) -> bool {
        true
    }
    /// Takes what is lagged (normal forces, anchors, contact pairs) from the state. Returns true if
    /// the stencils changed.
    fn begin_step(&mut self, state: &State, at: &Configuration<'_>) -> bool {
        let _ = (state, at);
        false
    }
    /// How much of the motion from `x0` to `x` is admissible.
    fn max_step(&self, at: &Configuration<'_>) -> MaxStep {
        let _ = at;
        MaxStep::default()
    }
    /// Adds the force on a body and its torque about `origin` [N], [N m].
    fn add_wrench(
        &self,
        body: usize,
        at: &Configuration<'_>,
        origin: &Vec3,
        force: &mut Vec3,
        torque: &mut Vec3,
    ) {
        let _ = (body, at, origin, force, torque);
    }
    /// After an accepted step: moves friction anchors and other plastic state.
    fn accept(&mut self, at: &Configuration<'_>, state: &mut State) {
        let _ = (at, state);
    }
}

impl ContactSettings {
    /// Refuses numbers that are not finite or have a sign that cannot be.
    pub fn check(&self) -> crate::error::Result<()> {
        let rules = [
            ("friction", self.friction, self.friction >= 0.0),
            ("thickness", self.thickness, self.thickness >= 0.0),
            ("stiffness", self.stiffness, self.stiffness > 0.0),
        ];
        for (name, value, fine) in rules {
            if !(value.is_finite() && fine) {
                return Err(crate::error::Error::argument(format!(
                    "contact.{name} = {value} must be finite and not negative (stiffness: positive)"
                )));
            }
        }
        Ok(())
    }
}
