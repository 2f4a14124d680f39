//! Stencils of each energy from a mesh of yarns and their materials.
//!
//! Where two yarns share an energy it has the mean of their stiffness and damping.

use super::adapter::Stencil;
use super::bending::Bending;
use super::friction::Rubbing;
use super::gravity::Weight;
use super::inertia::Inertia;
use super::kernel::{MAX_POSITIONS, MAX_SLIDES};
use super::passing::{Passing, passings};
use super::shear::{Shear, lock};
use super::spacing::Spacing;
use super::stitch::StitchLength;
use super::stretch::Stretch;
use super::tie::TieSpring;
use super::wrapping::Wrapping;
use super::{YarnOptions, material_of};
use crate::error::{Error, Result};
use crate::yarn::{YarnMaterial, YarnMesh};

/// Length of a segment between contacts that hold each other and that nothing else keeps apart, over its laid
/// length, below which they press on each other.
const CLOSEST: f64 = 0.4;
/// Same in time where contacts come off, over the yarn's radius: below what is left when they do.
const LEFT: f64 = 0.15;

/// How a strand rubs on its neighbours in the stack.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct StrandFriction {
    /// Coefficient with the strand behind and the one in front where they cross, else 0.
    pub crossing: [f64; 2],
    /// Coefficient with the one in front where it lies beside, else 0.
    pub beside: f64,
    /// Stiffness of the anchor [N/m].
    pub anchor: f64,
    /// Viscous resistance [N s/m].
    pub viscosity: f64,
}

fn stencil<K>(nodes: &[u32], incidences: &[u32], kernel: K) -> Stencil<K> {
    let mut out = Stencil {
        nodes: [0; MAX_POSITIONS],
        incidences: [0; MAX_SLIDES],
        kernel,
    };
    out.nodes[..nodes.len()].copy_from_slice(nodes);
    out.incidences[..incidences.len()].copy_from_slice(incidences);
    out
}

/// Yarn of each incidence.
fn yarns(mesh: &YarnMesh) -> Vec<u32> {
    let mut out = vec![0; mesh.incidences.len()];
    for y in 0..mesh.yarn_count() {
        out[mesh.starts[y] as usize..mesh.starts[y + 1] as usize].fill(y as u32);
    }
    out
}

/// Every run of `n` incidences that follow each other in a yarn, with the yarn's material; only those
/// with a node inside.
fn runs<const N: usize>(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
    mut f: impl FnMut([u32; N], [u32; N], &YarnMaterial),
) -> Result<()> {
    for y in 0..mesh.yarn_count() {
        let m = material_of(mesh, materials, y)?;
        let (from, to) = (mesh.starts[y] as usize, mesh.starts[y + 1] as usize);
        for i in from..(to + 1).saturating_sub(N) {
            let incidences: [u32; N] = std::array::from_fn(|k| (i + k) as u32);
            let nodes = incidences.map(|i| mesh.incidences[i as usize].node);
            if mesh.reaches(&nodes) {
                f(incidences, nodes, m);
            }
        }
    }
    Ok(())
}

pub(super) fn weights(mesh: &YarnMesh, m: &[YarnMaterial]) -> Result<Vec<Stencil<Weight>>> {
    let mut out = Vec::new();
    runs(mesh, m, |incidences, nodes: [u32; 2], m| {
        let density = m.density;
        out.push(stencil(&nodes, &incidences, Weight { density }));
    })?;
    Ok(out)
}

pub(super) fn stretches(mesh: &YarnMesh, m: &[YarnMaterial]) -> Result<Vec<Stencil<Stretch>>> {
    let mut out = Vec::new();
    runs(mesh, m, |incidences, nodes: [u32; 2], m| {
        let kernel = Stretch {
            stiffness: m.stretch,
            damping: m.damping_stiffness,
        };
        out.push(stencil(&nodes, &incidences, kernel));
    })?;
    Ok(out)
}

pub(super) fn bends(mesh: &YarnMesh, m: &[YarnMaterial]) -> Result<Vec<Stencil<Bending>>> {
    let mut out = Vec::new();
    runs(mesh, m, |[a, _, b], nodes: [u32; 3], m| {
        let kernel = Bending {
            stiffness: m.bending,
            damping: m.damping_stiffness,
        };
        out.push(stencil(&nodes, &[a, b], kernel));
    })?;
    Ok(out)
}

pub(super) fn inertias(
    mesh: &YarnMesh,
    m: &[YarnMaterial],
    options: &YarnOptions,
) -> Result<Vec<Stencil<Inertia>>> {
    let mut out = Vec::new();
    runs(mesh, m, |incidences, nodes: [u32; 2], m| {
        let kernel = Inertia::new(
            m.density,
            m.damping_mass,
            options.sliding_mass,
            options.inertia_forces,
        );
        out.push(stencil(&nodes, &incidences, kernel));
    })?;
    Ok(out)
}

pub(super) fn wraps(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
    options: &YarnOptions,
) -> Result<Vec<Stencil<Wrapping>>> {
    let yarns = yarns(mesh);
    let mut out = Vec::with_capacity(mesh.wraps.len());
    for wrap in &mesh.wraps {
        let [a, b] = wrap.wings.map(|i| yarns[i as usize] as usize);
        let (a, b) = (
            material_of(mesh, materials, a)?,
            material_of(mesh, materials, b)?,
        );
        let [wing_a, wing_b] = wrap.wings.map(|i| mesh.incidences[i as usize].node);
        let kernel = Wrapping {
            stiffness: 0.5 * (a.wrapping + b.wrapping) * wrap.length,
            length: wrap.length,
            sign: wrap.sign,
            rest: options.wrap_angle,
            damping: 0.5 * (a.damping_stiffness + b.damping_stiffness),
        };
        let nodes = [wrap.axis[0], wrap.axis[1], wing_a, wing_b];
        out.push(stencil(&nodes, &wrap.wings, kernel));
    }
    Ok(out)
}

pub(super) fn stitches(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
) -> Result<Vec<Stencil<StitchLength>>> {
    let yarns = yarns(mesh);
    let mut out = Vec::with_capacity(mesh.stitch_springs.len());
    for spring in &mesh.stitch_springs {
        let m = material_of(
            mesh,
            materials,
            yarns[spring.incidences[0] as usize] as usize,
        )?;
        let kernel = StitchLength {
            stiffness: m.stitch,
            length: spring.length,
            damping: m.damping_stiffness,
        };
        out.push(stencil(&[], &spring.incidences, kernel));
    }
    Ok(out)
}

pub(super) fn spacings(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
) -> Result<Vec<Stencil<Spacing>>> {
    let yarns = yarns(mesh);
    let mut out = Vec::with_capacity(mesh.incidences.len());
    let mut spaced = vec![false; mesh.incidences.len()];
    let passings = passings(mesh);
    for spacing in &mesh.spacings {
        // a loop can be pulled out
        if passings[spacing.incidences[0] as usize] != Passing::Kept {
            continue;
        }
        spaced[spacing.incidences[0] as usize] = true;
        let m = material_of(
            mesh,
            materials,
            yarns[spacing.incidences[0] as usize] as usize,
        )?;
        let kernel = Spacing {
            stiffness: m.spacing * spacing.length,
            least: spacing.least,
            damping: m.damping_stiffness,
            least_in_time: spacing.least,
            nodes: spacing.incidences.map(|i| mesh.incidences[i as usize].node),
            held: false,
        };
        out.push(stencil(&[], &spacing.incidences, kernel));
    }
    // a contact may come near to the next one, and not pass it
    for y in 0..mesh.yarn_count() {
        let m = material_of(mesh, materials, y)?;
        for i in mesh.starts[y] as usize + 1..mesh.starts[y + 1] as usize {
            let laid = mesh.incidences[i].u - mesh.incidences[i - 1].u;
            let nodes = [i - 1, i].map(|i| mesh.incidences[i].node);
            if !spaced[i - 1] && mesh.reaches(&nodes) {
                let kernel = Spacing {
                    stiffness: m.spacing * laid,
                    least: CLOSEST * laid,
                    damping: m.damping_stiffness,
                    least_in_time: match passings[i - 1] {
                        Passing::Kept => CLOSEST * laid,
                        _ => (LEFT * m.radius).min(CLOSEST * laid),
                    },
                    nodes,
                    held: false,
                };
                out.push(stencil(&[], &[i as u32 - 1, i as u32], kernel));
            }
        }
    }
    Ok(out)
}

pub(super) fn corners(mesh: &YarnMesh, materials: &[YarnMaterial]) -> Result<Vec<Stencil<Shear>>> {
    let yarns = yarns(mesh);
    let mut out = Vec::with_capacity(mesh.corners.len());
    for (k, corner) in mesh.corners.iter().enumerate() {
        let stack = mesh.stack(corner.nodes[0] as usize);
        let [mut shear, mut radius, mut damping] = [0.0; 3];
        for strand in stack {
            let m = material_of(mesh, materials, yarns[strand.incidence as usize] as usize)?;
            let part = 1.0 / stack.len() as f64;
            shear += part * m.shear;
            radius += part * m.radius;
            damping += part * m.damping_stiffness;
        }
        let free = lock(radius, corner.length);
        if !(free > 0.0) {
            return Err(Error::argument(format!(
                "corner {k} at node {}: yarns of radius {radius} m at a pitch of {} m leave no \
                 angle to shear",
                corner.nodes[0], corner.length
            )));
        }
        let kernel = Shear::new(shear, radius, corner.length, damping);
        out.push(stencil(&corner.nodes, &[], kernel));
    }
    Ok(out)
}

pub(super) fn ties(mesh: &YarnMesh, options: &YarnOptions) -> Vec<Stencil<TieSpring>> {
    mesh.ties
        .iter()
        .map(|tie| {
            let kernel = TieSpring {
                stiffness: options.tie_stiffness * tie.length,
                t: tie.t,
            };
            stencil(&[tie.node, tie.segment[0], tie.segment[1]], &[], kernel)
        })
        .collect()
}

/// How each strand of the stacks rubs on its neighbours.
pub fn frictions(mesh: &YarnMesh, materials: &[YarnMaterial]) -> Result<Vec<StrandFriction>> {
    let yarns = yarns(mesh);
    let of = |s: u32| material_of(mesh, materials, yarns[s as usize] as usize);
    let mut out = vec![StrandFriction::default(); mesh.stacks.len()];
    for node in 0..mesh.uv.len() {
        let first = mesh.stack_starts[node] as usize;
        let stack = mesh.stack(node);
        for (k, strand) in stack.iter().enumerate() {
            let own = of(strand.incidence)?;
            out[first + k].anchor = own.anchor;
            out[first + k].viscosity = own.sliding_damping;
            if let Some(next) = stack.get(k + 1) {
                let friction = 0.5 * (own.friction + of(next.incidence)?.friction);
                if next.group == strand.group {
                    out[first + k].beside = friction;
                } else {
                    out[first + k].crossing[1] = friction;
                    out[first + k + 1].crossing[0] = friction;
                }
            }
        }
    }
    Ok(out)
}

/// Friction of each strand by its own coordinate, and between strands beside each other.
pub(super) fn rubbings(
    mesh: &YarnMesh,
    materials: &[YarnMaterial],
) -> Result<[Vec<Stencil<Rubbing>>; 2]> {
    let (mut own, mut beside) = (Vec::new(), Vec::new());
    let all = frictions(mesh, materials)?;
    for (s, (strand, f)) in mesh.stacks.iter().zip(&all).enumerate() {
        let kernel = Rubbing::new(s as u32, f.crossing, f.anchor, f.viscosity);
        own.push(stencil(&[], &[strand.incidence], kernel));
        if f.beside > 0.0 {
            let kernel = Rubbing::new(s as u32, [0.0, f.beside], f.anchor, 0.0);
            let pair = [strand.incidence, mesh.stacks[s + 1].incidence];
            beside.push(stencil(&[], &pair, kernel));
        }
    }
    Ok([own, beside])
}
