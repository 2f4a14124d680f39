//! JSON to [`Scene`]. Any bytes give a scene or errors that name the JSON path, the rule and the
//! value; sections are read independently, so that `toile check` can list every problem at once.

mod bodies;
mod pins;

use super::motion::{OffsetKey, PoseKey};
use super::{Initial, RunPlan, Scene, files, schema};
use crate::body::Pose;
use crate::error::{Error, Result};
use crate::math::Rotation;
use crate::pattern::Garment;
use crate::pattern::import::read::{Node, Object, keep, parse};
use crate::pattern::import::{fabric_from_json, garment_from_node};
use std::path::Path;

impl Scene {
    /// Reads a scene; files that it names are looked up in `base_dir`. The first problem is the
    /// error. A bare garment (toile's own or a GarmentCode specification) is a scene without bodies.
    pub fn from_json(text: &str, base_dir: Option<&Path>) -> Result<Self> {
        let (scene, problems) = Self::read_all(text, base_dir);
        match (problems.into_iter().next(), scene) {
            (Some(problem), _) => Err(problem),
            (None, Some(scene)) => Ok(scene),
            (None, None) => Err(Error::parse("no scene could be read")),
        }
    }

    /// Reads as much as possible; the scene is `None` if there is no garment. Without problems there
    /// is a scene.
    pub fn read_all(text: &str, base_dir: Option<&Path>) -> (Option<Self>, Vec<Error>) {
        let mut reader = Reader {
            base_dir,
            problems: Vec::new(),
        };
        let scene = parse(text).and_then(|value| {
            let root = Node::new(&value, "");
            let object = root.object()?;
            if object.has("toile") {
                Ok(reader.scene(&object))
            } else if object.has("toile_garment") || object.has("pattern") {
                let read = garment_from_node(&root, base_dir, &mut reader.problems);
                Ok(read.map(|(garment, notes)| {
                    reader.checked(&garment, "");
                    Scene {
                        notes,
                        ..Scene::new(garment)
                    }
                }))
            } else {
                Err(object.error(
                    "neither a scene (key 'toile'), a toile garment (key 'toile_garment') nor a \
                     GarmentCode specification (key 'pattern')",
                ))
            }
        });
        match scene {
            Ok(scene) => (scene, reader.problems),
            Err(e) => {
                reader.problems.push(e);
                (None, reader.problems)
            }
        }
    }

    /// Reads a scene or garment file; files that it names are looked up beside it.
    pub fn from_file(path: &Path) -> Result<Self> {
        let text = files::read_text(path)?;
        let mut scene = Self::from_json(&text, path.parent()).map_err(|e| e.at(path.display()))?;
        scene.name_after(path);
        Ok(scene)
    }

    /// Takes the file's name where the file gave none.
    pub fn name_after(&mut self, path: &Path) {
        let stem = || {
            path.file_stem()
                .map(|s| s.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        if self.garment.name.is_empty() {
            self.garment.name = stem();
        }
        if self.name.is_empty() {
            self.name = stem();
        }
    }
}

struct Reader<'a> {
    base_dir: Option<&'a Path>,
    problems: Vec<Error>,
}

impl Reader<'_> {
    /// The value, or the problem put aside.
    fn keep<T>(&mut self, result: Result<T>) -> Option<T> {
        keep(&mut self.problems, result)
    }

    fn scene(&mut self, object: &Object<'_>) -> Option<Scene> {
        self.keep(object.only(schema::SCENE));
        self.keep(object.need("toile").and_then(|n| version(&n)));
        let mut notes = Vec::new();
        let garment = self
            .keep(object.need("garment"))
            .and_then(|node| self.garment(&node));
        let garment = garment.map(|(garment, more)| {
            notes.extend(more);
            garment
        });
        // what does not need the garment is read without it, to tell all problems
        let mut scene = Scene::new(garment.clone().unwrap_or_default());
        if let Some(node) = object.get("name") {
            let name = self.keep(node.text());
            scene.name = name.unwrap_or_default().to_owned();
        }
        for (name, slot) in [("gravity", &mut scene.gravity), ("wind", &mut scene.wind)] {
            if let Some(v) = object.get(name).and_then(|n| self.keep(n.vec3())) {
                *slot = v.into();
            }
        }
        if let Some(v) = self.keep(object.number_or("pressure", 0.0)) {
            scene.pressure = v;
        }
        if let Some(node) = object.get("edge_length") {
            let set = node.number().and_then(|v| {
                scene
                    .set_edge_length(v)
                    .map_err(|_| node.error(format!("{v} must be positive")))
            });
            self.keep(set);
        }
        if let Some(numbers) = object.get("numbers").and_then(|n| self.keep(n.object())) {
            for (name, node) in numbers.entries() {
                let set = node
                    .number()
                    .and_then(|v| scene.settings.set(name, v).map_err(|e| node.error(e)));
                self.keep(set);
                scene.threads_given |= name == super::THREADS;
            }
        }
        if let Some(node) = object.get("fabrics") {
            self.fabrics(&node, &mut scene.garment, garment.is_some(), &mut notes);
        }
        if let Some(nodes) = object.get("bodies").and_then(|n| self.keep(n.array())) {
            for (index, node) in nodes.iter().enumerate() {
                let body = bodies::body(node, index, self.base_dir);
                scene.bodies.extend(self.keep(body));
            }
        }
        if let Some(nodes) = object.get("pins").and_then(|n| self.keep(n.array())) {
            for node in &nodes {
                let pin = pins::pin(node, garment.as_ref());
                scene.pins.extend(self.keep(pin));
            }
        }
        if let Some(nodes) = object.get("probes").and_then(|n| self.keep(n.array())) {
            for node in &nodes {
                let probe = pins::probe(node, garment.as_ref(), &scene.probes);
                scene.probes.extend(self.keep(probe));
            }
        }
        if let Some(node) = object.get("initial") {
            let initial = initial(&node, self.base_dir);
            scene.initial = self.keep(initial).unwrap_or_default();
        }
        if let Some(node) = object.get("run") {
            scene.run = self.keep(run(&node)).unwrap_or_default();
        }
        scene.notes = notes;
        garment.is_some().then_some(scene)
    }

    fn garment(&mut self, node: &Node<'_>) -> Option<(Garment, Vec<String>)> {
        let object = self.keep(node.object())?;
        let (garment, notes) = match object.get("file") {
            None => garment_from_node(node, self.base_dir, &mut self.problems)?,
            Some(file) => {
                let read = object
                    .only(schema::FILE)
                    .and_then(|()| file_text(&file, self.base_dir))
                    .and_then(|(path, text)| Ok((parse(&text)?, path)));
                let (value, path) = self.keep(read)?;
                let mut found = Vec::new();
                let read = garment_from_node(&Node::new(&value, ""), path.parent(), &mut found);
                let placed = |e: Error| file.error(format!("{}: {e}", path.display()));
                self.problems.extend(found.into_iter().map(placed));
                read?
            }
        };
        self.checked(&garment, &node.path);
        Some((garment, notes))
    }

    /// Puts all problems of a garment aside, or that it would have too many vertices.
    fn checked(&mut self, garment: &Garment, place: &str) {
        let mut found = garment.problems();
        if found.is_empty() {
            found.extend(garment.check().err());
        }
        let placed = |e: Error| if place.is_empty() { e } else { e.at(place) };
        self.problems.extend(found.into_iter().map(placed));
    }

    /// Fabrics by panel name; "*" is put on first, whatever its place.
    fn fabrics(
        &mut self,
        node: &Node<'_>,
        garment: &mut Garment,
        known: bool,
        notes: &mut Vec<String>,
    ) {
        let Some(object) = self.keep(node.object()) else {
            return;
        };
        let mut entries: Vec<_> = object.entries().collect();
        entries.sort_by_key(|(name, _)| *name != "*");
        for (name, node) in entries {
            let Some((mut fabric, more)) = self.keep(fabric(&node, self.base_dir)) else {
                continue;
            };
            notes.extend(more.into_iter().map(|n| format!("{}: {n}", node.path)));
            // names are keys of the garment's own file: two fabrics must not share one
            let taken = |f: &str, g: &Garment| g.fabrics.iter().any(|other| other.name == f);
            let base = fabric.name.clone();
            let mut k = 2;
            while taken(&fabric.name, garment) {
                fabric.name = format!("{base} ({k})");
                k += 1;
            }
            let index = garment.fabrics.len();
            let mut used = false;
            for panel in &mut garment.panels {
                if name == "*" || panel.name == name {
                    panel.fabric = index;
                    used = true;
                }
            }
            garment.fabrics.push(fabric);
            if known && !used {
                let shown: Vec<&str> = garment.panels.iter().map(|p| p.name.as_str()).collect();
                self.problems.push(node.error(format!(
                    "the garment has no such panel; it has {}",
                    shown.join(", ")
                )));
            }
        }
    }
}

fn version(node: &Node<'_>) -> Result<()> {
    let version = node.index()?;
    if version != schema::VERSION {
        return Err(node.error(format!(
            "format version {version}; this library reads version {}",
            schema::VERSION
        )));
    }
    Ok(())
}

/// Path and text of a file that a node names.
fn file_text(node: &Node<'_>, base_dir: Option<&Path>) -> Result<(std::path::PathBuf, String)> {
    let path = files::resolve(base_dir, node.text()?).map_err(|e| e.at(&node.path))?;
    let text = files::read_text(&path).map_err(|e| e.at(&node.path))?;
    Ok((path, text))
}

fn fabric(
    node: &Node<'_>,
    base_dir: Option<&Path>,
) -> Result<(crate::pattern::Fabric, Vec<String>)> {
    let object = node.object()?;
    let Some(file) = object.get("file") else {
        return fabric_from_json(&node.value.to_string()).map_err(|e| e.at(&node.path));
    };
    object.only(schema::FILE)?;
    let (path, text) = file_text(&file, base_dir)?;
    let (mut fabric, notes) =
        fabric_from_json(&text).map_err(|e| file.error(format!("{}: {e}", path.display())))?;
    if let Some(stem) = path.file_stem() {
        fabric.name = stem.to_string_lossy().into_owned();
    }
    Ok((fabric, notes))
}

/// A pose from the keys `position`, `quaternion_xyzw` or `rotation_deg`.
fn pose(object: &Object<'_>) -> Result<Pose> {
    let mut pose = Pose::default();
    if let Some(node) = object.get("position") {
        pose.position = node.vec3()?;
    }
    if let Some(node) = object.get("quaternion_xyzw") {
        let mut q = [0.0; 4];
        for (slot, item) in q.iter_mut().zip(node.array_of::<4>()?) {
            *slot = item.number()?;
        }
        let [x, y, z, w] = q;
        let q = nalgebra::Quaternion::new(w, x, y, z);
        if !(q.norm() > 1e-9 && q.norm() < 1e9) {
            return Err(node.error(format!("[{x}, {y}, {z}, {w}] is no rotation")));
        }
        pose.rotation = Rotation::from_quaternion(q);
        if object.has("rotation_deg") {
            return Err(object.error("give quaternion_xyzw or rotation_deg, not both"));
        }
    } else if let Some(node) = object.get("rotation_deg") {
        let r = node.vec3()?.map(f64::to_radians);
        pose.rotation = Rotation::from_euler_angles(r.x, r.y, r.z);
    }
    Ok(pose)
}

/// Refuses a time that does not come after the one before.
fn increasing(node: &Node<'_>, last: Option<f64>, time: f64) -> Result<()> {
    match last {
        Some(last) if time <= last => {
            Err(node.error(format!("time {time} must come after {last}")))
        }
        _ => Ok(()),
    }
}

fn pose_keys(node: &Node<'_>) -> Result<Vec<PoseKey>> {
    let mut keys: Vec<PoseKey> = Vec::new();
    for item in node.array()? {
        let object = item.object()?;
        object.only(schema::KEYFRAME)?;
        let time = object.need("time")?.number()?;
        increasing(&item, keys.last().map(|k| k.time), time)?;
        keys.push(PoseKey {
            time,
            pose: pose(&object)?,
        });
    }
    if keys.is_empty() {
        return Err(node.error("must have at least one keyframe"));
    }
    Ok(keys)
}

fn offset_keys(node: &Node<'_>) -> Result<Vec<OffsetKey>> {
    let mut keys: Vec<OffsetKey> = Vec::new();
    for item in node.array()? {
        let object = item.object()?;
        object.only(schema::OFFSET)?;
        let time = object.need("time")?.number()?;
        increasing(&item, keys.last().map(|k| k.time), time)?;
        keys.push(OffsetKey {
            time,
            offset: object.need("offset")?.vec3()?,
        });
    }
    Ok(keys)
}

fn initial(node: &Node<'_>, base_dir: Option<&Path>) -> Result<Initial> {
    let object = node.object()?;
    object.only(schema::INITIAL)?;
    let mut initial = Initial::default();
    if let Some(file) = object.get("file") {
        let (path, text) = file_text(&file, base_dir)?;
        let positions = crate::readout::export::obj::read_positions(&text)
            .map_err(|e| file.error(format!("{}: {e}", path.display())))?;
        initial.positions = Some(positions);
    }
    if let Some(v) = object.get("velocity") {
        initial.velocity = v.vec3()?.into();
    }
    if let Some(file) = object.get("snapshot") {
        if object.has("file") || object.has("velocity") {
            return Err(file.error("a snapshot holds positions and velocities: give it alone"));
        }
        let path = files::resolve(base_dir, file.text()?).map_err(|e| e.at(&file.path))?;
        initial.snapshot = Some(files::read(&path).map_err(|e| e.at(&file.path))?);
    }
    Ok(initial)
}

fn run(node: &Node<'_>) -> Result<RunPlan> {
    let object = node.object()?;
    object.only(schema::RUN)?;
    let default = RunPlan::default();
    let plan = RunPlan {
        drape: object.boolean_or("drape", default.drape)?,
        duration: object.number_or("duration", default.duration)?,
        dt: object.number_or("dt", default.dt)?,
        frame_every: match object.get("frame_every") {
            Some(n) => n.index()?,
            None => default.frame_every,
        },
    };
    plan.check()?;
    Ok(plan)
}
