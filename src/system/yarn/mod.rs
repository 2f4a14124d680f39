//! Mechanics of cloth made of yarns: energies over nodes and sliding material coordinates.
//!
//! Discretisation and forces after Cirio, Lopez-Moreno and Otaduy 2017 ("Yarn-level cloth simulation with
//! sliding persistent contacts") and 2014 (woven cloth). Each energy is a pure
//! [`Kernel`](kernel::Kernel) of one stencil; [`adapter`] makes terms of them, over the blocks that
//! [`Unknowns`] numbers. What is lagged within a step, the normal forces of
//! [`compression`] and the anchors of [`friction`], is in the State.

pub mod adapter;
pub mod angle;
pub mod bending;
pub mod compression;
pub mod contacts;
pub mod friction;
pub mod gravity;
pub mod inertia;
pub mod kernel;
pub(super) mod normals;
pub mod passing;
pub mod release;
pub mod shear;
pub mod slip;
pub mod spacing;
pub mod springs;
pub mod stack;
pub mod stitch;
pub mod stretch;
pub mod tie;
pub mod unknowns;
pub mod wrapping;

use super::term::Term;
use crate::error::{Error, Result};
use crate::yarn::{YarnMaterial, YarnMesh};
use unknowns::Unknowns;

/// Numbers of the yarns' energies that no material has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct YarnOptions {
    /// Stiffness of ties per length of seam [N/m^2].
    pub tie_stiffness: f64,
    /// Angle of a stitch at rest [rad].
    pub wrap_angle: f64,
    /// Mass added to material coordinates, a part of the segment's.
    pub sliding_mass: f64,
    /// Whether the inertia forces of sliding material act.
    pub inertia_forces: bool,
}

impl Default for YarnOptions {
    fn default() -> Self {
        Self {
            tie_stiffness: 1e5,
            wrap_angle: std::f64::consts::FRAC_PI_2,
            sliding_mass: 1e-3,
            inertia_forces: true,
        }
    }
}

/// Material of a yarn.
fn material_of<'a>(
    mesh: &YarnMesh,
    materials: &'a [YarnMaterial],
    yarn: usize,
) -> Result<&'a YarnMaterial> {
    let fabric = mesh.yarn_fabric[yarn] as usize;
    materials.get(fabric).ok_or_else(|| {
        Error::argument(format!(
            "yarn {yarn} is of fabric {fabric}, there are {} materials",
            materials.len()
        ))
    })
}

/// Every term of the yarns, `materials` by fabric.
pub fn terms(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
    unknowns: &Unknowns,
    options: &YarnOptions,
) -> Result<Vec<Box<dyn Term>>> {
    let mut all = adapter::terms(unknowns, mesh, springs::weights(mesh, materials)?);
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::stretches(mesh, materials)?,
    ));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::bends(mesh, materials)?,
    ));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::wraps(mesh, materials, options)?,
    ));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::stitches(mesh, materials)?,
    ));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::corners(mesh, materials)?,
    ));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::spacings(mesh, materials)?,
    ));
    all.extend(adapter::terms(unknowns, mesh, springs::ties(mesh, options)));
    let [own, beside] = springs::rubbings(mesh, materials)?;
    all.extend(adapter::terms::<_, 1>(unknowns, mesh, own));
    all.extend(adapter::terms::<_, 2>(unknowns, mesh, beside));
    all.extend(adapter::terms(
        unknowns,
        mesh,
        springs::inertias(mesh, materials, options)?,
    ));
    Ok(all)
}
