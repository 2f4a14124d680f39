//! Ridges of a membrane ([`Ridge`]) fitted to the tests of a cell, for fabrics whose stiffness depends on strain.
//!
//! A knit gives way until its loops are drawn out and then pulls on its yarn: its stiffness grows a hundredfold within a percent
//! of strain. With hats `h_k` at equidistant strains `s_k`, one step of the tests apart or more,
//!
//! ```text
//! W(e) = 1/2 e^T C e + sum_r phi_r(d_r . e),   phi_r'' = sum_k c_rk h_k,   c_rk >= 0
//! ```
//!
//! is linear in the unknowns `c_rk`, and so is its stress. They are those of least squares of the errors over `W` and, with a
//! weight, over the size of the stress; differences of neighbouring `c_rk` count a little as well, as spikes follow nothing. `C` is a small part of the stiffness without ridges, so that the material is positive
//! definite where the ridges tell nothing. The last hats are those before the largest strain, and go on from there: what
//! is stiff at the end of the tests stays so beyond it. SI units.

use super::fit::{FLOOR, Range, Sample, energy, errors, weights};
use super::nonnegative::nonnegative;
use crate::error::{Error, Result};
use crate::pattern::Ridge;
use nalgebra::{DMatrix, DVector, Vector3};

/// Directions `(E11, E22, 2 E12)`, the last over the largest stretch and times the largest shear of the tests.
const DIRECTIONS: [[f64; 3]; 17] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [1.0, 1.0, 0.0],
    [1.0, 0.5, 0.0],
    [0.5, 1.0, 0.0],
    [1.0, 0.75, 0.0],
    [0.75, 1.0, 0.0],
    [1.0, -1.0, 0.0],
    [1.0, -0.5, 0.0],
    [0.5, -1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 0.0, 0.5],
    [1.0, 0.0, -0.5],
    [0.0, 1.0, 0.5],
    [0.0, 1.0, -0.5],
    [1.0, 1.0, 0.5],
    [1.0, 1.0, -0.5],
];
/// Weight of an error of stress beside one of energy.
const STRESS: f64 = 0.1;
/// Weight of a difference of neighbouring stiffnesses beside the errors that they make.
const SMOOTH: f64 = 0.03;
/// Most strains of a ridge within the largest stretch of the tests; if there are more steps, the strains are further apart.
const MOST_STEPS: usize = 40;

/// A membrane with ridges.
#[derive(Clone, Debug, PartialEq)]
pub struct Ridged {
    /// `(weft, coupling, warp, shear)` beside the ridges [N/m].
    pub membrane: [f64; 4],
    /// The ridges.
    pub ridges: Vec<Ridge>,
    /// Root mean square and largest error of the energy, each over the yarns'.
    pub errors: [f64; 2],
}

impl Ridged {
    /// `W` [J/m^2].
    pub fn energy(&self, strain: &Vector3<f64>) -> f64 {
        let ridges = self.ridges.iter();
        energy(&self.membrane, strain)
            + ridges
                .map(|r| r.at(r.direction().dot(strain)).energy)
                .sum::<f64>()
    }
}

/// Strains along a direction at which its stiffness is sought.
fn knots(direction: &Vector3<f64>, samples: &[Sample], step: f64) -> Vec<f64> {
    let reach = |side: f64| {
        let along = samples.iter().map(|s| side * direction.dot(&s.strain));
        along.fold(0.0, f64::max)
    };
    // one less than lead to the end, where stiffness goes on
    let count = |reach: f64| ((reach / step).round() as i64 - 1).max(0);
    (-count(reach(-1.0))..=count(reach(1.0)))
        .map(|k| k as f64 * step)
        .collect()
}

/// Fits ridges beside a small part of the membrane that fits best without them.
pub fn ridged(samples: &[Sample], without: &[f64; 4], range: &Range) -> Result<Ridged> {
    let least = FLOOR * without[0].max(without[2]);
    let membrane = [least, 0.0, least, least];
    let step = range.stretch / range.steps.min(MOST_STEPS) as f64;
    let directions =
        DIRECTIONS.map(|d| Vector3::new(d[0], d[1], d[2] * range.stretch / range.shear));
    let strains: Vec<Vec<f64>> = (directions.iter())
        .map(|d| knots(d, samples, step))
        .collect();
    let mut hats = Vec::new();
    for (direction, strains) in directions.iter().zip(&strains) {
        for k in 0..strains.len() {
            let mut hat = vec![0.0; strains.len()];
            hat[k] = 1.0;
            hats.push(Ridge::new(*direction, strains.clone(), hat)?);
        }
    }
    let rows = 4 * samples.len() + hats.len();
    let (mut a, mut b) = (DMatrix::zeros(rows, hats.len()), DVector::zeros(rows));
    let energies = weights(samples.iter().map(|s| s.energy));
    let stresses = weights(samples.iter().map(|s| s.stress.norm()));
    for (i, sample) in samples.iter().enumerate() {
        let e = &sample.strain;
        let [energy_row, stress_row] = [energies[i], STRESS * stresses[i]];
        b[4 * i] = (sample.energy - energy(&membrane, e)) * energy_row;
        for k in 0..3 {
            b[4 * i + 1 + k] = (sample.stress[k] - least * e[k]) * stress_row;
        }
        for (j, hat) in hats.iter().enumerate() {
            let d = hat.direction();
            let value = hat.at(d.dot(e));
            a[(4 * i, j)] = value.energy * energy_row;
            for k in 0..3 {
                a[(4 * i + 1 + k, j)] = value.slope * d[k] * stress_row;
            }
        }
    }
    // neighbours of one direction differ little where the tests do not ask for it
    let mut row = 4 * samples.len();
    let sizes: Vec<f64> = a.column_iter().map(|c| c.norm()).collect();
    for j in 1..hats.len() {
        if hats[j].direction() == hats[j - 1].direction() {
            let weight = SMOOTH * sizes[j].max(sizes[j - 1]);
            a[(row, j)] = weight;
            a[(row, j - 1)] = -weight;
            row += 1;
        }
    }
    let found = nonnegative(&a, &b).ok_or_else(|| {
        Error::material("the tests do not tell the ridges of the membrane".to_owned())
    })?;
    let mut ridges = Vec::new();
    let mut first = 0;
    for (direction, strains) in directions.iter().zip(strains) {
        let stiffness = &found.as_slice()[first..first + strains.len()];
        first += strains.len();
        let near = |k: usize| &stiffness[k.saturating_sub(1)..(k + 2).min(stiffness.len())];
        // zeros between zeros tell nothing
        let (strains, stiffness): (Vec<f64>, Vec<f64>) = (0..strains.len())
            .filter(|k| near(*k).iter().any(|c| *c > 0.0))
            .map(|k| (strains[k], stiffness[k]))
            .unzip();
        if !strains.is_empty() {
            ridges.push(Ridge::new(*direction, strains, stiffness)?);
        }
    }
    let mut out = Ridged {
        membrane,
        ridges,
        errors: [0.0; 2],
    };
    out.errors = errors(samples, |e| out.energy(e));
    Ok(out)
}
