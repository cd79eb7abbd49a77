/* A method whose penumbrae have the wrong width must not pass for a right one: each method that
 * has penumbrae is rendered with the light as it is and with a light of half and of twice the size,
 * which is what a wrong factor in its estimate gives, and measured against the closed form of the
 * true light. */
#include "tests/accuracy/harness.h"
#include "tests/unit/check.h"

#define SIDE 1.0

static double error_of(const char *method, const uint8_t *id, const struct planar_case *planar,
    double side, truth_function truth)
{
    char settings[1024];
    snprintf(settings, sizeof settings,
        "technique=%s&width=128&height=128&ground=off&camera.eye=0,1,0&camera.target=0,0,0"
        "&camera.up=0,0,-1&camera.fov_y_deg=90&light.type=rect&light.position=0,3,0"
        "&light.target=0,0,0&light.up=0,0,-1&light.width=%g&light.height=%g",
        method, side, side);
    struct shot shot;
    harness_shot(id, settings, &shot);
    double rmse = harness_deviation(&shot, truth, planar).rmse_penumbra;
    harness_shot_finish(&shot);
    return rmse;
}

/* Methods without a penumbra of the light's own size. */
static bool is_exempt(const char *method)
{
    static const char *const names[] = {"none", "hard", "pcf", "vsm", "evsm", "msm", "csm"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        if (!strcmp(method, names[i]))
            return true;
    return false;
}

int main(void)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    struct planar_case planar = {.c = 1.2, .h = 3, .a = SIDE / 2};
    uint8_t id[PEN_ID_BYTES];
    harness_scene(&(struct pen_generated_options){.kind = PEN_GENERATED_HALF_PLANE}, id);
    for (uint32_t i = 0; i < catalogue->count; i++) {
        const char *method = catalogue->items[i]->name;
        if (!strcmp(method, "temporal")) /* a frame of its own has few samples */
            method = "temporal&samples=16";
        if (is_exempt(method))
            continue;
        double right = error_of(method, id, &planar, SIDE, truth_half_plane);
        double half = error_of(method, id, &planar, SIDE / 2, truth_half_plane);
        double twice = error_of(method, id, &planar, SIDE * 2, truth_half_plane);
        fprintf(stderr, "%-18s right %.4f  half %.4f  twice %.4f\n", method, right, half, twice);
        CHECK(right < 0.05);
        CHECK(half > 3 * right && half > 0.1);
        CHECK(twice > 3 * right && twice > 0.1);
    }
    CHECK_DONE();
}
