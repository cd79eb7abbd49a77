/* The reference against closed forms, under lights that face the receiver squarely and askew: what
 * other methods are compared with must be right itself. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

#define NARROW                                                                                     \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"                     \
    "&light.width=0.5&light.height=0.1"
#define ASKEW                                                                                      \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=1e-3,0,-1"                  \
    "&light.width=1&light.height=1"

int main(void)
{
    static const struct {
        const char *name, *light;
        uint32_t kind;
        struct planar_case planar;
        truth_function truth;
        double most;
    } rows[] = {
        {"T1, rect", HARNESS_RECT, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.5, 0}, truth_half_plane,
            0.004},
        {"T1, narrow rect", NARROW, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.25, 0}, truth_half_plane,
            0.004},
        {"T1, turned rect", ASKEW, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.5, 0}, truth_half_plane,
            0.004},
        {"T2, rect", HARNESS_RECT, PEN_GENERATED_SQUARE, {1.2, 3, 0.5, 0.4}, truth_square, 0.005},
        {"T3, disk", HARNESS_DISK, PEN_GENERATED_HALF_PLANE, {1.2, 3, 0.5, 0},
            truth_half_plane_disk, 0.004},
        {"T7, rect", HARNESS_RECT, PEN_GENERATED_PLANE, {0}, truth_one, 1e-6},
    };
    for (uint32_t i = 0; i < sizeof rows / sizeof *rows; i++) {
        uint8_t id[PEN_ID_BYTES];
        char settings[512];
        struct shot shot;
        harness_scene(&(struct pen_generated_options){.kind = rows[i].kind}, id);
        snprintf(settings, sizeof settings, "technique=raytraced&samples=256&" HARNESS_VIEW "%s",
            rows[i].light);
        harness_shot(id, settings, &shot);
        struct deviation d = harness_deviation(&shot, rows[i].truth, &rows[i].planar);
        fprintf(stderr, "%s: rmse %.5f, mean error %+.5f, worst %.4f over %u pixels\n",
            rows[i].name, d.rmse, d.mean, d.worst, d.pixels);
        CHECK(d.pixels > 10000);
        CHECK(d.rmse < rows[i].most);
        CHECK(d.mean < 0.001 && d.mean > -0.001);
        harness_shot_finish(&shot);
    }
    CHECK_DONE();
}
