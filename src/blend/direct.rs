//! Yarns joined to triangles directly: no blending, no filter.
//!
//! Triangles of the region are taken out. Every energy of the yarns with a node in the region is there as a whole; its
//! nodes outside ride on the triangles they lie in, `p = B v`. So the yarns reach over the border, and what they do
//! there is taken from the triangles. With the mass `m_T` of all yarn that could be laid in triangle `T` of area `A`,
//! `c_T` that of the segments that are there, and `m`, `c` the same with each piece weighted by the square of its direction's
//! component along the weft or along the warp,
//!
//! ```text
//! mass of T = m_T - c_T,   share of its membrane along an axis s = max(1 - c / (A m/A of the panel), 0.01)
//! ```
//!
//! where `c_T > 0`, and the fabric's own elsewhere: every piece of yarn weighs once, as yarn or as triangle, and an even
//! stretch pulls evenly on both sides of the border. Bending is left as it is. Where that leaves a vertex without any mass, as in
//! a corner that the region cuts off, its triangles are taken out as well. A rod of a seam between yarns and
//! triangles rides on the edge of the triangles; where both sides are yarns it is free.

use super::coupling::{Coupling, Joined};
use super::cover::{Cover, Places, in_part, laid_passages};
use super::riders::Riders;
use crate::error::Result;
use crate::pattern::Garment;
use crate::tri::GarmentMesh;
use crate::yarn::{YarnMaterial, YarnMesh};

/// Cuts out of `laid`, the yarns of whole panels, what the triangles with `full` give way to.
pub fn join(
    garment: &Garment,
    mesh: &GarmentMesh,
    full: &[bool],
    laid: YarnMesh,
    materials: &[YarnMaterial],
) -> Result<Joined> {
    let places = Places::new(mesh, &laid)?;
    let mut full = full.to_vec();
    let (inside, cover) = loop {
        let inside = places.inside(&laid, |t| full[t]);
        let own = places.own(&laid);
        let cover = Cover::new(garment, mesh, &full, &laid, materials, own, |nodes| {
            let reaches = nodes.iter().any(|n| inside[*n as usize]);
            f64::from(u8::from(reaches))
        })?;
        let bare = cover.bare(mesh, &full);
        if bare.is_empty() {
            break (inside, cover);
        }
        for t in bare {
            full[t] = true;
        }
    };
    let list = places.riders(mesh, &laid, |_, t| !full[t]);
    let mut joined = Joined {
        share: cover.share(mesh, &full),
        masses: (0..full.len())
            .map(|t| cover.mass(t).filter(|_| !full[t]))
            .collect(),
        own: vec![1.0; full.len()],
        full,
        ..Joined::default()
    };
    if inside.iter().all(|i| *i) && list.is_empty() {
        joined.nodes = (0..laid.uv.len() as u32).collect();
        joined.passages = (0..laid.incidences.len() as u32).collect();
        joined.yarns = laid;
        return Ok(joined);
    }
    let (yarns, nodes, numbers) = laid.part(&inside);
    joined.yarns = yarns;
    joined.passages = laid_passages(&numbers);
    joined.coupling = Coupling {
        riders: Riders::new(in_part(list, &nodes, mesh.uv.len() as u32))?,
        filter: None,
    };
    joined.nodes = nodes;
    Ok(joined)
}
