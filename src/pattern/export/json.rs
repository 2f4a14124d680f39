//! A garment as toile's own JSON object; reading it back gives the same garment, bit for bit.
//!
//! Rotations are written as quaternions. Angles are written in degrees where that is exact, else in
//! radians. Panels and fabrics are named by name where the name is unique, else by index.

use crate::error::{Error, Result};
use crate::math::Vec2;
use crate::pattern::chart::Notation;
use crate::pattern::curve::Curve;
use crate::pattern::import::json::VERSION;
use crate::pattern::yarn_fabric::Structure;
use crate::pattern::{
    BendingModel, BlendRegion, Edge, Fabric, Garment, Panel, Placement, Ridge, Shape, YarnFabric,
};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;

/// Widest line on which a value is written whole.
const LINE: usize = 100;

/// The garment as JSON text. Numbers that are not finite cannot be written and are refused.
pub fn garment_to_json(garment: &Garment) -> Result<String> {
    let mut root = Map::new();
    root.insert("toile_garment".into(), json!(VERSION));
    root.insert("name".into(), json!(garment.name));
    root.insert("edge_length".into(), number(garment.edge_length)?);
    let fabrics = garment.fabrics.iter().map(fabric_value);
    root.insert("fabrics".into(), fabrics.collect::<Result<Value>>()?);
    let panels = garment.panels.iter().map(|p| panel_value(garment, p));
    root.insert("panels".into(), panels.collect::<Result<Value>>()?);
    let name = |panel| panel_name(garment, panel);
    let mut seams = Vec::new();
    for seam in &garment.seams {
        let mut value = Map::new();
        value.insert("a".into(), json!([name(seam.a.panel), seam.a.edge]));
        value.insert("b".into(), json!([name(seam.b.panel), seam.b.edge]));
        if seam.same_direction {
            value.insert("same_direction".into(), json!(true));
        }
        angle(&mut value, seam.rest_angle, "rest_angle")?;
        seams.push(Value::Object(value));
    }
    root.insert("seams".into(), Value::Array(seams));
    if !garment.blend_regions.is_empty() {
        root.insert("blend_regions".into(), blend_regions(garment)?);
    }
    Ok(text(&Value::Object(root)))
}

/// The list of the garment's blend regions.
pub fn blend_regions(garment: &Garment) -> Result<Value> {
    let value = |region: &BlendRegion| -> Result<Value> {
        let mut value = Map::new();
        value.insert("panel".into(), panel_name(garment, region.panel));
        match &region.shape {
            Shape::Polygon(corners) => {
                value.insert("polygon".into(), points(corners)?);
            }
            Shape::Disc { center, radius } => {
                let disc = json!({"center": point(center)?, "radius": number(*radius)?});
                value.insert("disc".into(), disc);
            }
            Shape::Edge { edge, width } => {
                value.insert("edge".into(), json!(edge));
                value.insert("width".into(), number(*width)?);
            }
        }
        value.insert("rings".into(), json!(region.rings));
        Ok(Value::Object(value))
    };
    garment.blend_regions.iter().map(value).collect()
}

/// A panel by its name, if that is its own.
fn panel_name(garment: &Garment, panel: u32) -> Value {
    match garment.panels.get(panel as usize) {
        Some(p) if garment.panels.iter().filter(|q| q.name == p.name).count() == 1 => {
            json!(p.name)
        }
        _ => json!(panel),
    }
}

/// One fabric as JSON text.
pub fn fabric_to_json(fabric: &Fabric) -> Result<String> {
    Ok(text(&fabric_value(fabric)?))
}

fn number(x: f64) -> Result<Value> {
    if x.is_finite() {
        Ok(json!(x))
    } else {
        Err(Error::argument(format!("{x} cannot be written as JSON")))
    }
}

fn point(p: &Vec2) -> Result<Value> {
    Ok(Value::Array(vec![number(p.x)?, number(p.y)?]))
}

fn points(list: &[Vec2]) -> Result<Value> {
    list.iter().map(point).collect()
}

/// Writes a non-zero angle in degrees if reading them gives the same bits, else in radians.
fn angle(object: &mut Map<String, Value>, radians: f64, key: &str) -> Result<()> {
    if radians == 0.0 && radians.is_sign_positive() {
        return Ok(());
    }
    let degrees = radians.to_degrees();
    let rounded = (degrees * 1e6).round() * 1e-6;
    for candidate in [rounded, degrees, degrees.next_up(), degrees.next_down()] {
        if candidate.to_radians().to_bits() == radians.to_bits() {
            object.insert(format!("{key}_deg"), number(candidate)?);
            return Ok(());
        }
    }
    object.insert(format!("{key}_rad"), number(radians)?);
    Ok(())
}

fn fabric_value(fabric: &Fabric) -> Result<Value> {
    let mut value = json!({
        "name": fabric.name,
        "density": number(fabric.density)?,
        "membrane": {
            "warp": number(fabric.warp)?,
            "weft": number(fabric.weft)?,
            "coupling": number(fabric.coupling)?,
            "shear": number(fabric.shear)?,
        },
        "bending": {
            "warp": number(fabric.bending_warp)?,
            "weft": number(fabric.bending_weft)?,
            "model": match fabric.bending_model {
                BendingModel::Hinge => "hinge",
                BendingModel::Quadratic => "quadratic",
            },
        },
        "damping": {
            "mass": number(fabric.damping_mass)?,
            "stiffness": number(fabric.damping_stiffness)?,
        },
        "thickness": number(fabric.thickness)?,
        "friction": number(fabric.friction)?,
    });
    for (key, curvature) in [
        ("curvature_warp", fabric.curvature_warp),
        ("curvature_weft", fabric.curvature_weft),
    ] {
        if curvature != 0.0 {
            value["bending"][key] = number(curvature)?;
        }
    }
    if !fabric.ridges.is_empty() {
        let ridges = fabric.ridges.iter().map(ridge_value);
        value["ridges"] = ridges.collect::<Result<Value>>()?;
    }
    if fabric.fitted {
        value["triangles"] = json!("fitted");
    }
    if let Some(yarns) = &fabric.yarns {
        value["yarns"] = yarns_value(yarns)?;
    }
    Ok(value)
}

fn ridge_value(ridge: &Ridge) -> Result<Value> {
    let numbers = |list: &[f64]| list.iter().map(|x| number(*x)).collect::<Result<Value>>();
    Ok(json!({
        "direction": numbers(ridge.direction().as_slice())?,
        "strain": numbers(ridge.strains())?,
        "stiffness": numbers(ridge.stiffness())?,
    }))
}

fn yarns_value(yarns: &YarnFabric) -> Result<Value> {
    let mut value = Map::new();
    match &yarns.structure {
        Structure::Woven(weave) => {
            let mask = weave.mask.lines();
            value.insert(
                "weave".into(),
                mask.map_or_else(|lines| json!(lines), |name| json!(name)),
            );
            value.insert("warp_pitch".into(), number(weave.warp_pitch)?);
            value.insert("weft_pitch".into(), number(weave.weft_pitch)?);
        }
        Structure::Knitted(knit) => {
            let key = match knit.chart.notation() {
                Notation::Grid => "chart",
                Notation::Worked => "instructions",
            };
            value.insert(key.into(), json!(knit.chart.source()));
            if knit.once {
                value.insert("once".into(), json!(true));
            }
            value.insert("loop_width".into(), number(knit.loop_width)?);
            value.insert("loop_height".into(), number(knit.loop_height)?);
        }
    }
    for (key, x) in [
        ("radius", yarns.radius),
        ("density", yarns.density),
        ("young", yarns.young),
        ("bending", yarns.bending),
        ("shear", yarns.shear),
        ("wrapping", yarns.wrapping),
        ("stitch", yarns.stitch),
        ("spacing", yarns.spacing),
        ("friction", yarns.friction),
        ("anchor", yarns.anchor),
        ("sliding_damping", yarns.sliding_damping),
    ] {
        value.insert(key.into(), number(x)?);
    }
    value.insert(
        "damping".into(),
        json!({
            "mass": number(yarns.damping_mass)?,
            "stiffness": number(yarns.damping_stiffness)?,
        }),
    );
    if yarns.compensated {
        value.insert("compensated".into(), json!(true));
    }
    if !yarns.fastened {
        value.insert("fastened".into(), json!(false));
    }
    Ok(Value::Object(value))
}

fn panel_value(garment: &Garment, panel: &Panel) -> Result<Value> {
    let mut value = Map::new();
    value.insert("name".into(), json!(panel.name));
    if let Some(label) = &panel.label {
        value.insert("label".into(), json!(label));
    }
    let placement = placement_value(&panel.placement)?;
    if !placement.is_empty() {
        value.insert("placement".into(), Value::Object(placement));
    }
    let fabric = garment
        .fabrics
        .get(panel.fabric)
        .filter(|f| garment.fabrics.iter().filter(|g| g.name == f.name).count() == 1);
    value.insert(
        "fabric".into(),
        fabric.map_or(json!(panel.fabric), |f| json!(f.name)),
    );
    angle(&mut value, panel.grain, "grain")?;
    if let Some(h) = panel.edge_length {
        value.insert("edge_length".into(), number(h)?);
    }
    value.insert("vertices".into(), points(&panel.vertices)?);
    let ring = |edges: &[Edge]| edges.iter().map(edge_value).collect::<Result<Value>>();
    value.insert("edges".into(), ring(&panel.outline)?);
    if !panel.holes.is_empty() {
        let holes = panel.holes.iter().map(|hole| ring(hole));
        value.insert("holes".into(), holes.collect::<Result<Value>>()?);
    }
    Ok(Value::Object(value))
}

fn placement_value(placement: &Placement) -> Result<Map<String, Value>> {
    let mut value = Map::new();
    let t = placement.translation;
    if t.iter().any(|x| x.to_bits() != 0) {
        value.insert(
            "translation".into(),
            Value::Array(vec![number(t.x)?, number(t.y)?, number(t.z)?]),
        );
    }
    let q = placement.rotation.quaternion();
    if [q.i, q.j, q.k, q.w].map(f64::to_bits) != [0.0, 0.0, 0.0, 1.0_f64].map(f64::to_bits) {
        value.insert(
            "quaternion_xyzw".into(),
            Value::Array(vec![number(q.i)?, number(q.j)?, number(q.k)?, number(q.w)?]),
        );
    }
    Ok(value)
}

fn edge_value(edge: &Edge) -> Result<Value> {
    let ends = json!([edge.start, edge.end]);
    if edge.curve == Curve::Line && edge.label.is_none() {
        return Ok(ends);
    }
    let mut value = Map::new();
    value.insert("endpoints".into(), ends);
    match edge.curve {
        Curve::Line => {}
        Curve::Quadratic(c) => {
            value.insert("quadratic".into(), point(&c)?);
        }
        Curve::Cubic(c, d) => {
            value.insert("cubic".into(), points(&[c, d])?);
        }
        Curve::Arc {
            radius,
            large,
            right,
        } => {
            value.insert(
                "arc".into(),
                json!({ "radius": number(radius)?, "large": large, "right": right }),
            );
        }
    }
    if let Some(label) = &edge.label {
        value.insert("label".into(), json!(label));
    }
    Ok(Value::Object(value))
}

/// JSON text in which what fits on a line stands on one line.
pub fn text(value: &Value) -> String {
    let mut out = String::new();
    write_value(&mut out, value, 0);
    out.push('\n');
    out
}

fn write_value(out: &mut String, value: &Value, depth: usize) {
    let whole = spaced(value, LINE.saturating_sub(2 * depth));
    if let Some(line) = whole {
        out.push_str(&line);
        return;
    }
    let indent = "  ".repeat(depth + 1);
    let close = "  ".repeat(depth);
    match value {
        Value::Array(items) => {
            out.push_str("[\n");
            for (k, item) in items.iter().enumerate() {
                out.push_str(&indent);
                write_value(out, item, depth + 1);
                out.push_str(if k + 1 < items.len() { ",\n" } else { "\n" });
            }
            let _ = write!(out, "{close}]");
        }
        Value::Object(map) => {
            out.push_str("{\n");
            for (k, (key, item)) in map.iter().enumerate() {
                let _ = write!(out, "{indent}{}: ", Value::from(key.as_str()));
                write_value(out, item, depth + 1);
                out.push_str(if k + 1 < map.len() { ",\n" } else { "\n" });
            }
            let _ = write!(out, "{close}}}");
        }
        scalar => {
            let _ = write!(out, "{scalar}");
        }
    }
}

/// The value on one line, unless that is longer than `room`.
fn spaced(value: &Value, room: usize) -> Option<String> {
    let line = match value {
        Value::Array(items) => {
            let mut line = String::from("[");
            for (k, item) in items.iter().enumerate() {
                if k > 0 {
                    line.push_str(", ");
                }
                line.push_str(&spaced(item, room.checked_sub(line.len())?)?);
            }
            line.push(']');
            line
        }
        Value::Object(map) => {
            let mut line = String::from("{ ");
            for (k, (key, item)) in map.iter().enumerate() {
                if k > 0 {
                    line.push_str(", ");
                }
                let _ = write!(line, "{}: ", Value::from(key.as_str()));
                line.push_str(&spaced(item, room.checked_sub(line.len())?)?);
            }
            line.push_str(if map.is_empty() { "}" } else { " }" });
            line
        }
        scalar => scalar.to_string(),
    };
    (line.len() <= room).then_some(line)
}
