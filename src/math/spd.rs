//! Projection of small symmetric matrices onto the positive semi-definite cone.

use super::{Mat2, Mat3};

/// Nearest positive semi-definite matrix in the Frobenius norm: negative eigenvalues become 0.
///
/// Closed form: with mean `m` and radius `r` of the two eigenvalues `m +- r`.
pub fn project2(a: &Mat2) -> Mat2 {
    let mean = 0.5 * (a[(0, 0)] + a[(1, 1)]);
    let half = 0.5 * (a[(0, 0)] - a[(1, 1)]);
    let off = 0.5 * (a[(0, 1)] + a[(1, 0)]);
    let radius = half.hypot(off);
    if mean >= radius {
        return Mat2::new(a[(0, 0)], off, off, a[(1, 1)]);
    }
    if mean <= -radius {
        return Mat2::zeros();
    }
    // one positive eigenvalue `mean + radius` with projector (A - (mean - radius) I) / (2 radius)
    let scale = (mean + radius) / (2.0 * radius);
    Mat2::new(half + radius, off, off, radius - half) * scale
}

/// Same for 3x3, by eigenvalues.
pub fn project3(a: &Mat3) -> Mat3 {
    let symmetric = (a + a.transpose()) * 0.5;
    let mut eigen = symmetric.symmetric_eigen();
    if eigen.eigenvalues.min() >= 0.0 {
        return symmetric;
    }
    eigen.eigenvalues.iter_mut().for_each(|v| *v = v.max(0.0));
    eigen.recompose()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn projection_keeps_the_positive_part_only() {
        for k in 0..200 {
            let f = |i: i32| (f64::from(k * 7 + i) * 1.7).sin() * 3.0;
            let a = Mat2::new(f(1), f(2), f(2), f(3));
            let p = project2(&a);
            let mut eigen = a.symmetric_eigen();
            eigen.eigenvalues.iter_mut().for_each(|v| *v = v.max(0.0));
            assert!((p - eigen.recompose()).norm() < 1e-13);
            let b = Mat3::new(f(1), f(2), f(3), f(2), f(4), f(5), f(3), f(5), f(6));
            let q = project3(&b);
            assert!(q.symmetric_eigenvalues().min() > -1e-13);
            assert!((project3(&q) - q).norm() < 1e-13);
            // what was cut is negative
            assert!((b - q).symmetric_eigenvalues().max() < 1e-13);
        }
    }
}
