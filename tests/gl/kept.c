/* A request for more samples of what was drawn before goes on with it: the picture is that of one
 * piece, and only what is missing is drawn. */
#include "protocol/fnv.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define WIDTH 80
#define HEIGHT 60
#define PIXEL_BYTES 16 /* of a sum */

static void set_number(struct pen_request *request, const char *name, double value)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), request->technique);
    const struct pen_param *row = pen_param_find(info->params, name);
    CHECK(row && pen_param_store(row, request->technique_params, &value, "", NULL));
}

static uint64_t hash_of(struct pen_frame *frame)
{
    uint64_t hash =
        pen_fnv(PEN_FNV_START, frame->planes[0].data, (size_t)frame->width * frame->height * 4);
    pen_frame_finish(frame);
    return hash;
}

/* Goes on with what there is. turns > 0: gives up after so many, and returns 0. */
static uint64_t go_on(struct pen_renderer *r, const struct pen_request *request, double budget_ms,
    uint32_t turns, struct pen_result *result)
{
    struct pen_frame frame;
    struct pen_error error = {0};
    struct pen_render *render = pen_render_begin(r, request, &frame, result, &error);
    CHECK(render != NULL);
    if (!render)
        return 0;
    pen_render_limit(render, budget_ms, 0);
    pen_render_continue(render);
    bool ended = false;
    for (uint32_t i = 0; !ended && (!turns || i < turns); i++)
        ended = pen_render_advance(render, turns ? 0 : INFINITY);
    bool ok = pen_render_end(render, &error);
    CHECK(ok == ended);
    return ok ? hash_of(&frame) : 0;
}

static uint32_t count_of(const struct pen_result *result, const char *pass)
{
    for (uint32_t i = 0; i < result->pass_count; i++)
        if (!strcmp(result->passes[i].name, pass))
            return result->passes[i].count;
    return 0;
}

static uint64_t whole(
    struct pen_renderer *r, const struct pen_request *request, struct pen_result *result)
{
    pen_renderer_drop_shadows(r);
    return fixture_render(r, request, result);
}

static void make_request(
    struct pen_request *request, const uint8_t scene[PEN_ID_BYTES], uint32_t samples)
{
    fixture_request(request, scene, "multisample");
    request->width = WIDTH, request->height = HEIGHT;
    request->camera.mode = PEN_CAMERA_ORBIT;
    set_number(request, "samples", samples);
    set_number(request, "map_size", 128);
}

/* From `first` to `then` samples. */
static void check_more(struct pen_renderer *r, struct pen_request *request, uint32_t first,
    uint32_t then, uint32_t taken)
{
    struct pen_result part, more, one;
    set_number(request, "samples", first);
    go_on(r, request, 0, 0, &part);
    CHECK(part.progress.done == first && part.progress.kept == 0);
    set_number(request, "samples", then);
    pen_renderer_drop_shadows(r);
    uint64_t hash = go_on(r, request, 0, 0, &more);
    CHECK(more.progress.done == then && more.progress.kept == taken);
    CHECK(hash == whole(r, request, &one));
    CHECK(one.progress.kept == 0);
    CHECK(more.shadow_maps == one.shadow_maps);
    printf("%u to %u: %u of %u lookups\n", first, then, count_of(&more, "multisample lookup"),
        count_of(&one, "multisample lookup"));
    CHECK(count_of(&more, "multisample lookup") < count_of(&one, "multisample lookup"));
}

/* Batches of 4, 12, 16, 16, ... */
static void check_batches(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request request;
    struct pen_result result;
    make_request(&request, scene, 16);
    check_more(r, &request, 16, 64, 16);
    uint64_t hash = whole(r, &request, &result);
    /* All are there, and fewer are not to be had from them. */
    CHECK(go_on(r, &request, 0, 0, &result) == hash);
    CHECK(result.progress.kept == 64 && !count_of(&result, "multisample lookup"));
    set_number(&request, "samples", 20);
    hash = whole(r, &request, &result);
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == 0);
    set_number(&request, "samples", 80);
    hash = whole(r, &request, &result);
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == 64);
    /* What is no whole batch is taken again. */
    request.camera.azimuth_deg += 10;
    check_more(r, &request, 10, 50, 4);
    request.camera.azimuth_deg += 10;
    set_number(&request, "samples", 2);
    go_on(r, &request, 0, 0, &result);
    set_number(&request, "samples", 7);
    hash = whole(r, &request, &result);
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == 0);
}

/* Each of them a picture of its own. */
static void check_others(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request first, other;
    struct pen_result result;
    make_request(&first, scene, 16);
    first.lights_given = true;
    first.light_count = 1;
    pen_light_default(&first.lights[0], PEN_LIGHT_RECT);
    first.lights[0].position[1] = 4;
    go_on(r, &first, 0, 0, &result);
    for (int i = 0; i < 8; i++) {
        other = first;
        set_number(&other, "samples", 32);
        switch (i) {
        case 0:
            other.antialias = 2;
            break;
        case 1:
            set_number(&other, "map_size", 64);
            break;
        case 2:
            set_number(&other, "bias", 0.01);
            break;
        case 3:
            other.width = WIDTH + 1;
            break;
        case 4:
            other.lights[0].position[0] = 0.5;
            break;
        case 5:
            other.casters = PEN_CASTERS_FRONT;
            break;
        case 6:
            other.camera.elevation_deg += 1;
            break;
        case 7:
            other.lights[0].width *= 2;
            break;
        }
        uint64_t hash = whole(r, &other, &result);
        CHECK(go_on(r, &other, 0, 0, &result) == hash);
        CHECK(result.progress.kept == 0);
    }
    /* The file's format is no other picture. */
    other = first;
    set_number(&other, "samples", 32);
    other.output.format = PEN_JPEG;
    go_on(r, &other, 0, 0, &result);
    CHECK(result.progress.kept == 16);
}

/* Rays of a pixel's own samples are all traced once, and its pre-test as well. */
static void check_rays(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES], bool adaptive,
    bool weighted, uint32_t layer)
{
    struct pen_request request;
    struct pen_result part, more, one, again;
    fixture_request(&request, scene, "raytraced");
    request.width = WIDTH, request.height = HEIGHT;
    request.output.layer = layer;
    set_number(&request, "backend", 2);
    set_number(&request, "samples", 100); /* 128 */
    set_number(&request, "adaptive", adaptive);
    set_number(&request, "weighting", weighted);
    go_on(r, &request, 0, 0, &part);
    CHECK(part.progress.kept == 0);
    set_number(&request, "samples", 512);
    uint64_t hash = whole(r, &request, &one);
    CHECK(go_on(r, &request, 0, 0, &more) == hash);
    CHECK(more.progress.kept == 128 && more.progress.done == 512);
    CHECK(part.rays > 0 && part.rays + more.rays == one.rays);
    CHECK(more.full_work_pixels == one.full_work_pixels);
    CHECK(go_on(r, &request, 0, 0, &again) == hash);
    CHECK(again.progress.kept == 512 && again.rays == 0);
    CHECK(again.full_work_pixels == one.full_work_pixels);
    /* Blocks of 64 and less are other points; another seed is another set. */
    set_number(&request, "samples", 32);
    hash = whole(r, &request, &one);
    CHECK(go_on(r, &request, 0, 0, &more) == hash && more.progress.kept == 0);
    set_number(&request, "samples", 1024);
    set_number(&request, "seed", 7);
    CHECK(go_on(r, &request, 0, 0, &more) != 0 && more.progress.kept == 0);
    /* What had to end early. */
    set_number(&request, "seed", 8);
    hash = whole(r, &request, &one);
    go_on(r, &request, 1e-3, 0, &part);
    CHECK(part.progress.done < 1024);
    CHECK(go_on(r, &request, 0, 0, &more) == hash);
    CHECK(more.progress.kept == (part.progress.done >= 64 ? part.progress.done : 0));
}

/* Each jittered frame, light and face has sums of its own. */
static void check_many(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request request;
    make_request(&request, scene, 16);
    request.antialias = 2;
    request.lights_given = true;
    request.light_count = 2;
    for (int k = 0; k < 2; k++) {
        pen_light_default(&request.lights[k], k ? PEN_LIGHT_SPHERE : PEN_LIGHT_DISK);
        request.lights[k].position[0] = 2 * k, request.lights[k].position[1] = 4;
        request.lights[k].position[2] = 1;
    }
    struct pen_result part, more, one;
    go_on(r, &request, 0, 0, &part);
    set_number(&request, "samples", 32);
    uint64_t hash = go_on(r, &request, 0, 0, &more);
    CHECK(hash == whole(r, &request, &one));
    CHECK(more.progress.kept == 2 * 16 && more.progress.done == 2 * 32);
}

/* What had to end early, and what nobody waited for. */
static void check_begun(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request request;
    struct pen_result result;
    make_request(&request, scene, 100);
    request.camera.azimuth_deg += 20;
    uint64_t hash = whole(r, &request, &result);
    pen_renderer_drop_shadows(r);
    go_on(r, &request, 1, 0, &result);
    uint32_t done = result.progress.done;
    CHECK(done >= 4 && done < 100);
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == done);
    request.camera.azimuth_deg += 20;
    hash = whole(r, &request, &result);
    for (uint32_t turns = 10; turns < 13; turns++) /* in the midst of a batch or not */
        CHECK(go_on(r, &request, 0, turns, &result) == 0);
    CHECK(go_on(r, &request, 0, 0, &result) == hash);
    CHECK(result.progress.kept % 16 == 0 || result.progress.kept == 4);
}

static void check_scene_goes(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request request;
    struct pen_result result;
    uint8_t other[PEN_ID_BYTES];
    make_request(&request, scene, 16);
    request.camera.azimuth_deg += 60;
    uint64_t hash = go_on(r, &request, 0, 0, &result);
    fixture_scene(r, PEN_GENERATED_PLANAR_MASK, 0, 2, other);
    struct pen_request between = request;
    memcpy(between.scene, other, PEN_ID_BYTES);
    go_on(r, &between, 0, 0, &result);
    CHECK(result.progress.kept == 0);
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == 16);
    pen_renderer_drop_scene(r, scene);
    uint8_t same[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, same);
    CHECK(!memcmp(same, scene, PEN_ID_BYTES));
    CHECK(go_on(r, &request, 0, 0, &result) == hash && result.progress.kept == 0);
}

/* Sixteen requests' sums, whatever comes. */
static void check_bounds(struct pen_renderer *r)
{
    struct pen_request request;
    struct pen_result result;
    uint64_t full = 0, kept = 0;
    uint8_t scene[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_HALF_PLANE, 0, 3, scene);
    make_request(&request, scene, 4);
    request.sky.on = 0;
    request.width = 32, request.height = 24;
    for (uint32_t i = 0; i < 30; i++) {
        request.camera.azimuth_deg = (float)i;
        pen_renderer_drop_shadows(r);
        go_on(r, &request, 0, 0, &result);
        full = i == 19 ? pen_renderer_gpu_bytes(r) : full;
        if (i >= 20)
            CHECK(pen_renderer_gpu_bytes(r) <= full);
    }
    for (uint32_t i = 30; i-- > 0;) {
        request.camera.azimuth_deg = (float)i;
        set_number(&request, "samples", 3); /* leaves what there is as it is */
        go_on(r, &request, 0, 0, &result);
        set_number(&request, "samples", 4);
        if (i >= 14)
            go_on(r, &request, 0, 0, &result), kept += result.progress.kept == 4;
    }
    CHECK(kept == 16);
}

/* They go first when there is no room: nothing else is made again. */
static void check_pressure(void)
{
    struct pen_error error;
    uint8_t scene[PEN_ID_BYTES];
    uint64_t budget = 0;
    for (int small = 0; small < 2; small++) {
        struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, budget, &error);
        struct pen_request request;
        struct pen_result result;
        fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, scene);
        make_request(&request, scene, 16);
        request.width = 4 * WIDTH, request.height = 4 * HEIGHT;
        uint64_t hash = fixture_render(r, &request, &result);
        /* Room for all that is there now, and for a part of a sum. */
        budget = pen_renderer_gpu_bytes(r) + (uint64_t)request.width * request.height * 8;
        go_on(r, &request, 0, 0, &result);
        CHECK(result.gpu_bytes <= budget || !small);
        CHECK(go_on(r, &request, 0, 0, &result) == hash);
        CHECK(result.progress.kept == (small ? 0 : 16));
        CHECK(!small || result.shadow_inputs_reused);
        pen_renderer_destroy(r);
    }
}

int main(void)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    uint8_t scene[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, scene);
    check_batches(r, scene);
    check_others(r, scene);
    check_many(r, scene);
    check_rays(r, scene, true, false, PEN_LAYER_BEAUTY);
    check_rays(r, scene, false, false, PEN_LAYER_BEAUTY);
    check_rays(r, scene, true, true, PEN_LAYER_BEAUTY);
    check_rays(r, scene, true, false, PEN_LAYER_ERROR);
    check_begun(r, scene);
    check_bounds(r);
    check_scene_goes(r, scene);
    pen_renderer_destroy(r);
    check_pressure();
    CHECK_DONE();
}
