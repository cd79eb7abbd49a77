/* Renders in turns: whatever is drawn in between, and however finely a render is cut, its picture is
 * the one it gives in one piece; one that is given up leaves nothing behind. */
#include "protocol/fnv.h"
#include "renderer/gl/fiber.h"
#include "renderer/gl/release.h"
#include "renderer/gl/target.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <stdio.h>
#include <string.h>

#define SHORTEST 0.0 /* ms: a pause wherever there can be one */

struct counting {
    struct gl_fiber *fiber;
    int sum;
};

static void count_to_three(void *context)
{
    struct counting *c = context;
    for (int i = 1; i <= 3; i++) {
        c->sum += i;
        gl_fiber_pause(c->fiber);
    }
}

static void check_fiber(void)
{
    struct counting c[2] = {{gl_fiber_create(), 0}, {gl_fiber_create(), 100}};
    for (int round = 0; round < 2; round++) {
        for (int k = 0; k < 2; k++)
            gl_fiber_begin(c[k].fiber, count_to_three, &c[k]);
        for (int i = 0; i < 3; i++)
            for (int k = 0; k < 2; k++)
                CHECK(!gl_fiber_resume(c[k].fiber));
        for (int k = 0; k < 2; k++)
            CHECK(gl_fiber_resume(c[k].fiber));
    }
    CHECK(c[0].sum == 12 && c[1].sum == 112);
    for (int k = 0; k < 2; k++)
        gl_fiber_destroy(c[k].fiber);
}

static uint64_t hash_frame(const struct pen_frame *frame)
{
    uint64_t hash = PEN_FNV_START;
    static const size_t bytes[] = {4, 8, 16};
    for (uint32_t i = 0; i < frame->plane_count; i++)
        hash = pen_fnv(hash, frame->planes[i].data,
            (size_t)frame->width * frame->height * bytes[frame->planes[i].pixel]);
    return hash;
}

static uint64_t whole(struct pen_renderer *r, const struct pen_request *request)
{
    struct pen_result result;
    struct pen_frame frame;
    struct pen_error error = {0};
    pen_renderer_drop_shadows(r);
    if (!pen_renderer_render(r, request, &frame, &result, &error)) {
        fprintf(stderr, "%s: %s\n", request->technique, error.message);
        return 0;
    }
    uint64_t hash = hash_frame(&frame);
    pen_frame_finish(&frame);
    return hash;
}

#define ABREAST 3

/* All side by side, a turn each; returns the number of turns. */
static uint32_t in_turns(struct pen_renderer *r, const struct pen_request requests[ABREAST],
    double ms, uint64_t hashes[ABREAST])
{
    static struct pen_result results[ABREAST];
    struct pen_frame frames[ABREAST];
    struct pen_error error = {0};
    struct pen_render *renders[ABREAST];
    bool ended[ABREAST] = {false};
    uint32_t turns = 0, left = ABREAST;
    pen_renderer_drop_shadows(r);
    for (int k = 0; k < ABREAST; k++) {
        renders[k] = pen_render_begin(r, &requests[k], &frames[k], &results[k], &error);
        if (!renders[k]) {
            fprintf(stderr, "%s\n", error.message);
            return 0;
        }
    }
    while (left)
        for (int k = 0; k < ABREAST; k++)
            if (!ended[k]) {
                ended[k] = pen_render_advance(renders[k], ms);
                left -= ended[k];
                turns++;
            }
    for (int k = 0; k < ABREAST; k++) {
        hashes[k] = 0;
        if (!pen_render_end(renders[k], &error))
            fprintf(stderr, "%s: %s\n", requests[k].technique, error.message);
        else
            hashes[k] = hash_frame(&frames[k]);
        pen_frame_finish(&frames[k]);
    }
    return turns;
}

static void set_number(struct pen_request *request, const char *name, double value)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), request->technique);
    const struct pen_param *row = pen_param_find(info->params, name);
    if (row && row->min <= value && row->max >= value)
        pen_param_store(row, request->technique_params, &value, "", NULL);
}

/* The same passes for less work. */
static void make_cheap(struct pen_request *request, double samples)
{
    set_number(request, "samples", samples);
    set_number(request, "map_size", 256);
    set_number(request, "series_size", 256);
}

/* Every method beside its neighbour in the list, with other sizes, cameras and lights, and beside
 * itself. */
static void check_methods(struct pen_renderer *r, const uint8_t scenes[2][PEN_ID_BYTES])
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    for (uint32_t i = 0; i < catalogue->count; i++) {
        struct pen_request all[ABREAST], *a = &all[0], *b = &all[1], *c = &all[2];
        fixture_request(a, scenes[0], catalogue->items[i]->name);
        fixture_request(b, scenes[1], catalogue->items[(i + 1) % catalogue->count]->name);
        fixture_request(c, scenes[1], catalogue->items[i]->name);
        a->antialias = 2;
        a->height = 200; /* more than a band */
        b->width = 333, b->height = 130;
        b->lights_given = true;
        b->light_count = 2;
        for (int k = 0; k < 2; k++) {
            pen_light_default(&b->lights[k], k ? PEN_LIGHT_RECT : PEN_LIGHT_SUN);
            b->lights[k].position[0] = 2 * k, b->lights[k].position[1] = 4;
            b->lights[k].position[2] = 1;
        }
        c->width = 100, c->height = 70;
        uint64_t expected[ABREAST], got[ABREAST];
        for (int k = 0; k < ABREAST; k++) {
            make_cheap(&all[k], 20);
            expected[k] = whole(r, &all[k]);
            CHECK(expected[k]);
        }
        uint32_t turns = in_turns(r, all, SHORTEST, got);
        printf("%s beside %s: %u turns\n", a->technique, b->technique, turns);
        /* At least two passes of each frame have all pixels, and no piece has more than 64 x 8. */
        CHECK(turns > 2 * (2 * 4 * 25 + 6 * 17 + 2 * 9));
        for (int k = 0; k < ABREAST; k++)
            CHECK(got[k] == expected[k]);
    }
}

/* Given up after few and after many turns. */
static void check_giving_up(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    gl_release(); /* whose target is made the first time */
    for (uint32_t i = 0; i < catalogue->count; i++) {
        struct pen_request request;
        fixture_request(&request, scene, catalogue->items[i]->name);
        make_cheap(&request, 40);
        request.width = 96, request.height = 72;
        uint64_t expected = whole(r, &request), bytes = gl_targets_bytes();
        for (uint32_t most = 0; most < 60; most = 2 * most + 1) {
            struct pen_result result;
            struct pen_frame frame;
            struct pen_error error = {0};
            pen_renderer_drop_shadows(r);
            struct pen_render *render = pen_render_begin(r, &request, &frame, &result, &error);
            bool ended = false;
            for (uint32_t turn = 0; turn < most && !ended; turn++)
                ended = pen_render_advance(render, SHORTEST);
            bool ok = pen_render_end(render, &error);
            CHECK(ok == ended);
            if (!ok)
                CHECK(error.code == PEN_LOST && !frame.plane_count);
            pen_frame_finish(&frame);
        }
        CHECK(gl_targets_bytes() == bytes);
        CHECK(whole(r, &request) == expected);
    }
}

static bool count_call(void *context)
{
    ++*(uint32_t *)context;
    return true;
}

static void (*real_finish)(void);
static uint32_t finishes;

static void count_finish(void)
{
    finishes++;
    real_finish();
}

/* In turns a software device is not made to wait more often than in one piece: there is always something
 * more for it to do, except where another render was at it. */
static void check_busy(struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES])
{
    struct pen_request request;
    struct pen_result result;
    struct pen_frame frame;
    struct pen_error error = {0};
    uint32_t turns = 1;
    fixture_request(&request, scene, "multisample");
    make_cheap(&request, 40);
    request.edges = PEN_EDGES_NONE; /* made by hand, row by row */
    uint64_t expected = whole(r, &request);
    real_finish = gl.Finish;
    gl.Finish = count_finish;
    CHECK(whole(r, &request) == expected);
    uint32_t most = finishes + 1;
    finishes = 0;
    pen_renderer_drop_shadows(r);
    struct pen_render *render = pen_render_begin(r, &request, &frame, &result, &error);
    while (!pen_render_advance(render, SHORTEST))
        turns++;
    CHECK(pen_render_end(render, &error) && hash_frame(&frame) == expected);
    gl.Finish = real_finish;
    printf("%u turns, waited %u times, in one piece %u\n", turns, finishes, most - 1);
    CHECK(turns > 100 && finishes <= most);
    pen_frame_finish(&frame);
}

/* Who is called comes back after each piece of work, whatever time there is. */
static void check_calling(void)
{
    uint32_t calls = 0, turns = 1;
    uint8_t scene[PEN_ID_BYTES];
    struct pen_error error = {0};
    struct pen_renderer *r = pen_renderer_create(
        &(struct pen_renderer_config){.is_called = count_call, .call_context = &calls}, &error);
    struct pen_request request;
    struct pen_result result;
    struct pen_frame frame;
    fixture_scene(r, PEN_GENERATED_PLANAR_MASK, 0, 1, scene);
    fixture_request(&request, scene, "multisample");
    make_cheap(&request, 40);
    uint64_t expected = whole(r, &request);
    CHECK(calls == 0); /* in one piece means that */
    pen_renderer_drop_shadows(r);
    struct pen_render *render = pen_render_begin(r, &request, &frame, &result, &error);
    while (!pen_render_advance(render, 1e9))
        turns++;
    CHECK(pen_render_end(render, &error) && hash_frame(&frame) == expected);
    CHECK(turns > 12 && calls == turns - 1); /* G-buffer, maps, lookups, shading */
    pen_frame_finish(&frame);
    pen_renderer_destroy(r);
}

int main(void)
{
    struct pen_error error;
    check_fiber();
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    uint8_t scenes[2][PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, scenes[0]);
    fixture_scene(r, PEN_GENERATED_PLANAR_MASK, 0, 1, scenes[1]);
    check_methods(r, scenes);
    check_giving_up(r, scenes[1]);
    check_busy(r, scenes[1]);
    pen_renderer_destroy(r);
    check_calling();
    CHECK(gl_targets_bytes() == 0);
    CHECK_DONE();
}
