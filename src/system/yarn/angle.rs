//! The angle between two directions at a node, with its derivatives, and the law of jamming.
//!
//! For `a`, `b` with unit vectors `t1`, `t2`, `theta = atan2(|a x b|, a.b)`, the normal `m` of their plane
//! and the perpendiculars `n1 = m x t1`, `n2 = m x t2`:
//!
//! ```text
//! dtheta/da = -n1/|a|,   dtheta/db = n2/|b|
//! d2theta/da2 = (t1 n1^T + n1 t1^T + cot(theta) m m^T)/|a|^2
//! d2theta/db2 = (-t2 n2^T - n2 t2^T + cot(theta) m m^T)/|b|^2
//! d2theta/dadb = -m m^T/(|a| |b| sin(theta))
//! ```
//!
//! In the direction `m` the second derivative splits into `(1 + cos)/(2 sin)` on `(1/|a|, -1/|b|)` and
//! `(cos - 1)/(2 sin)` on `(1/|a|, 1/|b|)`; times a moment, the positive one of them is kept by `Psd`. The rest
//! in the plane is indefinite. No division by zero where the two are parallel: `m` is then any normal.
//!
//! **Jamming** multiplies a stiffness by `K` beyond an angle. The tangent is blended, not the stiffness, so that
//! the moment is smooth: `R'' = t/delta` up to `delta` and 1 beyond, `R(t) = 0` for `t < 0`.

use super::kernel::{Lower, add_weighted};
use crate::math::Vec3;

/// Sine below which the two directions count as parallel.
const PARALLEL: f64 = 1e-9;

/// Two directions and the angle between them.
pub(super) struct Angle {
    pub(super) theta: f64,
    cos: f64,
    pub(super) sin: f64,
    t: [Vec3; 2],
    n: [Vec3; 2],
    m: Vec3,
    /// One over the lengths of `a` and `b` [1/m].
    inverse: [f64; 2],
}

/// A function of the angle at one configuration.
pub(super) struct Moment {
    /// First derivative.
    pub(super) value: f64,
    /// First derivative over the sine of the angle.
    pub(super) over_sin: f64,
    /// Positive part of the second derivative, and the second derivative.
    pub(super) slope: [f64; 2],
}

/// Angle between `a` and `b` [rad].
pub(super) fn angle(a: &Vec3, b: &Vec3) -> f64 {
    a.cross(b).norm().atan2(a.dot(b))
}

impl Angle {
    /// Lengths below `floor` count as `floor`: derivatives stay finite, no longer exact.
    pub(super) fn new(a: &Vec3, b: &Vec3, floor: f64) -> Self {
        let inverse = [a, b].map(|v| 1.0 / v.norm().max(floor));
        let t = [a * inverse[0], b * inverse[1]];
        let cross = t[0].cross(&t[1]);
        let (sin, cos) = (cross.norm(), t[0].dot(&t[1]));
        let m = if sin > PARALLEL {
            cross / sin
        } else {
            perpendicular(&t[0])
        };
        Self {
            theta: sin.atan2(cos),
            cos,
            sin,
            t,
            n: [m.cross(&t[0]), m.cross(&t[1])],
            m,
            inverse,
        }
    }

    /// `theta / sin(theta)`, bounded near a full fold.
    pub(super) fn over_sin(&self) -> f64 {
        if self.sin < 1e-4 && self.cos > 0.0 {
            1.0 + self.theta * self.theta / 6.0
        } else {
            self.theta / self.sin.max(PARALLEL)
        }
    }

    /// Derivatives of the angle by `a` and `b`.
    pub(super) fn gradient(&self) -> [Vec3; 2] {
        [-self.n[0] * self.inverse[0], self.n[1] * self.inverse[1]]
    }

    /// Adds the Hessian of a function of the angle, but for `slope[0] g g^T` (the caller's), where
    /// `a = sum_p w[0][p] x_p` and `b = sum_p w[1][p] x_p`.
    pub(super) fn add_curvature<const N: usize>(
        &self,
        w: &[[f64; 3]; 2],
        moment: &Moment,
        exactness: f64,
        out: &mut Lower<N>,
    ) {
        let [alpha, beta] = self.inverse;
        let mm = self.m * self.m.transpose();
        let half = 0.5 * moment.over_sin;
        for (k, sign) in [
            (half * (self.cos + 1.0), -1.0),
            (half * (self.cos - 1.0), 1.0),
        ] {
            let kept = k.max(0.0) + exactness * k.min(0.0);
            if kept != 0.0 {
                let j = [0, 1, 2].map(|p| alpha * w[0][p] + sign * beta * w[1][p]);
                add_weighted(out, &j, &(mm * kept));
            }
        }
        if exactness > 0.0 {
            for (k, sign) in [(0, 1.0), (1, -1.0)] {
                let tn = self.t[k] * self.n[k].transpose();
                let scale = sign * exactness * moment.value * self.inverse[k] * self.inverse[k];
                add_weighted(out, &w[k], &((tn + tn.transpose()) * scale));
            }
        }
    }
}

impl Moment {
    /// What multiplies `g g^T`.
    pub(super) fn square(&self, exactness: f64) -> f64 {
        self.slope[0] + exactness * (self.slope[1] - self.slope[0])
    }
}

fn perpendicular(t: &Vec3) -> Vec3 {
    let least = t.iamin();
    let mut axis = Vec3::zeros();
    axis[least] = 1.0;
    let across = axis - t * t.dot(&axis);
    across / across.norm().max(f64::MIN_POSITIVE)
}

/// Jamming beyond an angle, blended over a width.
#[derive(Clone, Copy, Debug)]
pub struct Jam {
    /// Factor on the stiffness.
    pub factor: f64,
    /// Angle at which it begins [rad].
    pub from: f64,
    /// Width of the blend [rad].
    pub width: f64,
}

impl Jam {
    /// `(K - 1) R` and its first and second derivative at an angle.
    #[inline]
    pub fn at(&self, angle: f64) -> [f64; 3] {
        let t = angle - self.from;
        if t <= 0.0 {
            return [0.0; 3];
        }
        let (k, d) = (self.factor - 1.0, self.width);
        if t < d {
            [t * t * t / (6.0 * d), t * t / (2.0 * d), t / d].map(|v| k * v)
        } else {
            let s = t - 0.5 * d;
            [0.5 * s * s + d * d / 24.0, s, 1.0].map(|v| k * v)
        }
    }
}
