//! Every key of a scene file: type, unit, default, meaning.
//!
//! The reader refuses keys that are not in these tables, so the tables cannot miss one; a test
//! checks that they hold none that the reader does not read. Tables of the garment and of fabrics
//! stand with their readers.

mod print;

use crate::pattern::import::schema::{self as pattern, Key};
pub use print::{json_schema, text};

/// Version of the format that this library reads.
pub const VERSION: u32 = 1;

const fn key(
    name: &'static str,
    kind: &'static str,
    unit: &'static str,
    default: &'static str,
    doc: &'static str,
) -> Key {
    Key {
        name,
        kind,
        unit,
        default,
        doc,
    }
}

/// Keys of the scene itself.
pub const SCENE: &[Key] = &[
    key(
        "toile",
        "integer",
        "",
        "required",
        "version of the format, 1",
    ),
    key("name", "text", "", "the garment's", "name for people"),
    key("about", "text", "", "none", "free text, not read"),
    key(
        "garment",
        "object",
        "",
        "required",
        "a garment object, a GarmentCode specification, or {\"file\": path} of one",
    ),
    key(
        "edge_length",
        "number",
        "m",
        "the garment's",
        "target edge length of every panel",
    ),
    key(
        "fabrics",
        "object",
        "",
        "the garment's",
        "fabric by panel name, \"*\" for all others: a fabric object, an ARCSim material, or {\"file\": path} of one",
    ),
    key("bodies", "array", "", "none", "bodies of the world"),
    key(
        "gravity",
        "[x, y, z]",
        "m/s^2",
        "[0, -9.81, 0]",
        "acceleration of gravity",
    ),
    key(
        "wind",
        "[x, y, z]",
        "m/s",
        "[0, 0, 0]",
        "velocity of the air",
    ),
    key(
        "pressure",
        "number",
        "Pa",
        "0",
        "pressure along the cloth's normal",
    ),
    key("pins", "array", "", "none", "held points and edges"),
    key(
        "probes",
        "array",
        "",
        "none",
        "named points and edges that hosts watch",
    ),
    key(
        "numbers",
        "object",
        "",
        "{}",
        "tunables by dotted name; they are listed at the end",
    ),
    key(
        "initial",
        "object",
        "",
        "the placed panels",
        "state to start from",
    ),
    key("run", "object", "", "drape only", "what to run"),
];

/// Keys of a file reference.
pub const FILE: &[Key] = &[key(
    "file",
    "text",
    "",
    "required",
    "path relative to the scene's folder",
)];

/// Keys of a body.
pub const BODY: &[Key] = &[
    key(
        "name",
        "text",
        "",
        "body and its number",
        "name for people and model files",
    ),
    key(
        "shape",
        "text",
        "",
        "required",
        "\"sphere\", \"capsule\", \"plane\", \"grid\", \"mesh\" or \"mannequin\"",
    ),
    key(
        "file",
        "text",
        "",
        "required",
        "mesh: closed OBJ mesh, path relative to the scene's folder",
    ),
    key(
        "scale",
        "number",
        "",
        "1",
        "mesh: factor from the file's coordinates to metres, also for motion.frames",
    ),
    key(
        "cell_size",
        "number",
        "m",
        "chosen",
        "mesh and mannequin: cell of the distance field, 0 chooses; grid: required",
    ),
    key("radius", "number", "m", "required", "sphere and capsule"),
    key(
        "half_length",
        "number",
        "m",
        "required",
        "capsule: along y from -half_length to half_length",
    ),
    key(
        "normal",
        "[x, y, z]",
        "",
        "[0, 1, 0]",
        "plane: points out of the body",
    ),
    key(
        "offset",
        "number",
        "m",
        "0",
        "plane: the body is where normal . x <= offset",
    ),
    key(
        "counts",
        "[integer, integer, integer]",
        "",
        "required",
        "grid: nodes along x, y, z",
    ),
    key(
        "origin",
        "[x, y, z]",
        "m",
        "[0, 0, 0]",
        "grid: position of the first node",
    ),
    key(
        "values",
        "array of numbers",
        "m",
        "required",
        "grid: signed distances, z fastest",
    ),
    key("pose", "object", "", "identity", "where it stands"),
    key("contact", "object", "", "see there", "how cloth meets it"),
    key("motion", "object", "", "none", "how it moves"),
];

/// Keys of a body that every shape has.
pub const BODY_COMMON: &[&str] = &["name", "shape", "pose", "contact", "motion"];

/// Keys of a pose.
pub const POSE: &[Key] = &[
    key(
        "position",
        "[x, y, z]",
        "m",
        "[0, 0, 0]",
        "world position of the body's origin",
    ),
    key(
        "quaternion_xyzw",
        "[x, y, z, w]",
        "",
        "[0, 0, 0, 1]",
        "rotation from body to world",
    ),
    key(
        "rotation_deg",
        "[x, y, z]",
        "degree",
        "[0, 0, 0]",
        "instead: turns about x, then y, then z of the world, R = Rz Ry Rx",
    ),
];

/// Keys of a body's contact.
pub const CONTACT: &[Key] = &[
    key("friction", "number", "", "0.3", "Coulomb friction"),
    key(
        "thickness",
        "number",
        "m",
        "0.003",
        "gap kept free between the body and the cloth's middle surface",
    ),
    key(
        "stiffness",
        "number",
        "Pa/m",
        "1e7",
        "penalty, pressure per depth",
    ),
];

/// Keys of a body's motion.
pub const MOTION: &[Key] = &[
    key(
        "keyframes",
        "array",
        "",
        "none",
        "poses over time, instead of pose",
    ),
    key(
        "frames",
        "array of text",
        "",
        "none",
        "mesh: OBJ files with the mesh's vertices, one for each frame",
    ),
    key(
        "rate",
        "number",
        "1/s",
        "required with frames",
        "frames per second",
    ),
    key(
        "repeat",
        "boolean",
        "",
        "false",
        "with frames: start over after the last one",
    ),
];

/// Keys of a keyframe of a body.
pub const KEYFRAME: &[Key] = &[
    key("time", "number", "s", "required", "times increase"),
    key("position", "[x, y, z]", "m", "[0, 0, 0]", "as in pose"),
    key(
        "quaternion_xyzw",
        "[x, y, z, w]",
        "",
        "[0, 0, 0, 1]",
        "as in pose",
    ),
    key(
        "rotation_deg",
        "[x, y, z]",
        "degree",
        "[0, 0, 0]",
        "as in pose",
    ),
];

/// Keys of a pin.
pub const PIN: &[Key] = &[
    key(
        "panel",
        "text or integer",
        "",
        "required without yarn",
        "panel by name or index",
    ),
    key(
        "uv",
        "[u, v]",
        "m",
        "this, edge or yarn",
        "flat point; the nearest vertex is held, the nearest node of a panel simulated as yarns",
    ),
    key(
        "edge",
        "integer",
        "",
        "this, uv or yarn",
        "edge number; every vertex on it is held, or every node of yarns",
    ),
    key(
        "yarn",
        "integer",
        "",
        "this, uv or edge",
        "number of a yarn, in the order of toile_sim_yarn_offsets; every node of it is held",
    ),
    key(
        "end",
        "text",
        "",
        "the whole yarn",
        "with yarn: first or last, the end that is held alone",
    ),
    key(
        "target",
        "[x, y, z]",
        "m",
        "where placed",
        "with uv or end: where the point is to be",
    ),
    key("motion", "array", "", "none", "displacements over time"),
    key(
        "until",
        "number",
        "s",
        "never",
        "time at which the pin lets go",
    ),
];

/// Keys of a probe.
pub const PROBE: &[Key] = &[
    key("name", "text", "", "required", "no two alike"),
    key(
        "panel",
        "text or integer",
        "",
        "required",
        "panel by name or index",
    ),
    key(
        "uv",
        "[u, v]",
        "m",
        "this or edge",
        "flat point; the nearest vertex is watched",
    ),
    key(
        "edge",
        "integer",
        "",
        "this or uv",
        "edge number; the curve of its vertices is watched",
    ),
];

/// Keys of a keyframe of a pin.
pub const OFFSET: &[Key] = &[
    key("time", "number", "s", "required", "times increase"),
    key(
        "offset",
        "[x, y, z]",
        "m",
        "required",
        "displacement from the pin's place",
    ),
];

/// Keys of the initial state.
pub const INITIAL: &[Key] = &[
    key(
        "file",
        "text",
        "",
        "none",
        "OBJ file with a position for each vertex, as `toile run` writes it",
    ),
    key(
        "velocity",
        "[x, y, z]",
        "m/s",
        "[0, 0, 0]",
        "velocity of every vertex",
    ),
    key(
        "snapshot",
        "text",
        "",
        "none",
        "saved state of the same scene, instead of the others",
    ),
];

/// Keys of the run.
pub const RUN: &[Key] = &[
    key(
        "drape",
        "boolean",
        "",
        "true",
        "sew and drape to rest first",
    ),
    key("duration", "number", "s", "0", "time simulated afterwards"),
    key("dt", "number", "s", "1/60", "step of that time"),
    key(
        "frame_every",
        "integer",
        "",
        "0",
        "keep a frame every so many steps; 0 keeps none",
    ),
];

/// The scene's own tables with the path of the object each belongs to, "" for the scene.
pub const TABLES: &[(&str, &[Key])] = &[
    ("", SCENE),
    ("fabrics.<panel>", FILE),
    ("bodies[]", BODY),
    ("bodies[].pose", POSE),
    ("bodies[].contact", CONTACT),
    ("bodies[].motion", MOTION),
    ("bodies[].motion.keyframes[]", KEYFRAME),
    ("pins[]", PIN),
    ("pins[].motion[]", OFFSET),
    ("probes[]", PROBE),
    ("initial", INITIAL),
    ("run", RUN),
];

/// Tables of the scene, then those of the garment.
pub fn tables() -> impl Iterator<Item = (&'static str, &'static [Key])> {
    TABLES
        .iter()
        .copied()
        .chain([("garment (a file)", FILE)])
        .chain(pattern::TABLES.iter().copied())
}
