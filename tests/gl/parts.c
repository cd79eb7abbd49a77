/* Renders that are watched: what is shown of a picture comes nearer to it, and it ends as it does when
 * nobody looks. */
#include "protocol/memory.h"
#include "tests/gl/fixture.h"
#include "tests/unit/check.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define MAX_PARTS 64

struct parts {
    struct pen_frame frames[MAX_PARTS];
    struct pen_result results[MAX_PARTS];
    uint32_t count;
};

static bool wants(void *context)
{
    return ((struct parts *)context)->count < MAX_PARTS;
}

static void show(void *context, const struct pen_frame *frame, const struct pen_result *result)
{
    struct parts *parts = context;
    parts->frames[parts->count] = *frame;
    parts->results[parts->count++] = *result;
}

/* Empties it. */
static void finish(struct parts *parts)
{
    for (uint32_t i = 0; i < parts->count; i++)
        pen_frame_finish(&parts->frames[i]);
    parts->count = 0;
}

/* `parts` NULL: nobody watches. */
static bool render(struct pen_renderer *r, const struct pen_request *request, double ms,
    struct parts *parts, struct pen_frame *frame, struct pen_result *result)
{
    struct pen_error error = {0};
    struct pen_render *render = pen_render_begin(r, request, frame, result, &error);
    if (render && parts)
        pen_render_watch(render, &(struct pen_viewer){wants, show, parts, .share = INFINITY});
    while (render && !pen_render_advance(render, ms))
        ;
    if (render && pen_render_end(render, &error))
        return true;
    fprintf(stderr, "%s: %s\n", request->technique, error.message);
    return false;
}

static void set_number(struct pen_request *request, const char *name, double value)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), request->technique);
    const struct pen_param *row = pen_param_find(info->params, name);
    if (row && (row->choices || (row->min <= value && row->max >= value)))
        pen_param_store(row, request->technique_params, &value, "", NULL);
}

/* Watched in one piece and in turns. */
static void check_watching(struct pen_renderer *r, const struct pen_request *request)
{
    struct parts parts = {.count = 0};
    struct pen_frame plain, watched;
    struct pen_result result;
    pen_renderer_drop_shadows(r);
    CHECK(render(r, request, INFINITY, NULL, &plain, &result));
    CHECK(result.progress.done == result.progress.total && result.progress.number == 0);
    for (int turns = 0; turns < 2; turns++) {
        pen_renderer_drop_shadows(r);
        CHECK(render(r, request, turns ? 0 : INFINITY, &parts, &watched, &result));
        CHECK(fixture_distance(&plain, &watched) == 0);
        CHECK(result.progress.number == parts.count);
        uint32_t done = 0;
        for (uint32_t i = 0; i < parts.count; i++) {
            const struct pen_progress *progress = &parts.results[i].progress;
            printf("%s: %u of %u, off %.3f, estimate %.4f, %.0f ms\n", request->technique,
                progress->done, progress->total, fixture_distance(&parts.frames[i], &plain),
                (double)progress->standard_error, (double)progress->elapsed_ms);
            CHECK(progress->number == i && progress->done > done);
            CHECK(progress->done < progress->total && progress->total == result.progress.total);
            done = progress->done;
        }
        finish(&parts);
        pen_frame_finish(&watched);
    }
    pen_frame_finish(&plain);
}

static void make_request(struct pen_request *request, const uint8_t scene[PEN_ID_BYTES],
    const char *technique, uint32_t antialias)
{
    fixture_request(request, scene, technique);
    request->width = 96, request->height = 72;
    request->antialias = antialias;
    set_number(request, "samples", technique[0] == 'r' ? 256 : 64);
    set_number(request, "map_size", 256);
}

/* The mean visibility comes nearer to what it will be, as far as the estimate says. */
static void check_falling(struct pen_renderer *r, const struct pen_request *request)
{
    struct parts parts = {.count = 0};
    struct pen_frame last;
    struct pen_result result;
    double before = INFINITY;
    CHECK(render(r, request, INFINITY, &parts, &last, &result));
    CHECK(parts.count >= 3);
    for (uint32_t i = 0; i < parts.count; i++) {
        const struct pen_progress *progress = &parts.results[i].progress;
        double off = fixture_distance(&parts.frames[i], &last) / 255;
        printf("%s: %u of %u, off %.4f, estimate %.4f\n", request->technique, progress->done,
            progress->total, off, (double)progress->standard_error);
        /* A face of a light may show little of the picture: within noise. */
        CHECK(off < (request->light_count > 1 ? 1.02 : 1) * before);
        before = off;
        /* A random variable of few degrees of freedom, and over the ground's far part, too. */
        CHECK(i == 0 || (progress->standard_error > off / 4 && progress->standard_error < 8 * off));
    }
    CHECK(result.progress.standard_error < parts.results[parts.count - 1].progress.standard_error);
    finish(&parts);
    pen_frame_finish(&last);
}

/* What has nothing to show before its first frame is complete shows a sketch of that: nearer to it than
 * one without shadows is. */
static void check_sketch(
    struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES], const char *technique)
{
    const char *const names[] = {technique, "none"};
    struct parts parts[2] = {{.count = 0}};
    struct pen_request request;
    struct pen_frame plain, watched;
    struct pen_result result;
    for (int i = 0; i < 2; i++) {
        make_request(&request, scene, names[i], 4);
        CHECK(render(r, &request, INFINITY, NULL, &plain, &result));
        pen_renderer_drop_shadows(r);
        CHECK(render(r, &request, i ? INFINITY : 0, &parts[i], &watched, &result));
        CHECK(fixture_distance(&plain, &watched) == 0);
        CHECK(parts[i].count == (i ? 3 : 4) && result.progress.done == 4);
        pen_frame_finish(&watched), pen_frame_finish(&plain);
    }
    CHECK(parts[0].results[0].progress.done == 0 && parts[0].results[0].progress.total == 4);
    const struct pen_frame *first = &parts[0].frames[1];
    double off = fixture_distance(&parts[0].frames[0], first);
    double empty = fixture_distance(&parts[1].frames[0], first);
    printf("%s: sketch off %.3f, without shadows %.3f\n", technique, off, empty);
    CHECK(off > 0 && off < 0.5 * empty);
    finish(&parts[0]), finish(&parts[1]);
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
    static const char *const names[] = {"multisample", "raytraced", "stochastic", "pcss"};
    struct pen_request request;
    for (int i = 0; i < 4; i++) {
        make_request(&request, scene, names[i], 2);
        check_watching(r, &request);
    }
    check_sketch(r, scene, "bilateral");
    check_sketch(r, scene, "adaptive-sampling");
    for (int i = 0; i < 2; i++) { /* something of all lights is there first */
        make_request(&request, scene, names[i], 1);
        request.lights_given = true;
        request.light_count = 2;
        for (int k = 0; k < 2; k++) {
            pen_light_default(&request.lights[k], !k  ? PEN_LIGHT_RECT
                                                  : i ? PEN_LIGHT_SPHERE
                                                      : PEN_LIGHT_DISK);
            request.lights[k].position[0] = 2 * k, request.lights[k].position[1] = 4;
            request.lights[k].position[2] = 1;
        }
        check_watching(r, &request);
        request.output.layer = PEN_LAYER_VISIBILITY; /* their errors add up */
        check_falling(r, &request);
    }
    for (int i = 0; i < 3; i++) {
        make_request(&request, scene, names[i ? 1 : 0], 1);
        request.output.layer = PEN_LAYER_VISIBILITY;
        if (i == 2) { /* in compute shaders */
            set_number(&request, "backend", 1);
            set_number(&request, "samples", 512);
            request.width = 48, request.height = 36;
            check_watching(r, &request);
        }
        check_falling(r, &request);
    }
    pen_renderer_destroy(r);
    CHECK_DONE();
}
