/* Few rays and a filter: against closed forms and against many rays, which it shares no pixel's worth
 * of sampling with. */
#include "tests/accuracy/quads.h"
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

#define METHOD "technique=denoised&"
#define NARROW                                                                                     \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"                     \
    "&light.width=0.1&light.height=0.1"
#define SMALL "&width=160&height=120"

static struct deviation measure(const uint8_t *id, const char *method, const char *light,
    const struct planar_case *planar, truth_function truth)
{
    char settings[640];
    struct shot shot;
    snprintf(settings, sizeof settings, "%s" HARNESS_VIEW "%s", method, light);
    harness_shot(id, settings, &shot);
    struct deviation d = harness_deviation(&shot, truth, planar);
    CHECK(harness_not_finite(&shot) == 0);
    harness_shot_finish(&shot);
    return d;
}

static void scene(uint32_t kind, uint8_t id[PEN_ID_BYTES])
{
    harness_scene(&(struct pen_generated_options){.kind = kind}, id);
}

static void check_closed_forms(void)
{
    static const struct {
        const char *name, *light;
        uint32_t kind;
        struct planar_case planar;
        truth_function truth;
        double most; /* rmse in the penumbra */
    } rows[] = {
        {"T1, rect", HARNESS_RECT, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.5, 0}, truth_half_plane,
            0.012},
        {"T1, narrow", NARROW, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.05, 0}, truth_half_plane, 0.04},
        {"T2, rect", HARNESS_RECT, PEN_GENERATED_SQUARE, {1.2, 3, 0.5, 0.4}, truth_square, 0.012},
        {"T3, disk", HARNESS_DISK, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.5, 0},
            truth_half_plane_disk, 0.012},
    };
    for (uint32_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint8_t id[PEN_ID_BYTES];
        scene(rows[i].kind, id);
        struct deviation d = measure(id, METHOD, rows[i].light, &rows[i].planar, rows[i].truth);
        fprintf(stderr, "%s: rmse %.5f, in penumbra %.5f, mean error %+.5f, worst %.4f\n",
            rows[i].name, d.rmse, d.rmse_penumbra, d.mean, d.worst);
        CHECK(d.pixels > 10000);
        CHECK(d.rmse_penumbra < rows[i].most);
        CHECK(fabs(d.mean) < 0.002);
        CHECK(d.worst < 0.3);
    }
}

/* Beyond the reach of a filter nothing is between dark and light. */
static void check_far_from_edges(void)
{
    const struct planar_case t = {1.2, 3, 0.5, 0};
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    uint32_t counts[2] = {0};
    scene(PEN_GENERATED_HALF_PLANE, id);
    harness_shot(id, METHOD HARNESS_VIEW HARNESS_RECT, &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        double x = (double)p[0], z = (double)p[2], far = x < 0 ? x + 0.15 : x - 0.15;
        double truth = truth_half_plane(x, z, &t);
        if (fabsf(p[1]) > 1e-3f || truth_half_plane(far, z, &t) != truth ||
            truth * (1 - truth) != 0)
            continue;
        counts[truth == 1]++;
        for (int c = 0; c < 4; c++)
            CHECK(shot.visibility[4 * i + c] == (float)truth);
    }
    CHECK(counts[0] > 1000 && counts[1] > 1000);
    harness_shot_finish(&shot);
}

static void check_more_rays(void)
{
    const struct planar_case t = {1.2, 3, 0.5, 0}, narrow = {1.2, 3, 0.05, 0};
    uint8_t id[PEN_ID_BYTES];
    double before[2] = {INFINITY, INFINITY};
    scene(PEN_GENERATED_HALF_PLANE, id);
    for (uint32_t n = 1; n <= 16; n *= 4) {
        char method[128];
        double now[2];
        snprintf(method, sizeof method, METHOD "refine=0&samples=%u&", n);
        now[0] = measure(id, method, HARNESS_RECT, &t, truth_half_plane).rmse_penumbra;
        snprintf(method, sizeof method, METHOD "budget=64&refine=%u&", 4 * n);
        now[1] = measure(id, method, NARROW, &narrow, truth_half_plane).rmse_penumbra;
        fprintf(stderr, "%u rays %.5f, %u more %.5f\n", n, now[0], 4 * n, now[1]);
        for (int k = 0; k < 2; k++)
            CHECK(now[k] < 0.75 * before[k]);
        memcpy(before, now, sizeof now);
    }
}

static double rmse_between(const struct shot *a, const struct shot *b, bool penumbra)
{
    double sum = 0;
    uint32_t n = 0;
    for (uint32_t i = 0; i < a->width * a->height; i++) {
        double truth = (double)b->visibility[4 * i + 3];
        if (penumbra && (truth < 0.02 || truth > 0.98))
            continue;
        sum += pow((double)a->visibility[4 * i + 3] - truth, 2);
        n++;
    }
    return sqrt(sum / (n ? n : 1));
}

/* Lights of all kinds over alpha-masked leaves and all: clearly better than percentage-closer
 * filtering, and not beyond `most`. */
static void check_against_many_rays(void)
{
    static const struct {
        const char *light;
        double most;
    } rows[] = {
        {"", 0.075},
        {"&light.type=disk&light.position=2,4,3&light.radius=0.5", 0.075},
        {"&light.type=sphere&light.position=2,3,3&light.radius=0.3", 0.075},
        {"&light.type=sun&light.position=2,4,3&light.angular_diameter_deg=4", 0.075},
        {"&lights.0.type=rect&lights.0.position=2,4,3&lights.1.type=disk&lights.1.position=-2,3,1",
            0.075},
        {"&light.type=rect&light.position=2,4,3&light.width=2&light.height=1"
         "&light.texture.pattern=checker",
            0.075},
    };
    static const char *const methods[] = {
        "raytraced&samples=256&adaptive=false", "denoised&budget=8", "pcss"};
    uint8_t id[PEN_ID_BYTES];
    scene(PEN_GENERATED_DEMO, id);
    for (uint32_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        struct shot shots[3];
        double error[3];
        for (int k = 0; k < 3; k++) {
            char text[512];
            snprintf(text, sizeof text, "technique=%s" SMALL "%s", methods[k], rows[i].light);
            harness_shot(id, text, &shots[k]);
            error[k] = rmse_between(&shots[k], &shots[0], true);
        }
        fprintf(
            stderr, "demo%s: %.4f in the penumbra, pcss %.4f\n", rows[i].light, error[1], error[2]);
        CHECK(error[1] < rows[i].most && error[1] < 0.65 * error[2]);
        CHECK(harness_not_finite(&shots[1]) == 0);
        for (int k = 0; k < 3; k++)
            harness_shot_finish(&shots[k]);
    }
}

/* A point hides all or nothing: the same rays as many others. */
static void check_points(void)
{
    static const char *const lights[] = {"&light.type=point&light.position=0.5,1.8,0.3",
        "&light.type=spot&light.position=0.5,1.8,0.3&light.target=0,0,0"};
    uint8_t id[PEN_ID_BYTES];
    scene(PEN_GENERATED_SQUARE, id);
    for (int i = 0; i < 2; i++) {
        struct shot shots[2];
        for (int k = 0; k < 2; k++) {
            char text[512];
            snprintf(text, sizeof text, "technique=%s&" HARNESS_VIEW "%s",
                k ? "raytraced" : "denoised", lights[i]);
            harness_shot(id, text, &shots[k]);
        }
        CHECK(rmse_between(&shots[0], &shots[1], false) == 0);
        for (int k = 0; k < 2; k++)
            harness_shot_finish(&shots[k]);
    }
}

/* T1 under a caster that lets 3 / 5 of the light through. */
static double truth_blended(double x, double z, const void *user)
{
    return 1 - 0.4 * (1 - truth_half_plane(x, z, user));
}

static void check_blended(void)
{
    static const struct quad quads[] = {
        {.half_u = {4, 0, 0}, .half_v = {0, 0, -4}, .color = {1, 1, 1, 1}},
        {{-2, 1.2f, 0}, {2, 0, 0}, {0, 0, -4}, {1, 1, 1, 0.4f}},
    };
    const struct planar_case t = {1.2, 3, 0.5, 0};
    uint8_t id[PEN_ID_BYTES];
    load_quads(quads, 2, false, id);
    struct deviation d = measure(id, METHOD, HARNESS_RECT, &t, truth_blended);
    fprintf(stderr, "blended: rmse %.5f, mean error %+.5f\n", d.rmse, d.mean);
    CHECK(d.rmse < 0.008 && fabs(d.mean) < 0.002 && d.pixels > 10000);
}

/* A penumbra that ends at a ridge, beyond which the surface is turned from the sun by ten degrees:
 * nothing of what is lit before it gets there. */
static void check_ridge(void)
{
    static const struct quad quads[] = {
        {{-1, 0, 0}, {1, 0, 0}, {0, 0, -1}, {1, 1, 1, 1}},
        {{0.94f, -0.342f, 0}, {0.94f, -0.342f, 0}, {0, 0, -1}, {1, 1, 1, 1}},
        {{-0.5f, 0.08f, 0}, {0.05f, 0, 0}, {0, 0, -0.5f}, {1, 1, 1, 1}},
    };
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    uint32_t counts[3] = {0};
    load_quads(quads, 3, false, id);
    harness_shot(id,
        METHOD "width=256&height=256&ground=off&camera.eye=0,1.5,0&camera.target=0,0,0"
               "&camera.up=0,0,-1&camera.fov_y_deg=60&light.type=sun&light.position=-1,0.1763,0"
               "&light.target=0,0,0&light.angular_diameter_deg=10",
        &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        float a = shot.visibility[4 * i + 3];
        if (p[0] > 0 && p[1] < -1e-4f) {
            CHECK(a == 0);
            counts[0]++;
        } else if (p[0] < -0.01f && fabsf(p[1]) < 1e-3f && fabsf(p[2]) < 0.4f) {
            counts[1]++;
            counts[2] += a > 0.05f && a < 0.95f;
        }
    }
    CHECK(counts[0] > 10000 && counts[1] > 5000 && counts[2] > 500);
    harness_shot_finish(&shot);
}

/* The same request, the same bytes, whatever was drawn before it; pictures smaller than a block; and
 * another seed is another picture. */
static void check_requests(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shots[3];
    scene(PEN_GENERATED_DEMO, id);
    static const char *const sizes[] = {
        "width=1&height=1", "width=7&height=5", "width=33&height=1"};
    for (uint32_t i = 0; i < sizeof sizes / sizeof *sizes; i++) {
        char text[128];
        snprintf(text, sizeof text, METHOD "%s", sizes[i]);
        harness_shot(id, text, &shots[0]);
        CHECK(harness_not_finite(&shots[0]) == 0);
        harness_shot_finish(&shots[0]);
    }
    harness_shot(id, METHOD "width=90&height=70", &shots[0]);
    harness_shot(id, METHOD "width=200&height=100&samples=16", &shots[1]);
    harness_shot_finish(&shots[1]);
    harness_shot(id, METHOD "width=90&height=70", &shots[1]);
    harness_shot(id, METHOD "width=90&height=70&seed=1", &shots[2]);
    CHECK(!memcmp(shots[0].visibility, shots[1].visibility, 16 * 90 * 70));
    CHECK(memcmp(shots[0].visibility, shots[2].visibility, 16 * 90 * 70));
    for (int k = 0; k < 3; k++)
        harness_shot_finish(&shots[k]);
    /* No more rays than the budget allows, and in shaders as many as a pixel may get here. */
    harness_shot(id, METHOD SMALL "&refine=0", &shots[0]);
    harness_shot(id, METHOD SMALL "&refine=64&budget=1", &shots[1]);
    uint64_t more = shots[1].result.rays - shots[0].result.rays;
    fprintf(stderr, "%llu rays, and %llu\n", (unsigned long long)shots[0].result.rays,
        (unsigned long long)more);
    CHECK(more > 0 && more <= 160 * 120);
    for (int k = 0; k < 2; k++)
        harness_shot_finish(&shots[k]);
    static const char tiny[] = "&backend=gpu&width=32&height=24";
    char text[128];
    for (int k = 0; k < 2; k++) {
        snprintf(text, sizeof text, "technique=%s%s",
            k ? "raytraced&samples=64" : "denoised&refine=60", tiny);
        harness_shot(id, text, &shots[k]);
    }
    CHECK(!memcmp(shots[0].visibility, shots[1].visibility, 16 * 32 * 24));
    for (int k = 0; k < 2; k++)
        harness_shot_finish(&shots[k]);
}

int main(void)
{
    const struct planar_case t = {1.2, 3, 0.5, 0};
    uint8_t id[PEN_ID_BYTES];
    check_closed_forms();
    check_far_from_edges();
    check_more_rays();
    check_points();
    check_blended();
    check_ridge();
    check_requests();
    scene(PEN_GENERATED_HALF_PLANE, id);
    textured_check_t5(id, METHOD, &t, 0.03);
    check_against_many_rays();
    CHECK_DONE();
}
