//! Triangles whose material is that of their fabric's yarns ([`fit`]), for fabrics that ask for it.
//!
//! The material is that of the fabric at rest. Beside yarns it fits those laid at that size: fabrics at rest as they are laid,
//! such as weaves, and compensated ones.

use super::fit::{Fit, Range, fit};
use super::known::Known;
use crate::error::{Error, Result};
use crate::pattern::Garment;
use crate::pattern::yarn_fabric::YarnFabric;
use crate::solve::settings::Settings;
use std::borrow::Cow;

/// Difference of the size at rest from that as laid up to which they are one.
const SAME: f64 = 0.01;

/// Fits found while the program runs.
static KNOWN: Known<Fit> = Known::new();

/// A garment whose fabrics have the fitted material where they ask for it.
pub fn fitted<'a>(garment: &'a Garment, settings: &Settings) -> Result<Cow<'a, Garment>> {
    let mut out = Cow::Borrowed(garment);
    for (k, fabric) in garment.fabrics.iter().enumerate() {
        let (true, Some(yarns)) = (fabric.fitted, &fabric.yarns) else {
            continue;
        };
        if !garment.panels.iter().any(|p| p.fabric == k) {
            continue;
        }
        let named = |e: Error| e.at(format!("fabric '{}'", fabric.name));
        let find = || fit(yarns, &Range::of(yarns), settings);
        let found = KNOWN.of(yarns, settings, find).map_err(named)?;
        if is_laid(garment, k) {
            fits(yarns, &found).map_err(named)?;
        }
        out.to_mut().fabrics[k] = found.fabric(fabric);
    }
    Ok(out)
}

/// Refuses regions of yarns in a garment that was fitted with these settings, where the yarns are not at rest as they are laid.
pub fn check_regions(garment: &Garment, settings: &Settings) -> Result<()> {
    for (k, fabric) in garment.fabrics.iter().enumerate() {
        if let (true, Some(yarns)) = (fabric.fitted && is_laid(garment, k), &fabric.yarns) {
            let find = || fit(yarns, &Range::of(yarns), settings);
            (KNOWN
                .of(yarns, settings, find)
                .and_then(|found| fits(yarns, &found)))
            .map_err(|e| e.at(format!("fabric '{}'", fabric.name)))?;
        }
    }
    Ok(())
}

fn is_laid(garment: &Garment, fabric: usize) -> bool {
    let list = garment.blend_regions.iter();
    let mut fabrics = list.map(|r| garment.panels[r.panel as usize].fabric);
    fabrics.any(|f| f == fabric)
}

/// Refuses yarns that are not at rest as they are laid.
fn fits(yarns: &YarnFabric, found: &Fit) -> Result<()> {
    let [across, along] = found.rest.factors;
    let same = |l: f64| (l - 1.0).abs() <= SAME;
    if yarns.compensated || (same(across) && same(along)) {
        return Ok(());
    }
    Err(Error::material(format!(
        "triangles are fitted to the fabric at rest, at {across:.3} of its width and {along:.3} of its height, and its yarns are laid at theirs: they need yarns.compensated"
    )))
}
