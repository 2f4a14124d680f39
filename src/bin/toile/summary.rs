//! `summary.json` and the table on the terminal.

use serde_json::{Map, Value, json};
use std::fmt::Write;
use std::path::Path;
use toile::scene::Scene;
use toile::sim::{Outcome, Sim, StepReport};

/// What a run adds up.
#[derive(Default)]
pub(crate) struct Summary {
    name: String,
    threads: f64,
    pub(crate) steps: u64,
    pub(crate) outcome: Option<Outcome>,
    pub(crate) reason: String,
    newton_iterations: u64,
    linear_iterations: u64,
    substeps: u64,
    pub(crate) wall_seconds: f64,
    pub(crate) simulated_seconds: f64,
    pub(crate) body_crossings: usize,
    pub(crate) self_crossings: usize,
    pub(crate) further_second_motion: Option<f64>,
    peak_memory: Option<u64>,
}

/// Gap of a seam that is no longer sewn [m].
const OPEN_SEAM: f64 = 2e-3;
/// Relative stretch that no yarn or cloth survives.
const TORN: f64 = 1.0;

impl Summary {
    pub(crate) fn new(scene: &Scene) -> Self {
        Self {
            name: scene.name.clone(),
            threads: scene.settings.threads,
            ..Self::default()
        }
    }

    /// Adds the counts of a drape or a step.
    pub(crate) fn add(&mut self, report: &StepReport) {
        self.newton_iterations += report.newton_iterations;
        self.linear_iterations += report.linear_iterations;
        self.substeps += report.substeps;
    }

    /// Takes the largest memory so far, before results are written.
    pub(crate) fn measure_memory(&mut self) {
        self.peak_memory = peak_memory();
    }

    /// What a garment that is dressed as it should be does not have.
    fn doubts(&self, last: &StepReport) -> Vec<String> {
        let mut doubts = Vec::new();
        if last.max_seam_gap > OPEN_SEAM {
            doubts.push(format!(
                "a seam is open by {:.1} mm: the garment is not sewn shut, as where it is too tight or \
                 placed for a body that stands elsewhere (--body-offset moves the body)",
                1e3 * last.max_seam_gap
            ));
        }
        if last.max_edge_strain > TORN {
            doubts.push(format!(
                "an edge of triangles or a piece of yarn is {:.1} times as long as at rest: nothing tears here, and what it \
                 pulls with means nothing",
                1.0 + last.max_edge_strain
            ));
        }
        for (count, what) in [
            (self.body_crossings, "a body"),
            (self.self_crossings, "the garment itself"),
        ] {
            if count > 0 {
                doubts.push(format!("{count} edges of the garment pass through {what}"));
            }
        }
        doubts
    }

    /// Every key of `summary.json`; a number that is not finite becomes null.
    pub(crate) fn to_json(&self, sim: &Sim, last: &StepReport) -> Value {
        let info = sim.info();
        let mut map = Map::new();
        let mut put = |key: &str, value: Value| map.insert(key.into(), value);
        put("name", json!(self.name));
        put(
            "outcome",
            json!(self.outcome.unwrap_or(last.outcome).name()),
        );
        if !self.reason.is_empty() {
            put("reason", json!(self.reason));
        }
        put("vertices", json!(info.vertices));
        put("triangles", json!(info.triangles));
        put("yarn_nodes", json!(info.yarn_nodes));
        put("yarns", json!(info.yarns));
        put(
            "full_nodes",
            json!(info.yarn_nodes - info.carried_nodes - info.hybrid_nodes),
        );
        put("hybrid_nodes", json!(info.hybrid_nodes));
        put("carried_nodes", json!(info.carried_nodes));
        put("active_triangles", json!(info.active_triangles));
        put("unknowns", json!(info.unknowns));
        put("min_angle_degrees", json!(info.min_angle.to_degrees()));
        put("steps", json!(self.steps));
        put("substeps", json!(self.substeps));
        put("newton_iterations", json!(self.newton_iterations));
        put("linear_iterations", json!(self.linear_iterations));
        put("residual", json!(last.residual));
        put("max_edge_strain", json!(last.max_edge_strain));
        put("min_gap", json!(last.min_gap));
        put("max_seam_gap", json!(last.max_seam_gap));
        put("body_crossings", json!(self.body_crossings));
        put("self_crossings", json!(self.self_crossings));
        put("kinetic_energy", json!(last.kinetic_energy));
        put("potential_energy", json!(last.potential_energy));
        if let Some(motion) = self.further_second_motion {
            put("further_second_motion", json!(motion));
        }
        put("simulated_seconds", json!(self.simulated_seconds));
        put("wall_seconds", json!(self.wall_seconds));
        put("peak_memory_bytes", json!(self.peak_memory));
        put("system_bytes", json!(info.bytes));
        put("factor_bytes", json!(info.factor_bytes));
        put("threads", json!(self.threads as u64));
        put("backend", json!(info.backend));
        let mut notes = info.notes;
        notes.extend(self.doubts(last));
        put("notes", json!(notes));
        put("version", json!(env!("CARGO_PKG_VERSION")));
        Value::Object(map)
    }
}

/// Largest resident memory so far [bytes], where the system tells it.
fn peak_memory() -> Option<u64> {
    let status = std::fs::read_to_string("/proc/self/status").ok()?;
    let line = status.lines().find_map(|l| l.strip_prefix("VmHWM:"))?;
    let kib: u64 = line.trim().strip_suffix("kB")?.trim().parse().ok()?;
    Some(kib * 1024)
}

/// The summary for people.
pub(crate) fn table(scene: &Scene, json: &Value, dir: &Path) -> String {
    let mut text = String::new();
    let number = |key: &str| json.get(key).and_then(Value::as_f64);
    let _ = writeln!(text, "{}", scene.name);
    let mut row = |name: &str, value: String| {
        let _ = writeln!(text, "  {name:<24} {value}");
    };
    let plain = |key: &str| json.get(key).map(|v| v.to_string().replace('"', ""));
    for (name, key) in [
        ("outcome", "outcome"),
        ("reason", "reason"),
        ("vertices", "vertices"),
        ("triangles", "triangles"),
        ("yarns", "yarns"),
        ("yarn nodes", "yarn_nodes"),
        ("steps", "steps"),
        ("Newton iterations", "newton_iterations"),
        ("edges through a body", "body_crossings"),
        ("edges through cloth", "self_crossings"),
        ("threads", "threads"),
    ] {
        if let Some(value) = plain(key) {
            row(name, value);
        }
    }
    for (name, key, factor, unit) in [
        ("largest edge strain", "max_edge_strain", 100.0, "%"),
        ("smallest gap to a body", "min_gap", 1e3, "mm"),
        ("largest seam gap", "max_seam_gap", 1e3, "mm"),
        ("motion in a further s", "further_second_motion", 1e3, "mm"),
        ("residual force", "residual", 1e6, "uN"),
        ("wall time", "wall_seconds", 1.0, "s"),
        ("peak memory", "peak_memory_bytes", 1.0 / 1048576.0, "MiB"),
    ] {
        if let Some(v) = number(key) {
            row(name, format!("{:.3} {unit}", v * factor));
        }
    }
    let built = json.get("notes").and_then(Value::as_array);
    let built = built.into_iter().flatten().filter_map(Value::as_str);
    for note in built.chain(scene.notes.iter().map(String::as_str)) {
        row("note", note.to_owned());
    }
    let _ = writeln!(text, "  results in {}", dir.display());
    text
}
