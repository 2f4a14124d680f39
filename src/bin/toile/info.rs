//! `toile info`, `toile check`, `toile mannequin`, and how all commands read a scene.

use crate::args::SceneArgs;
use crate::output::{Done, Failure, file, out};
use std::fmt::Write;
use std::path::Path;
use std::process::ExitCode;
use toile::body::Body;
use toile::error::{Error, Result};
use toile::scene::motion::BodyMotion;
use toile::scene::{Scene, SceneBody, THREADS, files};
use toile::sim::Settings;
use toile::sim_scene;

/// Puts in what the command line says beside the file.
fn apply(scene: &mut Scene, args: &SceneArgs) -> Result<()> {
    scene.name_after(&args.scene);
    if let Some(path) = &args.body {
        let body = Body::obj(path, args.body_scale, 0.0).map_err(|e| {
            // the reader may or may not name the file
            if e.message.contains(&*path.to_string_lossy()) {
                e
            } else {
                e.at(path.display())
            }
        })?;
        let mut body = SceneBody {
            name: path
                .file_stem()
                .map_or_else(|| "body".into(), |s| s.to_string_lossy().into_owned()),
            body,
            contact: Default::default(),
            motion: BodyMotion::default(),
        };
        body.shift(args.body_offset.unwrap_or_default().into());
        scene.bodies.push(body);
    }
    if let Some(length) = args.edge_length {
        scene.set_edge_length(length)?;
    }
    if let Some(threads) = args.threads {
        scene.set_number(THREADS, f64::from(threads))?;
    }
    for (name, value) in &args.set {
        scene.set_number(name, *value)?;
    }
    if !scene.threads_given {
        scene.settings.threads = every_core();
    }
    Ok(())
}

/// Cores that this program may use, as many as the setting admits.
pub(crate) fn every_core() -> f64 {
    let cores = std::thread::available_parallelism().map_or(1, usize::from);
    let most = Settings::KEYS
        .iter()
        .find(|k| k.name == THREADS)
        .map_or(1.0, |k| k.max);
    (cores as f64).min(most)
}

/// The scene of a command line.
pub(crate) fn load(args: &SceneArgs) -> Result<Scene> {
    let mut scene = Scene::from_file(&args.scene)?;
    apply(&mut scene, args)?;
    Ok(scene)
}

pub(crate) fn info(args: &SceneArgs) -> Done {
    let scene = load(args)?;
    let sim = sim_scene::build(&scene)?;
    let info = sim.info();
    let mib = |bytes: usize| bytes as f64 / f64::from(1 << 20);
    let mut text = String::new();
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "{name:<22} {value}");
    };
    row("scene", scene.name.clone());
    row("panels", scene.garment.panels.len().to_string());
    row("seams", scene.garment.seams.len().to_string());
    for fabric in &scene.garment.fabrics {
        row(
            "fabric",
            format!("{}, {} kg/m^2", fabric.name, fabric.density),
        );
    }
    for body in &scene.bodies {
        let n = body.body.triangles().len();
        let size = if n > 0 {
            format!(", {n} triangles")
        } else {
            String::new()
        };
        row("body", format!("{}{size}", body.name));
    }
    row("vertices", info.vertices.to_string());
    row("triangles", info.triangles.to_string());
    if info.yarn_nodes > 0 {
        row("active triangles", info.active_triangles.to_string());
        row("yarn nodes", info.yarn_nodes.to_string());
        row("carried nodes", info.carried_nodes.to_string());
        if info.hybrid_nodes > 0 {
            let [kept, dropped] = info.hybrid_vertices;
            row("hybrid nodes", info.hybrid_nodes.to_string());
            row("hybrid vertices", format!("{kept} and {dropped} left out"));
            row("amplification", format!("{:.2}", info.amplification));
        }
    }
    row("unknowns", info.unknowns.to_string());
    row(
        "smallest angle",
        format!("{:.1} degrees", info.min_angle.to_degrees()),
    );
    for (term, stencils) in &info.terms {
        row(&format!("term {term}"), format!("{stencils} stencils"));
    }
    row("linear solver", info.backend.clone());
    row("mesh, terms, matrix", format!("{:.2} MiB", mib(info.bytes)));
    let factor = match info.factor_bytes {
        // its size depends on the solver, which is chosen by the matrix
        0 => "made by the first solve".into(),
        bytes => format!("{:.2} MiB", mib(bytes)),
    };
    row("factor, work arrays", factor);
    row(
        "run",
        format!(
            "{}{} steps of {} s",
            if scene.run.drape { "drape, then " } else { "" },
            scene.run.steps(),
            scene.run.dt
        ),
    );
    for note in info.notes.iter().chain(&scene.notes) {
        row("note", note.clone());
    }
    out(&text)
}

pub(crate) fn check(args: &SceneArgs) -> Done {
    let text = files::read_text(&args.scene)?;
    let (scene, mut problems) = Scene::read_all(&text, args.scene.parent());
    let mut notes = Vec::new();
    if let Some(mut scene) = scene {
        notes.append(&mut scene.notes);
        // what only building shows: triangles, seams, pins
        if problems.is_empty() {
            let built = apply(&mut scene, args).and_then(|()| sim_scene::build(&scene));
            match built {
                Ok(sim) => notes.append(&mut sim.info().notes),
                Err(e) => problems.push(e),
            }
        }
    }
    let mut report = String::new();
    for problem in &problems {
        let _ = writeln!(report, "{}: {problem}", args.scene.display());
    }
    for note in notes {
        let _ = writeln!(report, "{}: note: {note}", args.scene.display());
    }
    let summary = match problems.len() {
        0 => "no problems".to_owned(),
        1 => "1 problem".to_owned(),
        n => format!("{n} problems"),
    };
    let _ = writeln!(report, "{}: {summary}", args.scene.display());
    out(&report)?;
    Ok(ExitCode::from(u8::from(!problems.is_empty())))
}

pub(crate) fn mannequin(path: &Path, cell: f64) -> Done {
    if !(cell.is_finite() && cell >= 0.0) {
        return Err(Failure::from(Error::argument(format!(
            "--cell {cell} must be finite and not negative"
        ))));
    }
    let (positions, triangles) = toile::body::mannequin::body(cell)?.display_mesh();
    let text = toile::readout::export::obj::to_obj(&positions, &triangles, &[], &[], &[]);
    file(path, text.as_bytes())?;
    Ok(ExitCode::SUCCESS)
}
