/* The blocks of the moment methods by themselves: the algebra of moments.glsl, run as it is on the
 * device, against distributions made by hand, and the blur. */
#include "renderer/passes/map/blur.h"
#include "tests/accuracy/compute.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static struct technique_ctx ctx;

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
    GLuint buffers[2] = {
        compute_buffer(mixtures, count * sizeof *mixtures, GL_SHADER_STORAGE_BUFFER, 0),
        compute_buffer(NULL, count * sizeof *results, GL_SHADER_STORAGE_BUFFER, 1)};
    compute_run((const char *const[]){"moments.glsl", NULL}, mixture_main, count / 64);
    gl.GetNamedBufferSubData(buffers[1], 0, (GLsizeiptr)(count * sizeof *results), results);
    gl.DeleteBuffers(2, buffers);
}

static const char pack_main[] = "layout(std430, binding = 0) buffer Moments { vec4 moments[]; };\n"
                                "void main() {\n"
                                "    uint i = gl_GlobalInvocationID.x;\n"
                                "    moments[i] = moments_unpack(moments_pack(moments[i]));\n"
                                "}\n";

/* The transform that goes into integers and back is linear and loses nothing. */
static void check_packing(void)
{
    static float in[64][4], out[64][4];
    double worst = 0;
    for (int i = 0; i < 64; i++) {
        double z = 2 * compute_random() - 1;
        for (int k = 0; k < 4; k++)
            in[i][k] = (float)pow(z, k + 1);
    }
    GLuint buffer = compute_buffer(in, sizeof in, GL_SHADER_STORAGE_BUFFER, 0);
    compute_run((const char *const[]){"moments.glsl", NULL}, pack_main, 1);
    gl.GetNamedBufferSubData(buffer, 0, sizeof out, out);
    gl.DeleteBuffers(1, &buffer);
    for (int i = 0; i < 64; i++)
        for (int k = 0; k < 4; k++)
            worst = fmax(worst, fabs((double)out[i][k] - in[i][k]));
    CHECK(worst < 1e-6);
}

/* Blockers at one depth, the rest at the receiver's: every method is exact, for all shares. */
static void check_two_planes(void)
{
    enum { COUNT = 1024 };
    static struct mixture mixtures[COUNT];
    static float results[COUNT][4];
    double worst[4] = {0};
    for (int i = 0; i < COUNT; i++) {
        float p = (float)(0.02 + 0.96 * compute_random());
        float t = (float)(0.3 + 0.7 * compute_random()), z = (float)((t - 0.1) * compute_random());
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
    CHECK(worst[MOMENT] < 1e-4);
    CHECK(worst[MEAN_BLOCKER] < 1e-4);
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
    CHECK(results[0][MOMENT] < 1e-4);
    CHECK_NEAR(results[1][MOMENT], 0.4, 1e-4); /* two blockers and the receiver: exact */
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
        double a = compute_random(), b = compute_random() * (1 - a);
        mixtures[i] = (struct mixture){
            {(float)compute_random(), (float)compute_random(), (float)compute_random()},
            {(float)a, (float)b, (float)(1 - a - b)}, (float)compute_random(), 0};
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
    struct gl_context *context;
    if (!compute_begin(&ctx, &context))
        return 77;
    check_packing();
    check_two_planes();
    check_leaks();
    check_bounded();
    check_blur();
    compute_end(&ctx, context);
    CHECK_DONE();
}
