#include "renderer/import/convert/mesh.h"
#include "protocol/memory.h"
#include "renderer/import/geometry/accessor.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/marks.h"
#include "renderer/import/convert/material.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

enum { LINES = 1, TRIANGLES = 4, TRIANGLE_STRIP = 5, TRIANGLE_FAN = 6 };

#define FARTHEST 1e12f /* m, as in the blob */

/* Where the corners of a primitive come from. */
struct corners {
    struct imp_reader indices;
    bool indexed;
    uint32_t count;
};

static uint32_t corner(const struct corners *corners, uint32_t i)
{
    return corners->indexed ? imp_read_index(&corners->indices, i) : i;
}

/* Points and lines keep their corners as they are; unrolls strips and fans: section 3.7.2.1 of the glTF 2.0 specification. */
static void unroll(struct imp_geometry *g, const struct corners *corners, uint32_t mode)
{
    uint32_t n = corners->count, out = 0;
    if (mode < TRIANGLES) {
        g->indices = pen_alloc_zero(n, sizeof *g->indices);
        n -= mode == LINES ? n % 2 : 0; /* a pair is a line */
        for (g->index_count = 0; g->index_count < n; g->index_count++)
            g->indices[g->index_count] = corner(corners, g->index_count);
        return;
    }
    uint32_t triangles = mode == TRIANGLES ? n / 3 : n >= 3 ? n - 2 : 0;
    g->indices = pen_alloc_zero(3 * (size_t)triangles, sizeof *g->indices);
    for (uint32_t i = 0; i < triangles; i++) {
        uint32_t a = i, b = i + 1 + i % 2, c = i + 2 - i % 2; /* a strip turns every other one */
        if (mode == TRIANGLES)
            a = 3 * i, b = a + 1, c = a + 2;
        else if (mode == TRIANGLE_FAN)
            a = i + 1, b = i + 2, c = 0;
        a = corner(corners, a);
        b = corner(corners, b);
        c = corner(corners, c);
        if (mode == TRIANGLE_STRIP && (a == b || b == c || c == a))
            continue; /* a stitch */
        g->indices[out++] = a;
        g->indices[out++] = b;
        g->indices[out++] = c;
    }
    g->index_count = out;
}

static bool too_many_vertices(struct pen_error *error)
{
    return pen_fail(
        error, PEN_TOO_BIG, "", "The scene has more than %llu vertices.", IMP_MAX_VERTICES);
}

static bool too_many_triangles(struct pen_error *error)
{
    return pen_fail(
        error, PEN_TOO_BIG, "", "The scene has more than %llu triangles.", IMP_MAX_INDICES / 3);
}

static bool read_triangles(struct imp_context *context, struct imp_geometry *g,
    const struct gltf_primitive *primitive, uint32_t vertex_count, struct pen_error *error)
{
    struct corners corners = {.indexed = primitive->indices >= 0, .count = vertex_count};
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/accessors/%d", primitive->indices);
    if (corners.indexed) {
        if (!imp_reader_init(
                &corners.indices, context->document, context->model, primitive->indices, error))
            return false;
        uint32_t c = corners.indices.component;
        if (corners.indices.components != 1 || (c != 5121 && c != 5123 && c != 5125))
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: indices must be unsigned integers.", pointer);
        corners.count = corners.indices.count;
    } else if (vertex_count > IMP_MAX_VERTICES - context->vertex_count) {
        return too_many_vertices(error);
    }
    uint64_t most = primitive->mode <= TRIANGLES ? corners.count : 3 * (uint64_t)corners.count;
    if (most > IMP_MAX_INDICES - context->index_count)
        return too_many_triangles(error);
    unroll(g, &corners, primitive->mode);
    if (primitive->mode >= TRIANGLES)
        context->index_count += g->index_count;
    for (uint32_t i = 0; i < g->index_count; i++)
        if (g->indices[i] >= vertex_count)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: index %u of a primitive with %u vertices.", pointer, g->indices[i],
                vertex_count);
    return true;
}

/* Renumbers the vertices that the triangles use, in order of first use, and returns the list of
 * their old numbers. Some files share one large vertex buffer among thousands of primitives. */
static uint32_t *compact(struct imp_context *context, struct imp_geometry *g, uint32_t total)
{
    if (context->stamp_capacity < total) {
        free(context->stamps);
        free(context->stamped);
        context->stamps = pen_alloc_zero(total, sizeof *context->stamps);
        context->stamped = pen_alloc_zero(total, sizeof *context->stamped);
        context->stamp_capacity = total;
        context->stamp = 0;
    }
    uint32_t stamp = ++context->stamp;
    uint32_t most = g->index_count < total ? g->index_count : total;
    uint32_t *used = pen_alloc_zero(most, sizeof *used);
    g->vertex_count = 0;
    for (uint32_t i = 0; i < g->index_count; i++) {
        uint32_t old = g->indices[i];
        if (context->stamps[old] != stamp) {
            context->stamps[old] = stamp;
            context->stamped[old] = g->vertex_count;
            used[g->vertex_count++] = old;
        }
        g->indices[i] = context->stamped[old];
    }
    return used;
}

/* Reads `components` floats of each used vertex; NULL in *out when the primitive has no such
 * attribute. Those that the accessor lacks are 1. */
static bool gather(struct imp_context *context, int32_t accessor, uint32_t least, uint32_t total,
    const uint32_t *used, uint32_t count, uint32_t components, void *out, struct pen_error *error)
{
    struct imp_reader reader;
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/accessors/%d", accessor);
    if (accessor < 0)
        return true;
    if (!imp_reader_init(&reader, context->document, context->model, accessor, error))
        return false;
    if (reader.components < least || reader.components > components)
        return pen_fail(
            error, PEN_INVALID, pointer, "glTF %s: its type does not suit the attribute.", pointer);
    if (reader.count < total)
        return pen_fail(error, PEN_INVALID, pointer,
            "glTF %s: it has fewer elements than the primitive has vertices.", pointer);
    float *values = pen_alloc_zero((size_t)count * components, sizeof *values);
    *(float **)out = values;
    for (uint32_t i = 0; i < count; i++) {
        float *value = values + (size_t)i * components;
        for (uint32_t k = reader.components; k < components; k++)
            value[k] = 1;
        imp_read_floats(&reader, used[i], value, components);
    }
    return true;
}

static bool read_vertices(struct imp_context *context, struct imp_geometry *g,
    const struct gltf_primitive *primitive, uint32_t total, struct pen_error *error)
{
    uint32_t *used = compact(context, g, total), n = g->vertex_count;
    bool done = false;
    if (n > IMP_MAX_VERTICES - context->vertex_count) {
        pen_fail(
            error, PEN_TOO_BIG, "", "The scene has more than %llu vertices.", IMP_MAX_VERTICES);
        goto fail;
    }
    context->vertex_count += n;
    if (!gather(context, primitive->position, 3, total, used, n, 3, &g->positions, error) ||
        !gather(context, primitive->normal, 3, total, used, n, 3, &g->normals, error) ||
        !gather(context, primitive->uv[0], 2, total, used, n, 2, &g->uv[0], error) ||
        !gather(context, primitive->uv[1], 2, total, used, n, 2, &g->uv[1], error) ||
        !gather(context, primitive->color, 3, total, used, n, 4, &g->colors, error))
        goto fail;
    /* Without normals the specification wants flat ones, and given tangents ignored. */
    if (g->normals &&
        !gather(context, primitive->tangent, 4, total, used, n, 4, &g->tangents, error))
        goto fail;
    for (uint32_t i = 0; i < n; i++)
        for (int k = 0; k < 3; k++)
            if (!(fabsf(g->positions[i][k]) <= FARTHEST)) {
                char pointer[64];
                snprintf(pointer, sizeof pointer, "/accessors/%d", primitive->position);
                pen_fail(error, PEN_INVALID, pointer,
                    "glTF %s: a position is not finite or beyond 1e12 m.", pointer);
                goto fail;
            }
    done = true;
fail:
    free(used);
    return done;
}

/* `points`: what the described bounds are of; NULL: the geometry's own positions. */
static bool add(struct imp_context *context, uint32_t number, struct imp_geometry *g,
    const float (*points)[3], uint32_t point_count, uint32_t *psc, struct pen_error *error)
{
    const struct gltf_primitive *primitive = &context->model->primitives[number];
    struct primitive_bounds *bounds = &context->primitive_bounds[number];
    for (int k = 0; k < 3; k++)
        bounds->min[k] = bounds->max[k] = g->positions[0][k];
    for (uint32_t i = 1; i < g->vertex_count; i++)
        for (int k = 0; k < 3; k++) {
            bounds->min[k] = fminf(bounds->min[k], g->positions[i][k]);
            bounds->max[k] = fmaxf(bounds->max[k], g->positions[i][k]);
        }
    imp_geometry_optimise(g, &context->optimiser_work);
    const struct psc_mesh mesh = {.positions = (const float(*)[3])g->positions,
        .normals = (const float(*)[3])g->normals,
        .tangents = (const float(*)[4])g->tangents,
        .uv0 = (const float(*)[2])g->uv[0],
        .uv1 = (const float(*)[2])g->uv[1],
        .colors = (const float(*)[4])g->colors,
        .vertex_count = g->vertex_count,
        .indices = g->indices,
        .index_count = g->index_count,
        .material = imp_material(context, primitive->material),
        .need_tangents = imp_material_has_normal_map(context, primitive->material),
        .meshlet_triangles = g->meshlet_triangles,
        .meshlet_count = g->meshlet_count,
        .points = points,
        .point_count = point_count};
    return psc_builder_add_mesh(context->builder, &mesh, psc, error);
}

bool imp_primitive(
    struct imp_context *context, uint32_t number, uint32_t *psc, struct pen_error *error)
{
    const struct gltf_primitive *primitive = &context->model->primitives[number];
    *psc = context->primitives[number];
    if (*psc != IMP_NOT_YET)
        return true;
    *psc = context->primitives[number] = IMP_SKIPPED;
    if (primitive->position < 0) {
        imp_warn(context, "A primitive without positions is not drawn.");
        return true;
    }
    if (primitive->morphed)
        imp_warn(context, "Morph targets are ignored: shapes are drawn at rest.");
    struct imp_reader positions;
    if (!imp_reader_init(&positions, context->document, context->model, primitive->position, error))
        return false;
    if (positions.count > IMP_MAX_ACCESSOR)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The scene has more than %u vertices.", IMP_MAX_ACCESSOR);
    struct imp_geometry g = {0};
    bool done = read_triangles(context, &g, primitive, positions.count, error);
    bool drawn = done && g.index_count;
    if (done && !drawn)
        imp_warn(context, "A primitive without any triangle is not drawn.");
    float(*points)[3] = NULL;
    done = done && (!drawn || read_vertices(context, &g, primitive, positions.count, error));
    uint32_t point_count = g.vertex_count;
    if (done && drawn && primitive->mode < TRIANGLES)
        done = imp_marks_thicken(context, &g, primitive->mode, &points, error);
    if (done && drawn)
        done = add(context, number, &g, (const float(*)[3])points, point_count,
            &context->primitives[number], error);
    free(points);
    imp_geometry_finish(&g);
    *psc = context->primitives[number];
    return done;
}

bool imp_primitives_fit(const struct gltf_model *model, struct pen_error *error)
{
    uint64_t corners = 0, vertices = 0;
    for (uint32_t i = 0; i < model->primitive_count; i++) {
        const struct gltf_primitive *primitive = &model->primitives[i];
        int32_t counted = primitive->indices >= 0 ? primitive->indices : primitive->position;
        if (primitive->mode < TRIANGLES || (uint32_t)counted >= model->accessor_count)
            continue;
        uint64_t count = model->accessors[counted].count;
        corners += primitive->mode == TRIANGLES ? count : 3 * count;
        vertices += primitive->indices >= 0 ? 0 : count;
    }
    if (corners > IMP_MAX_INDICES)
        return too_many_triangles(error);
    return vertices <= IMP_MAX_VERTICES || too_many_vertices(error);
}
