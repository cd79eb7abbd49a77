/* Times ray-traced visibility on a scene blob: bench_trace FILE.pscene [samples] [runs]
 * The view and the light are those of the bunny comparison (800 x 600, a 1 x 1 m light); prints the
 * best of `runs` (8) for all receivers and for the adaptive mode, and their difference. Then builds
 * the shader's hierarchy and asks both for the way to the light's centre. */
#include "renderer/trace/bvh.h"
#include "renderer/trace/trace.h"
#include <fcntl.h>
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <time.h>
#include <unistd.h>

#define WIDTH 800
#define HEIGHT 600

static void normalise(float v[3])
{
    float scale = 1 / sqrtf(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    for (int c = 0; c < 3; c++)
        v[c] *= scale;
}

static struct pen_trace_light square_light(void)
{
    struct pen_trace_light light = {
        .type = PEN_TRACE_RECT, .origin = {1.5f, 3, 1}, .z = {-1.5f, -3, -1}, .half = {0.5f, 0.5f}};
    normalise(light.z);
    light.x[0] = light.z[2]; /* up x z, with up = +y */
    light.x[2] = -light.z[0];
    normalise(light.x);
    for (int c = 0; c < 3; c++) {
        int i = (c + 1) % 3, j = (c + 2) % 3;
        light.y[c] = light.z[i] * light.x[j] - light.z[j] * light.x[i];
    }
    return light;
}

static double rmse(const float *a, const float *b)
{
    double sum = 0;
    for (size_t i = 0; i < WIDTH * HEIGHT; i++) {
        double d = (double)a[4 * i + 3] - (double)b[4 * i + 3];
        sum += d * d;
    }
    return sqrt(sum / (WIDTH * HEIGHT));
}

static bool time_job(struct pen_trace_scene *scene, const struct pen_trace_job *job,
    float *visibility, unsigned runs, const char *name)
{
    struct pen_trace_light light = square_light();
    struct pen_trace_result result = {.visibility = visibility};
    struct pen_trace_stats best = {.seconds = 1e9}, stats;
    struct pen_error error = {0};
    for (unsigned i = 0; i < runs; i++) {
        if (!pen_trace_visibility(scene, &light, job, &result, &stats, &error)) {
            fprintf(stderr, "%s\n", error.message);
            return false;
        }
        if (stats.build_seconds > 0)
            printf("%llu casters, %llu of them filtered, built in %.1f ms\n",
                (unsigned long long)stats.casters, (unsigned long long)stats.filtered,
                1e3 * stats.build_seconds);
        if (stats.seconds < best.seconds)
            best = stats;
    }
    printf("%-10s %4u samples  %7.1f ms  cpu %7.1f ms  %6.2f M rays  %6.1f M rays/s  "
           "full %6.2f %%\n",
        name, best.samples, 1e3 * best.seconds, 1e3 * best.cpu_seconds, (double)best.rays * 1e-6,
        best.mrays_per_second,
        100 * (double)best.full_receivers / (double)(best.receivers ? best.receivers : 1));
    return true;
}

static bool run_view(struct pen_trace_scene *scene, const float eye[3], const float target[3],
    unsigned samples, unsigned runs, float *buffers[4])
{
    struct pen_trace_camera camera =
        pen_trace_camera_look_at(eye, target, (const float[]){0, 1, 0}, 45, WIDTH, HEIGHT);
    struct pen_trace_hits hits = {.positions = buffers[0], .normals = buffers[1]};
    struct pen_error error = {0};
    if (!pen_trace_primary(scene, &camera, 0, &hits, &error))
        return false;
    struct pen_trace_job job = {.positions = buffers[0],
        .normals = buffers[1],
        .width = WIDTH,
        .height = HEIGHT,
        .samples = samples};
    bool ok = time_job(scene, &job, buffers[2], runs, "all");
    job.adaptive = true;
    ok = ok && time_job(scene, &job, buffers[3], runs, "adaptive");
    printf("adaptive against all: RMSE %.6f\n", rmse(buffers[2], buffers[3]));
    return ok;
}

/* Hard shadows by the shader's hierarchy, against Embree's. */
static bool compare_hierarchies(
    const struct psc_scene *blob, struct pen_trace_scene *scene, float *buffers[4])
{
    struct pen_trace_light light = square_light();
    struct pen_bvh bvh;
    struct pen_error error = {0};
    struct timespec start, end;
    clock_gettime(CLOCK_MONOTONIC, &start);
    if (!pen_bvh_build_scene(blob, 0, &bvh, &error)) {
        fprintf(stderr, "%s\n", error.message);
        return false;
    }
    clock_gettime(CLOCK_MONOTONIC, &end);
    printf("own hierarchy: %u nodes, depth %u, cost %.1f, built in %.1f ms\n", bvh.node_count,
        bvh.depth, (double)bvh.cost,
        1e3 * (double)(end.tv_sec - start.tv_sec) + 1e-6 * (double)(end.tv_nsec - start.tv_nsec));
    light.type = PEN_TRACE_POINT;
    light.cos_cone = -1;
    struct pen_trace_job job = {.positions = buffers[0],
        .normals = buffers[1],
        .width = WIDTH,
        .height = HEIGHT,
        .samples = 1,
        .bias = 1e-4f};
    struct pen_trace_result result = {.visibility = buffers[2]};
    bool ok = pen_trace_visibility(scene, &light, &job, &result, NULL, &error);
    size_t asked = 0, differ = 0;
    for (size_t i = 0; ok && i < WIDTH * HEIGHT; i++) {
        const float *p = buffers[0] + 3 * i, *n = buffers[1] + 3 * i;
        float origin[3], direction[3], cosine = 0;
        for (int c = 0; c < 3; c++) {
            origin[c] = p[c] + 1e-4f * n[c];
            direction[c] = light.origin[c] - origin[c];
            cosine += direction[c] * n[c];
        }
        if (!(cosine > 1e-3f))
            continue;
        asked++;
        differ += pen_bvh_occluded(&bvh, false, origin, direction, 0.9999f) ==
                  (buffers[2][4 * i + 3] > 0);
    }
    printf("%zu of %zu rays answered otherwise than by Embree\n", differ, asked);
    pen_bvh_finish(&bvh);
    return ok;
}

int main(int argc, char **argv)
{
    struct psc_scene blob;
    struct pen_error error = {0};
    int fd = argc > 1 ? open(argv[1], O_RDONLY | O_CLOEXEC) : -1;
    if (fd < 0) {
        fprintf(stderr, "usage: %s FILE.pscene [samples] [runs]\n", argv[0]);
        return 2;
    }
    if (!psc_open(fd, &blob, &error)) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    struct pen_trace_scene *scene = pen_trace_scene_create(&blob, NULL, &error);
    if (!scene) {
        fprintf(stderr, "%s\n", error.message);
        return 1;
    }
    struct pen_trace_scene_info info = pen_trace_scene_info(scene);
    printf("%llu triangles (%llu single-sided, %llu with alpha), %.1f MiB, native packets %u\n",
        (unsigned long long)info.triangles, (unsigned long long)info.single_sided,
        (unsigned long long)info.alpha, (double)info.bytes / (1 << 20), info.native_packet16);
    float *buffers[4];
    for (int i = 0; i < 4; i++)
        buffers[i] = calloc((size_t)WIDTH * HEIGHT * 4, sizeof **buffers);
    unsigned samples = argc > 2 ? (unsigned)strtoul(argv[2], NULL, 10) : 256;
    unsigned runs = argc > 3 ? (unsigned)strtoul(argv[3], NULL, 10) : 8;
    bool ok = run_view(scene, (const float[]){2.2f, 1.6f, 2.6f}, (const float[]){0, 0.45f, 0},
        samples, runs, buffers);
    ok = ok && run_view(scene, (const float[]){-1.6f, 1.1f, -1.4f},
                   (const float[]){-0.2f, 0.2f, -0.1f}, samples, runs, buffers);
    ok = ok && compare_hierarchies(&blob, scene, buffers);
    for (int i = 0; i < 4; i++)
        free(buffers[i]);
    pen_trace_scene_destroy(scene);
    psc_close(&blob);
    close(fd);
    return ok ? 0 : 1;
}
