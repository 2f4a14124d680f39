/* A swatch of jersey, every yarn simulated: it is let go for a moment, and its yarns are read, as a host draws them
 * and as numbers.
 *
 * The laws at the end: what relaxes loses energy, yarns keep their order and their length, a held node stays
 * where it is held, and the swatch leaves its plane as jersey does. */
#include <math.h>
#include <string.h>

#include "check.h"

/* 6 by 6 loops, 3 mm wide */
static const char GARMENT[] =
    "{\"toile_garment\": 1, \"name\": \"swatch\", \"edge_length\": 0.006,"
    " \"fabrics\": [{\"name\": \"jersey\", \"yarns\": {\"preset\": \"jersey\"}}],"
    " \"panels\": [{\"name\": \"p\", \"fabric\": \"jersey\","
    "  \"vertices\": [[0, 0], [0.0192, 0], [0.0192, 0.017115], [0, 0.017115]],"
    "  \"edges\": [[0, 1], [1, 2], [2, 3], [3, 0]]}],"
    " \"blend_regions\": [{\"panel\": \"p\", \"polygon\": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]}";

enum { STEPS = 30 };

/* the numbers of one of the read-outs, whose length the library tells */
#define READ(type, name, sim, count)                                                      \
    type *name = NULL;                                                                    \
    CALL(toile_sim_##name(sim, NULL, 0, &(count)));                                       \
    name = malloc((count) * sizeof *name);                                                \
    HOLDS(name != NULL);                                                                  \
    CALL(toile_sim_##name(sim, name, count, NULL))

/* length of a polyline */
static double along(const double *points, size_t count) {
    double sum = 0;
    for (size_t k = 1; k < count; ++k) {
        const double *a = points + 3 * (k - 1), *b = points + 3 * k;
        sum += sqrt((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1]) +
                    (b[2] - a[2]) * (b[2] - a[2]));
    }
    return sum;
}

/* what a plug-in needs to draw yarns: points of curves, where each begins, and radii; the length drawn */
static double draw(const toile_sim *sim) {
    enum { SAMPLES = 4 };
    size_t starts = 0, numbers = 0, yarns = 0, panels = 0, fabrics = 0;
    CALL(toile_sim_yarn_curve_offsets(sim, SAMPLES, NULL, 0, &starts));
    CALL(toile_sim_yarn_curves(sim, SAMPLES, NULL, 0, &numbers));
    uint32_t *start = malloc(starts * sizeof *start);
    double *points = malloc(numbers * sizeof *points);
    HOLDS(start != NULL && points != NULL);
    CALL(toile_sim_yarn_curve_offsets(sim, SAMPLES, start, starts, NULL));
    CALL(toile_sim_yarn_curves(sim, SAMPLES, points, numbers, NULL));
    READ(double, yarn_radii, sim, yarns);
    READ(uint32_t, yarn_fabrics, sim, fabrics);
    READ(uint32_t, yarn_panels, sim, panels);
    HOLDS(starts == yarns + 1 && fabrics == yarns && panels == yarns);
    HOLDS(3 * (size_t)start[yarns] == numbers);
    double length = 0;
    for (size_t y = 0; y < yarns; ++y) {
        HOLDS(yarn_radii[y] > 0 && yarn_fabrics[y] == 0 && yarn_panels[y] == 0);
        /* here the tube of this radius around these points would go to the screen */
        length += along(points + 3 * (size_t)start[y], start[y + 1] - start[y]);
    }
    free(start);
    free(points);
    free(yarn_radii);
    free(yarn_fabrics);
    free(yarn_panels);
    return length;
}

static double yarn_energy(const toile_sim *sim) {
    toile_energies energies;
    CALL(toile_energies_init(&energies, sizeof energies));
    CALL(toile_sim_energies(sim, &energies));
    return energies.yarn;
}

int main(void) {
    toile_garment *garment = NULL;
    CALL(toile_garment_from_json(GARMENT, strlen(GARMENT), NULL, &garment));
    toile_sim_desc desc;
    CALL(toile_sim_desc_init(&desc, sizeof desc));
    desc.gravity[1] = 0;
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, &desc, &sim));
    toile_garment_free(garment);
    CALL(toile_sim_set_number(sim, "solver.newton.relative_tolerance", 0.01));

    /* the node in the middle is held where it is */
    const double middle[] = {0.0096, 0.0085};
    uint32_t held;
    CALL(toile_sim_locate_yarn_node(sim, 0, middle, &held));
    CALL(toile_sim_pin_yarn_nodes(sim, &held, 1, NULL));
    size_t count = 0;
    READ(double, yarn_nodes, sim, count);
    const double home[] = {yarn_nodes[3 * held], yarn_nodes[3 * held + 1], yarn_nodes[3 * held + 2]};
    free(yarn_nodes);

    const double laid = yarn_energy(sim);
    for (int k = 0; k < STEPS; ++k) {
        CALL(toile_sim_step(sim, 1e-3, NULL));
    }
    const double energy = yarn_energy(sim);

    size_t yarns = 0, passages = 0, nodes = 0;
    READ(uint32_t, yarn_offsets, sim, yarns);
    READ(uint32_t, yarn_indices, sim, passages);
    READ(double, yarn_coordinates, sim, passages);
    READ(double, yarn_tensions, sim, passages);
    READ(double, yarn_slips, sim, passages);
    READ(double, yarn_compressions, sim, nodes);
    double length = 0, tension = 0, slip = 0, compression = 0, height = 0;
    for (size_t y = 0; y + 1 < yarns; ++y) {
        const uint32_t first = yarn_offsets[y], last = yarn_offsets[y + 1] - 1;
        length += yarn_coordinates[last] - yarn_coordinates[first];
        for (uint32_t i = first; i < last; ++i) {
            HOLDS(yarn_coordinates[i + 1] > yarn_coordinates[i]);
        }
    }
    for (size_t i = 0; i < passages; ++i) {
        HOLDS(yarn_indices[i] < nodes);
        tension = fmax(tension, yarn_tensions[i]);
        slip = fmax(slip, fabs(yarn_slips[i]));
    }
    for (size_t n = 0; n < nodes; ++n) {
        compression = fmax(compression, yarn_compressions[n]);
    }
    size_t points = 0;
    double *now = NULL;
    CALL(toile_sim_yarn_nodes(sim, NULL, 0, &points));
    now = malloc(points * sizeof *now);
    HOLDS(now != NULL && points == 3 * nodes);
    CALL(toile_sim_yarn_nodes(sim, now, points, NULL));
    for (size_t n = 0; n < nodes; ++n) {
        height = fmax(height, fabs(now[3 * n + 2] - home[2]));
    }
    printf("%-28s %10zu of %zu yarns\n", "nodes", nodes, yarns - 1);
    printf("%-28s %10.4f\n", "length of yarn [m]", length);
    const double drawn = draw(sim);
    size_t top = 0;
    CALL(toile_sim_yarn_nodes_along(sim, 0, 2, NULL, 0, &top));
    printf("%-28s %10.4f\n", "length as drawn [m]", drawn);
    printf("%-28s %10zu\n", "nodes along the top", top);
    printf("%-28s %10.4f -> %.4f\n", "yarn energy [mJ]", 1e3 * laid, 1e3 * energy);
    printf("%-28s %10.4f\n", "largest tension [N]", tension);
    printf("%-28s %10.4f\n", "largest compression [N]", compression);
    printf("%-28s %10.4f\n", "largest slip [mm]", 1e3 * slip);
    printf("%-28s %10.4f\n", "out of its plane [mm]", 1e3 * height);

    HOLDS(energy < 0.9 * laid);
    /* drawn yarns lie around each other at contacts, which takes more than their straight segments do */
    HOLDS(drawn > length && drawn < 2 * length);
    HOLDS(top >= 12);
    for (int k = 0; k < 3; ++k) {
        HOLDS(now[3 * held + k] == home[k]);
    }
    HOLDS(compression > 0 && slip > 0);
    HOLDS(height > 5e-4);
    free(now);
    free(yarn_offsets);
    free(yarn_indices);
    free(yarn_coordinates);
    free(yarn_tensions);
    free(yarn_slips);
    free(yarn_compressions);
    toile_sim_free(sim);
    return 0;
}
