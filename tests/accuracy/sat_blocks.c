/* Summed-area tables against sums in double, on both paths, and what Chebyshev makes of them. */
#include "renderer/passes/map/sat.h"
#include "tests/accuracy/compute.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct technique_ctx ctx;

/* Depth with a slope, steps and noise, as a map has it. */
static void make_depth(double *depth, uint32_t side)
{
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double slope = 0.3 + 0.5 * x / side + 0.1 * y / side;
            double step = (x / 37 + y / 53) % 3 == 0 ? 0.25 : 0;
            depth[y * side + x] = slope - step + 0.01 * compute_random();
        }
}

struct window {
    float low[2], high[2];
};

/* Integral of four powers of the texels' boxes over the window, divided by its area. */
static void exact_mean(const double *depth, uint32_t side, const struct window *w, double mean[4])
{
    memset(mean, 0, 4 * sizeof *mean);
    for (uint32_t y = (uint32_t)w->low[1]; y < side && y < w->high[1]; y++)
        for (uint32_t x = (uint32_t)w->low[0]; x < side && x < w->high[0]; x++) {
            double cover = (fmin(x + 1.0, w->high[0]) - fmax(x, w->low[0])) *
                           (fmin(y + 1.0, w->high[1]) - fmax(y, w->low[1]));
            double z = depth[y * side + x], power = cover;
            for (int k = 0; k < 4; k++)
                mean[k] += power *= z;
        }
    double area = ((double)w->high[0] - w->low[0]) * ((double)w->high[1] - w->low[1]);
    for (int k = 0; k < 4; k++)
        mean[k] /= area;
}

static double worst_of(const float found[4], const double expected[4], uint32_t n)
{
    double worst = 0;
    for (uint32_t k = 0; k < n; k++)
        worst = fmax(worst, fabs(found[k] - expected[k]));
    return worst;
}

static const char window_main[] =
    "layout(std430, binding = 0) buffer Windows { vec4 windows[]; };\n"
    "layout(std430, binding = 1) buffer Means { vec4 means[]; };\n"
    "void main() {\n"
    "    uint i = gl_GlobalInvocationID.x;\n"
    "    vec4 w = windows[i];\n"
    "    means[2u * i] = sat_mean(w.xy, w.zw);\n"
    "    means[2u * i + 1u] = sat_mean_whole(ivec2(w.xy), ivec2(w.zw) + 1);\n"
    "}\n";

/* Windows of up to 64 texels anywhere, most of them in the far quadrant. */
static void check_window_means(
    const double *depth, uint32_t side, uint32_t n, const struct gl_texture *sat, double scale)
{
    enum { COUNT = 256 };
    static struct window windows[COUNT];
    static float means[COUNT][2][4];
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 2; k++) {
            double from = i % 4 ? side / 2.0 : 0, size = i % 3 ? 1 + 62 * compute_random() : 4;
            double low = from + (side - from - 64) * compute_random();
            windows[i].low[k] = (float)low;
            windows[i].high[k] = (float)(low + size);
        }
    windows[0] =
        (struct window){{(float)side - 3.5f, (float)side - 64}, {(float)side, (float)side}};
    struct sat_block block = {(float)(1 / scale), (float)side, {64, 64}};
    GLuint buffers[3] = {compute_buffer(windows, sizeof windows, GL_SHADER_STORAGE_BUFFER, 0),
        compute_buffer(NULL, sizeof means, GL_SHADER_STORAGE_BUFFER, 1),
        compute_buffer(&block, sizeof block, GL_UNIFORM_BUFFER, UBO_EXTRA)};
    gl.BindTextureUnit(UNIT_SAT, sat->name);
    compute_run((const char *const[]){"light.glsl", "sat.glsl", NULL}, window_main, COUNT / 64);
    gl.GetNamedBufferSubData(buffers[1], 0, sizeof means, means);
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        double mean[4];
        exact_mean(depth, side, &windows[i], mean);
        worst = fmax(worst, worst_of(means[i][0], mean, n));
        struct window whole;
        for (int k = 0; k < 2; k++) {
            whole.low[k] = floorf(windows[i].low[k]);
            whole.high[k] = fminf(floorf(windows[i].high[k]) + 1, (float)side);
        }
        if (windows[i].high[0] >= side) /* the shader's helper takes no window past the border */
            continue;
        exact_mean(depth, side, &whole, mean);
        worst = fmax(worst, worst_of(means[i][1], mean, n));
    }
    fprintf(stderr, "sat %u: worst error of a window mean %.3g\n", side, worst);
    CHECK(worst < 1e-6);
    gl.DeleteBuffers(3, buffers);
}

static const char planes_main[] =
    "layout(std430, binding = 0) buffer Windows { vec4 windows[]; };\n"
    "layout(std430, binding = 1) buffer Results { vec4 results[]; };\n"
    "void main() {\n"
    "    vec4 w = windows[gl_GlobalInvocationID.x];\n"
    "    const float t = 0.8;\n"
    "    vec4 m = sat_mean(w.xy, w.zw);\n"
    "    float p = chebyshev(m.xy, t, 0.0);\n"
    "    results[gl_GlobalInvocationID.x] = vec4(p, (m.x - p * t) / (1.0 - p), 0.0, 0.0);\n"
    "}\n";

/* Blockers at 0.3 in the left part of a map, the receiver's plane in the rest: visibility and mean
 * blocker by Chebyshev are exact, from the table too. */
static void check_two_planes_in_table(void)
{
    enum { SIDE = 1024, COUNT = 256, EDGE = 700 };
    static struct window windows[COUNT];
    static float results[COUNT][4];
    double scale = floor(4294967295.0 / (66 * 66)), worst_v = 0, worst_z = 0;
    uint32_t *in = malloc(2 * SIDE * SIDE * sizeof *in);
    for (uint32_t i = 0; i < SIDE * SIDE; i++) {
        double z = i % SIDE < EDGE ? 0.3 : 0.8;
        in[2 * i] = (uint32_t)lround(z * scale), in[2 * i + 1] = (uint32_t)lround(z * z * scale);
    }
    struct gl_texture from = gl_texture_create(GL_RG32UI, SIDE, SIDE, 0, 1),
                      to = gl_texture_create(GL_RG32UI, SIDE + 1, SIDE + 1, 0, 1);
    gl.TextureSubImage2D(from.name, 0, 0, 0, SIDE, SIDE, GL_RG_INTEGER, GL_UNSIGNED_INT, in);
    struct pen_error error = {0};
    CHECK(sat_scan(&ctx, &from, &to, SAT_HOST, &error));
    for (int i = 0; i < COUNT; i++) {
        double size = 8 + 54 * compute_random(), share = 0.05 + 0.9 * compute_random();
        windows[i].low[0] = (float)(EDGE - share * size);
        windows[i].low[1] = (float)(900 * compute_random());
        for (int k = 0; k < 2; k++)
            windows[i].high[k] = windows[i].low[k] + (float)size;
    }
    struct sat_block block = {(float)(1 / scale), SIDE, {64, 64}};
    GLuint buffers[3] = {compute_buffer(windows, sizeof windows, GL_SHADER_STORAGE_BUFFER, 0),
        compute_buffer(NULL, sizeof results, GL_SHADER_STORAGE_BUFFER, 1),
        compute_buffer(&block, sizeof block, GL_UNIFORM_BUFFER, UBO_EXTRA)};
    gl.BindTextureUnit(UNIT_SAT, to.name);
    compute_run((const char *const[]){"light.glsl", "sat.glsl", "moments.glsl", NULL}, planes_main,
        COUNT / 64);
    gl.GetNamedBufferSubData(buffers[1], 0, sizeof results, results);
    for (int i = 0; i < COUNT; i++) {
        double lit =
            ((double)windows[i].high[0] - EDGE) / ((double)windows[i].high[0] - windows[i].low[0]);
        worst_v = fmax(worst_v, fabs(results[i][0] - lit));
        worst_z = fmax(worst_z, fabs(results[i][1] - 0.3));
    }
    fprintf(stderr, "two planes from a table, worst: visibility %.2g, mean blocker %.2g\n", worst_v,
        worst_z);
    CHECK(worst_v < 1e-4);
    CHECK(worst_z < 1e-4);
    gl.DeleteBuffers(3, buffers);
    gl_texture_destroy(&from);
    gl_texture_destroy(&to);
    free(in);
}

static void check_sat(uint32_t side, GLenum format)
{
    uint32_t n = format == GL_RGBA32UI ? 4 : 2;
    GLenum layout = n == 4 ? GL_RGBA_INTEGER : GL_RG_INTEGER;
    size_t in_bytes = (size_t)side * side * n * 4,
           out_bytes = (size_t)(side + 1) * (side + 1) * n * 4;
    double *depth = malloc((size_t)side * side * sizeof *depth);
    uint32_t *in = malloc(in_bytes), *host = malloc(out_bytes), *device = malloc(out_bytes);
    double scale = floor(4294967295.0 / (66 * 66));
    make_depth(depth, side);
    for (size_t i = 0; i < (size_t)side * side; i++)
        for (uint32_t k = 0; k < n; k++)
            in[n * i + k] = (uint32_t)lround(pow(depth[i], k + 1) * scale);
    struct gl_texture from = gl_texture_create(format, side, side, 0, 1);
    struct gl_texture to[2];
    gl.TextureSubImage2D(
        from.name, 0, 0, 0, (GLsizei)side, (GLsizei)side, layout, GL_UNSIGNED_INT, in);
    uint32_t *results[2] = {host, device};
    static const enum sat_path paths[2] = {SAT_HOST, SAT_COMPUTE};
    for (int i = 0; i < 2; i++) {
        struct pen_error error = {0};
        to[i] = gl_texture_create(format, side + 1, side + 1, 0, 1);
        double begun = gl_now_ms();
        CHECK(sat_scan(&ctx, &from, &to[i], paths[i], &error));
        gl.Finish();
        fprintf(stderr, "sat %u x %u, %s: %.2f ms\n", side, n, i ? "compute" : "host",
            gl_now_ms() - begun);
        gl.GetTextureImage(to[i].name, 0, layout, GL_UNSIGNED_INT, (GLsizei)out_bytes, results[i]);
    }
    CHECK(!memcmp(host, device, out_bytes));
    /* The sums themselves: the last corner is the total. */
    uint32_t total = 0;
    for (size_t i = 0; i < (size_t)side * side; i++)
        total += in[n * i + n - 1];
    CHECK(device[out_bytes / 4 - 1] == total);
    CHECK(device[0] == 0 && device[n * side] == 0);
    if (side >= 256)
        for (int i = 0; i < 2; i++)
            check_window_means(depth, side, n, &to[i], scale);
    gl_texture_destroy(&from);
    gl_texture_destroy(&to[0]);
    gl_texture_destroy(&to[1]);
    free(depth), free(in), free(host), free(device);
}

int main(void)
{
    struct gl_context *context;
    if (!compute_begin(&ctx, &context))
        return 77;
    check_sat(64, GL_RG32UI);
    check_sat(300, GL_RGBA32UI);
    check_sat(1024, GL_RG32UI);
    check_two_planes_in_table();
    compute_end(&ctx, context);
    CHECK_DONE();
}
