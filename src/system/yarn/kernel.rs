//! What an energy of yarns is: a function of the few scalars of one stencil.
//!
//! The scalars are the components of `POSITIONS` nodes [m] and then the material coordinates of up
//! to two incidences [m]; which of them are unknowns and where they stand in the system is the
//! business of the adapter. Damping is proportional to stiffness through the kernel's own measure
//! `m` of strain, `c/2 (m - m0)^2` with `c = beta/dt` times the stiffness at the start of the step: rigid
//! motion is not damped.

use super::super::state::State;
use crate::math::{Mat3, Vec3};

/// Largest number of nodes of a kernel.
pub const MAX_POSITIONS: usize = 4;
/// Largest number of material coordinates of a kernel.
pub const MAX_SLIDES: usize = 2;

/// Second derivatives by the scalars; only `[i][j]` with `j <= i` has meaning.
pub type Lower<const N: usize> = [[f64; N]; N];

/// One stencil's scalars and what acts on it.
#[derive(Clone, Copy)]
pub struct Local<'a, const N: usize> {
    /// Scalars now.
    pub q: &'a [f64; N],
    /// Scalars at the start of the step; zeros for a kernel that does not look back.
    pub q0: &'a [f64; N],
    /// Weight of the damping and the measure at the start of the step, [`Kernel::start`] of a kernel that is damped by it.
    pub start: Damped,
    /// One over the step size [1/s], 0 in statics.
    pub inv_dt: f64,
    /// Acceleration of gravity [m/s^2].
    pub gravity: Vec3,
}

/// Damping by a measure `m` of strain: `weight/2 (m - measure)^2`.
#[derive(Clone, Copy, Debug, Default)]
pub struct Damped {
    /// Weight [J] over the unit of the measure squared.
    pub weight: f64,
    /// The measure at the start of the step.
    pub measure: f64,
}

/// Node `k` of a list of scalars.
#[inline]
pub fn point<const N: usize>(q: &[f64; N], k: usize) -> Vec3 {
    Vec3::new(q[3 * k], q[3 * k + 1], q[3 * k + 2])
}

/// The energy of one stencil.
pub trait Kernel<const N: usize>: Send + Sync {
    /// Stable name of the term.
    const NAME: &'static str;
    /// Nodes; `N - 3 POSITIONS` material coordinates follow.
    const POSITIONS: usize;
    /// Whether the energy is linear in the positions and has no semi-definite part by what slides.
    const LINEAR: bool = false;
    /// Whether the energy is invariant under translation and rotation.
    const INTERNAL: bool = true;
    /// Whether it bounds the admissible part of a motion.
    const BOUNDS: bool = false;
    /// Whether it takes something from the State or leaves something there.
    const LAGGED: bool = false;
    /// Whether the scalars of the start of the step count in a step.
    const LOOKS_BACK: bool = false;
    /// Whether it is damped by what [`Self::start`] tells.
    const DAMPED: bool = false;

    /// Energy [J]; infinite where the stencil cannot be.
    fn value(&self, at: &Local<'_, N>) -> f64;
    /// Its derivative, overwriting `out`.
    fn gradient(&self, at: &Local<'_, N>, out: &mut [f64; N]);
    /// Its derivative, overwriting `gradient`, and its second derivative, added to the zeros in `hessian`:
    /// `H_psd + exactness (H_exact - H_psd)`.
    fn derivatives(
        &self,
        at: &Local<'_, N>,
        exactness: f64,
        gradient: &mut [f64; N],
        hessian: &mut Lower<N>,
    );
    /// Its damping in a step that begins at the scalars `q0`.
    fn start(&self, q0: &[f64; N], inv_dt: f64) -> Damped {
        let _ = (q0, inv_dt);
        Damped::default()
    }
    /// Whether there is no energy at this step size, wherever the nodes are.
    fn is_idle(inv_dt: f64) -> bool {
        let _ = inv_dt;
        false
    }
    /// Admissible part of the motion from `q0` to `q`.
    fn bound(&self, at: &Local<'_, N>) -> f64 {
        let _ = at;
        1.0
    }
    /// Takes what is lagged; `rates` are those of the scalars at the start of the step.
    fn begin(&mut self, at: &Local<'_, N>, rates: &[f64; N], state: &State) {
        let _ = (at, rates, state);
    }
    /// Leaves what the next step needs.
    fn accept(&self, at: &Local<'_, N>, state: &mut State) {
        let _ = (at, state);
    }
}

/// `out += k g g^T`.
#[inline]
pub fn add_square<const N: usize>(out: &mut Lower<N>, k: f64, g: &[f64; N]) {
    for i in 0..N {
        let left = k * g[i];
        for j in 0..=i {
            out[i][j] += left * g[j];
        }
    }
}

/// `out += k (g h^T + h g^T)`.
#[inline]
pub fn add_product<const N: usize>(out: &mut Lower<N>, k: f64, g: &[f64; N], h: &[f64; N]) {
    for i in 0..N {
        for j in 0..=i {
            out[i][j] += k * (g[i] * h[j] + h[i] * g[j]);
        }
    }
}

/// Adds `w_p w_r m` to the block of nodes `(p, r)`, for a symmetric `m`.
#[inline]
pub fn add_weighted<const N: usize, const P: usize>(out: &mut Lower<N>, w: &[f64; P], m: &Mat3) {
    for p in 0..P {
        for r in 0..=p {
            let k = w[p] * w[r];
            for i in 0..3 {
                for j in 0..3 {
                    out[3 * p + i][3 * r + j] += k * m[(i, j)];
                }
            }
        }
    }
}

/// Adds `m` to the block of nodes `(p, r)`, `r <= p`.
#[inline]
pub fn add_block<const N: usize>(out: &mut Lower<N>, p: usize, r: usize, m: &Mat3) {
    for i in 0..3 {
        for j in 0..3 {
            out[3 * p + i][3 * r + j] += m[(i, j)];
        }
    }
}

/// Writes `v` at node `p` of a gradient.
#[inline]
pub fn set_point<const N: usize>(out: &mut [f64; N], p: usize, v: &Vec3) {
    out[3 * p] = v.x;
    out[3 * p + 1] = v.y;
    out[3 * p + 2] = v.z;
}
