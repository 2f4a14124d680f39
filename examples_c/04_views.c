/* Reads positions and velocities where they lie, without a copy.
 *
 * The law at the end: a sheet that nothing holds falls with the acceleration of gravity, whatever
 * its stiffness. An array that is held stays as it was all the while. */
#include <math.h>

#include "check.h"

int main(void) {
    const double corners[] = {0, 0, 0.3, 0, 0.3, 0.3, 0, 0.3};
    toile_garment *garment = NULL;
    CALL(toile_garment_create(NULL, &garment));
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.edge_length = 0.05;
    CALL(toile_garment_add_panel(garment, &panel, NULL));
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    toile_garment_free(garment);

    /* no air: numbers go by their names */
    CALL(toile_sim_set_number(sim, "air.drag", 0));
    CALL(toile_sim_set_number(sim, "air.tangential", 0));

    toile_view_f64 x, v;
    CALL(toile_view_f64_init(&x, sizeof x));
    CALL(toile_view_f64_init(&v, sizeof v));
    CALL(toile_sim_positions_view(sim, &x));
    HOLDS(x.count > 0 && x.components == 3 && x.stride == 3 * sizeof(double));
    HOLDS(x.epoch == toile_sim_epoch(sim));
    double *start = malloc(3 * x.count * sizeof *start);
    HOLDS(start != NULL);
    CALL(toile_sim_positions(sim, start, 3 * x.count, NULL));
    for (uint64_t i = 0; i < 3 * x.count; ++i) {
        HOLDS(x.data[i] == start[i]); /* a view and a copy are the same numbers */
    }

    /* what must outlive the next call is held: no copy is made before the sheet moves */
    toile_array *held = NULL;
    CALL(toile_sim_positions_array(sim, &held));
    toile_view_f64 h;
    CALL(toile_view_f64_init(&h, sizeof h));
    CALL(toile_array_view(held, &h));
    HOLDS(h.data == x.data && h.count == x.count);

    const int steps = 200;
    const double dt = 1e-3;
    for (int i = 0; i < steps; ++i) {
        uint64_t before = toile_sim_epoch(sim);
        CALL(toile_sim_step(sim, dt, NULL));
        HOLDS(toile_sim_epoch(sim) != before); /* the views have ended */
    }
    CALL(toile_sim_positions_view(sim, &x));
    CALL(toile_sim_velocities_view(sim, &v));
    const double t = steps * dt;
    double worst = 0;
    for (uint64_t i = 0; i < x.count; ++i) {
        double fallen = start[3 * i + 1] - x.data[3 * i + 1];
        worst = fmax(worst, fabs(fallen / (0.5 * 9.81 * t * t) - 1));
        worst = fmax(worst, fabs(v.data[3 * i + 1] / (-9.81 * t) - 1));
        HOLDS(fabs(x.data[3 * i] - start[3 * i]) < 1e-9);
    }
    printf("after %.3f s: off the law of free fall by %.3f %%\n", t, 100 * worst);
    HOLDS(worst < 0.01); /* the integrator is of first order: dt / t = 0.5 % */
    toile_sim_free(sim);
    for (uint64_t i = 0; i < 3 * h.count; ++i) {
        HOLDS(h.data[i] == start[i]); /* neither the steps nor the end of the sheet have touched it */
    }
    toile_array_free(held);
    free(start);
    return 0;
}
