/* Methods that work on the screen (erosion, screen-space, bilateral, stochastic) against closed
 * forms and against each other's baselines. With arguments: T1 to T3 of the methods named. */
#include "tests/accuracy/textured.h"
#include "tests/unit/check.h"

static const struct planar_case standard = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};

#define SMALL_LIGHT(side)                                                                          \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1&light.width=" side   \
    "&light.height=" side
/* A corner of the scene from the side: receivers tilted to the camera, penumbrae foreshortened. */
#define OBLIQUE_VIEW                                                                               \
    "width=320&height=240&ground=off&camera.eye=1.6,0.9,1.3&camera.target=-0.05,0,-0.2"            \
    "&camera.up=0,1,0&camera.fov_y_deg=50"
/* The caster covers a part of its own umbra on the screen. */
#define OVER_CASTER                                                                                \
    "width=256&height=256&ground=off&camera.eye=0,5,1&camera.target=0,0.6,0.1&camera.up=0,1,0"     \
    "&camera.fov_y_deg=24"

static const char *const methods[] = {
    "erosion", "erosion&variant=direct", "screen-space", "bilateral", "stochastic"};
enum { METHODS = sizeof methods / sizeof *methods };

static void shoot(uint32_t kind, float height, const char *method, const char *view,
    const char *light, struct shot *shot)
{
    uint8_t id[PEN_ID_BYTES];
    char settings[1024];
    snprintf(settings, sizeof settings, "technique=%s&%s%s", method, view, light);
    harness_scene(&(struct pen_generated_options){.kind = kind, .caster_height = height}, id);
    harness_shot(id, settings, shot);
}

static struct deviation deviation(uint32_t kind, const char *method, const char *view,
    const char *light, truth_function truth, const struct planar_case *t)
{
    struct shot shot;
    shoot(kind, (float)t->c, method, view, light, &shot);
    struct deviation d = harness_deviation(&shot, truth, t);
    fprintf(stderr, "%-34.34s rmse %.5f penumbra %.5f worst %.4f mean %+.5f\n", method, d.rmse,
        d.rmse_penumbra, d.worst, d.mean);
    harness_shot_finish(&shot);
    return d;
}

static void check_closed_forms(const char *method, const double limits[4])
{
    const struct planar_case *t = &standard;
    CHECK(
        deviation(PEN_GENERATED_HALF_PLANE, method, HARNESS_VIEW, HARNESS_RECT, truth_half_plane, t)
            .rmse < limits[0]);
    CHECK(
        deviation(PEN_GENERATED_SQUARE, method, HARNESS_VIEW, HARNESS_RECT, truth_square, t).rmse <
        limits[1]);
    CHECK(deviation(PEN_GENERATED_HALF_PLANE, method, HARNESS_VIEW, HARNESS_DISK,
              truth_half_plane_disk, t)
              .rmse < limits[2]);
    CHECK(
        deviation(PEN_GENERATED_HALF_PLANE, method, OBLIQUE_VIEW, HARNESS_RECT, truth_half_plane, t)
            .rmse < limits[3]);
}

/* Full width of the penumbra from its 10 % and 90 % points, m, at caster height c. */
static double width(const char *method, double c)
{
    struct shot shot;
    shoot(PEN_GENERATED_HALF_PLANE, (float)c, method, HARNESS_VIEW, SMALL_LIGHT("0.5"), &shot);
    double w = harness_width_10_90(&shot) / 0.8;
    harness_shot_finish(&shot);
    return w;
}

static void check_widths(void)
{
    static const double heights[] = {2.1, 1.5, 1.2}; /* c_z / r_z = 0.3, 0.5, 0.6 */
    for (int i = 0; i < 3; i++) {
        double c = heights[i], expected = 0.5 * c / (3 - c), pixel = 2.0 / 256;
        double direct = width("erosion&variant=direct&map_size=4096", c);
        double eroded = width("erosion&map_size=4096&filter_taps=64", c);
        double pcss = width("pcss&map_size=4096&search_taps=64&filter_taps=64", c);
        double blurred = width("screen-space&map_size=4096", c);
        fprintf(stderr, "width at %.1f: %.4f direct %.4f pcf %.4f pcss %.4f screen-space %.4f\n", c,
            expected, direct, eroded, pcss, blurred);
        CHECK_NEAR(direct, expected, 2 * pixel); /* F5 within 2 px */
        CHECK_NEAR(eroded, pcss, 0.03 * expected);
        CHECK_NEAR(eroded, expected, 0.02 * expected);
        CHECK_NEAR(blurred, expected, 0.05 * expected);
    }
}

/* A light that is large and far away, in metres or because the scene's unit is small: what the
 * methods keep in half floats must neither overflow nor vanish. */
static void check_far_light(void)
{
    struct planar_case t = {.c = 1.2, .h = 300, .a = 50};
    for (int i = 0; i < METHODS; i++) {
        double rmse = deviation(PEN_GENERATED_HALF_PLANE, methods[i], HARNESS_VIEW,
            "&light.type=rect&light.position=0,300,0&light.target=0,0,0&light.up=0,0,-1"
            "&light.width=100&light.height=100",
            truth_half_plane, &t)
                          .rmse;
        CHECK(rmse < 0.012);
    }
}

/* A penumbra that is wider than the picture, whose edges' pyramid then has fewer levels than its width
 * asks for: the size of the picture makes no difference. */
static void check_small_pictures(const char *method)
{
    static const int sides[] = {48, 96, 192, 512};
    const struct planar_case t = {.c = 1.2, .h = 3, .a = 1.5};
    for (int i = 0; i < 4; i++) {
        char view[200];
        snprintf(view, sizeof view,
            "width=%d&height=%d&ground=off&camera.eye=0,1,0&camera.target=0,0,0&camera.up=0,0,-1"
            "&camera.fov_y_deg=90",
            sides[i], sides[i] * 3 / 4);
        fprintf(stderr, "%3d px ", sides[i]);
        CHECK(deviation(
                  PEN_GENERATED_HALF_PLANE, method, view, SMALL_LIGHT("3"), truth_half_plane, &t)
                  .rmse < 0.05);
    }
}

/* A penumbra of 85 px that may only reach 32 px to each side of its edge is narrower, but still a
 * ramp: nothing is cut off. */
static void check_bounded_radius(const char *method)
{
    struct shot shot;
    double step = 0;
    shoot(PEN_GENERATED_HALF_PLANE, 1.2f, method, HARNESS_VIEW, HARNESS_RECT, &shot);
    for (uint32_t x = 1; x < shot.width; x++) {
        const float *v = shot.visibility + 4 * (shot.height / 2 * shot.width + x);
        step = fmax(step, fabsf(v[3] - v[-1]));
    }
    fprintf(stderr, "%-50s largest step %.4f\n", method, step);
    harness_shot_finish(&shot);
    CHECK(step < 2.5 / 64);
}

/* The edge runs 1 : 3 over the pixels; the fitted lines must undo its stairs. All edges in a strip
 * of 1 / sqrt 10 = 0.316 px make the same stairs, and no fit can tell them apart: the camera is
 * moved by half of that, so that the true edge is the strip's middle and not its border. */
static void check_line_fit(void)
{
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.25};
    double pixels = 2 * t.a * t.c / (t.h - t.c) * 128, sum = 0, worst = 0;
    uint32_t count = 0;
    struct shot shot;
    shoot(PEN_GENERATED_HALF_PLANE, 1.2f, "erosion&variant=direct&map_size=4096",
        "width=256&height=256&ground=off&camera.eye=0.0013,1,0&camera.target=0.0013,0,0"
        "&camera.up=0.316227766,0,-0.948683298&camera.fov_y_deg=90",
        SMALL_LIGHT("0.5"), &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        double v = truth_half_plane(p[0], p[2], &t);
        double residual = fabs(shot.visibility[4 * i + 3] - v) * pixels;
        bool border = i % shot.width < 64 || i % shot.width >= 192 || i / shot.width < 64 ||
                      i / shot.width >= 192;
        if (v < 0.02 || v > 0.98 || border)
            continue;
        sum += residual * residual;
        worst = fmax(worst, residual);
        count++;
    }
    harness_shot_finish(&shot);
    fprintf(stderr, "line fit: residual %.4f px rms, %.4f px worst\n", sqrt(sum / count), worst);
    CHECK(count > 1000);
    CHECK(sqrt(sum / count) < 0.1);
    CHECK(worst < 0.15);
}

/* Over the caster's silhouette lit and dark pixels meet that have nothing to do with each other:
 * the caster's top stays lit and the umbra beside it stays dark. */
static void check_depth_step(const char *method)
{
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.1, .s = 0.4};
    double floor_worst = 0, top_worst = 0, sum = 0;
    uint32_t floor_pixels = 0, top_pixels = 0, umbra = 0;
    struct shot shot;
    shoot(PEN_GENERATED_SQUARE, 1.2f, method, OVER_CASTER, SMALL_LIGHT("0.2"), &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        const float *p = shot.position + 4 * i;
        double v = shot.visibility[4 * i + 3];
        if (fabsf(p[1] - 1.2f) < 1e-3f) {
            top_worst = fmax(top_worst, 1 - v);
            top_pixels++;
        } else if (fabsf(p[1]) < 1e-3f) {
            double truth = truth_square(p[0], p[2], &t);
            sum += (v - truth) * (v - truth);
            floor_pixels++;
            umbra += truth == 0;
            if (truth == 0)
                floor_worst = fmax(floor_worst, v);
        }
    }
    double rmse = sqrt(sum / floor_pixels);
    fprintf(stderr, "%-34s step: top %.4f, umbra %.4f, floor rmse %.4f\n", method, top_worst,
        floor_worst, rmse);
    harness_shot_finish(&shot);
    CHECK(top_pixels > 2000 && umbra > 2000);
    CHECK(top_worst == 0);
    CHECK(floor_worst < 0.1);
    CHECK(rmse < 0.02); /* without the test of silhouettes, direct: 0.43 and 0.026 */
}

static void check_bilateral(void)
{
    const struct planar_case *t = &standard;
    uint32_t kind = PEN_GENERATED_HALF_PLANE;
    double filtered =
        deviation(kind, "bilateral", HARNESS_VIEW, HARNESS_RECT, truth_half_plane, t).rmse;
    struct deviation raw =
        deviation(kind, "bilateral&sigma=0", HARNESS_VIEW, HARNESS_RECT, truth_half_plane, t);
    /* Its 25 points are in the middle of 25 strata along this axis: an edge is wrong by -1/2 to 1/2
     * of one, variance 1/12. */
    CHECK_NEAR(raw.rmse_penumbra, sqrt(1.0 / 12) / 25, 2e-4);
    CHECK(filtered < 0.6 * raw.rmse);
}

/* Where visibility is 0 or 1 all around, it is exactly that afterwards. */
static void check_constant(const char *method)
{
    struct shot shot;
    shoot(PEN_GENERATED_HALF_PLANE, 1.2f, method, HARNESS_VIEW, HARNESS_RECT, &shot);
    uint32_t wrong = 0;
    double edge = 2 * 0.5 * 1.2 / 1.8 / 2;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double x = shot.position[4 * i], v = shot.visibility[4 * i + 3];
        wrong += fabs(x) > 2 * edge && v != (x > 0);
    }
    harness_shot_finish(&shot);
    CHECK(wrong == 0);
}

static double mean_visibility(const struct shot *shot)
{
    double sum = 0;
    for (uint32_t i = 0; i < shot->width * shot->height; i++)
        sum += shot->visibility[4 * i + 3];
    return sum / (shot->width * shot->height);
}

static void check_stochastic(void)
{
    const struct planar_case *t = &standard;
    static const uint32_t kinds[] = {PEN_GENERATED_HALF_PLANE, PEN_GENERATED_SQUARE};
    for (int i = 0; i < 2; i++) {
        struct shot shot, reference;
        shoot(kinds[i], 1.2f, "stochastic", HARNESS_VIEW, HARNESS_RECT, &shot);
        shoot(kinds[i], 1.2f, "multisample&samples=512", HARNESS_VIEW, HARNESS_RECT, &reference);
        double mean = mean_visibility(&shot), expected = mean_visibility(&reference);
        fprintf(stderr, "stochastic: mean %.5f, expected %.5f\n", mean, expected);
        CHECK_NEAR(mean, expected, 0.005 * expected);
        harness_shot_finish(&shot);
        harness_shot_finish(&reference);
    }
    for (int samples = 1; samples <= 4; samples *= 2) {
        char method[64];
        snprintf(method, sizeof method, "stochastic&samples=%d", samples);
        CHECK(deviation(
                  PEN_GENERATED_HALF_PLANE, method, HARNESS_VIEW, HARNESS_RECT, truth_half_plane, t)
                  .rmse < 0.03);
    }
    /* Frames of an antialiased image take other samples, so even unfiltered ones converge. */
    double one = deviation(PEN_GENERATED_HALF_PLANE, "stochastic&levels=0", HARNESS_VIEW,
        HARNESS_RECT, truth_half_plane, t)
                     .rmse;
    double eight = deviation(PEN_GENERATED_HALF_PLANE, "stochastic&levels=0&antialias=8",
        HARNESS_VIEW, HARNESS_RECT, truth_half_plane, t)
                       .rmse;
    CHECK(eight < 0.4 * one);
}

static void check_textured(const char *method, double limit)
{
    struct planar_case t = standard;
    for (int sign = -1; sign <= 1; sign += 2) {
        struct shot shot;
        char light[512];
        double worst;
        snprintf(
            light, sizeof light, "%s&light.texture.pattern=two-colour", textured_light(0, sign));
        shoot(PEN_GENERATED_HALF_PLANE, 1.2f, method, HARNESS_VIEW, light, &shot);
        double rmse = textured_t5(&shot, &t, sign < 0, &worst);
        fprintf(stderr, "%-34s T5 %+d rmse %.4f worst %.4f\n", method, sign, rmse, worst);
        CHECK(rmse < limit);
        harness_shot_finish(&shot);
    }
}

/* A sphere amid the scene has a map with six faces; here the border of two of them runs through the
 * penumbra, and no method may show it. */
static void check_cube(void)
{
    static const char view[] =
        "width=256&height=256&ground=off&camera.eye=-1.2,1,0&camera.target=-1.2,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=90";
    static const char light[] = "&light.type=sphere&light.position=1.8,3,0&light.radius=0.2";
    struct shot truth;
    shoot(PEN_GENERATED_HALF_PLANE, 1.2f, "multisample&samples=256", view, light, &truth);
    for (int m = 0; m < METHODS; m++) {
        struct shot shot;
        double sum = 0, step = 0;
        shoot(PEN_GENERATED_HALF_PLANE, 1.2f, methods[m], view, light, &shot);
        for (uint32_t i = 0; i < shot.width * shot.height; i++) {
            double e = shot.visibility[4 * i + 3] - truth.visibility[4 * i + 3];
            sum += e * e;
            if (i % shot.width)
                step = fmax(
                    step, fabs(e - (shot.visibility[4 * i - 1] - truth.visibility[4 * i - 1])));
        }
        double rmse = sqrt(sum / (shot.width * shot.height));
        fprintf(stderr, "%-34s cube: rmse %.4f, largest step %.4f\n", methods[m], rmse, step);
        CHECK(rmse < 0.015);
        CHECK(step < 0.15);
        harness_shot_finish(&shot);
    }
    harness_shot_finish(&truth);
}

int main(int argc, char **argv)
{
    static const double any[4] = {1, 1, 1, 1};
    /* T1, T2, T3 from above; T1 from the side. Under T2's light all of the square's edges overlap:
     * the nearest edge alone, and a Gaussian of hard shadows from the light's centre, must fail. */
    static const double limits[METHODS][4] = {{0.005, 0.006, 0.004, 0.006},
        {0.001, 0.08, 0.001, 0.02}, {0.015, 0.035, 0.01, 0.03}, {0.005, 0.025, 0.008, 0.005},
        {0.004, 0.02, 0.006, 0.006}};
    for (int i = 1; i < argc; i++)
        check_closed_forms(argv[i], any);
    if (argc > 1)
        CHECK_DONE();
    for (int i = 0; i < METHODS; i++)
        check_closed_forms(methods[i], limits[i]);
    check_widths();
    check_far_light();
    check_small_pictures("erosion");
    check_small_pictures("erosion&variant=direct");
    check_bounded_radius("erosion&max_radius=32");
    check_bounded_radius("erosion&variant=direct&max_radius=32");
    check_line_fit();
    for (int i = 0; i < METHODS; i++)
        check_depth_step(methods[i]);
    check_bilateral();
    check_constant("bilateral");
    check_constant("stochastic");
    check_stochastic();
    check_textured("bilateral", 0.015);
    check_textured("stochastic", 0.015);
    check_cube();
    CHECK_DONE();
}
