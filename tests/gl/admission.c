/* What there is no room for beside renders in progress waits, and is refused only when it would not
 * fit alone. */
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>
#include <unistd.h>

#define TRIANGLES 60000

enum { IN_USE, WANTED, IMAGE, BLOBS }; /* of equal size */

struct blobs {
    uint8_t ids[BLOBS][PEN_ID_BYTES];
    int fds[BLOBS];
};

struct progress {
    struct pen_request request;
    struct pen_frame frame;
    struct pen_result result;
    struct pen_render *render;
};

static struct blobs blobs;

static void make_blobs(void)
{
    for (uint32_t i = 0; i < BLOBS; i++)
        blobs.fds[i] = fixture_blob(PEN_GENERATED_HAIRBALL, TRIANGLES, i + 1, blobs.ids[i]);
}

/* `image`: the request needs IMAGE, too. */
static enum pen_admission admit(struct pen_renderer *r, const struct pen_request *request, int blob,
    bool image, struct pen_error *error)
{
    struct pen_blobs wanted = {.count = 1 + image,
        .ids = {blobs.ids[blob], blobs.ids[IMAGE]},
        .fds = {blobs.fds[blob], blobs.fds[IMAGE]}};
    memset(error, 0, sizeof *error);
    return pen_renderer_admit(r, request, &wanted, error);
}

static void make_request_of(struct pen_request *request, int blob, double texels)
{
    fixture_request(request, blobs.ids[blob], "pcf");
    const struct pen_technique_info *info = pen_catalogue_find(pen_renderer_catalogue(), "pcf");
    pen_param_store(
        pen_param_find(info->params, "map_size"), request->technique_params, &texels, "", NULL);
    request->width = 80, request->height = 60;
}

static void make_request(struct pen_request *request, int blob)
{
    make_request_of(request, blob, 64); /* so that shadow inputs hardly count */
}

/* One that has begun and has its first turn. */
static void begin(struct pen_renderer *r, struct progress *p, int blob)
{
    struct pen_error error;
    make_request(&p->request, blob);
    CHECK(admit(r, &p->request, blob, false, &error) == PEN_ADMITTED);
    p->render = pen_render_begin(r, &p->request, &p->frame, &p->result, &error);
    /* Two pieces of work: the picture's buffers and the G-buffer. */
    CHECK(p->render && !pen_render_advance(p->render, 0) && !pen_render_advance(p->render, 0));
}

static void end(struct progress *p)
{
    while (!pen_render_advance(p->render, 1000))
        ;
    CHECK(pen_render_end(p->render, NULL));
    pen_frame_finish(&p->frame);
}

static uint64_t bytes_of_one(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    uint64_t bytes = 0;
    if (r && pen_renderer_load_scene(r, blobs.ids[0], blobs.fds[0], &error))
        bytes = pen_renderer_gpu_bytes(r);
    pen_renderer_destroy(r);
    return bytes;
}

/* There is room for two blobs and a half, and three are wanted. */
static void check_scenes_in_use(uint64_t blob)
{
    struct pen_error error;
    uint64_t budget = 5 * blob / 2;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    struct pen_request request;
    struct pen_result result;
    struct progress other = {0};
    make_request(&request, WANTED);
    CHECK(admit(r, &request, WANTED, true, &error) == PEN_ADMITTED);
    uint64_t alone = fixture_render(r, &request, &result);
    pen_renderer_drop_scene(r, blobs.ids[WANTED]);
    pen_renderer_drop_scene(r, blobs.ids[IMAGE]);
    begin(r, &other, IN_USE);
    for (int i = 0; i < 3; i++) {
        CHECK(admit(r, &request, WANTED, true, &error) == PEN_LATER && !error.code);
        CHECK(pen_renderer_has_scene(r, blobs.ids[IN_USE]));
        CHECK(pen_renderer_gpu_bytes(r) <= budget);
    }
    /* Without its image there is room. */
    CHECK(admit(r, &request, WANTED, false, &error) == PEN_ADMITTED);
    CHECK(admit(r, &request, WANTED, true, &error) == PEN_LATER);
    end(&other);
    CHECK(admit(r, &request, WANTED, true, &error) == PEN_ADMITTED);
    CHECK(pen_renderer_has_scene(r, blobs.ids[WANTED]) &&
          pen_renderer_has_scene(r, blobs.ids[IMAGE]));
    CHECK(fixture_render(r, &request, &result) == alone);
    pen_renderer_destroy(r);
}

/* The picture's own buffers count while it is being made, and afterwards as long as they are kept. */
static void check_pictures(uint64_t blob)
{
    struct pen_error error;
    uint64_t budget = 3 * blob;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    struct pen_request large, small;
    struct progress other = {0};
    make_request(&small, IN_USE);
    make_request(&large, IN_USE);
    /* 28 bytes are the least that a pixel takes: depth, two normals, albedo, surface, visibility. */
    large.width = 1024;
    large.height = (uint32_t)(3 * blob / 4 / (28 * 1024));
    begin(r, &other, IN_USE);
    CHECK(pen_renderer_gpu_bytes(r) > blob + 80 * 60 * 20);
    CHECK(admit(r, &small, IN_USE, false, &error) == PEN_ADMITTED);
    struct progress big = {.request = large};
    CHECK(admit(r, &large, IN_USE, false, &error) == PEN_ADMITTED);
    big.render = pen_render_begin(r, &big.request, &big.frame, &big.result, &error);
    CHECK(big.render != NULL);
    CHECK(admit(r, &large, IN_USE, false, &error) == PEN_LATER);
    CHECK(admit(r, &small, IN_USE, false, &error) == PEN_ADMITTED);
    end(&other);
    CHECK(admit(r, &large, IN_USE, false, &error) == PEN_LATER);
    end(&big);
    CHECK(pen_renderer_gpu_bytes(r) <= budget);
    CHECK(admit(r, &large, IN_USE, false, &error) == PEN_ADMITTED);
    /* Too large alone: the numbers are named. */
    large.height *= 6;
    CHECK(admit(r, &large, IN_USE, false, &error) == PEN_REFUSED && error.code == PEN_TOO_BIG);
    CHECK(strstr(error.message, "fewer pixels") && strstr(error.message, "--gpu-memory"));
    char allowed[32];
    snprintf(allowed, sizeof allowed, "%.0f MiB are allowed", (double)budget / (1 << 20));
    CHECK(strstr(error.message, allowed));
    CHECK(admit(r, &small, IN_USE, false, &error) == PEN_ADMITTED);
    pen_renderer_destroy(r);
}

/* The light follows the camera: each picture needs a map of its own. */
static void turn_camera(struct pen_request *request, int step)
{
    request->camera.mode = PEN_CAMERA_ORBIT;
    request->camera.azimuth_deg = 40 * (float)step;
}

/* There is room for two maps and a half: the third frame's takes the place of the first's when it is
 * drawn, not when the frame has ended. */
static void check_maps_within_a_frame(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    struct progress frame = {0};
    struct pen_result result;
    uint64_t bytes[2];
    make_request_of(&frame.request, IN_USE, 2048);
    CHECK(admit(r, &frame.request, IN_USE, false, &error) == PEN_ADMITTED);
    for (int i = 0; i < 2; i++) {
        turn_camera(&frame.request, i);
        fixture_render(r, &frame.request, &result);
        bytes[i] = pen_renderer_gpu_bytes(r);
    }
    pen_renderer_destroy(r);
    uint64_t map = bytes[1] - bytes[0], budget = bytes[1] + map / 2;
    CHECK(map >= 2048 * 2048 * 4);
    r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    for (int i = 0; i < 4; i++) {
        turn_camera(&frame.request, i);
        CHECK(admit(r, &frame.request, IN_USE, false, &error) == PEN_ADMITTED);
        frame.render = pen_render_begin(r, &frame.request, &frame.frame, &frame.result, &error);
        CHECK(frame.render);
        while (frame.render && !pen_render_advance(frame.render, 0))
            CHECK(pen_renderer_gpu_bytes(r) <= budget);
        CHECK(pen_render_end(frame.render, NULL));
        pen_frame_finish(&frame.frame);
    }
    pen_renderer_destroy(r);
}

/* Of `count` lights, each with maps of its own; what the renderer holds between any two pieces goes to
 * *most. */
static uint64_t render_lights(
    struct pen_renderer *r, const char *technique, uint32_t count, uint64_t *most)
{
    struct pen_error error;
    struct progress p = {0};
    struct pen_result first;
    fixture_request(&p.request, blobs.ids[IN_USE], technique);
    p.request.width = 80, p.request.height = 60;
    CHECK(admit(r, &p.request, IN_USE, false, &error) == PEN_ADMITTED);
    fixture_render(r, &p.request, &first);
    p.request.lights_given = 1;
    p.request.light_count = count;
    for (uint32_t i = 0; i < count; i++) {
        p.request.lights[i] = first.completed.lights[0];
        p.request.lights[i].position[0] += 0.1f * (float)i;
    }
    CHECK(admit(r, &p.request, IN_USE, false, &error) == PEN_ADMITTED);
    p.render = pen_render_begin(r, &p.request, &p.frame, &p.result, &error);
    CHECK(p.render);
    *most = 0;
    while (p.render && !pen_render_advance(p.render, 0))
        if (pen_renderer_gpu_bytes(r) > *most)
            *most = pen_renderer_gpu_bytes(r);
    CHECK(pen_render_end(p.render, NULL));
    uint64_t hash = fixture_hash(&p.frame);
    pen_frame_finish(&p.frame);
    return hash;
}

/* A light's maps go where the next one's want to be: a frame of many lights takes no more memory than
 * one of a few, and is the same. What is used up by making a map (`vssm`: sums of rows) counts. */
static void check_lights_within_a_frame(void)
{
    static const char *const techniques[] = {"pcf", "vssm"};
    struct pen_error error;
    for (int i = 0; i < 2; i++) {
        uint64_t most[3];
        struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
        render_lights(r, techniques[i], 3, &most[0]);
        uint64_t whole = render_lights(r, techniques[i], 8, &most[1]);
        pen_renderer_destroy(r);
        CHECK(most[1] > 3 * most[0] / 2); /* else it shows nothing */
        r = fixture_renderer(PEN_DEVICE_AUTO, most[0], &error);
        CHECK(render_lights(r, techniques[i], 8, &most[2]) == whole && most[2] <= most[0]);
        pen_renderer_destroy(r);
    }
}

/* A map that cannot fit is refused with the numbers, and the next picture is as before. */
static void check_maps_too_large(void)
{
    struct pen_error error = {0};
    const uint64_t budget = 160u << 20;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
    struct pen_request small, large;
    struct pen_result result;
    struct pen_frame frame;
    make_request_of(&small, IN_USE, 1024);
    make_request_of(&large, IN_USE, 8192); /* 256 MiB of depth alone */
    CHECK(admit(r, &small, IN_USE, false, &error) == PEN_ADMITTED);
    uint64_t before = fixture_render(r, &small, &result);
    CHECK(!pen_renderer_render(r, &large, &frame, &result, &error));
    CHECK(error.code == PEN_TOO_BIG && strstr(error.message, "160 MiB are allowed"));
    CHECK(fixture_render(r, &small, &result) == before);
    CHECK(pen_renderer_gpu_bytes(r) <= budget);
    /* Nor beside another frame: it would not fit when that has ended. */
    struct progress other = {0};
    begin(r, &other, IN_USE);
    CHECK(!pen_renderer_render(r, &large, &frame, &result, &error) && error.code == PEN_TOO_BIG);
    CHECK(pen_renderer_gpu_bytes(r) <= budget);
    end(&other);
    pen_renderer_destroy(r);
}

int main(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r)
        return 77;
    pen_renderer_destroy(r);
    make_blobs();
    uint64_t blob = bytes_of_one();
    CHECK(blob > 1 << 20);
    check_scenes_in_use(blob);
    check_pictures(blob);
    check_maps_within_a_frame();
    check_lights_within_a_frame();
    check_maps_too_large();
    for (uint32_t i = 0; i < BLOBS; i++)
        close(blobs.fds[i]);
    CHECK_DONE();
}
