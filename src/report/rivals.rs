//! The regions that a scene has against those that the indicator suggests.
//!
//! Four models, all from where triangles came to rest: triangles; the scene's own regions; suggested ones; and yarns wherever fabrics
//! have them, the reference. They are compared at every node of the reference.

use super::{Kind, Points, Report, check, compared, whole};
use crate::error::{Error, Result};
use crate::indicate::Wish;
use crate::pattern::BlendRegion;
use crate::scene::Scene;
use crate::sim_scene::build;

/// The wish for a region that costs no more than a scene's own: so many nodes of yarns, so many rings.
pub fn same_cost(scene: &Scene) -> Result<Wish> {
    let Some(drawn) = scene.garment.blend_regions.first() else {
        return Err(Error::argument(
            "regions are compared with the garment's own; it has none",
        ));
    };
    check(scene)?;
    Ok(Wish {
        budget: Some(build(scene)?.info().yarn_nodes as u64),
        rings: drawn.rings,
        ..Wish::default()
    })
}

/// Compares a scene's regions with others, suggested for its triangles. `watch` is told the name of each model before it runs.
pub fn rivals(
    scene: &Scene,
    others: &[BlendRegion],
    watch: &mut dyn FnMut(&str),
) -> Result<Report> {
    check(scene)?;
    let garment = &scene.garment;
    let with = |regions: &[BlendRegion]| {
        let mut garment = garment.clone();
        garment.blend_regions = regions.to_vec();
        garment
    };
    let panels: Vec<u32> = (0..)
        .zip(&garment.panels)
        .filter(|(_, p)| garment.fabrics[p.fabric].yarns.is_some())
        .map(|p| p.0)
        .collect();
    let everywhere = whole(garment, panels)?;
    let reference = Scene {
        garment: everywhere.clone(),
        ..scene.clone()
    };
    let points = Points::new(&build(&reference)?)?;
    let models = vec![
        ("triangles".to_owned(), Kind::Triangles, with(&[])),
        ("drawn".to_owned(), Kind::Mixed, garment.clone()),
        ("suggested".to_owned(), Kind::Mixed, with(others)),
        ("yarns".to_owned(), Kind::Yarns, everywhere),
    ];
    compared(scene, points, models, watch)
}
