//! Every key of toile's own garment and fabric JSON: type, unit, default, meaning.
//!
//! The readers refuse keys that are not in these tables, so the tables cannot miss one.

/// One key of a JSON object.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Key {
    /// Name of the key.
    pub name: &'static str,
    /// JSON type.
    pub kind: &'static str,
    /// Unit, or empty.
    pub unit: &'static str,
    /// Value when absent; "required" if it must be there.
    pub default: &'static str,
    /// What it means.
    pub doc: &'static str,
}

pub(super) const fn key(
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

/// Keys of the garment object.
pub const GARMENT: &[Key] = &[
    key(
        "toile_garment",
        "integer",
        "",
        "required",
        "version of the format, 1",
    ),
    key("name", "text", "", "garment", "name for people"),
    key(
        "edge_length",
        "number",
        "m",
        "0.015",
        "target edge length of the triangulation",
    ),
    key(
        "fabrics",
        "array",
        "",
        "one plain cotton",
        "fabric objects, or paths of fabric files relative to the garment's folder",
    ),
    key("panels", "array", "", "required", "flat pieces of cloth"),
    key(
        "seams",
        "array",
        "",
        "none",
        "which edges are sewn to which",
    ),
    key(
        "blend_regions",
        "array",
        "",
        "none",
        "where every yarn is wanted",
    ),
];

/// Keys of a panel.
pub const PANEL: &[Key] = &[
    key("name", "text", "", "required", "unique name"),
    key(
        "vertices",
        "array of [u, v]",
        "m",
        "required",
        "corners; u along the weft, v along the warp",
    ),
    key(
        "edges",
        "array",
        "",
        "required",
        "closed outline in order, counter-clockwise seen from the outside of the cloth: edge objects, or [start, end] for straight ones",
    ),
    key(
        "holes",
        "array of arrays",
        "",
        "none",
        "closed loops of edges inside the outline; edge numbers go on after the outline's",
    ),
    key(
        "placement",
        "object",
        "",
        "identity",
        "rigid motion of the plane z = 0 into the world",
    ),
    key(
        "fabric",
        "text or integer",
        "",
        "0",
        "name or index of the fabric",
    ),
    key(
        "grain_deg",
        "number",
        "degree",
        "0",
        "warp direction from +v, counter-clockwise",
    ),
    key(
        "grain_rad",
        "number",
        "rad",
        "0",
        "the same in radians, instead of grain_deg",
    ),
    key(
        "edge_length",
        "number",
        "m",
        "the garment's",
        "target edge length of this panel",
    ),
    key("label", "text", "", "none", "free label"),
];

/// Keys of an edge.
pub const EDGE: &[Key] = &[
    key(
        "endpoints",
        "[integer, integer]",
        "",
        "required",
        "corners where the edge starts and ends",
    ),
    key(
        "quadratic",
        "[u, v]",
        "m",
        "none",
        "control point of a quadratic Bezier curve, in panel coordinates",
    ),
    key(
        "cubic",
        "[[u, v], [u, v]]",
        "m",
        "none",
        "control points of a cubic Bezier curve, in panel coordinates",
    ),
    key(
        "arc",
        "object",
        "",
        "none",
        "circular arc; no curve key at all is a straight edge",
    ),
    key("label", "text", "", "none", "free label"),
];

/// Keys of an arc.
pub const ARC: &[Key] = &[
    key(
        "radius",
        "number",
        "m",
        "required",
        "radius, at least half the chord",
    ),
    key(
        "large",
        "boolean",
        "",
        "false",
        "the arc of more than half a turn",
    ),
    key(
        "right",
        "boolean",
        "",
        "false",
        "bulges to the right of the directed edge",
    ),
];

/// Keys of a placement.
pub const PLACEMENT: &[Key] = &[
    key(
        "translation",
        "[x, y, z]",
        "m",
        "[0, 0, 0]",
        "world position of the panel's origin",
    ),
    key(
        "rotation_deg",
        "[x, y, z]",
        "degree",
        "[0, 0, 0]",
        "turns about x, then y, then z of the world: R = Rz Ry Rx",
    ),
    key(
        "quaternion_xyzw",
        "[x, y, z, w]",
        "",
        "[0, 0, 0, 1]",
        "rotation, instead of rotation_deg",
    ),
];

/// Keys of a seam.
pub const SEAM: &[Key] = &[
    key(
        "a",
        "[panel, edge]",
        "",
        "required",
        "first edge: panel by name or index, edge number",
    ),
    key("b", "[panel, edge]", "", "required", "second edge"),
    key(
        "same_direction",
        "boolean",
        "",
        "false",
        "true: start meets start; false: start of a meets end of b",
    ),
    key(
        "rest_angle_deg",
        "number",
        "degree",
        "0",
        "rest angle across the seam; 0 is flat",
    ),
    key(
        "rest_angle_rad",
        "number",
        "rad",
        "0",
        "the same in radians, instead of rest_angle_deg",
    ),
];

/// Keys of a blend region.
pub const BLEND_REGION: &[Key] = &[
    key(
        "panel",
        "text or integer",
        "",
        "required but for a seam",
        "panel by name or index",
    ),
    key(
        "polygon",
        "array of [u, v]",
        "m",
        "none",
        "what is inside of a polygon in flat coordinates; or one of the next three",
    ),
    key(
        "disc",
        "object",
        "",
        "none",
        "what is no farther from a point than a radius",
    ),
    key(
        "edge",
        "integer",
        "",
        "none",
        "what is no farther from an edge of the panel than the width",
    ),
    key(
        "seam",
        "integer",
        "",
        "none",
        "the same on both sides of a seam, by its place in the list",
    ),
    key(
        "width",
        "number",
        "m",
        "required there",
        "how far from the edge",
    ),
    key("rings", "integer", "", "0", "hybrid rings around it"),
];

/// Keys of a disc.
pub const DISC: &[Key] = &[
    key("center", "[u, v]", "m", "required", "in flat coordinates"),
    key("radius", "number", "m", "required", "how far it goes"),
];

/// Keys of a fabric.
pub const FABRIC: &[Key] = &[
    key(
        "name",
        "text",
        "",
        "plain cotton",
        "name by which panels ask for it",
    ),
    key("density", "number", "kg/m^2", "0.2", "mass per area"),
    key(
        "membrane",
        "object",
        "",
        "see there",
        "stiffness in the plane",
    ),
    key(
        "triangles",
        "text",
        "",
        "given",
        "\"given\", or \"fitted\": density, membrane, ridges and bending are those fitted to the yarns when a simulation is made",
    ),
    key(
        "ridges",
        "array of ridges",
        "",
        "none",
        "convex functions of the strain beside the membrane's stiffness",
    ),
    key("bending", "object", "", "see there", "flexural rigidity"),
    key("damping", "object", "", "see there", "Rayleigh damping"),
    key(
        "thickness",
        "number",
        "m",
        "0.001",
        "half of it is kept free around the middle surface",
    ),
    key(
        "friction",
        "number",
        "",
        "0.3",
        "Coulomb friction of cloth on cloth",
    ),
    key(
        "yarns",
        "object",
        "",
        "none",
        "the yarns that it is made of, for panels whose every yarn is simulated",
    ),
];

/// Keys of a fabric's membrane.
pub const MEMBRANE: &[Key] = &[
    key("warp", "number", "N/m", "1000", "stiffness along the warp"),
    key("weft", "number", "N/m", "1000", "stiffness along the weft"),
    key(
        "coupling",
        "number",
        "N/m",
        "0",
        "c12 between warp and weft",
    ),
    key(
        "poisson",
        "number",
        "",
        "0",
        "instead of coupling: coupling = poisson sqrt(warp weft)",
    ),
    key(
        "shear",
        "number",
        "N/m",
        "200",
        "force per length per shear angle",
    ),
];

/// Keys of a ridge of a fabric's membrane.
pub const RIDGE: &[Key] = &[
    key(
        "direction",
        "[weft, warp, shear]",
        "",
        "required",
        "d of the strain s = d . (E11, E22, 2 E12)",
    ),
    key(
        "strain",
        "array of numbers",
        "",
        "required",
        "growing strains s at which the stiffness is given, constant beyond them",
    ),
    key(
        "stiffness",
        "array of numbers",
        "N/m",
        "required",
        "second derivative of the energy by s there, not negative",
    ),
];

/// Keys of a fabric's bending.
pub const BENDING: &[Key] = &[
    key(
        "warp",
        "number",
        "N m",
        "1e-5",
        "rigidity per width against curving the warp",
    ),
    key(
        "weft",
        "number",
        "N m",
        "1e-5",
        "rigidity per width against curving the weft",
    ),
    key(
        "curvature_warp",
        "number",
        "1/m",
        "0",
        "curvature of the warp at rest, positive to the front; hinges only",
    ),
    key("curvature_weft", "number", "1/m", "0", "same of the weft"),
    key(
        "model",
        "text",
        "",
        "hinge",
        "\"hinge\" (rest angles) or \"quadratic\" (constant Hessian, flat rest shape)",
    ),
];

/// Keys of a fabric's damping.
pub const DAMPING: &[Key] = &[
    key("mass", "number", "1/s", "0", "mass-proportional"),
    key("stiffness", "number", "s", "0", "stiffness-proportional"),
];

/// All tables with the path of the object each belongs to.
pub const TABLES: &[(&str, &[Key])] = &[
    ("garment", GARMENT),
    ("garment.panels[]", PANEL),
    ("garment.panels[].edges[]", EDGE),
    ("garment.panels[].edges[].arc", ARC),
    ("garment.panels[].placement", PLACEMENT),
    ("garment.seams[]", SEAM),
    ("garment.blend_regions[]", BLEND_REGION),
    ("garment.blend_regions[].disc", DISC),
    ("garment.fabrics[]", FABRIC),
    ("garment.fabrics[].membrane", MEMBRANE),
    ("garment.fabrics[].ridges[]", RIDGE),
    ("garment.fabrics[].bending", BENDING),
    ("garment.fabrics[].damping", DAMPING),
    ("garment.fabrics[].yarns", super::yarns::YARNS),
    ("garment.fabrics[].yarns.damping", DAMPING),
];
