/* vssm and mssm against T1 to T4, and a window whose mean lies behind the receiver. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

static void shoot(const struct pen_generated_options *options, const char *technique,
    const char *rest, struct shot *shot)
{
    uint8_t id[PEN_ID_BYTES];
    char settings[1024];
    harness_scene(options, id);
    snprintf(settings, sizeof settings, "technique=%s&%s", technique, rest);
    harness_shot(id, settings, shot);
}

/* T1 at three heights of the caster: the width of the penumbra follows the blocker's distance. */
static void check_widths(const char *technique, double share, double most_rmse)
{
    static const float heights[] = {2.1f, 1.5f, 1.2f, 0.6f}; /* c_z / r_z = 0.3, 0.5, 0.6, 0.8 */
    for (int i = 0; i < 4; i++) {
        double c = heights[i], h = 3, a = 0.25, expected = 0.8 * 2 * a * c / (h - c);
        struct planar_case t = {.c = c, .h = h, .a = a};
        struct shot shot;
        shoot(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE,
                  .caster_height = heights[i]},
            technique,
            "width=256&height=256&ground=off&camera.eye=0,0.5,0&camera.target=0,0,0"
            "&camera.up=0,0,-1&camera.fov_y_deg=120&light.type=rect&light.position=0,3,0"
            "&light.target=0,0,0&light.up=0,0,-1&light.width=0.5&light.height=0.5",
            &shot);
        double width = harness_width_10_90(&shot);
        struct deviation d = harness_deviation(&shot, truth_half_plane, &t);
        fprintf(stderr, "%s, caster at %.1f: width %+.2f %%, rmse %.5f\n", technique, c,
            100 * (width / expected - 1), d.rmse);
        CHECK_NEAR(width, expected, share * expected);
        CHECK(d.rmse < most_rmse);
        harness_shot_finish(&shot);
    }
}

static void check_planar(
    const char *technique, uint32_t kind, const char *light, truth_function truth, double limit)
{
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
    struct shot shot;
    char view[512];
    snprintf(view, sizeof view, HARNESS_VIEW "%s", light);
    shoot(&(struct pen_generated_options){.kind = kind}, technique, view, &shot);
    struct deviation d = harness_deviation(&shot, truth, &t);
    fprintf(stderr, "%s, scene %u: rmse %.5f penumbra %.5f worst %.4f mean %+.5f\n", technique,
        kind, d.rmse, d.rmse_penumbra, d.worst, d.mean);
    CHECK(d.rmse < limit);
    harness_shot_finish(&shot);
}

/* T4: stacked casters that block everything; see moments_hard.c for the distances. */
static double leak(const char *technique)
{
    struct shot shot;
    double most = 0;
    shoot(
        &(struct pen_generated_options){
            .kind = PEN_GENERATED_STACKED, .caster_height = 4.4f, .second_height = 1.1f},
        technique,
        "width=256&height=64&ground=off&camera.eye=-1.33,1,0&camera.target=-1.33,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=30&light.type=rect&light.position=0,8,0"
        "&light.target=0,0,0&light.up=0,0,-1&light.width=0.5&light.height=0.5",
        &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++)
        if (fabs(shot.position[4 * i + 1]) < 1e-3 && shot.position[4 * i] < -0.6)
            most = fmax(most, shot.visibility[4 * i + 3]);
    fprintf(stderr, "%s: leaks %.4f\n", technique, most);
    harness_shot_finish(&shot);
    return most;
}

/* On the lower of two casters, near its edge: the light is partly behind the upper one, and the
 * window also shows the floor far below, which pulls the mean behind the receiver. */
static double error_over_an_edge(const char *technique)
{
    const double high = 4.4, low = 3.3, h = 8, a = 4;
    struct shot shot;
    shoot(&(struct pen_generated_options){.kind = PEN_GENERATED_STACKED,
              .caster_height = (float)high,
              .second_height = (float)low},
        technique,
        "width=128&height=64&ground=off&camera.eye=-0.3,3.9,0&camera.target=-0.3,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=45&light.type=rect&light.position=0,8,0"
        "&light.target=0,0,0&light.up=0,0,-1&light.width=8&light.height=0.5",
        &shot);
    double sum = 0, truth = 0;
    uint32_t count = 0;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double x = shot.position[4 * i];
        if (fabs(shot.position[4 * i + 1] - low) > 1e-3 || x < -0.6 || x > -0.02)
            continue;
        double s = x + (-0.6 - x) * (h - low) / (high - low);
        double expected = fmin(fmax((a - s) / (2 * a), 0), 1),
               e = shot.visibility[4 * i + 3] - expected;
        sum += e * e;
        truth += expected;
        count++;
    }
    CHECK(count > 500);
    CHECK(truth / count > 0.4 && truth / count < 0.9);
    fprintf(stderr, "%s: over an edge rmse %.4f\n", technique, sqrt(sum / count));
    harness_shot_finish(&shot);
    return sqrt(sum / count);
}

int main(void)
{
    static const char *const methods[] = {
        "vssm", "vssm&subdivide=uniform", "vssm&subdivide=off", "mssm", "mssm&parts=1"};
    for (int i = 0; i < 5; i++) {
        check_widths(methods[i], 0.02, 0.01);
        check_planar(methods[i], PEN_GENERATED_HALF_PLANE, HARNESS_RECT, truth_half_plane, 0.006);
        check_planar(methods[i], PEN_GENERATED_SQUARE, HARNESS_RECT, truth_square, 0.01);
        check_planar(
            methods[i], PEN_GENERATED_HALF_PLANE, HARNESS_DISK, truth_half_plane_disk, 0.015);
    }
    /* The published algorithm without subdivision is exact where all casters share a depth. */
    check_widths("vssm&subdivide=off&smooth=off", 0.005, 0.002);
    double off = leak("vssm&subdivide=off&bounded=0");
    CHECK(off > 0.2 && off < 0.37);
    CHECK(leak("vssm&bounded=0") < 0.01);
    CHECK(leak("vssm&subdivide=uniform&bounded=0") < 0.01);
    CHECK(leak("mssm&bounded=0") < 0.02);
    CHECK(leak("mssm&parts=1&bounded=0") < 0.02);
    CHECK(error_over_an_edge("vssm&subdivide=off") > 0.08);
    CHECK(error_over_an_edge("vssm") < 0.03);
    CHECK(error_over_an_edge("vssm&subdivide=uniform") < 0.03);
    CHECK(error_over_an_edge("mssm") < 0.05);
    CHECK_DONE();
}
