/* The layers about the work: classes may never contradict a closed form, and standard errors must
 * be as large as the errors that are really made. */
#include "protocol/json_request.h"
#include "tests/accuracy/quads.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdio.h>

enum { LIT, UNDECIDED, UMBRA };

#define LIGHT_0(x)                                                                                 \
    "&lights.0.type=rect&lights.0.position=" x ",3,0&lights.0.target=" x ",0,0"                    \
    "&lights.0.up=0,0,-1&lights.0.width=0.5&lights.0.height=0.5"
#define LIGHT_1(x)                                                                                 \
    "&lights.1.type=rect&lights.1.position=" x ",3,0&lights.1.target=" x ",0,0"                    \
    "&lights.1.up=0,0,-1&lights.1.width=0.5&lights.1.height=0.5"
#define TWO_LIGHTS LIGHT_0("0.3") LIGHT_1("-0.5")

static const struct planar_case t1 = {.c = 1.2, .h = 3, .a = 0.25};

/* T1 under a light whose centre is at x = light_x. */
static double truth_at(double x, double light_x)
{
    double v = (light_x + t1.a + x * (t1.h - t1.c) / t1.c) / (2 * t1.a);
    return v < 0 ? 0 : v > 1 ? 1 : v;
}

static bool is_receiver(const struct shot *shot, uint32_t i)
{
    const float *n = shot->normal + 4 * i;
    return n[0] != 0 || n[1] != 0 || n[2] != 0;
}

static void count_classes(const struct shot *shot, uint32_t count[3])
{
    memset(count, 0, 3 * sizeof *count);
    for (uint32_t i = 0; i < shot->width * shot->height; i++)
        if (is_receiver(shot, i))
            count[(int)shot->classes[4 * i]]++;
}

/* Lit and umbra are proofs; the record counts what the layer shows; the background is lit. */
static void check_classes(const uint8_t *half, const uint8_t *demo)
{
    struct shot shot;
    uint32_t count[3], wrong = 0, dark_background = 0;
    harness_shot(half, "technique=pcss&classify=on&" HARNESS_VIEW LIGHT_0("0"), &shot);
    count_classes(&shot, count);
    fprintf(stderr, "T1: lit %u, undecided %u, umbra %u\n", count[0], count[1], count[2]);
    CHECK(!memcmp(count, shot.result.class_pixels, sizeof count));
    CHECK(count[LIT] > 5000 && count[UMBRA] > 5000);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double truth = truth_at(shot.position[4 * i], 0);
        float found = shot.classes[4 * i];
        wrong += (found == LIT && truth < 1) || (found == UMBRA && truth > 0);
    }
    CHECK(wrong == 0);
    harness_shot_finish(&shot);
    harness_shot(
        demo, "technique=pcss&width=320&height=237&ground=off&camera.orbit.elevation_deg=5", &shot);
    count_classes(&shot, count);
    CHECK(!memcmp(count, shot.result.class_pixels, sizeof count));
    CHECK(count[0] + count[1] + count[2] == harness_receivers(&shot));
    CHECK(harness_receivers(&shot) < shot.width * shot.height);
    for (uint32_t i = 0; i < shot.width * shot.height; i++)
        dark_background += !is_receiver(&shot, i) && shot.classes[4 * i] != LIT;
    CHECK(dark_background == 0);
    harness_shot_finish(&shot);
}

/* A class of several lights, or of jittered frames, holds for each of them. */
static void check_several(const uint8_t *half)
{
    static const char method[] = "technique=pcss&" HARNESS_VIEW;
    struct shot one, other, both;
    char settings[1024];
    uint32_t wrong = 0, seen[3] = {0};
    snprintf(settings, sizeof settings, "%s%s", method, LIGHT_0("0.3"));
    harness_shot(half, settings, &one);
    snprintf(settings, sizeof settings, "%s%s", method, LIGHT_0("-0.5"));
    harness_shot(half, settings, &other);
    snprintf(settings, sizeof settings, "%s%s", method, TWO_LIGHTS);
    harness_shot(half, settings, &both);
    for (uint32_t i = 0; i < both.width * both.height; i++) {
        float a = one.classes[4 * i], b = other.classes[4 * i];
        float expected = a == b ? a : UNDECIDED;
        wrong += both.classes[4 * i] != expected;
        seen[(int)expected] += a != b || a != UNDECIDED;
    }
    CHECK(wrong == 0 && seen[LIT] > 1000 && seen[UNDECIDED] > 1000 && seen[UMBRA] > 1000);
    for (int k = 0; k < 3; k++)
        CHECK(both.result.class_pixels[k] ==
              one.result.class_pixels[k] + other.result.class_pixels[k]);
    harness_shot_finish(&one);
    harness_shot_finish(&other);
    harness_shot_finish(&both);

    snprintf(settings, sizeof settings, "%s%s&antialias=5", method, TWO_LIGHTS);
    harness_shot(half, settings, &both);
    for (uint32_t i = 0; i < both.width * both.height; i++) {
        float v = both.visibility[4 * i + 3], found = both.classes[4 * i];
        wrong += (found == LIT && v < 0.999f) || (found == UMBRA && v > 0.001f);
    }
    uint32_t count[3];
    count_classes(&both, count);
    CHECK(wrong == 0 && count[LIT] > 1000 && count[UMBRA] > 1000);
    CHECK(both.result.class_pixels[0] + both.result.class_pixels[1] + both.result.class_pixels[2] ==
          2 * 5 * both.width * both.height);
    harness_shot_finish(&both);
}

/* Renders one layer as PNG; the caller finishes the frame. */
static void layer_of(const uint8_t *scene, const char *settings, const char *layer, uint32_t bits,
    struct pen_frame *frame, struct pen_result *result)
{
    struct pen_query_pair pairs[32];
    struct pen_request request;
    struct pen_error error = {0};
    char text[1024], *state = NULL;
    uint32_t count = 0;
    snprintf(text, sizeof text, "%s&output.layer=%s", settings, layer);
    for (char *at = strtok_r(text, "&", &state); at && count < 32;
         at = strtok_r(NULL, "&", &state)) {
        char *equals = strchr(at, '=');
        *equals = 0;
        pairs[count++] = (struct pen_query_pair){at, equals + 1};
    }
    bool ok = pen_request_from_query(pairs, count, pen_renderer_catalogue(), &request, &error);
    request.output.bit_depth = bits;
    memcpy(request.scene, scene, PEN_ID_BYTES);
    ok = ok && pen_renderer_render(harness_renderer(), &request, frame, result, &error);
    CHECK(ok && frame->plane_count == 1);
    if (!ok)
        exit(1);
}

static bool warns(const struct pen_result *result, const char *text)
{
    for (uint32_t i = 0; i < result->warning_count; i++)
        if (strstr(result->warnings[i], text))
            return true;
    return false;
}

/* Where nothing was classified all receivers are undecided, and the record says why. */
static void check_unclassified(const uint8_t *half)
{
    static const char *const settings[] = {
        "technique=pcss&classify=off&" HARNESS_VIEW LIGHT_0("0"),
        "technique=hard&" HARNESS_VIEW LIGHT_0("0"),
        "technique=pcss&" HARNESS_VIEW LIGHT_0("0"),
    };
    static const char *const reasons[] = {"as the request wants", "does not use the classifier"};
    for (uint32_t k = 0; k < 3; k++) {
        struct pen_frame frame;
        struct pen_result result;
        uint32_t undecided = 0;
        layer_of(half, settings[k], "classes", 8, &frame, &result);
        const uint8_t *pixels = frame.planes[0].data;
        for (uint32_t i = 0; i < 256 * 256; i++)
            undecided += pixels[4 * i] == 127 || pixels[4 * i] == 128;
        CHECK(k == 2 ? undecided == result.class_pixels[UNDECIDED] : undecided == 256 * 256);
        CHECK(k == 2 ? !result.warning_count : warns(&result, reasons[k]));
        pen_frame_finish(&frame);
    }
}

/* A lamp between casters has a cube of maps: the face that owns a tile proves it lit, and each
 * pixel counts once. */
static void check_cube(const uint8_t *demo)
{
    struct shot shot;
    uint32_t count[3];
    harness_shot(demo,
        "technique=pcss&width=320&height=240&light.type=sphere&light.radius=0.1"
        "&light.position=1,3,1",
        &shot);
    count_classes(&shot, count);
    CHECK(count[LIT] + count[UNDECIDED] == harness_receivers(&shot) && count[LIT] > 1000);
    CHECK(!memcmp(count, shot.result.class_pixels, sizeof count));
    CHECK(shot.result.full_work_pixels == count[UNDECIDED]);
    harness_shot_finish(&shot);
}

/* A square light at height 3 over x, turned in its plane by the direction (s, c) of its side. */
struct turned_light {
    double x, s, c;
};
#define TURNED(i, x)                                                                               \
    "&lights." i ".type=rect&lights." i ".position=" x ",3,0&lights." i ".target=" x ",0,0"        \
    "&lights." i ".up=0.6,0,-0.8&lights." i ".width=0.5&lights." i ".height=0.5"
static const struct turned_light middle = {0, 0.6, 0.8}, right = {0.3, 0.6, 0.8},
                                 left = {-0.5, 0.6, 0.8};

static double ramp2(double s)
{
    return s > 0 ? 0.5 * s * s : 0;
}

/* The coordinate of the light's points across the caster's edge is the sum of two uniform ones. */
static double truth_turned(double x, const struct turned_light *l)
{
    double t = l->x + x * (t1.h - t1.c) / t1.c, p = t1.a * l->s, q = t1.a * l->c;
    return (ramp2(t + p + q) - ramp2(t + p - q) - ramp2(t - p + q) + ramp2(t - p - q)) /
           (4 * p * q);
}

struct spread {
    double actual, estimated; /* root mean squares over the penumbra */
};

/* What was really wrong with the mean over two lights, and what the layer says of it. */
static struct spread spread_of(const uint8_t *half, const char *settings,
    const struct turned_light *light, const struct turned_light *other)
{
    struct spread s = {0};
    struct shot shot;
    uint32_t n = 0;
    harness_shot(half, settings, &shot);
    CHECK(shot.error);
    for (uint32_t i = 0; shot.error && i < shot.width * shot.height; i++) {
        double x = shot.position[4 * i];
        double truth = 0.5 * (truth_turned(x, light) + truth_turned(x, other));
        if (truth < 0.02 || truth > 0.98)
            continue;
        double e = shot.visibility[4 * i + 3] - truth;
        s.actual += e * e;
        s.estimated += (double)shot.error[4 * i] * shot.error[4 * i];
        n++;
    }
    s.actual = sqrt(s.actual / n), s.estimated = sqrt(s.estimated / n);
    fprintf(stderr, "error %.5f, estimated %.5f: %.3f\n", s.actual, s.estimated,
        s.estimated / s.actual);
    harness_shot_finish(&shot);
    return s;
}

#define TRACED                                                                                     \
    "technique=raytraced&technique.params.adaptive=off&" HARNESS_VIEW "&technique.params.samples="

/* The estimate compares two samples a stratum; the net does better than that, so it is on the safe
 * side, by most where an edge is parallel to the light's. */
static bool is_sensible(struct spread s)
{
    return s.estimated > s.actual && s.estimated < 2.2 * s.actual;
}

static bool is_near(double value, double expected)
{
    return fabs(value - expected) < 0.1 * expected;
}

static void check_error(const uint8_t *half)
{
    static const char *const few[] = {TRACED "4" TURNED("0", "0"), TRACED "64" TURNED("0", "0"),
        TRACED "256" TURNED("0", "0"), TRACED "16&technique.params.weighting=g" TURNED("0", "0")};
    for (uint32_t k = 0; k < sizeof few / sizeof *few; k++)
        CHECK(is_sensible(spread_of(half, few[k], &middle, &middle)));
    struct spread one = spread_of(half, TRACED "16" TURNED("0", "0"), &middle, &middle);
    CHECK(is_sensible(one));
    CHECK(is_sensible(
        spread_of(half, TRACED "16" TURNED("0", "0.3") TURNED("1", "-0.5"), &right, &left)));
    /* Twice the same light: the errors must be independent, or they would not average out. */
    struct spread twice =
        spread_of(half, TRACED "16" TURNED("0", "0") TURNED("1", "0"), &middle, &middle);
    CHECK(is_sensible(twice) && is_near(twice.estimated, one.estimated / sqrt(2)));
    CHECK(twice.actual < 0.9 * one.actual);
    struct spread frames =
        spread_of(half, TRACED "16&antialias=4" TURNED("0", "0"), &middle, &middle);
    CHECK(is_sensible(frames) && is_near(frames.estimated, one.estimated / 2));
}

/* A file of integers shows 0.1 as white; a method without an estimate shows nothing and says so. */
static void check_error_files(const uint8_t *half)
{
    struct shot shot;
    struct pen_frame frame;
    struct pen_result result;
    double worst = 0, largest = 0;
    harness_shot(half, TRACED "4" TURNED("0", "0"), &shot);
    layer_of(half, TRACED "4" TURNED("0", "0"), "error", 8, &frame, &result);
    const uint8_t *pixels = frame.planes[0].data;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double expected = fmin(2550 * (double)shot.error[4 * i], 255);
        worst = fmax(worst, fabs(pixels[4 * i] - expected));
        largest = fmax(largest, shot.error[4 * i]);
    }
    CHECK(worst <= 0.51 && largest > 0.1 && !result.warning_count);
    pen_frame_finish(&frame);
    harness_shot_finish(&shot);

    layer_of(half, "technique=pcss&" HARNESS_VIEW LIGHT_0("0"), "error", 16, &frame, &result);
    const float *values = frame.planes[0].data;
    largest = 0;
    for (uint32_t i = 0; i < 256 * 256; i++)
        largest = fmax(largest, (double)values[4 * i]);
    CHECK(largest == 0 && warns(&result, "does not estimate its error"));
    pen_frame_finish(&frame);
}

/* Each of more materials than a draw can bind, alone or with others, on its own square. */
static void check_materials(void)
{
    enum { ACROSS = 16, DOWN = 10, COUNT = ACROSS * DOWN, PX = 8 };
    struct quad quads[COUNT];
    uint8_t id[PEN_ID_BYTES];
    struct pen_frame frame;
    struct pen_result result;
    for (uint32_t i = 0; i < COUNT; i++)
        quads[i] = (struct quad){{(float)(i % ACROSS) - 7.5f, 4.5f - (float)(i / ACROSS), 0},
            {0.5f, 0, 0}, {0, 0.5f, 0},
            {(float)(i % ACROSS) / 15, (float)(i / ACROSS) / 9, 0.3f, i % 3 ? 1 : 0.9999f}};
    load_quads(quads, COUNT, false, id);
    layer_of(id,
        "technique=none&width=128&height=80&ground=off&camera.eye=0,0,5&camera.target=0,0,0"
        "&camera.fov_y_deg=90&output.format=exr",
        "albedo", 32, &frame, &result);
    const float *found = frame.planes[0].data;
    double worst = 0;
    for (uint32_t i = 0; i < COUNT; i++) {
        uint32_t at = (i / ACROSS * PX + PX / 2) * ACROSS * PX + i % ACROSS * PX + PX / 2;
        for (int k = 0; k < 3; k++)
            worst = fmax(worst, fabs((double)found[4 * at + k] - (double)quads[i].color[k]));
    }
    CHECK(worst < 0.005); /* the G-buffer holds 8 bits of its root */
    pen_frame_finish(&frame);
}

int main(void)
{
    uint8_t half[PEN_ID_BYTES], demo[PEN_ID_BYTES];
    harness_scene(
        &(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE, .caster_height = 1.2f},
        half);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_DEMO}, demo);
    check_materials();
    check_classes(half, demo);
    check_several(half);
    check_unclassified(half);
    check_cube(demo);
    check_error(half);
    check_error_files(half);
    CHECK_DONE();
}
