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

static double distance(const struct pen_frame *a, const struct pen_frame *b)
{
    size_t bytes = (size_t)4 * a->width * a->height;
    const uint8_t *x = a->planes[0].data, *y = b->planes[0].data;
    double sum = 0;
    for (size_t i = 0; i < bytes; i++)
        sum += (double)(x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum / (double)bytes);
}

static void set_number(struct pen_request *request, const char *name, double value)
{
    const struct pen_technique_info *info =
        pen_catalogue_find(pen_renderer_catalogue(), request->technique);
    const struct pen_param *row = pen_param_find(info->params, name);
    if (row && row->min <= value && row->max >= value)
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
        CHECK(distance(&plain, &watched) == 0);
        CHECK(result.progress.number == parts.count);
        uint32_t done = 0;
        for (uint32_t i = 0; i < parts.count; i++) {
            const struct pen_progress *progress = &parts.results[i].progress;
            printf("%s: %u of %u, off %.3f, estimate %.4f, %.0f ms\n", request->technique,
                progress->done, progress->total, distance(&parts.frames[i], &plain),
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

/* Every method, two jittered frames. */
static void check_methods(
    struct pen_renderer *r, const uint8_t scene[PEN_ID_BYTES], const char *only)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    for (uint32_t i = 0; i < catalogue->count; i++) {
        struct pen_request request;
        if (only && strcmp(only, catalogue->items[i]->name))
            continue;
        fixture_request(&request, scene, catalogue->items[i]->name);
        request.width = 96, request.height = 72;
        request.antialias = 2;
        set_number(&request, "samples", 40);
        set_number(&request, "map_size", 256);
        set_number(&request, "series_size", 256);
        check_watching(r, &request);
    }
}

int main(int argc, char **argv)
{
    struct pen_error error;
    struct pen_renderer *r = fixture_renderer(PEN_DEVICE_AUTO, 0, &error);
    if (!r) {
        fprintf(stderr, "skipped: %s\n", error.message);
        return 77;
    }
    uint8_t scene[PEN_ID_BYTES];
    fixture_scene(r, PEN_GENERATED_DEMO, 0, 1, scene);
    check_methods(r, scene, argc > 1 ? argv[1] : NULL);
    pen_renderer_destroy(r);
    CHECK_DONE();
}
