/* penumbra-shot SCENE.pscene OUT.png [key=value ...]: one image without a daemon. Keys are those of
 * the GET render call; repeat=N renders N times and prints the last one's times and, in
 * brackets, the least of each pass; turn=D turns the camera by so many degrees each time, so that
 * nothing of the view is kept (lights stay where the first frame had them); against=KEY=VALUE sets
 * that in every second frame and prints the processor time of both kinds, medians; a scene name of
 * penumbra generate (square, demo, ...) instead of a file makes that scene. */
#include "protocol/json_request.h"
#include "renderer/blob/pscene.h"
#include "renderer/encode/encode.h"
#include "renderer/renderer.h"
#include "renderer/generate/generate.h"
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <time.h>
#include <unistd.h>

#define MAX_REPEAT 1000

static int open_scene(const char *name, struct pen_error *error)
{
    for (uint32_t i = 0; pen_generated_names[i]; i++) {
        if (strcmp(pen_generated_names[i], name))
            continue;
        struct pen_generated_options options = {.kind = i};
        void *data;
        size_t bytes;
        if (!pen_generate_blob(&options, &data, &bytes, error))
            return -1;
        int fd = memfd_create("scene", 0);
        if (write(fd, data, bytes) != (ssize_t)bytes)
            exit(1);
        free(data);
        return fd;
    }
    return open(name, O_RDONLY);
}

static int report(const struct pen_error *error)
{
    fprintf(stderr, "%u %s %s\n", error->code, error->message, error->pointer);
    return 1;
}

/* `first` is what the first frame was of, completed: its lights, and its camera further round its
 * target's vertical. */
static void turn_camera(struct pen_request *request, const struct pen_request *first, double angle)
{
    struct pen_camera *camera = &request->camera;
    *camera = first->camera;
    double x = camera->eye[0] - camera->target[0], z = camera->eye[2] - camera->target[2];
    camera->eye[0] = camera->target[0] + cos(angle) * x + sin(angle) * z;
    camera->eye[2] = camera->target[2] - sin(angle) * x + cos(angle) * z;
    request->lights_given = first->lights_given;
    request->light_count = first->light_count;
    memcpy(request->lights, first->lights, sizeof request->lights);
}

static double processor_ms(void)
{
    struct timespec t;
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &t);
    return t.tv_sec * 1e3 + t.tv_nsec / 1e6;
}

static int by_size(const void *a, const void *b)
{
    double x = *(const double *)a, y = *(const double *)b;
    return (x > y) - (x < y);
}

/* Of every second of `count` values, from `first` on. */
static double median(const double *values, int count, int first)
{
    double sorted[MAX_REPEAT];
    int n = 0;
    for (int i = first; i < count; i += 2)
        sorted[n++] = values[i];
    qsort(sorted, (size_t)n, sizeof *sorted, by_size);
    return n ? sorted[n / 2] : 0;
}

int main(int argc, char **argv)
{
    if (argc < 3) {
        fprintf(stderr, "usage: %s SCENE OUT [key=value ...]\n", argv[0]);
        return 2;
    }
    struct pen_error error = {0};
    struct pen_query_pair pairs[65];
    char *against = NULL;
    uint32_t count = 0;
    int repeat = 1;
    double turn = 0;
    for (int i = 3; i < argc && count < 64; i++) {
        char *equals = strchr(argv[i], '=');
        if (!equals)
            return 2;
        *equals = 0;
        if (!strcmp(argv[i], "repeat"))
            repeat = atoi(equals + 1);
        else if (!strcmp(argv[i], "turn"))
            turn = atof(equals + 1);
        else if (!strcmp(argv[i], "against"))
            against = equals + 1;
        else
            pairs[count++] = (struct pen_query_pair){argv[i], equals + 1};
    }
    struct pen_request request, other;
    char *value = against ? strchr(against, '=') : NULL;
    if (repeat > MAX_REPEAT || (against && !value))
        return 2;
    if (value) {
        *value = 0;
    }
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    if (!pen_request_from_query(pairs, count, catalogue, &request, &error))
        return report(&error);
    uint32_t at = 0;
    while (against && at < count && strcmp(pairs[at].key, against))
        at++;
    if (against)
        pairs[at] = (struct pen_query_pair){against, value + 1};
    if (!pen_request_from_query(
            pairs, at == count && against ? count + 1 : count, catalogue, &other, &error))
        return report(&error);
    struct pen_renderer_config config = {.device = {.debug = true}};
    struct pen_renderer *renderer = pen_renderer_create(&config, &error);
    if (!renderer)
        return report(&error);
    int fd = open_scene(argv[1], &error);
    if (fd < 0 || !pen_renderer_load_scene(renderer, request.scene, fd, &error))
        return report(&error);
    static struct pen_result result;
    struct pen_frame frame = {0};
    struct pen_bytes bytes = {0};
    static float least[PEN_MAX_PASSES];
    static double spent[MAX_REPEAT];
    static struct pen_request first;
    for (int i = 0; i < repeat; i++) {
        pen_frame_finish(&frame);
        struct pen_request *now = against && i % 2 ? &other : &request;
        if (i && turn != 0)
            turn_camera(now, &first, i * turn * M_PI / 180);
        spent[i] = processor_ms();
        if (!pen_renderer_render(renderer, now, &frame, &result, &error))
            return report(&error);
        spent[i] = processor_ms() - spent[i];
        if (!i)
            first = result.completed;
        for (uint32_t k = 0; k < result.pass_count; k++)
            least[k] = i && least[k] < result.passes[k].ms ? least[k] : result.passes[k].ms;
    }
    for (uint32_t i = 0; i < result.pass_count; i++)
        printf("%-10s %-22s x%-3u %8.2f ms (%.2f)\n", pen_stage_names[result.passes[i].stage],
            result.passes[i].name, result.passes[i].count, (double)result.passes[i].ms,
            (double)least[i]);
    if (against)
        printf("processor  %.1f ms, with %s=%s %.1f ms\n", median(spent + 2, repeat - 2, 0),
            against, value + 1, median(spent + 2, repeat - 2, 1));
    printf("class pixels %u %u %u, full work %u, triangles %u\n", result.class_pixels[0],
        result.class_pixels[1], result.class_pixels[2], result.full_work_pixels,
        result.triangles_drawn);
    printf("sample maps %u\n", result.shadow_maps);
    for (uint32_t i = 0; i < result.warning_count; i++)
        printf("warning: %s\n", result.warnings[i]);
    const uint32_t *split = result.subdivided_pixels;
    if (split[0] + split[1])
        printf("subdivided  once %u, twice %u pixels\n", split[0], split[1]);
    if (!pen_encode(&frame, &request.output, NULL, 0, &bytes, &error))
        return report(&error);
    FILE *file = fopen(argv[2], "wb");
    bool ok = file && fwrite(bytes.data, 1, bytes.size, file) == bytes.size && !fclose(file);
    pen_bytes_finish(&bytes);
    pen_frame_finish(&frame);
    pen_renderer_destroy(renderer);
    return ok ? 0 : 1;
}
