//! Which region of yarns a simulation of triangles wants.

use super::Sim;
use crate::error::{Error, Result};
use crate::fabric::rest::cells;
use crate::indicate::indicator::Indicator;
use crate::indicate::{Suggestion, Wish, suggest};

impl Sim {
    /// The region of yarns for a tolerance or a budget, from the present state. A simulation that has yarns already is
    /// refused: the indicator tells errors of triangles.
    pub fn suggest_region(&self, wish: &Wish) -> Result<Suggestion> {
        self.refuse_yarns()?;
        let used = |fabric: usize| self.garment.panels.iter().any(|p| p.fabric == fabric);
        let cells = cells(&self.garment, used, &self.settings)?;
        suggest(&self.garment, &self.mesh, self.positions(), &cells, wish)
    }

    /// How wrong the triangles may be at each vertex, in the present state.
    pub fn vertex_errors(&self) -> Result<Indicator> {
        self.refuse_yarns()?;
        Indicator::new(&self.garment, &self.mesh, self.positions())
    }

    fn refuse_yarns(&self) -> Result<()> {
        if self.yarns.is_none() {
            return Ok(());
        }
        Err(Error::unsupported(format!(
            "the indicator reads a simulation of triangles alone; this one has {} regions of yarns",
            self.garment.blend_regions.len()
        )))
    }
}
