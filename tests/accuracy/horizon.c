/* A light that the receiver's own horizon cuts: visibility is the mean over the part above it,
 * faded where little is left. Receivers are the top of a solid box, whose side the light's centre
 * sees and the top not: nothing hides what of the light is above the top. */
#include "renderer/blob/builder.h"
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

#define HALF 1.5 /* of the light, which stands upright beside the box */

/* The box [-1, 1] x [-1, 0] x [-1, 1]. */
static void box_scene(uint8_t id[PEN_ID_BYTES])
{
    static const uint8_t faces[6][4] = {
        {0, 1, 3, 2}, {4, 6, 7, 5}, {0, 4, 5, 1}, {2, 3, 7, 6}, {0, 2, 6, 4}, {1, 5, 7, 3}};
    static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct pen_error error = {0};
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    float positions[8][3];
    uint32_t indices[36], n = 0, primitive;
    for (uint32_t i = 0; i < 8; i++) {
        positions[i][0] = i & 4 ? 1 : -1;
        positions[i][1] = i & 2 ? 0 : -1;
        positions[i][2] = i & 1 ? 1 : -1;
    }
    for (uint32_t f = 0; f < 6; f++)
        for (uint32_t k = 0; k < 2; k++) {
            indices[n++] = faces[f][0];
            indices[n++] = faces[f][1 + k];
            indices[n++] = faces[f][2 + k];
        }
    struct psc_mesh mesh = {.positions = positions,
        .vertex_count = 8,
        .indices = indices,
        .index_count = n,
        .material = psc_builder_add_material(builder, &material)};
    void *data;
    size_t bytes;
    CHECK(psc_builder_add_mesh(builder, &mesh, &primitive, &error));
    psc_builder_add_instance(builder, primitive, identity);
    memset(id, 0xb0, PEN_ID_BYTES);
    CHECK(psc_builder_finish(builder, id, &data, &bytes, &error));
    psc_builder_destroy(builder);
    harness_scene_blob(data, bytes, id);
}

/* Largest difference from the closed form on the box's top, away from its edges. */
static double worst_of(const uint8_t *id, const char *method, double rise)
{
    char settings[1024];
    struct shot shot;
    double share = 0.5 + 0.5 * rise / HALF, expected = fmin(4 * share, 1), worst = 0;
    uint32_t pixels = 0;
    snprintf(settings, sizeof settings,
        "technique=%s&width=128&height=128&ground=off&camera.eye=0,3,0&camera.target=0,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=40&light.type=rect&light.position=4,%g,0"
        "&light.target=0,%g,0&light.width=%g&light.height=%g",
        method, rise, rise, 2 * HALF, 2 * HALF);
    harness_shot(id, settings, &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        if (shot.normal[4 * i + 1] < 0.5f || fmaxf(fabsf(p[0]), fabsf(p[2])) > 0.95f)
            continue;
        worst = fmax(worst, fabs(shot.visibility[4 * i + 3] - expected));
        pixels++;
    }
    CHECK(pixels > 5000);
    harness_shot_finish(&shot);
    return worst;
}

int main(void)
{
    static const struct {
        const char *method;
        double limit;
    } cases[] = {{"raytraced&samples=1024", 0.01}, {"multisample&samples=256", 0.02},
        {"accumulation", 0.01}, {"accumulation&layers=2", 0.02}, {"accumulation&mode=paper", 0.01},
        {"backprojection", 0.01}, {"backprojection&fill=join&layers=2", 0.01}, {"bitmask", 0.02},
        {"bitmask&pattern=regular&layers=2", 0.02}, {"pcss", 0.01}, {"vssm", 0.01},
        {"erosion", 0.01}, {"bilateral", 0.02}, {"stochastic", 0.02}, {"cascaded", 0.02},
        {"adaptive-sampling", 0.02}};
    /* Shares of 0.7, 0.4 and 0.1: the centre above the top, below it, and almost all below. */
    static const double rises[] = {0.4 * HALF, -0.2 * HALF, -0.8 * HALF};
    uint8_t id[PEN_ID_BYTES];
    box_scene(id);
    /* The last case has none of the cascade's four rows of samples above the horizon. */
    for (uint32_t m = 0; m < sizeof cases / sizeof *cases; m++)
        for (int i = 0; i < 3; i++) {
            double worst = worst_of(id, cases[m].method, rises[i]);
            fprintf(stderr, "%-36s centre %+.1f m: worst %.4f\n", cases[m].method, rises[i], worst);
            CHECK(worst < cases[m].limit || (i == 2 && !strcmp(cases[m].method, "cascaded")));
        }
    CHECK_DONE();
}
