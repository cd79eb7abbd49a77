/* Embree's hierarchies, kept between calls: one for all lights, or one per light where only fronts
 * cast. */
#include "renderer/trace/embree/internal.h"
#include <math.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

/* On which side of a triangle's plane the light lies: 1 all in front, 0 across, -1 all behind. */
static int side_of(const struct trace_silhouette *light, const float corner[3][3])
{
    float e1[3], e2[3], n[3], to[3];
    for (int c = 0; c < 3; c++) {
        e1[c] = corner[1][c] - corner[0][c];
        e2[c] = corner[2][c] - corner[0][c];
        to[c] = light->shape == TRACE_PARALLEL ? light->center[c] : light->center[c] - corner[0][c];
    }
    trace_cross(e1, e2, n);
    float middle = trace_dot(n, to), reach = 0, length = sqrtf(trace_dot(n, n));
    float a = trace_dot(n, light->a), b = trace_dot(n, light->b);
    switch (light->shape) {
    case TRACE_EYE:
    case TRACE_BOTH_SIDES:
        return 0;
    case TRACE_SQUARE:
        reach = fabsf(a) + fabsf(b);
        break;
    case TRACE_ROUND:
    case TRACE_PARALLEL:
        reach = sqrtf(a * a + b * b);
        break;
    case TRACE_BALL:
        reach = light->a[0] * length;
        break;
    }
    /* Rounding must not settle what the filter would decide otherwise. */
    reach += 1e-5f * length * sqrtf(trace_dot(to, to));
    return middle > reach ? 1 : middle < -reach ? -1 : 0;
}

static int side_of_triangle(const struct pen_trace_scene *scene, enum trace_group group,
    uint32_t triangle, const struct trace_silhouette *light)
{
    const uint32_t *index = scene->indices[group][triangle];
    float corner[3][3];
    for (int k = 0; k < 3; k++)
        memcpy(corner[k], scene->positions[group][index[k]], sizeof corner[k]);
    return side_of(light, corner);
}

static bool add_geometry(struct pen_trace_scene *scene, struct trace_hierarchy *h,
    enum trace_geometry id, const float (*positions)[3], uint32_t vertices,
    const uint32_t (*indices)[3], uint32_t triangles, struct pen_error *error)
{
    if (triangles == 0)
        return true;
    RTCGeometry geometry = rtcNewGeometry(scene->device, RTC_GEOMETRY_TYPE_TRIANGLE);
    if (!geometry)
        return trace_check_device(scene, error);
    h->geometries[id] = geometry;
    rtcSetSharedGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_VERTEX, 0, RTC_FORMAT_FLOAT3, positions, 0, 12, vertices);
    rtcSetSharedGeometryBuffer(
        geometry, RTC_BUFFER_TYPE_INDEX, 0, RTC_FORMAT_UINT3, indices, 0, 12, triangles);
    bool eye = h->light.shape == TRACE_EYE; /* else all rays are shadow rays */
    if (id == TRACE_GEOMETRY_MIXED) {
        rtcSetGeometryOccludedFilterFunction(geometry, trace_filter_facing_shadow);
        rtcSetGeometryIntersectFilterFunction(
            geometry, eye ? trace_filter_facing_primary : trace_filter_facing_shadow);
    } else if (id == TRACE_GEOMETRY_ALPHA) {
        rtcSetGeometryUserData(geometry, &h->filter);
        rtcSetGeometryOccludedFilterFunction(geometry, trace_filter_alpha_shadow);
        rtcSetGeometryIntersectFilterFunction(
            geometry, eye ? trace_filter_alpha_primary : trace_filter_alpha_shadow);
    }
    rtcCommitGeometry(geometry);
    rtcAttachGeometryByID(h->scene, geometry, id);
    h->triangles += triangles;
    if (id == TRACE_GEOMETRY_MIXED || id == TRACE_GEOMETRY_ALPHA)
        h->filtered += triangles;
    return trace_check_device(scene, error);
}

static bool add_group(struct pen_trace_scene *scene, struct trace_hierarchy *h,
    enum trace_geometry id, enum trace_group group, uint32_t triangles, struct pen_error *error)
{
    uint32_t(*indices)[3] = h->indices[id] ? h->indices[id] : scene->indices[group];
    return add_geometry(scene, h, id, (const float(*)[3])scene->positions[group],
        scene->vertex_count[group], (const uint32_t(*)[3])indices, triangles, error);
}

/* Fills the subsets that can cast for a light. */
static bool cull(struct pen_trace_scene *scene, struct trace_hierarchy *h,
    uint32_t counts[TRACE_GEOMETRIES], struct pen_error *error)
{
    uint32_t facing = scene->triangle_count[TRACE_FACING];
    uint32_t alpha = scene->triangle_count[TRACE_ALPHA];
    uint32_t(*front)[3] = malloc((facing + 1) * sizeof *front);
    uint32_t(*mixed)[3] = malloc((facing + 1) * sizeof *mixed);
    uint32_t(*leaves)[3] = malloc((alpha + 1) * sizeof *leaves);
    h->indices[TRACE_GEOMETRY_FRONT] = front;
    h->indices[TRACE_GEOMETRY_MIXED] = mixed;
    h->indices[TRACE_GEOMETRY_ALPHA] = leaves;
    h->alpha_triangles = malloc((alpha + 1) * sizeof *h->alpha_triangles);
    if (!front || !mixed || !leaves || !h->alpha_triangles)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    h->bytes = (uint64_t)facing * 24 + (uint64_t)alpha * 16;
    atomic_fetch_add(&scene->bytes, (int64_t)h->bytes);
    for (uint32_t i = 0; i < facing; i++) {
        int side = side_of_triangle(scene, TRACE_FACING, i, &h->light);
        uint32_t geometry = side > 0 ? TRACE_GEOMETRY_FRONT : TRACE_GEOMETRY_MIXED;
        if (side >= 0)
            memcpy(h->indices[geometry][counts[geometry]++], scene->indices[TRACE_FACING][i],
                sizeof *front);
    }
    for (uint32_t i = 0; i < alpha; i++) {
        const struct trace_alpha_material *m = &scene->alpha.table[scene->alpha.materials[i]];
        if (!m->two_sided && side_of_triangle(scene, TRACE_ALPHA, i, &h->light) < 0)
            continue;
        h->alpha_triangles[counts[TRACE_GEOMETRY_ALPHA]] = i;
        memcpy(
            leaves[counts[TRACE_GEOMETRY_ALPHA]++], scene->indices[TRACE_ALPHA][i], sizeof *leaves);
    }
    return true;
}

/* Embree's medium quality: the high one builds three times as long and traces no faster here. */
static bool build(struct pen_trace_scene *scene, struct trace_hierarchy *h,
    RTCProgressMonitorFunction goes_on, void *context, struct pen_error *error)
{
    uint32_t counts[TRACE_GEOMETRIES] = {
        [TRACE_GEOMETRY_TWO_SIDED] = scene->triangle_count[TRACE_TWO_SIDED],
        [TRACE_GEOMETRY_MIXED] = scene->triangle_count[TRACE_FACING],
        [TRACE_GEOMETRY_ALPHA] = scene->triangle_count[TRACE_ALPHA]};
    bool both_sides = h->light.shape == TRACE_BOTH_SIDES;
    if (both_sides) {
        counts[TRACE_GEOMETRY_FRONT] = counts[TRACE_GEOMETRY_MIXED];
        counts[TRACE_GEOMETRY_MIXED] = 0;
    } else if (h->light.shape != TRACE_EYE) {
        counts[TRACE_GEOMETRY_MIXED] = counts[TRACE_GEOMETRY_ALPHA] = 0;
        if (!cull(scene, h, counts, error))
            return false;
    }
    h->filter = (struct trace_filter){&scene->alpha, h->alpha_triangles, both_sides};
    h->scene = rtcNewScene(scene->device);
    if (!h->scene)
        return trace_check_device(scene, error);
    static const uint8_t group_of[] = {[TRACE_GEOMETRY_TWO_SIDED] = TRACE_TWO_SIDED,
        [TRACE_GEOMETRY_FRONT] = TRACE_FACING,
        [TRACE_GEOMETRY_MIXED] = TRACE_FACING,
        [TRACE_GEOMETRY_ALPHA] = TRACE_ALPHA};
    for (uint32_t id = 0; id < TRACE_GEOMETRY_GROUND; id++)
        if (!add_group(scene, h, id, group_of[id], counts[id], error))
            return false;
    if (scene->has_ground &&
        !add_geometry(scene, h, TRACE_GEOMETRY_GROUND, (const float(*)[3])scene->ground, 4,
            (const uint32_t(*)[3])scene->ground_indices, 2, error))
        return false;
    if (goes_on)
        rtcSetSceneProgressMonitorFunction(h->scene, goes_on, context);
    rtcCommitScene(h->scene);
    if (goes_on) /* what was handed over ends with the build */
        rtcSetSceneProgressMonitorFunction(h->scene, NULL, NULL);
    return trace_check_device(scene, error);
}

#define BUILT_AT_ONCE 5000 /* triangles; some milliseconds */
#define LOOK_EVERY_US 500

/* One that is built while others have their turns. */
struct trace_building {
    struct pen_trace_scene *scene;
    struct trace_hierarchy *hierarchy;
    pthread_t thread;
    atomic_bool abandoned, ended;
    bool ok;
};

static bool goes_on(void *context, double share)
{
    struct trace_building *b = context;
    (void)share;
    return !atomic_load(&b->abandoned);
}

static void *build_beside(void *context)
{
    struct trace_building *b = context;
    b->ok = build(b->scene, b->hierarchy, goes_on, b, &b->hierarchy->error);
    atomic_store(&b->ended, true);
    return NULL;
}

static void made(struct pen_trace_scene *scene, struct trace_hierarchy *h, bool ok)
{
    scene->builds++;
    h->last_use = ok ? ++scene->clock : 0;
}

/* Begins to make it, or makes it. */
static void begin(
    struct pen_trace_scene *scene, struct trace_hierarchy *h, const struct pen_trace_job *job)
{
    uint64_t triangles = 0;
    for (uint32_t g = 0; g < TRACE_GROUPS; g++)
        triangles += scene->triangle_count[g];
    bool beside = job && job->turn && triangles >= BUILT_AT_ONCE;
    struct trace_building *b = beside ? calloc(1, sizeof *b) : NULL;
    if (b) {
        *b = (struct trace_building){.scene = scene, .hierarchy = h};
        h->building = b;
        if (!pthread_create(&b->thread, NULL, build_beside, b))
            return;
        h->building = NULL;
        free(b);
    }
    made(scene, h, build(scene, h, NULL, NULL, &h->error));
}

/* Whoever sees first that it has ended. */
static void end(struct pen_trace_scene *scene, struct trace_hierarchy *h)
{
    struct trace_building *b = h->building;
    pthread_join(b->thread, NULL);
    made(scene, h, b->ok);
    h->building = NULL;
    free(b);
}

/* False when the job has given up; it says why. */
static bool await(
    struct pen_trace_scene *scene, struct trace_hierarchy *h, const struct pen_trace_job *job)
{
    while (h->building) {
        if (atomic_load(&h->building->ended)) {
            end(scene, h);
            break;
        }
        usleep(LOOK_EVERY_US);
        if (job && job->turn && !job->turn(job->turn_context))
            return false;
    }
    return true;
}

/* The one for that light, or a place for it; NULL: all are in use. */
static struct trace_hierarchy *find(
    struct pen_trace_scene *scene, const struct trace_silhouette *light)
{
    struct trace_hierarchy *oldest = NULL;
    for (uint32_t i = 0; i < TRACE_HIERARCHIES; i++) {
        struct trace_hierarchy *h = &scene->hierarchies[i];
        if ((h->last_use || h->users) && !memcmp(&h->light, light, sizeof *light))
            return h;
        if (!h->users && (!oldest || h->last_use < oldest->last_use))
            oldest = h;
    }
    if (oldest)
        trace_hierarchy_finish(scene, oldest);
    return oldest;
}

const struct trace_hierarchy *trace_hierarchy_get(struct pen_trace_scene *scene,
    const struct trace_silhouette *light, const struct pen_trace_job *job, struct pen_error *error)
{
    struct trace_hierarchy *h = find(scene, light);
    if (!h) {
        pen_fail(error, PEN_INTERNAL, "", "Too many hierarchies are in use.");
        return NULL;
    }
    if (!h->last_use && !h->users) {
        h->light = *light;
        begin(scene, h, job);
    }
    h->users++;
    bool stays = await(scene, h, job);
    if (stays && h->last_use) {
        h->last_use = ++scene->clock;
        return h;
    }
    if (stays && error && error->code == PEN_OK)
        *error = h->error;
    trace_hierarchy_release(scene, h);
    return NULL;
}

/* What nobody wants any more is not built to the end; what could not be made is tried again. */
void trace_hierarchy_release(struct pen_trace_scene *scene, const struct trace_hierarchy *hierarchy)
{
    struct trace_hierarchy *h = &scene->hierarchies[hierarchy - scene->hierarchies];
    if (--h->users)
        return;
    if (h->building) {
        atomic_store(&h->building->abandoned, true);
        end(scene, h);
        h->last_use = 0;
    }
    if (!h->last_use)
        trace_hierarchy_finish(scene, h);
}

void trace_hierarchy_finish(struct pen_trace_scene *scene, struct trace_hierarchy *h)
{
    for (uint32_t id = 0; id < TRACE_GEOMETRIES; id++) {
        if (h->geometries[id])
            rtcReleaseGeometry(h->geometries[id]);
        free(h->indices[id]);
    }
    if (h->scene)
        rtcReleaseScene(h->scene);
    free(h->alpha_triangles);
    atomic_fetch_sub(&scene->bytes, (int64_t)h->bytes);
    memset(h, 0, sizeof *h);
}
