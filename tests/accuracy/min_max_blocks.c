/* Every cell of the min-max pyramid against the texels of the map that it stands for. */
#include "renderer/passes/map/min_max.h"
#include "tests/accuracy/compute.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdlib.h>

#define NEAR_Z 0.5
#define FAR_Z 20.0
#define NOTHING 1e30

static struct technique_ctx ctx;

/* One texel in ten holds nothing. */
static void make_depth(float *depth, uint32_t side)
{
    for (uint32_t i = 0; i < side * side; i++)
        depth[i] = compute_random() < 0.1 ? 1.0f : (float)compute_random();
}

static double linear(double d, bool parallel)
{
    if (d >= 1)
        return NOTHING;
    return parallel ? NEAR_Z + d * (FAR_Z - NEAR_Z)
                    : NEAR_Z * FAR_Z / (FAR_Z - d * (FAR_Z - NEAR_Z));
}

static double error_of(double found, double expected)
{
    return expected == NOTHING ? (found < 0.999e30) : fabs(found / expected - 1);
}

static double check_level(const float *depth, uint32_t side, const struct gl_texture *pyramid,
    uint32_t level, bool parallel)
{
    uint32_t width = pyramid->width >> level ? pyramid->width >> level : 1, cell = 2u << level;
    float *found = malloc((size_t)width * width * 8);
    double worst = 0;
    gl.GetTextureImage(
        pyramid->name, (GLint)level, GL_RG, GL_FLOAT, (GLsizei)(width * width * 8), found);
    for (uint32_t y = 0; y < width; y++)
        for (uint32_t x = 0; x < width; x++) {
            uint32_t end_x = x + 1 == width ? side : (x + 1) * cell;
            uint32_t end_y = y + 1 == width ? side : (y + 1) * cell;
            double low = NOTHING, high = 0;
            for (uint32_t v = y * cell; v < end_y; v++)
                for (uint32_t u = x * cell; u < end_x; u++) {
                    double z = linear((double)depth[v * side + u], parallel);
                    low = fmin(low, z);
                    high = fmax(high, z);
                }
            const float *range = found + 2 * (y * width + x);
            worst = fmax(worst, error_of((double)range[0], low));
            worst = fmax(worst, error_of((double)range[1], high));
        }
    free(found);
    return worst;
}

static void check_side(uint32_t side, bool parallel)
{
    struct light_face face = {.near_z = (float)NEAR_Z, .far_z = (float)FAR_Z, .parallel = parallel};
    GLuint block = compute_buffer(&face, sizeof face, GL_UNIFORM_BUFFER, UBO_LIGHT);
    struct gl_texture map = gl_texture_create(GL_DEPTH_COMPONENT32F, side, side, 0, 1);
    struct gl_texture pyramid = gl_texture_create(GL_RG32F, side / 2, side / 2, 0, 0);
    struct pen_error error = {0};
    float *depth = malloc((size_t)side * side * 4);
    double worst = 0;
    make_depth(depth, side);
    gl.TextureSubImage2D(
        map.name, 0, 0, 0, (GLsizei)side, (GLsizei)side, GL_DEPTH_COMPONENT, GL_FLOAT, depth);
    CHECK(pass_min_max_levels(&ctx, &map, side, &pyramid, &error));
    for (uint32_t level = 0; level < pyramid.levels; level++)
        worst = fmax(worst, check_level(depth, side, &pyramid, level, parallel));
    fprintf(
        stderr, "side %4u, %u levels: worst relative error %.2g\n", side, pyramid.levels, worst);
    CHECK(worst < 1e-5);
    gl_texture_destroy(&map);
    gl_texture_destroy(&pyramid);
    gl.DeleteBuffers(1, &block);
    free(depth);
}

int main(void)
{
    struct gl_context *context;
    if (!compute_begin(&ctx, &context))
        return 77;
    static const uint32_t sides[] = {2, 64, 63, 100, 250, 999, 1024};
    for (uint32_t i = 0; i < sizeof sides / sizeof *sides; i++)
        check_side(sides[i], i % 2);
    compute_end(&ctx, context);
    CHECK_DONE();
}
