/* Yarns that come out of their contacts: a weft is pulled out of a plain weave by its end, then the yarn of a
 * garter swatch until its bind-off row has unravelled.
 *
 * The laws at the end: the pull falls as contacts are left, no yarn has become longer or shorter, and the
 * rest of the cloth holds together. */
#include <math.h>
#include <string.h>

#include "check.h"

static const char WEAVE[] =
    "{\"toile_garment\": 1, \"name\": \"weave\", \"edge_length\": 0.002,"
    " \"fabrics\": [{\"name\": \"y\", \"yarns\":"
    "  {\"weave\": \"plain\", \"warp_pitch\": 0.001, \"radius\": 0.00025}}],"
    " \"panels\": [{\"name\": \"p\", \"fabric\": \"y\","
    "  \"vertices\": [[0, 0], [0.006, 0], [0.006, 0.006], [0, 0.006]],"
    "  \"edges\": [[0, 1], [1, 2], [2, 3], [3, 0]]}],"
    " \"blend_regions\": [{\"panel\": \"p\", \"polygon\": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]}";

/* 4 by 4 loops, 3 mm wide, the ends of the yarn not woven in */
static const char GARTER[] =
    "{\"toile_garment\": 1, \"name\": \"garter\", \"edge_length\": 0.004,"
    " \"fabrics\": [{\"name\": \"y\", \"yarns\": {\"preset\": \"jersey\", \"knit\": \"garter\","
    "  \"fastened\": false}}],"
    " \"panels\": [{\"name\": \"p\", \"fabric\": \"y\","
    "  \"vertices\": [[0, 0], [0.0132, 0], [0.0132, 0.012015], [0, 0.012015]],"
    "  \"edges\": [[0, 1], [1, 2], [2, 3], [3, 0]]}],"
    " \"blend_regions\": [{\"panel\": \"p\", \"polygon\": [[-1, -1], [1, -1], [1, 1], [-1, 1]]}]}";

static toile_sim *create(const char *json) {
    toile_garment *garment = NULL;
    CALL(toile_garment_from_json(json, strlen(json), NULL, &garment));
    toile_sim_desc desc;
    CALL(toile_sim_desc_init(&desc, sizeof desc));
    desc.gravity[1] = 0;
    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, &desc, &sim));
    toile_garment_free(garment);
    CALL(toile_sim_set_number(sim, "solver.newton.relative_tolerance", 1e-3));
    return sim;
}

static toile_yarn_changes changes(const toile_sim *sim) {
    toile_yarn_changes out;
    CALL(toile_yarn_changes_init(&out, sizeof out));
    CALL(toile_sim_yarn_changes(sim, &out));
    return out;
}

/* an array of numbers of which the library tells how many there are */
static double *numbers(const toile_sim *sim, size_t *count,
                       toile_status (*read)(const toile_sim *, double *, size_t, size_t *)) {
    CALL(read(sim, NULL, 0, count));
    double *out = malloc(*count * sizeof *out);
    HOLDS(out != NULL);
    CALL(read(sim, out, *count, NULL));
    return out;
}

static double length(const toile_sim *sim) {
    size_t yarns = 0, passages = 0;
    CALL(toile_sim_yarn_offsets(sim, NULL, 0, &yarns));
    uint32_t *offsets = malloc(yarns * sizeof *offsets);
    HOLDS(offsets != NULL);
    CALL(toile_sim_yarn_offsets(sim, offsets, yarns, NULL));
    double *u = numbers(sim, &passages, toile_sim_yarn_coordinates);
    double sum = 0;
    for (size_t y = 0; y + 1 < yarns; ++y) {
        sum += u[offsets[y + 1] - 1] - u[offsets[y]];
    }
    free(offsets);
    free(u);
    return sum;
}

/* moves a node by the way of a millisecond and takes that step; what its holder bears [N] */
static double pull(toile_sim *sim, uint32_t node, const double way[3]) {
    size_t count = 0;
    double *nodes = numbers(sim, &count, toile_sim_yarn_nodes);
    double target[3], force = 0;
    for (int k = 0; k < 3; ++k) {
        target[k] = nodes[3 * node + k] + way[k];
    }
    free(nodes);
    CALL(toile_sim_pin_yarn_nodes(sim, &node, 1, target));
    CALL(toile_sim_step(sim, 1e-3, NULL));
    double *forces = numbers(sim, &count, toile_sim_yarn_forces);
    for (int k = 0; k < 3; ++k) {
        force += forces[3 * node + k] * forces[3 * node + k];
    }
    free(forces);
    return sqrt(force);
}

static void weave(void) {
    toile_sim *sim = create(WEAVE);
    /* the warp, yarns 0 to 5, is held at its ends; the third weft, yarn 8, is pulled at its last end */
    for (uint32_t yarn = 0; yarn < 6; ++yarn) {
        for (uint32_t end = 0; end < 2; ++end) {
            uint32_t node;
            CALL(toile_sim_yarn_end(sim, yarn, end, &node));
            CALL(toile_sim_pin_yarn_nodes(sim, &node, 1, NULL));
        }
    }
    uint32_t end;
    CALL(toile_sim_yarn_end(sim, 8, 1, &end));
    const double before = length(sim);
    const double way[] = {1e-4, 0, 0};
    double most[7] = {0};
    for (int k = 0; k < 90; ++k) {
        const double force = pull(sim, end, way);
        const size_t contacts = 6 - (size_t)changes(sim).passages_gone;
        most[contacts] = fmax(most[contacts], force);
    }
    printf("weft of a weave, largest pull with so many contacts left [mN]:");
    for (int k = 6; k >= 0; --k) {
        printf(" %.2f", 1e3 * most[k]);
    }
    printf("\n");
    HOLDS(changes(sim).passages_gone == 6);
    /* the first contact goes while the pull still grows */
    for (int k = 0; k < 5; ++k) {
        HOLDS(most[k] < most[k + 1]);
    }
    HOLDS(fabs(length(sim) - before) < 1e-12);
    toile_sim_free(sim);
}

static void garter(void) {
    toile_sim *sim = create(GARTER);
    /* the yarn begins with the cast-on, which is held, and ends with the bind-off */
    size_t count = 0;
    double *nodes = numbers(sim, &count, toile_sim_yarn_nodes);
    for (uint32_t n = 0; n < count / 3; ++n) {
        if (nodes[3 * n + 1] < 1.3e-3) {
            CALL(toile_sim_pin_yarn_nodes(sim, &n, 1, NULL));
        }
    }
    free(nodes);
    uint32_t end;
    CALL(toile_sim_yarn_end(sim, 0, 1, &end));
    const double before = length(sim);
    const double way[] = {1e-4, 2e-4, 0};
    uint64_t epoch = changes(sim).epoch;
    HOLDS(epoch == 1);
    int steps = 0;
    /* four contacts to each of four loops */
    while (changes(sim).nodes_split < 16 && steps < 200) {
        (void)pull(sim, end, way);
        ++steps;
        const toile_yarn_changes now = changes(sim);
        if (now.epoch != epoch) {
            epoch = now.epoch;
            printf("garter after %d ms: %u contacts have come apart\n", steps,
                   (unsigned)now.nodes_split);
        }
    }
    HOLDS(changes(sim).nodes_split == 16);
    HOLDS(fabs(length(sim) - before) < 1e-12);
    toile_sim_free(sim);
}

int main(void) {
    weave();
    garter();
    return 0;
}
