//! Triangles as polygons: the regions of a garment that hold just these triangles.
//!
//! Triangles that share edges make a piece; a piece has one polygon along its border, over vertices of the mesh. A piece with
//! holes is cut: the polygon goes from the border of a hole along edges inside the piece to the rest of the border, and the same way
//! back. By the parity of crossings the way counts nothing. [`super::Region::new`] then finds the triangles
//! again: a vertex lies in a polygon if it is one of its piece.

use crate::error::{Error, Result};
use crate::math::topology;
use crate::pattern::{BlendRegion, Shape, check_rings};
use crate::tri::GarmentMesh;
use std::collections::{BTreeMap, BTreeSet, VecDeque};

/// The polygons of the triangles whose corners all have an `alpha` of 1, with so many hybrid rings. Values below 1 are
/// those of the rings, whose number says where they fall to 0. Refused are values outside of 0 to 1, a number of them other than
/// the vertices', and such as make no triangle.
pub fn from_alpha(mesh: &GarmentMesh, alpha: &[f64], rings: u32) -> Result<Vec<BlendRegion>> {
    if alpha.len() != mesh.uv.len() {
        return Err(Error::argument(format!(
            "{} values of alpha for {} vertices",
            alpha.len(),
            mesh.uv.len()
        )));
    }
    if let Some(v) = alpha.iter().position(|a| !(0.0..=1.0).contains(a)) {
        return Err(Error::argument(format!(
            "alpha[{v}] = {} must be from 0 to 1",
            alpha[v]
        )));
    }
    check_rings(rings)?;
    let whole = |v: &u32| alpha[*v as usize] >= 1.0;
    let full: Vec<bool> = (mesh.triangles.iter())
        .map(|t| t.iter().all(whole))
        .collect();
    if alpha.iter().any(|a| *a > 0.0) && !full.contains(&true) {
        return Err(Error::argument(
            "no triangle has an alpha of 1 at its three corners: no yarn would be simulated",
        ));
    }
    Ok(polygons(mesh, &full, rings))
}

/// The polygons of the triangles with `full`, with so many hybrid rings.
///
/// A triangle that is not `full` with three corners in one piece would be in its polygon; sets grown from vertices have none.
pub fn polygons(mesh: &GarmentMesh, full: &[bool], rings: u32) -> Vec<BlendRegion> {
    let mut regions = Vec::new();
    for piece in pieces(mesh, full) {
        let panel = mesh.triangle_panel[piece[0] as usize];
        let polygon = polygon(mesh, &piece);
        regions.push(BlendRegion {
            panel,
            shape: Shape::Polygon(polygon.iter().map(|v| mesh.uv[*v as usize]).collect()),
            rings,
        });
    }
    regions
}

/// Triangles that are connected by edges, in ascending order of their first ones.
fn pieces(mesh: &GarmentMesh, full: &[bool]) -> Vec<Vec<u32>> {
    let mut beside = vec![Vec::new(); full.len()];
    for (_, [a, b]) in topology::inner_edges(&mesh.triangles) {
        beside[a as usize].push(b);
        beside[b as usize].push(a);
    }
    topology::pieces(&beside, full)
}

/// Vertices along the border of a piece, its holes' borders included.
fn polygon(mesh: &GarmentMesh, piece: &[u32]) -> Vec<u32> {
    let sides = |t: &u32| {
        let [a, b, c] = mesh.triangles[*t as usize];
        [[a, b], [b, c], [c, a]]
    };
    let all: BTreeSet<[u32; 2]> = piece.iter().flat_map(sides).collect();
    // border: sides that no other triangle of the piece has the other way
    let mut next: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [a, b] in all.iter().filter(|[a, b]| !all.contains(&[*b, *a])) {
        next.entry(*a).or_default().push(*b);
    }
    let mut near: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for [a, b] in &all {
        near.entry(*a).or_default().push(*b);
        near.entry(*b).or_default().push(*a);
    }
    let mut out: Vec<u32> = Vec::new();
    while let Some((&start, _)) = next.iter().find(|(_, to)| !to.is_empty()) {
        let mut ring = vec![start];
        let mut at = start;
        while let Some(to) = next.get_mut(&at).and_then(Vec::pop) {
            at = to;
            ring.push(at);
        }
        if out.is_empty() {
            out = ring;
            continue;
        }
        let way = way(&near, start, &out);
        let joint = out.iter().position(|v| way.last() == Some(v)).unwrap_or(0);
        let back = way.iter().rev().copied();
        let detour: Vec<u32> = (back.clone().skip(1))
            .chain(ring.into_iter().skip(1))
            .chain(way.iter().copied().skip(1))
            .collect();
        out.splice(joint + 1..joint + 1, detour);
    }
    // the last vertex is the first one again
    out.pop();
    out
}

/// Fewest edges from a vertex to one of some others.
fn way(near: &BTreeMap<u32, Vec<u32>>, from: u32, to: &[u32]) -> Vec<u32> {
    let goals: BTreeSet<u32> = to.iter().copied().collect();
    let mut came: BTreeMap<u32, u32> = BTreeMap::from([(from, from)]);
    let mut queue = VecDeque::from([from]);
    while let Some(v) = queue.pop_front() {
        if goals.contains(&v) {
            let mut way = vec![v];
            let mut at = v;
            while at != from {
                at = came[&at];
                way.push(at);
            }
            way.reverse();
            return way;
        }
        for w in &near[&v] {
            came.entry(*w).or_insert_with(|| {
                queue.push_back(*w);
                v
            });
        }
    }
    vec![from]
}
