//! Finite differences, the twin of every analytic derivative.

/// Result of comparing a derivative with central differences.
#[derive(Clone, Copy, Debug)]
pub struct Agreement {
    /// Smallest error over the step sizes, relative to the largest entry of the two.
    pub error: f64,
    /// Observed order between the two largest step sizes; infinite where both errors vanish.
    pub order: f64,
}

/// Compares `analytic`, the derivative of `f` along a direction, with central differences of
/// `f(s)` at `s = +-h` for each step of `steps` (largest first). `scale` is added to the largest
/// entry, so that a derivative that is 0 is not measured against rounding.
pub fn compare(
    analytic: &[f64],
    mut f: impl FnMut(f64) -> Vec<f64>,
    steps: &[f64],
    scale: f64,
) -> Agreement {
    let mut errors = Vec::with_capacity(steps.len());
    for &h in steps {
        let (plus, minus) = (f(h), f(-h));
        let mut largest = scale;
        let mut error = 0.0_f64;
        for ((p, m), a) in plus.iter().zip(&minus).zip(analytic) {
            let d = (p - m) / (2.0 * h);
            largest = largest.max(d.abs()).max(a.abs());
            let gap = (d - a).abs();
            error = if gap.is_nan() {
                f64::INFINITY
            } else {
                error.max(gap)
            };
        }
        errors.push(if largest > 0.0 {
            error / largest
        } else {
            error
        });
    }
    let order = match (errors.first(), errors.get(1)) {
        (Some(&a), Some(&b)) if b > 0.0 => (a / b).ln() / (steps[0] / steps[1]).ln(),
        _ => f64::INFINITY,
    };
    Agreement {
        error: errors.iter().copied().fold(f64::INFINITY, f64::min),
        order,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_true_derivative_agrees_with_order_two_and_a_wrong_one_does_not() {
        let steps = [1e-1, 1e-2, 1e-4, 1e-5];
        let right = compare(&[1.0_f64.cos()], |s| vec![(1.0 + s).sin()], &steps, 0.0);
        assert!(right.error < 1e-9 && (right.order - 2.0).abs() < 0.05);
        let wrong = compare(
            &[1.001 * 1.0_f64.cos()],
            |s| vec![(1.0 + s).sin()],
            &steps,
            0.0,
        );
        assert!(wrong.error > 5e-4);
    }
}
