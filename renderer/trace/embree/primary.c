/* Primary rays, in packets of 4 x 4 pixels. */
#include "renderer/trace/embree/internal.h"
#include <math.h>
#include <string.h>

#define BLOCK 4
#define LANES (BLOCK * BLOCK)

struct primary {
    const struct pen_trace_scene *scene;
    const struct pen_trace_camera *camera;
    const struct pen_trace_hits *hits;
    uint32_t blocks_x;
    RTCScene rtc;
};

static void normalise(float v[3])
{
    float scale = 1 / sqrtf(trace_dot(v, v));
    for (int c = 0; c < 3; c++)
        v[c] *= scale;
}

struct pen_trace_camera pen_trace_camera_look_at(const float eye[3], const float target[3],
    const float up[3], float fov_y_deg, uint32_t width, uint32_t height)
{
    struct pen_trace_camera camera = {
        .tan_half_fov_y = tanf(fov_y_deg * (float)M_PI / 360), .width = width, .height = height};
    for (int c = 0; c < 3; c++) {
        camera.eye[c] = eye[c];
        camera.forward[c] = target[c] - eye[c];
    }
    normalise(camera.forward);
    trace_cross(camera.forward, up, camera.right);
    normalise(camera.right);
    trace_cross(camera.right, camera.forward, camera.up);
    return camera;
}

/* The group behind a geometry of the hierarchy for primary rays; TRACE_GROUPS: the ground. */
static uint32_t group_of(uint32_t geometry)
{
    return geometry == TRACE_GEOMETRY_TWO_SIDED ? TRACE_TWO_SIDED
           : geometry == TRACE_GEOMETRY_MIXED   ? TRACE_FACING
           : geometry == TRACE_GEOMETRY_ALPHA   ? TRACE_ALPHA
                                                : TRACE_GROUPS;
}

/* The instance whose triangles hold triangle `*triangle` of a group; makes it relative. */
static uint32_t find_instance(
    const struct pen_trace_scene *scene, uint32_t group, uint32_t *triangle)
{
    uint32_t low = 0, high = scene->range_count[group];
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (scene->ranges[group][middle].first_triangle <= *triangle)
            low = middle;
        else
            high = middle;
    }
    *triangle -= scene->ranges[group][low].first_triangle;
    return scene->ranges[group][low].instance;
}

static void store(
    const struct primary *p, uint32_t pixel, const struct RTCRayHit16 *ray, uint32_t lane)
{
    const struct pen_trace_hits *hits = p->hits;
    bool hit = ray->hit.geomID[lane] != RTC_INVALID_GEOMETRY_ID;
    uint32_t group = group_of(ray->hit.geomID[lane]);
    float d[3] = {ray->ray.dir_x[lane], ray->ray.dir_y[lane], ray->ray.dir_z[lane]};
    if (hits->positions)
        for (int c = 0; c < 3; c++)
            hits->positions[3 * (size_t)pixel + c] =
                hit ? p->camera->eye[c] + ray->ray.tfar[lane] * d[c] : 0;
    if (hits->normals) {
        float n[3] = {ray->hit.Ng_x[lane], ray->hit.Ng_y[lane], ray->hit.Ng_z[lane]};
        float length = hit ? sqrtf(trace_dot(n, n)) : 0;
        float scale = length > 0 ? copysignf(1 / length, -trace_dot(n, d)) : 0;
        for (int c = 0; c < 3; c++)
            hits->normals[3 * (size_t)pixel + c] = hit ? n[c] * scale : 0;
    }
    uint32_t triangle = PEN_TRACE_NONE, instance = PEN_TRACE_NONE;
    if (hit && group < TRACE_GROUPS) {
        triangle = ray->hit.primID[lane];
        instance = find_instance(p->scene, group, &triangle);
    }
    if (hits->instances)
        hits->instances[pixel] = instance;
    if (hits->triangles)
        hits->triangles[pixel] = triangle;
}

static void trace_block(void *context, uint32_t item)
{
    const struct primary *p = context;
    const struct pen_trace_camera *camera = p->camera;
    struct RTCRayHit16 ray;
    int valid[LANES] __attribute__((aligned(64)));
    memset(&ray, 0, sizeof ray);
    uint32_t x0 = item % p->blocks_x * BLOCK, y0 = item / p->blocks_x * BLOCK;
    float half_height = 0.5f * (float)camera->height;
    float scale = camera->tan_half_fov_y / half_height;
    for (uint32_t lane = 0; lane < LANES; lane++) {
        uint32_t x = x0 + lane % BLOCK, y = y0 + lane / BLOCK;
        float sx = ((float)x + 0.5f + camera->jitter[0] - 0.5f * (float)camera->width) * scale;
        float sy = (half_height - ((float)y + 0.5f + camera->jitter[1])) * scale;
        float *direction[3] = {ray.ray.dir_x, ray.ray.dir_y, ray.ray.dir_z};
        for (int c = 0; c < 3; c++)
            direction[c][lane] = camera->forward[c] + sx * camera->right[c] + sy * camera->up[c];
        ray.ray.org_x[lane] = camera->eye[0];
        ray.ray.org_y[lane] = camera->eye[1];
        ray.ray.org_z[lane] = camera->eye[2];
        ray.ray.tfar[lane] = INFINITY;
        ray.ray.mask[lane] = ~0u;
        ray.ray.id[lane] = trace_hash(y * camera->width + x);
        ray.hit.geomID[lane] = ray.hit.instID[0][lane] = RTC_INVALID_GEOMETRY_ID;
        valid[lane] = x < camera->width && y < camera->height ? -1 : 0;
    }
    struct trace_context query = {0};
    embree_context_init(&query.embree);
    embree_intersect16(valid, p->rtc, &query.embree, &ray, true);
    for (uint32_t lane = 0; lane < LANES; lane++)
        if (valid[lane])
            store(p, (y0 + lane / BLOCK) * camera->width + x0 + lane % BLOCK, &ray, lane);
}

bool pen_trace_primary(struct pen_trace_scene *scene, const struct pen_trace_camera *camera,
    uint32_t threads, const struct pen_trace_hits *hits, struct pen_error *error)
{
    if (camera->width == 0 || camera->height == 0 || camera->width > 1u << 16 ||
        camera->height > 1u << 16 || !(camera->tan_half_fov_y > 0))
        return pen_fail(error, PEN_INVALID, "", "The camera has no pixels.");
    const struct trace_hierarchy *hierarchy =
        trace_hierarchy_get(scene, &(struct trace_silhouette){.shape = TRACE_EYE}, NULL, error);
    if (!hierarchy)
        return false;
    uint32_t blocks_x = (camera->width + BLOCK - 1) / BLOCK;
    uint32_t blocks_y = (camera->height + BLOCK - 1) / BLOCK;
    struct primary p = {.scene = scene,
        .camera = camera,
        .hits = hits,
        .blocks_x = blocks_x,
        .rtc = hierarchy->scene};
    double cpu_seconds = 0;
    const struct trace_work work = {trace_block, &p, blocks_x * blocks_y, NULL, 0};
    trace_parallel(trace_thread_count(threads), &work, &cpu_seconds);
    trace_hierarchy_release(scene, hierarchy);
    return true;
}
