#include "tests/gl/fixture.h"
#include "protocol/fnv.h"
#include <stdio.h>
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

struct pen_renderer *fixture_renderer(uint32_t device, uint64_t gpu_memory, struct pen_error *error)
{
    struct pen_renderer_config config = {
        .device = {.choice = device, .debug = true}, .gpu_memory_bytes = gpu_memory};
    memset(error, 0, sizeof *error);
    return pen_renderer_create(&config, error);
}

static void die(const struct pen_error *error)
{
    fprintf(stderr, "%u %s %s\n", error->code, error->pointer, error->message);
    exit(1);
}

int fixture_blob(uint32_t kind, uint32_t triangles, uint32_t seed, uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    struct pen_generated_options options = {.kind = kind, .triangles = triangles, .seed = seed};
    void *data;
    size_t bytes;
    memset(id, 0, PEN_ID_BYTES);
    memcpy(id, &options, 12);
    if (!pen_generate_blob(&options, &data, &bytes, &error))
        die(&error);
    int fd = memfd_create("scene", MFD_CLOEXEC);
    if (fd < 0 || write(fd, data, bytes) != (ssize_t)bytes)
        exit(1);
    free(data);
    return fd;
}

void fixture_scene(struct pen_renderer *renderer, uint32_t kind, uint32_t triangles, uint32_t seed,
    uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    int fd = fixture_blob(kind, triangles, seed, id);
    if (!pen_renderer_load_scene(renderer, id, fd, &error))
        die(&error);
    close(fd);
}

void fixture_request(
    struct pen_request *request, const uint8_t id[PEN_ID_BYTES], const char *technique)
{
    const struct pen_catalogue *catalogue = pen_renderer_catalogue();
    const struct pen_technique_info *info = pen_catalogue_find(catalogue, technique);
    pen_request_default(request, catalogue);
    memcpy(request->scene, id, PEN_ID_BYTES);
    memset(request->technique, 0, sizeof request->technique);
    snprintf(request->technique, sizeof request->technique, "%s", technique);
    memset(request->technique_params, 0, sizeof request->technique_params);
    pen_params_default(info->params, request->technique_params);
    request->width = 200, request->height = 150;
}

uint64_t fixture_hash(const struct pen_frame *frame)
{
    return pen_fnv(PEN_FNV_START, frame->planes[0].data, (size_t)frame->width * frame->height * 4);
}

uint64_t fixture_render(
    struct pen_renderer *renderer, const struct pen_request *request, struct pen_result *result)
{
    struct pen_error error = {0};
    struct pen_frame frame;
    if (!pen_renderer_render(renderer, request, &frame, result, &error))
        die(&error);
    uint64_t hash = fixture_hash(&frame);
    pen_frame_finish(&frame);
    return hash;
}

double fixture_distance(const struct pen_frame *a, const struct pen_frame *b)
{
    size_t bytes = (size_t)4 * a->width * a->height;
    const uint8_t *x = a->planes[0].data, *y = b->planes[0].data;
    double sum = 0;
    for (size_t i = 0; i < bytes; i++)
        sum += (double)(x[i] - y[i]) * (x[i] - y[i]);
    return sqrt(sum / (double)bytes);
}

double fixture_resident_mib(void)
{
    long size = 0, resident = 0;
    FILE *file = fopen("/proc/self/statm", "r");
    if (!file || fscanf(file, "%ld %ld", &size, &resident) != 2)
        exit(1);
    fclose(file);
    return (double)resident * (double)sysconf(_SC_PAGESIZE) / (1 << 20);
}
