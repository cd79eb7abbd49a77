#include "tests/accuracy/harness.h"
#include "protocol/json_request.h"
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <unistd.h>

static struct pen_renderer *renderer;

static void die(const char *what, const struct pen_error *error)
{
    fprintf(stderr, "%s: %u %s %s\n", what, error->code, error->pointer, error->message);
    exit(1);
}

struct pen_renderer *harness_renderer(void)
{
    struct pen_error error = {0};
    struct pen_renderer_config config = {.device = {.debug = true}, .gpu_memory_bytes = 4ull << 30};
    if (!renderer && !(renderer = pen_renderer_create(&config, &error))) {
        fprintf(stderr, "skipped: %s\n", error.message);
        exit(77);
    }
    return renderer;
}

void harness_scene_blob(void *data, size_t bytes, const uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    int fd = memfd_create("scene", MFD_CLOEXEC);
    if (fd < 0 || write(fd, data, bytes) != (ssize_t)bytes)
        exit(1);
    free(data);
    if (!pen_renderer_load_scene(harness_renderer(), id, fd, &error))
        die("load", &error);
    close(fd);
}

void harness_scene(const struct pen_generated_options *options, uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    memset(id, 0, PEN_ID_BYTES);
    memcpy(id, options, sizeof *options < PEN_ID_BYTES ? sizeof *options : PEN_ID_BYTES);
    if (pen_renderer_has_scene(harness_renderer(), id))
        return;
    if (!pen_generate_blob(options, &data, &bytes, &error))
        die("generate", &error);
    harness_scene_blob(data, bytes, id);
}

bool harness_scene_file(const char *path, uint8_t id[PEN_ID_BYTES])
{
    struct pen_error error = {0};
    int fd = open(path, O_RDONLY | O_CLOEXEC);
    if (fd < 0)
        return false;
    memset(id, 0, PEN_ID_BYTES);
    size_t length = strlen(path);
    memcpy(id, path + (length > PEN_ID_BYTES ? length - PEN_ID_BYTES : 0),
        length > PEN_ID_BYTES ? PEN_ID_BYTES : length);
    if (!pen_renderer_load_scene(harness_renderer(), id, fd, &error))
        die(path, &error);
    close(fd);
    return true;
}

void harness_shot(const uint8_t id[PEN_ID_BYTES], const char *settings, struct shot *shot)
{
    struct pen_error error = {0};
    struct pen_query_pair pairs[64];
    uint32_t count = 0;
    char *text = strdup(settings), *state = NULL;
    memset(shot, 0, sizeof *shot);
    for (char *at = strtok_r(text, "&", &state); at && count < 62;
         at = strtok_r(NULL, "&", &state)) {
        char *equals = strchr(at, '=');
        *equals = 0;
        pairs[count++] = (struct pen_query_pair){at, equals + 1};
    }
    pairs[count++] = (struct pen_query_pair){"output.layer", "all"};
    pairs[count++] = (struct pen_query_pair){"output.format", "exr"};
    struct pen_request request;
    if (!pen_request_from_query(pairs, count, pen_renderer_catalogue(), &request, &error))
        die(settings, &error);
    free(text);
    request.output.bit_depth = 32;
    memcpy(request.scene, id, PEN_ID_BYTES);
    struct pen_frame frame;
    if (!pen_renderer_render(harness_renderer(), &request, &frame, &shot->result, &error))
        die(settings, &error);
    shot->width = frame.width, shot->height = frame.height;
    for (uint32_t i = 0; i < frame.plane_count; i++) {
        float **to = !strcmp(frame.planes[i].name, "visibility") ? &shot->visibility
                     : !strcmp(frame.planes[i].name, "position") ? &shot->position
                     : !strcmp(frame.planes[i].name, "normal")   ? &shot->normal
                     : !strcmp(frame.planes[i].name, "beauty")   ? &shot->beauty
                     : !strcmp(frame.planes[i].name, "classes")  ? &shot->classes
                     : !strcmp(frame.planes[i].name, "error")    ? &shot->error
                                                                 : NULL;
        if (to) {
            *to = frame.planes[i].data;
            frame.planes[i].data = NULL;
        }
    }
    pen_frame_finish(&frame);
}

void harness_shot_finish(struct shot *shot)
{
    free(shot->visibility);
    free(shot->position);
    free(shot->normal);
    free(shot->beauty);
    free(shot->classes);
    free(shot->error);
    memset(shot, 0, sizeof *shot);
}

struct deviation harness_deviation(const struct shot *shot, truth_function truth, const void *user)
{
    struct deviation d = {0};
    double penumbra = 0;
    uint32_t in_penumbra = 0;
    for (uint32_t i = 0; i < shot->width * shot->height; i++) {
        const float *p = shot->position + 4 * i;
        if (fabsf(p[1]) > 1e-3f || shot->normal[4 * i + 1] < 0.5f)
            continue;
        double expected = truth(p[0], p[2], user), e = shot->visibility[4 * i + 3] - expected;
        d.rmse += e * e;
        d.mean += e;
        d.worst = fmax(d.worst, fabs(e));
        d.pixels++;
        if (expected > 0.02 && expected < 0.98) {
            penumbra += e * e;
            in_penumbra++;
        }
    }
    if (d.pixels) {
        d.rmse = sqrt(d.rmse / d.pixels);
        d.mean /= d.pixels;
    }
    if (in_penumbra)
        d.rmse_penumbra = sqrt(penumbra / in_penumbra);
    return d;
}

static double clamp01(double v)
{
    return v < 0 ? 0 : v > 1 ? 1 : v;
}

double truth_one(double x, double z, const void *unused)
{
    (void)x, (void)z, (void)unused;
    return 1;
}

double truth_half_plane(double x, double z, const void *planar_case)
{
    const struct planar_case *t = planar_case;
    (void)z;
    double caster_z = t->h - t->c, receiver_z = t->h;
    return clamp01(0.5 + x * caster_z / (2 * t->a * (receiver_z - caster_z)));
}

double truth_half_plane_disk(double x, double z, const void *planar_case)
{
    const struct planar_case *t = planar_case;
    (void)z;
    double u = x * (t->h - t->c) / (t->a * t->c);
    u = u < -1 ? -1 : u > 1 ? 1 : u;
    return 0.5 + (u * sqrt(1 - u * u) + asin(u)) / M_PI;
}

/* Share of the light's extent along one axis that a caster [-s, s] hides. */
static double hidden(const struct planar_case *t, double r)
{
    double k = (t->h - t->c) / t->h;
    double high = fmin(t->a, (t->s - r * k) / (1 - k)),
           low = fmax(-t->a, (-t->s - r * k) / (1 - k));
    return fmax(0, high - low) / (2 * t->a);
}

double truth_square(double x, double z, const void *planar_case)
{
    return 1 - hidden(planar_case, x) * hidden(planar_case, z);
}

static double crossing(const struct shot *shot, float level)
{
    uint32_t row = shot->height / 2;
    for (uint32_t x = 1; x < shot->width; x++) {
        uint32_t i = row * shot->width + x;
        float a = shot->visibility[4 * (i - 1) + 3], b = shot->visibility[4 * i + 3];
        if ((a < level) != (b < level)) {
            float t = (level - a) / (b - a);
            return shot->position[4 * (i - 1)] +
                   t * (shot->position[4 * i] - shot->position[4 * (i - 1)]);
        }
    }
    return NAN;
}

double harness_width_10_90(const struct shot *shot)
{
    return fabs(crossing(shot, 0.9f) - crossing(shot, 0.1f));
}

uint32_t harness_receivers(const struct shot *shot)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < shot->width * shot->height; i++) {
        const float *n = shot->normal + 4 * i;
        count += n[0] != 0 || n[1] != 0 || n[2] != 0;
    }
    return count;
}

uint32_t harness_not_finite(const struct shot *shot)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < 4 * shot->width * shot->height; i++)
        count += !isfinite(shot->visibility[i]);
    return count;
}
