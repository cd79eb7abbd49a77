#include "renderer/import/convert/mesh.h"
#include "protocol/memory.h"
#include "renderer/import/geometry/accessor.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/marks.h"
#include "renderer/import/convert/material.h"
#include "renderer/import/convert/variants.h"
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

/* Points and lines keep their corners, or every `stride`-th of them. */
static void pick_marks(
    struct imp_geometry *g, const struct corners *corners, uint32_t mode, uint32_t stride)
{
    uint32_t run = mode == LINES ? 2 : 1; /* a pair is a line */
    uint32_t n = corners->count - corners->count % run;
    g->indices = pen_alloc_zero(n / stride + 2 * run, sizeof *g->indices);
    for (uint64_t i = 0; i < n; i += (uint64_t)stride * run)
        for (uint32_t k = 0; k < run; k++)
            if (i + k < n)
                g->indices[g->index_count++] = corner(corners, (uint32_t)i + k);
    if (mode > LINES && n && (n - 1) % stride) /* a strip ends where it did */
        g->indices[g->index_count++] = corner(corners, n - 1);
}

/* Unrolls strips and fans: section 3.7.2.1 of the glTF 2.0 specification. */
static void unroll(struct imp_geometry *g, const struct corners *corners, uint32_t mode)
{
    uint32_t n = corners->count, out = 0;
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
    if (primitive->mode < TRIANGLES)
        pick_marks(g, &corners, primitive->mode, context->marks.stride);
    else
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

/* Renumbers the vertices that the triangles use, in order of first use, and keeps their old numbers.
 * Some files share one large vertex buffer among thousands of primitives. */
static void compact(struct imp_context *context, struct imp_geometry *g, uint32_t total)
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
    g->used = pen_alloc_zero(most, sizeof *g->used);
    g->vertex_count = 0;
    for (uint32_t i = 0; i < g->index_count; i++) {
        uint32_t old = g->indices[i];
        if (context->stamps[old] != stamp) {
            context->stamps[old] = stamp;
            context->stamped[old] = g->vertex_count;
            g->used[g->vertex_count++] = old;
        }
        g->indices[i] = context->stamped[old];
    }
}

/* NULL: it suits. */
static const char *why_not(const struct imp_geometry *g, const struct imp_reader *reader,
    uint32_t least, uint32_t components)
{
    if (reader->components < least || reader->components > components)
        return "its type does not suit the attribute";
    return reader->count < g->used_of ? "it has fewer elements than the primitive has vertices"
                                      : NULL;
}

bool imp_gather(struct imp_context *context, const struct imp_geometry *g, int32_t accessor,
    uint32_t least, uint32_t components, void *out, struct pen_error *error)
{
    struct imp_reader reader;
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/accessors/%d", accessor);
    if (accessor < 0)
        return true;
    if (!imp_reader_init(&reader, context->document, context->model, accessor, error))
        return false;
    const char *why = why_not(g, &reader, least, components);
    if (why)
        return pen_fail(error, PEN_INVALID, pointer, "glTF %s: %s.", pointer, why);
    float *values = pen_alloc_zero((size_t)g->vertex_count * components, sizeof *values);
    *(float **)out = values;
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        float *value = values + (size_t)i * components;
        for (uint32_t k = reader.components; k < components; k++)
            value[k] = 1;
        imp_read_floats(&reader, g->used[i], value, components);
    }
    return true;
}

/* Of an attribute that the primitive can do without: left out when it does not suit. */
static bool gather_extra(struct imp_context *context, const struct imp_geometry *g,
    int32_t accessor, uint32_t least, uint32_t components, void *out, struct pen_error *error)
{
    struct imp_reader reader;
    if (accessor < 0)
        return true;
    if (!imp_reader_init(&reader, context->document, context->model, accessor, error))
        return false;
    const char *why = why_not(g, &reader, least, components);
    if (!why)
        return imp_gather(context, g, accessor, least, components, out, error);
    imp_warn(context, "An attribute is left out. glTF /accessors/%d: %s.", accessor, why);
    return true;
}

static bool read_vertices(struct imp_context *context, struct imp_geometry *g,
    const struct gltf_primitive *primitive, uint32_t total, struct pen_error *error)
{
    uint32_t sets[2];
    imp_material_uv_sets(context, primitive->material, sets);
    compact(context, g, total);
    g->used_of = total;
    if (g->vertex_count > IMP_MAX_VERTICES - context->vertex_count)
        return too_many_vertices(error);
    context->vertex_count += g->vertex_count;
    if (!imp_gather(context, g, primitive->position, 3, 3, &g->positions, error) ||
        !gather_extra(context, g, primitive->normal, 3, 3, &g->normals, error) ||
        !gather_extra(context, g, primitive->uv[sets[0]], 2, 2, &g->uv[0], error) ||
        !gather_extra(context, g, primitive->uv[sets[1]], 2, 2, &g->uv[1], error) ||
        !gather_extra(context, g, primitive->color, 3, 4, &g->colors, error))
        return false;
    /* Without normals the specification wants flat ones, and given tangents ignored. */
    if (g->normals && !gather_extra(context, g, primitive->tangent, 4, 4, &g->tangents, error))
        return false;
    for (uint32_t i = 0; i < g->vertex_count; i++)
        for (int k = 0; k < 3; k++)
            if (!(fabsf(g->positions[i][k]) <= FARTHEST)) {
                char pointer[64];
                snprintf(pointer, sizeof pointer, "/accessors/%d", primitive->position);
                return pen_fail(error, PEN_INVALID, pointer,
                    "glTF %s: a position is not finite or beyond 1e12 m.", pointer);
            }
    return true;
}

bool imp_geometry_read(
    struct imp_context *context, uint32_t number, struct imp_geometry *g, struct pen_error *error)
{
    const struct gltf_primitive *primitive = &context->model->primitives[number];
    struct imp_reader positions;
    if (primitive->position < 0) {
        imp_warn(context, "A primitive without positions is not drawn.");
        return true;
    }
    if (!imp_reader_init(&positions, context->document, context->model, primitive->position, error))
        return false;
    g->has_normal_map = imp_variants_normal_map(context, number, &g->normal_map);
    if (positions.count > IMP_MAX_ACCESSOR)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The scene has more than %u vertices.", IMP_MAX_ACCESSOR);
    if (!read_triangles(context, g, primitive, positions.count, error))
        return false;
    if (!g->index_count) {
        imp_warn(context, "A primitive without any triangle is not drawn.");
        return true;
    }
    return read_vertices(context, g, primitive, positions.count, error) &&
           (primitive->mode >= TRIANGLES || imp_marks_thicken(context, g, primitive->mode, error));
}

struct psc_mesh imp_geometry_mesh(
    struct imp_context *context, uint32_t number, const struct imp_geometry *g)
{
    int32_t material = context->model->primitives[number].material;
    return (struct psc_mesh){.positions = (const float(*)[3])g->positions,
        .normals = (const float(*)[3])g->normals,
        .tangents = (const float(*)[4])g->tangents,
        .uv0 = (const float(*)[2])g->uv[0],
        .uv1 = (const float(*)[2])g->uv[1],
        .colors = (const float(*)[4])g->colors,
        .vertex_count = g->vertex_count,
        .indices = g->indices,
        .index_count = g->index_count,
        .material = imp_material(context, material),
        .normal_map = g->has_normal_map ? &g->normal_map : NULL,
        .meshlet_triangles = g->meshlet_triangles,
        .meshlet_count = g->meshlet_count,
        .points = (const float(*)[3])g->points,
        .point_count = g->point_count,
        .base = {g->base[0], g->base[1], g->base[2]},
        .closed = g->closed};
}

static bool add(struct imp_context *context, uint32_t number, struct imp_geometry *g, uint32_t *psc,
    struct pen_error *error)
{
    struct primitive_bounds *bounds = &context->primitive_bounds[number];
    for (int k = 0; k < 3; k++)
        bounds->min[k] = bounds->max[k] = g->positions[0][k];
    for (uint32_t i = 1; i < g->vertex_count; i++)
        for (int k = 0; k < 3; k++) {
            bounds->min[k] = fmin(bounds->min[k], g->positions[i][k]);
            bounds->max[k] = fmax(bounds->max[k], g->positions[i][k]);
        }
    for (int k = 0; k < 3; k++)
        bounds->min[k] += g->base[k], bounds->max[k] += g->base[k];
    free(g->used); /* or no two vertices would be equal */
    g->used = NULL;
    imp_geometry_optimise(g, &context->optimiser_work);
    const struct psc_mesh mesh = imp_geometry_mesh(context, number, g);
    if (!psc_builder_add_mesh(context->builder, &mesh, psc, error))
        return false;
    imp_variants_note(context, number, *psc);
    return true;
}

bool imp_primitive(
    struct imp_context *context, uint32_t number, uint32_t *psc, struct pen_error *error)
{
    *psc = context->primitives[number];
    if (*psc != IMP_NOT_YET)
        return true;
    context->primitives[number] = IMP_SKIPPED;
    struct imp_geometry g = {0};
    bool done = imp_geometry_read(context, number, &g, error) &&
                (!g.index_count || add(context, number, &g, &context->primitives[number], error));
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
