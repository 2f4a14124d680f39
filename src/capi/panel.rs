//! A panel of the pattern from its C description.

use super::input;
use super::types::{
    TOILE_EDGE_ARC, TOILE_EDGE_CUBIC, TOILE_EDGE_LINE, TOILE_EDGE_QUADRATIC, toile_panel_desc,
};
use crate::error::{Error, Result};
use crate::math::{Rotation, Vec2, Vec3};
use crate::pattern::curve::Curve;
use crate::pattern::{Edge, Panel, Placement};

/// Most corners, edges or holes of one panel.
pub(super) const LARGEST_PANEL: usize = 1 << 20;

/// A panel from its description; everything about it that does not need the garment is checked.
pub(super) unsafe fn panel(desc: &toile_panel_desc) -> Result<Panel> {
    const LIMIT: usize = LARGEST_PANEL;
    input::reserved(desc.reserved)?;
    // SAFETY: the description's pointers are the caller's, as the header asks.
    let (name, vertices, pairs, kinds, controls, holes) = unsafe {
        let kinds = if desc.edge_kinds.is_null() {
            &[]
        } else {
            input::array(desc.edge_kinds, desc.edge_count, LIMIT, "edge_kinds")?
        };
        let controls = if desc.edge_controls.is_null() {
            Vec::new()
        } else {
            controls(desc.edge_controls, desc.edge_count, kinds)?
        };
        (
            input::optional_name(desc.name, "name")?.unwrap_or_default(),
            input::points::<2>(desc.vertices, desc.vertex_count, LIMIT, "vertices")?,
            input::array(
                desc.edges.cast::<[u32; 2]>(),
                desc.edge_count,
                LIMIT,
                "edges",
            )?,
            kinds,
            controls,
            input::array(desc.hole_sizes, desc.hole_count, LIMIT, "hole_sizes")?,
        )
    };
    if vertices.len() < 2 {
        return Err(Error::geometry(format!(
            "panel '{name}': {} corners cannot enclose anything",
            vertices.len()
        )));
    }

    // edges, straight around the corners if none are given
    let corner_count = vertices.len();
    let mut edges = Vec::with_capacity(pairs.len().max(corner_count));
    if pairs.is_empty() {
        if !kinds.is_empty() || !holes.is_empty() {
            return Err(Error::argument(format!(
                "panel '{name}': edge kinds or holes without edges"
            )));
        }
        for i in 0..corner_count {
            edges.push(Edge {
                start: i as u32,
                end: ((i + 1) % corner_count) as u32,
                curve: Curve::Line,
                label: None,
            });
        }
    }
    for (i, &[start, end]) in pairs.iter().enumerate() {
        for corner in [start, end] {
            if corner as usize >= corner_count {
                return Err(Error::geometry(format!(
                    "panel '{name}': edge {i} uses corner {corner} of {corner_count}"
                )));
            }
        }
        let kind = kinds.get(i).copied().unwrap_or(TOILE_EDGE_LINE);
        let curve = curve(kind, controls.get(i), i).map_err(|e| e.at(format!("panel '{name}'")))?;
        edges.push(Edge {
            start,
            end,
            curve,
            label: None,
        });
    }

    // loops: the outline has what the holes leave
    let in_holes: u64 = holes.iter().map(|&n| u64::from(n)).sum();
    if in_holes >= edges.len() as u64 {
        return Err(Error::geometry(format!(
            "panel '{name}': the holes have {in_holes} of {} edges, which leaves no outline",
            edges.len()
        )));
    }
    let mut rest = edges.split_off(edges.len() - in_holes as usize).into_iter();
    let holes = holes
        .iter()
        .map(|&n| rest.by_ref().take(n as usize).collect())
        .collect();

    input::finite_all(&desc.position, "position")?;
    let [x, y, z, w] = input::quaternion(desc.quaternion_xyzw, "quaternion_xyzw")?;
    let rotation = Rotation::new_normalize(nalgebra::Quaternion::new(w, x, y, z));
    Ok(Panel {
        name: name.to_owned(),
        vertices: vertices.iter().map(|&[u, v]| Vec2::new(u, v)).collect(),
        outline: edges,
        holes,
        placement: Placement {
            rotation,
            translation: Vec3::from(desc.position),
        },
        fabric: desc.fabric as usize,
        grain: input::finite(desc.grain, "grain")?,
        edge_length: match input::not_negative(desc.edge_length, "edge_length")? {
            0.0 => None,
            length => Some(length),
        },
        label: None,
    })
}

/// Control numbers of the edges, finite where the kind uses them.
unsafe fn controls(from: *const f64, count: usize, kinds: &[u32]) -> Result<Vec<[f64; 4]>> {
    // SAFETY: handed on.
    let all = unsafe {
        input::array(
            from.cast::<[f64; 4]>(),
            count,
            LARGEST_PANEL,
            "edge_controls",
        )?
    };
    for (i, numbers) in all.iter().enumerate() {
        let used = match kinds.get(i) {
            Some(&TOILE_EDGE_QUADRATIC) => 2,
            Some(&TOILE_EDGE_CUBIC) => 4,
            Some(&TOILE_EDGE_ARC) => 3,
            _ => 0,
        };
        input::finite_all(&numbers[..used], &format!("edge_controls[{i}]"))?;
    }
    Ok(all.to_vec())
}

fn curve(kind: u32, controls: Option<&[f64; 4]>, edge: usize) -> Result<Curve> {
    if kind == TOILE_EDGE_LINE {
        return Ok(Curve::Line);
    }
    let bit = |x: f64, what: &str| match x {
        0.0 => Ok(false),
        1.0 => Ok(true),
        _ => Err(Error::argument(format!(
            "edge {edge}: {what} = {x} must be 0 or 1"
        ))),
    };
    let c = controls
        .ok_or_else(|| Error::argument(format!("edge {edge} is curved, edge_controls is NULL")))?;
    match kind {
        TOILE_EDGE_QUADRATIC => Ok(Curve::Quadratic(Vec2::new(c[0], c[1]))),
        TOILE_EDGE_CUBIC => Ok(Curve::Cubic(Vec2::new(c[0], c[1]), Vec2::new(c[2], c[3]))),
        TOILE_EDGE_ARC => Ok(Curve::Arc {
            radius: input::positive(c[0], "radius")?,
            large: bit(c[1], "larger arc")?,
            right: bit(c[2], "bulge to the right")?,
        }),
        _ => Err(Error::argument(format!(
            "edge {edge}: {kind} is not a kind of edge"
        ))),
    }
}
