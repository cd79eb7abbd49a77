/* T1, T2 and T3 for the first methods, against their closed forms. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

#define PCSS_LIGHT                                                                                 \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1&light.width=0.5"     \
    "&light.height=0.5"

static struct deviation deviation(uint32_t kind, float height, const char *settings,
    truth_function truth, const struct planar_case *t)
{
    uint8_t id[PEN_ID_BYTES];
    struct pen_generated_options options = {.kind = kind, .caster_height = height};
    harness_scene(&options, id);
    struct shot shot;
    harness_shot(id, settings, &shot);
    struct deviation d = harness_deviation(&shot, truth, t);
    harness_shot_finish(&shot);
    fprintf(stderr, "%-60.60s rmse %.5f penumbra %.5f worst %.4f mean %+.5f\n", settings, d.rmse,
        d.rmse_penumbra, d.worst, d.mean);
    return d;
}

/* A texel of the half-plane's map, m on the receiver, `stretch` being what the light makes of
 * lengths at the caster's height: the map shows 4 m of caster and 1/256 of that to each side. */
static double texel_of(uint32_t map_size, double stretch)
{
    return 4 * (1 + 2.0 / 256) * stretch / map_size;
}

/* The edge lies within a texel of x = 0. */
static void check_hard(void)
{
    uint8_t id[PEN_ID_BYTES];
    struct shot shot;
    uint32_t wrong = 0, pixels = 0;
    double texel = texel_of(256, 3 / 1.8);
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE}, id);
    harness_shot(id, "technique=hard&map_size=256&" HARNESS_VIEW HARNESS_RECT, &shot);
    for (uint32_t i = 0; i < shot.width * shot.height; i++) {
        double x = shot.position[4 * i];
        if (fabs(x) <= texel)
            continue;
        wrong += shot.visibility[4 * i + 3] != (x > 0 ? 1 : 0);
        pixels++;
    }
    harness_shot_finish(&shot);
    CHECK(pixels > 50000);
    CHECK(wrong == 0);
}

/* T1 by a fixed kernel: as wide as the kernel is on the receiver, whatever the caster's height. */
static void check_pcf(void)
{
    static const float heights[] = {2.1f, 1.2f, 0.3f};
    static const char *const lights[] = {"&light.type=sun&light.position=0,3,0&light.target=0,0,0"
                                         "&light.up=0,0,-1",
        HARNESS_RECT};
    for (int i = 0; i < 3; i++)
        for (int k = 0; k < 2; k++) {
            uint8_t id[PEN_ID_BYTES];
            char settings[512];
            struct shot shot;
            double c = heights[i], expected = 0.8 * 32 * texel_of(1024, k ? 3 / (3 - c) : 1);
            harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE,
                              .caster_height = heights[i]},
                id);
            snprintf(settings, sizeof settings,
                "technique=pcf&map_size=1024&radius=16&taps=64&width=256&height=256&ground=off"
                "&camera.eye=0,0.25,0&camera.target=0,0,0&camera.up=0,0,-1&camera.fov_y_deg=90%s",
                lights[k]);
            harness_shot(id, settings, &shot);
            double width = harness_width_10_90(&shot);
            fprintf(stderr, "pcf, %s, caster at %.1f: 10-90 %% width %.4f, expected %.4f\n",
                k ? "rect" : "sun", c, width, expected);
            CHECK_NEAR(width, expected, 0.05 * expected);
            harness_shot_finish(&shot);
        }
}

static void check_pcss(void)
{
    static const float heights[] = {2.1f, 1.5f, 1.2f, 0.6f}; /* c_z / r_z = 0.3, 0.5, 0.6, 0.8 */
    for (int i = 0; i < 4; i++) {
        double c = heights[i], h = 3, a = 0.25;
        struct planar_case t = {.c = c, .h = h, .a = a};
        uint8_t id[PEN_ID_BYTES];
        struct pen_generated_options options = {
            .kind = PEN_GENERATED_HALF_PLANE, .caster_height = heights[i]};
        harness_scene(&options, id);
        struct shot shot;
        /* From between caster and receiver. */
        harness_shot(id,
            i == 3 ? "technique=pcss&map_size=4096&search_taps=64&filter_taps=64&width=256&height="
                     "256&ground=off&camera.eye=0,0.5,0&camera.target=0,0,0&camera.up=0,0,-1"
                     "&camera.fov_y_deg=90" PCSS_LIGHT
                   : "technique=pcss&map_size=4096&search_taps=64&filter_taps=64&" HARNESS_VIEW
                         PCSS_LIGHT,
            &shot);
        double expected = 0.8 * 2 * a * c / (h - c), width = harness_width_10_90(&shot);
        fprintf(stderr, "pcss caster at %.1f: 10-90 %% width %.4f, expected %.4f\n", c, width,
            expected);
        CHECK_NEAR(width, expected, 0.05 * expected);
        CHECK(harness_deviation(&shot, truth_half_plane, &t).rmse < 0.02);
        harness_shot_finish(&shot);
    }
    struct planar_case disk = {.c = 1.2, .h = 3, .a = 0.5};
    CHECK(
        deviation(PEN_GENERATED_HALF_PLANE, 1.2f,
            "technique=pcss&map_size=4096&search_taps=64&filter_taps=64&" HARNESS_VIEW HARNESS_DISK,
            truth_half_plane_disk, &disk)
            .rmse < 0.02);
}

static void check_multisample(void)
{
    struct planar_case t = {.c = 1.2, .h = 3, .a = 0.5, .s = 0.4};
    static const uint32_t counts[] = {16, 64, 256};
    double last = 1;
    for (int i = 0; i < 3; i++) {
        char settings[512];
        snprintf(settings, sizeof settings,
            "technique=multisample&samples=%u&map_size=2048&" HARNESS_VIEW HARNESS_RECT, counts[i]);
        double rmse =
            deviation(PEN_GENERATED_HALF_PLANE, 1.2f, settings, truth_half_plane, &t).rmse_penumbra;
        /* Along an axis of the light each of N strata holds one point, anywhere in it: an edge that
         * cuts off the share x of a stratum is wrong by 1 - x or -x strata, variance x (1 - x), 1/6
         * in the mean. And what the texels of a 2048 map add. */
        CHECK(rmse < sqrt(1.0 / 6) / counts[i] + 0.002);
        CHECK(rmse < 0.5 * last);
        last = rmse;
    }
    struct deviation square = deviation(PEN_GENERATED_SQUARE, 1.2f,
        "technique=multisample&samples=256&map_size=2048&" HARNESS_VIEW HARNESS_RECT, truth_square,
        &t);
    CHECK(square.rmse < 0.005);
    struct deviation disk = deviation(PEN_GENERATED_HALF_PLANE, 1.2f,
        "technique=multisample&samples=256&map_size=2048&" HARNESS_VIEW HARNESS_DISK,
        truth_half_plane_disk, &t);
    CHECK(disk.rmse < 0.005);
}

int main(void)
{
    check_hard();
    check_pcf();
    check_pcss();
    check_multisample();
    CHECK_DONE();
}
