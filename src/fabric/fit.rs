//! The triangles' material of a fabric, fitted to its yarns by tests on the periodic cell.
//!
//! The cell is brought to rest ([`rest`](super::rest)); from there it is stretched across, along and both ways, pressed together one way, also while
//! it is stretched the other, sheared, and both at once, in steps, with the contacts held where they slid to, so that there is one energy of the strain. With the Green
//! strain `E` against the size at rest and `W` per area at rest, less that at rest,
//!
//! ```text
//! W ~ 1/2 (weft E11^2 + 2 coupling E11 E22 + warp E22^2 + shear (2 E12)^2)
//! W ~ M kappa + 1/2 B kappa^2 = 1/2 B (kappa - kappa0)^2 - const,   kappa0 = -M/B
//! ```
//!
//! by least squares of the errors over `W`, so that small strains count like large ones. A fabric that this does not follow has
//! ridges as well ([`ridges`](super::ridges)). The stress at rest is left out, of `W` too: a knit held square has one of shear. In bending tests the width across is
//! that at rest and the length is free. What the fit leaves is told as an error of energy. SI units.

use super::cell::PeriodicCell;
use super::rest::{Rest, rest, sized};
use super::ridges::{Ridged, ridged};
use crate::error::{Error, Result};
use crate::pattern::Fabric;
use crate::pattern::yarn_fabric::{Structure, YarnFabric};
use crate::solve::settings::Settings;
use nalgebra::{Matrix2, Matrix3x2, Matrix4, Vector2, Vector3, Vector4};

/// Least weight of an energy, over the largest.
const LEAST: f64 = 1e-6;
/// Error of energy, root mean square, above which a fabric gets ridges.
const FOLLOWS: f64 = 0.02;
/// Least stiffness of a fit over its largest: a material must be positive definite.
pub(super) const FLOOR: f64 = 1e-4;

/// Largest strains and curvatures of the tests, and how many steps lead there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Range {
    /// Green strain `E11`, `E22`.
    pub stretch: f64,
    /// Strain, without its sign, of a direction that is pressed together, alone or while the other is stretched; 0 for no such
    /// tests.
    pub press: f64,
    /// Shear strain `2 E12`.
    pub shear: f64,
    /// Curvature [1/m].
    pub curvature: f64,
    /// Steps.
    pub steps: usize,
}

impl Range {
    /// What suits a fabric: yarns of a weave are stretched at once, loops of a knit give way first, by drawing in across.
    /// A weave that is pressed together buckles as a sheet long before its yarns do between their crossings.
    pub fn of(fabric: &YarnFabric) -> Self {
        let [a, b] = fabric.structure.pitch();
        let (stretch, press, steps) = match fabric.structure {
            Structure::Woven(_) => (0.01, 0.0, 4),
            Structure::Knitted(_) => (0.1, 0.1, 20),
        };
        Self {
            stretch,
            press,
            shear: 0.1,
            curvature: 0.15 / a.max(b),
            steps,
        }
    }

    /// Where a test ends.
    pub fn end(&self, direction: &[f64; 3]) -> Vector3<f64> {
        let plane = |d: f64| d * if d < 0.0 { self.press } else { self.stretch };
        let [weft, warp, shear] = *direction;
        Vector3::new(plane(weft), plane(warp), shear * self.shear)
    }
}

/// A test: strains grow along a direction, over the largest of their range.
pub const TESTS: [(&str, [f64; 3]); 25] = [
    ("weft", [1.0, 0.0, 0.0]),
    ("warp", [0.0, 1.0, 0.0]),
    ("both", [1.0, 1.0, 0.0]),
    ("weft, half warp", [1.0, 0.5, 0.0]),
    ("warp, half weft", [0.5, 1.0, 0.0]),
    ("weft pressed", [-1.0, 0.0, 0.0]),
    ("warp pressed", [0.0, -1.0, 0.0]),
    ("weft, less warp", [1.0, -1.0, 0.0]),
    ("warp, less weft", [-1.0, 1.0, 0.0]),
    ("weft, half less warp", [1.0, -0.5, 0.0]),
    ("warp, half less weft", [-0.5, 1.0, 0.0]),
    ("weft, quarter less warp", [1.0, -0.25, 0.0]),
    ("warp, quarter less weft", [-0.25, 1.0, 0.0]),
    ("shear", [0.0, 0.0, 1.0]),
    ("shear back", [0.0, 0.0, -1.0]),
    ("weft and shear", [1.0, 0.0, 1.0]),
    ("warp and shear", [0.0, 1.0, 1.0]),
    ("weft and shear back", [1.0, 0.0, -1.0]),
    ("warp and shear back", [0.0, 1.0, -1.0]),
    ("both and shear", [1.0, 1.0, 1.0]),
    ("both and shear back", [1.0, 1.0, -1.0]),
    ("weft, less warp, shear", [1.0, -1.0, 1.0]),
    ("weft, less warp, shear back", [1.0, -1.0, -1.0]),
    ("warp, less weft, shear", [-1.0, 1.0, 1.0]),
    ("warp, less weft, shear back", [-1.0, 1.0, -1.0]),
];

/// The cell at one strain.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sample {
    /// Number of the test in [`TESTS`].
    pub test: usize,
    /// `(E11, E22, 2 E12)`.
    pub strain: Vector3<f64>,
    /// `W`, less the work of the stress at rest [J/m^2].
    pub energy: f64,
    /// Second Piola-Kirchhoff stress `(S11, S22, S12)`, less that at rest [N/m].
    pub stress: Vector3<f64>,
}

/// The cell at one curvature.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BentSample {
    /// Which direction is curved: 0 weft, 1 warp.
    pub axis: usize,
    /// Curvature, positive to the front [1/m].
    pub curvature: f64,
    /// `W` [J/m^2].
    pub energy: f64,
}

/// Bending of one direction.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Bending {
    /// `B` [N m].
    pub rigidity: f64,
    /// `M`, the moment per width of the flat fabric [N].
    pub moment: f64,
    /// Largest error of the energy over the largest energy.
    pub error: f64,
}

impl Bending {
    /// Curvature at rest, positive to the front [1/m].
    pub fn rest(&self) -> f64 {
        -self.moment / self.rigidity
    }
}

/// What the tests of a fabric came to.
#[derive(Clone, Debug, PartialEq)]
pub struct Fit {
    /// Size at rest.
    pub rest: Rest,
    /// Mass per area at rest [kg/m^2].
    pub density: f64,
    /// Tests of the membrane.
    pub samples: Vec<Sample>,
    /// Tests of bending.
    pub bent: Vec<BentSample>,
    /// `(weft, coupling, warp, shear)` without ridges [N/m].
    pub membrane: [f64; 4],
    /// Root mean square and largest error of its energy, each over the yarns'.
    pub errors: [f64; 2],
    /// The membrane with ridges, where the one without does not follow the yarns.
    pub ridged: Option<Ridged>,
    /// Bending that curves the weft, the warp.
    pub bending: [Bending; 2],
    /// Corrections of everything inside that all tests took.
    pub corrections: u64,
}

/// `W` of the material `(weft, coupling, warp, shear)` [J/m^2].
pub fn energy(membrane: &[f64; 4], strain: &Vector3<f64>) -> f64 {
    basis(strain).dot(&Vector4::from(*membrane))
}

fn basis(e: &Vector3<f64>) -> Vector4<f64> {
    Vector4::new(0.5 * e.x * e.x, e.x * e.y, 0.5 * e.y * e.y, 0.5 * e.z * e.z)
}

/// Fits a fabric's material.
pub fn fit(fabric: &YarnFabric, range: &Range, settings: &Settings) -> Result<Fit> {
    // smaller ones would measure the force to which the cell comes to rest
    for (name, value, least, most) in [
        ("stretch", range.stretch, 1e-4, 1.0),
        ("shear", range.shear, 1e-4, 1.0),
        // the area vanishes at 0.5
        ("press", range.press, 0.0, 0.45),
        ("curvature", range.curvature, 1e-2, 1e5),
    ] {
        if !(least..=most).contains(&value) {
            return Err(Error::argument(format!(
                "{name} of the tests = {value} must lie in [{least}, {most}]"
            )));
        }
    }
    if !(1..=1000).contains(&range.steps) {
        return Err(Error::argument(format!(
            "{} steps of the tests, must be 1 to 1000",
            range.steps
        )));
    }
    let mut cell = PeriodicCell::one(fabric, settings)?;
    let at_rest = rest(&mut cell)?;
    let mut corrections = at_rest.corrections + cell.relax(cell.nothing())?;
    let area: f64 = at_rest.factors.iter().product();
    let start = (cell.energy()?, second(&mut cell, at_rest.factors)?);
    let kept = cell.checkpoint();
    let mut samples = Vec::with_capacity(TESTS.len() * range.steps);
    for (test, (name, direction)) in TESTS.iter().enumerate() {
        let end = range.end(direction);
        if range.press == 0.0 && direction.iter().take(2).any(|d| *d < 0.0) {
            continue;
        }
        cell.roll_back(kept.clone());
        for step in 1..=range.steps {
            let part = step as f64 / range.steps as f64;
            let strain = end * part;
            cell.stretch(&strained(at_rest.factors, &strain));
            corrections += cell
                .relax(cell.nothing())
                .map_err(|e| e.at(format!("{name}, strain {:?}", strain.as_slice())))?;
            samples.push(Sample {
                test,
                strain,
                energy: (cell.energy()? - start.0) / area - start.1.dot(&strain),
                stress: second(&mut cell, at_rest.factors)? - start.1,
            });
        }
    }
    cell.roll_back(kept);
    let mut bent = Vec::with_capacity(4 * range.steps);
    for axis in [0, 1] {
        for side in [-1.0, 1.0] {
            for step in 1..=range.steps {
                let curvature = side * range.curvature * step as f64 / range.steps as f64;
                let mut test = cell.bent(axis, curvature)?;
                corrections += test
                    .relax(test.nothing())
                    .map_err(|e| e.at(format!("curvature {curvature} 1/m")))?;
                bent.push(BentSample {
                    axis,
                    curvature,
                    energy: (test.energy()? - start.0) / area,
                });
            }
        }
    }
    let membrane = membrane(&samples)?;
    let errors = errors(&samples, |e| energy(&membrane, e));
    let ridged = (errors[0] > FOLLOWS)
        .then(|| ridged(&samples, &membrane, range))
        .transpose()?;
    Ok(Fit {
        ridged,
        rest: at_rest,
        density: cell.density() / area,
        membrane,
        errors,
        bending: [bending(&bent, 0)?, bending(&bent, 1)?],
        samples,
        bent,
        corrections,
    })
}

/// A gradient from the flat layout with this Green strain against the size at rest.
fn strained(factors: [f64; 2], e: &Vector3<f64>) -> Matrix3x2<f64> {
    let c = Vector3::new(1.0 + 2.0 * e.x, 1.0 + 2.0 * e.y, e.z);
    let first = c.x.sqrt();
    let side = c.z / first;
    let f = Matrix3x2::new(first, side, 0.0, (c.y - side * side).sqrt(), 0.0, 0.0);
    f * sized(factors).fixed_rows::<2>(0)
}

/// Second Piola-Kirchhoff stress against the size at rest.
fn second(cell: &mut PeriodicCell, factors: [f64; 2]) -> Result<Vector3<f64>> {
    let size = Matrix2::from_diagonal(&Vector2::from(factors));
    let area = size.determinant();
    let stress = cell.stress()? * size / area;
    let f = cell.gradient() * Matrix2::from_diagonal(&Vector2::from(factors.map(f64::recip)));
    let c = f.transpose() * f;
    let inverse = c.try_inverse().ok_or_else(|| {
        Error::material("the cell of the fabric has lost its area under a test".to_owned())
    })?;
    let s = inverse * f.transpose() * stress;
    Ok(Vector3::new(
        s[(0, 0)],
        s[(1, 1)],
        0.5 * (s[(0, 1)] + s[(1, 0)]),
    ))
}

/// Weights of least squares: one over each energy.
pub(super) fn weights(energies: impl Iterator<Item = f64> + Clone) -> Vec<f64> {
    let largest = energies.clone().map(f64::abs).fold(0.0, f64::max);
    energies
        .map(|w| 1.0 / w.abs().max(LEAST * largest))
        .collect()
}

fn membrane(samples: &[Sample]) -> Result<[f64; 4]> {
    let (mut a, mut b) = (Matrix4::zeros(), Vector4::zeros());
    let weights = weights(samples.iter().map(|s| s.energy));
    for (sample, weight) in samples.iter().zip(weights) {
        let row = basis(&sample.strain) * weight;
        a += row * row.transpose();
        b += row * (sample.energy * weight);
    }
    // unknowns of one size
    let scale = a.diagonal().map(|d| 1.0 / d.sqrt());
    let scaled = Matrix4::from_diagonal(&scale) * a * Matrix4::from_diagonal(&scale);
    let solution = scaled
        .cholesky()
        .ok_or_else(|| {
            Error::material("the tests do not tell the membrane's stiffness".to_owned())
        })?
        .solve(&b.component_mul(&scale))
        .component_mul(&scale);
    let [mut weft, mut coupling, mut warp, mut shear] = <[f64; 4]>::from(solution);
    let least = FLOOR * weft.abs().max(warp.abs());
    weft = weft.max(least);
    warp = warp.max(least);
    shear = shear.max(least);
    let most = (1.0 - FLOOR) * (weft * warp).sqrt();
    coupling = coupling.clamp(-most, most);
    Ok([weft, coupling, warp, shear])
}

/// Root mean square and largest of the errors of a material's energy, each over the yarns'.
pub fn errors(samples: &[Sample], material: impl Fn(&Vector3<f64>) -> f64) -> [f64; 2] {
    let weights = weights(samples.iter().map(|s| s.energy));
    let (mut sum, mut largest) = (0.0, 0.0_f64);
    for (sample, weight) in samples.iter().zip(weights) {
        let error = (material(&sample.strain) - sample.energy) * weight;
        sum += error * error;
        largest = largest.max(error.abs());
    }
    [(sum / samples.len() as f64).sqrt(), largest]
}

fn bending(samples: &[BentSample], axis: usize) -> Result<Bending> {
    let own = || samples.iter().filter(|s| s.axis == axis);
    let (mut a, mut b) = (Matrix2::zeros(), Vector2::zeros());
    let size = own().map(|s| s.curvature.abs()).fold(0.0, f64::max);
    let row = |s: &BentSample| {
        let k = s.curvature / size;
        Vector2::new(k, 0.5 * k * k)
    };
    for sample in own() {
        let row = row(sample);
        a += row * row.transpose();
        b += row * sample.energy;
    }
    let solution = a.try_inverse().map_or_else(Vector2::zeros, |i| i * b);
    let largest = own().map(|s| s.energy.abs()).fold(0.0, f64::max);
    let error = own()
        .map(|s| (row(s).dot(&solution) - s.energy).abs())
        .fold(0.0, f64::max);
    let rigidity = solution.y / (size * size);
    if !(rigidity > 0.0 && rigidity.is_finite()) {
        return Err(Error::material(format!(
            "the tests do not tell the bending of the {}: its energy over curvatures to {size} 1/m bends downwards, as if its rigidity were {rigidity:.1e} N m",
            ["weft", "warp"][axis]
        )));
    }
    Ok(Bending {
        rigidity,
        moment: solution.x / size,
        error: error / largest,
    })
}

impl Fit {
    /// `W` of the triangles' membrane [J/m^2].
    pub fn energy(&self, strain: &Vector3<f64>) -> f64 {
        let without = || energy(&self.membrane, strain);
        self.ridged
            .as_ref()
            .map_or_else(without, |r| r.energy(strain))
    }

    /// A fabric with this material, everything else as it was.
    pub fn fabric(&self, like: &Fabric) -> Fabric {
        let ridged = self.ridged.as_ref();
        let [weft, coupling, warp, shear] = ridged.map_or(self.membrane, |r| r.membrane);
        Fabric {
            density: self.density,
            weft,
            coupling,
            warp,
            shear,
            ridges: ridged.map_or_else(Vec::new, |r| r.ridges.clone()),
            bending_weft: self.bending[0].rigidity,
            bending_warp: self.bending[1].rigidity,
            curvature_weft: self.bending[0].rest(),
            curvature_warp: self.bending[1].rest(),
            ..like.clone()
        }
    }
}
