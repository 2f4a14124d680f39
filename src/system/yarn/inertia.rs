//! Inertia of a segment whose material slides through its ends.
//!
//! The material at `u = (1 - a) u0 + a u1` moves with `v = (1 - a) V0 + a V1`, `V_k = x_k' - w u_k'`,
//! `w = (x1 - x0)/du`. With `A = [I, -w; -w^T, w.w]` over `(x_k, u_k)` of an end
//!
//! ```text
//! T = rho du/6 (V0.V0 + V0.V1 + V1.V1) = 1/2 q'^T M q',   M = rho du/6 [2A, A; A, 2A]
//! ```
//!
//! of rank 6: a node that moves along the yarn while the material stands still, `(w, 1)`, has no inertia. So
//! that a node with collinear yarns keeps a regular matrix, `eps rho du/3 w.w` is added to the diagonal
//! entries of `u`. Backward Euler with `M` of the start of the step is the potential
//!
//! ```text
//! V = (q - q0 - h q0')^T M (q - q0 - h q0')/(2 h^2) + alpha (q - q0)^T M (q - q0)/(2 h) - F.(q - q0)
//! ```
//!
//! with the mass-proportional damping `alpha` and the inertia forces `F = dT/dq - M' q'` (derived from the
//! Lagrangian), taken at the start of the step; `s = (2 V0 + V1) u0' + (V0 + 2 V1) u1'`,
//! `Q = V0.V0 + V0.V1 + V1.V1`:
//!
//! ```text
//! dT/dx1 = -rho/6 s = -dT/dx0,   dT/du1 = rho/6 (Q + w.s) = -dT/du0
//! ```
//!
//! They may be left out: only with sliding do they exist, and momentum is kept only with them. The
//! Hessian is constant within a step. SI units; idle in statics.

use super::super::state::State;
use super::kernel::{Kernel, Local, Lower, point, set_point};
use crate::math::Vec3;

/// Inertia of one segment; scalars `(x0, x1, u0, u1)`.
pub struct Inertia {
    density: f64,
    damping: f64,
    regular: f64,
    forces: bool,
    mass: Mass,
    rates: [f64; 8],
    force: [f64; 8],
}

/// The mass matrix of a segment.
#[derive(Clone, Copy, Debug)]
pub struct Mass {
    /// `rho du / 6` [kg].
    sixth: f64,
    w: Vec3,
    /// Added to the diagonal entries of `u` [kg].
    regular: f64,
}

impl Mass {
    /// Mass matrix at scalars `(x0, x1, u0, u1)` of a yarn of `density` [kg/m], `regular` being `eps`.
    pub fn new(q: &[f64; 8], density: f64, regular: f64) -> Self {
        let du = q[7] - q[6];
        let w = (point(q, 1) - point(q, 0)) / du;
        let sixth = density * du / 6.0;
        Self {
            sixth,
            w,
            regular: 2.0 * regular * sixth * w.norm_squared(),
        }
    }

    /// Velocities `V0`, `V1` of the material at the ends for the rates `y`.
    pub fn material(&self, y: &[f64; 8]) -> [Vec3; 2] {
        [point(y, 0) - self.w * y[6], point(y, 1) - self.w * y[7]]
    }

    /// `M y`.
    pub fn times(&self, y: &[f64; 8]) -> [f64; 8] {
        let [a, b] = self.material(y);
        let (p, r) = ((a * 2.0 + b) * self.sixth, (a + b * 2.0) * self.sixth);
        let mut out = [0.0; 8];
        set_point(&mut out, 0, &p);
        set_point(&mut out, 1, &r);
        out[6] = self.regular * y[6] - self.w.dot(&p);
        out[7] = self.regular * y[7] - self.w.dot(&r);
        out
    }

    /// `1/2 y^T M y`.
    pub fn energy(&self, y: &[f64; 8]) -> f64 {
        0.5 * dot(y, &self.times(y))
    }
}

fn dot(a: &[f64; 8], b: &[f64; 8]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

fn minus(a: &[f64; 8], b: &[f64; 8]) -> [f64; 8] {
    std::array::from_fn(|i| a[i] - b[i])
}

/// `dT/dq - M' q'` at scalars `q` with the rates `y`.
pub fn inertia_force(q: &[f64; 8], y: &[f64; 8], density: f64) -> [f64; 8] {
    let du = q[7] - q[6];
    let mass = Mass::new(q, density, 0.0);
    let [a, b] = mass.material(y);
    let ddu = y[7] - y[6];
    let (p, r) = (a * 2.0 + b, a + b * 2.0);
    let s = p * y[6] + r * y[7];
    let energy = a.dot(&a) + a.dot(&b) + b.dot(&b);
    let sixth = density / 6.0;
    // rates of M's factors w and du with q' held
    let dw = (point(y, 1) - point(y, 0) - mass.w * ddu) / du;
    let (da, db) = (-dw * y[6], -dw * y[7]);
    let dp = (p * ddu + (da * 2.0 + db) * du) * sixth;
    let dr = (r * ddu + (da + db * 2.0) * du) * sixth;
    let by_x = s * sixth;
    let by_u = sixth * (energy + mass.w.dot(&s));
    let mut out = [0.0; 8];
    set_point(&mut out, 0, &(by_x - dp));
    set_point(&mut out, 1, &(-by_x - dr));
    out[6] = -by_u + dw.dot(&p) * sixth * du + mass.w.dot(&dp);
    out[7] = by_u + dw.dot(&r) * sixth * du + mass.w.dot(&dr);
    out
}

impl Inertia {
    /// Inertia of a segment of a yarn of `density` [kg/m] and mass-proportional `damping` [1/s];
    /// `regular` is `eps`, `forces` whether inertia forces act.
    pub fn new(density: f64, damping: f64, regular: f64, forces: bool) -> Self {
        Self {
            density,
            damping,
            regular,
            forces,
            mass: Mass {
                sixth: 0.0,
                w: Vec3::zeros(),
                regular: 0.0,
            },
            rates: [0.0; 8],
            force: [0.0; 8],
        }
    }

    /// Motion from the start of the step, and from where inertia alone leads.
    fn motion(&self, at: &Local<'_, 8>) -> [[f64; 8]; 2] {
        let moved = minus(at.q, at.q0);
        let mut off = moved;
        for (o, r) in off.iter_mut().zip(&self.rates) {
            *o -= r / at.inv_dt;
        }
        [moved, off]
    }

    fn factors(&self, at: &Local<'_, 8>) -> [f64; 2] {
        [self.damping * at.inv_dt, at.inv_dt * at.inv_dt]
    }
}

impl Kernel<8> for Inertia {
    const NAME: &'static str = "yarn_inertia";
    const POSITIONS: usize = 2;
    const LOOKS_BACK: bool = true;
    const INTERNAL: bool = false;
    const LAGGED: bool = true;

    fn value(&self, at: &Local<'_, 8>) -> f64 {
        let [moved, off] = self.motion(at);
        let [damping, inertia] = self.factors(at);
        damping * self.mass.energy(&moved) + inertia * self.mass.energy(&off)
            - dot(&self.force, &moved)
    }

    fn gradient(&self, at: &Local<'_, 8>, out: &mut [f64; 8]) {
        let [moved, off] = self.motion(at);
        let [damping, inertia] = self.factors(at);
        let y = std::array::from_fn(|i| damping * moved[i] + inertia * off[i]);
        *out = minus(&self.mass.times(&y), &self.force);
    }

    fn derivatives(&self, at: &Local<'_, 8>, _: f64, gradient: &mut [f64; 8], out: &mut Lower<8>) {
        self.gradient(at, gradient);
        let scale = self.factors(at).iter().sum::<f64>() * self.mass.sixth;
        let w = &self.mass.w;
        let ww = w.norm_squared();
        for (p, r, k) in [(0, 0, 2.0 * scale), (1, 0, scale), (1, 1, 2.0 * scale)] {
            for c in 0..3 {
                out[3 * p + c][3 * r + c] = k;
                out[6 + p][3 * r + c] = -k * w[c];
                out[6 + r][3 * p + c] = -k * w[c];
            }
            out[6 + p][6 + r] = k * ww;
        }
        let regular = self.factors(at).iter().sum::<f64>() * self.mass.regular;
        out[6][6] += regular;
        out[7][7] += regular;
    }

    fn is_idle(inv_dt: f64) -> bool {
        inv_dt == 0.0
    }

    fn begin(&mut self, at: &Local<'_, 8>, rates: &[f64; 8], _: &State) {
        self.mass = Mass::new(at.q0, self.density, self.regular);
        self.rates = *rates;
        self.force = if self.forces {
            inertia_force(at.q0, rates, self.density)
        } else {
            [0.0; 8]
        };
    }
}
