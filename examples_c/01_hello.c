/* A square of cloth, held by two corners, swings down from the horizontal.
 *
 * The law at the end: nobody does work on the cloth, so its energy never grows, and the held
 * corners stay where they are. */
#include <math.h>

#include "check.h"

int main(void) {
    /* a garment of one square panel, lying flat: u along x, v away from the viewer (-z) */
    const double corners[] = {0, 0, 0.4, 0, 0.4, 0.4, 0, 0.4};
    toile_garment_desc garment_desc;
    CALL(toile_garment_desc_init(&garment_desc, sizeof garment_desc));
    garment_desc.edge_length = 0.05;
    toile_garment *garment = NULL;
    CALL(toile_garment_create(&garment_desc, &garment));

    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.name = "square";
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.quaternion_xyzw[0] = -sqrt(0.5);
    panel.quaternion_xyzw[3] = sqrt(0.5);
    CALL(toile_garment_add_panel(garment, &panel, NULL));

    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    toile_garment_free(garment); /* the simulation has its own copy */

    /* hold two corners where they are */
    uint32_t held[2];
    CALL(toile_sim_locate(sim, 0, (const double[]){0, 0}, &held[0]));
    CALL(toile_sim_locate(sim, 0, (const double[]){0.4, 0}, &held[1]));
    CALL(toile_sim_pin(sim, held, 2, NULL));

    size_t count = 0;
    CALL(toile_sim_positions(sim, NULL, 0, &count));
    double *start = malloc(count * sizeof *start);
    double *now = malloc(count * sizeof *now);
    HOLDS(start != NULL && now != NULL);
    CALL(toile_sim_positions(sim, start, count, &count));

    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    CALL(toile_sim_report(sim, &report));
    double energy = report.kinetic_energy + report.potential_energy;
    printf("%8s %12s %12s %10s\n", "time [s]", "energy [J]", "lowest [m]", "strain");
    for (int frame = 0; frame < 24; ++frame) {
        CALL(toile_sim_step(sim, 1.0 / 24, &report));
        double next = report.kinetic_energy + report.potential_energy;
        HOLDS(next <= energy + 1e-6);
        energy = next;

        CALL(toile_sim_positions(sim, now, count, &count));
        double lowest = 0;
        for (size_t i = 1; i < count; i += 3) {
            lowest = fmin(lowest, now[i]);
        }
        if (frame % 6 == 5) {
            printf("%8.3f %12.6f %12.4f %10.5f\n", toile_sim_time(sim), energy, lowest,
                   report.max_edge_strain);
        }
        HOLDS(lowest > -0.45);
        if (frame == 23) {
            HOLDS(lowest < -0.2); /* it does hang down */
        }
    }
    for (int k = 0; k < 2; ++k) {
        for (int axis = 0; axis < 3; ++axis) {
            size_t i = 3 * (size_t)held[k] + (size_t)axis;
            HOLDS(fabs(now[i] - start[i]) < 1e-9);
        }
    }
    HOLDS(fabs(toile_sim_time(sim) - 1.0) < 1e-9);

    free(start);
    free(now);
    toile_sim_free(sim);
    return 0;
}
