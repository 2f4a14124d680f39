//! toile's own garment object, version 1. Keys and units stand in [`super::schema`].

use super::DEFAULT_EDGE_LENGTH;
use super::fabric::{fabric_from_json, fabric_from_node};
use super::read::{Node, Object, keep};
use super::schema;
use crate::error::{Error, Result};
use crate::math::Rotation;
use crate::pattern::curve::Curve;
use crate::pattern::{BlendRegion, Edge, EdgeRef, Fabric, Garment, Panel, Placement, Seam, Shape};
use nalgebra::Quaternion;
use std::collections::BTreeMap;
use std::path::Path;

/// Version of the format that this library writes and reads.
pub const VERSION: u32 = 1;

/// Names to indices; a name that stands twice is ambiguous and cannot be used.
struct Names<'a> {
    what: &'static str,
    index: BTreeMap<&'a str, Option<u32>>,
    count: usize,
}

impl<'a> Names<'a> {
    fn new(what: &'static str, names: impl Iterator<Item = &'a str>) -> Self {
        let mut index = BTreeMap::new();
        let mut count = 0;
        for name in names {
            index
                .entry(name)
                .and_modify(|entry| *entry = None)
                .or_insert(Some(count as u32));
            count += 1;
        }
        Self { what, index, count }
    }

    /// An index, or the name of exactly one thing.
    fn find(&self, node: &Node<'_>) -> Result<u32> {
        if let Some(name) = node.value.as_str() {
            return match self.index.get(name) {
                Some(Some(index)) => Ok(*index),
                Some(None) => Err(node.error(format!("several {}s are named {name:?}", self.what))),
                None => Err(node.error(format!("no {} is named {name:?}", self.what))),
            };
        }
        let index = node.index()?;
        if index as usize >= self.count {
            return Err(node.error(format!("{} {index} of {}", self.what, self.count)));
        }
        Ok(index)
    }
}

/// Reads a garment object; the notes tell what measured fabrics held that was not used. All problems
/// are put aside, the first of each fabric, panel, seam and region; with any nothing is read.
pub fn read_garment(
    garment: &Object<'_>,
    base_dir: Option<&Path>,
    problems: &mut Vec<Error>,
) -> Option<(Garment, Vec<String>)> {
    let before = problems.len();
    let version = keep(problems, garment.need("toile_garment"))?;
    let number = keep(problems, version.index())?;
    if number != VERSION {
        problems.push(version.error(format!("version {number} is not known, only {VERSION}")));
        return None;
    }
    keep(problems, garment.only(schema::GARMENT));
    let mut notes = Vec::new();
    let mut fabrics = Vec::new();
    let mut complete = true;
    for node in list(garment, "fabrics", problems) {
        match read_fabric(&node, base_dir) {
            Ok((fabric, more)) => {
                notes.extend(more.iter().map(|note| format!("{}: {note}", node.path)));
                fabrics.push(fabric);
            }
            Err(e) => {
                problems.push(e);
                complete = false;
            }
        }
    }
    if fabrics.is_empty() && complete {
        fabrics.push(Fabric::default());
    }
    // a fabric that could not be read has no name: what names one is not held against the others
    let fabric_names =
        complete.then(|| Names::new("fabric", fabrics.iter().map(|f| f.name.as_str())));
    keep(problems, garment.need("panels"));
    let nodes = list(garment, "panels", problems);
    let read = nodes.iter().map(|node| {
        let panel = node
            .object()
            .and_then(|o| read_panel(&o, fabric_names.as_ref()));
        keep(problems, panel)
    });
    let read: Vec<Option<Panel>> = read.collect();
    let panel_names = Names::new("panel", nodes.iter().map(name_of));
    let mut seams = Vec::new();
    for node in list(garment, "seams", problems) {
        let seam = node.object().and_then(|o| read_seam(&o, &panel_names));
        seams.extend(keep(problems, seam));
    }
    let mut blend_regions = Vec::new();
    for node in list(garment, "blend_regions", problems) {
        let region = node
            .object()
            .and_then(|o| read_blend_regions(&o, &panel_names, &seams));
        blend_regions.extend(keep(problems, region).into_iter().flatten());
    }
    let name = garment
        .get("name")
        .map_or(Ok("garment"), |name| name.text());
    let name = keep(problems, name);
    let edge_length = keep(
        problems,
        garment.number_or("edge_length", DEFAULT_EDGE_LENGTH),
    );
    if problems.len() > before {
        return None;
    }
    let garment = Garment {
        name: name?.to_owned(),
        edge_length: edge_length?,
        panels: read.into_iter().collect::<Option<_>>()?,
        seams,
        fabrics,
        blend_regions,
    };
    for panel in &garment.panels {
        // a loop that is not closed is found by the garment's check
        if panel.signed_outline_area().is_ok_and(|area| area < 0.0) {
            notes.push(format!(
                "panel '{}': its outline runs clockwise, so that its outside is the side seen from -z before it is \
                 placed",
                panel.name
            ));
        }
    }
    Some((garment, notes))
}

/// Entries of a list, none where there is no list.
fn list<'a>(object: &Object<'a>, key: &str, problems: &mut Vec<Error>) -> Vec<Node<'a>> {
    let entries = object.get(key).map(|node| node.array());
    entries
        .and_then(|entries| keep(problems, entries))
        .unwrap_or_default()
}

/// Name of a panel, empty where it has none that could be read.
fn name_of<'a>(node: &Node<'a>) -> &'a str {
    node.value
        .get("name")
        .and_then(|name| name.as_str())
        .unwrap_or_default()
}

fn read_fabric(node: &Node<'_>, base_dir: Option<&Path>) -> Result<(Fabric, Vec<String>)> {
    let Some(file) = node.value.as_str() else {
        return fabric_from_node(node);
    };
    let Some(base_dir) = base_dir else {
        return Err(node.error(format!(
            "fabric file {file:?} cannot be found: the garment was read without a folder"
        )));
    };
    let path = base_dir.join(file);
    let text = std::fs::read_to_string(&path)
        .map_err(|e| Error::io(format!("cannot read {}: {e}", path.display())).at(&node.path))?;
    let (mut fabric, notes) =
        fabric_from_json(&text).map_err(|e| e.at(path.display()).at(&node.path))?;
    // measured files carry no name
    if fabric.name == "measured fabric"
        && let Some(stem) = path.file_stem()
    {
        fabric.name = stem.to_string_lossy().into_owned();
    }
    Ok((fabric, notes))
}

fn read_panel(panel: &Object<'_>, fabrics: Option<&Names<'_>>) -> Result<Panel> {
    panel.only(schema::PANEL)?;
    let mut vertices = Vec::new();
    for node in panel.need("vertices")?.array()? {
        vertices.push(node.vec2()?);
    }
    let corners = vertices.len();
    let read_loop = |node: &Node<'_>| -> Result<Vec<Edge>> {
        node.array()?
            .iter()
            .map(|edge| read_edge(edge, corners))
            .collect()
    };
    let outline = read_loop(&panel.need("edges")?)?;
    let mut holes = Vec::new();
    if let Some(list) = panel.get("holes") {
        for node in list.array()? {
            holes.push(read_loop(&node)?);
        }
    }
    Ok(Panel {
        name: panel.need("name")?.text()?.to_owned(),
        vertices,
        outline,
        holes,
        placement: match panel.get("placement") {
            Some(node) => read_placement(&node.object()?)?,
            None => Placement::default(),
        },
        fabric: match (panel.get("fabric"), fabrics) {
            (Some(node), Some(fabrics)) => fabrics.find(&node)? as usize,
            _ => 0,
        },
        grain: read_angle(panel, "grain_deg", "grain_rad")?,
        edge_length: panel
            .get("edge_length")
            .map(|node| node.number())
            .transpose()?,
        label: read_label(panel)?,
    })
}

fn read_label(object: &Object<'_>) -> Result<Option<String>> {
    object
        .get("label")
        .map(|node| node.text().map(str::to_owned))
        .transpose()
}

/// An angle in degrees or in radians [rad].
fn read_angle(object: &Object<'_>, degrees: &str, radians: &str) -> Result<f64> {
    match (object.get(degrees), object.get(radians)) {
        (Some(_), Some(_)) => {
            Err(object.error(format!("has both '{degrees}' and '{radians}'; give one")))
        }
        (Some(node), None) => Ok(node.number()?.to_radians()),
        (None, Some(node)) => node.number(),
        (None, None) => Ok(0.0),
    }
}

fn read_edge(node: &Node<'_>, corners: usize) -> Result<Edge> {
    let ends = |node: &Node<'_>| -> Result<[u32; 2]> {
        let pair = node.array_of::<2>()?;
        let mut ends = [0; 2];
        for (end, entry) in ends.iter_mut().zip(&pair) {
            *end = entry.index()?;
            if *end as usize >= corners {
                return Err(entry.error(format!("corner {end} of {corners}")));
            }
        }
        Ok(ends)
    };
    if node.value.is_array() {
        let [start, end] = ends(node)?;
        return Ok(Edge {
            start,
            end,
            curve: Curve::Line,
            label: None,
        });
    }
    let edge = node.object()?;
    edge.only(schema::EDGE)?;
    let [start, end] = ends(&edge.need("endpoints")?)?;
    let curve = match (edge.get("quadratic"), edge.get("cubic"), edge.get("arc")) {
        (None, None, None) => Curve::Line,
        (Some(c), None, None) => Curve::Quadratic(c.vec2()?),
        (None, Some(c), None) => {
            let [a, b] = c.array_of::<2>()?;
            Curve::Cubic(a.vec2()?, b.vec2()?)
        }
        (None, None, Some(a)) => {
            let arc = a.object()?;
            arc.only(schema::ARC)?;
            Curve::Arc {
                radius: arc.need("radius")?.number()?,
                large: arc.boolean_or("large", false)?,
                right: arc.boolean_or("right", false)?,
            }
        }
        _ => return Err(edge.error("has more than one of 'quadratic', 'cubic', 'arc'")),
    };
    Ok(Edge {
        start,
        end,
        curve,
        label: read_label(&edge)?,
    })
}

fn read_placement(placement: &Object<'_>) -> Result<Placement> {
    placement.only(schema::PLACEMENT)?;
    let mut result = Placement::default();
    if let Some(node) = placement.get("translation") {
        result.translation = node.vec3()?;
    }
    match (
        placement.get("rotation_deg"),
        placement.get("quaternion_xyzw"),
    ) {
        (Some(_), Some(_)) => {
            return Err(placement.error("has both 'rotation_deg' and 'quaternion_xyzw'; give one"));
        }
        (Some(node), None) => {
            let angles = node.vec3()?.map(f64::to_radians);
            result.rotation = Rotation::from_euler_angles(angles.x, angles.y, angles.z);
        }
        (None, Some(node)) => {
            let [x, y, z, w] = node.array_of::<4>()?;
            let q = Quaternion::new(w.number()?, x.number()?, y.number()?, z.number()?);
            let norm = q.norm();
            if !(norm > 1e-6 && norm < 1e6) {
                return Err(node.error(format!("quaternion of length {norm} is no rotation")));
            }
            // what is unit up to rounding keeps its bits, so that files come back the same
            result.rotation = if (norm - 1.0).abs() <= 1e-14 {
                Rotation::new_unchecked(q)
            } else {
                Rotation::new_normalize(q)
            };
        }
        (None, None) => {}
    }
    Ok(result)
}

fn read_seam(seam: &Object<'_>, panels: &Names<'_>) -> Result<Seam> {
    seam.only(schema::SEAM)?;
    let side = |key: &str| -> Result<EdgeRef> {
        let [panel, edge] = seam.need(key)?.array_of::<2>()?;
        Ok(EdgeRef {
            panel: panels.find(&panel)?,
            edge: edge.index()?,
        })
    };
    Ok(Seam {
        a: side("a")?,
        b: side("b")?,
        same_direction: seam.boolean_or("same_direction", false)?,
        rest_angle: read_angle(seam, "rest_angle_deg", "rest_angle_rad")?,
    })
}

/// One region, or one on each side of a seam.
fn read_blend_regions(
    region: &Object<'_>,
    panels: &Names<'_>,
    seams: &[Seam],
) -> Result<Vec<BlendRegion>> {
    region.only(schema::BLEND_REGION)?;
    let rings = region.get("rings").map_or(Ok(0), |node| node.index())?;
    let given = |key: &&str| region.get(key).is_some();
    let shapes: Vec<&str> = (["polygon", "disc", "edge", "seam"].into_iter())
        .filter(given)
        .collect();
    let [shape] = shapes[..] else {
        return Err(region.error(format!(
            "one of 'polygon', 'disc', 'edge', 'seam' must be there, not {}",
            shapes.len()
        )));
    };
    let node = region.need(shape)?;
    let beside = matches!(shape, "edge" | "seam");
    if !beside && region.get("width").is_some() {
        return Err(region.error(format!("'width' has no meaning beside '{shape}'")));
    }
    let along = |side: EdgeRef| -> Result<BlendRegion> {
        Ok(BlendRegion {
            panel: side.panel,
            shape: Shape::Edge {
                edge: side.edge,
                width: region.need("width")?.number()?,
            },
            rings,
        })
    };
    if shape == "seam" {
        let index = node.index()?;
        let Some(seam) = seams.get(index as usize) else {
            return Err(node.error(format!("seam {index} of {}", seams.len())));
        };
        if region.get("panel").is_some() {
            return Err(region.error("'panel' has no meaning beside 'seam'"));
        }
        return [seam.a, seam.b].into_iter().map(along).collect();
    }
    let panel = panels.find(&region.need("panel")?)?;
    let shape = match shape {
        "edge" => {
            let edge = node.index()?;
            return Ok(vec![along(EdgeRef { panel, edge })?]);
        }
        "disc" => {
            let disc = node.object()?;
            disc.only(schema::DISC)?;
            Shape::Disc {
                center: disc.need("center")?.vec2()?,
                radius: disc.need("radius")?.number()?,
            }
        }
        _ => {
            let corners = node.array()?;
            Shape::Polygon(corners.iter().map(Node::vec2).collect::<Result<_>>()?)
        }
    };
    Ok(vec![BlendRegion {
        panel,
        shape,
        rings,
    }])
}
