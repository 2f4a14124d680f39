/* A sheet held at its corners meets bodies that move: a rigid sphere that rises into it, then a
 * mesh that swells as a walking body's skin would.
 *
 * The laws at the end: the cloth never gets inside, is lifted as far as the body asks, and pushes
 * back: the force on the body points down. */
#include <math.h>

#include "check.h"

enum { RINGS = 12, SECTORS = 24, VERTICES = 2 + (RINGS - 1) * SECTORS };

/* a closed sphere of triangles, counter-clockwise seen from outside */
static size_t sphere(double radius, double *points, uint32_t *triangles) {
    const double pi = 3.14159265358979323846;
    size_t n = 0, t = 0;
    points[n++] = 0, points[n++] = radius, points[n++] = 0;
    for (int r = 1; r < RINGS; ++r) {
        for (int s = 0; s < SECTORS; ++s) {
            double a = pi * r / RINGS, b = 2 * pi * s / SECTORS;
            points[n++] = radius * sin(a) * cos(b);
            points[n++] = radius * cos(a);
            points[n++] = -radius * sin(a) * sin(b);
        }
    }
    points[n++] = 0, points[n++] = -radius, points[n++] = 0;
    if (triangles == NULL) {
        return 0;
    }
    for (uint32_t s = 0; s < SECTORS; ++s) {
        uint32_t next = (s + 1) % SECTORS, last = 1 + (RINGS - 2) * SECTORS;
        triangles[t++] = 0, triangles[t++] = 1 + s, triangles[t++] = 1 + next;
        for (uint32_t r = 0; r + 2 < RINGS; ++r) {
            uint32_t a = 1 + r * SECTORS, b = a + SECTORS;
            triangles[t++] = a + s, triangles[t++] = b + s, triangles[t++] = b + next;
            triangles[t++] = a + s, triangles[t++] = b + next, triangles[t++] = a + next;
        }
        triangles[t++] = VERTICES - 1, triangles[t++] = last + next, triangles[t++] = last + s;
    }
    return t / 3;
}

/* a level sheet around the origin at y = 0.15, held at its four corners */
static toile_sim *sheet(void) {
    const double corners[] = {-0.25, -0.25, 0.25, -0.25, 0.25, 0.25, -0.25, 0.25};
    toile_garment *garment = NULL;
    CALL(toile_garment_create(NULL, &garment));
    toile_panel_desc panel;
    CALL(toile_panel_desc_init(&panel, sizeof panel));
    panel.vertices = corners;
    panel.vertex_count = 4;
    panel.edge_length = 0.04;
    panel.position[1] = 0.15;
    panel.quaternion_xyzw[0] = -sqrt(0.5);
    panel.quaternion_xyzw[3] = sqrt(0.5);
    CALL(toile_garment_add_panel(garment, &panel, NULL));
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    toile_garment_free(garment);
    for (int i = 0; i < 4; ++i) {
        uint32_t vertex;
        CALL(toile_sim_locate(sim, 0, &corners[2 * i], &vertex));
        CALL(toile_sim_pin(sim, &vertex, 1, NULL));
    }
    return sim;
}

static void check(const toile_sim *sim, const toile_step_report *report, double top,
                  const char *what) {
    toile_view_f64 view;
    CALL(toile_view_f64_init(&view, sizeof view));
    CALL(toile_sim_positions_view(sim, &view));
    double highest = -INFINITY, force[3], torque[3];
    for (uint64_t i = 0; i < view.count; ++i) {
        highest = fmax(highest, view.data[3 * i + 1]);
    }
    CALL(toile_sim_body_wrench(sim, 0, force, torque));
    printf("%-8s top %.4f m, cloth up to %.4f m, smallest gap %.3f mm, force on it %.3f N\n", what,
           top, highest, 1e3 * report->min_gap, force[1]);
    HOLDS(report->min_gap > -1e-3);
    HOLDS(highest > top - 1e-3 && highest < top + 0.02);
    HOLDS(force[1] < 0);
    HOLDS(fabs(force[0]) < 0.1 * fabs(force[1]) && fabs(force[2]) < 0.1 * fabs(force[1]));
}

int main(void) {
    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    const double upright[4] = {0, 0, 0, 1};
    const int frames = 30;

    /* a rigid sphere of 0.1 m rises by 0.12 m within a second */
    toile_sim *sim = sheet();
    toile_body *body = NULL;
    CALL(toile_body_sphere(0.1, &body));
    uint32_t number;
    CALL(toile_sim_set_body_sdf(sim, body, NULL, &number));
    toile_body_free(body);
    for (int i = 0; i <= frames; ++i) {
        const double position[3] = {0, 0.12 * i / frames, 0};
        CALL(toile_sim_set_body_pose(sim, number, position, upright));
        CALL(toile_sim_step(sim, 1.0 / frames, &report));
        HOLDS(report.min_gap > -1e-3);
    }
    check(sim, &report, 0.22, "rigid");
    toile_sim_free(sim);

    /* a mesh swells from 0.1 m to 0.2 m */
    static double points[3 * VERTICES];
    static uint32_t triangles[3 * 2 * VERTICES];
    size_t triangle_count = sphere(0.1, points, triangles);
    CALL(toile_body_mesh(points, VERTICES, triangles, triangle_count, 0.01, &body));
    sim = sheet();
    CALL(toile_sim_set_body_sdf(sim, body, NULL, &number));
    toile_body_free(body);
    double radius = 0.1;
    for (int i = 0; i <= frames; ++i) {
        radius = 0.1 + 0.1 * i / frames;
        sphere(radius, points, NULL);
        CALL(toile_sim_set_body_vertices(sim, number, points, VERTICES));
        CALL(toile_sim_step(sim, 1.0 / frames, &report));
        HOLDS(report.min_gap > -1e-3);
    }
    check(sim, &report, radius, "swelling");
    toile_sim_free(sim);
    return 0;
}
