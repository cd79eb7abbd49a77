/* No method: asks for the maps of two sets of points that differ in the middle one alone, and fails
 * when it gets the same. */
#include "renderer/passes/light/sample_maps.h"
#include <string.h>

#define SIZE 64

struct sample_probe {
    uint32_t unused;
};

static const struct pen_param rows[] = {
    PARAM(struct sample_probe, unused, .def = 0, .min = 0, .max = 1, .help = "Nothing."),
};

static bool read_middle(
    struct technique_run *run, float middle, float depths[SIZE * SIZE], struct pen_error *error)
{
    struct sample_point points[3];
    struct sample_map table[3];
    const struct gl_texture *maps;
    static const float across[3] = {-1, 0, 1};
    for (int i = 0; i < 3; i++)
        points[i] = sample_point_at(run->face, i == 1 ? middle : across[i], across[i]);
    if (!pass_sample_maps(run, points, 3, SIZE, true, table, &maps, error))
        return false;
    gl.GetTextureSubImage(maps->name, 0, 0, 0, 1, SIZE, SIZE, 1, GL_DEPTH_COMPONENT, GL_FLOAT,
        SIZE * SIZE * 4, depths);
    return true;
}

static bool record(struct technique_run *run, struct pen_error *error)
{
    float left[SIZE * SIZE], right[SIZE * SIZE];
    if (!read_middle(run, -0.9f, left, error) || !read_middle(run, 0.9f, right, error))
        return false;
    return memcmp(left, right, sizeof left) ||
           pen_fail(error, PEN_INTERNAL, "", "Two sets of points have the same maps.");
}

const struct technique technique_sample_probe = {
    .info = {.name = "sample-probe",
        .title = "Probe",
        .summary = "Asks for maps.",
        .citation = "None.",
        .artefacts = "No shadows.",
        .cost_class = PEN_COST_CHEAP,
        .textured = false,
        .struct_size = sizeof(struct sample_probe),
        .params = {rows, sizeof rows / sizeof *rows}},
    .record = record,
};
