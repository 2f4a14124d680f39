//! Structs of the header. Fields are only ever appended; there is no hidden padding.

pub use super::log::{TOILE_LOG_ERROR, TOILE_LOG_INFO, TOILE_LOG_WARNING, toile_log_fn};

use super::desc::{self, Versioned};
use super::guard::entry;
use super::status::toile_status;
use crate::pattern::import::DEFAULT_EDGE_LENGTH;
use std::ffi::{c_char, c_void};
use std::ptr;

/// A garment: flat panels, seams, fabrics. Editable; no simulation inside.
#[derive(Debug)]
pub struct toile_garment {
    _private: [u8; 0],
}

/// A body that cloth meets: a signed distance field, negative inside. Never changes.
#[derive(Debug)]
pub struct toile_body {
    _private: [u8; 0],
}

/// A simulation: a garment in a world.
#[derive(Debug)]
pub struct toile_sim {
    _private: [u8; 0],
}

/// An array that stays as it was.
#[derive(Debug)]
pub struct toile_array {
    _private: [u8; 0],
}

/// A straight edge.
pub const TOILE_EDGE_LINE: u32 = 0;
/// A quadratic Bezier curve; controls are the control point u, v [m] and two ignored numbers.
pub const TOILE_EDGE_QUADRATIC: u32 = 1;
/// A cubic Bezier curve; controls are two control points u, v, u, v [m].
pub const TOILE_EDGE_CUBIC: u32 = 2;
/// A circular arc; controls are the radius [m], 1 for the larger arc or 0, 1 if it bulges to the
/// right of the directed edge or 0 for the left, and one ignored number.
pub const TOILE_EDGE_ARC: u32 = 3;

/// Every tolerance was met.
pub const TOILE_OUTCOME_CONVERGED: u32 = 0;
/// A step was cut into smaller ones and reached its end.
pub const TOILE_OUTCOME_SUBSTEPPED: u32 = 1;
/// An iteration limit was hit; the state is admissible and the residual is in the report.
pub const TOILE_OUTCOME_ITERATION_LIMIT: u32 = 2;
/// The host asked to stop; the state is admissible.
pub const TOILE_OUTCOME_CANCELLED: u32 = 3;
/// A drape ended where no step, however short, leads lower; the state is admissible, the residual is
/// in the report, the reason in the log.
pub const TOILE_OUTCOME_STALLED: u32 = 4;
/// Nothing holds a part of the garment and nothing lies on its way: a drape of it would never end.
/// The state is that at which this was seen; the log names the part.
pub const TOILE_OUTCOME_FALLING: u32 = 5;

/// How a garment begins.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_garment_desc {
    /// sizeof(toile_garment_desc).
    pub struct_size: usize,
    /// Name for people, UTF-8; NULL for none.
    pub name: *const c_char,
    /// Target edge length of the triangles [m]; a panel may have its own. Default 0.015.
    pub edge_length: f64,
}

/// A flat panel. Coordinates u (along the weft) and v (along the warp, up) lie in the panel's own
/// plane [m]; the outline runs counter-clockwise seen from the outside of the cloth.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_panel_desc {
    /// sizeof(toile_panel_desc).
    pub struct_size: usize,
    /// Unique name, UTF-8; NULL gives "panel_" and its number.
    pub name: *const c_char,
    /// Corners [m], shape [vertex_count, 2].
    pub vertices: *const f64,
    /// Number of corners.
    pub vertex_count: usize,
    /// Start and end corner of each edge, shape [edge_count, 2]: the outline in order, then hole
    /// after hole. NULL with edge_count 0: straight edges from each corner to the next, edge i
    /// beginning at corner i.
    pub edges: *const u32,
    /// Number of edges, holes included.
    pub edge_count: usize,
    /// Kind of each edge (TOILE_EDGE_...), shape [edge_count]; NULL if all are straight.
    pub edge_kinds: *const u32,
    /// Numbers of each edge as its kind says, shape [edge_count, 4]; NULL if all are straight.
    pub edge_controls: *const f64,
    /// Number of edges of each hole, shape [hole_count]; the outline has the rest.
    pub hole_sizes: *const u32,
    /// Number of holes.
    pub hole_count: usize,
    /// World position of the panel's origin before sewing [m].
    pub position: [f64; 3],
    /// Rotation of the panel's plane (z = 0) into the world before sewing, x, y, z, w.
    pub quaternion_xyzw: [f64; 4],
    /// Direction of the warp in the plane, from +v counter-clockwise [rad].
    pub grain: f64,
    /// Target edge length of the triangles [m]; 0 (default) takes the garment's.
    pub edge_length: f64,
    /// Index of the fabric.
    pub fabric: u32,
    /// 0.
    pub reserved: u32,
}

/// Two edges sewn together, matched by fraction of arc length: the longer one is gathered.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_seam_desc {
    /// sizeof(toile_seam_desc).
    pub struct_size: usize,
    /// Panel of the first edge.
    pub panel_a: u32,
    /// First edge, counted in its panel: outline first, then hole after hole.
    pub edge_a: u32,
    /// Panel of the second edge; the same panel for a dart.
    pub panel_b: u32,
    /// Second edge.
    pub edge_b: u32,
    /// 0 (default): the start of the first edge meets the end of the second, so that the outsides
    /// of the cloth agree; 1: start meets start.
    pub same_direction: u32,
    /// 0.
    pub reserved: u32,
    /// Rest angle across the seam [rad]; 0 (default) is flat.
    pub rest_angle: f64,
}

/// Signed distances on the nodes of a regular grid: node (i, j, k) at origin + cell_size (i, j, k).
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_sdf_grid_desc {
    /// sizeof(toile_sdf_grid_desc).
    pub struct_size: usize,
    /// Nodes along x, y, z; at least 2 each.
    pub counts: [u32; 3],
    /// 0.
    pub reserved: u32,
    /// Position of node (0, 0, 0) [m].
    pub origin: [f64; 3],
    /// Distance between neighbouring nodes [m].
    pub cell_size: f64,
    /// Signed distances, negative inside [m], shape [counts[0], counts[1], counts[2]], z fastest.
    pub values: *const f64,
    /// Number of values: the product of the counts.
    pub value_count: usize,
}

/// The world of a simulation.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_sim_desc {
    /// sizeof(toile_sim_desc).
    pub struct_size: usize,
    /// Acceleration of gravity [m/s^2], within 1e6; default (0, -9.81, 0).
    pub gravity: [f64; 3],
    /// Velocity of the air [m/s], within 1e6.
    pub wind: [f64; 3],
    /// Pressure on the cloth along its normal [Pa], within 1e9.
    pub pressure: f64,
    /// Worker threads, the calling one included; results do not depend on it. Default 1.
    pub threads: u32,
    /// 0.
    pub reserved: u32,
    /// Most vertices the garment may be triangulated into; default 2000000.
    pub max_vertices: u64,
    /// Takes the log; NULL for none.
    pub log: toile_log_fn,
    /// Handed to the log callback.
    pub log_user: *mut c_void,
    /// Told before every substep how far a step has come (its stage is "step"), and asked whether to
    /// go on; NULL for none. A step that is stopped leaves the simulation as it was before it.
    pub progress: toile_progress_fn,
    /// Handed to the progress callback.
    pub progress_user: *mut c_void,
}

/// How the cloth meets one body.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_contact_desc {
    /// sizeof(toile_contact_desc).
    pub struct_size: usize,
    /// Coulomb friction; default 0.3.
    pub friction: f64,
    /// Gap kept free between the body's surface and the cloth's middle surface [m]; default 0.003.
    pub thickness: f64,
    /// Penalty stiffness, pressure per depth [Pa/m]; default 1e7.
    pub stiffness: f64,
}

/// How far a long call has come.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_progress {
    /// sizeof(toile_progress) of the library; a newer library may have appended fields.
    pub struct_size: usize,
    /// Estimate of the part done, 0 to 1, never decreasing.
    pub fraction: f64,
    /// Name of the stage, UTF-8, valid during the callback: "sew", "settle", "unfold", "rest" of a
    /// drape, "step" of a step.
    pub stage: *const c_char,
    /// Largest force on a free vertex now [N].
    pub residual: f64,
}

/// Called on the calling thread while a long call works. Returns 0 to go on; anything else stops
/// the call as soon as there is an admissible state. The simulation at work is busy for calls from
/// in here. Must not throw or jump out.
pub type toile_progress_fn =
    Option<extern "C" fn(user: *mut c_void, progress: *const toile_progress) -> i32>;

/// How to drape.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_drape_desc {
    /// sizeof(toile_drape_desc).
    pub struct_size: usize,
    /// At rest when no free vertex carries a larger force [N]; 0 (default) takes the number
    /// "solver.drape.force_tolerance".
    pub force_tolerance: f64,
    /// Steps allowed on each level; 0 (default) takes the number "solver.drape.max_steps".
    pub max_steps: u64,
    /// Told how far the drape has come, and asked whether to go on; NULL for none.
    pub progress: toile_progress_fn,
    /// Handed to the progress callback.
    pub progress_user: *mut c_void,
}

/// How a step or a drape went.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_step_report {
    /// sizeof(toile_step_report), set by the caller.
    pub struct_size: usize,
    /// Why it stopped: TOILE_OUTCOME_...
    pub outcome: u32,
    /// 0.
    pub reserved: u32,
    /// Newton iterations, all substeps together.
    pub newton_iterations: u64,
    /// Iterations of the linear solver, all together; a direct solve counts one.
    pub linear_iterations: u64,
    /// Substeps taken.
    pub substeps: u64,
    /// Time advanced [s].
    pub advanced: f64,
    /// Largest force residual of a free vertex at the end [N].
    pub residual: f64,
    /// Largest relative stretch of a mesh edge, or of a piece of yarn between two nodes.
    pub max_edge_strain: f64,
    /// Smallest signed distance of a vertex to a body [m]; infinite without bodies.
    pub min_gap: f64,
    /// Kinetic energy [J].
    pub kinetic_energy: f64,
    /// Elastic, gravity and contact energy [J].
    pub potential_energy: f64,
    /// Largest distance between the two points of a sewn pair [m].
    pub max_seam_gap: f64,
}

/// Energies of the present state [J].
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_energies {
    /// sizeof(toile_energies), set by the caller.
    pub struct_size: usize,
    /// Kinetic energy.
    pub kinetic: f64,
    /// Gravity, zero at the world's origin.
    pub gravity: f64,
    /// Stretch and shear of the triangles.
    pub membrane: f64,
    /// Bending.
    pub bending: f64,
    /// Seams.
    pub seam: f64,
    /// Contact with bodies and of the cloth with itself, friction springs included.
    pub contact: f64,
    /// All yarn energies together.
    pub yarn: f64,
}

/// What was built and what it costs.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_system_info {
    /// sizeof(toile_system_info), set by the caller.
    pub struct_size: usize,
    /// Vertices.
    pub vertices: u64,
    /// Triangles.
    pub triangles: u64,
    /// Nodes of yarns.
    pub yarn_nodes: u64,
    /// Scalar unknowns.
    pub unknowns: u64,
    /// Memory of mesh, energies and matrix, without the factor [bytes].
    pub bytes: u64,
    /// Memory of the factor and the solver's work arrays [bytes].
    pub factor_bytes: u64,
    /// Smallest angle of a triangle [rad].
    pub min_angle: f64,
    /// Triangles that are simulated; yarns stand for the others.
    pub active_triangles: u64,
    /// Nodes of yarns that triangles carry.
    pub carried_nodes: u64,
}

/// What is not as the yarns were laid.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_yarn_changes {
    /// sizeof(toile_yarn_changes), set by the caller.
    pub struct_size: usize,
    /// Grows whenever any of these numbers, or the arrays that count nodes and passages, change, with regions too. 0 before
    /// there are yarns, 1 as they are laid first.
    pub epoch: u64,
    /// Passages of yarns through nodes that are gone.
    pub passages_gone: u64,
    /// Nodes that came out of others where yarns parted.
    pub nodes_split: u64,
    /// Nodes that no yarn passes any more.
    pub nodes_left: u64,
}

/// Which region of yarns is wanted: at least one of tolerance and budget.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_suggest_desc {
    /// sizeof(toile_suggest_desc).
    pub struct_size: usize,
    /// Error of the deformation's gradient above which triangles give way to yarns, from 0.001 to 1000: a root mean square over a vertex
    /// and what is around it, so that single vertices with more may stay. 0 (default) is none given.
    pub tolerance: f64,
    /// Most nodes of yarns, counted as they are laid. 0 (default) is no limit.
    pub budget: u64,
    /// Hybrid rings around the region, 0 (default) to 3.
    pub rings: u32,
    /// Criteria that do not count in the error: the sum of 1 << TOILE_CRITERION_... of each. 0 (default) counts all.
    pub left_out: u32,
}

/// What a suggested region leaves and costs: nodes and unknowns counted, time and memory predicted.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_suggestion {
    /// sizeof(toile_suggestion), set by the caller.
    pub struct_size: usize,
    /// Tolerance that the region is one for: the wanted one, or what the budget allows.
    pub tolerance: f64,
    /// Error of triangles alone, root mean square over their area.
    pub error: f64,
    /// The same of the triangles that are left.
    pub error_left: f64,
    /// Largest error of a triangle that is left.
    pub largest_left: f64,
    /// Triangles that give way to yarns; 0 where no yarns are needed.
    pub full_triangles: u64,
    /// Nodes of yarns, those that triangles carry included.
    pub yarn_nodes: u64,
    /// Nodes that triangles carry.
    pub carried_nodes: u64,
    /// Triangles that are simulated.
    pub active_triangles: u64,
    /// Scalar unknowns.
    pub unknowns: u64,
    /// Memory of the simulation [bytes].
    pub bytes: u64,
    /// Time of a drape that goes on where triangles rest, theirs included, over that of triangles alone. Right within a factor of 2.3
    /// in nine drapes.
    pub time_ratio: f64,
    /// Nodes of yarns wherever fabrics have them, for comparison.
    pub all_yarn_nodes: u64,
    /// Time of a drape with yarns wherever fabrics have them over that of triangles alone.
    pub all_time_ratio: f64,
    /// Time of a Newton iteration over that of triangles alone. A step takes more of them than of triangles as well, which no prediction tells.
    pub iteration_ratio: f64,
}

/// Numbers that lie in the library's memory. Valid until the next call on the same handle whose
/// handle is not const; compare `epoch` with toile_sim_epoch to find out.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
pub struct toile_view_f64 {
    /// sizeof(toile_view_f64), set by the caller.
    pub struct_size: usize,
    /// First number; NULL if count is 0.
    pub data: *const f64,
    /// Number of elements (points).
    pub count: u64,
    /// Numbers of each element.
    pub components: u64,
    /// Bytes from one element to the next.
    pub stride: u64,
    /// Epoch of the simulation when the view was taken.
    pub epoch: u64,
}

macro_rules! versioned {
    ($($name:ident { $($field:ident : $value:expr),* $(,)? })*) => {
        $(
            // SAFETY: repr(C), begins with its size; numbers, raw pointers and optional function
            // pointers, of which the caller vouches for what is not NULL.
            unsafe impl Versioned for $name {
                const NAME: &'static str = stringify!($name);
                fn defaults() -> Self {
                    Self { struct_size: size_of::<Self>(), $($field: $value),* }
                }
            }
        )*
    };
}

versioned! {
    toile_garment_desc { name: ptr::null(), edge_length: DEFAULT_EDGE_LENGTH }
    toile_panel_desc {
        name: ptr::null(), vertices: ptr::null(), vertex_count: 0, edges: ptr::null(),
        edge_count: 0, edge_kinds: ptr::null(), edge_controls: ptr::null(),
        hole_sizes: ptr::null(), hole_count: 0, position: [0.0; 3],
        quaternion_xyzw: [0.0, 0.0, 0.0, 1.0], grain: 0.0, edge_length: 0.0, fabric: 0, reserved: 0,
    }
    toile_seam_desc {
        panel_a: 0, edge_a: 0, panel_b: 0, edge_b: 0, same_direction: 0, reserved: 0,
        rest_angle: 0.0,
    }
    toile_sdf_grid_desc {
        counts: [0; 3], reserved: 0, origin: [0.0; 3], cell_size: 0.0, values: ptr::null(),
        value_count: 0,
    }
    toile_sim_desc {
        gravity: [0.0, -9.81, 0.0], wind: [0.0; 3], pressure: 0.0, threads: 1, reserved: 0,
        max_vertices: 2_000_000, log: None, log_user: ptr::null_mut(), progress: None,
        progress_user: ptr::null_mut(),
    }
    toile_contact_desc { friction: 0.3, thickness: 3e-3, stiffness: 1e7 }
    toile_progress { fraction: 0.0, stage: ptr::null(), residual: 0.0 }
    toile_drape_desc {
        force_tolerance: 0.0, max_steps: 0, progress: None, progress_user: ptr::null_mut(),
    }
    toile_step_report {
        outcome: 0, reserved: 0, newton_iterations: 0, linear_iterations: 0, substeps: 0,
        advanced: 0.0, residual: 0.0, max_edge_strain: 0.0, min_gap: 0.0, kinetic_energy: 0.0,
        potential_energy: 0.0, max_seam_gap: 0.0,
    }
    toile_energies {
        kinetic: 0.0, gravity: 0.0, membrane: 0.0, bending: 0.0, seam: 0.0, contact: 0.0,
        yarn: 0.0,
    }
    toile_system_info {
        vertices: 0, triangles: 0, yarn_nodes: 0, unknowns: 0, bytes: 0, factor_bytes: 0,
        min_angle: 0.0, active_triangles: 0, carried_nodes: 0,
    }
    toile_yarn_changes { epoch: 0, passages_gone: 0, nodes_split: 0, nodes_left: 0 }
    toile_suggest_desc { tolerance: 0.0, budget: 0, rings: 0, left_out: 0 }
    toile_suggestion {
        tolerance: 0.0, error: 0.0, error_left: 0.0, largest_left: 0.0, full_triangles: 0,
        yarn_nodes: 0, carried_nodes: 0, active_triangles: 0, unknowns: 0, bytes: 0, time_ratio: 0.0,
        all_yarn_nodes: 0, all_time_ratio: 0.0, iteration_ratio: 0.0,
    }
    toile_view_f64 { data: ptr::null(), count: 0, components: 0, stride: 0, epoch: 0 }
}

/// Fills a garment description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_garment_desc_init(
    desc: *mut toile_garment_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a panel description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_panel_desc_init(
    desc: *mut toile_panel_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a seam description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_seam_desc_init(
    desc: *mut toile_seam_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a grid description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sdf_grid_desc_init(
    desc: *mut toile_sdf_grid_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a simulation description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_sim_desc_init(
    desc: *mut toile_sim_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a contact description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_contact_desc_init(
    desc: *mut toile_contact_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a drape description of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_drape_desc_init(
    desc: *mut toile_drape_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a report of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_step_report_init(
    out: *mut toile_step_report,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}

/// Fills energies of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_energies_init(
    out: *mut toile_energies,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}

/// Fills system information of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_system_info_init(
    out: *mut toile_system_info,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}

/// Fills changes of yarns of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_yarn_changes_init(
    out: *mut toile_yarn_changes,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}

/// Fills a description of a wanted region of `struct_size` bytes with defaults and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_suggest_desc_init(
    desc: *mut toile_suggest_desc,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(desc, struct_size) })
}

/// Fills a suggestion of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_suggestion_init(
    out: *mut toile_suggestion,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}

/// Fills a view of `struct_size` bytes with zeros and its own size.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn toile_view_f64_init(
    out: *mut toile_view_f64,
    struct_size: usize,
) -> toile_status {
    entry!({ desc::init(out, struct_size) })
}
