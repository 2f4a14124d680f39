//! Stretch of a segment of yarn between two contacts.
//!
//! With `d = x1 - x0`, `du = u1 - u0`, `t = d/|d|` and the stretch `s = |d|/du`
//!
//! ```text
//! V = k_s/2 du (s - 1)^2,   k_s = Y pi R^2 [N]
//! H = k_s/du J J^T + k_s (s - 1)/|d| (+,-;-,+) (I - t t^T),   J = (-t, t, s, -s) over (x0, x1, u0, u1)
//! ```
//!
//! (Cirio et al. 2014, section 4). `Psd` keeps the second part only under tension. Material that
//! slides out of a segment makes `V` grow as `1/du`: the barrier that keeps `du` positive; a step is
//! admissible while `du` keeps [`LEAST`] of its length. Damping acts on `s` with the weight
//! `beta/dt k_s du0`. Below 1e-4 of `du` the direction of a segment is shortened with it: derivatives stay
//! finite, no longer exact. SI units.

use super::kernel::{
    Damped, Kernel, Local, Lower, add_product, add_square, add_weighted, point, set_point,
};
use crate::math::{Mat3, Vec3};

/// Part of a segment's material that a step must leave in it.
pub const LEAST: f64 = 0.2;
/// Length, in `du`, below which a segment counts as a point.
const FLOOR: f64 = 1e-4;

/// Stretch of one segment; scalars `(x0, x1, u0, u1)`.
pub struct Stretch {
    /// `k_s` [N].
    pub stiffness: f64,
    /// Stiffness-proportional damping [s].
    pub damping: f64,
}

struct Frame {
    t: Vec3,
    /// Length, not below the floor [m].
    length: f64,
    du: f64,
    stretch: f64,
}

fn frame(q: &[f64; 8]) -> Frame {
    let d = point(q, 1) - point(q, 0);
    let du = q[7] - q[6];
    let length = d.norm();
    let floored = length.max(FLOOR * du.abs());
    Frame {
        t: d / floored,
        length: floored,
        du,
        stretch: length / du,
    }
}

impl Stretch {
    /// Derivative of the energy, and what damping has of the tension.
    fn force(&self, f: &Frame, start: Damped, out: &mut [f64; 8]) -> f64 {
        let viscous = start.weight * (f.stretch - start.measure) / f.du;
        let tension = f.t * (self.stiffness * (f.stretch - 1.0) + viscous);
        set_point(out, 0, &-tension);
        set_point(out, 1, &tension);
        let slide = 0.5 * self.stiffness * (1.0 - f.stretch * f.stretch) - viscous * f.stretch;
        out[6] = -slide;
        out[7] = slide;
        viscous
    }
}

impl Kernel<8> for Stretch {
    const NAME: &'static str = "yarn_stretch";
    const POSITIONS: usize = 2;
    const BOUNDS: bool = true;
    const LOOKS_BACK: bool = true;
    const DAMPED: bool = true;

    fn value(&self, at: &Local<'_, 8>) -> f64 {
        let f = frame(at.q);
        if f.du <= 0.0 {
            return f64::INFINITY;
        }
        let (strain, since) = (f.stretch - 1.0, f.stretch - at.start.measure);
        0.5 * (self.stiffness * f.du * strain * strain + at.start.weight * since * since)
    }

    fn gradient(&self, at: &Local<'_, 8>, out: &mut [f64; 8]) {
        self.force(&frame(at.q), at.start, out);
    }

    fn derivatives(
        &self,
        at: &Local<'_, 8>,
        exactness: f64,
        gradient: &mut [f64; 8],
        out: &mut Lower<8>,
    ) {
        let f = frame(at.q);
        let viscous = self.force(&f, at.start, gradient);
        let j = [
            -f.t.x, -f.t.y, -f.t.z, f.t.x, f.t.y, f.t.z, f.stretch, -f.stretch,
        ];
        let square = self.stiffness / f.du + at.start.weight / (f.du * f.du);
        add_square(out, square, &j);
        let tension = self.stiffness * (f.stretch - 1.0) + viscous;
        let kept = tension.max(0.0) + exactness * tension.min(0.0);
        let across = (Mat3::identity() - f.t * f.t.transpose()) * (kept / f.length);
        add_weighted(out, &[1.0, -1.0], &across);
        if exactness > 0.0 && viscous != 0.0 {
            // what the damped stretch has of second derivatives by u: d(J/du)/du
            let k = exactness * viscous / f.du;
            let e = [0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 1.0, -1.0];
            add_product(out, k, &j, &e);
        }
    }

    fn start(&self, q0: &[f64; 8], inv_dt: f64) -> Damped {
        let f = frame(q0);
        Damped {
            weight: self.damping * inv_dt * self.stiffness * f.du,
            measure: f.stretch,
        }
    }

    fn bound(&self, at: &Local<'_, 8>) -> f64 {
        let (du, start) = (at.q[7] - at.q[6], at.q0[7] - at.q0[6]);
        if du >= LEAST * start {
            1.0
        } else {
            (1.0 - LEAST) * start / (start - du)
        }
    }
}
