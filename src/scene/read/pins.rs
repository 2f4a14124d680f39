//! Pins and probes of a scene file: places on panels.

use super::offset_keys;
use crate::error::Result;
use crate::math::Vec2;
use crate::pattern::import::read::{Node, Object};
use crate::pattern::{Garment, Panel};
use crate::scene::{PinPlace, ScenePin, SceneProbe, schema};

/// Reads panel and place, looked up where the garment is known.
fn place(object: &Object<'_>, garment: Option<&Garment>) -> Result<(u32, PinPlace)> {
    let panel_node = object.need("panel")?;
    let panel = match (panel_node.value.as_str(), garment) {
        (Some(_), None) => 0,
        (Some(name), Some(garment)) => garment
            .panels
            .iter()
            .position(|p| p.name == name)
            .and_then(|i| u32::try_from(i).ok())
            .ok_or_else(|| panel_node.error(format!("no panel is named {name:?}")))?,
        (None, _) => panel_node.index()?,
    };
    let edges = garment.map(|g| (g.panels.len(), g.panels.get(panel as usize)));
    let edges = match edges {
        None => None,
        Some((_, Some(p))) => Some(p.edge_count()),
        Some((count, None)) => return Err(panel_node.error(format!("panel {panel} of {count}"))),
    };
    let place = match (object.get("uv"), object.get("edge")) {
        (Some(uv), None) => {
            let point = uv.vec2()?;
            if let Some(panel) = garment.and_then(|g| g.panels.get(panel as usize)) {
                near(&uv, &point, panel)?;
            }
            PinPlace::Point(point.into())
        }
        (None, Some(edge)) => {
            let index = edge.index()?;
            if let Some(count) = edges
                && index as usize >= count
            {
                return Err(edge.error(format!("edge {index} of {count}")));
            }
            PinPlace::Edge(index)
        }
        _ => return Err(object.error("give either uv or edge")),
    };
    Ok((panel, place))
}

/// Refuses a place farther beside a panel than the panel is large: given in another unit, or of another panel.
fn near(node: &Node<'_>, point: &Vec2, panel: &Panel) -> Result<()> {
    let mut corners = panel.vertices.iter();
    let Some(first) = corners.next() else {
        return Ok(());
    };
    let (least, most) = corners.fold((*first, *first), |(a, b), p| (a.inf(p), b.sup(p)));
    let outside = (least - point).sup(&(point - most)).sup(&Vec2::zeros());
    if outside.norm() > (most - least).norm() {
        return Err(node.error(format!(
            "({}, {}) lies {:.3} m beside panel '{}', whose corners are from ({}, {}) to ({}, {})",
            point.x,
            point.y,
            outside.norm(),
            panel.name,
            least.x,
            least.y,
            most.x,
            most.y
        )));
    }
    Ok(())
}

/// Reads a probe; `before` are those that came earlier.
pub(super) fn probe(
    node: &Node<'_>,
    garment: Option<&Garment>,
    before: &[SceneProbe],
) -> Result<SceneProbe> {
    let object = node.object()?;
    object.only(schema::PROBE)?;
    let name_node = object.need("name")?;
    let name = name_node.text()?;
    if name.is_empty() || before.iter().any(|p| p.name == name) {
        return Err(name_node.error(format!("{name:?} must not be empty or given twice")));
    }
    let (panel, place) = place(&object, garment)?;
    Ok(SceneProbe {
        name: name.to_owned(),
        panel,
        place,
    })
}

/// Reads a yarn that is held, whole or at an end.
fn yarn(object: &Object<'_>, yarn: &Node<'_>) -> Result<PinPlace> {
    for other in ["panel", "uv", "edge"] {
        if let Some(other) = object.get(other) {
            return Err(other.error("a yarn is named by its number alone"));
        }
    }
    let end = match object.get("end") {
        None => None,
        Some(end) => match end.text()? {
            "first" => Some(0),
            "last" => Some(1),
            _ => return Err(end.error("must be \"first\" or \"last\"")),
        },
    };
    Ok(PinPlace::Yarn {
        yarn: yarn.index()?,
        end,
    })
}

/// Reads a pin; panel and edge are looked up where the garment is known.
pub(super) fn pin(node: &Node<'_>, garment: Option<&Garment>) -> Result<ScenePin> {
    let object = node.object()?;
    object.only(schema::PIN)?;
    let (panel, place) = match object.get("yarn") {
        Some(yarn) => (0, self::yarn(&object, &yarn)?),
        None => match object.get("end") {
            Some(end) => return Err(end.error("goes with yarn alone")),
            None => place(&object, garment)?,
        },
    };
    let several = matches!(place, PinPlace::Edge(_) | PinPlace::Yarn { end: None, .. });
    let target = match object.get("target") {
        None => None,
        Some(target) if several => {
            return Err(target.error("an edge or a yarn has no single target; use motion"));
        }
        Some(target) => Some(target.vec3()?.into()),
    };
    Ok(ScenePin {
        panel,
        place,
        target,
        motion: match object.get("motion") {
            Some(n) => offset_keys(&n)?,
            None => Vec::new(),
        },
        until: match object.get("until") {
            Some(n) => Some(n.number()?),
            None => None,
        },
    })
}
