//! The yarns of a fabric from JSON, and the table of their keys.

use super::read::{Node, Object};
use super::schema::{DAMPING, Key, key};
use crate::error::Result;
use crate::pattern::chart::Chart;
use crate::pattern::yarn_fabric::{Knit, Mask, Structure, Weave, YarnFabric};

/// Keys of a fabric's yarns.
pub const YARNS: &[Key] = &[
    key(
        "preset",
        "text",
        "",
        "none",
        "plain, twill or satin shirting, sweater, shirt, pullover, jersey, rib; other keys change it",
    ),
    key(
        "weave",
        "text or array of text",
        "",
        "none",
        "\"plain\", \"twill 2/2\", \"twill 3/1\", \"satin 5\", or lines, first weft first: x warp in front, . weft in front",
    ),
    key(
        "warp_pitch",
        "number",
        "m",
        "required for a weave",
        "from one warp yarn to the next, at least two radii",
    ),
    key(
        "weft_pitch",
        "number",
        "m",
        "warp_pitch",
        "from one weft yarn to the next, at least two radii",
    ),
    key(
        "knit",
        "text",
        "",
        "none",
        "\"stockinette\", \"reverse stockinette\", \"garter\", \"rib 1x1\", \"rib 2x2\"",
    ),
    key(
        "chart",
        "array of text",
        "",
        "none",
        "a knitting chart of symbols as the front looks, bottom row first: . knit, - purl, o yarn-over, / k2tog, \\ ssk, ^ central double decrease, < sk2p, 3 4 5 k3tog to k5tog, a b c the same leaning left, A central of five, p q purl decreases, v kfb, u pfb, w k-yo-k, m m1, + cast-on, x bind-off, _ no stitch",
    ),
    key(
        "instructions",
        "array of text",
        "",
        "none",
        "a knitter's instructions, rows as worked, sides alternating: \"co 13 turn\", \"k 1 * yo 1 k2tog 1 * 6 turn\"",
    ),
    key(
        "once",
        "boolean",
        "",
        "false",
        "the chart is the whole piece, not a repeat",
    ),
    key(
        "loop_width",
        "number",
        "m",
        "required for a knit",
        "from one loop to the next, at least four radii",
    ),
    key(
        "loop_height",
        "number",
        "m",
        "0.85 loop_width",
        "from one course to the next, at least two radii and 0.4 loop_width",
    ),
    key("radius", "number", "m", "required", "radius R of a yarn"),
    key(
        "density",
        "number",
        "kg/m",
        "750 pi R^2",
        "mass per length of yarn",
    ),
    key("young", "number", "Pa", "1e7", "Young's modulus Y"),
    key(
        "bending",
        "number",
        "N",
        "3e-4",
        "bending modulus B; the flexural rigidity is B pi R^2",
    ),
    key(
        "shear",
        "number",
        "Pa",
        "1000",
        "shear modulus of crossings",
    ),
    key("wrapping", "number", "N", "bending", "stitch wrapping k_w"),
    key(
        "stitch",
        "number",
        "N",
        "Y pi R^2",
        "stiffness of the length inside of stitch contacts, k_l",
    ),
    key(
        "spacing",
        "number",
        "N/m^2",
        "Y pi R / (2 pitch)",
        "stiffness of the least distance of crossings, k_c",
    ),
    key(
        "friction",
        "number",
        "",
        "0.3",
        "Coulomb friction of yarn on yarn",
    ),
    key(
        "anchor",
        "number",
        "N/m",
        "1000",
        "stiffness of the friction's anchors, k_f",
    ),
    key(
        "sliding_damping",
        "number",
        "N s/m",
        "0.01",
        "viscous resistance of yarn on yarn",
    ),
    key(
        "damping",
        "object",
        "",
        "see there",
        "Rayleigh damping of the yarns: mass 2, stiffness 0.01",
    ),
    key(
        "compensated",
        "boolean",
        "",
        "false",
        "whether yarns are laid at the distances that they have when the fabric is at rest",
    ),
    key(
        "fastened",
        "boolean",
        "",
        "true",
        "whether the ends of a knitted piece's yarn are woven in, so that it does not unravel; ends at which it has been cut are free",
    ),
];

/// Reads a fabric's yarns; `Fabric::check` judges the numbers.
pub(super) fn read_yarns(node: &Node<'_>) -> Result<YarnFabric> {
    let object = node.object()?;
    object.only(YARNS)?;
    let mut yarns = match object.get("preset") {
        Some(preset) => {
            let mut yarns = YarnFabric::preset(preset.text()?).map_err(|e| e.at(&preset.path))?;
            if let Some(structure) = read_structure(&object, Some(&yarns.structure))? {
                yarns.structure = structure;
            }
            yarns.radius = object.number_or("radius", yarns.radius)?;
            yarns
        }
        None => {
            let structure = read_structure(&object, None)?.ok_or_else(|| {
                object.error(
                    "one of 'preset', 'weave', 'knit', 'chart', 'instructions' must be there",
                )
            })?;
            YarnFabric::new(structure, object.need("radius")?.number()?)
        }
    };
    yarns.young = object.number_or("young", yarns.young)?;
    yarns.bending = object.number_or("bending", yarns.bending)?;
    yarns.derive();
    for (key, number) in [
        ("density", &mut yarns.density),
        ("shear", &mut yarns.shear),
        ("wrapping", &mut yarns.wrapping),
        ("stitch", &mut yarns.stitch),
        ("spacing", &mut yarns.spacing),
        ("friction", &mut yarns.friction),
        ("anchor", &mut yarns.anchor),
        ("sliding_damping", &mut yarns.sliding_damping),
    ] {
        *number = object.number_or(key, *number)?;
    }
    if let Some(node) = object.get("damping") {
        let damping = node.object()?;
        damping.only(DAMPING)?;
        yarns.damping_mass = damping.number_or("mass", yarns.damping_mass)?;
        yarns.damping_stiffness = damping.number_or("stiffness", yarns.damping_stiffness)?;
    }
    yarns.compensated = object.boolean_or("compensated", yarns.compensated)?;
    yarns.fastened = object.boolean_or("fastened", yarns.fastened)?;
    Ok(yarns)
}

const WOVEN: [&str; 3] = ["weave", "warp_pitch", "weft_pitch"];
const CHARTS: [&str; 3] = ["knit", "chart", "instructions"];
const KNITTED: [&str; 3] = ["once", "loop_width", "loop_height"];

/// The structure that the object asks for; what it leaves out is the preset's. `None` if it says
/// nothing about it.
fn read_structure(object: &Object<'_>, preset: Option<&Structure>) -> Result<Option<Structure>> {
    let given = |keys: &[&'static str]| keys.iter().copied().find(|key| object.get(key).is_some());
    let woven = given(&WOVEN);
    let knitted = given(&CHARTS).or(given(&KNITTED));
    match (woven, knitted) {
        (Some(a), Some(b)) => {
            Err(object.error(format!("has both '{a}' of a weave and '{b}' of a knit")))
        }
        (Some(_), None) => read_weave(object, preset).map(Some),
        (None, Some(_)) => read_knit(object, preset).map(Some),
        (None, None) => Ok(None),
    }
}

fn read_weave(object: &Object<'_>, preset: Option<&Structure>) -> Result<Structure> {
    let old = match preset {
        Some(Structure::Woven(weave)) => Some(weave),
        _ => None,
    };
    let mask = match (object.get("weave"), old) {
        (Some(node), _) => read_mask(&node)?,
        (None, Some(weave)) => weave.mask.clone(),
        (None, None) => return Err(object.error("key 'weave' is missing")),
    };
    let warp_pitch = match (object.get("warp_pitch"), old) {
        (Some(node), _) => node.number()?,
        (None, Some(weave)) => weave.warp_pitch,
        (None, None) => return Err(object.error("key 'warp_pitch' is missing")),
    };
    Ok(Structure::Woven(Weave {
        mask,
        warp_pitch,
        weft_pitch: object.number_or("weft_pitch", warp_pitch)?,
    }))
}

fn read_mask(node: &Node<'_>) -> Result<Mask> {
    if node.value.is_array() {
        let lines = lines(node)?;
        return Mask::from_lines(&lines).map_err(|e| e.at(&node.path));
    }
    Mask::preset(node.text()?).ok_or_else(|| {
        node.error(format!(
            "no weave is named so; known are {}",
            crate::pattern::yarn_fabric::WEAVES.join(", ")
        ))
    })
}

fn read_knit(object: &Object<'_>, preset: Option<&Structure>) -> Result<Structure> {
    let old = match preset {
        Some(Structure::Knitted(knit)) => Some(knit),
        _ => None,
    };
    let mut charts = CHARTS
        .iter()
        .filter_map(|key| object.get(key).map(|node| (*key, node)));
    let chart = match (charts.next(), charts.next()) {
        (Some((a, _)), Some((b, _))) => {
            return Err(object.error(format!("has both '{a}' and '{b}'; give one")));
        }
        (Some((key, node)), None) => read_chart(key, &node)?,
        (None, _) => match old {
            Some(knit) => knit.chart.clone(),
            None => {
                return Err(object.error("one of 'knit', 'chart', 'instructions' is missing"));
            }
        },
    };
    let loop_width = match (object.get("loop_width"), old) {
        (Some(node), _) => node.number()?,
        (None, Some(knit)) => knit.loop_width,
        (None, None) => return Err(object.error("key 'loop_width' is missing")),
    };
    Ok(Structure::Knitted(Knit {
        chart,
        once: object.boolean_or("once", old.is_some_and(|knit| knit.once))?,
        loop_width,
        loop_height: object.number_or("loop_height", 0.85 * loop_width)?,
    }))
}

fn read_chart(key: &str, node: &Node<'_>) -> Result<Chart> {
    let chart = match key {
        "knit" => Chart::preset(node.text()?),
        "chart" => Chart::from_grid(&lines(node)?.join("\n")),
        _ => Chart::from_worked(&lines(node)?.join("\n")),
    };
    chart.map_err(|e| e.at(&node.path))
}

fn lines<'a>(node: &Node<'a>) -> Result<Vec<&'a str>> {
    node.array()?.iter().map(Node::text).collect::<Result<_>>()
}
