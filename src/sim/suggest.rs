//! Which region of yarns a simulation of triangles wants.

use super::Sim;
use super::yarns::YarnPart;
use crate::error::{Error, Result};
use crate::fabric::rest::cells;
use crate::indicate::cost::Cost;
use crate::indicate::indicator::{Indicator, LeftOut};
use crate::indicate::{Suggestion, Wish, suggest};

impl Sim {
    /// The region of yarns for a tolerance or a budget, from the present state. A simulation that has yarns already is
    /// refused: the indicator tells errors of triangles.
    pub fn suggest_region(&self, wish: &Wish) -> Result<Suggestion> {
        wish.check()?;
        self.suggest_for(&self.vertex_errors(&wish.left_out)?, wish)
    }

    /// The same for errors that may be those of several states. The yarns of the region are laid to count them, and where they are more
    /// than the budget a smaller one is tried.
    pub fn suggest_for(&self, indicator: &Indicator, wish: &Wish) -> Result<Suggestion> {
        self.refuse_yarns()?;
        let used = |fabric: usize| self.garment.panels.iter().any(|p| p.fabric == fabric);
        let cells = cells(&self.garment, used, &self.settings)?;
        let mut tried = *wish;
        loop {
            let (garment, mesh) = (&self.garment, &self.mesh);
            let mut found = suggest(garment, mesh, indicator.clone(), &cells, &tried)?;
            found.cost = self.counted(&found)?;
            let excess = wish
                .budget
                .map_or(0, |b| found.cost.yarn_nodes.saturating_sub(b));
            if excess == 0 {
                return Ok(found);
            }
            // a budget of one node allows no piece of a region, so this ends
            tried.budget = tried.budget.map(|b| b.saturating_sub(excess).max(1));
        }
    }

    /// How wrong the triangles may be at each vertex, in the present state, without some criteria.
    pub fn vertex_errors(&self, left_out: &LeftOut) -> Result<Indicator> {
        self.refuse_yarns()?;
        Indicator::new(&self.garment, &self.mesh, self.positions(), left_out)
    }

    /// What a suggestion costs, with the nodes of its yarns as they are laid.
    fn counted(&self, found: &Suggestion) -> Result<Cost> {
        let mut garment = self.garment.clone();
        garment.blend_regions.clone_from(&found.regions);
        let settings = (&self.settings, &self.first_settings);
        let Some(part) = YarnPart::new(&garment, &self.mesh, settings.0, settings.1)? else {
            return Ok(found.cost);
        };
        let vertices = self.mesh.uv.len();
        let nodes = part.now.mesh.uv.len();
        let points = vertices as u32..(vertices + nodes) as u32;
        let carried = points.filter(|p| part.coupling.riders.rides(*p)).count();
        let follow = (0..vertices as u32).filter(|v| part.follows(*v)).count();
        let rows = part.coupling.filter.as_ref().map_or(0, |f| f.width());
        let cost = Cost {
            yarn_nodes: nodes as u64,
            carried_nodes: carried as u64,
            triangles: part.left_out.iter().filter(|gone| !**gone).count() as u64,
            ..found.cost
        };
        let moving = nodes - carried + vertices - follow;
        Ok(cost.with_unknowns(3 * moving.saturating_sub(rows) as u64, vertices))
    }

    fn refuse_yarns(&self) -> Result<()> {
        let Some(mesh) = self.yarns() else {
            return Ok(());
        };
        Err(Error::unsupported(format!(
            "the indicator reads a simulation of triangles alone; this one has {} nodes of yarns in {} regions: ask one that was made \
             without blend regions, or take them away first",
            mesh.uv.len(),
            self.garment.blend_regions.len()
        )))
    }
}
