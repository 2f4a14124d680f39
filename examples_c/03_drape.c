/* Drapes a garment file on a body file, shows how far it has come, prints a table, writes a model.
 *
 *     03_drape GARMENT.json BODY.obj OUT.obj [SCALE]
 *
 * GARMENT.json is a garment of toile's own or a GarmentCode specification; SCALE multiplies the
 * body's coordinates into metres (1 if left out).
 *
 * The laws at the end: seams are shut, no vertex is inside the body. */
#include <string.h>

#include "check.h"

static char *read_file(const char *path, size_t *length) {
    FILE *file = fopen(path, "rb");
    if (file == NULL || fseek(file, 0, SEEK_END) != 0) {
        fprintf(stderr, "%s cannot be read\n", path);
        exit(2);
    }
    long size = ftell(file);
    rewind(file);
    char *text = malloc((size_t)size + 1);
    if (size < 0 || text == NULL || fread(text, 1, (size_t)size, file) != (size_t)size) {
        fprintf(stderr, "%s cannot be read\n", path);
        exit(2);
    }
    fclose(file);
    text[size] = '\0';
    *length = (size_t)size;
    return text;
}

static int32_t show(void *user, const toile_progress *progress) {
    int *shown = user;
    int percent = (int)(100 * progress->fraction);
    if (percent != *shown) {
        *shown = percent;
        fprintf(stderr, "\r%3d %% %-8s residual %9.2e N ", percent, progress->stage,
                progress->residual);
    }
    return 0; /* anything else would stop */
}

static void write_obj(const char *path, const toile_sim *sim) {
    size_t point_count = 0, index_count = 0;
    CALL(toile_sim_positions(sim, NULL, 0, &point_count));
    CALL(toile_sim_triangles(sim, NULL, 0, &index_count));
    double *points = malloc(point_count * sizeof *points);
    uint32_t *indices = malloc(index_count * sizeof *indices);
    HOLDS(points != NULL && indices != NULL);
    CALL(toile_sim_positions(sim, points, point_count, NULL));
    CALL(toile_sim_triangles(sim, indices, index_count, NULL));
    FILE *file = fopen(path, "w");
    if (file == NULL) {
        fprintf(stderr, "%s cannot be written\n", path);
        exit(2);
    }
    for (size_t i = 0; i < point_count; i += 3) {
        fprintf(file, "v %.9g %.9g %.9g\n", points[i], points[i + 1], points[i + 2]);
    }
    for (size_t i = 0; i < index_count; i += 3) {
        fprintf(file, "f %u %u %u\n", (unsigned)indices[i] + 1, (unsigned)indices[i + 1] + 1,
                (unsigned)indices[i + 2] + 1);
    }
    if (fclose(file) != 0) {
        fprintf(stderr, "%s cannot be written\n", path);
        exit(2);
    }
    free(points);
    free(indices);
}

int main(int argc, char **argv) {
    if (argc < 4) {
        fprintf(stderr, "usage: %s GARMENT.json BODY.obj OUT.obj [SCALE]\n", argv[0]);
        return 2;
    }
    size_t length = 0;
    char *json = read_file(argv[1], &length);
    toile_garment *garment = NULL;
    CALL(toile_garment_from_json(json, length, NULL, &garment));
    free(json);
    toile_body *body = NULL;
    CALL(toile_body_obj(argv[2], argc > 4 ? atof(argv[4]) : 1.0, 0, &body));

    toile_sim *sim = NULL;
    CALL(toile_sim_create(garment, NULL, &sim));
    CALL(toile_sim_set_body_sdf(sim, body, NULL, NULL));
    uint32_t panels = 0, seams = 0;
    CALL(toile_garment_panel_count(garment, &panels));
    CALL(toile_garment_seam_count(garment, &seams));
    toile_garment_free(garment);
    toile_body_free(body);

    int shown = -1;
    toile_drape_desc desc;
    CALL(toile_drape_desc_init(&desc, sizeof desc));
    desc.progress = show;
    desc.progress_user = &shown;
    toile_step_report report;
    CALL(toile_step_report_init(&report, sizeof report));
    CALL(toile_sim_drape(sim, &desc, &report));
    fprintf(stderr, "\n");

    static const char *const outcomes[] = {"converged", "substepped", "iteration limit",
                                           "cancelled", "stalled", "falling"};
    toile_system_info info;
    CALL(toile_system_info_init(&info, sizeof info));
    CALL(toile_sim_info(sim, &info));
    printf("%-24s %12u\n", "panels", (unsigned)panels);
    printf("%-24s %12u\n", "seams", (unsigned)seams);
    printf("%-24s %12llu\n", "vertices", (unsigned long long)info.vertices);
    printf("%-24s %12llu\n", "triangles", (unsigned long long)info.triangles);
    printf("%-24s %12s\n", "outcome", report.outcome < 6 ? outcomes[report.outcome] : "?");
    printf("%-24s %12llu\n", "substeps", (unsigned long long)report.substeps);
    printf("%-24s %12llu\n", "Newton iterations", (unsigned long long)report.newton_iterations);
    printf("%-24s %12.3e\n", "residual [N]", report.residual);
    printf("%-24s %12.3f\n", "largest seam gap [mm]", 1e3 * report.max_seam_gap);
    printf("%-24s %12.3f\n", "smallest body gap [mm]", 1e3 * report.min_gap);
    printf("%-24s %12.3f\n", "largest strain [%]", 100 * report.max_edge_strain);
    printf("%-24s %12.6f\n", "potential energy [J]", report.potential_energy);
    write_obj(argv[3], sim);

    HOLDS(report.max_seam_gap < 2e-3);
    HOLDS(report.min_gap > -1e-3);
    toile_sim_free(sim);
    return 0;
}
