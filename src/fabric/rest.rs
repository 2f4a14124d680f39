//! How a fabric lies when nothing pulls: the size of its cell at rest (Cirio et al. 2017, section 4.1).
//!
//! A knit that is laid as its numbers say is bent and wrapped and draws itself together. With the factors
//! `l = (across, along)` on the flat layout the rest is
//!
//! ```text
//! min W(diag(l_1, l_2)),   dW/dl_k = P_kk = 0
//! ```
//!
//! Courses stay across wales: a cell whose lattice is wholly free may shear as well, to either side, which a panel cut along
//! the grain does not follow. Yarns slide where friction lets them, first as the fabric comes to rest at a size, then while
//! the size changes; in between Newton's method moves the size with the contacts held, where `W` is smooth. SI units.

use super::cell::PeriodicCell;
use super::known::Known;
use crate::error::{Error, Result};
use crate::math::{Mat2, Vec2};
use crate::pattern::Garment;
use crate::pattern::yarn_fabric::YarnFabric;
use crate::solve::settings::Settings;
use crate::yarn::Cell;
use nalgebra::{Matrix3x2, SymmetricEigen};

/// Largest change of a factor in one correction.
const MOST: f64 = 0.05;
/// Change of the factors below which they are those of rest.
const STEADY: f64 = 1e-6;
/// Difference of a factor that tells the stiffness.
const DIFFERENCE: f64 = 1e-4;
/// Corrections of the size.
const ROUNDS: usize = 60;

/// A fabric at rest.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rest {
    /// Size at rest over that of the layout, across and along.
    pub factors: [f64; 2],
    /// Energy per laid area as laid, everything inside relaxed, and at rest [J/m^2].
    pub energies: [f64; 2],
    /// Largest stress that is left [N/m].
    pub stress: f64,
    /// Corrections of everything inside.
    pub corrections: u64,
}

/// Sizes found while the program runs.
static KNOWN: Known<Cell> = Known::new();

/// How the fabrics of a garment are laid: compensated ones at their size at rest, if the garment is laid as yarns there
/// (`laid`, by fabric).
pub fn cells(
    garment: &Garment,
    laid: impl Fn(usize) -> bool,
    settings: &Settings,
) -> Result<Vec<Cell>> {
    let cell = |k: usize| match &garment.fabrics[k].yarns {
        Some(yarns) if yarns.compensated && laid(k) => compensated(yarns, settings)
            .map_err(|e| e.at(format!("fabric '{}'", garment.fabrics[k].name))),
        _ => Ok(Cell::default()),
    };
    (0..garment.fabrics.len()).map(cell).collect()
}

fn compensated(yarns: &YarnFabric, settings: &Settings) -> Result<Cell> {
    KNOWN.of(yarns, settings, || {
        let mut cell = PeriodicCell::one(yarns, settings)?;
        let [across, along] = rest(&mut cell)?.factors;
        if cell.folds() {
            return Err(Error::material(format!(
                "yarns.compensated: at rest ({across:.3} of its width, {along:.3} of its height) the fabric folds onto itself, and yarns are laid flat"
            )));
        }
        Ok(Cell {
            across,
            along,
            rest: 1.0,
        })
    })
}

/// `diag(factors)` as a gradient to space.
pub fn sized(factors: [f64; 2]) -> Matrix3x2<f64> {
    let mut f = Matrix3x2::zeros();
    (f[(0, 0)], f[(1, 1)]) = (factors[0], factors[1]);
    f
}

/// Brings a cell to its size at rest and leaves it there, its contacts held where they slid to.
pub fn rest(cell: &mut PeriodicCell) -> Result<Rest> {
    let mut factors = Vec2::new(1.0, 1.0);
    let mut corrections = cell.relax(cell.nothing())?;
    let laid = cell.energy()?;
    for _ in 0..ROUNDS {
        let stress = tension(cell)?;
        let stiffness = stiffness(cell, factors, &mut corrections)?;
        let eigen = SymmetricEigen::new(stiffness);
        let largest = eigen.eigenvalues.amax();
        // down the slope where the size is not stable
        let values = eigen.eigenvalues.map(|v| 1.0 / v.abs().max(1e-3 * largest));
        let inverse =
            eigen.eigenvectors * Mat2::from_diagonal(&values) * eigen.eigenvectors.transpose();
        let step = -(inverse * stress);
        let step = step * (MOST / step.amax()).min(1.0);
        factors += step;
        cell.stretch(&sized(factors.into()));
        corrections += cell.relax(cell.nothing())?;
        if step.amax() < STEADY {
            if let Some(steps) = cell.missing() {
                return Err(Error::material(format!(
                    "at rest ({:.3} of its width, {:.3} of its height) the fabric folds onto its image {steps:?} repeats away, which is too far to touch in a periodic cell",
                    factors.x, factors.y
                )));
            }
            cell.set_sliding(false)?;
            return Ok(Rest {
                factors: factors.into(),
                energies: [laid, cell.energy()?],
                stress: tension(cell)?.amax(),
                corrections,
            });
        }
    }
    Err(Error::material(format!(
        "the fabric finds no size at rest: {:.4} of its width and {:.4} of its height as laid after {ROUNDS} corrections",
        factors.x, factors.y
    )))
}

/// `dW/dl`.
fn tension(cell: &mut PeriodicCell) -> Result<Vec2> {
    let p = cell.stress()?;
    Ok(Vec2::new(p[(0, 0)], p[(1, 1)]))
}

/// `d2W/dl2` with the contacts held, by differences.
fn stiffness(cell: &mut PeriodicCell, at: Vec2, corrections: &mut u64) -> Result<Mat2> {
    let kept = cell.checkpoint();
    cell.set_sliding(false)?;
    let mut columns = [Vec2::zeros(); 2];
    for (k, column) in columns.iter_mut().enumerate() {
        for side in [1.0, -1.0] {
            let mut moved = at;
            moved[k] += side * DIFFERENCE;
            cell.stretch(&sized(moved.into()));
            *corrections += cell.relax(cell.nothing())?;
            *column += tension(cell)? * (side / (2.0 * DIFFERENCE));
        }
    }
    cell.set_sliding(true)?;
    cell.roll_back(kept);
    let all = Mat2::from_columns(&columns);
    Ok((all + all.transpose()) * 0.5)
}
