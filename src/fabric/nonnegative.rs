//! Least squares with unknowns that are not negative.
//!
//! ```text
//! min |A x - b|^2 + lambda |D x|^2,   x >= 0,   D = lengths of the columns of A
//! ```
//!
//! by the active sets of Lawson and Hanson (Solving Least Squares Problems, 1974, chapter 23) on the normal equations. The small
//! `lambda` makes them definite, so that the solution is the only one and is found in finitely many exchanges.

use nalgebra::{DMatrix, DVector};

/// `lambda`.
const DAMPING: f64 = 1e-10;
/// Slope of the error, over the largest at 0, that counts as none.
const FLAT: f64 = 1e-10;

/// The solution, or `None` if numbers are not finite or exchanges do not end.
pub(super) fn nonnegative(a: &DMatrix<f64>, b: &DVector<f64>) -> Option<DVector<f64>> {
    let count = a.ncols();
    if a.iter().chain(b).any(|v| !v.is_finite()) {
        return None;
    }
    // unknowns of one size; a column of zeros tells nothing and stays out
    let scale: Vec<f64> = a
        .column_iter()
        .map(|c| if c.norm() > 0.0 { 1.0 / c.norm() } else { 0.0 })
        .collect();
    let mut scaled = a.clone();
    for (mut column, s) in scaled.column_iter_mut().zip(&scale) {
        column *= *s;
    }
    let mut gram = scaled.tr_mul(&scaled);
    for k in 0..count {
        gram[(k, k)] += DAMPING;
    }
    let right = scaled.tr_mul(b);
    let flat = FLAT * right.amax();
    let mut x = DVector::zeros(count);
    let mut free = vec![false; count];
    for _ in 0..10 * count + 10 {
        let slope = &right - &gram * &x;
        let best = (0..count)
            .filter(|k| !free[*k])
            .max_by(|i, j| slope[*i].total_cmp(&slope[*j]));
        match best {
            Some(k) if slope[k] > flat => free[k] = true,
            _ => return Some(DVector::from_fn(count, |k, _| x[k] * scale[k])),
        }
        loop {
            let own: Vec<usize> = (0..count).filter(|k| free[*k]).collect();
            let part = DMatrix::from_fn(own.len(), own.len(), |i, j| gram[(own[i], own[j])]);
            let aim = part
                .cholesky()?
                .solve(&DVector::from_fn(own.len(), |i, _| right[own[i]]));
            // as far as none becomes negative
            let reach = (own.iter().zip(&aim))
                .filter(|(_, aim)| **aim <= 0.0)
                .map(|(k, aim)| x[*k] / (x[*k] - aim))
                .fold(1.0, f64::min);
            let negative = aim.iter().any(|v| *v <= 0.0);
            for (k, aim) in own.iter().zip(&aim) {
                x[*k] += reach * (aim - x[*k]);
                if negative && (*aim <= 0.0 && x[*k] <= 4.0 * f64::EPSILON * x.amax()) {
                    x[*k] = 0.0;
                    free[*k] = false;
                }
            }
            if !negative {
                break;
            }
        }
    }
    None
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    /// Unknowns that are above 0 have no slope, the others none that leads below the error: the conditions of the minimum.
    #[test]
    fn the_solution_meets_the_conditions_of_the_minimum() {
        let mut held = 0;
        for seed in 0..20 {
            let f = |i: usize, j: usize| ((i * 7 + j * 13 + seed * 5) as f64 * 1.7).sin();
            let a = DMatrix::from_fn(30, 12, |i, j| f(i, j) + 0.5 * f(i, 3));
            let b = DVector::from_fn(30, |i, _| f(i, 40));
            let x = nonnegative(&a, &b).unwrap();
            let slope = a.tr_mul(&(&b - &a * &x));
            for k in 0..12 {
                assert!(x[k] >= 0.0);
                assert!(slope[k] < 1e-8, "{seed} {k}: {}", slope[k]);
                assert!(x[k] == 0.0 || slope[k].abs() < 1e-8, "{seed} {k}");
                held += u32::from(x[k] == 0.0);
            }
        }
        assert!(held > 20, "{held}");
        // what has a solution above 0 is solved
        let a = DMatrix::from_fn(9, 3, |i, j| ((i + 1) as f64).powi(j as i32));
        let want = DVector::from_vec(vec![1.0, 0.5, 0.25]);
        assert!((nonnegative(&a, &(&a * &want)).unwrap() - want).amax() < 1e-6);
        assert!(nonnegative(&DMatrix::from_element(2, 2, f64::NAN), &DVector::zeros(2)).is_none());
    }
}
