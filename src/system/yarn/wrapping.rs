//! Wrapping of two yarns around each other at a stitch contact.
//!
//! Nodes `q0`, `q1` of the contact, the far end `a` of a wing of one yarn beside `q0`, the far end `b` of a wing of
//! another yarn beside `q1`; `psi` is the signed angle between the triangles `(q0, q1, a)` and `(q0, q1, b)` times the
//! handedness of the contact, 0 in the flat fabric with the wings on opposite sides:
//!
//! ```text
//! V = k_w/2 L (psi - psi0)^2 W_a W_b,   psi0 = pi/2,   psi - psi0 in (-pi, pi]
//! W = (1 + e^2) sin^2(beta)/(sin^2(beta) + e^2),   e = 0.3
//! ```
//!
//! (Cirio et al. 2017, equations 2 and 7 to 16, whose derivatives are those of the signed angle, not of the printed
//! `arccos`.) `beta` is the angle between the axis and a wing: without `W` the gradient grows as `1/beta` where
//! a wing lies along the axis. `Psd` is the square of the gradient of `(psi - psi0) sqrt(W_a W_b)`. Damping is the same
//! energy with `beta/dt k_w` and the `psi` of the start of the step in place of `k_w` and `psi0`; with guards of the start
//! it would be a wall where a wing passes the axis. No material coordinate enters.
//! SI units; `k_w` in N.

use super::kernel::{
    Damped, Kernel, Local, Lower, add_block, add_product, add_square, point, set_point,
};
use crate::math::geometry::{
    HingeFloor, dihedral, dihedral_gradient, dihedral_hessian, wrap_angle,
};
use crate::math::{Mat3, Vec3};

/// Square of `e`.
const SOFT: f64 = 0.09;

/// Wrapping of one pair of wings; scalars `(q0, q1, a, b)`.
pub struct Wrapping {
    /// `k_w L` [N m].
    pub stiffness: f64,
    /// Length of the contact at rest [m].
    pub length: f64,
    /// Handedness, +1 or -1.
    pub sign: f64,
    /// Angle at rest `psi0` [rad].
    pub rest: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

/// Guard of one wing: its value and derivatives by the axis and by the wing.
struct Guard {
    value: f64,
    /// Derivative of the guard by the cosine, twice.
    by_cos: [f64; 2],
    cos: f64,
    axis: Vec3,
    wing: Vec3,
    /// One over both lengths.
    inverse: [f64; 2],
}

fn guard(axis: &Vec3, wing: &Vec3, floor: f64) -> Guard {
    let inverse = [axis, wing].map(|v| 1.0 / v.norm().max(floor));
    let (e, w) = (axis * inverse[0], wing * inverse[1]);
    let cos = e.dot(&w);
    let y = e.cross(&w).norm_squared();
    let first = (1.0 + SOFT) * SOFT / ((y + SOFT) * (y + SOFT));
    let second = -2.0 * first / (y + SOFT);
    Guard {
        value: (1.0 + SOFT) * y / (y + SOFT),
        by_cos: [-2.0 * cos * first, 4.0 * cos * cos * second - 2.0 * first],
        cos,
        axis: e,
        wing: w,
        inverse,
    }
}

impl Guard {
    /// Derivatives of the cosine by the axis and the wing.
    fn cosine(&self) -> [Vec3; 2] {
        [
            (self.wing - self.axis * self.cos) * self.inverse[0],
            (self.axis - self.wing * self.cos) * self.inverse[1],
        ]
    }

    /// Derivatives of the guard by the axis and the wing.
    fn gradient(&self) -> [Vec3; 2] {
        self.cosine().map(|g| g * self.by_cos[0])
    }

    /// Blocks (axis, axis), (wing, axis), (wing, wing) of the second derivative.
    fn hessian(&self) -> [Mat3; 3] {
        let [ga, gw] = self.cosine();
        let [ia, iw] = self.inverse;
        let (e, w, c) = (&self.axis, &self.wing, self.cos);
        let one = Mat3::identity();
        let same = |t: &Vec3, g: &Vec3, inverse: f64| {
            let tg = t * g.transpose();
            -(tg + tg.transpose() + (one - t * t.transpose()) * (c * inverse)) * inverse
        };
        let mixed =
            (one - w * w.transpose() - e * e.transpose() + w * e.transpose() * c) * (ia * iw);
        let [first, second] = self.by_cos;
        [
            same(e, &ga, ia) * first + ga * ga.transpose() * second,
            mixed * first + gw * ga.transpose() * second,
            same(w, &gw, iw) * first + gw * gw.transpose() * second,
        ]
    }
}

fn points(q: &[f64; 12]) -> [Vec3; 4] {
    [point(q, 0), point(q, 1), point(q, 2), point(q, 3)]
}

/// Guards of both wings: the second is seen from `q1` along the axis as the first from `q0`.
fn guards(x: &[Vec3; 4], floor: f64) -> [Guard; 2] {
    let axis = x[1] - x[0];
    [
        guard(&axis, &(x[2] - x[0]), floor),
        guard(&axis, &(x[3] - x[1]), floor),
    ]
}

/// Derivative of the product of the guards by the four points.
fn guard_gradient(g: &[Guard; 2]) -> [Vec3; 4] {
    let [aa, aw] = g[0].gradient().map(|v| v * g[1].value);
    let [ba, bw] = g[1].gradient().map(|v| v * g[0].value);
    [-aa - aw - ba, aa + ba - bw, aw, bw]
}

/// `k g + l h`.
fn combined(k: f64, g: &[f64; 12], l: f64, h: &[f64; 12]) -> [f64; 12] {
    std::array::from_fn(|i| k * g[i] + l * h[i])
}

fn flat(v: &[Vec3; 4], scale: f64) -> [f64; 12] {
    let mut out = [0.0; 12];
    for (p, v) in v.iter().enumerate() {
        set_point(&mut out, p, &(v * scale));
    }
    out
}

impl Wrapping {
    fn length_floor(&self) -> f64 {
        1e-4 * self.length
    }

    fn floor(&self) -> HingeFloor {
        HingeFloor {
            length: self.length_floor(),
            area: 1e-4 * self.length * self.length,
        }
    }

    /// The angle `psi` of a contact at four points [rad].
    pub fn angle(&self, x: &[Vec3; 4]) -> f64 {
        -self.sign * dihedral(x)
    }

    /// Derivative of `psi`.
    fn angle_gradient(&self, x: &[Vec3; 4]) -> [Vec3; 4] {
        dihedral_gradient(x, self.floor()).map(|g| g * -self.sign)
    }

    /// Stiffness [N m] and angle [rad] of the elastic energy and of damping.
    fn parts(&self, start: Damped, psi: f64) -> [(f64, f64); 2] {
        let damped = if start.weight > 0.0 {
            (start.weight, wrap_angle(psi - start.measure))
        } else {
            (0.0, 0.0)
        };
        [(self.stiffness, wrap_angle(psi - self.rest)), damped]
    }

    /// Sum of stiffness times angle [N m], and of half of stiffness times its square [J].
    fn moments(parts: &[(f64, f64); 2]) -> (f64, f64) {
        let [(k, a), (c, b)] = parts;
        (k * a + c * b, 0.5 * (k * a * a + c * b * b))
    }

    /// Elastic force's negative on `(q0, q1, wing)` of the triangle of wing `a` and of wing `b`: what each
    /// of the two yarns carries.
    pub fn sides(&self, x: &[Vec3; 4]) -> [[Vec3; 3]; 2] {
        let delta = wrap_angle(self.angle(x) - self.rest);
        let guards = guards(x, self.length_floor());
        let w = guards[0].value * guards[1].value;
        let g = self.angle_gradient(x);
        let axis = x[1] - x[0];
        let squared = axis.norm_squared().max(self.length_floor().powi(2));
        let moment = self.stiffness * delta * w;
        let half = 0.5 * self.stiffness * delta * delta;
        [0, 1].map(|k| {
            let wing = g[2 + k] * moment;
            let foot = (x[2 + k] - x[0]).dot(&axis) / squared;
            let [ga, gw] = guards[k]
                .gradient()
                .map(|v| v * (half * guards[1 - k].value));
            let own = if k == 0 {
                [gw, Vec3::zeros()]
            } else {
                [Vec3::zeros(), gw]
            };
            [
                wing * (foot - 1.0) - ga - own[0],
                -wing * foot + ga - own[1],
                wing + gw,
            ]
        })
    }
}

impl Kernel<12> for Wrapping {
    const NAME: &'static str = "stitch_wrapping";
    const POSITIONS: usize = 4;
    const DAMPED: bool = true;

    fn value(&self, at: &Local<'_, 12>) -> f64 {
        let x = points(at.q);
        let (_, energy) = Self::moments(&self.parts(at.start, self.angle(&x)));
        let [a, b] = guards(&x, self.length_floor());
        energy * a.value * b.value
    }

    fn gradient(&self, at: &Local<'_, 12>, out: &mut [f64; 12]) {
        let x = points(at.q);
        let (moment, energy) = Self::moments(&self.parts(at.start, self.angle(&x)));
        let guards = guards(&x, self.length_floor());
        let g = flat(&self.angle_gradient(&x), 1.0);
        let dw = flat(&guard_gradient(&guards), 1.0);
        *out = combined(moment * guards[0].value * guards[1].value, &g, energy, &dw);
    }

    fn derivatives(
        &self,
        at: &Local<'_, 12>,
        exactness: f64,
        gradient: &mut [f64; 12],
        out: &mut Lower<12>,
    ) {
        let x = points(at.q);
        let parts = self.parts(at.start, self.angle(&x));
        let (moment, energy) = Self::moments(&parts);
        let guards = guards(&x, self.length_floor());
        let w = guards[0].value * guards[1].value;
        let psi_gradient = self.angle_gradient(&x);
        let (g, dw) = (
            flat(&psi_gradient, 1.0),
            flat(&guard_gradient(&guards), 1.0),
        );
        *gradient = combined(moment * guards[0].value * guards[1].value, &g, energy, &dw);
        // square of the gradient of angle sqrt(w), which has no root in it
        let root = w.sqrt();
        let over = if root > 1e-12 { 0.5 / root } else { 0.0 };
        for (k, angle) in parts {
            if k == 0.0 {
                continue;
            }
            let mut measure = [0.0; 12];
            for i in 0..12 {
                measure[i] = root * g[i] + over * angle * dw[i];
            }
            add_square(out, k, &measure);
        }
        if exactness == 0.0 {
            return;
        }
        // what the squares leave out: d2(k angle^2 w / 2) - k measure^2
        add_product(out, 0.5 * exactness * moment, &g, &dw);
        add_square(out, -2.0 * exactness * energy * over * over, &dw);
        let second = dihedral_hessian(&x, self.floor());
        let turned = -self.sign * exactness * moment * w;
        for p in 0..4 {
            for r in 0..=p {
                add_block(out, p, r, &(second[p][r] * turned));
            }
        }
        add_guard_hessian(&guards, exactness * energy, out);
    }

    fn start(&self, q0: &[f64; 12], inv_dt: f64) -> Damped {
        Damped {
            weight: self.damping * inv_dt * self.stiffness,
            measure: self.angle(&points(q0)),
        }
    }
}

/// Adds `k` times the second derivative of the product of the guards.
fn add_guard_hessian(guards: &[Guard; 2], k: f64, out: &mut Lower<12>) {
    // axis and wing of each guard by the points
    let weights = [
        [[-1.0, 1.0, 0.0, 0.0], [-1.0, 0.0, 1.0, 0.0]],
        [[-1.0, 1.0, 0.0, 0.0], [0.0, -1.0, 0.0, 1.0]],
    ];
    let mut own = [[Vec3::zeros(); 4]; 2];
    for (s, guard) in guards.iter().enumerate() {
        let [ax, wi] = &weights[s];
        let [aa, wa, ww] = guard.hessian().map(|m| m * (k * guards[1 - s].value));
        let [ga, gw] = guard.gradient();
        for p in 0..4 {
            own[s][p] = ga * ax[p] + gw * wi[p];
            for r in 0..=p {
                let m = aa * (ax[p] * ax[r])
                    + wa * (wi[p] * ax[r])
                    + wa.transpose() * (ax[p] * wi[r])
                    + ww * (wi[p] * wi[r]);
                add_block(out, p, r, &m);
            }
        }
    }
    add_product(out, k, &flat(&own[0], 1.0), &flat(&own[1], 1.0));
}
