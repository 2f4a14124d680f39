/* A tunic of triangles is draped; then a region around a side seam, down to the hem, is given to
 * yarns, and the two kinds move on as one cloth.
 *
 * The laws at the end: the seams stay shut and no cloth gets inside the body, the body bears what it bore, the hem stays
 * where it was, and yarns that cross the border carry load. */
#include <math.h>
#include <string.h>

#include "check.h"

/*   5---4   3---2     edges: 0 hem (0-1), 1 right side (1-2), 2 right shoulder (2-3),
 *   |    \_/    |            3 neck (3-4), 4 left shoulder (4-5), 5 left side (5-0)
 *   0-----------1 */
static const double corners[] = {-0.22, 0,   0.22,  0,   0.22,  0.5,
                                 0.08,  0.5, -0.08, 0.5, -0.22, 0.5};

/* a weave of thick yarns, 10 mm apart, and the membrane and bending that they make */
static const char fabric[] =
    "{\"name\": \"weave\", \"density\": 0.25,"
    " \"membrane\": {\"warp\": 754, \"weft\": 754, \"shear\": 40, \"coupling\": 0},"
    " \"bending\": {\"warp\": 1e-5, \"weft\": 1e-5},"
    " \"yarns\": {\"weave\": \"plain\", \"warp_pitch\": 0.01, \"radius\": 0.002, \"young\": 6e5,"
    " \"shear\": 25000, \"bending\": 0.00796, \"density\": 1.25e-3}}";

static uint32_t add_panel(toile_garment *garment, const char *name, double z, int turned) {
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.name = name;
    panel.vertices = corners;
    panel.vertex_count = 6;
    panel.position[1] = -0.03;
    panel.position[2] = z;
    if (turned) { /* half a turn about y: the outside looks along -z */
        panel.quaternion_xyzw[1] = 1;
        panel.quaternion_xyzw[3] = 0;
    }
    uint32_t index = TOILE_NONE;
    CALL(toile_garment_add_panel(garment, &panel, &index));
    return index;
}

static void sew(toile_garment *garment, uint32_t a, uint32_t edge_a, uint32_t b, uint32_t edge_b) {
    toile_seam_desc seam;
    CALL(toile_seam_desc_init(&seam, sizeof seam));
    seam.panel_a = a;
    seam.edge_a = edge_a;
    seam.panel_b = b;
    seam.edge_b = edge_b;
    CALL(toile_garment_add_seam(garment, &seam, NULL));
}

/* the tunic on its capsule, as placed */
static toile_sim *tunic(int mixed) {
    toile_garment_desc desc;
    CALL(toile_garment_desc_init(&desc, sizeof desc));
    desc.name = "tunic";
    desc.edge_length = 0.04;
    toile_garment *garment = NULL;
    CALL(toile_garment_create(&desc, &garment));
    uint32_t front = add_panel(garment, "front", 0.16, 0);
    uint32_t back = add_panel(garment, "back", -0.16, 1);
    uint32_t number;
    CALL(toile_garment_add_fabric(garment, fabric, strlen(fabric), &number));
    CALL(toile_garment_set_panel_fabric(garment, front, number));
    CALL(toile_garment_set_panel_fabric(garment, back, number));
    /* what is right on the front is left on the back */
    sew(garment, front, 1, back, 5);
    sew(garment, front, 5, back, 1);
    sew(garment, front, 2, back, 4);
    sew(garment, front, 4, back, 2);
    if (mixed) {
        const double right[] = {0.1, -0.1, 0.3, -0.1, 0.3, 0.2, 0.1, 0.2};
        const double left[] = {-0.3, -0.1, -0.1, -0.1, -0.1, 0.2, -0.3, 0.2};
        CALL(toile_garment_set_blend_region(garment, front, right, 4, 0));
        CALL(toile_garment_set_blend_region(garment, back, left, 4, 0));
    }
    toile_body *body = NULL;
    CALL(toile_body_capsule(0.3, 0.12, &body));
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    CALL(toile_sim_set_body_sdf(sim, body, NULL, NULL));
    CALL(toile_sim_set_number(sim, "solver.newton.relative_tolerance", 1e-2));
    CALL(toile_sim_set_number(sim, "yarn.sliding", 0));
    toile_body_free(body);
    toile_garment_free(garment);
    return sim;
}

static double hem(const toile_sim *sim) {
    toile_view_f64 view;
    CALL(toile_view_f64_init(&view, sizeof view));
    CALL(toile_sim_positions_view(sim, &view));
    double lowest = INFINITY;
    for (uint64_t i = 0; i < view.count; ++i) {
        lowest = fmin(lowest, view.data[3 * i + 1]);
    }
    return lowest;
}

/* the largest tension of a yarn between a node of the region and one that triangles carry */
static double tension_across(const toile_sim *sim) {
    size_t count = 0, nodes = 0;
    CALL(toile_sim_yarn_tensions(sim, NULL, 0, &count));
    CALL(toile_sim_yarn_active(sim, NULL, 0, &nodes));
    double *tension = malloc(count * sizeof *tension);
    uint32_t *index = malloc(count * sizeof *index);
    uint8_t *active = malloc(nodes);
    CALL(toile_sim_yarn_tensions(sim, tension, count, &count));
    CALL(toile_sim_yarn_indices(sim, index, count, &count));
    CALL(toile_sim_yarn_active(sim, active, nodes, &nodes));
    double largest = 0;
    for (size_t i = 0; i + 1 < count; ++i) {
        if (tension[i] != 0 && active[index[i]] != active[index[i + 1]]) {
            largest = fmax(largest, tension[i]);
        }
    }
    free(tension);
    free(index);
    free(active);
    return largest;
}

int main(void) {
    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    double force[3], torque[3];
    toile_sim *triangles = tunic(0), *mixed = tunic(1);
    CALL(toile_sim_drape(triangles, NULL, &report));
    HOLDS(report.outcome == TOILE_OUTCOME_CONVERGED && report.max_seam_gap < 1e-3);
    CALL(toile_sim_body_wrench(triangles, 0, force, torque));
    const double weight = -force[1], height = hem(triangles);
    printf("triangles: weight %.3f N, hem at %.4f m\n", weight, height);

    /* the two have the same vertices; yarns begin where the triangles lie */
    toile_view_f64 view;
    CALL(toile_view_f64_init(&view, sizeof view));
    CALL(toile_sim_positions_view(triangles, &view));
    CALL(toile_sim_set_positions(mixed, view.data, NULL, view.count));
    toile_sim_free(triangles);
    toile_system_info info;
    CALL(toile_system_info_init(&info, sizeof info));
    CALL(toile_sim_info(mixed, &info));
    printf("mixed: %d of %d triangles, %d yarn nodes, %d of them carried, %d unknowns\n",
           (int)info.active_triangles, (int)info.triangles, (int)info.yarn_nodes,
           (int)info.carried_nodes, (int)info.unknowns);
    HOLDS(info.active_triangles < info.triangles && info.carried_nodes > 0);
    double borne = 0;
    for (int i = 0; i < 12; ++i) {
        CALL(toile_sim_step(mixed, 0.01, &report));
        HOLDS(report.min_gap > -1e-3 && report.max_seam_gap < 2e-3);
        CALL(toile_sim_body_wrench(mixed, 0, force, torque));
        borne -= i < 6 ? 0 : force[1] / 6;
    }
    printf("mixed: weight %.3f N, hem at %.4f m, tension across the border %.2f mN\n", borne,
           hem(mixed), 1e3 * tension_across(mixed));
    HOLDS(fabs(borne / weight - 1) < 0.05);
    HOLDS(fabs(hem(mixed) - height) < 0.005);
    HOLDS(tension_across(mixed) > 0);
    toile_sim_free(mixed);
    return 0;
}
