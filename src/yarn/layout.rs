//! Lays every yarn of a garment: weaves and knits panel by panel, then the rods of the seams.
//!
//! How many nodes that takes is estimated from the sizes of the panels and refused before any memory is
//! taken.

use super::builder::Builder;
use super::region::Region;
use super::{YarnMesh, rods, stitch, weave};
use crate::error::{Error, Result};
use crate::math::Mat2;
use crate::pattern::Garment;
use crate::pattern::yarn_fabric::{Structure, YarnFabric};

/// Node limit for hosts that name none.
pub const DEFAULT_MAX_NODES: usize = 5_000_000;
/// Indices are 32 bits wide and a node has several passages.
const MOST_NODES: usize = 1 << 28;

/// How a fabric is laid against what its numbers say: a fabric at rest has another pitch, its yarns the length that they
/// have there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cell {
    /// Laid over nominal distance across: of warp yarns, of loops along a course.
    pub across: f64,
    /// Laid over nominal distance along: of weft yarns, of courses.
    pub along: f64,
    /// Length of yarn over that of the nominal layout.
    pub rest: f64,
}

impl Default for Cell {
    fn default() -> Self {
        Self {
            across: 1.0,
            along: 1.0,
            rest: 1.0,
        }
    }
}

/// What is laid, and how.
#[derive(Clone, Debug)]
pub struct Layout<'a> {
    /// Panels, by index; `None` is every panel whose fabric has yarns.
    pub panels: Option<&'a [u32]>,
    /// Cells of the garment's fabrics; those that the slice does not reach are laid as they are.
    pub cells: &'a [Cell],
    /// Most nodes.
    pub max_nodes: usize,
}

impl Default for Layout<'_> {
    fn default() -> Self {
        Self {
            panels: None,
            cells: &[],
            max_nodes: DEFAULT_MAX_NODES,
        }
    }
}

impl Layout<'_> {
    fn cell(&self, fabric: usize) -> Cell {
        self.cells.get(fabric).copied().unwrap_or_default()
    }
}

/// Numbers of what a mesh holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Counts {
    /// Nodes.
    pub nodes: usize,
    /// Yarns, rods of seams among them.
    pub yarns: usize,
    /// Passages of yarns through nodes.
    pub incidences: usize,
    /// Unwrapping angles.
    pub wraps: usize,
    /// Lengths inside of contacts.
    pub stitch_springs: usize,
    /// Angles of crossings.
    pub corners: usize,
    /// Least distances.
    pub spacings: usize,
    /// Ties to rods.
    pub ties: usize,
    /// Memory of it all [bytes].
    pub bytes: usize,
}

impl YarnMesh {
    /// What it holds.
    pub fn counts(&self) -> Counts {
        let bytes = size_of_val(&self.uv[..])
            + size_of_val(&self.lift[..])
            + size_of_val(&self.node_panel[..])
            + size_of_val(&self.starts[..])
            + size_of_val(&self.incidences[..])
            + size_of_val(&self.yarn_fabric[..])
            + size_of_val(&self.yarn_family[..])
            + size_of_val(&self.stack_starts[..])
            + size_of_val(&self.stacks[..])
            + size_of_val(&self.wraps[..])
            + size_of_val(&self.stitch_springs[..])
            + size_of_val(&self.corners[..])
            + size_of_val(&self.spacings[..])
            + size_of_val(&self.ties[..])
            + size_of_val(&self.across[..])
            + size_of_val(&self.outside[..])
            + size_of_val(&self.alpha[..])
            + size_of_val(&self.images[..]);
        Counts {
            nodes: self.uv.len(),
            yarns: self.yarn_count(),
            incidences: self.incidences.len(),
            wraps: self.wraps.len(),
            stitch_springs: self.stitch_springs.len(),
            corners: self.corners.len(),
            spacings: self.spacings.len(),
            ties: self.ties.len(),
            bytes,
        }
    }
}

/// Lays the yarns of a checked garment.
pub fn lay(garment: &Garment, layout: &Layout<'_>) -> Result<YarnMesh> {
    let panels = wanted(garment, layout)?;
    for (k, cell) in layout.cells.iter().enumerate() {
        for (name, value) in [
            ("across", cell.across),
            ("along", cell.along),
            ("rest", cell.rest),
        ] {
            if !(value.is_finite() && (0.1..=10.0).contains(&value)) {
                return Err(Error::argument(format!(
                    "cell of fabric {k}: {name} = {value} must lie between 0.1 and 10"
                )));
            }
        }
    }
    let regions = panels
        .iter()
        .map(|p| Region::new(&garment.panels[*p]))
        .collect::<Result<Vec<_>>>()?;
    refuse_many(garment, layout, &panels, &regions)?;
    let mut builder = Builder::default();
    for (&p, region) in panels.iter().zip(&regions) {
        let fabric = garment.panels[p].fabric;
        let place = |e: Error| e.at(format!("panel '{}'", garment.panels[p].name));
        let yarns = yarns_of(garment, p)?;
        let cell = layout.cell(fabric);
        let (index, panel) = (fabric as u32, p as u32);
        let before = builder.mesh.yarn_count();
        builder.nominal = region.nominal(&cell);
        match &yarns.structure {
            Structure::Woven(woven) => {
                weave::lay(
                    &mut builder,
                    region,
                    woven,
                    yarns.radius,
                    &cell,
                    index,
                    panel,
                );
            }
            Structure::Knitted(knit) => {
                stitch::lay(&mut builder, region, knit, yarns, &cell, index, panel)
                    .map_err(place)?;
            }
        }
        if builder.mesh.yarn_count() == before {
            let [a, b] = yarns.structure.pitch();
            return Err(place(Error::geometry(format!(
                "too small for yarns {a} and {b} m apart: none is held by two others"
            ))));
        }
    }
    // rods are as long as they are laid
    builder.nominal = Mat2::identity();
    rods::sew(&mut builder, garment, &panels)?;
    let mesh = builder.finish();
    mesh.check()?;
    Ok(mesh)
}

/// The panels to lay, in the garment's order.
fn wanted(garment: &Garment, layout: &Layout<'_>) -> Result<Vec<usize>> {
    let count = garment.panels.len();
    let Some(list) = layout.panels else {
        let yarns = |p: &usize| yarns_of(garment, *p).is_ok();
        return Ok((0..count).filter(yarns).collect());
    };
    let mut panels = Vec::with_capacity(list.len());
    for p in list {
        if *p as usize >= count {
            return Err(Error::argument(format!("panel {p} of {count}")));
        }
        yarns_of(garment, *p as usize)?;
        panels.push(*p as usize);
    }
    panels.sort_unstable();
    panels.dedup();
    Ok(panels)
}

/// The yarns of a panel's fabric.
pub(super) fn yarns_of(garment: &Garment, panel: usize) -> Result<&YarnFabric> {
    let fabric = garment.fabrics.get(garment.panels[panel].fabric);
    fabric.and_then(|f| f.yarns.as_ref()).ok_or_else(|| {
        Error::material(format!(
            "panel '{}': its fabric has no yarns",
            garment.panels[panel].name
        ))
    })
}

/// Refuses more nodes than the limit.
fn refuse_many(
    garment: &Garment,
    layout: &Layout<'_>,
    panels: &[usize],
    regions: &[Region],
) -> Result<()> {
    let limit = layout.max_nodes.min(MOST_NODES);
    let mut total = 0.0;
    for (&p, region) in panels.iter().zip(regions) {
        let [low, high] = region.bounds();
        let size = high - low;
        let cell = layout.cell(garment.panels[p].fabric);
        let count = match &yarns_of(garment, p)?.structure {
            Structure::Woven(woven) => {
                let [warps, wefts] = weave::line_counts(woven, &cell, size);
                let share = garment.panels[p].area()? / (size.x * size.y);
                warps * wefts * share + 2.0 * (warps + wefts)
            }
            Structure::Knitted(knit) => stitch::estimate(knit, &cell, size),
        };
        total += count;
        if !(total <= limit as f64) {
            return Err(Error::limit(format!(
                "panel '{}': about {count:.3e} yarn nodes, {total:.3e} with the panels before it, limit {limit}",
                garment.panels[p].name
            )));
        }
    }
    Ok(())
}
