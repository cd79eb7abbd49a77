/* How soon a render that is watched shows something, and what watching costs.
 *
 *     penumbra-parts [rounds]
 *
 * For raytraced and multisample with 1024 samples at 800 x 600: the time to the first picture over
 * that of a whole pcss picture, and the time of a watched render, with as many pictures as the worker
 * would show to one who takes all, over that of an unwatched one. In alternation; medians of the
 * ratios of each round. Encoding is not in it. */
#include "protocol/memory.h"
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define MAX_ROUNDS 99
#define SHARE 0.06 /* as the worker has it */

static double now_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

struct watching {
    uint32_t count;
    double begun_ms, first_ms;
};

static bool wants(void *context)
{
    (void)context;
    return true;
}

static void show(void *context, const struct pen_frame *frame, const struct pen_result *result)
{
    struct watching *w = context;
    struct pen_frame own = *frame;
    (void)result;
    if (!w->count++)
        w->first_ms = now_ms() - w->begun_ms;
    pen_frame_finish(&own);
}

/* Returns ms; `watching` may be NULL. Exits on failure. */
static double measure(
    struct pen_renderer *r, const struct pen_request *request, struct watching *watching)
{
    struct pen_error error = {0};
    static struct pen_result result;
    struct pen_frame frame;
    pen_renderer_drop_shadows(r);
    double start = now_ms();
    struct pen_render *render = pen_render_begin(r, request, &frame, &result, &error);
    if (render && watching) {
        *watching = (struct watching){.begun_ms = start};
        pen_render_watch(render, &(struct pen_viewer){wants, show, watching, SHARE});
    }
    while (render && !pen_render_advance(render, 25))
        ;
    if (!render || !pen_render_end(render, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    double ms = now_ms() - start;
    pen_frame_finish(&frame);
    return ms;
}

static int compare(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return x < y ? -1 : x > y;
}

static double median(double *values, int count)
{
    qsort(values, (size_t)count, sizeof *values, compare);
    return values[count / 2];
}

static void make_request(struct pen_request *request, const uint8_t *scene, const char *technique)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, technique);
    double samples = 1024;
    pen_request_default(request, catalogue);
    memcpy(request->scene, scene, PEN_ID_BYTES);
    memset(request->technique, 0, sizeof request->technique);
    memset(request->technique_params, 0, sizeof request->technique_params);
    strcpy(request->technique, technique);
    pen_params_default(info->params, request->technique_params);
    const struct pen_param *row = pen_param_find(info->params, "samples");
    if (row && row->max >= samples)
        pen_param_store(row, request->technique_params, &samples, "", NULL);
}

int main(int argc, char **argv)
{
    static const char *const names[] = {"raytraced", "multisample"};
    struct pen_renderer_config config = {0};
    struct pen_error error = {0};
    struct pen_generated_options options = {.kind = PEN_GENERATED_DEMO};
    uint8_t id[PEN_ID_BYTES] = {1};
    int rounds = argc > 1 ? atoi(argv[1]) : 5;
    rounds = rounds < 1 ? 1 : rounds > MAX_ROUNDS ? MAX_ROUNDS : rounds;
    struct pen_renderer *r = pen_renderer_create(&config, &error);
    FILE *file = tmpfile();
    void *data = NULL;
    size_t bytes = 0;
    if (!r || !file || !pen_generate_blob(&options, &data, &bytes, &error) ||
        fwrite(data, 1, bytes, file) != bytes || fflush(file) ||
        !pen_renderer_load_scene(r, id, fileno(file), &error)) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    struct pen_request pcss, sampled;
    make_request(&pcss, id, "pcss");
    measure(r, &pcss, NULL); /* compiles */
    for (int m = 0; m < 2; m++) {
        double first[MAX_ROUNDS], total[MAX_ROUNDS], alone_ms = 0, pcss_ms = 0;
        struct watching watching;
        make_request(&sampled, id, names[m]);
        measure(r, &sampled, &watching);
        for (int i = 0; i < rounds; i++) {
            pcss_ms = measure(r, &pcss, NULL);
            double watched = measure(r, &sampled, &watching);
            alone_ms = measure(r, &sampled, NULL);
            first[i] = watching.first_ms / pcss_ms;
            total[i] = watched / alone_ms;
        }
        printf("%s 1024: first picture %.2f of a pcss picture (%.0f ms), watched %.3f of unwatched "
               "(%.0f ms), %u pictures on the way\n",
            names[m], median(first, rounds), pcss_ms, median(total, rounds), alone_ms,
            watching.count);
        fflush(stdout);
    }
    fclose(file);
    free(data);
    pen_renderer_destroy(r);
    return 0;
}
