/* Eight simulations in eight threads, all made of one garment.
 *
 * The laws at the end: every thread gets the same bits, and the cloth lies on the sphere. */
#include <math.h>
#include <pthread.h>
#include <string.h>

#include "check.h"

enum { THREADS = 8, STEPS = 20 };

typedef struct job {
    const toile_garment *garment;
    const toile_body *body;
    uint8_t *state;
    size_t size;
    double min_gap;
} job;

static void *work(void *argument) {
    job *j = argument;
    toile_sim *sim = NULL;
    CALL(toile_sim_create(j->garment, NULL, &sim));
    CALL(toile_sim_set_body_sdf(sim, j->body, NULL, NULL));
    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    for (int i = 0; i < STEPS; ++i) {
        CALL(toile_sim_step(sim, 0.02, &report));
    }
    j->min_gap = report.min_gap;
    CALL(toile_sim_save(sim, NULL, 0, &j->size));
    j->state = malloc(j->size);
    HOLDS(j->state != NULL);
    CALL(toile_sim_save(sim, j->state, j->size, NULL));
    toile_sim_free(sim);
    return NULL;
}

int main(void) {
    const double corners[] = {-0.2, -0.2, 0.2, -0.2, 0.2, 0.2, -0.2, 0.2};
    toile_garment *garment = NULL;
    CALL(toile_garment_create(NULL, &garment));
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.edge_length = 0.05;
    panel.position[1] = 0.16; /* flat, above the sphere */
    panel.quaternion_xyzw[0] = -sqrt(0.5);
    panel.quaternion_xyzw[3] = sqrt(0.5);
    CALL(toile_garment_add_panel(garment, &panel, NULL));
    toile_body *body = NULL;
    CALL(toile_body_sphere(0.15, &body));

    job jobs[THREADS];
    pthread_t threads[THREADS];
    for (int i = 0; i < THREADS; ++i) {
        jobs[i] = (job){garment, body, NULL, 0, 0};
        HOLDS(pthread_create(&threads[i], NULL, work, &jobs[i]) == 0);
    }
    for (int i = 0; i < THREADS; ++i) {
        HOLDS(pthread_join(threads[i], NULL) == 0);
    }
    for (int i = 0; i < THREADS; ++i) {
        HOLDS(jobs[i].size == jobs[0].size);
        HOLDS(memcmp(jobs[i].state, jobs[0].state, jobs[0].size) == 0);
        HOLDS(jobs[i].min_gap > -1e-3 && jobs[i].min_gap < 0.01);
    }
    printf("%d threads, %zu equal bytes of state each, smallest gap %.3f mm\n", (int)THREADS,
           jobs[0].size, 1e3 * jobs[0].min_gap);
    for (int i = 0; i < THREADS; ++i) {
        free(jobs[i].state);
    }
    toile_body_free(body);
    toile_garment_free(garment);
    return 0;
}
