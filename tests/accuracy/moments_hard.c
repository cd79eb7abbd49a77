/* Prefiltered hard shadows: the step of a half-plane against the kernel's own step response, and
 * what leaks through stacked casters against its closed form. */
#include "renderer/passes/map/blur.h"
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

/* Lit share of the kernel `s` texels right of an edge that lies between two texels: sums of weights
 * at texel centres, linear between them. */
static double lit_share_at(int texel, uint32_t radius, const float *weights)
{
    double sum = 0;
    for (int i = -(int)radius; i <= (int)radius; i++)
        if (texel + i >= 0)
            sum += weights[abs(i)];
    return sum;
}

static double lit_share(double s, uint32_t radius)
{
    float weights[BLUR_MAX_RADIUS + 1];
    blur_weights(radius, weights);
    double at = s - 0.5, base = floor(at), f = at - base;
    return (1 - f) * lit_share_at((int)base, radius, weights) +
           f * lit_share_at((int)base + 1, radius, weights);
}

/* The caster ends at x = 0. The map shows the casters' 4 m, seen at the receiver's depth, and 1/256
 * of that on either side; the edge then lies 256 / 258 of a texel from the border of a map of 256,
 * and is rounded to a whole one. */
static void check_step(const char *settings, double tolerance)
{
    const double c = 1.2, h = 3;
    const uint32_t size = 256, radius = 6;
    double texel = 4 * h / (h - c) * (1 + 2.0 / 256) / size;
    uint8_t id[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE}, id);
    char all[1024];
    snprintf(all, sizeof all,
        "technique=%s&map_size=%u&blur=%u&bleed=0&bias=0.0001&" HARNESS_VIEW HARNESS_RECT, settings,
        size, radius);
    struct shot shot;
    harness_shot(id, all, &shot);
    double worst = 0;
    uint32_t inside = 0, row = shot.height / 2;
    for (uint32_t i = row * shot.width; i < (row + 1) * shot.width; i++) {
        double s = shot.position[4 * i] / texel + (256.0 / 258 - 1);
        double expected = lit_share(s, radius), v = shot.visibility[4 * i + 3];
        worst = fmax(worst, fabs(v - expected));
        inside += expected > 0.05 && expected < 0.95;
    }
    fprintf(stderr, "%s: step off by at most %.4f over %u pixels\n", settings, worst, inside);
    CHECK(inside > 15);
    CHECK(worst < tolerance);
    harness_shot_finish(&shot);
}

/* T4. Casters at 4.4 and 1.1 m under a light at 8 m: as far apart from the receiver as 0.2 and 0.8
 * are from 1. All light is blocked. By Chebyshev, a share p of the upper one and the rest of the
 * lower leave p (1 - p) 9 / (p (1 - p) 9 + (1 + 3 p)^2): 0.265 at one half, 0.36 at most. */
struct leak {
    double most, at_half;
};

static struct leak leak(const char *settings)
{
    uint8_t id[PEN_ID_BYTES];
    harness_scene(
        &(struct pen_generated_options){
            .kind = PEN_GENERATED_STACKED, .caster_height = 4.4f, .second_height = 1.1f},
        id);
    char all[1024];
    snprintf(all, sizeof all,
        "technique=%s&map_size=256&blur=6&bias=0.0001&width=256&height=64&ground=off"
        "&camera.eye=-1.33,1,0&camera.target=-1.33,0,0&camera.up=0,0,-1&camera.fov_y_deg=30"
        "&light.type=rect&light.position=0,8,0&light.target=0,0,0&light.up=0,0,-1&light.width=0.5"
        "&light.height=0.5",
        settings);
    struct shot shot;
    struct leak result = {0, NAN};
    harness_shot(id, all, &shot);
    double nearest = 1;
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double x = shot.position[4 * i], v = shot.visibility[4 * i + 3];
        if (fabs(shot.position[4 * i + 1]) > 1e-3 || x > -0.6)
            continue;
        result.most = fmax(result.most, v);
        double distance = fabs(x + 0.6 * 8 / (8 - 4.4));
        if (distance < nearest)
            nearest = distance, result.at_half = v;
    }
    CHECK(nearest < 0.01);
    fprintf(stderr, "%s: leaks %.4f, at one half %.4f\n", settings, result.most, result.at_half);
    harness_shot_finish(&shot);
    return result;
}

int main(void)
{
    check_step("vsm&min_variance=0", 0.012);
    check_step("evsm&min_deviation=0", 0.012);
    check_step("msm", 0.012);
    check_step("msm&precision=unorm16", 0.02);
    struct leak vsm = leak("vsm&bounded=0&bleed=0");
    CHECK_NEAR(vsm.most, 0.36, 0.01);
    CHECK_NEAR(vsm.at_half, 0.265, 0.03);
    CHECK_NEAR(leak("vsm&bounded=0&bleed=0.2").most, (0.36 - 0.2) / 0.8, 0.01);
    CHECK(leak("vsm&bounded=0&bleed=0.3").at_half < 0.001);
    CHECK(leak("vsm&bounded=0&bleed=0.37").most < 0.001);
    CHECK(leak("evsm&bounded=0").most < 0.01);
    CHECK(leak("msm&bounded=0").most < 0.01);
    CHECK(leak("msm&bounded=0&precision=unorm16").most < 0.02);
    /* Where the whole blur is behind casters nothing is left, whatever the bound of the moments. */
    CHECK(leak("vsm&bleed=0").most == 0);
    CHECK_DONE();
}
