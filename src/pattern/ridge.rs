//! A ridge function of the strain: the part of a membrane that stiffens along one direction.
//!
//! With the Green strain `e = (E11, E22, 2 E12)` in the (weft, warp) frame a fabric's membrane has, per rest area,
//!
//! ```text
//! W(e) = 1/2 e^T C e + sum_r phi_r(s_r),   s_r = d_r . e,   phi_r(0) = phi_r'(0) = 0,   phi_r'' >= 0
//! ```
//!
//! `phi''` is linear between given strains `s` and constant beyond them, so that `phi` is a cubic spline that continues as a
//! parabola. Every ridge is convex in the strain: the second derivative by strain, `C + sum_r phi_r'' d_r d_r^T`, is positive
//! definite wherever `C` is. No strain, no stress. SI units: `phi` [J/m^2], `phi''` [N/m].

use crate::error::{Error, Result};
use crate::math::Vec3;

/// Most strains of one ridge.
const MAX_STRAINS: usize = 1000;

/// Energy, slope and stiffness of a ridge at one strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RidgeValue {
    /// `phi` [J/m^2].
    pub energy: f64,
    /// `phi'` [N/m].
    pub slope: f64,
    /// `phi''` [N/m].
    pub stiffness: f64,
}

/// One ridge.
#[derive(Clone, Debug, PartialEq)]
pub struct Ridge {
    direction: Vec3,
    strains: Vec<f64>,
    stiffness: Vec<f64>,
    /// Strains, 0 among them, with the values there.
    nodes: Vec<(f64, RidgeValue)>,
}

impl Ridge {
    /// A ridge along `direction` with `phi''` at growing strains. Refuses what is not finite, a direction of no length,
    /// strains that do not grow, and negative stiffness.
    pub fn new(direction: Vec3, strains: Vec<f64>, stiffness: Vec<f64>) -> Result<Self> {
        let finite = direction.iter().all(|d| d.is_finite());
        if !finite || direction.norm() <= 0.0 {
            return Err(Error::material(format!(
                "direction = {:?} must be finite and not zero",
                direction.as_slice()
            )));
        }
        if !(1..=MAX_STRAINS).contains(&strains.len()) || strains.len() != stiffness.len() {
            return Err(Error::material(format!(
                "{} strains and {} stiffnesses: there must be as many of both, 1 to {MAX_STRAINS}",
                strains.len(),
                stiffness.len()
            )));
        }
        for (k, s) in strains.iter().enumerate() {
            if !s.is_finite() || (k > 0 && *s <= strains[k - 1]) {
                return Err(Error::material(format!(
                    "strain[{k}] = {s} must be finite and above the one before"
                )));
            }
        }
        for (k, c) in stiffness.iter().enumerate() {
            if !c.is_finite() || *c < 0.0 {
                return Err(Error::material(format!(
                    "stiffness[{k}] = {c} must be finite and not negative"
                )));
            }
        }
        let nodes = nodes(&strains, &stiffness);
        Ok(Self {
            direction,
            strains,
            stiffness,
            nodes,
        })
    }

    /// `d`.
    pub fn direction(&self) -> &Vec3 {
        &self.direction
    }

    /// Strains at which the stiffness is given.
    pub fn strains(&self) -> &[f64] {
        &self.strains
    }

    /// `phi''` there [N/m].
    pub fn stiffness(&self) -> &[f64] {
        &self.stiffness
    }

    /// The ridge at a strain `s = d . e`.
    pub fn at(&self, s: f64) -> RidgeValue {
        let next = self.nodes.partition_point(|n| n.0 <= s);
        let (x, from) = self.nodes[next.saturating_sub(1)];
        let rate = match self.nodes.get(next) {
            Some((y, to)) if next > 0 => (to.stiffness - from.stiffness) / (y - x),
            _ => 0.0,
        };
        grown(&from, s - x, rate)
    }
}

/// A distance `t` on, where the stiffness grows at `rate`.
fn grown(from: &RidgeValue, t: f64, rate: f64) -> RidgeValue {
    RidgeValue {
        energy: from.energy + t * (from.slope + t * (0.5 * from.stiffness + t * rate / 6.0)),
        slope: from.slope + t * (from.stiffness + 0.5 * t * rate),
        stiffness: from.stiffness + t * rate,
    }
}

/// Integrates the stiffness twice from strain 0 to either side.
fn nodes(strains: &[f64], stiffness: &[f64]) -> Vec<(f64, RidgeValue)> {
    let mut points: Vec<(f64, f64)> = strains
        .iter()
        .copied()
        .zip(stiffness.iter().copied())
        .collect();
    let place = points.partition_point(|p| p.0 < 0.0);
    if points.get(place).is_none_or(|p| p.0 > 0.0) {
        let here = match (place.checked_sub(1).map(|k| points[k]), points.get(place)) {
            (Some(a), Some(b)) => a.1 + (b.1 - a.1) * a.0 / (a.0 - b.0),
            (Some(end), None) => end.1,
            (None, Some(end)) => end.1,
            (None, None) => 0.0,
        };
        points.insert(place, (0.0, here));
    }
    let value = |stiffness: f64| RidgeValue {
        energy: 0.0,
        slope: 0.0,
        stiffness,
    };
    let mut nodes: Vec<(f64, RidgeValue)> = points.iter().map(|p| (p.0, value(p.1))).collect();
    let mut reach = |from: usize, to: usize| {
        let ((x, a), (y, b)) = (nodes[from], nodes[to]);
        let rate = (b.stiffness - a.stiffness) / (y - x);
        let there = grown(&a, y - x, rate);
        nodes[to].1 = RidgeValue {
            stiffness: b.stiffness,
            ..there
        };
    };
    for k in place + 1..points.len() {
        reach(k - 1, k);
    }
    for k in (0..place).rev() {
        reach(k + 1, k);
    }
    nodes
}

#[cfg(test)]
#[allow(clippy::unwrap_used, reason = "a test may panic")]
mod tests {
    use super::*;

    fn ridge(strains: &[f64], stiffness: &[f64]) -> Ridge {
        Ridge::new(Vec3::x(), strains.to_vec(), stiffness.to_vec()).unwrap()
    }

    #[test]
    fn energy_and_slope_are_the_integrals_of_the_stiffness_and_vanish_at_rest() {
        for r in [
            ridge(&[-0.02, 0.01, 0.05], &[4.0, 0.0, 90.0]),
            ridge(&[0.0, 0.03], &[5.0, 1.0]),
            ridge(&[0.01, 0.03], &[5.0, 1.0]),
            ridge(&[-0.03, -0.01], &[0.0, 7.0]),
            ridge(&[0.02], &[3.0]),
        ] {
            assert_eq!((r.at(0.0).energy, r.at(0.0).slope), (0.0, 0.0), "{r:?}");
            let h = 1e-5;
            for k in -100..=100 {
                let s = 1.003e-3 * f64::from(k);
                let [a, b, c] = [s - h, s, s + h].map(|s| r.at(s));
                let (slope, stiffness) = (
                    (c.energy - a.energy) / (2.0 * h),
                    (c.slope - a.slope) / (2.0 * h),
                );
                assert!((slope - b.slope).abs() < 1e-6, "{s} {slope} {b:?}");
                assert!(
                    (stiffness - b.stiffness).abs() < 0.05,
                    "{s} {stiffness} {b:?}"
                );
                assert!(b.energy >= 0.0 && b.stiffness >= 0.0, "{s} {b:?}");
            }
        }
        // a single stiffness is a parabola
        let r = ridge(&[0.02], &[3.0]);
        assert!((r.at(-0.4).energy - 0.5 * 3.0 * 0.16).abs() < 1e-15);
        // constant beyond the strains
        let r = ridge(&[-0.02, 0.01], &[4.0, 9.0]);
        assert_eq!((r.at(-1.0).stiffness, r.at(1.0).stiffness), (4.0, 9.0));
    }

    #[test]
    fn ridges_that_cannot_be_are_refused() {
        for (direction, strains, stiffness) in [
            (Vec3::zeros(), vec![0.0], vec![1.0]),
            (Vec3::new(f64::NAN, 1.0, 0.0), vec![0.0], vec![1.0]),
            (Vec3::x(), vec![], vec![]),
            (Vec3::x(), vec![0.0, 0.1], vec![1.0]),
            (Vec3::x(), vec![0.1, 0.1], vec![1.0, 1.0]),
            (Vec3::x(), vec![f64::INFINITY], vec![1.0]),
            (Vec3::x(), vec![0.0], vec![-1.0]),
            (Vec3::x(), vec![0.0; 1001], vec![1.0; 1001]),
        ] {
            assert!(Ridge::new(direction, strains, stiffness).is_err());
        }
    }
}
