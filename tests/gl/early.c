/* Pictures that have to end in the midst of a method that gives nothing before its end. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>

static bool render(struct pen_renderer *r, const struct pen_request *request, double budget_ms,
    struct pen_frame *frame, struct pen_result *result)
{
    struct pen_error error = {0};
    struct pen_render *render = pen_render_begin(r, request, frame, result, &error);
    if (render)
        pen_render_limit(render, budget_ms, 0);
    while (render && !pen_render_advance(render, 5))
        ;
    if (render && pen_render_end(render, &error))
        return true;
    fprintf(stderr, "%s: %s\n", request->technique, error.message);
    return false;
}

static void make_request(struct pen_request *request, const uint8_t scene[PEN_ID_BYTES],
    const char *technique, uint32_t lights)
{
    fixture_request(request, scene, technique);
    request->width = 96, request->height = 72;
    request->output.layer = PEN_LAYER_VISIBILITY;
    request->lights_given = true;
    request->light_count = lights;
    for (uint32_t k = 0; k < lights; k++) {
        pen_light_default(&request->lights[k], k ? PEN_LIGHT_DISK : PEN_LIGHT_RECT);
        request->lights[k].position[0] = 2 * k, request->lights[k].position[1] = 4;
        request->lights[k].position[2] = 1;
    }
}

/* A sketch has the shadows where they belong, and costs the whole picture nothing. */
static void check_method(
    struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES], const char *name, uint32_t lights)
{
    struct pen_request request, bare;
    struct pen_frame full, ample, early, none;
    struct pen_result result;
    make_request(&request, scene, name, lights);
    make_request(&bare, scene, "none", lights);
    if (!render(r, &bare, 0, &none, &result) || !render(r, &request, 0, &full, &result)) {
        CHECK(false);
        return;
    }
    CHECK(render(r, &request, 3.6e6, &ample, &result));
    CHECK(fixture_distance(&full, &ample) == 0 && result.progress.done == 1);
    CHECK(result.warning_count == 0);
    double whole_ms = (double)result.progress.elapsed_ms;
    pen_renderer_drop_shadows(r);
    CHECK(render(r, &request, 1e-3, &early, &result));
    CHECK(result.progress.done == 0 && result.progress.total == 1);
    CHECK(result.warning_count == 1 && strstr(result.warnings[0], "sketch"));
    CHECK(!memcmp(
        result.completed.technique_params, request.technique_params, sizeof bare.technique_params));
    double off = fixture_distance(&early, &full), empty = fixture_distance(&none, &full);
    printf("%s, %u lights: off %.2f, without shadows %.2f\n", name, lights, off, empty);
    CHECK(empty > 4 && off < 0.5 * empty);
    for (int i = 1; i < 4; i++) { /* wherever that is */
        pen_frame_finish(&early);
        pen_renderer_drop_shadows(r);
        CHECK(render(r, &request, whole_ms * i / 4, &early, &result));
        off = fixture_distance(&early, &full);
        CHECK(result.progress.done ? off == 0 : off < 0.5 * empty);
    }
    pen_frame_finish(&full), pen_frame_finish(&ample);
    pen_frame_finish(&early), pen_frame_finish(&none);
}

int main(void)
{
    static const char *const names[] = {"stochastic", "bilateral", "adaptive-sampling",
        "accumulation", "bitmask", "cascaded", "screen-space", "erosion", "mssm"};
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    uint8_t scene[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, scene);
    for (size_t i = 0; i < sizeof names / sizeof *names; i++)
        check_method(r, scene, names[i], 1 + i % 2);
    pen_renderer_destroy(r);
    CHECK_DONE();
}
