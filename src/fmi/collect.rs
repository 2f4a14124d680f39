//! The files of an archive's `resources` folder: the scene with what it names, so that nothing
//! outside of the archive is needed. Files keep their names as far as two of them do not clash.

use super::model::SCENE_FILE;
use crate::error::{Error, Result};
use crate::pattern::import::read::parse;
use crate::scene::{files, schema};
use serde_json::{Map, Value, json};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// What a command line changes in a scene.
#[derive(Clone, Debug, Default)]
pub struct Overrides {
    /// Target edge length of every panel [m].
    pub edge_length: Option<f64>,
    /// Numbers by dotted name.
    pub numbers: Vec<(String, f64)>,
    /// A body to add.
    pub body: Option<AddedBody>,
}

/// A closed mesh that a command line adds to the bodies.
#[derive(Clone, Debug)]
pub struct AddedBody {
    /// OBJ file.
    pub file: PathBuf,
    /// Factor from its coordinates to metres.
    pub scale: f64,
    /// Where its origin stands [m].
    pub position: [f64; 3],
}

/// A scene as it goes into an archive.
#[derive(Clone, Debug)]
pub struct Collected {
    /// The scene's JSON, its file names those of `files`.
    pub scene: Value,
    /// Bytes by name, below the resources folder.
    pub files: BTreeMap<String, Vec<u8>>,
}

impl Collected {
    /// Takes in a scene or garment file and all files that it names.
    pub fn new(path: &Path, overrides: &Overrides) -> Result<Self> {
        let text = files::read_text(path)?;
        let value = parse(&text).map_err(|e| e.at(path.display()))?;
        let mut own = Self {
            scene: value,
            files: BTreeMap::new(),
        };
        if own.scene.get("toile").is_none() {
            // a bare garment: a scene around it
            let garment = std::mem::take(&mut own.scene);
            own.scene = json!({"toile": schema::VERSION, "garment": garment});
        }
        if own.scene.get("name").is_none() {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            own.set("name", json!(stem))?;
        }
        own.gather(path.parent())
            .map_err(|e| e.at(path.display()))?;
        own.change(overrides)?;
        Ok(own)
    }

    fn root(&mut self) -> Result<&mut Map<String, Value>> {
        self.scene
            .as_object_mut()
            .ok_or_else(|| Error::parse("a scene must be an object"))
    }

    /// Sets a key of the scene.
    pub fn set(&mut self, key: &str, value: Value) -> Result<()> {
        self.root()?.insert(key.into(), value);
        Ok(())
    }

    /// All files, the scene among them.
    pub fn all(&self) -> BTreeMap<String, Vec<u8>> {
        let mut files = self.files.clone();
        let text = format!("{:#}\n", self.scene);
        files.insert(SCENE_FILE.into(), text.into_bytes());
        files
    }

    /// Takes bytes in under a free name like `wanted`; the same bytes are kept once.
    fn keep(&mut self, wanted: &str, bytes: Vec<u8>) -> String {
        let (stem, extension) = wanted.rsplit_once('.').unwrap_or((wanted, ""));
        let mut name = wanted.to_owned();
        let mut k = 2;
        while name == SCENE_FILE || self.files.get(&name).is_some_and(|b| *b != bytes) {
            name = format!("{stem}_{k}.{extension}");
            k += 1;
        }
        self.files.insert(name.clone(), bytes);
        name
    }

    /// Takes in the file that a text names and puts its new name in the text's place.
    fn file(&mut self, folder: &str, base: Option<&Path>, node: &mut Value) -> Result<()> {
        let Some(name) = node.as_str() else {
            return Err(Error::parse(format!("{node} is not the name of a file")));
        };
        let path = files::resolve(base, name)?;
        let bytes = files::read(&path)?;
        *node = json!(self.keep(&plain(folder, &path), bytes));
        Ok(())
    }

    fn gather(&mut self, base: Option<&Path>) -> Result<()> {
        let mut scene = std::mem::take(&mut self.scene);
        if let Some(garment) = scene.get_mut("garment") {
            self.garment(garment, base)?;
        }
        if let Some(fabrics) = scene.get_mut("fabrics").and_then(Value::as_object_mut) {
            for (_, fabric) in fabrics.iter_mut() {
                if let Some(file) = fabric.get_mut("file") {
                    self.file("fabrics", base, file)?;
                }
            }
        }
        if let Some(bodies) = scene.get_mut("bodies").and_then(Value::as_array_mut) {
            for body in bodies {
                if let Some(file) = body.get_mut("file") {
                    self.file("bodies", base, file)?;
                }
                let frames = body.get_mut("motion").and_then(|m| m.get_mut("frames"));
                for frame in frames.and_then(Value::as_array_mut).into_iter().flatten() {
                    self.file("bodies", base, frame)?;
                }
            }
        }
        for key in ["file", "snapshot"] {
            if let Some(file) = scene.get_mut("initial").and_then(|i| i.get_mut(key)) {
                self.file("initial", base, file)?;
            }
        }
        self.scene = scene;
        Ok(())
    }

    /// A garment inside the scene, or a file with one; fabrics may be files beside it.
    fn garment(&mut self, garment: &mut Value, base: Option<&Path>) -> Result<()> {
        let Some(name) = garment.get("file").map(|f| f.as_str().map(str::to_owned)) else {
            return self.fabrics(garment, base, "");
        };
        let name = name.ok_or_else(|| Error::parse("garment.file is not the name of a file"))?;
        let path = files::resolve(base, &name)?;
        let mut inner = parse(&files::read_text(&path)?).map_err(|e| e.at(path.display()))?;
        // its fabrics will lie beside it
        self.fabrics(&mut inner, path.parent(), "garment/")
            .map_err(|e| e.at(path.display()))?;
        let text = format!("{inner:#}\n").into_bytes();
        let kept = self.keep(&plain("garment", &path), text);
        *garment = json!({"file": kept});
        Ok(())
    }

    /// Fabrics of a garment that are named by path; `beside` is the folder that the garment's own
    /// file will be in.
    fn fabrics(&mut self, garment: &mut Value, base: Option<&Path>, beside: &str) -> Result<()> {
        let fabrics = garment.get_mut("fabrics").and_then(Value::as_array_mut);
        for fabric in fabrics.into_iter().flatten().filter(|f| f.is_string()) {
            let folder = format!("{beside}fabrics");
            self.file(&folder, base, fabric)?;
            if let Some(inside) = fabric.as_str().and_then(|f| f.strip_prefix(beside)) {
                *fabric = json!(inside);
            }
        }
        Ok(())
    }

    fn change(&mut self, overrides: &Overrides) -> Result<()> {
        if let Some(length) = overrides.edge_length {
            self.set("edge_length", json!(length))?;
        }
        if let Some(added) = &overrides.body {
            let path = &added.file;
            let bytes = files::read(path)?;
            let name = path.file_stem().unwrap_or_default().to_string_lossy();
            let file = self.keep(&plain("bodies", path), bytes);
            let body = json!({
                "name": name, "shape": "mesh", "file": file, "scale": added.scale,
                "pose": {"position": added.position},
            });
            let bodies = self.root()?.entry("bodies").or_insert_with(|| json!([]));
            bodies
                .as_array_mut()
                .ok_or_else(|| Error::parse("bodies must be an array"))?
                .push(body);
        }
        for (name, value) in &overrides.numbers {
            self.number(name, *value)?;
        }
        Ok(())
    }

    /// Sets what `Scene::set_number` sets.
    fn number(&mut self, name: &str, value: f64) -> Result<()> {
        let wrong = |key: &str| Error::parse(format!("{key} has another type than it should"));
        let root = self.root()?;
        let (group, key) = name.split_once('.').unwrap_or(("", name));
        let axis = ["x", "y", "z"].iter().position(|a| *a == key);
        match (group, axis) {
            ("gravity" | "wind", Some(k)) => {
                let default = if group == "gravity" {
                    json!(crate::scene::GRAVITY)
                } else {
                    json!([0.0, 0.0, 0.0])
                };
                let vector = root.entry(group).or_insert(default);
                *vector.get_mut(k).ok_or_else(|| wrong(group))? = json!(value);
            }
            ("run", None) => {
                let run = root.entry("run").or_insert_with(|| json!({}));
                run.as_object_mut()
                    .ok_or_else(|| wrong("run"))?
                    .insert(key.into(), json!(value));
            }
            ("", None) if ["pressure", "edge_length"].contains(&key) => {
                root.insert(key.into(), json!(value));
            }
            _ => {
                let numbers = root.entry("numbers").or_insert_with(|| json!({}));
                numbers
                    .as_object_mut()
                    .ok_or_else(|| wrong("numbers"))?
                    .insert(name.into(), json!(value));
            }
        }
        Ok(())
    }
}

/// A name in a folder of the archive, of characters that every file system takes.
fn plain(folder: &str, path: &Path) -> String {
    let name = path.file_name().unwrap_or_default().to_string_lossy();
    let fine = |c: char| c.is_ascii_alphanumeric() || "._-".contains(c);
    let name: String = name
        .chars()
        .map(|c| if fine(c) { c } else { '_' })
        .collect();
    format!("{folder}/{name}")
}
