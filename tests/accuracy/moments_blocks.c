/* The blocks of the moment methods by themselves: summed-area tables against sums in double, and
 * the algebra of moments.glsl, run as it is on the device, against distributions made by hand. */
#include "renderer/gl/context.h"
#include "renderer/gl/source.h"
#include "renderer/passes/blur.h"
#include "renderer/passes/sat.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct technique_ctx ctx;

static const char *source(const char *name)
{
    const struct gl_source *s = gl_sources;
    while (s->name && strcmp(s->name, name))
        s++;
    return s->name ? s->text : "";
}

/* Runs `main_text` after the named shader files, 64 invocations per group. */
static void run_compute(const char *const *files, const char *main_text, uint32_t groups)
{
    const char *texts[8] = {"#version 450 core\nlayout(local_size_x = 64) in;\n"};
    int count = 1;
    for (; files[count - 1]; count++)
        texts[count] = source(files[count - 1]);
    texts[count++] = main_text;
    GLuint shader = gl.CreateShader(GL_COMPUTE_SHADER), program = gl.CreateProgram();
    gl.ShaderSource(shader, count, texts, NULL);
    gl.CompileShader(shader);
    gl.AttachShader(program, shader);
    gl.LinkProgram(program);
    GLint ok = 0;
    char log[2048] = "";
    gl.GetShaderInfoLog(shader, sizeof log, NULL, log);
    gl.GetProgramiv(program, GL_LINK_STATUS, &ok);
    if (!ok)
        fprintf(stderr, "%s\n", log);
    CHECK(ok);
    gl.UseProgram(program);
    gl.DispatchCompute(groups, 1, 1);
    gl.MemoryBarrier(GL_BUFFER_UPDATE_BARRIER_BIT);
    gl.Finish();
    gl.DeleteShader(shader);
    gl.DeleteProgram(program);
}

static GLuint storage(const void *data, size_t bytes, GLenum target, GLuint binding)
{
    GLuint buffer;
    gl.CreateBuffers(1, &buffer);
    gl.NamedBufferStorage(buffer, (GLsizeiptr)bytes, data, 0);
    gl.BindBufferBase(target, binding, buffer);
    return buffer;
}

static double uniform_random(void)
{
    return rand() / (RAND_MAX + 1.0);
}

/* Depth with a slope, steps and noise, as a map has it. */
static void make_depth(double *depth, uint32_t side)
{
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++) {
            double slope = 0.3 + 0.5 * x / side + 0.1 * y / side;
            double step = (x / 37 + y / 53) % 3 == 0 ? 0.25 : 0;
            depth[y * side + x] = slope - step + 0.01 * uniform_random();
        }
}

struct window {
    float low[2], high[2];
};

/* Integral of the texels' boxes over the window, and of their squares, divided by its area. */
static void exact_mean(const double *depth, uint32_t side, const struct window *w, double mean[2])
{
    mean[0] = mean[1] = 0;
    for (uint32_t y = (uint32_t)w->low[1]; y < side && y < w->high[1]; y++)
        for (uint32_t x = (uint32_t)w->low[0]; x < side && x < w->high[0]; x++) {
            double cover = (fmin(x + 1.0, w->high[0]) - fmax(x, w->low[0])) *
                           (fmin(y + 1.0, w->high[1]) - fmax(y, w->low[1]));
            double z = depth[y * side + x];
            mean[0] += cover * z;
            mean[1] += cover * z * z;
        }
    double area = ((double)w->high[0] - w->low[0]) * ((double)w->high[1] - w->low[1]);
    mean[0] /= area, mean[1] /= area;
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
    const double *depth, uint32_t side, const struct gl_texture *sat, double scale)
{
    enum { COUNT = 256 };
    static struct window windows[COUNT];
    static float means[COUNT][2][4];
    for (int i = 0; i < COUNT; i++)
        for (int k = 0; k < 2; k++) {
            double from = i % 4 ? side / 2.0 : 0, size = i % 3 ? 1 + 62 * uniform_random() : 4;
            double low = from + (side - from - 64) * uniform_random();
            windows[i].low[k] = (float)low;
            windows[i].high[k] = (float)(low + size);
        }
    windows[0] =
        (struct window){{(float)side - 3.5f, (float)side - 64}, {(float)side, (float)side}};
    struct sat_block block = {(float)(1 / scale), (float)side, {64, 64}};
    GLuint buffers[3] = {storage(windows, sizeof windows, GL_SHADER_STORAGE_BUFFER, 0),
        storage(NULL, sizeof means, GL_SHADER_STORAGE_BUFFER, 1),
        storage(&block, sizeof block, GL_UNIFORM_BUFFER, 3)};
    gl.BindTextureUnit(8, sat->name);
    run_compute((const char *const[]){"light.glsl", "sat.glsl", NULL}, window_main, COUNT / 64);
    gl.GetNamedBufferSubData(buffers[1], 0, sizeof means, means);
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        double mean[2];
        exact_mean(depth, side, &windows[i], mean);
        worst = fmax(worst, fmax(fabs(means[i][0][0] - mean[0]), fabs(means[i][0][1] - mean[1])));
        struct window whole;
        for (int k = 0; k < 2; k++) {
            whole.low[k] = floorf(windows[i].low[k]);
            whole.high[k] = fminf(floorf(windows[i].high[k]) + 1, (float)side);
        }
        if (windows[i].high[0] >= side) /* the shader's helper takes no window past the border */
            continue;
        exact_mean(depth, side, &whole, mean);
        worst = fmax(worst, fmax(fabs(means[i][1][0] - mean[0]), fabs(means[i][1][1] - mean[1])));
    }
    fprintf(stderr, "sat %u: worst error of a window mean %.3g\n", side, worst);
    CHECK(worst < 1e-6);
    gl.DeleteBuffers(3, buffers);
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
            check_window_means(depth, side, &to[i], scale);
    gl_texture_destroy(&from);
    gl_texture_destroy(&to[0]);
    gl_texture_destroy(&to[1]);
    free(depth), free(in), free(host), free(device);
}

/* A mixture of depths in [0, 1] and the depth t it is compared with. */
struct mixture {
    float depth[3], share[3], t;
    float pad;
};

static const char mixture_main[] =
    "struct Mixture { float z[3]; float w[3]; float t; float pad; };\n"
    "layout(std430, binding = 0) buffer Mixtures { Mixture mixtures[]; };\n"
    "layout(std430, binding = 1) buffer Results { vec4 results[]; };\n"
    "void main() {\n"
    "    Mixture x = mixtures[gl_GlobalInvocationID.x];\n"
    "    vec2 m = vec2(0.0); vec4 b = vec4(0.0), e = vec4(0.0);\n"
    "    const vec2 c = vec2(40.0, 5.0);\n"
    "    for (int i = 0; i < 3; i++) {\n"
    "        float u = x.z[i], z = 2.0 * u - 1.0, z2 = z * z;\n"
    "        vec2 w = exponential_warp(z, c);\n"
    "        m += x.w[i] * vec2(u, u * u);\n"
    "        b += x.w[i] * moments_pack(vec4(z, z2, z2 * z, z2 * z2));\n"
    "        e += x.w[i] * vec4(w, w * w);\n"
    "    }\n"
    "    vec2 t = exponential_warp(2.0 * x.t - 1.0, c);\n"
    "    vec4 unpacked = moments_bias(moments_unpack(b), 6e-7);\n"
    "    vec2 blockers = moment_blockers(unpacked, 2.0 * x.t - 1.0, 1e-7);\n"
    "    results[gl_GlobalInvocationID.x] = vec4(chebyshev(m, x.t, 0.0),\n"
    "        min(chebyshev(e.xz, t.x, 0.0), chebyshev(e.yw, t.y, 0.0)),\n"
    "        1.0 - moment_shadow(unpacked, 2.0 * x.t - 1.0), 0.5 + 0.5 * blockers.y);\n"
    "}\n";

enum { VARIANCE, EXPONENTIAL, MOMENT, MEAN_BLOCKER };

static void evaluate(const struct mixture *mixtures, uint32_t count, float (*results)[4])
{
    CHECK(count % 64 == 0);
    GLuint buffers[2] = {storage(mixtures, count * sizeof *mixtures, GL_SHADER_STORAGE_BUFFER, 0),
        storage(NULL, count * sizeof *results, GL_SHADER_STORAGE_BUFFER, 1)};
    run_compute((const char *const[]){"moments.glsl", NULL}, mixture_main, count / 64);
    gl.GetNamedBufferSubData(buffers[1], 0, (GLsizeiptr)(count * sizeof *results), results);
    gl.DeleteBuffers(2, buffers);
}

/* Blockers at one depth, the rest at the receiver's: every method is exact, for all shares. */
static void check_two_planes(void)
{
    enum { COUNT = 1024 };
    static struct mixture mixtures[COUNT];
    static float results[COUNT][4];
    double worst[4] = {0};
    for (int i = 0; i < COUNT; i++) {
        float p = (float)(0.02 + 0.96 * uniform_random());
        float t = (float)(0.3 + 0.7 * uniform_random()), z = (float)((t - 0.1) * uniform_random());
        mixtures[i] = (struct mixture){{z, t, t}, {p, 1 - p, 0}, t, 0};
    }
    evaluate(mixtures, COUNT, results);
    for (int i = 0; i < COUNT; i++) {
        double expected = mixtures[i].share[1];
        for (int k = 0; k < 3; k++)
            worst[k] = fmax(worst[k], fabs(results[i][k] - expected));
        worst[3] = fmax(worst[3], fabs(results[i][MEAN_BLOCKER] - mixtures[i].depth[0]));
    }
    fprintf(stderr, "two planes, worst: vsm %.2g evsm %.2g msm %.2g mean blocker %.2g\n", worst[0],
        worst[1], worst[2], worst[3]);
    CHECK(worst[VARIANCE] < 1e-4);
    CHECK(worst[EXPONENTIAL] < 1e-4);
    CHECK(worst[MOMENT] < 2e-3);
    CHECK(worst[MEAN_BLOCKER] < 2e-3);
}

/* Light that reaches t through blockers that fill the window: 0 in truth. Values of techniques 2.4,
 * 4.1 and 4.2, by hand or in double. */
static void check_leaks(void)
{
    static struct mixture mixtures[64];
    static float results[64][4];
    for (int i = 0; i < 64; i++)
        mixtures[i] = (struct mixture){{1, 1, 1}, {1, 0, 0}, 1, 0};
    mixtures[0] = (struct mixture){{0.2f, 0.8f, 0.8f}, {0.5f, 0.5f, 0}, 1, 0};
    mixtures[1] = (struct mixture){{0.2f, 0.8f, 1}, {0.5f, 0.1f, 0.4f}, 1, 0};
    mixtures[2] = (struct mixture){{0.2f, 0.5f, 0.8f}, {1 / 3.f, 1 / 3.f, 1 / 3.f}, 1, 0};
    mixtures[3] = (struct mixture){{0.8f, 0.9f, 0.9f}, {0.5f, 0.5f, 0}, 0.95f, 0};
    mixtures[4] = (struct mixture){{0.5f, 0.5f, 0.5f}, {1, 0, 0}, 0.5f, 0};
    mixtures[5] = (struct mixture){{0.5f, 0.5f, 0.5f}, {1, 0, 0}, 0.499f, 0};
    mixtures[6] = (struct mixture){{0.5f, 0.5f, 0.5f}, {1, 0, 0}, 0.6f, 0};
    evaluate(mixtures, 64, results);
    CHECK_NEAR(results[0][VARIANCE], 0.2647, 0.001);
    CHECK(results[0][EXPONENTIAL] < 1e-4);
    CHECK(results[0][MOMENT] < 1e-3);
    CHECK_NEAR(results[1][MOMENT], 0.4, 2e-3); /* two blockers and the receiver: exact */
    CHECK_NEAR(results[1][VARIANCE], 0.4556, 0.001);
    CHECK_NEAR(results[2][MOMENT], 0.04, 0.003);
    CHECK_NEAR(results[2][VARIANCE], 0.194, 0.005);
    CHECK(results[3][EXPONENTIAL] < 2e-4);
    CHECK_NEAR(results[4][MOMENT], 1, 1e-3);
    CHECK_NEAR(results[5][MOMENT], 1, 1e-3);
    CHECK_NEAR(results[6][MOMENT], 0, 1e-3);
    for (int i = 0; i < 64; i++)
        for (int k = 0; k < 4; k++)
            CHECK(isfinite(results[i][k]));
}

/* No depths at all may make a share below 0, above 1 or not a number. */
static void check_bounded(void)
{
    enum { COUNT = 4096 };
    static struct mixture mixtures[COUNT];
    static float results[COUNT][4];
    for (int i = 0; i < COUNT; i++) {
        double a = uniform_random(), b = uniform_random() * (1 - a);
        mixtures[i] = (struct mixture){
            {(float)uniform_random(), (float)uniform_random(), (float)uniform_random()},
            {(float)a, (float)b, (float)(1 - a - b)}, (float)uniform_random(), 0};
        if (i % 8 == 0) /* almost one depth */
            mixtures[i].depth[1] = mixtures[i].depth[2] = mixtures[i].depth[0];
    }
    evaluate(mixtures, COUNT, results);
    double worst = 0;
    for (int i = 0; i < COUNT; i++) {
        double lit = 0;
        for (int k = 0; k < 3; k++) {
            CHECK(results[i][k] >= 0 && results[i][k] <= 1);
            if (mixtures[i].depth[k] >= mixtures[i].t)
                lit += mixtures[i].share[k];
        }
        /* All three are upper bounds of the light. */
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, lit - results[i][k]);
    }
    fprintf(stderr, "random mixtures: light below the truth by at most %.3g\n", worst);
    CHECK(worst < 0.01);
}

static void check_blur(void)
{
    for (uint32_t radius = 0; radius <= BLUR_MAX_RADIUS; radius++) {
        float weights[BLUR_MAX_RADIUS + 1];
        blur_weights(radius, weights);
        double sum = weights[0];
        for (uint32_t i = 1; i <= radius; i++)
            sum += 2 * weights[i];
        CHECK_NEAR(sum, 1, 1e-6);
    }
    /* A point spreads to the product of the weights. */
    enum { SIDE = 32 };
    static float image[SIDE][SIDE][2];
    image[16][12][0] = 1;
    image[16][12][1] = 3;
    struct gl_texture t = gl_texture_create(GL_RG32F, SIDE, SIDE, 0, 0);
    struct pen_error error = {0};
    gl.TextureSubImage2D(t.name, 0, 0, 0, SIDE, SIDE, GL_RG, GL_FLOAT, image);
    CHECK(pass_blur(&ctx, &t, 3, &error));
    gl.GetTextureImage(t.name, 0, GL_RG, GL_FLOAT, sizeof image, image);
    float w[BLUR_MAX_RADIUS + 1];
    blur_weights(3, w);
    CHECK_NEAR(image[16][12][0], w[0] * w[0], 1e-6);
    CHECK_NEAR(image[14][13][1], 3 * w[2] * w[1], 1e-6);
    CHECK_NEAR(image[13][9][0], w[3] * w[3], 1e-6);
    CHECK(image[12][12][0] == 0 && image[16][16][0] == 0);
    float top[2];
    gl.GetTextureImage(t.name, 5, GL_RG, GL_FLOAT, sizeof top, top);
    CHECK_NEAR(top[0], 1.0 / (SIDE * SIDE), 1e-6); /* the mips keep the mean */
    gl_texture_destroy(&t);
}

int main(void)
{
    struct pen_error error = {0};
    struct pen_renderer_config config = {.debug = true};
    struct gl_context *context = gl_context_create(&config, &ctx.device, &error);
    if (!context) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    ctx.programs = gl_programs_create();
    gl_samplers_init(&ctx.samplers);
    gl_timer_init(&ctx.timer, ctx.device.software);
    gl.CreateVertexArrays(1, &ctx.empty_array);
    check_sat(64, GL_RG32UI);
    check_sat(300, GL_RGBA32UI);
    check_sat(1024, GL_RG32UI);
    check_two_planes();
    check_leaks();
    check_bounded();
    check_blur();
    gl.DeleteVertexArrays(1, &ctx.empty_array);
    gl_timer_finish(&ctx.timer);
    gl_samplers_finish(&ctx.samplers);
    gl_programs_destroy(ctx.programs);
    gl_context_destroy(context);
    CHECK_DONE();
}
