//! Where yarns would change the answer: from a state of triangles alone to a region of yarns and what it costs.
//!
//! [`indicator`] estimates an error of the triangles at every vertex, [`grow`] makes a region of the places where it is
//! above a tolerance, [`cost`] predicts what that region costs. A budget of nodes is met by the least tolerance whose region is predicted
//! to keep to it; whoever can lay yarns counts them and corrects the budget ([`crate::sim::Sim::suggest_region`]). Everything here reads
//! the mesh and positions alone, one vertex after the other, so that nothing depends on threads.

pub mod cost;
pub mod grow;
pub mod indicator;

use crate::blend::{Region, trace};
use crate::error::{Error, Result};
use crate::pattern::{BlendRegion, Garment, check_rings};
use crate::tri::GarmentMesh;
use crate::yarn::Cell;
use cost::{Cost, Predictor};
use grow::Growth;
use indicator::{Indicator, LeftOut};

/// Least tolerance: errors below it are those of rounding and of a drape's own residual.
pub const LEAST_TOLERANCE: f64 = 1e-3;
/// Most that a tolerance can be.
pub const LARGEST_TOLERANCE: f64 = 1e3;

/// What region is asked for: at least one of tolerance and budget.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Wish {
    /// Error, as a root mean square around a vertex, above which triangles give way; `None` is [`LEAST_TOLERANCE`], with
    /// a budget.
    pub tolerance: Option<f64>,
    /// Most nodes of yarns; `None` is no limit.
    pub budget: Option<u64>,
    /// Hybrid rings around the region.
    pub rings: u32,
    /// Criteria that do not count.
    pub left_out: LeftOut,
}

/// A region and why.
#[derive(Clone, Debug, PartialEq)]
pub struct Suggestion {
    /// The criteria and the error of every vertex.
    pub indicator: Indicator,
    /// Which triangles give way to yarns.
    pub region: Region,
    /// The same as polygons, for garments and scenes; none where nothing is suggested.
    pub regions: Vec<BlendRegion>,
    /// The tolerance that the region is one for: the wish's, or what its budget allows.
    pub tolerance: f64,
    /// Error of triangles alone: root mean square over their area, and of the worst one ([`Indicator::over`]).
    pub whole: [f64; 2],
    /// The same of those that are left.
    pub left: [f64; 2],
    /// Prediction for the region.
    pub cost: Cost,
    /// Prediction for triangles alone.
    pub triangles: Cost,
    /// Prediction for yarns wherever fabrics have them.
    pub everywhere: Cost,
}

impl Wish {
    /// The tolerance; refuses what cannot be wished for.
    pub fn check(&self) -> Result<f64> {
        if self.tolerance.is_none() && self.budget.is_none() {
            return Err(Error::argument(
                "a region needs a tolerance or a budget of yarn nodes: neither is given",
            ));
        }
        let tolerance = self.tolerance.unwrap_or(LEAST_TOLERANCE);
        if !(LEAST_TOLERANCE..=LARGEST_TOLERANCE).contains(&tolerance) {
            return Err(Error::argument(format!(
                "tolerance {tolerance} must be from {LEAST_TOLERANCE} to {LARGEST_TOLERANCE}"
            )));
        }
        if self.left_out.iter().all(|left_out| *left_out) {
            return Err(Error::argument(
                "every criterion is left out: nothing tells where yarns are needed",
            ));
        }
        if self.budget == Some(0) {
            return Err(Error::argument("a budget of 0 yarn nodes allows no yarns"));
        }
        check_rings(self.rings)?;
        Ok(tolerance)
    }
}

/// The region that a garment of triangles alone wants for these errors. `cells` says how fabrics are laid.
pub fn suggest(
    garment: &Garment,
    mesh: &GarmentMesh,
    indicator: Indicator,
    cells: &[Cell],
    wish: &Wish,
) -> Result<Suggestion> {
    let wanted = wish.check()?;
    let has_yarns = |panel: u32| {
        let panel = &garment.panels[panel as usize];
        garment.fabrics[panel.fabric].yarns.is_some()
    };
    if !mesh.triangle_panel.iter().any(|p| has_yarns(*p)) {
        return Err(Error::argument(
            "no panel has a fabric with yarns: there is nothing to suggest",
        ));
    }
    let may: Vec<bool> = mesh.triangle_panel.iter().map(|p| has_yarns(*p)).collect();
    if let Some(v) = indicator.error.iter().position(|e| !e.is_finite()) {
        return Err(Error::argument(format!(
            "the error at vertex {v} is {}: its place or those beside it are no state of cloth",
            indicator.error[v]
        )));
    }
    let growth = Growth::new(mesh, &indicator.error, may.clone());
    let predictor = Predictor::new(garment, mesh, cells);
    let at = |tolerance: f64| {
        let region = Region::around(mesh, growth.full(tolerance), wish.rings);
        let cost = predictor.cost(&region);
        (region, cost)
    };
    let mut tolerance = wanted;
    let (mut region, mut cost) = at(tolerance);
    if let Some(budget) = wish.budget.filter(|b| cost.yarn_nodes > *b) {
        // regions shrink as the tolerance grows, the last level's is empty: the least one that keeps to the budget
        let mut levels: Vec<f64> = growth.levels().filter(|l| *l > wanted).collect();
        levels.sort_unstable_by(f64::total_cmp);
        let within = |l: &f64| at(*l).1.yarn_nodes <= budget;
        let first = levels.partition_point(|l| !within(l));
        tolerance = levels[first.min(levels.len() - 1)];
        (region, cost) = at(tolerance);
    }
    let error = |v: usize| indicator.error[v];
    let none = Region::around(mesh, vec![false; may.len()], 0);
    let all = Region::around(mesh, may, 0);
    Ok(Suggestion {
        whole: indicator.over(mesh, error, |_| true),
        left: indicator.over(mesh, error, |t| !region.full[t]),
        regions: trace::polygons(mesh, &region.full, wish.rings),
        tolerance,
        cost,
        triangles: predictor.cost(&none),
        everywhere: predictor.cost(&all),
        region,
        indicator,
    })
}
