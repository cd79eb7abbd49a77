/* How soon a render that is watched shows something, and what watching costs.
 *
 *     penumbra-parts [rounds [samples [method]]]
 *
 * For raytraced and multisample with 1024 samples at 800 x 600, or as asked: the time to the first picture over
 * that of a whole pcss picture; the time of a watched render, with as many pictures as the worker
 * would show to one who takes all, over that of an unwatched one; and that of one in turns, which
 * nobody watches, over one in one piece. The last two also in time on processors, which other
 * processes disturb less. In alternation; medians of the ratios of each round. Encoding is not in
 * it. */
#include "protocol/memory.h"
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>

#define MAX_ROUNDS 99
#define SHARE 0.06   /* as the worker has it */
#define TURN_MS 25.0 /* likewise */

static double clock_ms(clockid_t clock)
{
    struct timespec t;
    clock_gettime(clock, &t);
    return 1e3 * (double)t.tv_sec + 1e-6 * (double)t.tv_nsec;
}

static double now_ms(void)
{
    return clock_ms(CLOCK_MONOTONIC);
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

struct cost {
    double ms, processor_ms;
};

/* `watching` may be NULL. Exits on failure. */
static struct cost measure(struct pen_renderer *r, const struct pen_request *request,
    double turn_ms, struct watching *watching)
{
    struct pen_error error = {0};
    static struct pen_result result;
    struct pen_frame frame;
    pen_renderer_drop_shadows(r);
    double start = now_ms(), processor = clock_ms(CLOCK_PROCESS_CPUTIME_ID);
    struct pen_render *render = pen_render_begin(r, request, &frame, &result, &error);
    if (render && watching) {
        *watching = (struct watching){.begun_ms = start};
        pen_render_watch(render, &(struct pen_viewer){wants, show, watching, SHARE});
    }
    while (render && !pen_render_advance(render, turn_ms))
        ;
    if (!render || !pen_render_end(render, &error)) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    struct cost cost = {now_ms() - start, clock_ms(CLOCK_PROCESS_CPUTIME_ID) - processor};
    pen_frame_finish(&frame);
    return cost;
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

static void make_request(
    struct pen_request *request, const uint8_t *scene, const char *technique, double samples)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, technique);
    pen_request_default(request, catalogue);
    memcpy(request->scene, scene, PEN_ID_BYTES);
    memset(request->technique, 0, sizeof request->technique);
    memset(request->technique_params, 0, sizeof request->technique_params);
    strcpy(request->technique, technique);
    pen_params_default(info->params, request->technique_params);
    const struct pen_param *row = pen_param_find(info->params, "samples");
    if (row && samples > 0 && row->max >= samples)
        pen_param_store(row, request->technique_params, &samples, "", NULL);
}

int main(int argc, char **argv)
{
    const char *names[] = {"raytraced", "multisample"};
    struct pen_renderer_config config = {0};
    struct pen_error error = {0};
    struct pen_generated_options options = {.kind = PEN_GENERATED_DEMO};
    uint8_t id[PEN_ID_BYTES] = {1};
    int rounds = argc > 1 ? atoi(argv[1]) : 5;
    rounds = rounds < 1 ? 1 : rounds > MAX_ROUNDS ? MAX_ROUNDS : rounds;
    double samples = argc > 2 ? atof(argv[2]) : 1024;
    int methods = argc > 3 ? 1 : 2;
    names[0] = argc > 3 ? argv[3] : names[0];
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
    make_request(&pcss, id, "pcss", 0);
    measure(r, &pcss, TURN_MS, NULL); /* compiles */
    for (int m = 0; m < methods; m++) {
        double first[MAX_ROUNDS], ratios[4][MAX_ROUNDS];
        struct cost one_piece = {0}, quick = {0};
        struct watching watching;
        make_request(&sampled, id, names[m], samples);
        measure(r, &sampled, TURN_MS, &watching);
        for (int i = 0; i < rounds; i++) {
            quick = measure(r, &pcss, TURN_MS, NULL);
            struct cost watched = measure(r, &sampled, TURN_MS, &watching);
            struct cost turns = measure(r, &sampled, TURN_MS, NULL);
            one_piece = measure(r, &sampled, INFINITY, NULL);
            first[i] = watching.first_ms / quick.ms;
            ratios[0][i] = watched.ms / turns.ms;
            ratios[1][i] = watched.processor_ms / turns.processor_ms;
            ratios[2][i] = turns.ms / one_piece.ms;
            ratios[3][i] = turns.processor_ms / one_piece.processor_ms;
        }
        printf("%s %.0f: first picture %.2f of a pcss picture (%.0f ms)\n"
               "  watched %.3f of unwatched (processors %.3f), %u pictures on the way\n"
               "  in turns %.3f of one piece (processors %.3f), %.0f ms\n",
            names[m], samples, median(first, rounds), quick.ms, median(ratios[0], rounds),
            median(ratios[1], rounds), watching.count, median(ratios[2], rounds),
            median(ratios[3], rounds), one_piece.ms);
        fflush(stdout);
    }
    fclose(file);
    free(data);
    pen_renderer_destroy(r);
    return 0;
}
