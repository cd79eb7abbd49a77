/* accumulation, backprojection and bitmask against closed forms, and against many samples where
 * there is none. */
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

#define SMALL_RECT                                                                                 \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"                     \
    "&light.width=0.1&light.height=0.1"

static void shoot(uint32_t kind, const char *settings, const char *light, struct shot *shot)
{
    uint8_t id[PEN_ID_BYTES];
    char all[1024];
    harness_scene(&(struct pen_generated_options){.kind = kind, .caster_height = 1.2f}, id);
    snprintf(all, sizeof all, "%s&" HARNESS_VIEW "%s", settings, light);
    harness_shot(id, all, shot);
}

static struct deviation deviation(uint32_t kind, const char *settings, const char *light,
    truth_function truth, const struct planar_case *t)
{
    struct shot shot;
    shoot(kind, settings, light, &shot);
    struct deviation d = harness_deviation(&shot, truth, t);
    harness_shot_finish(&shot);
    fprintf(stderr, "%-66.66s rmse %.5f penumbra %.5f worst %.4f mean %+.5f\n", settings, d.rmse,
        d.rmse_penumbra, d.worst, d.mean);
    return d;
}

static const struct planar_case wide = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
static const struct planar_case narrow = {.c = 1.2, .h = 3, .a = 0.05, .s = 0.4};

/* T2 within 0.02 at K = 64, from the published sum too; T3. */
static void check_planar(void)
{
    static const struct {
        const char *settings;
        double square, disk; /* greatest RMSE */
    } cases[] = {
        {"technique=accumulation&mode=paper&kernel=64", 0.01, 0.01},
        {"technique=accumulation&mode=paper&window=casters&kernel=64", 0.01, 0.01},
        {"technique=accumulation&kernel=64", 0.002, 0.002},
        {"technique=accumulation", 0.01, 0.005},
        {"technique=accumulation&kernel=64&layers=2", 0.02, 0.01},
        {"technique=backprojection&kernel=64&fill=none", 0.002, 0.002},
        {"technique=backprojection&kernel=64", 0.002, 0.002},
        {"technique=backprojection&kernel=64&fill=join", 0.002, 0.002},
        {"technique=backprojection", 0.01, 0.005},
        {"technique=bitmask&kernel=64", 0.01, 0.01},
        {"technique=bitmask&kernel=64&samples=256", 0.01, 0.01},
        {"technique=bitmask", 0.015, 0.01},
    };
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        const char *settings = cases[i].settings;
        CHECK(deviation(PEN_GENERATED_SQUARE, settings, HARNESS_RECT, truth_square, &wide).rmse <
              cases[i].square);
        CHECK(deviation(
                  PEN_GENERATED_HALF_PLANE, settings, HARNESS_DISK, truth_half_plane_disk, &wide)
                  .rmse < cases[i].disk);
    }
}

/* The map's window is the caster's with a margin of 1/256 of its side, so in a map of 258 k texels
 * the caster's edges fall on texel borders: nothing is left but rounding. 2^-11: half floats. */
static void check_exact(void)
{
    static const char *const cases[] = {
        "technique=accumulation&map_size=1032&kernel=64",
        "technique=backprojection&map_size=1032&kernel=64&fill=none",
        "technique=backprojection&map_size=1032&kernel=64&fill=extend",
        "technique=backprojection&map_size=1032&kernel=64&fill=join",
    };
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++)
        CHECK(deviation(PEN_GENERATED_SQUARE, cases[i], SMALL_RECT, truth_square, &narrow).worst <
              1e-3);
}

/* Where all light is blocked the sum is 1, also where the pyramid does not prove it at once. The
 * published sum counts the points of a K x K grid in a disk: where the grid lies decides whether
 * there are pi K^2 / 4 of them to 0.1 or to 0.2 %. */
static void check_blocked(void)
{
    static const struct {
        const char *settings;
        double rect, disk;
    } cases[] = {
        {"technique=accumulation&mode=paper&kernel=64", 1e-3, 2e-3},
        {"technique=accumulation&kernel=32", 1e-3, 1e-3},
        {"technique=accumulation&kernel=64", 1e-3, 1e-3},
        {"technique=accumulation&kernel=32&layers=2", 1e-3, 1e-3},
        {"technique=backprojection&kernel=32&fill=none", 1e-3, 1e-3},
        {"technique=backprojection&kernel=32&fill=join", 1e-3, 1e-3},
        {"technique=bitmask&kernel=32", 1e-3, 1e-3},
    };
    for (uint32_t i = 0; i < 2 * sizeof cases / sizeof *cases; i++) {
        bool disk = i & 1;
        struct shot shot;
        shoot(PEN_GENERATED_SQUARE, cases[i / 2].settings,
            disk ? HARNESS_DISK
                 : "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"
                   "&light.width=0.6&light.height=0.6",
            &shot);
        /* A caster that is smaller by the largest texels that are walked still hides all light. */
        struct planar_case t = {.c = 1.2, .h = 3, .a = disk ? 0.5 : 0.3, .s = 0.4};
        t.s -= 2 * (2 * t.a * 1.2 / 3) / 32;
        double worst = 0;
        uint32_t pixels = 0;
        for (uint32_t k = 0; k < shot.width * shot.height; k++) {
            const float *p = shot.position + 4 * k;
            if (fabsf(p[1]) > 1e-3f || shot.normal[4 * k + 1] < 0.5f ||
                truth_square(p[0], p[2], &t) > 0)
                continue;
            worst = fmax(worst, (double)shot.visibility[4 * k + 3]);
            pixels++;
        }
        fprintf(stderr, "%-50s %s umbra of %u pixels: worst %.5f\n", cases[i / 2].settings,
            disk ? "disk" : "rect", pixels, worst);
        CHECK(pixels > 100);
        CHECK(worst < (disk ? cases[i / 2].disk : cases[i / 2].rect));
        harness_shot_finish(&shot);
    }
}

/* T1 by points: half a column of a grid; jittered sets have a point in every 256th of the width. */
static void check_points(void)
{
    CHECK(deviation(PEN_GENERATED_HALF_PLANE,
              "technique=bitmask&pattern=regular&samples=64&kernel=64&map_size=2048", HARNESS_RECT,
              truth_half_plane, &wide)
              .worst < 1.0 / (2 * 8));
    CHECK(deviation(PEN_GENERATED_HALF_PLANE,
              "technique=bitmask&pattern=jittered&samples=256&kernel=64&map_size=2048&smooth=off",
              HARNESS_RECT, truth_half_plane, &wide)
              .worst < 0.005);
}

/* Mean visibility of receivers around the origin. */
static double at_origin(const struct shot *shot)
{
    double sum = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < shot->width * shot->height; i++) {
        const float *p = shot->position + 4 * i;
        if (fabsf(p[1]) < 1e-3f && fabsf(p[0]) < 0.004f && fabsf(p[2]) < 0.1f &&
            shot->normal[4 * i + 1] > 0.5f) {
            sum += (double)shot->visibility[4 * i + 3];
            count++;
        }
    }
    CHECK(count > 0);
    return sum / count;
}

/* Two casters hide the same half of the light. Sums count it twice, which is the method's known
 * error; bits count it once. The camera is below the lower caster. */
static void check_duplicate(void)
{
    static const struct {
        const char *settings;
        double expected;
    } cases[] = {
        {"technique=backprojection&layers=1", 0.5},
        {"technique=backprojection&layers=2", 0},
        {"technique=accumulation&layers=1", 0.5},
        {"technique=accumulation&layers=2", 0.5},
        {"technique=bitmask&layers=1", 0.5},
        {"technique=bitmask&layers=2", 0.5},
        {"technique=bitmask&layers=4&samples=256", 0.5},
    };
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t id[PEN_ID_BYTES];
        struct shot shot;
        char settings[512];
        harness_scene(
            &(struct pen_generated_options){.kind = PEN_GENERATED_DUPLICATE, .caster_height = 1.2f},
            id);
        snprintf(settings, sizeof settings,
            "%s&width=256&height=256&ground=off&camera.eye=0,0.5,0&camera.target=0,0,0"
            "&camera.up=0,0,-1&camera.fov_y_deg=90" HARNESS_RECT,
            cases[i].settings);
        harness_shot(id, settings, &shot);
        double v = at_origin(&shot);
        fprintf(stderr, "%-50s duplicate %.4f, expected %.1f\n", cases[i].settings, v,
            cases[i].expected);
        CHECK_NEAR(v, cases[i].expected, 0.015);
        harness_shot_finish(&shot);
    }
}

/* Both casters of the stacked scene hide a part of their own from most receivers: bits know the
 * union, from two layers. */
static double truth_stacked(double x, double z, const void *unused)
{
    (void)unused;
    struct planar_case upper = {.c = 1.2, .h = 3, .a = 0.5}, lower = {.c = 0.6, .h = 3, .a = 0.5};
    /* The upper edge lies at x = -0.6. */
    double a = truth_half_plane(x + 0.6 * upper.h / (upper.h - upper.c), z, &upper);
    return fmin(a, truth_half_plane(x, z, &lower));
}

static void check_stacked(void)
{
    static const struct {
        const char *settings;
        double limit;
    } cases[] = {
        {"technique=bitmask&layers=2&samples=256&kernel=32", 0.02},
        {"technique=accumulation&layers=2&kernel=32", 0.03},
    };
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        uint8_t id[PEN_ID_BYTES];
        struct shot shot;
        char settings[512];
        harness_scene(
            &(struct pen_generated_options){.kind = PEN_GENERATED_STACKED, .caster_height = 1.2f},
            id);
        snprintf(settings, sizeof settings,
            "%s&width=256&height=256&ground=off&camera.eye=0,0.5,0&camera.target=0,0,0"
            "&camera.up=0,0,-1&camera.fov_y_deg=120" HARNESS_RECT,
            cases[i].settings);
        harness_shot(id, settings, &shot);
        struct deviation d = harness_deviation(&shot, truth_stacked, NULL);
        fprintf(stderr, "%-50s stacked rmse %.5f worst %.4f mean %+.5f\n", cases[i].settings,
            d.rmse, d.worst, d.mean);
        CHECK(d.rmse < cases[i].limit);
        harness_shot_finish(&shot);
    }
}

/* Every kind of light against an average of hard shadows; the square leaves no
 * doubt about layers. */
static void check_lights(void)
{
    static const struct {
        const char *light;
        double limit;
    } lights[] = {
        {"&light.type=sun&light.position=1,3,0.5&light.angular_diameter_deg=12", 0.01},
        {"&light.type=sun&light.position=0,3,0.2&light.angular_diameter_deg=0", 0.12},
        {"&light.type=sphere&light.position=0.3,2.5,0&light.radius=0.3", 0.01},
        {"&light.type=point&light.position=0.3,2.5,0", 0.12},
        {"&light.type=spot&light.position=0.3,2.5,0&light.target=0,0,0&light.outer_cone_deg=40",
            0.12},
        {"&light.type=rect&light.position=1.5,2.5,0.4&light.target=0,0.6,0&light.width=0.6"
         "&light.height=0.3",
            0.01},
    };
    static const char *const methods[] = {"accumulation", "backprojection", "bitmask"};
    for (uint32_t i = 0; i < sizeof lights / sizeof *lights; i++) {
        struct shot truth;
        shoot(PEN_GENERATED_SQUARE, "technique=multisample&samples=256&map_size=1024",
            lights[i].light, &truth);
        for (int m = 0; m < 3; m++) {
            char settings[64];
            struct shot shot;
            snprintf(settings, sizeof settings, "technique=%s", methods[m]);
            shoot(PEN_GENERATED_SQUARE, settings, lights[i].light, &shot);
            double sum = 0;
            uint32_t pixels = shot.width * shot.height, shadow = 0;
            for (uint32_t k = 0; k < pixels; k++) {
                double v = (double)shot.visibility[4 * k + 3];
                double e = v - (double)truth.visibility[4 * k + 3];
                sum += e * e;
                shadow += v < 0.5;
            }
            fprintf(
                stderr, "%-16s%.60s rmse %.5f\n", methods[m], lights[i].light, sqrt(sum / pixels));
            CHECK(sqrt(sum / pixels) < lights[i].limit);
            CHECK(shadow > pixels / 100);
            CHECK(harness_not_finite(&shot) == 0);
            harness_shot_finish(&shot);
        }
        harness_shot_finish(&truth);
    }
}

/* T5 on both axes of the light: sums of emission are exact, points have a colour each. The lit half
 * light keeps its colours, and a receiver without a caster gets the mean. */
static void check_colours(void)
{
    static const struct {
        const char *settings;
        double limit;
    } cases[] = {
        {"technique=backprojection&kernel=64&map_size=2048", 0.002},
        {"technique=backprojection", 0.004},
        {"technique=backprojection&fill=join&layers=2", 0.004},
        {"technique=bitmask&samples=256&kernel=64", 0.01},
        {"technique=bitmask", 0.015},
        {"technique=bitmask&pattern=regular", 0.04},
    };
    for (uint32_t i = 0; i < sizeof cases / sizeof *cases; i++)
        for (int k = 0; k < 4; k++) {
            int axis = k >> 1, sign = (k & 1) ? 1 : -1;
            char light[256];
            struct shot shot;
            /* Red is the left half as seen from the scene: the side of the light's -x. */
            snprintf(light, sizeof light, "%s&light.texture.pattern=two-colour",
                textured_light(axis, sign));
            shoot(PEN_GENERATED_HALF_PLANE, cases[i].settings, light, &shot);
            if (axis == 0) {
                double worst, rmse = textured_t5(&shot, &wide, sign < 0, &worst);
                fprintf(stderr, "%-52s T5 %+d rmse %.5f worst %.4f\n", cases[i].settings, sign,
                    rmse, worst);
                CHECK(rmse < cases[i].limit);
            } else {
                /* The cut runs across the border of the colours: both halves dim alike. */
                double worst = 0;
                for (uint32_t p = 0; p < shot.width * shot.height; p++) {
                    const float *v = shot.visibility + 4 * p;
                    if (fabsf(shot.position[4 * p + 1]) < 1e-3f)
                        worst = fmax(worst, (double)fabsf(v[0] - v[1]));
                }
                fprintf(stderr, "%-52s T5 across: worst %.4f\n", cases[i].settings, worst);
                CHECK(worst < 0.04);
            }
            harness_shot_finish(&shot);
        }
}

int main(void)
{
    check_planar();
    check_exact();
    check_blocked();
    check_points();
    check_duplicate();
    check_stacked();
    check_lights();
    check_colours();
    CHECK_DONE();
}
