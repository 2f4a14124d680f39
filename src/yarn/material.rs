//! Stiffness, mass and friction of one yarn, in the units of its energies.
//!
//! ```text
//! k_s = Y pi R^2,   k_b = B pi R^2,   k_x = S R^2
//! ```
//!
//! with Young's modulus `Y`, bending modulus `B`, shear modulus of the contacts `S` and radius `R`
//! (Cirio et al. 2017, section 4; the woven shear as in Cirio et al. 2014).

use crate::pattern::YarnFabric;
use std::f64::consts::PI;

/// One yarn as its energies see it.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct YarnMaterial {
    /// Radius `R` [m].
    pub radius: f64,
    /// Mass per length [kg/m].
    pub density: f64,
    /// Tension per strain `k_s` [N].
    pub stretch: f64,
    /// Flexural rigidity `k_b` [N m^2].
    pub bending: f64,
    /// Stitch wrapping `k_w` [N].
    pub wrapping: f64,
    /// Length inside of stitch contacts `k_l` [N].
    pub stitch: f64,
    /// Shear of crossings `k_x` [N].
    pub shear: f64,
    /// Least distance of crossings `k_c` [N/m^2].
    pub spacing: f64,
    /// Coulomb friction between yarns.
    pub friction: f64,
    /// Stiffness of the friction's anchors `k_f` [N/m].
    pub anchor: f64,
    /// Viscous resistance to sliding [N s/m].
    pub sliding_damping: f64,
    /// Mass-proportional damping [1/s].
    pub damping_mass: f64,
    /// Stiffness-proportional damping [s].
    pub damping_stiffness: f64,
}

impl From<&YarnFabric> for YarnMaterial {
    fn from(fabric: &YarnFabric) -> Self {
        let square = fabric.radius * fabric.radius;
        Self {
            radius: fabric.radius,
            density: fabric.density,
            stretch: fabric.young * PI * square,
            bending: fabric.bending * PI * square,
            wrapping: fabric.wrapping,
            stitch: fabric.stitch,
            shear: fabric.shear * square,
            spacing: fabric.spacing,
            friction: fabric.friction,
            anchor: fabric.anchor,
            sliding_damping: fabric.sliding_damping,
            damping_mass: fabric.damping_mass,
            damping_stiffness: fabric.damping_stiffness,
        }
    }
}
