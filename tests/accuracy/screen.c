/* Methods that work on the screen: screen-space, bilateral and stochastic against closed forms. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

static const struct planar_case standard = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};

static void shoot(uint32_t kind, const char *settings, struct shot *shot)
{
    uint8_t id[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = kind, .caster_height = 1.2f}, id);
    harness_shot(id, settings, shot);
}

static struct deviation deviation(
    uint32_t kind, const char *method, const char *light, truth_function truth)
{
    char settings[1024];
    struct shot shot;
    snprintf(settings, sizeof settings, "technique=%s&" HARNESS_VIEW "%s", method, light);
    shoot(kind, settings, &shot);
    struct deviation d = harness_deviation(&shot, truth, &standard);
    fprintf(stderr, "%-52.52s rmse %.5f penumbra %.5f worst %.4f mean %+.5f width %.4f\n", method,
        d.rmse, d.rmse_penumbra, d.worst, d.mean, harness_width_10_90(&shot));
    harness_shot_finish(&shot);
    return d;
}

static void check_closed_forms(const char *method, double t1, double t2, double t3)
{
    struct deviation d =
        deviation(PEN_GENERATED_HALF_PLANE, method, HARNESS_RECT, truth_half_plane);
    CHECK(d.rmse < t1);
    d = deviation(PEN_GENERATED_SQUARE, method, HARNESS_RECT, truth_square);
    CHECK(d.rmse < t2);
    d = deviation(PEN_GENERATED_HALF_PLANE, method, HARNESS_DISK, truth_half_plane_disk);
    CHECK(d.rmse < t3);
}

int main(int argc, char **argv)
{
    if (argc > 1) {
        check_closed_forms(argv[1], 1, 1, 1);
        CHECK_DONE();
    }
    check_closed_forms("screen-space", 1, 1, 1);
    check_closed_forms("bilateral", 1, 1, 1);
    check_closed_forms("bilateral&sigma=0", 1, 1, 1);
    check_closed_forms("stochastic", 1, 1, 1);
    check_closed_forms("stochastic&levels=0", 1, 1, 1);
    check_closed_forms("pcss", 1, 1, 1);
    CHECK_DONE();
}
