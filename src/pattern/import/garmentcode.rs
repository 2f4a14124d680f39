//! GarmentCode and Garment-Pattern-Generator specification JSON.
//!
//! `pattern` alone is the geometry; parameters are ignored. `properties.units_in_meter` (100 for
//! centimetres, 300 in old templates) divides vertices, translations and arc radii. Placement is
//! `x = R (u, v, 0) + t` with `R = Rz Ry Rx` (angles in degrees). Curvature is relative to the edge
//! (`start + cx (end - start) + cy perp`, `perp = (-dy, dx)`) or, if
//! `properties.curvature_coords` is "absolute", in panel coordinates; a bare pair is a quadratic
//! control point. Loops keep their direction: it defines the outside of the cloth.
//!
//! Loader hints of the reference tools (`normalize_panel_translation`, `normalized_edge_loops`,
//! `panel_order`) change no geometry and are ignored, and so are keys not named here.

use super::DEFAULT_EDGE_LENGTH;
use super::read::{Node, Object};
use crate::error::Result;
use crate::math::{Rotation, Vec2};
use crate::pattern::curve::Curve;
use crate::pattern::{Edge, EdgeRef, Fabric, Garment, Panel, Placement, Seam};
use std::collections::BTreeMap;

/// Reads a specification. The garment has the default fabric and edge length, and no name.
pub fn read_specification(root: &Object<'_>) -> Result<Garment> {
    let properties = root.get("properties").map(|n| n.object()).transpose()?;
    let mut units = 100.0;
    let mut relative = true;
    if let Some(properties) = &properties {
        if let Some(node) = properties.get("units_in_meter") {
            units = node.number()?;
            if units <= 0.0 {
                return Err(node.error(format!("must be positive, is {units}")));
            }
        }
        if let Some(node) = properties.get("curvature_coords") {
            relative = match node.text()? {
                "relative" => true,
                "absolute" => false,
                other => {
                    return Err(node.error(format!(
                        "must be \"relative\" or \"absolute\", is {other:?}"
                    )));
                }
            };
        }
    }
    let pattern = root.need("pattern")?.object()?;
    let mut names = BTreeMap::new();
    let mut panels = Vec::new();
    for (name, node) in pattern.need("panels")?.object()?.entries() {
        names.insert(name, panels.len() as u32);
        panels.push(read_panel(name, &node.object()?, units, relative)?);
    }
    let mut seams = Vec::new();
    if let Some(stitches) = pattern.get("stitches") {
        for node in stitches.array()? {
            seams.push(read_stitch(&node, &names)?);
        }
    }
    Ok(Garment {
        name: String::new(),
        panels,
        seams,
        fabrics: vec![Fabric::default()],
        edge_length: DEFAULT_EDGE_LENGTH,
        blend_regions: Vec::new(),
    })
}

fn read_panel(name: &str, panel: &Object<'_>, units: f64, relative: bool) -> Result<Panel> {
    let mut vertices = Vec::new();
    for node in panel.need("vertices")?.array()? {
        vertices.push(node.vec2()? / units);
    }
    let mut outline = Vec::new();
    for node in panel.need("edges")?.array()? {
        outline.push(read_edge(&node.object()?, &vertices, units, relative)?);
    }
    let mut placement = Placement::default();
    if let Some(node) = panel.get("translation") {
        placement.translation = node.vec3()? / units;
    }
    if let Some(node) = panel.get("rotation") {
        let angles = node.vec3()?.map(f64::to_radians);
        placement.rotation = Rotation::from_euler_angles(angles.x, angles.y, angles.z);
    }
    Ok(Panel {
        name: name.into(),
        vertices,
        outline,
        holes: Vec::new(),
        placement,
        fabric: 0,
        grain: 0.0,
        edge_length: None,
        label: read_label(panel)?,
    })
}

fn read_label(object: &Object<'_>) -> Result<Option<String>> {
    object
        .get("label")
        .map(|node| node.text().map(str::to_owned))
        .transpose()
        .map(|label| label.filter(|text| !text.is_empty()))
}

fn read_edge(edge: &Object<'_>, vertices: &[Vec2], units: f64, relative: bool) -> Result<Edge> {
    let [start, end] = edge.need("endpoints")?.array_of::<2>()?;
    let corner = |node: &Node<'_>| -> Result<(u32, Vec2)> {
        let index = node.index()?;
        match vertices.get(index as usize) {
            Some(p) => Ok((index, *p)),
            None => Err(node.error(format!("corner {index} of {}", vertices.len()))),
        }
    };
    let ((start, from), (end, to)) = (corner(&start)?, corner(&end)?);
    let along = to - from;
    let perp = Vec2::new(-along.y, along.x);
    let control = |node: &Node<'_>| -> Result<Vec2> {
        let c = node.vec2()?;
        Ok(if relative {
            from + c.x * along + c.y * perp
        } else {
            c / units
        })
    };
    let curve = match edge.get("curvature") {
        None => Curve::Line,
        Some(node) if node.value.is_array() => Curve::Quadratic(control(&node)?),
        Some(node) => read_curvature(&node.object()?, units, &control)?,
    };
    Ok(Edge {
        start,
        end,
        curve,
        label: read_label(edge)?,
    })
}

fn read_curvature(
    curvature: &Object<'_>,
    units: f64,
    control: &impl Fn(&Node<'_>) -> Result<Vec2>,
) -> Result<Curve> {
    let kind = curvature.need("type")?;
    let params = curvature.need("params")?;
    match kind.text()? {
        "quadratic" => {
            let [c] = params.array_of::<1>()?;
            Ok(Curve::Quadratic(control(&c)?))
        }
        "cubic" => {
            let [c, d] = params.array_of::<2>()?;
            Ok(Curve::Cubic(control(&c)?, control(&d)?))
        }
        "circle" => {
            let [radius, large, right] = params.array_of::<3>()?;
            Ok(Curve::Arc {
                radius: radius.number()? / units,
                large: flag(&large)?,
                right: flag(&right)?,
            })
        }
        other => Err(kind.error(format!(
            "must be \"quadratic\", \"cubic\" or \"circle\", is {other:?}"
        ))),
    }
}

/// 0 or 1, or a boolean.
fn flag(node: &Node<'_>) -> Result<bool> {
    if node.value.is_boolean() {
        return node.boolean();
    }
    match node.number()? {
        0.0 => Ok(false),
        1.0 => Ok(true),
        other => Err(node.error(format!("must be 0 or 1, is {other}"))),
    }
}

fn read_stitch(node: &Node<'_>, names: &BTreeMap<&str, u32>) -> Result<Seam> {
    let sides = node.array()?;
    let (a, b, same_direction) = match sides.as_slice() {
        [a, b] => (a, b, false),
        [a, b, flag] => match flag.text()? {
            "right_wrong" => (a, b, true),
            other => {
                return Err(flag.error(format!("must be \"right_wrong\", is {other:?}")));
            }
        },
        _ => {
            return Err(node.error(format!(
                "must have two sides and perhaps \"right_wrong\", has {} entries",
                sides.len()
            )));
        }
    };
    let side = |node: &Node<'_>| -> Result<EdgeRef> {
        let object = node.object()?;
        let panel = object.need("panel")?;
        let name = panel.text()?;
        Ok(EdgeRef {
            panel: *names
                .get(name)
                .ok_or_else(|| panel.error(format!("no panel is named {name:?}")))?,
            edge: object.need("edge")?.index()?,
        })
    };
    Ok(Seam {
        a: side(a)?,
        b: side(b)?,
        same_direction,
        rest_angle: 0.0,
    })
}
