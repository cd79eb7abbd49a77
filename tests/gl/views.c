/* The same view is not drawn again: only what it is lit by. Whatever else a request changes is seen,
 * and the picture is always that of a renderer that has seen nothing before. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>
#include <unistd.h>

static const struct pen_pass_time *pass_of(const struct pen_result *result, const char *name)
{
    for (uint32_t i = 0; i < result->pass_count; i++)
        if (!strcmp(result->passes[i].name, name))
            return &result->passes[i];
    return NULL;
}

/* Whether the view was drawn; and that the picture is the one it is when nothing is known. */
static bool draws(struct pen_renderer *r, const struct pen_request *request)
{
    struct pen_result result, anew;
    uint64_t hash = fixture_render(r, request, &result);
    pen_renderer_drop_shadows(r);
    CHECK(hash == fixture_render(r, request, &anew));
    CHECK(pass_of(&anew, "gbuffer") && pass_of(&anew, "sky occlusion"));
    CHECK(!pass_of(&result, "gbuffer") == !pass_of(&result, "sky occlusion"));
    CHECK(result.triangles_drawn == anew.triangles_drawn && result.triangles_drawn > 0);
    return pass_of(&result, "gbuffer") != NULL;
}

int main(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    uint8_t demo[PEN_ID_BYTES], foliage[PEN_ID_BYTES], own[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, demo);
    fixture_scene(r, PEN_GENERATED_FOLIAGE, 2000, 1, foliage);
    struct pen_request a, b;
    struct pen_result result;
    fixture_request(&a, demo, "pcss");
    a.width = 80, a.height = 60;
    fixture_render(r, &a, &result);
    CHECK(!draws(r, &a));
    b = a;
    b.exposure_ev = 1;
    CHECK(!draws(r, &b));
    fixture_request(&b, demo, "hard");
    b.width = 80, b.height = 60;
    CHECK(!draws(r, &b));
    b = a;
    b.lights_given = true;
    b.light_count = 1;
    b.lights[0] = result.completed.lights[0];
    b.lights[0].width *= 1.5f;
    CHECK(!draws(r, &b));

    b = a;
    b.width = 79;
    CHECK(draws(r, &b) && draws(r, &a));
    b = a;
    b.camera.mode = PEN_CAMERA_ORBIT;
    b.camera.azimuth_deg = 70;
    CHECK(draws(r, &b) && draws(r, &a));
    b = a;
    b.ground.on = 0;
    CHECK(draws(r, &b) && draws(r, &a));
    b = a;
    b.ground_albedo[1] = 0.9f;
    CHECK(draws(r, &b) && draws(r, &a));
    fixture_request(&b, foliage, "pcss");
    b.width = 80, b.height = 60;
    CHECK(draws(r, &b) && draws(r, &a));

    /* Jittered frames are views of their own. */
    b = a;
    b.antialias = 3;
    CHECK(draws(r, &b) && draws(r, &b) && draws(r, &a));

    /* Another scene of the same id. */
    struct pen_result before, after;
    uint64_t hash = fixture_render(r, &a, &before);
    pen_renderer_drop_scene(r, demo);
    int fd = fixture_blob(PEN_GENERATED_FOLIAGE, 2000, 1, own);
    CHECK(pen_renderer_load_scene(r, demo, fd, &error));
    close(fd);
    CHECK(fixture_render(r, &a, &after) != hash && pass_of(&after, "gbuffer"));
    pen_renderer_destroy(r);
    CHECK_DONE();
}
