//! A scene as an FMU: its variables, and simulations of it for given parameters.

use super::table::{self, Sizes};
use super::variables::{Quantity, Variable};
use crate::error::{Error, Result};
use crate::scene::{Initial, PinPlace, Scene, THREADS, files};
use crate::sim::Sim;
use crate::sim_scene::{self, along, pinned_points};
use crate::solve::settings::Settings;
use std::path::Path;

/// File of the resources folder that holds the scene.
pub const SCENE_FILE: &str = "scene.json";
/// File of the resources folder that ties it to the model description.
pub const ABOUT_FILE: &str = "fmu.json";
/// Version of the resources folder that this library reads.
pub const VERSION: u64 = 1;

/// A vertex of a pin, and where it is held without motion [m].
type Held = (u32, [f64; 3]);

/// A scene and what an FMU of it consists of.
pub struct Model {
    /// The scene, as the archive has it.
    pub scene: Scene,
    /// Variables; the place is the value reference.
    pub variables: Vec<Variable>,
    /// Vertices of each pin.
    pub pins: Vec<Vec<Held>>,
    /// Vertices of each probe.
    pub probes: Vec<Vec<u32>>,
    /// Positions from which a garment of other fabrics begins, where the scene has a saved state [m].
    start: Option<Vec<[f64; 3]>>,
}

/// What the model description says of the resources.
#[derive(Clone, Debug, PartialEq)]
pub struct About {
    /// Instantiation token.
    pub token: String,
    /// Fingerprint of the list of variables.
    pub variables: u64,
}

impl About {
    /// As JSON.
    pub fn to_json(&self) -> String {
        format!(
            "{{\"toile_fmu\": {VERSION}, \"token\": \"{}\", \"variables\": \"{:016x}\"}}\n",
            self.token, self.variables
        )
    }

    /// Reads the resources folder's file.
    pub fn read(folder: &Path) -> Result<Self> {
        let path = folder.join(ABOUT_FILE);
        let bad = |what: &str| Error::parse(format!("{}: {what}", path.display()));
        let text = files::read_text(&path)?;
        let value: serde_json::Value =
            serde_json::from_str(&text).map_err(|e| bad(&e.to_string()))?;
        let version = value["toile_fmu"].as_u64();
        if version != Some(VERSION) {
            return Err(bad(&format!(
                "toile_fmu = {}, this library reads {VERSION}",
                value["toile_fmu"]
            )));
        }
        let text = |key: &str| {
            value[key]
                .as_str()
                .ok_or_else(|| bad(&format!("{key} must be text")))
        };
        Ok(Self {
            token: text("token")?.to_owned(),
            variables: u64::from_str_radix(text("variables")?, 16)
                .map_err(|e| bad(&format!("variables: {e}")))?,
        })
    }
}

impl Model {
    /// The model of an unpacked resources folder with its simulation, if `token` is the archive's.
    pub fn load(folder: &Path, token: &str) -> Result<(Self, Sim)> {
        let about = About::read(folder)?;
        if about.token != token {
            return Err(Error::argument(format!(
                "instantiation token '{token}' is not that of {}: '{}'",
                folder.display(),
                about.token
            )));
        }
        let scene = Scene::from_file(&folder.join(SCENE_FILE))?;
        let (model, sim) = Self::new(scene)?;
        let own = table::fingerprint(&model.variables);
        if own != about.variables {
            return Err(Error::state(format!(
                "{}: the variables of this library ({own:016x}) are not those of the model \
                 description ({:016x}): the archive was made by another version",
                folder.join(ABOUT_FILE).display(),
                about.variables
            )));
        }
        Ok((model, sim))
    }

    /// The model of a scene with its simulation, nothing run.
    pub fn new(mut scene: Scene) -> Result<(Self, Sim)> {
        if !scene.threads_given {
            // a master decides how many threads there are, not every FMU for itself
            scene.set_number(THREADS, 1.0)?;
        }
        let sim = sim_scene::build(&scene)?;
        let probes = scene
            .probes
            .iter()
            .map(|probe| {
                match probe.place {
                    PinPlace::Point(uv) => sim.locate(probe.panel, uv).map(|v| vec![v]),
                    PinPlace::Edge(edge) => along(&sim, probe.panel, edge).map(<[u32]>::to_vec),
                    PinPlace::Yarn { .. } => {
                        Err(Error::unsupported("a yarn is pinned, not watched"))
                    }
                }
                .map_err(|e| e.at(format!("probe '{}'", probe.name)))
            })
            .collect::<Result<Vec<_>>>()?;
        let sizes = Sizes {
            vertices: sim.positions().len(),
            triangles: sim.triangles().len(),
            nodes: sim.yarn_nodes().len(),
            probes: probes.iter().map(Vec::len).collect(),
        };
        let restored = scene.initial.snapshot.is_some();
        // a restored pin may have moved: its place is where the panel is placed
        let home = |p: u32| {
            if restored {
                sim.placed(p)
            } else {
                sim.points()[p as usize]
            }
            .into()
        };
        let pins = scene
            .pins
            .iter()
            .zip(pinned_points(&sim, &scene)?)
            .map(|(pin, vertices)| {
                let place = |v| pin.target.unwrap_or_else(|| home(v));
                vertices.into_iter().map(|v| (v, place(v))).collect()
            })
            .collect();
        let start = restored.then(|| sim.positions().iter().map(|p| (*p).into()).collect());
        let model = Self {
            variables: table::variables(&scene, &sizes),
            pins,
            probes,
            start,
            scene,
        };
        Ok((model, sim))
    }

    /// The variable of a value reference.
    pub fn variable(&self, reference: u32) -> Result<&Variable> {
        self.variables.get(reference as usize).ok_or_else(|| {
            Error::argument(format!(
                "value reference {reference} does not exist; there are {}",
                self.variables.len()
            ))
        })
    }

    /// Whether two lists of scalars ask for different simulations.
    pub fn differ(&self, a: &[f64], b: &[f64]) -> bool {
        self.variables
            .iter()
            .zip(a.iter().zip(b))
            .any(|(v, (a, b))| is_compiled(v) && a.to_bits() != b.to_bits())
    }

    /// The simulation for the values of the parameters, nothing run. With other fabrics, contact or
    /// tunables a garment whose scene has a saved state begins at that state's positions, at rest.
    pub fn compile(&self, values: &[f64]) -> Result<Sim> {
        let mut scene = self.scene.clone();
        let mut other = false;
        for (variable, &value) in self.variables.iter().zip(values) {
            if !is_compiled(variable) {
                continue;
            }
            let matters = match variable.quantity {
                Quantity::Setting(s) => Settings::KEYS[s].matters(),
                _ => true,
            };
            other |= matters && value.to_bits() != variable.start.to_bits();
            match variable.quantity {
                Quantity::Fabric(f, number) => {
                    *number.slot(&mut scene.garment.fabrics[f]) = value;
                }
                Quantity::Contact(b, number) => {
                    let contact = &mut scene.bodies[b].contact;
                    match number {
                        0 => contact.friction = value,
                        1 => contact.thickness = value,
                        _ => contact.stiffness = value,
                    }
                }
                Quantity::Setting(s) => scene.settings.set(Settings::KEYS[s].name, value)?,
                _ => {}
            }
        }
        for fabric in &scene.garment.fabrics {
            fabric.check()?;
        }
        if other && let Some(start) = &self.start {
            scene.initial = Initial {
                positions: Some(start.clone()),
                ..Initial::default()
            };
        }
        sim_scene::build(&scene)
    }
}

/// Whether a variable is built into the simulation.
fn is_compiled(v: &Variable) -> bool {
    match v.quantity {
        Quantity::Fabric(..) | Quantity::Contact(..) => true,
        Quantity::Setting(_) => v.variability == super::variables::Variability::Fixed,
        _ => false,
    }
}
