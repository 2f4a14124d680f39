//! The regions that a scene has against those that the indicator suggests, at the same cost.
//!
//! Four models, all from where triangles came to rest: triangles; the scene's own regions; those that are suggested from the
//! triangles' state for at most as many nodes of yarns as the scene's have, counted as built; and yarns wherever fabrics have them, the reference. They are
//! compared at every node of the reference.

use super::{Kind, Points, Report, Row, check, compared, drape, whole};
use crate::error::{Error, Result};
use crate::indicate::Wish;
use crate::scene::Scene;
use crate::sim_scene::build;

/// Compares a scene's regions with suggested ones. `watch` is told the name of each model before it runs.
pub fn rivals(scene: &Scene, watch: &mut dyn FnMut(&str)) -> Result<Report> {
    let garment = &scene.garment;
    let Some(drawn) = garment.blend_regions.first() else {
        return Err(Error::argument(
            "regions are compared with the garment's own; it has none",
        ));
    };
    check(scene)?;
    let mut bare = scene.clone();
    bare.garment.blend_regions.clear();
    let mut row = Row::new(String::new(), Kind::Triangles);
    let triangles = drape(&bare, None, &mut row)
        .map_err(|reason| Error::argument(format!("triangles did not come to rest: {reason}")))?;
    let most = build(scene)?.info().yarn_nodes as u64;
    let mut suggested = garment.clone();
    let mut budget = most;
    loop {
        let wish = Wish {
            tolerance: None,
            budget: Some(budget),
            rings: drawn.rings,
        };
        suggested.blend_regions = triangles.suggest_region(&wish)?.regions;
        let built = Scene {
            garment: suggested.clone(),
            ..scene.clone()
        };
        // predictions are not exact, and the comparison must not favour what is suggested
        let excess = build(&built)?.info().yarn_nodes as u64;
        if excess <= most {
            break;
        }
        budget = budget.saturating_sub(excess - most).max(1);
    }
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
        ("triangles".to_owned(), Kind::Triangles, bare.garment),
        ("drawn".to_owned(), Kind::Mixed, garment.clone()),
        ("suggested".to_owned(), Kind::Mixed, suggested),
        ("yarns".to_owned(), Kind::Yarns, everywhere),
    ];
    compared(scene, points, models, watch)
}
