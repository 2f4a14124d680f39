//! What a fabric is: areal density, membrane and bending stiffness, damping, thickness, friction.

use super::{Ridge, YarnFabric};
use crate::error::{Error, Result};

/// Which bending energy a fabric uses.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Default)]
pub enum BendingModel {
    /// Discrete-shells hinges with a rest angle.
    #[default]
    Hinge,
    /// Quadratic (isometric) bending with a constant Hessian; flat rest shape only.
    Quadratic,
}

/// Numbers of one fabric, SI units.
///
/// Membrane energy per rest area, Green strain `E` in the (weft, warp) frame:
/// `1/2 (weft E11^2 + 2 coupling E11 E22 + warp E22^2 + shear (2 E12)^2)`, and that of the ridges ([`Ridge`]).
#[derive(Clone, Debug, PartialEq)]
pub struct Fabric {
    /// Name by which panels ask for it.
    pub name: String,
    /// Mass per area [kg/m^2].
    pub density: f64,
    /// Stiffness along the warp [N/m].
    pub warp: f64,
    /// Stiffness along the weft [N/m].
    pub weft: f64,
    /// Coupling `c12` between warp and weft [N/m]; Poisson ratio times stiffness.
    pub coupling: f64,
    /// Shear stiffness, force per length per shear angle [N/m].
    pub shear: f64,
    /// What the membrane has beside these: none where stiffness does not depend on strain.
    pub ridges: Vec<Ridge>,
    /// Flexural rigidity per width for bending that curves the warp [N m].
    pub bending_warp: f64,
    /// Flexural rigidity per width for bending that curves the weft [N m].
    pub bending_weft: f64,
    /// Curvature of the warp at rest, positive to the front, which is the panel's outside [1/m].
    pub curvature_warp: f64,
    /// Curvature of the weft at rest, positive to the front [1/m].
    pub curvature_weft: f64,
    /// Bending energy used.
    pub bending_model: BendingModel,
    /// Mass-proportional damping [1/s].
    pub damping_mass: f64,
    /// Stiffness-proportional damping [s].
    pub damping_stiffness: f64,
    /// Thickness [m]: half of it is kept free around the middle surface in contacts.
    pub thickness: f64,
    /// Coulomb friction of cloth on cloth.
    pub friction: f64,
    /// The yarns that it is made of, for panels whose every yarn is simulated.
    pub yarns: Option<YarnFabric>,
    /// Whether density, membrane and bending of triangles are those fitted to the yarns, whatever stands here.
    pub fitted: bool,
}

impl Default for Fabric {
    fn default() -> Self {
        Self {
            name: "plain cotton".into(),
            density: 0.2,
            warp: 1000.0,
            weft: 1000.0,
            coupling: 0.0,
            shear: 200.0,
            ridges: Vec::new(),
            bending_warp: 1e-5,
            bending_weft: 1e-5,
            curvature_warp: 0.0,
            curvature_weft: 0.0,
            bending_model: BendingModel::Hinge,
            damping_mass: 0.0,
            damping_stiffness: 0.0,
            thickness: 1e-3,
            friction: 0.3,
            yarns: None,
            fitted: false,
        }
    }
}

/// Largest curvature at rest [1/m].
const MAX_CURVATURE: f64 = 1e5;
/// Most ridges of a fabric.
const MAX_RIDGES: usize = 100;

impl Fabric {
    /// Stiffness without strain along weft and warp [N/m].
    pub fn along(&self) -> [f64; 2] {
        let ridges = |k: usize| -> f64 {
            let part = |r: &Ridge| r.at(0.0).stiffness * r.direction()[k].powi(2);
            self.ridges.iter().map(part).sum()
        };
        [self.weft + ridges(0), self.warp + ridges(1)]
    }

    /// Refuses numbers that are not finite, signs that cannot be, and a membrane that is not
    /// positive definite (`coupling^2 < warp * weft`).
    pub fn check(&self) -> Result<()> {
        let positive = [
            ("density", self.density),
            ("membrane.warp", self.warp),
            ("membrane.weft", self.weft),
            ("membrane.shear", self.shear),
        ];
        let not_negative = [
            ("bending.warp", self.bending_warp),
            ("bending.weft", self.bending_weft),
            ("damping.mass", self.damping_mass),
            ("damping.stiffness", self.damping_stiffness),
            ("thickness", self.thickness),
            ("friction", self.friction),
        ];
        let refuse = |key: &str, value: f64, rule: &str| {
            Err(Error::material(format!(
                "fabric '{}': {key} = {value} must be {rule}",
                self.name
            )))
        };
        for (key, value) in positive {
            if !value.is_finite() || value <= 0.0 {
                return refuse(key, value, "finite and positive");
            }
        }
        for (key, value) in not_negative {
            if !value.is_finite() || value < 0.0 {
                return refuse(key, value, "finite and not negative");
            }
        }
        for (key, value) in [
            ("bending.curvature_warp", self.curvature_warp),
            ("bending.curvature_weft", self.curvature_weft),
        ] {
            if !(value.abs() <= MAX_CURVATURE) {
                return refuse(key, value, &format!("at most {MAX_CURVATURE} 1/m in size"));
            }
            if value != 0.0 && self.bending_model == BendingModel::Quadratic {
                return refuse(
                    key,
                    value,
                    "0 with the quadratic model, which is flat at rest",
                );
            }
        }
        if !self.coupling.is_finite() || self.coupling * self.coupling >= self.warp * self.weft {
            return refuse(
                "membrane.coupling",
                self.coupling,
                "below sqrt(warp weft) in size",
            );
        }
        if self.ridges.len() > MAX_RIDGES {
            return Err(Error::material(format!(
                "fabric '{}': {} ridges, at most {MAX_RIDGES}",
                self.name,
                self.ridges.len()
            )));
        }
        if self.fitted && self.yarns.is_none() {
            return Err(Error::material(format!(
                "fabric '{}': triangles fitted to yarns, and it has no yarns",
                self.name
            )));
        }
        self.yarns.as_ref().map_or(Ok(()), |yarns| {
            yarns
                .check()
                .map_err(|e| e.at(format!("fabric '{}'", self.name)))
        })
    }
}
