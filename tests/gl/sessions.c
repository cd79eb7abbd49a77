/* How long sessions are kept, and how many of one client: an idle one leaves, with its memory, and
 * nobody's many names push out another's. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define MANY 40

static struct pen_request request;

static struct pen_renderer *make(double idle_ms)
{
    struct pen_error error = {0};
    struct pen_renderer *r =
        pen_renderer_create(&(struct pen_renderer_config){.session_idle_ms = idle_ms}, &error);
    uint8_t id[PEN_ID_BYTES];
    if (!r)
        return NULL;
    fixture_scene(r, PEN_GENERATED_HALF_PLANE, 0, 1, id);
    fixture_request(&request, id, "temporal");
    request.width = 40, request.height = 30;
    double texels = 64;
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), "temporal");
    pen_param_store(
        pen_param_find(info->params, "map_size"), request.technique_params, &texels, "", NULL);
    return r;
}

/* Frames that the session's next one rests on. */
static uint32_t frame(struct pen_renderer *r, uint32_t owner, const char *name)
{
    struct pen_result result;
    struct pen_delivery *delivery = &request.delivery;
    delivery->session_owner[0] = owner;
    snprintf(delivery->session, sizeof delivery->session, "%s", name);
    fixture_render(r, &request, &result);
    return result.history_frames;
}

static void check_idle(struct pen_renderer *r)
{
    CHECK(frame(r, 1, "") == 0);
    uint64_t without = pen_renderer_gpu_bytes(r);
    CHECK(frame(r, 1, "a") == 0 && frame(r, 1, "b") == 0);
    CHECK(pen_renderer_gpu_bytes(r) > without);
    usleep(20000);
    CHECK(frame(r, 1, "") == 0); /* any render looks whether somebody is idle */
    /* What frames are drawn into stays, as it does for others; the sessions' own is gone. */
    uint64_t after = pen_renderer_gpu_bytes(r);
    usleep(20000);
    CHECK(frame(r, 1, "a") == 0); /* it begins anew */
    usleep(20000);
    frame(r, 1, "");
    CHECK(pen_renderer_gpu_bytes(r) == after);
    pen_renderer_destroy(r);
}

static void check_kept(struct pen_renderer *r)
{
    char name[16];
    CHECK(frame(r, 2, "kept") == 0 && frame(r, 1, "kept") == 0);
    CHECK(frame(r, 1, "kept") == 1); /* the other client's is another */
    for (uint32_t i = 0; i < MANY; i++) {
        snprintf(name, sizeof name, "%u", i);
        CHECK(frame(r, 1, name) == 0);
    }
    uint64_t bytes = pen_renderer_gpu_bytes(r);
    for (uint32_t i = MANY; i < 2 * MANY; i++) {
        snprintf(name, sizeof name, "%u", i);
        CHECK(frame(r, 1, name) == 0);
    }
    CHECK(pen_renderer_gpu_bytes(r) == bytes);
    CHECK(frame(r, 2, "kept") == 1);
    CHECK(frame(r, 1, "kept") == 0);
    CHECK(frame(r, 1, name) == 1);
    pen_renderer_destroy(r);
}

int main(void)
{
    struct pen_renderer *r = make(1);
    if (!r)
        return 77;
    check_idle(r);
    check_kept(make(3.6e6));
    CHECK_DONE();
}
