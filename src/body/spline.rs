//! Tensor-product quadratic B-spline on 3 x 3 x 3 coefficients: the C1 reconstruction of every
//! sampled field.
//!
//! A point in the knot interval of node `i`, at `t = (x - x_i) / h` in [-1/2, 1/2], has per axis
//!
//! ```text
//! w  = ( (1/2 - t)^2 / 2,   3/4 - t^2,   (1/2 + t)^2 / 2 )
//! w' = ( t - 1/2,          -2 t,         t + 1/2 ) / h
//! w" = ( 1,                -2,           1 ) / h^2
//! ```
//!
//! (de Boor, A Practical Guide to Splines, ch. IX). Why not the trilinear interpolant: its gradient
//! jumps at every cell face, so that a contact energy built on it has kinks there and Newton's
//! method steps back and forth across them. The spline is C1 with a bounded Hessian, and value,
//! gradient and Hessian belong to one and the same function.
//!
//! Putting nodal samples `f` in place of coefficients smooths: the spline's second moment gives
//! `f + h^2/8 * laplace f`. The coefficients are therefore `c = f - 1/8 * sum_d delta_d^2 f`,
//! which leaves an error of order h^3 in the value and h^2 in the gradient where the distance is
//! smooth; across a kink of the distance (medial axis, inside of an edge) the error is of order h.
//!
//! Spaces of spacing `h` and `4 h` are nested when nodes sit at `(i + 1/2) h` (knots at `i h`), and
//! [`refined_weights`] gives the fine coefficient that reproduces a coarse spline exactly.

use super::Distance;
use crate::math::{Mat3, Vec3};

/// Values, first and second derivatives (by `t`) of the three weights of one axis.
pub(super) fn weights(t: f64) -> ([f64; 3], [f64; 3], [f64; 3]) {
    let (a, b) = (0.5 - t, 0.5 + t);
    (
        [0.5 * a * a, 0.75 - t * t, 0.5 * b * b],
        [-a, -2.0 * t, b],
        [1.0, -2.0, 1.0],
    )
}

/// Weights by which three coefficients of spacing `4 h` give the coefficient of spacing `h` whose
/// node is number `local` (0 to 3) of the coarse knot interval: `w - (h / 4h)^2 / 8 * w"`.
pub(super) fn refined_weights(local: usize) -> [f64; 3] {
    let t = (local as f64 + 0.5) / 4.0 - 0.5;
    let (w, _, s) = weights(t);
    std::array::from_fn(|i| w[i] - s[i] / 128.0)
}

/// Value, gradient and Hessian of the spline with coefficients `c[(3 i + j) 3 + k]` at `t`.
pub(super) fn evaluate(c: &[f64; 27], t: &[f64; 3], inv_h: f64) -> Distance {
    let (wx, dx, sx) = weights(t[0]);
    let (wy, dy, sy) = weights(t[1]);
    let (wz, dz, sz) = weights(t[2]);
    let (mut v, mut g, mut hd, mut ho) = (0.0, [0.0; 3], [0.0; 3], [0.0; 3]);
    for i in 0..3 {
        let (mut y00, mut y10, mut y20, mut y01, mut y11, mut y02) = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0);
        for j in 0..3 {
            let r = &c[(3 * i + j) * 3..(3 * i + j) * 3 + 3];
            let z0 = r[0] * wz[0] + r[1] * wz[1] + r[2] * wz[2];
            let z1 = r[0] * dz[0] + r[1] * dz[1] + r[2] * dz[2];
            let z2 = r[0] * sz[0] + r[1] * sz[1] + r[2] * sz[2];
            y00 += wy[j] * z0;
            y10 += dy[j] * z0;
            y20 += sy[j] * z0;
            y01 += wy[j] * z1;
            y11 += dy[j] * z1;
            y02 += wy[j] * z2;
        }
        v += wx[i] * y00;
        g[0] += dx[i] * y00;
        g[1] += wx[i] * y10;
        g[2] += wx[i] * y01;
        hd[0] += sx[i] * y00;
        hd[1] += wx[i] * y20;
        hd[2] += wx[i] * y02;
        ho[0] += dx[i] * y10;
        ho[1] += dx[i] * y01;
        ho[2] += wx[i] * y11;
    }
    let q = inv_h * inv_h;
    Distance {
        value: v,
        gradient: Vec3::new(g[0], g[1], g[2]) * inv_h,
        hessian: Mat3::new(
            hd[0], ho[0], ho[1], ho[0], hd[1], ho[2], ho[1], ho[2], hd[2],
        ) * q,
    }
}

/// The value alone, the same bits as [`evaluate`] gives.
pub(super) fn value(c: &[f64; 27], t: &[f64; 3]) -> f64 {
    let (wx, _, _) = weights(t[0]);
    let (wy, _, _) = weights(t[1]);
    let (wz, _, _) = weights(t[2]);
    let mut v = 0.0;
    for i in 0..3 {
        let mut y00 = 0.0;
        for j in 0..3 {
            let r = &c[(3 * i + j) * 3..(3 * i + j) * 3 + 3];
            y00 += wy[j] * (r[0] * wz[0] + r[1] * wz[1] + r[2] * wz[2]);
        }
        v += wx[i] * y00;
    }
    v
}

/// Distance outside a box from the distance `at` at the nearest point of the box, when the whole
/// surface lies inside it: with `e = point - clamped` and any surface point `s` of the box,
/// `|point - s|^2 >= |e|^2 + |clamped - s|^2`, so that `sqrt(at^2 + |e|^2)` never exceeds the
/// true distance and joins `at` at the border. Its gradient and Hessian are its own.
pub(super) fn beyond_box(at: &Distance, e: &Vec3) -> Distance {
    let sign = if at.value < 0.0 { -1.0 } else { 1.0 };
    let value = (at.value * at.value + e.norm_squared())
        .sqrt()
        .max(f64::MIN_POSITIVE);
    // Clamped axes do not move the clamped point.
    let keep = e.map(|c| if c == 0.0 { 1.0 } else { 0.0 });
    let gc = at.gradient.component_mul(&keep);
    let outer = keep * keep.transpose();
    let free = Mat3::from_diagonal(&keep.map(|k| 1.0 - k));
    // v^2 = a^2 + e^2: v v' = a a' + e, v v" + v' v'^T = a' a'^T + a a" + e'.
    let gradient = (gc * at.value + e) / value;
    let second = gc * gc.transpose() + at.hessian.component_mul(&outer) * at.value + free;
    let hessian = (second - gradient * gradient.transpose()) / value;
    Distance {
        value: sign * value,
        gradient: gradient * sign,
        hessian: hessian * sign,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn refined_coefficients_reproduce_the_coarse_spline() {
        // one axis: 3 coarse coefficients, the fine ones inside the middle interval
        let c = [0.3, -1.1, 2.0];
        for step in 0..9 {
            let x = (1.0 + step as f64 / 4.0) / 4.0 - 0.5; // stays inside fine nodes 0..3
            let (w, _, _) = weights(x);
            let coarse: f64 = (0..3).map(|i| w[i] * c[i]).sum();
            let f = (x + 0.5) * 4.0;
            let i = (f.floor() as usize).min(2);
            let (w, _, _) = weights(f - i as f64 - 0.5);
            let fine: f64 = (0..3)
                .map(|k| {
                    let r = refined_weights(i + k - 1);
                    w[k] * (0..3).map(|m| r[m] * c[m]).sum::<f64>()
                })
                .sum();
            assert!((coarse - fine).abs() < 1e-14, "{coarse} {fine}");
        }
    }
}
