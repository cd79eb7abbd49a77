/* Small scenes for the ray tracer's tests: a light at (0, LIGHT_Y, 0) that looks straight down, a
 * grid of receivers on y = 0, and casters in between. In the light's own frame a receiver at (x, 0,
 * z) is (x, z, LIGHT_Y) and a caster at height h has depth LIGHT_Y - h. */
#pragma once
#include "renderer/blob/builder.h"
#include "renderer/trace/trace.h"
#include "tests/unit/check.h"

#define LIGHT_Y 3.0f
#define GRID 64 /* receivers along an edge */

static const float identity[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};

static inline struct pen_trace_light downward_light(enum pen_trace_light_type type, float half)
{
    return (struct pen_trace_light){.type = type,
        .origin = {0, LIGHT_Y, 0},
        .x = {1, 0, 0},
        .y = {0, 0, 1},
        .z = {0, -1, 0},
        .half = {half, half},
        .cos_cone = -1};
}

/* A horizontal rectangle [x0, x1] x [z0, z1] at height y; uv runs from 0 to 1 along x and z. Its
 * front is its upper side, or the lower one when `down`. */
static inline void add_rectangle(struct psc_builder *builder, const float x[2], const float z[2],
    float y, bool down, uint32_t material, const float world[12])
{
    const float positions[4][3] = {
        {x[0], y, z[0]}, {x[1], y, z[0]}, {x[1], y, z[1]}, {x[0], y, z[1]}};
    static const float uv[4][2] = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
    static const uint32_t up_order[6] = {0, 2, 1, 0, 3, 2}, down_order[6] = {0, 1, 2, 0, 2, 3};
    struct psc_mesh mesh = {.positions = positions,
        .uv0 = uv,
        .vertex_count = 4,
        .indices = down ? down_order : up_order,
        .index_count = 6,
        .material = material};
    uint32_t primitive;
    struct pen_error error = {0};
    if (!psc_builder_add_mesh(builder, &mesh, &primitive, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    psc_builder_add_instance(builder, primitive, world);
}

static inline uint32_t add_plain_material(struct psc_builder *builder, bool double_sided)
{
    struct psc_material material = psc_material_default();
    material.flags = double_sided ? PSC_DOUBLE_SIDED : 0;
    return psc_builder_add_material(builder, &material);
}

/* Finishes the builder and opens the result for tracing. */
static inline struct pen_trace_scene *finish_scene(
    struct psc_builder *builder, const struct pen_trace_scene_options *options)
{
    static const uint8_t source[PEN_ID_BYTES];
    struct pen_error error = {0};
    struct psc_scene blob;
    void *data = NULL;
    size_t bytes;
    if (!psc_builder_finish(builder, source, &data, &bytes, &error) ||
        !psc_open_memory(data, bytes, &blob, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    struct pen_trace_scene *scene = pen_trace_scene_create(&blob, options, &error);
    if (!scene) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    psc_close(&blob);
    free(data); /* the tracer must not need it any more */
    psc_builder_destroy(builder);
    return scene;
}

struct receivers {
    float positions[GRID * GRID][3], normals[GRID * GRID][3];
    float visibility[GRID * GRID][4], error[GRID * GRID];
};

/* A grid over [x0, x1] x [z0, z1] at y = 0; allocated. */
static inline struct receivers *grid_receivers(const float x[2], const float z[2])
{
    struct receivers *r = calloc(1, sizeof *r);
    for (int i = 0; i < GRID * GRID; i++) {
        r->positions[i][0] = x[0] + (x[1] - x[0]) * ((float)(i % GRID) + 0.5f) / GRID;
        r->positions[i][2] = z[0] + (z[1] - z[0]) * ((float)(i / GRID) + 0.5f) / GRID;
        r->normals[i][1] = 1;
    }
    return r;
}

static inline struct pen_trace_job job_of(const struct receivers *r, uint32_t samples)
{
    return (struct pen_trace_job){.positions = r->positions[0],
        .normals = r->normals[0],
        .width = GRID,
        .height = GRID,
        .samples = samples,
        .seed = 7};
}

static inline void trace(struct pen_trace_scene *scene, const struct pen_trace_light *light,
    const struct pen_trace_job *job, struct receivers *r)
{
    struct pen_trace_result result = {.visibility = r->visibility[0], .standard_error = r->error};
    struct pen_error error = {0};
    if (!pen_trace_visibility(scene, light, job, &result, NULL, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
}

/* Checks one channel against the truth: every receiver within 4.5 standard errors but for one in a
 * thousand, and the mean of all within 3 of its own. The error is estimated per receiver; it cannot
 * be known to better than a sample's worth. Returns the RMSE. */
static inline double check_truth(const char *name, const struct receivers *r, int channel,
    double (*truth)(const void *context, const float position[3]), const void *context,
    uint32_t samples)
{
    double sum = 0, squares = 0, variance = 0;
    int outside = 0;
    for (int i = 0; i < GRID * GRID; i++) {
        double difference = (double)r->visibility[i][channel] - truth(context, r->positions[i]);
        double error2 = (double)r->error[i] * (double)r->error[i] + 1.0 / samples / samples;
        outside += fabs(difference) > 4.5 * sqrt(error2);
        sum += difference;
        squares += difference * difference;
        variance += error2;
    }
    double rmse = sqrt(squares / (GRID * GRID));
    printf("%-34s %5u samples: mean error %+.6f, RMSE %.5f, beyond 4.5 SE: %d\n", name, samples,
        sum / (GRID * GRID), rmse, outside);
    CHECK(outside * 1000 <= GRID * GRID);
    CHECK_NEAR(sum / (GRID * GRID), 0, 3 * sqrt(variance) / (GRID * GRID));
    return rmse;
}
