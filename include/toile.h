/*
 * toile.h - garment simulation behind a C interface.
 *
 * This file is generated from the library's sources; do not edit it.
 *
 * Handles. toile_garment, toile_body, toile_sim and toile_array are opaque and are only handed
 *   back to the library. A handle that is NULL, freed, or of another kind is TOILE_E_HANDLE, never
 *   a crash. The caller frees handles and nothing else.
 * Results. Every call that can fail returns a toile_status, 0 or a negative error, and gives its
 *   results by out-parameters. toile_last_error() says what went wrong, where, the limit and the
 *   value. After any error but TOILE_E_PANIC the object is exactly as it was before the call.
 * Structs. Every struct begins with its size. Fill descriptions with toile_..._desc_init(&desc,
 *   sizeof desc), and set struct_size of structs that the library fills. Fields are only ever
 *   appended; a shorter struct means defaults for the rest.
 * Memory. Input is borrowed during the call. Arrays are copied out by two calls: with out == NULL
 *   `*needed` gets the number of elements; then the caller passes an array of at least that
 *   `capacity`. TOILE_E_SIZE: the array is too small, nothing was written to it, and `*needed`
 *   says what it takes. Views point into the library and are valid until the next call on that
 *   handle whose handle is not const; what a toile_array holds is there, and the same, until
 *   toile_array_free. Pointers must be NULL or valid for the stated count, arrays aligned as their
 *   type asks. Text is UTF-8.
 * Threads. Calls whose handle is const may run beside each other; a call whose handle is not const
 *   needs the handle for itself; different handles are independent. Breaking this is TOILE_E_BUSY.
 * Units. SI throughout: m, kg, s, N, Pa, rad. Arrays are row-major, three numbers per point,
 *   indices uint32_t from 0. No axis is special: gravity is a vector, by default (0, -9.81, 0).
 */

#ifndef TOILE_H
#define TOILE_H

#include <stddef.h>
#include <stdint.h>

/**
 * No error.
 */
#define TOILE_OK 0

/**
 * An argument is NULL, not finite, out of range, or contradicts another.
 */
#define TOILE_E_ARGUMENT -1

/**
 * A handle is NULL, freed, of another kind, or was never one.
 */
#define TOILE_E_HANDLE -2

/**
 * The handle is in use by another thread, or by the call that this callback runs in.
 */
#define TOILE_E_BUSY -3

/**
 * The buffer is too small and nothing was written to it, or the count of an array is not the one that is expected.
 */
#define TOILE_E_SIZE -4

/**
 * The present state of the object does not allow the call.
 */
#define TOILE_E_STATE -5

/**
 * The library does not offer this for the object at hand.
 */
#define TOILE_E_UNSUPPORTED -6

/**
 * The host asked to stop before there was a result.
 */
#define TOILE_E_CANCELLED -7

/**
 * Text or bytes that are not of the expected format.
 */
#define TOILE_E_PARSE -20

/**
 * A pattern, mesh or body whose geometry cannot be.
 */
#define TOILE_E_GEOMETRY -21

/**
 * A fabric whose numbers cannot be.
 */
#define TOILE_E_MATERIAL -22

/**
 * More memory or more elements asked for than the limit.
 */
#define TOILE_E_LIMIT -23

/**
 * A file could not be read or written.
 */
#define TOILE_E_IO -24

/**
 * No admissible state was found; the simulation is as it was before the call.
 */
#define TOILE_E_NO_ADMISSIBLE_STATE -40

/**
 * A linear system could not be solved; the simulation is as it was before the call.
 */
#define TOILE_E_LINEAR_SOLVE -41

/**
 * An internal error was caught. The handle it happened in can only be freed.
 */
#define TOILE_E_PANIC -100

/**
 * Version of this header: the same numbers as the library's package.
 */
#define TOILE_VERSION_MAJOR 0

/**
 * Second number of the version.
 */
#define TOILE_VERSION_MINOR 1

/**
 * Third number of the version.
 */
#define TOILE_VERSION_PATCH 0

/**
 * An index that stands for "none".
 */
#define TOILE_NONE UINT32_MAX

/**
 * Something does not work.
 */
#define TOILE_LOG_ERROR 0

/**
 * Something works otherwise than asked for.
 */
#define TOILE_LOG_WARNING 1

/**
 * What was built and how calls ended.
 */
#define TOILE_LOG_INFO 2

/**
 * A straight edge.
 */
#define TOILE_EDGE_LINE 0

/**
 * A quadratic Bezier curve; controls are the control point u, v [m] and two ignored numbers.
 */
#define TOILE_EDGE_QUADRATIC 1

/**
 * A cubic Bezier curve; controls are two control points u, v, u, v [m].
 */
#define TOILE_EDGE_CUBIC 2

/**
 * A circular arc; controls are the radius [m], 1 for the larger arc or 0, 1 if it bulges to the
 * right of the directed edge or 0 for the left, and one ignored number.
 */
#define TOILE_EDGE_ARC 3

/**
 * Every tolerance was met.
 */
#define TOILE_OUTCOME_CONVERGED 0

/**
 * A step was cut into smaller ones and reached its end.
 */
#define TOILE_OUTCOME_SUBSTEPPED 1

/**
 * An iteration limit was hit; the state is admissible and the residual is in the report.
 */
#define TOILE_OUTCOME_ITERATION_LIMIT 2

/**
 * The host asked to stop; the state is admissible.
 */
#define TOILE_OUTCOME_CANCELLED 3

/**
 * A drape ended where no step, however short, leads lower; the state is admissible, the residual is
 * in the report, the reason in the log.
 */
#define TOILE_OUTCOME_STALLED 4

/**
 * Nothing holds a part of the garment and nothing lies on its way: a drape of it would never end.
 * The state is that at which this was seen; the log names the part.
 */
#define TOILE_OUTCOME_FALLING 5

/**
 * Criterion: waves that are too short for the triangles.
 */
#define TOILE_CRITERION_WRINKLE 0

/**
 * Criterion: shape that the mesh does not follow.
 */
#define TOILE_CRITERION_MESH 1

/**
 * Criterion: curvature beyond the range that triangles are fitted in.
 */
#define TOILE_CRITERION_CURVATURE 2

/**
 * Criterion: strain beyond that range.
 */
#define TOILE_CRITERION_STRAIN 3

/**
 * Criterion: jumps of strain between triangles.
 */
#define TOILE_CRITERION_STRESS 4

/**
 * Criterion: bending moments across seams.
 */
#define TOILE_CRITERION_SEAM 5

/**
 * Number of criteria.
 */
#define TOILE_CRITERION_COUNT 6

/**
 * An array that stays as it was.
 */
typedef struct toile_array toile_array;

/**
 * A body that cloth meets: a signed distance field, negative inside. Never changes.
 */
typedef struct toile_body toile_body;

/**
 * A garment: flat panels, seams, fabrics. Editable; no simulation inside.
 */
typedef struct toile_garment toile_garment;

/**
 * A simulation: a garment in a world.
 */
typedef struct toile_sim toile_sim;

/**
 * Result of every call that can fail: 0 is success, errors are negative. The values are fixed for
 * ever: -1.. use of the library, -20.. data, -40.. numerics, -60.. GPU, -100 an internal error.
 */
typedef int32_t toile_status;

/**
 * How a garment begins.
 */
typedef struct toile_garment_desc {
    /**
     * sizeof(toile_garment_desc).
     */
    size_t struct_size;
    /**
     * Name for people, UTF-8; NULL for none.
     */
    const char *name;
    /**
     * Target edge length of the triangles [m]; a panel may have its own. Default 0.015.
     */
    double edge_length;
} toile_garment_desc;

/**
 * A flat panel. Coordinates u (along the weft) and v (along the warp, up) lie in the panel's own
 * plane [m]; the outline runs counter-clockwise seen from the outside of the cloth.
 */
typedef struct toile_panel_desc {
    /**
     * sizeof(toile_panel_desc).
     */
    size_t struct_size;
    /**
     * Unique name, UTF-8; NULL gives "panel_" and its number.
     */
    const char *name;
    /**
     * Corners [m], shape [vertex_count, 2].
     */
    const double *vertices;
    /**
     * Number of corners.
     */
    size_t vertex_count;
    /**
     * Start and end corner of each edge, shape [edge_count, 2]: the outline in order, then hole
     * after hole. NULL with edge_count 0: straight edges from each corner to the next, edge i
     * beginning at corner i.
     */
    const uint32_t *edges;
    /**
     * Number of edges, holes included.
     */
    size_t edge_count;
    /**
     * Kind of each edge (TOILE_EDGE_...), shape [edge_count]; NULL if all are straight.
     */
    const uint32_t *edge_kinds;
    /**
     * Numbers of each edge as its kind says, shape [edge_count, 4]; NULL if all are straight.
     */
    const double *edge_controls;
    /**
     * Number of edges of each hole, shape [hole_count]; the outline has the rest.
     */
    const uint32_t *hole_sizes;
    /**
     * Number of holes.
     */
    size_t hole_count;
    /**
     * World position of the panel's origin before sewing [m].
     */
    double position[3];
    /**
     * Rotation of the panel's plane (z = 0) into the world before sewing, x, y, z, w.
     */
    double quaternion_xyzw[4];
    /**
     * Direction of the warp in the plane, from +v counter-clockwise [rad].
     */
    double grain;
    /**
     * Target edge length of the triangles [m]; 0 (default) takes the garment's.
     */
    double edge_length;
    /**
     * Index of the fabric.
     */
    uint32_t fabric;
    /**
     * 0.
     */
    uint32_t reserved;
} toile_panel_desc;

/**
 * Two edges sewn together, matched by fraction of arc length: the longer one is gathered.
 */
typedef struct toile_seam_desc {
    /**
     * sizeof(toile_seam_desc).
     */
    size_t struct_size;
    /**
     * Panel of the first edge.
     */
    uint32_t panel_a;
    /**
     * First edge, counted in its panel: outline first, then hole after hole.
     */
    uint32_t edge_a;
    /**
     * Panel of the second edge; the same panel for a dart.
     */
    uint32_t panel_b;
    /**
     * Second edge.
     */
    uint32_t edge_b;
    /**
     * 0 (default): the start of the first edge meets the end of the second, so that the outsides
     * of the cloth agree; 1: start meets start.
     */
    uint32_t same_direction;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Rest angle across the seam [rad]; 0 (default) is flat.
     */
    double rest_angle;
} toile_seam_desc;

/**
 * Signed distances on the nodes of a regular grid: node (i, j, k) at origin + cell_size (i, j, k).
 */
typedef struct toile_sdf_grid_desc {
    /**
     * sizeof(toile_sdf_grid_desc).
     */
    size_t struct_size;
    /**
     * Nodes along x, y, z; at least 2 each.
     */
    uint32_t counts[3];
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Position of node (0, 0, 0) [m].
     */
    double origin[3];
    /**
     * Distance between neighbouring nodes [m].
     */
    double cell_size;
    /**
     * Signed distances, negative inside [m], shape [counts[0], counts[1], counts[2]], z fastest.
     */
    const double *values;
    /**
     * Number of values: the product of the counts.
     */
    size_t value_count;
} toile_sdf_grid_desc;

/**
 * Takes a line of log: level (TOILE_LOG_...), UTF-8 text that ends with NUL, valid during the
 * callback. May come from any thread, several at once. Must not throw, jump out, or change the
 * object that the log belongs to.
 */
typedef void (*toile_log_fn)(void *user, uint32_t level, const char *message);

/**
 * How far a long call has come.
 */
typedef struct toile_progress {
    /**
     * sizeof(toile_progress) of the library; a newer library may have appended fields.
     */
    size_t struct_size;
    /**
     * Estimate of the part done, 0 to 1, never decreasing.
     */
    double fraction;
    /**
     * Name of the stage, UTF-8, valid during the callback: "sew", "settle", "unfold", "rest" of a
     * drape, "step" of a step.
     */
    const char *stage;
    /**
     * Largest force on a free vertex now [N].
     */
    double residual;
} toile_progress;

/**
 * Called on the calling thread while a long call works. Returns 0 to go on; anything else stops
 * the call as soon as there is an admissible state. The simulation at work is busy for calls from
 * in here. Must not throw or jump out.
 */
typedef int32_t (*toile_progress_fn)(void *user, const struct toile_progress *progress);

/**
 * The world of a simulation.
 */
typedef struct toile_sim_desc {
    /**
     * sizeof(toile_sim_desc).
     */
    size_t struct_size;
    /**
     * Acceleration of gravity [m/s^2], within 1e6; default (0, -9.81, 0).
     */
    double gravity[3];
    /**
     * Velocity of the air [m/s], within 1e6.
     */
    double wind[3];
    /**
     * Pressure on the cloth along its normal [Pa], within 1e9.
     */
    double pressure;
    /**
     * Worker threads, the calling one included; results do not depend on it. Default 1.
     */
    uint32_t threads;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Most vertices the garment may be triangulated into; default 2000000.
     */
    uint64_t max_vertices;
    /**
     * Takes the log; NULL for none.
     */
    toile_log_fn log;
    /**
     * Handed to the log callback.
     */
    void *log_user;
    /**
     * Told before every substep how far a step has come (its stage is "step"), and asked whether to
     * go on; NULL for none. A step that is stopped leaves the simulation as it was before it.
     */
    toile_progress_fn progress;
    /**
     * Handed to the progress callback.
     */
    void *progress_user;
} toile_sim_desc;

/**
 * How the cloth meets one body.
 */
typedef struct toile_contact_desc {
    /**
     * sizeof(toile_contact_desc).
     */
    size_t struct_size;
    /**
     * Coulomb friction; default 0.3.
     */
    double friction;
    /**
     * Gap kept free between the body's surface and the cloth's middle surface [m]; default 0.003.
     */
    double thickness;
    /**
     * Penalty stiffness, pressure per depth [Pa/m]; default 1e7.
     */
    double stiffness;
} toile_contact_desc;

/**
 * How to drape.
 */
typedef struct toile_drape_desc {
    /**
     * sizeof(toile_drape_desc).
     */
    size_t struct_size;
    /**
     * At rest when no free vertex carries a larger force [N]; 0 (default) takes the number
     * "solver.drape.force_tolerance".
     */
    double force_tolerance;
    /**
     * Steps allowed on each level; 0 (default) takes the number "solver.drape.max_steps".
     */
    uint64_t max_steps;
    /**
     * Told how far the drape has come, and asked whether to go on; NULL for none.
     */
    toile_progress_fn progress;
    /**
     * Handed to the progress callback.
     */
    void *progress_user;
} toile_drape_desc;

/**
 * How a step or a drape went.
 */
typedef struct toile_step_report {
    /**
     * sizeof(toile_step_report), set by the caller.
     */
    size_t struct_size;
    /**
     * Why it stopped: TOILE_OUTCOME_...
     */
    uint32_t outcome;
    /**
     * 0.
     */
    uint32_t reserved;
    /**
     * Newton iterations, all substeps together.
     */
    uint64_t newton_iterations;
    /**
     * Iterations of the linear solver, all together; a direct solve counts one.
     */
    uint64_t linear_iterations;
    /**
     * Substeps taken.
     */
    uint64_t substeps;
    /**
     * Time advanced [s].
     */
    double advanced;
    /**
     * Largest force residual of a free vertex at the end [N].
     */
    double residual;
    /**
     * Largest relative stretch of a mesh edge, or of a piece of yarn between two nodes.
     */
    double max_edge_strain;
    /**
     * Smallest signed distance of a vertex to a body [m]; infinite without bodies.
     */
    double min_gap;
    /**
     * Kinetic energy [J].
     */
    double kinetic_energy;
    /**
     * Elastic, gravity and contact energy [J].
     */
    double potential_energy;
    /**
     * Largest distance between the two points of a sewn pair [m].
     */
    double max_seam_gap;
} toile_step_report;

/**
 * Energies of the present state [J].
 */
typedef struct toile_energies {
    /**
     * sizeof(toile_energies), set by the caller.
     */
    size_t struct_size;
    /**
     * Kinetic energy.
     */
    double kinetic;
    /**
     * Gravity, zero at the world's origin.
     */
    double gravity;
    /**
     * Stretch and shear of the triangles.
     */
    double membrane;
    /**
     * Bending.
     */
    double bending;
    /**
     * Seams.
     */
    double seam;
    /**
     * Contact with bodies and of the cloth with itself, friction springs included.
     */
    double contact;
    /**
     * All yarn energies together.
     */
    double yarn;
} toile_energies;

/**
 * What was built and what it costs.
 */
typedef struct toile_system_info {
    /**
     * sizeof(toile_system_info), set by the caller.
     */
    size_t struct_size;
    /**
     * Vertices.
     */
    uint64_t vertices;
    /**
     * Triangles.
     */
    uint64_t triangles;
    /**
     * Nodes of yarns.
     */
    uint64_t yarn_nodes;
    /**
     * Scalar unknowns.
     */
    uint64_t unknowns;
    /**
     * Memory of mesh, energies and matrix, without the factor [bytes].
     */
    uint64_t bytes;
    /**
     * Memory of the factor and the solver's work arrays [bytes].
     */
    uint64_t factor_bytes;
    /**
     * Smallest angle of a triangle [rad].
     */
    double min_angle;
    /**
     * Triangles that are simulated; yarns stand for the others.
     */
    uint64_t active_triangles;
    /**
     * Nodes of yarns that triangles carry.
     */
    uint64_t carried_nodes;
} toile_system_info;

/**
 * What is not as the yarns were laid.
 */
typedef struct toile_yarn_changes {
    /**
     * sizeof(toile_yarn_changes), set by the caller.
     */
    size_t struct_size;
    /**
     * Grows whenever any of these numbers, or the arrays that count nodes and passages, change, with regions too. 0 before
     * there are yarns, 1 as they are laid first.
     */
    uint64_t epoch;
    /**
     * Passages of yarns through nodes that are gone.
     */
    uint64_t passages_gone;
    /**
     * Nodes that came out of others where yarns parted.
     */
    uint64_t nodes_split;
    /**
     * Nodes that no yarn passes any more.
     */
    uint64_t nodes_left;
} toile_yarn_changes;

/**
 * Which region of yarns is wanted: at least one of tolerance and budget.
 */
typedef struct toile_suggest_desc {
    /**
     * sizeof(toile_suggest_desc).
     */
    size_t struct_size;
    /**
     * Error of the deformation's gradient above which triangles give way to yarns, from 0.001 to 1000: a root mean square over a vertex
     * and what is around it, so that single vertices with more may stay. 0 (default) is none given.
     */
    double tolerance;
    /**
     * Most nodes of yarns, counted as they are laid. 0 (default) is no limit.
     */
    uint64_t budget;
    /**
     * Hybrid rings around the region, 0 (default) to 3.
     */
    uint32_t rings;
    /**
     * Criteria that do not count in the error: the sum of 1 << TOILE_CRITERION_... of each. 0 (default) counts all.
     */
    uint32_t left_out;
} toile_suggest_desc;

/**
 * What a suggested region leaves and costs: nodes and unknowns counted, time and memory predicted.
 */
typedef struct toile_suggestion {
    /**
     * sizeof(toile_suggestion), set by the caller.
     */
    size_t struct_size;
    /**
     * Tolerance that the region is one for: the wanted one, or what the budget allows.
     */
    double tolerance;
    /**
     * Error of triangles alone, root mean square over their area.
     */
    double error;
    /**
     * The same of the triangles that are left.
     */
    double error_left;
    /**
     * Largest error of a triangle that is left.
     */
    double largest_left;
    /**
     * Triangles that give way to yarns; 0 where no yarns are needed.
     */
    uint64_t full_triangles;
    /**
     * Nodes of yarns, those that triangles carry included.
     */
    uint64_t yarn_nodes;
    /**
     * Nodes that triangles carry.
     */
    uint64_t carried_nodes;
    /**
     * Triangles that are simulated.
     */
    uint64_t active_triangles;
    /**
     * Scalar unknowns.
     */
    uint64_t unknowns;
    /**
     * Memory of the simulation [bytes].
     */
    uint64_t bytes;
    /**
     * Time of a drape that goes on where triangles rest, theirs included, over that of triangles alone. Right within a factor of 2.3
     * in nine drapes.
     */
    double time_ratio;
    /**
     * Nodes of yarns wherever fabrics have them, for comparison.
     */
    uint64_t all_yarn_nodes;
    /**
     * Time of a drape with yarns wherever fabrics have them over that of triangles alone.
     */
    double all_time_ratio;
    /**
     * Time of a Newton iteration over that of triangles alone. A step takes more of them than of triangles as well, which no prediction tells.
     */
    double iteration_ratio;
} toile_suggestion;

/**
 * Numbers that lie in the library's memory. Valid until the next call on the same handle whose
 * handle is not const; compare `epoch` with toile_sim_epoch to find out.
 */
typedef struct toile_view_f64 {
    /**
     * sizeof(toile_view_f64), set by the caller.
     */
    size_t struct_size;
    /**
     * First number; NULL if count is 0.
     */
    const double *data;
    /**
     * Number of elements (points).
     */
    uint64_t count;
    /**
     * Numbers of each element.
     */
    uint64_t components;
    /**
     * Bytes from one element to the next.
     */
    uint64_t stride;
    /**
     * Epoch of the simulation when the view was taken.
     */
    uint64_t epoch;
} toile_view_f64;

#ifdef __cplusplus
extern "C" {
#endif // __cplusplus

/**
 * Version of the library that is running: 10000 major + 100 minor + patch. Compare it with the
 * header's TOILE_VERSION_MAJOR, _MINOR and _PATCH: before 1.0 a host needs the same minor version,
 * from 1.0 on the same major version.
 */
uint32_t toile_version(void);

/**
 * What went wrong in the last call of this thread that failed: what, where (panel, seam, vertex),
 * the limit and the value. Never NULL; empty before the first failure. Calls that succeed leave it.
 * Owned by the library, valid until the next call of this thread that fails, or the thread's end.
 */
const char *toile_last_error(void);

/**
 * Name of a status as in this header, "TOILE_E_HANDLE" for example. Never NULL; any number is
 * allowed. The text is constant.
 */
const char *toile_status_name(toile_status status);

/**
 * Fills a garment description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_garment_desc_init(struct toile_garment_desc *desc, size_t struct_size);

/**
 * Fills a panel description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_panel_desc_init(struct toile_panel_desc *desc, size_t struct_size);

/**
 * Fills a seam description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_seam_desc_init(struct toile_seam_desc *desc, size_t struct_size);

/**
 * Fills a grid description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_sdf_grid_desc_init(struct toile_sdf_grid_desc *desc, size_t struct_size);

/**
 * Fills a simulation description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_sim_desc_init(struct toile_sim_desc *desc, size_t struct_size);

/**
 * Fills a contact description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_contact_desc_init(struct toile_contact_desc *desc, size_t struct_size);

/**
 * Fills a drape description of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_drape_desc_init(struct toile_drape_desc *desc, size_t struct_size);

/**
 * Fills a report of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_step_report_init(struct toile_step_report *out, size_t struct_size);

/**
 * Fills energies of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_energies_init(struct toile_energies *out, size_t struct_size);

/**
 * Fills system information of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_system_info_init(struct toile_system_info *out, size_t struct_size);

/**
 * Fills changes of yarns of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_yarn_changes_init(struct toile_yarn_changes *out, size_t struct_size);

/**
 * Fills a description of a wanted region of `struct_size` bytes with defaults and its own size.
 */
toile_status toile_suggest_desc_init(struct toile_suggest_desc *desc, size_t struct_size);

/**
 * Fills a suggestion of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_suggestion_init(struct toile_suggestion *out, size_t struct_size);

/**
 * Fills a view of `struct_size` bytes with zeros and its own size.
 */
toile_status toile_view_f64_init(struct toile_view_f64 *out, size_t struct_size);

/**
 * Makes an empty garment with one fabric, a plain cotton. `desc` NULL takes the defaults. Free it
 * with toile_garment_free.
 */
toile_status toile_garment_create(const struct toile_garment_desc *desc,
                                  struct toile_garment **out);

/**
 * Reads a garment from JSON: the `garment` object of a scene file, or a GarmentCode
 * specification. `utf8` has `length` bytes. Files named inside are looked for in `base_dir` (UTF-8,
 * ends with NUL; NULL: the working directory). Free it with toile_garment_free. TOILE_E_PARSE names
 * the place in the text; TOILE_E_GEOMETRY the panel, edge or seam.
 */
toile_status toile_garment_from_json(const char *utf8,
                                     size_t length,
                                     const char *base_dir,
                                     struct toile_garment **out);

/**
 * Adds a panel. `out_panel`, which may be NULL, gets its index. TOILE_E_GEOMETRY names the edge
 * that cannot be.
 */
toile_status toile_garment_add_panel(struct toile_garment *garment,
                                     const struct toile_panel_desc *desc,
                                     uint32_t *out_panel);

/**
 * Sews two edges together. `out_seam`, which may be NULL, gets the seam's index.
 */
toile_status toile_garment_add_seam(struct toile_garment *garment,
                                    const struct toile_seam_desc *desc,
                                    uint32_t *out_seam);

/**
 * Makes every panel of this one fabric, and fabric 0 the only one. JSON: toile's own (SI units) or
 * ARCSim's measured one; what of it was not used is told by toile_garment_warnings.
 * TOILE_E_MATERIAL names the number that cannot be.
 */
toile_status toile_garment_set_fabric(struct toile_garment *garment,
                                      const char *fabric_json,
                                      size_t length);

/**
 * Adds a fabric for single panels; `out_fabric`, which may be NULL, gets its index.
 */
toile_status toile_garment_add_fabric(struct toile_garment *garment,
                                      const char *fabric_json,
                                      size_t length,
                                      uint32_t *out_fabric);

/**
 * Makes one panel of the fabric with this index.
 */
toile_status toile_garment_set_panel_fabric(struct toile_garment *garment,
                                            uint32_t panel,
                                            uint32_t fabric);

/**
 * Asks for every yarn inside a polygon of a panel: flat coordinates [m], shape [count, 2], with
 * `rings` hybrid rings around it. Takes the place of the panel's earlier region; a count of 0
 * takes it away.
 */
toile_status toile_garment_set_blend_region(struct toile_garment *garment,
                                            uint32_t panel,
                                            const double *uv,
                                            size_t count,
                                            uint32_t rings);

/**
 * Asks for every yarn in the triangles whose three corners have an `alpha` of 1, with `rings` hybrid rings around them: one number from
 * 0 to 1 for each vertex of the garment's simulation, shape [count], as toile_sim_suggest_region gives them. Values below 1 are
 * those of the rings. Takes the place of all earlier regions; 0 everywhere takes them away. The garment must not have
 * changed since in panels, seams or edge lengths. TOILE_E_ARGUMENT: another number of vertices, a value outside of 0 to 1, or
 * no triangle has three corners with 1.
 */
toile_status toile_garment_set_blend_vertices(struct toile_garment *garment,
                                              const double *alpha,
                                              size_t count,
                                              uint32_t rings);

/**
 * Takes every blend region away.
 */
toile_status toile_garment_clear_blend_region(struct toile_garment *garment);

/**
 * Frees a garment; NULL is allowed. Simulations made of it are not concerned.
 */
void toile_garment_free(struct toile_garment *garment);

/**
 * Refuses a garment that cannot be, naming panel, edge, seam or blend region, as toile_sim_create would; what only triangles and
 * laid yarns tell, such as a region that holds no triangle, is left to that.
 */
toile_status toile_garment_check(const struct toile_garment *garment);

/**
 * Number of panels.
 */
toile_status toile_garment_panel_count(const struct toile_garment *garment, uint32_t *out_count);

/**
 * Number of seams.
 */
toile_status toile_garment_seam_count(const struct toile_garment *garment, uint32_t *out_count);

/**
 * Index of the panel of this name (UTF-8, ends with NUL). TOILE_E_ARGUMENT if there is none.
 */
toile_status toile_garment_panel_index(const struct toile_garment *garment,
                                       const char *name,
                                       uint32_t *out_panel);

/**
 * Name of a panel, UTF-8. `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
 */
toile_status toile_garment_panel_name(const struct toile_garment *garment,
                                      uint32_t panel,
                                      char *out,
                                      size_t capacity,
                                      size_t *needed);

/**
 * What the garment's and its fabrics' files contained that is not used: lines of UTF-8 text, empty for nothing.
 * `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
 */
toile_status toile_garment_warnings(const struct toile_garment *garment,
                                    char *out,
                                    size_t capacity,
                                    size_t *needed);

/**
 * The garment as JSON that toile_garment_from_json reads back, UTF-8. `needed` gets the bytes, the
 * final NUL included; `out` NULL asks for it; a smaller `capacity` is TOILE_E_SIZE.
 */
toile_status toile_garment_to_json(const struct toile_garment *garment,
                                   char *out,
                                   size_t capacity,
                                   size_t *needed);

/**
 * The flat pattern as SVG at full size, with this seam allowance [m] around every panel; 0 for
 * none. `needed` gets the bytes, the final NUL included; `out` NULL asks for it.
 */
toile_status toile_garment_to_svg(const struct toile_garment *garment,
                                  double seam_allowance,
                                  char *out,
                                  size_t capacity,
                                  size_t *needed);

/**
 * A sphere around its origin, radius [m]. Free it with toile_body_free; simulations that use a body
 * keep what they need.
 */
toile_status toile_body_sphere(double radius, struct toile_body **out);

/**
 * A capsule along its y axis: the points within `radius` [m] of the segment from -half_length to
 * half_length [m].
 */
toile_status toile_body_capsule(double half_length, double radius, struct toile_body **out);

/**
 * The half space where normal . x <= offset; the normal has any length but 0, and offset is in
 * metres when it has length 1.
 */
toile_status toile_body_plane(const double normal[3], double offset, struct toile_body **out);

/**
 * A body from signed distances on a regular grid.
 */
toile_status toile_body_grid(const struct toile_sdf_grid_desc *desc, struct toile_body **out);

/**
 * A body from a closed triangle mesh: positions [m], shape [vertex_count, 3]; triangles, shape
 * [triangle_count, 3], counter-clockwise seen from outside. The field is sampled every `cell_size`
 * [m] near the surface, at most a quarter of the body's least extent; 0 chooses. TOILE_E_GEOMETRY names what is
 * wrong with the mesh.
 */
toile_status toile_body_mesh(const double *positions,
                             size_t vertex_count,
                             const uint32_t *triangles,
                             size_t triangle_count,
                             double cell_size,
                             struct toile_body **out);

/**
 * A body from a Wavefront OBJ file (path UTF-8, ends with NUL). `scale` multiplies its coordinates
 * into metres: 0.01 for a file in centimetres. `cell_size` as in toile_body_mesh.
 */
toile_status toile_body_obj(const char *path,
                            double scale,
                            double cell_size,
                            struct toile_body **out);

/**
 * Signed distance [m] of a point [m] in the body's own frame, and its gradient; either of
 * `out_distance` and `out_gradient` may be NULL. Far from the surface the distance is a bound with
 * the right sign.
 */
toile_status toile_body_distance(const struct toile_body *body,
                                 const double point[3],
                                 double *out_distance,
                                 double out_gradient[3]);

/**
 * Frees a body; NULL is allowed. Simulations that use it are not concerned.
 */
void toile_body_free(struct toile_body *body);

/**
 * Triangulates a garment and makes it ready to move; its vertices stand where the panels are
 * placed. `desc` NULL takes the defaults. The garment may be changed or freed afterwards. Free the
 * simulation with toile_sim_free. TOILE_E_GEOMETRY and TOILE_E_LIMIT name the panel;
 * TOILE_E_ARGUMENT: a blend region holds no triangle, its fabric has no yarns, or it has more than 3 hybrid
 * rings; TOILE_E_UNSUPPORTED: regions have different numbers of rings.
 */
toile_status toile_sim_create(const struct toile_garment *garment,
                              const struct toile_sim_desc *desc,
                              struct toile_sim **out);

/**
 * Makes a simulation from a scene file: garment, bodies, pins, numbers. `utf8` has `length` bytes;
 * files named inside are looked for in `base_dir` (UTF-8, ends with NUL; NULL: the working
 * directory). Bodies and pins stand where the file has them at its start; motions and the length of
 * the run are the host's to play. Free it with toile_sim_free. TOILE_E_PARSE names the key.
 */
toile_status toile_sim_from_scene(const char *utf8,
                                  size_t length,
                                  const char *base_dir,
                                  struct toile_sim **out);

/**
 * The garment that the simulation was made of, with its present regions of yarns, as a new handle; free it with toile_garment_free.
 */
toile_status toile_sim_garment(const struct toile_sim *sim,
                               struct toile_garment **out);

/**
 * Puts a body into the world, at the origin until it gets a pose. `contact` NULL takes the
 * defaults; `out_body`, which may be NULL, gets the body's number. The body may be freed afterwards.
 */
toile_status toile_sim_set_body_sdf(struct toile_sim *sim,
                                    const struct toile_body *body,
                                    const struct toile_contact_desc *contact,
                                    uint32_t *out_body);

/**
 * Says where a body is to be at the end of the next step: position [m] of its origin, within 1e6, and rotation
 * x, y, z, w. The cloth feels the velocity that follows. Before the first step or drape it is a
 * placement: the body stands there at once and has no velocity. A drape takes the body to its pose, and
 * cloth that rests on it goes along.
 */
toile_status toile_sim_set_body_pose(struct toile_sim *sim,
                                     uint32_t body,
                                     const double position[3],
                                     const double quaternion_xyzw[4]);

/**
 * Says where the vertices of a mesh body are to be at the end of the next step, in the body's
 * frame [m], within 1e6, shape [vertex_count, 3]. `vertex_count` must be the body's. The cloth feels the
 * velocities that follow; before the first step or drape it is a placement, as with a pose.
 */
toile_status toile_sim_set_body_vertices(struct toile_sim *sim,
                                         uint32_t body,
                                         const double *positions,
                                         size_t vertex_count);

/**
 * Holds vertices: [count] numbers, targets [m], within 1e6, shape [count, 3], reached at the end of the next
 * step. `targets` NULL holds them where they are. A vertex that is held already gets the new
 * target.
 */
toile_status toile_sim_pin(struct toile_sim *sim,
                           const uint32_t *vertices,
                           size_t count,
                           const double *targets);

/**
 * Lets vertices go. TOILE_E_ARGUMENT names one that is not held.
 */
toile_status toile_sim_unpin(struct toile_sim *sim, const uint32_t *vertices, size_t count);

/**
 * Sets a tunable number by its dotted name, the same as in scene files:
 * "solver.newton.max_iterations", "gravity.x", "wind.z", "pressure". TOILE_E_ARGUMENT names the
 * range. `toile schema` prints every name with its unit, range and meaning.
 */
toile_status toile_sim_set_number(struct toile_sim *sim, const char *name, double value);

/**
 * Reads what toile_sim_set_number sets.
 */
toile_status toile_sim_number(const struct toile_sim *sim, const char *name, double *out);

/**
 * Sets the acceleration of gravity [m/s^2], each component within 1e6.
 */
toile_status toile_sim_set_gravity(struct toile_sim *sim, const double gravity[3]);

/**
 * Sets the velocity of the air [m/s], each component within 1e6.
 */
toile_status toile_sim_set_wind(struct toile_sim *sim, const double wind[3]);

/**
 * Puts every vertex somewhere: positions [m] and velocities [m/s] within 1e6, shape [vertex_count, 3];
 * `velocities` NULL is at rest. `vertex_count` must be the simulation's.
 */
toile_status toile_sim_set_positions(struct toile_sim *sim,
                                     const double *positions,
                                     const double *velocities,
                                     size_t vertex_count);

/**
 * The state as bytes: everything that the next step depends on. `needed` gets the number of bytes;
 * `out` NULL asks for it.
 */
toile_status toile_sim_save(const struct toile_sim *sim,
                            uint8_t *out,
                            size_t capacity,
                            size_t *needed);

/**
 * Restores what toile_sim_save wrote, of a simulation made of the same garment with the same
 * bodies, in this process or another. The simulation then goes on bit by bit as the saved one did.
 * TOILE_E_PARSE and TOILE_E_STATE say what does not fit.
 */
toile_status toile_sim_restore(struct toile_sim *sim, const uint8_t *bytes, size_t count);

/**
 * Frees a simulation; NULL is allowed. Views of it end.
 */
void toile_sim_free(struct toile_sim *sim);

/**
 * Advances by exactly `dt` [s], in smaller steps inside where needed, or fails and leaves the
 * simulation as it was. `report` may be NULL. Stopped by the simulation's progress callback it is
 * TOILE_OK, has advanced by 0 and leaves everything as it was. TOILE_E_NO_ADMISSIBLE_STATE: pins or
 * bodies ask for what cannot be; a shorter step may pass. `dt` is at most 1e6; no step inside is longer than
 * the number "solver.step.max" (0.05 s), so a long one takes as long as many.
 */
toile_status toile_sim_step(struct toile_sim *sim,
                            double dt,
                            struct toile_step_report *report);

/**
 * Sews the garment and lets it come to rest. `desc` NULL takes the defaults; `report` may be NULL.
 * Stopped by the iteration limit, by the progress callback, in a dead end, or because nothing holds
 * the garment, it is TOILE_OK too, with the outcome in the report, and may be called again to go
 * on.
 */
toile_status toile_sim_drape(struct toile_sim *sim,
                             const struct toile_drape_desc *desc,
                             struct toile_step_report *report);

/**
 * The report of the present state without advancing it: counts 0; the outcome is converged if it is
 * at rest to the force tolerance of a drape, else iteration limit; residual, strain, gaps and
 * energies as they are.
 */
toile_status toile_sim_report(const struct toile_sim *sim, struct toile_step_report *report);

/**
 * A number that changes exactly when views end: with each call that changes the simulation. 0 for
 * a handle that is none; the last error tells.
 */
uint64_t toile_sim_epoch(const struct toile_sim *sim);

/**
 * Simulated time [s]. NaN for a handle that is none; the last error tells.
 */
double toile_sim_time(const struct toile_sim *sim);

/**
 * Number of vertices.
 */
toile_status toile_sim_vertex_count(const struct toile_sim *sim, uint32_t *out_count);

/**
 * Number of triangles.
 */
toile_status toile_sim_triangle_count(const struct toile_sim *sim, uint32_t *out_count);

/**
 * Number of bodies; they are numbered from 0 in the order in which they came.
 */
toile_status toile_sim_body_count(const struct toile_sim *sim, uint32_t *out_count);

/**
 * Positions of the vertices [m], shape [vertex_count, 3]. `needed` gets the count of numbers;
 * `out` NULL asks for it; a smaller `capacity` is TOILE_E_SIZE.
 */
toile_status toile_sim_positions(const struct toile_sim *sim,
                                 double *out,
                                 size_t capacity,
                                 size_t *needed);

/**
 * Velocities of the vertices [m/s], shape [vertex_count, 3]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_velocities(const struct toile_sim *sim,
                                  double *out,
                                  size_t capacity,
                                  size_t *needed);

/**
 * Unit normals at the vertices, pointing to the outside of the cloth, shape [vertex_count, 3];
 * sizes as in toile_sim_positions.
 */
toile_status toile_sim_normals(const struct toile_sim *sim,
                               double *out,
                               size_t capacity,
                               size_t *needed);

/**
 * Panel of each vertex, shape [vertex_count]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_vertex_panels(const struct toile_sim *sim,
                                     uint32_t *out,
                                     size_t capacity,
                                     size_t *needed);

/**
 * Flat coordinates of each vertex in its panel [m], shape [vertex_count, 2]; sizes as in
 * toile_sim_positions.
 */
toile_status toile_sim_vertex_uv(const struct toile_sim *sim,
                                 double *out,
                                 size_t capacity,
                                 size_t *needed);

/**
 * 1 for each vertex that moves by itself, 0 for one that follows the yarns above it, shape
 * [vertex_count]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_vertex_active(const struct toile_sim *sim,
                                     uint8_t *out,
                                     size_t capacity,
                                     size_t *needed);

/**
 * Vertices of each triangle, counter-clockwise seen from the outside of the cloth, shape
 * [triangle_count, 3]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_triangles(const struct toile_sim *sim,
                                 uint32_t *out,
                                 size_t capacity,
                                 size_t *needed);

/**
 * Positions of the vertices [m] where they lie, shape [vertex_count, 3].
 */
toile_status toile_sim_positions_view(const struct toile_sim *sim, struct toile_view_f64 *out);

/**
 * Velocities of the vertices [m/s] where they lie, shape [vertex_count, 3].
 */
toile_status toile_sim_velocities_view(const struct toile_sim *sim, struct toile_view_f64 *out);

/**
 * Vertex of a panel nearest to a point of it, in flat coordinates [m].
 */
toile_status toile_sim_locate(const struct toile_sim *sim,
                              uint32_t panel,
                              const double uv[2],
                              uint32_t *out_vertex);

/**
 * Force [N] and torque [N m] of the cloth on a body at the end of the last step, about the body's
 * own origin, in world axes. Either may be NULL.
 */
toile_status toile_sim_body_wrench(const struct toile_sim *sim,
                                   uint32_t body,
                                   double force[3],
                                   double torque[3]);

/**
 * A body's surface as it stands in the world now, to draw it: positions [m], shape [count, 3];
 * sizes as in toile_sim_positions. A plane gives a square.
 */
toile_status toile_sim_body_positions(const struct toile_sim *sim,
                                      uint32_t body,
                                      double *out,
                                      size_t capacity,
                                      size_t *needed);

/**
 * Triangles of that surface, shape [count, 3]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_body_triangles(const struct toile_sim *sim,
                                      uint32_t body,
                                      uint32_t *out,
                                      size_t capacity,
                                      size_t *needed);

/**
 * Energies of the present state [J].
 */
toile_status toile_sim_energies(const struct toile_sim *sim, struct toile_energies *out);

/**
 * What was built and what it costs.
 */
toile_status toile_sim_info(const struct toile_sim *sim, struct toile_system_info *out);

/**
 * Name of the linear solver in use, UTF-8. `needed` gets the bytes, the final NUL included; `out`
 * NULL asks for it.
 */
toile_status toile_sim_backend(const struct toile_sim *sim,
                               char *out,
                               size_t capacity,
                               size_t *needed);

/**
 * World positions of the yarns' nodes [m], shape [node_count, 3]; sizes as in toile_sim_positions.
 * Empty in a garment of triangles alone.
 *
 * Nodes keep their numbers. Where yarns come out of contacts (toile_sim_yarn_changes tells) new nodes are counted
 * on at the end, and nodes that no yarn passes any more stay where they were; the sizes of this and of the
 * arrays below change then.
 */
toile_status toile_sim_yarn_nodes(const struct toile_sim *sim,
                                  double *out,
                                  size_t capacity,
                                  size_t *needed);

/**
 * Where the nodes of each yarn begin in toile_sim_yarn_indices, shape [yarn_count + 1]; the last
 * number is the length of that array; sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_offsets(const struct toile_sim *sim,
                                    uint32_t *out,
                                    size_t capacity,
                                    size_t *needed);

/**
 * Nodes of the yarns, yarn after yarn; sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_indices(const struct toile_sim *sim,
                                    uint32_t *out,
                                    size_t capacity,
                                    size_t *needed);

/**
 * Arc length at rest of each yarn at its nodes [m], in the order of toile_sim_yarn_indices; it
 * changes where yarns slide. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_coordinates(const struct toile_sim *sim,
                                        double *out,
                                        size_t capacity,
                                        size_t *needed);

/**
 * Tension of each yarn between a node and the next along it [N], negative where it is compressed,
 * in the order of toile_sim_yarn_indices with 0 at the last node of a yarn. Sizes as in
 * toile_sim_positions.
 */
toile_status toile_sim_yarn_tensions(const struct toile_sim *sim,
                                     double *out,
                                     size_t capacity,
                                     size_t *needed);

/**
 * Largest normal force between two yarns at each node [N], shape [node_count], of the last step or
 * drape. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_compressions(const struct toile_sim *sim,
                                         double *out,
                                         size_t capacity,
                                         size_t *needed);

/**
 * How far each yarn has slid through its nodes since it was laid [m], in the order of
 * toile_sim_yarn_indices. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_slips(const struct toile_sim *sim,
                                  double *out,
                                  size_t capacity,
                                  size_t *needed);

/**
 * 1 for each node that moves by itself, 0 for one that the triangles around a region of yarns carry,
 * shape [node_count]; sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_active(const struct toile_sim *sim,
                                   uint8_t *out,
                                   size_t capacity,
                                   size_t *needed);

/**
 * Force on each node of the yarns and of what acts on them [N], shape [node_count, 3]: on a node that is held
 * what its holder bears. Inertia is no part of it. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_forces(const struct toile_sim *sim,
                                   double *out,
                                   size_t capacity,
                                   size_t *needed);

/**
 * Radius of each yarn [m], shape [yarn_count]. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_radii(const struct toile_sim *sim,
                                  double *out,
                                  size_t capacity,
                                  size_t *needed);

/**
 * Fabric of each yarn, counted as in the garment, shape [yarn_count]; rods along seams have the coarser of their two
 * sides. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_fabrics(const struct toile_sim *sim,
                                    uint32_t *out,
                                    size_t capacity,
                                    size_t *needed);

/**
 * Panel in which each yarn was laid, shape [yarn_count]; rods along seams lie in one of the two. Sizes as in
 * toile_sim_positions.
 */
toile_status toile_sim_yarn_panels(const struct toile_sim *sim,
                                   uint32_t *out,
                                   size_t capacity,
                                   size_t *needed);

/**
 * Where each node was laid in its panel, flat coordinates [m], shape [node_count, 2]. Sizes as in
 * toile_sim_positions.
 */
toile_status toile_sim_yarn_uv(const struct toile_sim *sim,
                               double *out,
                               size_t capacity,
                               size_t *needed);

/**
 * Where the points of each yarn begin in toile_sim_yarn_curves of the same `samples`, shape [yarn_count + 1]; the last
 * number is the number of points. It changes when the epoch of toile_sim_yarn_changes does. Sizes as in toile_sim_positions.
 */
toile_status toile_sim_yarn_curve_offsets(const struct toile_sim *sim,
                                          uint32_t samples,
                                          uint32_t *out,
                                          size_t capacity,
                                          size_t *needed);

/**
 * Yarns as they are drawn: points of smooth centre lines, `samples` pieces (1 to 64) between two nodes, which run beside each
 * other where yarns cross [m], shape [point_count, 3], yarn after yarn; a tube of toile_sim_yarn_radii around each is the
 * yarn. Sizes as in toile_sim_positions; asking for the number makes no points.
 */
toile_status toile_sim_yarn_curves(const struct toile_sim *sim,
                                   uint32_t samples,
                                   double *out,
                                   size_t capacity,
                                   size_t *needed);

/**
 * Nodes of the border of a panel's yarns along one of its edges, rising: those on the edge, or with none before them
 * where a piece lies away from it, as a pin with `edge` in a scene holds them. Empty where no yarns are simulated. Sizes as
 * in toile_sim_positions. TOILE_E_ARGUMENT names a panel or an edge that does not exist.
 */
toile_status toile_sim_yarn_nodes_along(const struct toile_sim *sim,
                                        uint32_t panel,
                                        uint32_t edge,
                                        uint32_t *out,
                                        size_t capacity,
                                        size_t *needed);

/**
 * What has changed since the yarns were laid: contacts that yarns came out of. `epoch` grows with every step, drape,
 * restored state or change of regions that changes it.
 */
toile_status toile_sim_yarn_changes(const struct toile_sim *sim,
                                    struct toile_yarn_changes *out);

/**
 * Node of a panel's yarns that was laid nearest to a point of the panel, in flat coordinates [m].
 * TOILE_E_ARGUMENT: the panel is not simulated as yarns.
 */
toile_status toile_sim_locate_yarn_node(const struct toile_sim *sim,
                                        uint32_t panel,
                                        const double uv[2],
                                        uint32_t *out_node);

/**
 * Node at the first (0) or the last (1) end of a yarn. TOILE_E_ARGUMENT names a yarn that does not exist.
 */
toile_status toile_sim_yarn_end(const struct toile_sim *sim,
                                uint32_t yarn,
                                uint32_t end,
                                uint32_t *out_node);

/**
 * Holds nodes of yarns, as toile_sim_pin holds vertices; yarns do not slide where they are held,
 * and no contact comes off there. A yarn is held whole by all of its nodes. TOILE_E_ARGUMENT names a node that does
 * not exist, or that no yarn passes any more.
 */
toile_status toile_sim_pin_yarn_nodes(struct toile_sim *sim,
                                      const uint32_t *nodes,
                                      size_t count,
                                      const double *targets);

/**
 * Lets nodes of yarns go. TOILE_E_ARGUMENT names one that is not held.
 */
toile_status toile_sim_unpin_yarn_nodes(struct toile_sim *sim, const uint32_t *nodes, size_t count);

/**
 * Suggests the region in which yarns would change the answer, from the present state of triangles alone, for a
 * tolerance, a budget of nodes, or both: `alpha` of each vertex, shape [vertex_count], 1 where yarns are wanted, falling to 0 over
 * the rings, 0 elsewhere; all 0 where triangles do. toile_garment_set_blend_vertices takes it. `out`, which may be NULL, gets what
 * the region leaves and costs. Sizes as in toile_sim_positions; `alpha` NULL asks for the number and for `out`.
 * TOILE_E_ARGUMENT: neither tolerance nor budget, every criterion left out, or no fabric has yarns; TOILE_E_UNSUPPORTED: the
 * simulation has yarns already, so that its state is not that of triangles. Ask one of the same garment without blend regions, or take
 * them away with toile_sim_set_blend_vertices and let the triangles go on first.
 */
toile_status toile_sim_suggest_region(const struct toile_sim *sim,
                                      const struct toile_suggest_desc *desc,
                                      double *alpha,
                                      size_t capacity,
                                      size_t *needed,
                                      struct toile_suggestion *out);

/**
 * Estimated error of the triangles at each vertex, shape [vertex_count], in the present state: that of the deformation's gradient,
 * without a unit; 0 where the fabric has no yarns. Sizes as in toile_sim_positions. TOILE_E_UNSUPPORTED: the simulation has yarns.
 */
toile_status toile_sim_vertex_errors(const struct toile_sim *sim,
                                     double *out,
                                     size_t capacity,
                                     size_t *needed);

/**
 * What the error of each vertex is made of, shape [vertex_count, TOILE_CRITERION_COUNT]: the estimate by each criterion, in the order of
 * TOILE_CRITERION_...; the error is the root of the sum of their squares. Otherwise as toile_sim_vertex_errors.
 */
toile_status toile_sim_vertex_criteria(const struct toile_sim *sim,
                                       double *out,
                                       size_t capacity,
                                       size_t *needed);

/**
 * Moves the region of a panel in which every yarn is simulated, with the state carried over: a polygon in flat coordinates [m],
 * shape [count, 2], with `rings` hybrid rings around it, in the place of the panel's earlier regions; a count of 0 takes them away.
 * Yarns that come in lie in the triangles as these are and move with them; vertices stay where they are. The arrays of yarns
 * change their sizes and numbers, the epoch of toile_sim_yarn_changes grows; states that were saved under other regions are refused.
 * Where held vertices begin to follow yarns, the nodes on their edges and beside them are held in their place, as far from their
 * targets as these were; where yarns go, the vertices beside held nodes are. What toile_sim_create refuses is refused; TOILE_E_STATE: nothing
 * can take a pin's place, or the region leaves out where yarns have come out of contacts.
 */
toile_status toile_sim_set_blend_region(struct toile_sim *sim,
                                        uint32_t panel,
                                        const double *uv,
                                        size_t count,
                                        uint32_t rings);

/**
 * Moves all regions at once, with the state carried over: yarns are simulated in the triangles whose three corners have an `alpha` of 1,
 * with `rings` hybrid rings around them. One number from 0 to 1 for each vertex, shape [count], as toile_sim_suggest_region gives
 * them; values below 1 are those of the rings, 0 everywhere takes all yarns away. Otherwise as toile_sim_set_blend_region, and
 * TOILE_E_ARGUMENT as in toile_garment_set_blend_vertices.
 */
toile_status toile_sim_set_blend_vertices(struct toile_sim *sim,
                                          const double *alpha,
                                          size_t count,
                                          uint32_t rings);

/**
 * Positions of the vertices [m] as they are now, shape [vertex_count, 3], kept as they are until
 * toile_array_free, whatever happens to the simulation. No copy is made now; the next call that
 * changes the simulation makes one if the array is still there.
 */
toile_status toile_sim_positions_array(const struct toile_sim *sim, struct toile_array **out);

/**
 * Velocities of the vertices [m/s], shape [vertex_count, 3], kept like toile_sim_positions_array.
 */
toile_status toile_sim_velocities_array(const struct toile_sim *sim, struct toile_array **out);

/**
 * Where the numbers of an array lie. They are there, and the same, until toile_array_free.
 */
toile_status toile_array_view(const struct toile_array *array, struct toile_view_f64 *out);

/**
 * Frees an array; NULL is allowed.
 */
void toile_array_free(struct toile_array *array);

#ifdef __cplusplus
}  // extern "C"
#endif  // __cplusplus

#endif  /* TOILE_H */
