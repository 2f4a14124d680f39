//! The archive: model description, binaries, resources, documentation, licences, icon. The same
//! input gives the same bytes: members are sorted, carry no time, and the token is a hash of them.

use super::collect::{Collected, Overrides};
use super::describe::Description;
use super::handbook;
use super::model::{ABOUT_FILE, About, Model, SCENE_FILE};
use super::names;
use super::platform::{Platform, Version};
use super::table;
use crate::error::{Error, Result};
use crate::math::Vec3;
use crate::math::hash::Hash;
use crate::readout::Part;
use crate::readout::picture::{PictureOptions, render};
use crate::scene::Scene;
use crate::sim::{DrapeOptions, Outcome, Progress, Sim};
use crate::sim_scene;
use serde_json::json;
use std::collections::BTreeMap;
use std::io::{Cursor, Read, Write};
use std::path::{Path, PathBuf};
use zip::write::SimpleFileOptions;
use zip::{CompressionMethod, DateTime, System, ZipArchive, ZipWriter};

/// Licence of toile and of every crate that is linked.
const LICENCES: &str = include_str!("../../docs/licences.txt");
/// File of the resources folder with the draped state.
const STATE_FILE: &str = "initial/draped.bin";
/// What every binary of toile contains.
const MARK: &[u8] = b"fmi3InstantiateCoSimulation";

/// How to pack.
#[derive(Clone, Debug)]
pub struct Options {
    /// Version of FMI.
    pub version: Version,
    /// Name of the model's binary: a C identifier is made of it.
    pub identifier: String,
    /// Libraries by platform.
    pub libraries: Vec<(Platform, Vec<u8>)>,
    /// Archives of the same scene whose binaries are taken in as well.
    pub merge: Vec<(String, Vec<u8>)>,
    /// Drape now if the scene says so, so that the FMU begins at rest.
    pub drape: bool,
    /// Threads for draping and drawing; the bytes do not depend on it.
    pub threads: f64,
}

/// An archive and what people should know of it.
#[derive(Clone, Debug)]
pub struct Packed {
    /// Bytes of the archive.
    pub bytes: Vec<u8>,
    /// Remarks.
    pub notes: Vec<String>,
}

/// A folder that goes when it is let go.
struct Scratch(PathBuf);

impl Scratch {
    fn new() -> Result<Self> {
        let fail = |e: std::io::Error| Error::io(format!("cannot make a temporary folder: {e}"));
        let base = std::env::temp_dir();
        for k in 0..1000 {
            let folder = base.join(format!("toile-fmu-{}-{k}", std::process::id()));
            match std::fs::create_dir(&folder) {
                Ok(()) => return Ok(Self(folder)),
                Err(e) if e.kind() == std::io::ErrorKind::AlreadyExists => {}
                Err(e) => return Err(fail(e)),
            }
        }
        Err(Error::io(format!(
            "cannot make a temporary folder in {}: 1000 of them are there",
            base.display()
        )))
    }

    fn write(&self, files: &BTreeMap<String, Vec<u8>>) -> Result<()> {
        for (name, bytes) in files {
            let path = self.0.join(name);
            let fail =
                |e: std::io::Error| Error::io(format!("cannot write {}: {e}", path.display()));
            if let Some(folder) = path.parent() {
                std::fs::create_dir_all(folder).map_err(fail)?;
            }
            std::fs::write(&path, bytes).map_err(fail)?;
        }
        Ok(())
    }

    /// The scene as an FMU will read it from there.
    fn scene(&self) -> Result<Scene> {
        Scene::from_file(&self.0.join(SCENE_FILE))
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        // a folder that stays behind in the temporary folder is no reason to fail
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

/// Packs a scene or garment file.
pub fn package(
    path: &Path,
    overrides: &Overrides,
    options: &Options,
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Packed> {
    let mut notes = Vec::new();
    let mut collected = Collected::new(path, overrides)?;
    let scratch = Scratch::new()?;
    scratch.write(&collected.all())?;
    let scene = scratch.scene().map_err(|e| e.at(path.display()))?;
    if scene.run.drape && options.drape {
        let state = drape(scene, options, &mut notes, progress)?;
        collected.files.insert(STATE_FILE.into(), state);
        collected.set("initial", json!({"snapshot": STATE_FILE}))?;
    }
    // what is draped is draped now
    let mut run = collected.scene.get("run").cloned().unwrap_or(json!({}));
    if let Some(run) = run.as_object_mut() {
        run.insert("drape".into(), json!(false));
    }
    collected.set("run", run)?;
    let mut resources = collected.all();
    scratch.write(&resources)?;
    let (model, sim) = Model::new(scratch.scene()?)?;
    let icon = icon(&model.scene, &sim, options.threads)?;
    let identifier = names::identifier(&options.identifier);
    let token = token(&resources, &model, &identifier, options.version)?;
    let about = About {
        token: token.clone(),
        variables: table::fingerprint(&model.variables),
    };
    resources.insert(ABOUT_FILE.into(), about.to_json().into_bytes());
    let description = Description {
        identifier: &identifier,
        token: &token,
        scene: &model.scene,
        variables: &model.variables,
    };
    let mut members = members(&description, options.version, icon)?;
    for (name, bytes) in resources {
        members.insert(format!("resources/{name}"), bytes);
    }
    for (platform, bytes) in &options.libraries {
        if !bytes.windows(MARK.len()).any(|w| w == MARK) {
            return Err(Error::argument(format!(
                "the library for {} is not one of toile's with FMI",
                platform.name
            )));
        }
        let member = platform.member(options.version, &identifier)?;
        if members.insert(member.clone(), bytes.clone()).is_some() {
            return Err(Error::argument(format!("{member} is given twice")));
        }
    }
    for (name, bytes) in &options.merge {
        merge(bytes, &mut members).map_err(|e| e.at(name))?;
    }
    if !members.keys().any(|m| m.starts_with("binaries/")) {
        return Err(Error::argument(
            "an FMU needs the library of one platform at least",
        ));
    }
    notes.extend(model.scene.notes.iter().cloned());
    notes.extend(sim.info().notes);
    Ok(Packed {
        bytes: archive(&members)?,
        notes,
    })
}

/// The draped state as bytes. A garment that nothing holds is sewn and relaxed without the forces
/// that carry it away.
fn drape(
    mut scene: Scene,
    options: &Options,
    notes: &mut Vec<String>,
    progress: &mut dyn FnMut(&Progress) -> bool,
) -> Result<Vec<u8>> {
    scene.set_number(crate::scene::THREADS, options.threads)?;
    let (gravity, wind, pressure) = (scene.gravity, scene.wind, scene.pressure);
    let mut sim = sim_scene::build(&scene)?;
    let plan = DrapeOptions {
        force_tolerance: 0.0,
        max_steps: 0,
    };
    let mut report = sim.drape(&plan, progress)?;
    if report.outcome == Outcome::Falling {
        notes.push(format!(
            "{}: the garment is draped without gravity, wind and pressure, and falls when the run \
             begins",
            report.reason
        ));
        (scene.gravity, scene.wind, scene.pressure) = ([0.0; 3], [0.0; 3], 0.0);
        sim = sim_scene::build(&scene)?;
        report = sim.drape(&plan, progress)?;
    }
    if report.outcome != Outcome::Converged {
        notes.push(format!(
            "the drape ended with outcome {}, residual {:.3e} N {}",
            report.outcome.name(),
            report.residual,
            report.reason
        ));
    }
    for (k, axis) in ["x", "y", "z"].iter().enumerate() {
        sim.set_number(&format!("gravity.{axis}"), gravity[k])?;
        sim.set_number(&format!("wind.{axis}"), wind[k])?;
    }
    sim.set_number("pressure", pressure)?;
    sim.save()
}

/// A picture of the garment as the run begins.
fn icon(scene: &Scene, sim: &Sim, threads: f64) -> Result<Vec<u8>> {
    let mut parts = vec![Part::garment(
        "garment",
        sim.positions(),
        sim.triangles(),
        sim.vertex_panels(),
    )];
    for (b, body) in (0_u32..).zip(&scene.bodies) {
        let (positions, triangles) = sim.body_mesh(b)?;
        parts.push(Part::body(&body.name, positions, triangles));
    }
    let up = -Vec3::from(scene.gravity);
    let up = up.try_normalize(1e-9).unwrap_or_else(Vec3::y);
    let front = if up.cross(&Vec3::z()).norm() < 1e-3 {
        -Vec3::y()
    } else {
        Vec3::z()
    };
    let options = PictureOptions {
        width: 256,
        height: 256,
        views: vec![0.5],
        up,
        front,
        threads: threads as usize,
        ..PictureOptions::default()
    };
    render(&parts, &options)?.to_png()
}

/// A hash of everything that decides what an FMU does and how it is described.
fn token(
    resources: &BTreeMap<String, Vec<u8>>,
    model: &Model,
    identifier: &str,
    version: Version,
) -> Result<String> {
    let unnamed = Description {
        identifier,
        token: "",
        scene: &model.scene,
        variables: &model.variables,
    };
    let described = match version {
        Version::Two => unnamed.fmi2()?,
        Version::Three => unnamed.fmi3()?,
    };
    let half = |salt: &[u8]| {
        let mut hash = Hash::default();
        hash.add(salt);
        for (name, bytes) in resources {
            hash.add(name.as_bytes());
            hash.add(&(bytes.len() as u64).to_le_bytes());
            hash.add(bytes);
        }
        hash.add(&described);
        hash.value()
    };
    let (a, b) = (half(b"toile"), half(b"fmu"));
    let text = format!("{a:016x}{b:016x}");
    let parts = [0..8, 8..12, 12..16, 16..20, 20..32].map(|r| &text[r]);
    Ok(format!("{{{}}}", parts.join("-")))
}

/// Everything but binaries and resources.
fn members(
    description: &Description<'_>,
    version: Version,
    icon: Vec<u8>,
) -> Result<BTreeMap<String, Vec<u8>>> {
    let mut members = BTreeMap::new();
    let mut add = |name: &str, bytes: Vec<u8>| members.insert(name.to_owned(), bytes);
    let picture = match version {
        Version::Two => {
            add("modelDescription.xml", description.fmi2()?);
            add("model.png", icon);
            "../model.png"
        }
        Version::Three => {
            add("modelDescription.xml", description.fmi3()?);
            add(
                "terminalsAndIcons/terminalsAndIcons.xml",
                description.terminals()?,
            );
            add("terminalsAndIcons/icon.png", icon);
            "../terminalsAndIcons/icon.png"
        }
    };
    add(
        "documentation/index.html",
        handbook::page(description, picture)?,
    );
    add(
        "documentation/licenses/license.txt",
        LICENCES.as_bytes().to_vec(),
    );
    Ok(members)
}

/// Takes the binaries of another archive in, if it is the same in everything else.
fn merge(bytes: &[u8], members: &mut BTreeMap<String, Vec<u8>>) -> Result<()> {
    let fail = |e: &dyn std::fmt::Display| Error::parse(format!("not an archive to merge: {e}"));
    let mut other = ZipArchive::new(Cursor::new(bytes)).map_err(|e| fail(&e))?;
    let mut taken = 0;
    for i in 0..other.len() {
        let mut member = other.by_index(i).map_err(|e| fail(&e))?;
        if member.size() > crate::scene::files::MAX_FILE {
            return Err(Error::limit(format!(
                "a member of {} bytes, limit {}",
                member.size(),
                crate::scene::files::MAX_FILE
            )));
        }
        let name = member.name().map_err(|e| fail(&e))?.into_owned();
        let mut content = Vec::new();
        member.read_to_end(&mut content).map_err(|e| fail(&e))?;
        let is_binary = name.starts_with("binaries/") && !name.contains("..");
        match members.get(&name) {
            Some(own) if *own == content => {}
            Some(_) if is_binary => {
                return Err(Error::argument(format!(
                    "{name} is there already and differs"
                )));
            }
            None if is_binary => {
                members.insert(name, content);
                taken += 1;
            }
            _ => {
                return Err(Error::argument(format!(
                    "it is an FMU of another scene or version: {name} differs"
                )));
            }
        }
    }
    if taken == 0 {
        return Err(Error::argument("it has no binary that is not here already"));
    }
    Ok(())
}

fn archive(members: &BTreeMap<String, Vec<u8>>) -> Result<Vec<u8>> {
    let fail = |e: &dyn std::fmt::Display| Error::io(format!("writing the archive: {e}"));
    let mut zip = ZipWriter::new(Cursor::new(Vec::new()));
    for (name, bytes) in members {
        let is_binary = name.starts_with("binaries/");
        let options = SimpleFileOptions::default()
            .compression_method(CompressionMethod::Deflated)
            .compression_level(Some(6))
            .last_modified_time(DateTime::default())
            .system(System::Unix)
            .unix_permissions(if is_binary { 0o755 } else { 0o644 });
        zip.start_file(name.as_str(), options)
            .map_err(|e| fail(&e))?;
        zip.write_all(bytes).map_err(|e| fail(&e))?;
    }
    Ok(zip.finish().map_err(|e| fail(&e))?.into_inner())
}
