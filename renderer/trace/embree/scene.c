/* From a blob to triangles in world space. Instances are flattened: one level of hierarchy is
 * faster to traverse than two, and the caller bounds the memory. */
#include "renderer/trace/casters.h"
#include "renderer/trace/embree/internal.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DEFAULT_MAX_BYTES ((uint64_t)4 << 30)

/* What the passes over the instances share. */
struct build {
    const struct psc_scene *blob;
    struct pen_trace_scene *out;
    uint8_t *plans; /* per primitive: enum trace_group; TRACE_GROUPS: casts nothing */
    uint64_t triangles[TRACE_GROUPS], vertices[TRACE_GROUPS];
    uint32_t instances[TRACE_GROUPS];
};

static bool count_bytes(void *user, ssize_t bytes, bool after)
{
    struct pen_trace_scene *scene = user;
    int64_t total = atomic_fetch_add(&scene->bytes, bytes) + bytes;
    if (bytes > 0 && !after && total > (int64_t)scene->max_bytes) {
        atomic_store(&scene->over_budget, true);
        return false;
    }
    return true;
}

/* The alpha channel of an image's finest level, taken out once; false when memory is short. */
static bool extract_alpha(struct build *b, uint32_t image)
{
    struct trace_alpha *alpha = &b->out->alpha;
    if (alpha->images[image])
        return true;
    const struct psc_image *source = &b->blob->images[image];
    size_t count = (size_t)source->width * source->height;
    uint8_t *texels = malloc(count);
    if (!texels)
        return false;
    const uint8_t *rgba = b->blob->texels + source->first_byte;
    for (size_t i = 0; i < count; i++)
        texels[i] = rgba[4 * i + 3];
    alpha->images[image] = texels;
    atomic_fetch_add(&b->out->bytes, (int64_t)count);
    return true;
}

static bool prepare_alpha_material(struct build *b, uint32_t index)
{
    const struct psc_material *m = &b->blob->materials[index];
    struct trace_alpha_material *out = &b->out->alpha.table[index];
    if (out->prepared)
        return true;
    *out = (struct trace_alpha_material){.factor = m->base_color[3],
        .cutoff = m->alpha_cutoff,
        .blend = m->alpha_mode == PSC_BLEND,
        .two_sided = (m->flags & PSC_DOUBLE_SIDED) != 0,
        .prepared = true};
    b->out->alpha.blends |= out->blend;
    if (m->base.texture < 0)
        return true;
    const struct psc_texture *texture = &b->blob->textures[m->base.texture];
    if (!extract_alpha(b, texture->image))
        return false;
    out->texels = b->out->alpha.images[texture->image];
    out->width = b->blob->images[texture->image].width;
    out->height = b->blob->images[texture->image].height;
    out->wrap_s = texture->wrap_s;
    out->wrap_t = texture->wrap_t;
    out->nearest = texture->nearest & 1;
    return true;
}

static bool plan_primitive(struct build *b, uint32_t index, enum trace_caster caster)
{
    const struct psc_primitive *p = &b->blob->primitives[index];
    bool two_sided = b->blob->materials[p->material].flags & PSC_DOUBLE_SIDED;
    uint32_t group = two_sided ? TRACE_TWO_SIDED : TRACE_FACING;
    if (caster != TRACE_CASTS)
        group = caster == TRACE_CASTS_BY_ALPHA ? TRACE_ALPHA : TRACE_GROUPS;
    b->plans[index] = (uint8_t)group;
    return group != TRACE_ALPHA || prepare_alpha_material(b, p->material);
}

static bool plan_all(struct build *b, struct pen_error *error)
{
    const struct psc_scene *blob = b->blob;
    struct trace_alpha *alpha = &b->out->alpha;
    b->plans = calloc(blob->primitive_count + 1, sizeof *b->plans);
    alpha->table = calloc(blob->material_count + 1, sizeof *alpha->table);
    alpha->images = calloc(blob->image_count + 1, sizeof *alpha->images);
    alpha->image_count = blob->image_count;
    if (!b->plans || !alpha->table || !alpha->images)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    uint8_t *casters = trace_casters(blob);
    bool planned = casters != NULL;
    for (uint32_t i = 0; planned && i < blob->primitive_count; i++)
        planned = plan_primitive(b, i, casters[i]);
    free(casters);
    if (!planned)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    for (uint32_t i = 0; i < blob->instance_count; i++) {
        const struct psc_primitive *p = &blob->primitives[blob->instances[i].primitive];
        uint32_t group = b->plans[blob->instances[i].primitive];
        if (group == TRACE_GROUPS)
            continue;
        b->instances[group]++;
        b->triangles[group] += p->index_count / 3;
        b->vertices[group] += p->vertex_count;
    }
    uint64_t bytes = (uint64_t)atomic_load(&b->out->bytes);
    for (uint32_t g = 0; g < TRACE_GROUPS; g++) {
        bytes += b->triangles[g] * 12 + b->vertices[g] * 12;
        b->out->info.triangles += b->triangles[g];
        if (b->triangles[g] >= UINT32_MAX / 4 || b->vertices[g] >= UINT32_MAX / 4)
            atomic_store(&b->out->over_budget, true);
    }
    bytes += b->triangles[TRACE_ALPHA] * 4 + b->vertices[TRACE_ALPHA] * 12;
    if (bytes > b->out->max_bytes)
        atomic_store(&b->out->over_budget, true);
    atomic_store(&b->out->bytes, (int64_t)bytes);
    b->out->info.single_sided = b->triangles[TRACE_FACING];
    b->out->info.alpha = b->triangles[TRACE_ALPHA];
    return trace_check_device(b->out, error);
}

static bool allocate(struct build *b, struct pen_error *error)
{
    struct pen_trace_scene *out = b->out;
    for (uint32_t g = 0; g < TRACE_GROUPS; g++) {
        out->ranges[g] = calloc(b->instances[g] + 1, sizeof *out->ranges[g]);
        out->positions[g] = calloc(b->vertices[g] + 1, sizeof *out->positions[g]);
        out->indices[g] = calloc(b->triangles[g] + 1, sizeof *out->indices[g]);
        if (!out->ranges[g] || !out->positions[g] || !out->indices[g])
            return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    }
    struct trace_alpha *alpha = &out->alpha;
    uint64_t triangles = b->triangles[TRACE_ALPHA], vertices = b->vertices[TRACE_ALPHA];
    alpha->indices = out->indices[TRACE_ALPHA];
    alpha->uv = calloc(vertices + 1, sizeof *alpha->uv);
    alpha->vertex_alpha = calloc(vertices + 1, sizeof *alpha->vertex_alpha);
    alpha->materials = calloc(triangles + 1, sizeof *alpha->materials);
    if (!alpha->uv || !alpha->vertex_alpha || !alpha->materials)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    return true;
}

static void copy_alpha_vertices(struct build *b, const struct psc_primitive *p, uint32_t first)
{
    struct trace_alpha *alpha = &b->out->alpha;
    const struct psc_texture_ref *ref = &b->blob->materials[p->material].base;
    const float *t = ref->transform;
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        const struct psc_attributes *a = &b->blob->attributes[p->first_vertex + i];
        const float *uv = a->uv[ref->uv_set & 1];
        for (int c = 0; c < 2; c++) {
            float value = t[3 * c] * uv[0] + t[3 * c + 1] * uv[1] + t[3 * c + 2];
            alpha->uv[first + i][c] = isfinite(value) ? value : 0;
        }
        alpha->vertex_alpha[first + i] = (float)a->color[3] / 255;
    }
}

/* Appends one instance's triangles to its group, in world space. */
static void append_instance(struct build *b, uint32_t index)
{
    const struct psc_instance *instance = &b->blob->instances[index];
    const struct psc_primitive *p = &b->blob->primitives[instance->primitive];
    struct pen_trace_scene *out = b->out;
    const float *m = instance->world;
    uint32_t g = b->plans[instance->primitive];
    if (g == TRACE_GROUPS)
        return;
    uint32_t vertex = out->vertex_count[g], triangle = out->triangle_count[g];
    out->ranges[g][out->range_count[g]++] = (struct trace_range){triangle, index};
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        const float *from = b->blob->positions[p->first_vertex + i];
        float *to = out->positions[g][vertex + i];
        for (int c = 0; c < 3; c++) {
            to[c] =
                m[4 * c] * from[0] + m[4 * c + 1] * from[1] + m[4 * c + 2] * from[2] + m[4 * c + 3];
            out->extent = fmaxf(out->extent, fabsf(to[c]));
        }
    }
    uint32_t base = vertex - p->first_vertex;
    bool mirrored = instance->flags & PSC_MIRRORED;
    for (uint32_t i = 0; i < p->index_count / 3; i++) {
        const uint32_t *from = b->blob->indices + p->first_index + 3 * (size_t)i;
        uint32_t *to = out->indices[g][triangle + i];
        to[0] = from[0] + base;
        to[1] = from[mirrored ? 2 : 1] + base;
        to[2] = from[mirrored ? 1 : 2] + base;
        if (g == TRACE_ALPHA)
            out->alpha.materials[triangle + i] = p->material;
    }
    if (g == TRACE_ALPHA)
        copy_alpha_vertices(b, p, vertex);
    out->vertex_count[g] += p->vertex_count;
    out->triangle_count[g] += p->index_count / 3;
}

static void add_ground(struct pen_trace_scene *out, const struct pen_trace_ground *ground)
{
    static const uint32_t quad[2][3] = {{0, 1, 2}, {0, 2, 3}};
    for (uint32_t i = 0; i < 4; i++) {
        out->ground[i][0] = ground->center[0] + (i == 1 || i == 2 ? 1 : -1) * ground->half_size;
        out->ground[i][1] = ground->center[1];
        out->ground[i][2] = ground->center[2] + (i < 2 ? 1 : -1) * ground->half_size;
    }
    memcpy(out->ground_indices, quad, sizeof quad);
    out->has_ground = true;
}

struct pen_trace_scene *pen_trace_scene_create(const struct psc_scene *blob,
    const struct pen_trace_scene_options *options, struct pen_error *error)
{
    struct pen_trace_scene *out = calloc(1, sizeof *out);
    struct build build = {.blob = blob, .out = out};
    if (!out) {
        pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
        return NULL;
    }
    out->max_bytes = options && options->max_bytes ? options->max_bytes : DEFAULT_MAX_BYTES;
    out->device = rtcNewDevice(NULL);
    if (!out->device) {
        pen_fail(
            error, PEN_INTERNAL, "", "Embree failed with code %d.", (int)rtcGetDeviceError(NULL));
        goto fail;
    }
    rtcSetDeviceMemoryMonitorFunction(out->device, count_bytes, out);
    out->info.native_packet16 =
        rtcGetDeviceProperty(out->device, RTC_DEVICE_PROPERTY_NATIVE_RAY16_SUPPORTED) != 0;
    if (!plan_all(&build, error) || !allocate(&build, error))
        goto fail;
    for (uint32_t i = 0; i < blob->instance_count; i++)
        append_instance(&build, i);
    if (options && options->ground)
        add_ground(out, options->ground);
    free(build.plans);
    return out;
fail:
    free(build.plans);
    pen_trace_scene_destroy(out);
    return NULL;
}

void pen_trace_scene_destroy(struct pen_trace_scene *scene)
{
    if (!scene)
        return;
    for (uint32_t i = 0; i < TRACE_HIERARCHIES; i++)
        trace_hierarchy_finish(scene, &scene->hierarchies[i]);
    if (scene->device)
        rtcReleaseDevice(scene->device);
    for (uint32_t g = 0; g < TRACE_GROUPS; g++) {
        free(scene->ranges[g]);
        free(scene->positions[g]);
        free(scene->indices[g]);
    }
    for (uint32_t i = 0; scene->alpha.images && i < scene->alpha.image_count; i++)
        free(scene->alpha.images[i]);
    free(scene->scratch);
    free(scene->alpha.images);
    free(scene->alpha.table);
    free(scene->alpha.uv);
    free(scene->alpha.vertex_alpha);
    free(scene->alpha.materials);
    free(scene);
}

struct pen_trace_scene_info pen_trace_scene_info(const struct pen_trace_scene *scene)
{
    struct pen_trace_scene_info info = scene->info;
    info.bytes = (uint64_t)atomic_load(&scene->bytes);
    return info;
}

void *trace_scratch_take(struct pen_trace_scene *scene, size_t *bytes)
{
    void *scratch = scene->scratch;
    size_t has = scene->scratch_bytes;
    scene->scratch = NULL;
    scene->scratch_bytes = 0;
    if (has >= *bytes && has / 2 <= *bytes) {
        *bytes = has;
        return scratch;
    }
    free(scratch);
    atomic_fetch_add(&scene->bytes, (int64_t)*bytes - (int64_t)has);
    scratch = aligned_alloc(64, *bytes);
    if (!scratch)
        atomic_fetch_sub(&scene->bytes, (int64_t)*bytes);
    return scratch;
}

void trace_scratch_give(struct pen_trace_scene *scene, void *scratch, size_t bytes)
{
    if (!scratch)
        return;
    free(scene->scratch); /* of one that ended meanwhile */
    atomic_fetch_sub(&scene->bytes, (int64_t)scene->scratch_bytes);
    scene->scratch = scratch;
    scene->scratch_bytes = bytes;
}
