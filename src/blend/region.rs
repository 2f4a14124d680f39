//! Which panels the blend regions cover.
//!
//! A region covers a panel wholly if its polygon crosses the outline nowhere and no point of the
//! outline is outside of it, within a millionth of the panel's size.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::outline::{Piece, inside, point_distance, polylines};
use crate::pattern::{BlendRegion, Garment, Panel};

/// Turn of an outline between two points that are looked at [rad].
const TURN: f64 = 0.1;
/// Tolerance over the size of the panel.
const TOLERANCE: f64 = 1e-6;

/// For each panel whether it is simulated as yarns alone. A region that covers a panel in part, one
/// whose fabric has no yarns, and a seam between yarns and triangles are refused.
pub fn yarn_panels(garment: &Garment) -> Result<Vec<bool>> {
    let mut wanted = vec![false; garment.panels.len()];
    for (k, region) in garment.blend_regions.iter().enumerate() {
        let panel = &garment.panels[region.panel as usize];
        let place = format!("blend_regions[{k}]");
        if garment.fabrics[panel.fabric].yarns.is_none() {
            return Err(Error::argument(format!(
                "panel '{}' has fabric '{}', which has no yarns",
                panel.name, garment.fabrics[panel.fabric].name
            ))
            .at(place));
        }
        if !covers(region, panel)? {
            return Err(Error::unsupported(format!(
                "the region covers panel '{}' in part; this version simulates the yarns of whole panels",
                panel.name
            ))
            .at(place));
        }
        wanted[region.panel as usize] = true;
    }
    for (k, seam) in garment.seams.iter().enumerate() {
        let [a, b] = [seam.a.panel, seam.b.panel].map(|p| p as usize);
        if wanted[a] != wanted[b] {
            let (yarns, triangles) = if wanted[a] { (a, b) } else { (b, a) };
            return Err(Error::unsupported(format!(
                "panel '{}' of yarns is sewn to panel '{}' of triangles; this version sews yarns to \
                 yarns: give both panels a region, or neither",
                garment.panels[yarns].name, garment.panels[triangles].name
            ))
            .at(format!("seams[{k}]")));
        }
    }
    Ok(wanted)
}

fn covers(region: &BlendRegion, panel: &Panel) -> Result<bool> {
    let n = region.polygon.len();
    let polygon: Vec<Piece> = (0..n)
        .map(|i| Piece {
            a: region.polygon[i],
            b: region.polygon[(i + 1) % n],
            edge: i,
            ring: 0,
            next: (i + 1) % n,
        })
        .collect();
    let [low, high] = panel.bounds()?.unwrap_or([Vec2::zeros(); 2]);
    let tolerance = TOLERANCE * (high - low).norm();
    let within = |p: Vec2| {
        inside(p, &polygon, 0)
            || polygon
                .iter()
                .any(|piece| point_distance(p, piece.a, piece.b) <= tolerance)
    };
    let outline = polylines(&panel.segments()?, &panel.loops()[..1], TURN);
    // a polygon that dips between two points of the outline has a corner inside of the panel
    let dips = region.polygon.iter().any(|p| {
        inside(*p, &outline, 0)
            && outline
                .iter()
                .all(|piece| point_distance(*p, piece.a, piece.b) > tolerance)
    });
    Ok(!dips && outline.iter().all(|piece| within(piece.a)))
}
