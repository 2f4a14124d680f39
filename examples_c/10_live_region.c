/* A cloth is laid over a ball by triangles. Where yarns would change the answer they come in while the simulation lives,
 * move on with it, and go again.
 *
 * The laws at the end: no vertex jumps when yarns come or go, the ball bears what it bore, and a state that was saved before is
 * refused until the yarns are gone. */
#include <math.h>
#include <string.h>

#include "check.h"

static const double corners[] = {-0.15, -0.15, 0.15, -0.15, 0.15, 0.15, -0.15, 0.15};

/* a weave of thick yarns, 6 mm apart, and the membrane and bending that they make */
static const char fabric[] =
    "{\"name\": \"weave\", \"density\": 0.25, \"friction\": 0.4,"
    " \"membrane\": {\"warp\": 754, \"weft\": 754, \"shear\": 40, \"coupling\": 0},"
    " \"bending\": {\"warp\": 6e-6, \"weft\": 6e-6},"
    " \"yarns\": {\"weave\": \"plain\", \"warp_pitch\": 0.006, \"radius\": 0.0012, \"young\": 1e6,"
    " \"shear\": 41667, \"bending\": 0.00796, \"density\": 7.5e-4}}";

/* a level cloth above a ball */
static toile_sim *cloth(void) {
    toile_garment_desc desc;
    CALL(toile_garment_desc_init(&desc, sizeof desc));
    desc.edge_length = 0.025;
    toile_garment *garment = NULL;
    CALL(toile_garment_create(&desc, &garment));
    CALL(toile_garment_set_fabric(garment, fabric, strlen(fabric)));
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.position[1] = 0.105;
    panel.quaternion_xyzw[0] = -sqrt(0.5);
    panel.quaternion_xyzw[3] = sqrt(0.5);
    CALL(toile_garment_add_panel(garment, &panel, NULL));
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    toile_body *ball = NULL;
    CALL(toile_body_sphere(0.1, &ball));
    CALL(toile_sim_set_body_sdf(sim, ball, NULL, NULL));
    CALL(toile_sim_set_number(sim, "yarn.sliding", 0));
    toile_body_free(ball);
    toile_garment_free(garment);
    return sim;
}

/* weight on the ball, mean of the later half of so many steps [N] */
static double borne(toile_sim *sim, int steps) {
    double sum = 0, force[3], torque[3];
    for (int i = 0; i < steps; ++i) {
        CALL(toile_sim_step(sim, 0.01, NULL));
        CALL(toile_sim_body_wrench(sim, 0, force, torque));
        sum -= i < steps / 2 ? 0 : force[1];
    }
    return sum / (steps - steps / 2);
}

static double *positions(const toile_sim *sim, size_t *count) {
    CALL(toile_sim_positions(sim, NULL, 0, count));
    double *x = malloc(*count * sizeof *x);
    CALL(toile_sim_positions(sim, x, *count, count));
    return x;
}

/* how far a vertex is from where it was [m] */
static double jump(const toile_sim *sim, const double *before) {
    size_t count = 0;
    double *x = positions(sim, &count), largest = 0;
    for (size_t i = 0; i < count; ++i) {
        largest = fmax(largest, fabs(x[i] - before[i]));
    }
    free(x);
    return largest;
}

int main(void) {
    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    toile_sim *sim = cloth();
    CALL(toile_sim_drape(sim, NULL, &report));
    HOLDS(report.outcome == TOILE_OUTCOME_CONVERGED);
    const double weight = borne(sim, 5);
    size_t bytes = 0, count = 0;
    CALL(toile_sim_save(sim, NULL, 0, &bytes));
    uint8_t *saved = malloc(bytes);
    CALL(toile_sim_save(sim, saved, bytes, &bytes));

    /* where are yarns wanted? */
    toile_suggest_desc wish;
    CALL(toile_suggest_desc_init(&wish, sizeof wish));
    wish.budget = 800;
    CALL(toile_sim_suggest_region(sim, &wish, NULL, 0, &count, NULL));
    double *alpha = malloc(count * sizeof *alpha);
    CALL(toile_sim_suggest_region(sim, &wish, alpha, count, &count, NULL));
    size_t numbers = 0;
    double *before = positions(sim, &numbers);
    CALL(toile_sim_set_blend_vertices(sim, alpha, count, 0));
    free(alpha);
    toile_system_info info;
    CALL(toile_system_info_init(&info, sizeof info));
    CALL(toile_sim_info(sim, &info));
    printf("%d yarn nodes come in for %d of %d triangles, no vertex jumps by more than %g m\n",
           (int)info.yarn_nodes, (int)(info.triangles - info.active_triangles),
           (int)info.triangles, jump(sim, before));
    HOLDS(info.yarn_nodes > 0 && jump(sim, before) == 0);
    HOLDS(toile_sim_restore(sim, saved, bytes) == TOILE_E_PARSE);
    const double mixed = borne(sim, 30);

    /* and triangles again */
    free(before);
    before = positions(sim, &numbers);
    CALL(toile_sim_set_blend_region(sim, 0, NULL, 0, 0));
    HOLDS(jump(sim, before) == 0);
    const double again = borne(sim, 30);
    printf("the ball bears %.4f N of triangles, %.4f N with yarns, %.4f N without them\n", weight,
           mixed, again);
    HOLDS(fabs(mixed / weight - 1) < 0.05 && fabs(again / weight - 1) < 0.05);
    CALL(toile_sim_restore(sim, saved, bytes));
    free(before);
    free(saved);
    toile_sim_free(sim);
    return 0;
}
