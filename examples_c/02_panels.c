/* A tunic of two panels, built in code, sewn round a capsule and draped to rest.
 *
 * The laws at the end: the seams are shut, no vertex is inside the body, and the tunic hangs on
 * the capsule's top instead of falling off. */
#include <math.h>

#include "check.h"

/*   5---4   3---2     edges: 0 hem (0-1), 1 right side (1-2), 2 right shoulder (2-3),
 *   |    \_/    |            3 neck (3-4, a curve), 4 left shoulder (4-5), 5 left side (5-0)
 *   0-----------1 */
static const double corners[] = {-0.22, 0,   0.22,  0,   0.22,  0.5,
                                 0.08,  0.5, -0.08, 0.5, -0.22, 0.5};
static const uint32_t edges[] = {0, 1, 1, 2, 2, 3, 3, 4, 4, 5, 5, 0};
static const uint32_t kinds[] = {TOILE_EDGE_LINE,      TOILE_EDGE_LINE, TOILE_EDGE_LINE,
                                 TOILE_EDGE_QUADRATIC, TOILE_EDGE_LINE, TOILE_EDGE_LINE};
static const double controls[6][4] = {{0}, {0}, {0}, {0, 0.44, 0, 0}, {0}, {0}};

static uint32_t add_panel(toile_garment *garment, const char *name, double z, int turned) {
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.name = name;
    panel.vertices = corners;
    panel.vertex_count = 6;
    panel.edges = edges;
    panel.edge_count = 6;
    panel.edge_kinds = kinds;
    panel.edge_controls = &controls[0][0];
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

int main(void) {
    toile_garment_desc garment_desc;
    CALL(toile_garment_desc_init(&garment_desc, sizeof garment_desc));
    garment_desc.name = "tunic";
    garment_desc.edge_length = 0.045;
    toile_garment *garment = NULL;
    CALL(toile_garment_create(&garment_desc, &garment));
    uint32_t front = add_panel(garment, "front", 0.16, 0);
    uint32_t back = add_panel(garment, "back", -0.16, 1);
    /* what is right on the front is left on the back */
    sew(garment, front, 1, back, 5);
    sew(garment, front, 5, back, 1);
    sew(garment, front, 2, back, 4);
    sew(garment, front, 4, back, 2);

    toile_body *body = NULL;
    CALL(toile_body_capsule(0.3, 0.12, &body));
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    CALL(toile_sim_set_body_sdf(sim, body, NULL, NULL));
    toile_body_free(body);
    toile_garment_free(garment);

    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    CALL(toile_sim_drape(sim, NULL, &report));

    toile_view_f64 view;
    CALL(toile_view_f64_init(&view, sizeof view));
    CALL(toile_sim_positions_view(sim, &view));
    double lowest = INFINITY, highest = -INFINITY;
    for (uint64_t i = 0; i < view.count; ++i) {
        lowest = fmin(lowest, view.data[3 * i + 1]);
        highest = fmax(highest, view.data[3 * i + 1]);
    }
    printf("%llu vertices, outcome %u, residual %.2e N\n", (unsigned long long)view.count,
           (unsigned)report.outcome, report.residual);
    printf("largest seam gap %.3f mm, smallest gap to the body %.3f mm\n",
           1e3 * report.max_seam_gap, 1e3 * report.min_gap);
    printf("from %.3f m to %.3f m\n", lowest, highest);
    HOLDS(report.max_seam_gap < 2e-3);
    HOLDS(report.min_gap > -1e-3);
    HOLDS(highest > 0.30 && highest < 0.47); /* the capsule's top is at 0.42 */
    HOLDS(lowest > -0.25);
    toile_sim_free(sim);
    return 0;
}
