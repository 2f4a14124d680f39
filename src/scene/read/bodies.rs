//! Bodies of a scene file. Every shape takes its own keys and refuses those of the others.

use super::{file_text, pose, pose_keys};
use crate::body::Body;
use crate::body::mannequin;
use crate::error::Result;
use crate::pattern::import::read::{Node, Object};
use crate::readout::export::obj::read_positions;
use crate::scene::motion::BodyMotion;
use crate::scene::{SceneBody, files, schema};
use crate::system::term::ContactSettings;
use std::path::Path;

/// Shapes and their own keys.
pub(super) const SHAPES: &[(&str, &[&str])] = &[
    ("sphere", &["radius"]),
    ("capsule", &["radius", "half_length"]),
    ("plane", &["normal", "offset"]),
    ("grid", &["counts", "origin", "cell_size", "values"]),
    ("mesh", &["file", "scale", "cell_size"]),
    ("mannequin", &["cell_size"]),
];

pub(super) fn body(node: &Node<'_>, index: usize, base_dir: Option<&Path>) -> Result<SceneBody> {
    let object = node.object()?;
    object.only(schema::BODY)?;
    let shape_node = object.need("shape")?;
    let shape = shape_node.text()?;
    let Some((_, own)) = SHAPES.iter().find(|(name, _)| *name == shape) else {
        let names: Vec<&str> = SHAPES.iter().map(|s| s.0).collect();
        return Err(shape_node.error(format!(
            "{shape:?} is no shape; shapes are {}",
            names.join(", ")
        )));
    };
    for (key, value) in object.entries() {
        if !schema::BODY_COMMON.contains(&key) && !own.contains(&key) {
            return Err(value.error(format!(
                "a {shape} has no such key; its own are {}",
                own.join(", ")
            )));
        }
    }
    let name = match object.get("name") {
        Some(n) => n.text()?.to_owned(),
        None => format!("body {index}"),
    };
    let scale = object.number_or("scale", 1.0)?;
    let body = geometry(&object, shape, scale, base_dir).map_err(|e| {
        // errors of the reader have their place already
        if e.message.starts_with(&node.path) {
            e
        } else {
            e.at(&node.path)
        }
    })?;
    let motion = motion(&object, &body, shape, scale, base_dir)?;
    Ok(SceneBody {
        name,
        body,
        contact: contact(&object)?,
        motion,
    })
}

fn geometry(object: &Object<'_>, shape: &str, scale: f64, base_dir: Option<&Path>) -> Result<Body> {
    let number = |key: &str| object.need(key).and_then(|n| n.number());
    let cell = object.number_or("cell_size", 0.0)?;
    let vector = |key: &str, default: [f64; 3]| match object.get(key) {
        Some(n) => n.vec3().map(Into::into),
        None => Ok(default),
    };
    match shape {
        "sphere" => Body::sphere(number("radius")?),
        "capsule" => Body::capsule(number("half_length")?, number("radius")?),
        "plane" => Body::plane(
            vector("normal", [0.0, 1.0, 0.0])?,
            object.number_or("offset", 0.0)?,
        ),
        "grid" => {
            let mut counts = [0; 3];
            for (slot, n) in counts
                .iter_mut()
                .zip(object.need("counts")?.array_of::<3>()?)
            {
                *slot = n.index()? as usize;
            }
            let values = object
                .need("values")?
                .array()?
                .iter()
                .map(|n| n.number())
                .collect::<Result<Vec<f64>>>()?;
            Body::grid(
                counts,
                vector("origin", [0.0; 3])?,
                number("cell_size")?,
                &values,
            )
        }
        "mesh" => {
            let file = object.need("file")?;
            let path = files::resolve(base_dir, file.text()?).map_err(|e| e.at(&file.path))?;
            // tells a missing or endless file before the mesh reader opens it
            let meta = std::fs::metadata(&path)
                .map_err(|e| file.error(format!("cannot read {}: {e}", path.display())))?;
            if !meta.is_file() || meta.len() > files::MAX_FILE {
                return Err(file.error(format!(
                    "{} is not a regular file of at most {} bytes",
                    path.display(),
                    files::MAX_FILE
                )));
            }
            Body::obj(&path, scale, cell)
        }
        _ => mannequin::body(cell),
    }
}

fn contact(object: &Object<'_>) -> Result<ContactSettings> {
    let default = ContactSettings::default();
    let Some(node) = object.get("contact") else {
        return Ok(default);
    };
    let contact = node.object()?;
    contact.only(schema::CONTACT)?;
    let read = |key: &str, default: f64| -> Result<f64> {
        let Some(n) = contact.get(key) else {
            return Ok(default);
        };
        let v = n.number()?;
        if v < 0.0 {
            return Err(n.error(format!("{v} must not be negative")));
        }
        Ok(v)
    };
    Ok(ContactSettings {
        friction: read("friction", default.friction)?,
        thickness: read("thickness", default.thickness)?,
        stiffness: read("stiffness", default.stiffness)?,
    })
}

fn motion(
    object: &Object<'_>,
    body: &Body,
    shape: &str,
    scale: f64,
    base_dir: Option<&Path>,
) -> Result<BodyMotion> {
    let mut motion = match object.get("pose") {
        None => BodyMotion::default(),
        Some(node) => {
            let pose_object = node.object()?;
            pose_object.only(schema::POSE)?;
            BodyMotion::fixed(pose(&pose_object)?)
        }
    };
    let Some(node) = object.get("motion") else {
        return Ok(motion);
    };
    let moving = node.object()?;
    moving.only(schema::MOTION)?;
    if let Some(keys) = moving.get("keyframes") {
        if object.has("pose") {
            return Err(keys.error("keyframes stand instead of a pose: give one of the two"));
        }
        motion.keys = pose_keys(&keys)?;
    }
    motion.repeat = moving.boolean_or("repeat", false)?;
    if let Some(frames) = moving.get("frames") {
        if shape != "mesh" {
            return Err(frames.error(format!("a {shape} does not deform, only a mesh does")));
        }
        let rate = moving.need("rate")?;
        motion.rate = rate.number()?;
        if motion.rate <= 0.0 {
            return Err(rate.error(format!("{} must be positive", motion.rate)));
        }
        for file in frames.array()? {
            let (path, text) = file_text(&file, base_dir)?;
            let mut x = read_positions(&text)
                .map_err(|e| file.error(format!("{}: {e}", path.display())))?;
            if x.len() != body.vertices().len() {
                return Err(file.error(format!(
                    "{} has {} vertices, the mesh has {}",
                    path.display(),
                    x.len(),
                    body.vertices().len()
                )));
            }
            x.iter_mut().flatten().for_each(|c| *c *= scale);
            motion.frames.push(x);
        }
        if motion.frames.is_empty() {
            return Err(frames.error("must name at least one file"));
        }
    } else if let Some(alone) = moving.get("rate").or_else(|| moving.get("repeat")) {
        return Err(alone.error("goes with frames, which are absent"));
    }
    Ok(motion)
}
