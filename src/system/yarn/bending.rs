//! Bending of a yarn at a contact, with jamming.
//!
//! Nodes 0, 1, 2 follow each other in one yarn, `a = x1 - x0`, `b = x2 - x1`, `theta` the angle between them (0
//! where the yarn is straight), `du = u2 - u0`:
//!
//! ```text
//! V = k_b G(theta)/du,   G = theta^2 + 2 (K - 1) R(theta - theta_j),   k_b = B pi R^2 [N m^2]
//! ```
//!
//! (Cirio et al. 2017, equation 1 and section 4.1; the jam by its moment, `K = 1000` past a right angle,
//! blended over 0.2 rad). `k_b` is the flexural rigidity: `V = EI/2 kappa^2 ds` with `kappa = 2 theta/du` over `du/2`.
//! `Psd` keeps, in `(theta, du)`, `k_b/du [(G'' - G'^2/2G)_+ g g^T + (G'/sqrt(2G) g - sqrt(2G)/du e)^2]`, and of the
//! curvature of `theta` the positive part across the plane of the bend.
//!
//! Damping acts on `r = sqrt(theta^2 + e^2)`, `e = 0.01 rad`, with the weight `beta/dt 2 k_b/du0`: `theta` itself has a tip
//! at 0. Bends below `e` are damped the less the smaller they are. Segments below 1e-4 of `du` count as
//! that long. SI units.

use super::angle::{Angle, Jam, Moment, angle};
use super::kernel::{Damped, Kernel, Local, Lower, add_square, point, set_point};
use crate::math::Vec3;

/// Jamming of a yarn bent past a right angle.
pub const JAM: Jam = Jam {
    factor: 1000.0,
    from: std::f64::consts::FRAC_PI_2,
    width: 0.2,
};
/// Bend below which damping fades [rad].
const SOFT: f64 = 0.01;
const FLOOR: f64 = 1e-4;
/// `a` and `b` by the three nodes.
const WEIGHTS: [[f64; 3]; 2] = [[-1.0, 1.0, 0.0], [0.0, -1.0, 1.0]];

/// Bending at the middle one of three nodes; scalars `(x0, x1, x2, u0, u2)`.
pub struct Bending {
    /// `k_b` [N m^2].
    pub stiffness: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

/// What damping acts on.
fn softened(theta: f64) -> f64 {
    (theta * theta + SOFT * SOFT).sqrt()
}

/// `G` and its first and second derivative.
fn law(theta: f64) -> [f64; 3] {
    let jam = JAM.at(theta);
    [
        theta * theta + 2.0 * jam[0],
        2.0 * (theta + jam[1]),
        2.0 * (1.0 + jam[2]),
    ]
}

fn edges(q: &[f64; 11]) -> [Vec3; 2] {
    let middle = point(q, 1);
    [middle - point(q, 0), point(q, 2) - middle]
}

fn frame(q: &[f64; 11]) -> (Angle, f64) {
    let [a, b] = edges(q);
    let du = q[10] - q[9];
    (Angle::new(&a, &b, FLOOR * du.abs()), du)
}

/// `-a`, `a - b` and `b` at the three nodes.
fn by_nodes([a, b]: &[Vec3; 2]) -> [f64; 11] {
    let mut out = [0.0; 11];
    set_point(&mut out, 0, &-a);
    set_point(&mut out, 1, &(a - b));
    set_point(&mut out, 2, b);
    out
}

impl Bending {
    /// Derivative of the energy by the scalars, with `g` that of the angle by both edges.
    fn force(&self, g: &[Vec3; 2], moment: f64, law: f64, du: f64) -> [f64; 11] {
        let mut out = by_nodes(&g.map(|g| g * moment));
        out[9] = self.stiffness * law / (du * du);
        out[10] = -out[9];
        out
    }

    fn moment(&self, at: &Local<'_, 11>, bend: &Angle, du: f64, g: &[f64; 3]) -> Moment {
        let k = self.stiffness / du;
        let Damped {
            weight: c,
            measure: start,
        } = at.start;
        let theta = bend.theta;
        let mut by_theta = if g[1] > 0.0 {
            k * g[1] / theta
        } else {
            2.0 * k
        };
        let ratio = if g[0] > 0.0 {
            g[1] * g[1] / (2.0 * g[0])
        } else {
            2.0
        };
        let mut slope = [k * g[2].max(ratio), k * g[2]];
        if c > 0.0 {
            let r = softened(theta);
            by_theta += c * (r - start) / r;
            let first = c * theta * theta / (r * r);
            let second = c * (r - start) * SOFT * SOFT / (r * r * r);
            slope[0] += first + second.max(0.0);
            slope[1] += first + second;
        }
        Moment {
            value: by_theta * theta,
            over_sin: by_theta * bend.over_sin(),
            slope,
        }
    }
}

impl Kernel<11> for Bending {
    const NAME: &'static str = "yarn_bending";
    const POSITIONS: usize = 3;
    const DAMPED: bool = true;

    fn value(&self, at: &Local<'_, 11>) -> f64 {
        let [a, b] = edges(at.q);
        let theta = angle(&a, &b);
        let since = softened(theta) - at.start.measure;
        let damped = 0.5 * at.start.weight * since * since;
        self.stiffness * law(theta)[0] / (at.q[10] - at.q[9]) + damped
    }

    fn gradient(&self, at: &Local<'_, 11>, out: &mut [f64; 11]) {
        let (bend, du) = frame(at.q);
        let g = law(bend.theta);
        let moment = self.moment(at, &bend, du, &g);
        *out = self.force(&bend.gradient(), moment.value, g[0], du);
    }

    fn derivatives(
        &self,
        at: &Local<'_, 11>,
        exactness: f64,
        gradient: &mut [f64; 11],
        out: &mut Lower<11>,
    ) {
        let (bend, du) = frame(at.q);
        let g = law(bend.theta);
        let moment = self.moment(at, &bend, du, &g);
        let by_edges = bend.gradient();
        let j = by_nodes(&by_edges);
        *gradient = self.force(&by_edges, moment.value, g[0], du);
        add_square(out, moment.square(exactness), &j);
        bend.add_curvature(&WEIGHTS, &moment, exactness, out);
        // by du, and mixed
        let k = self.stiffness / (du * du);
        for c in 0..9 {
            let mixed = k * g[1] * j[c];
            out[9][c] += mixed;
            out[10][c] -= mixed;
        }
        let second = 2.0 * k * g[0] / du;
        out[9][9] += second;
        out[10][9] -= second;
        out[10][10] += second;
    }

    fn start(&self, q0: &[f64; 11], inv_dt: f64) -> Damped {
        let [a, b] = edges(q0);
        Damped {
            weight: 2.0 * self.damping * inv_dt * self.stiffness / (q0[10] - q0[9]),
            measure: softened(angle(&a, &b)),
        }
    }
}
