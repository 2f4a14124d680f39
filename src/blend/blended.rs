//! Yarns blended into triangles: rings in which both act, each in part.
//!
//! Full triangles are taken out. In the rings around them triangles and yarns are both there, every energy and mass weighted
//! (Casafranca et al. 2020, section 4.1): an element of the yarns by the mean `a` of `alpha` at its nodes, a triangle by
//! `1 - a` of its corners; where an element is not in full triangles alone `a` is kept within 0.01 and 0.99. Nodes in
//! the rings are joined to the triangles by the [`Filter`]; nodes beyond that elements reach ride on their triangles,
//! and so do the nodes of a seam's rod beside triangles. Yarns slide in full triangles only.
//!
//! A triangle's mass is that of all yarn in it without what its segments weigh as yarns, so that the whole mass is exact.
//! Fans of bending have the mean of their triangles; between hybrid and full triangles there is no hinge. Where
//! everything is enriched, for tests, full triangles too have a filter over their vertices, which have no energies.

use super::coupling::{Coupling, Joined};
use super::cover::{Cover, Places, in_part, laid_passages};
use super::filter::{Filter, Parts};
use super::region::Region;
use super::riders::{Rider, Riders};
use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::Garment;
use crate::tri::GarmentMesh;
use crate::yarn::{YarnMaterial, YarnMesh, blended_weight};
use std::collections::BTreeMap;
use std::sync::Arc;

/// Nodes of each piece of yarn that its factor is anchored at.
const ANCHORS: usize = 4;
/// Part of a ring's vertices that nodes must determine.
const LEAST_KEPT: f64 = 0.5;

/// What may be asked of blended rings.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlendOptions {
    /// Whether the mean displacement of the nodes beside each hybrid triangle vanishes.
    pub means: bool,
    /// Whether full triangles are enriched too.
    pub everywhere: bool,
}

/// Cuts out of `laid`, the yarns of whole panels, what the region needs, and joins it to the triangles.
pub fn join(
    garment: &Garment,
    mesh: &GarmentMesh,
    region: &Region,
    mut laid: YarnMesh,
    materials: &[YarnMaterial],
    options: BlendOptions,
) -> Result<Joined> {
    if options.everywhere && (options.means || region.full.contains(&false)) {
        return Err(Error::argument(
            "blend.enrich_everywhere: regions must hold every triangle, and blend.means must be 0",
        ));
    }
    let places = Places::new(mesh, &laid)?;
    let inside = places.inside(&laid, |t| region.has_yarns(t));
    let mut on_seam = vec![false; laid.uv.len()];
    for (node, _) in &places.across {
        on_seam[*node as usize] = true;
    }
    let list = places.riders(mesh, &laid, |node, t| {
        let stays = if on_seam[node as usize] {
            region.hybrid[t]
        } else {
            false
        };
        stays || !region.has_yarns(t)
    });
    laid.alpha = (0..laid.uv.len())
        .map(|n| {
            let t = places.map.triangle[n] as usize;
            region.at(mesh, t, &places.map.weights[n])
        })
        .collect();
    for (node, k) in &places.across {
        let t = places.map.triangle[*k] as usize;
        let there = region.at(mesh, t, &places.map.weights[*k]);
        let own = &mut laid.alpha[*node as usize];
        *own = own.max(there);
    }
    let weight = |nodes: [u32; 2]| {
        let reached = nodes.iter().any(|n| inside[*n as usize]);
        if reached { laid.weight(&nodes) } else { 0.0 }
    };
    let own = places.own(&laid);
    let cover = Cover::new(garment, mesh, &region.full, &laid, materials, own, weight)?;
    let count = region.full.len();
    let part = |t: usize| {
        if !region.hybrid[t] {
            return 1.0;
        }
        let alpha = mesh.triangles[t].map(|v| region.alpha[v as usize]);
        // corners of alpha 1 between full triangles do not make one
        1.0 - blended_weight(&alpha).min(1.0 - YarnMesh::LEAST_ALPHA)
    };
    let own: Vec<f64> = (0..count).map(part).collect();
    let (yarns, nodes, numbers) = laid.part(&inside);
    let first = mesh.uv.len() as u32;
    let riders = Riders::new(in_part(list, &nodes, first))?;
    let enriched = |t: usize| region.hybrid[t] || (options.everywhere && region.full[t]);
    let mut blended: Vec<Rider> = Vec::new();
    let mut triangles = Vec::new();
    for (point, node) in (first..).zip(&nodes) {
        let t = places.map.triangle[*node as usize];
        if enriched(t as usize) && inside[*node as usize] && !riders.rides(point) {
            let place = places.rider(mesh, *node, *node as usize);
            blended.push(Rider { point, ..place });
            triangles.push(t);
        }
    }
    let mut with_triangles = vec![false; mesh.uv.len()];
    for t in (0..count).filter(|t| !region.full[*t]) {
        for v in mesh.triangles[t] {
            with_triangles[v as usize] = true;
        }
    }
    let mut bare: Vec<u32> = blended.iter().flat_map(|r| r.vertices).collect();
    bare.sort_unstable();
    bare.dedup();
    bare.retain(|v| !with_triangles[*v as usize]);
    let carriers = (first..).zip(&nodes).map(|(point, node)| {
        let place = places.rider(mesh, *node, *node as usize);
        Rider { point, ..place }
    });
    let filter = if blended.is_empty() {
        None
    } else {
        let parts = Parts {
            anchors: anchors(&yarns, &blended, first),
            triangles: if options.means { triangles } else { Vec::new() },
            nodes: blended,
            bare,
            carriers: carriers.collect(),
            covered: with_triangles,
        };
        let filter = Filter::new(parts)?;
        check_support(garment, mesh, &filter)?;
        Some(Arc::new(filter))
    };
    Ok(Joined {
        full: region.full.clone(),
        share: own.iter().map(|w| [*w; 2]).collect(),
        own,
        masses: (0..count)
            .map(|t| cover.mass(t).filter(|_| !region.full[t]))
            .collect(),
        yarns,
        nodes,
        passages: laid_passages(&numbers),
        coupling: Coupling { riders, filter },
    })
}

/// Refuses rings whose vertices hardly any nodes determine, by panel.
fn check_support(garment: &Garment, mesh: &GarmentMesh, filter: &Filter) -> Result<()> {
    let mut counts: BTreeMap<u32, [usize; 2]> = BTreeMap::new();
    for (list, kept) in [(filter.kept(), 1), (filter.dropped(), 0)] {
        for v in list {
            let count = counts.entry(mesh.vertex_panel[*v as usize]).or_default();
            count[0] += 1;
            count[1] += kept;
        }
    }
    for (panel, [all, kept]) in counts {
        if (kept as f64) < LEAST_KEPT * all as f64 {
            let panel = &garment.panels[panel as usize];
            return Err(Error::geometry(format!(
                "panel '{}': yarns determine {kept} of the {all} vertices in the hybrid rings, at least half are \
                 needed: triangles with edges of {} m are too short for the yarns' pitch (2.5 pitches do), or use 0 rings",
                panel.name,
                garment.panel_edge_length(panel)
            )));
        }
    }
    Ok(())
}

/// A few blended nodes of each piece of yarn that hangs together, far from each other.
fn anchors(yarns: &YarnMesh, blended: &[Rider], first: u32) -> Vec<u32> {
    let mut root: Vec<u32> = (0..yarns.uv.len() as u32).collect();
    let segments = (0..yarns.yarn_count())
        .flat_map(|y| yarns.yarn(y).windows(2))
        .map(|pair| [pair[0].node, pair[1].node]);
    let ties = yarns.ties.iter().map(|t| [t.node, t.segment[0]]);
    for [a, b] in segments.chain(ties) {
        let (a, b) = (find(&mut root, a), find(&mut root, b));
        root[a.max(b) as usize] = a.min(b);
    }
    let mut pieces: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for node in blended.iter().map(|r| r.point - first) {
        pieces.entry(find(&mut root, node)).or_default().push(node);
    }
    let place = |n: &u32| yarns.uv[*n as usize];
    let mut anchors = Vec::new();
    for nodes in pieces.values() {
        let middle = nodes.iter().map(place).sum::<Vec2>() / nodes.len() as f64;
        let mut chosen: Vec<Vec2> = Vec::new();
        let mut away: Vec<f64> = nodes.iter().map(|n| (place(n) - middle).norm()).collect();
        for _ in 0..ANCHORS.min(nodes.len()) {
            let farthest = (0..nodes.len()).max_by(|a, b| away[*a].total_cmp(&away[*b]));
            let Some(k) = farthest else { break };
            if !chosen.is_empty() && away[k] == 0.0 {
                break;
            }
            anchors.push(first + nodes[k]);
            chosen.push(place(&nodes[k]));
            for (d, n) in away.iter_mut().zip(nodes) {
                let last = (place(n) - place(&nodes[k])).norm();
                *d = if chosen.len() == 1 { last } else { d.min(last) };
            }
        }
    }
    anchors.sort_unstable();
    anchors
}

fn find(root: &mut [u32], v: u32) -> u32 {
    let mut top = v;
    while root[top as usize] != top {
        root[top as usize] = root[root[top as usize] as usize];
        top = root[top as usize];
    }
    top
}
