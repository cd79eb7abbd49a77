/* Points and lines as solids, which are lit and cast like everything else: an octahedron at each
 * point and at each end of a line, and a square bar along each line, with the normals of spheres
 * and cylinders. How thick they are follows from the primitive itself. Where there are very many,
 * points are tetrahedra and lines have no ends. */
#include "renderer/import/convert/marks.h"
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum { POINTS, LINES, LINE_LOOP, MOST_MODE = 3 };

#define POINT_OF_SPACING 0.25f /* a point's radius, of the distance if they filled a square ... */
#define POINT_LEAST 0.001f     /* ... but of the primitive's diagonal at least and at most this */
#define POINT_MOST 0.01f
#define LINE_RADIUS 0.002f
#define LONE_RADIUS 0.01f /* m: where there is no diagonal */

/* A solid in the making: vertices that take all but place and normal from vertex `from`. */
struct solid {
    struct imp_geometry g;
    uint32_t *from;
};

static uint32_t add_vertex(
    struct solid *s, uint32_t from, const float center[3], const float normal[3], float radius)
{
    uint32_t v = s->g.vertex_count++;
    s->from[v] = from;
    for (int k = 0; k < 3; k++) {
        s->g.positions[v][k] = center[k] + radius * normal[k];
        s->g.normals[v][k] = normal[k];
    }
    return v;
}

static void add_triangle(struct solid *s, uint32_t a, uint32_t b, uint32_t c)
{
    uint32_t *to = s->g.indices + s->g.index_count;
    to[0] = a, to[1] = b, to[2] = c;
    s->g.index_count += 3;
}

static void add_octahedron(struct solid *s, uint32_t from, const float center[3], float radius)
{
    uint32_t first = s->g.vertex_count;
    for (int i = 0; i < 6; i++) {
        float normal[3] = {0, 0, 0};
        normal[i / 2] = i % 2 ? -1 : 1;
        add_vertex(s, from, center, normal, radius);
    }
    for (uint32_t octant = 0; octant < 8; octant++) {
        uint32_t x = first + (octant & 1), y = first + 2 + (octant >> 1 & 1),
                 z = first + 4 + (octant >> 2);
        bool odd = __builtin_popcount(octant) % 2;
        add_triangle(s, x, odd ? z : y, odd ? y : z);
    }
}

/* The same with half the triangles. */
static void add_tetrahedron(struct solid *s, uint32_t from, const float center[3], float radius)
{
    static const float third = 0.57735027f; /* 1 / sqrt 3 */
    uint32_t v = s->g.vertex_count;
    for (uint32_t i = 0; i < 4; i++) { /* every other corner of a cube */
        const float normal[3] = {
            i & 1 ? third : -third, i & 2 ? third : -third, __builtin_parity(i) ? third : -third};
        add_vertex(s, from, center, normal, radius);
    }
    add_triangle(s, v, v + 1, v + 2);
    add_triangle(s, v, v + 3, v + 1);
    add_triangle(s, v, v + 2, v + 3);
    add_triangle(s, v + 1, v + 3, v + 2);
}

static void add_bar(
    struct solid *s, uint32_t a, uint32_t b, const float pa[3], const float pb[3], float radius)
{
    float d[3], u[3], v[3], length = 0;
    int thin = 0; /* the axis that the line is farthest from */
    for (int k = 0; k < 3; k++) {
        d[k] = pb[k] - pa[k];
        length += d[k] * d[k];
        thin = fabsf(d[k]) < fabsf(d[thin]) ? k : thin;
    }
    length = sqrtf(length);
    if (!(length > 0) || !isfinite(length))
        return;
    float along = 0, w[3] = {0, 0, 0}, size = 0;
    w[thin] = 1;
    for (int k = 0; k < 3; k++)
        d[k] /= length;
    along = d[thin];
    for (int k = 0; k < 3; k++) {
        u[k] = w[k] - along * d[k];
        size += u[k] * u[k];
    }
    for (int k = 0; k < 3; k++)
        u[k] /= sqrtf(size);
    for (int k = 0; k < 3; k++)
        v[k] = d[(k + 1) % 3] * u[(k + 2) % 3] - d[(k + 2) % 3] * u[(k + 1) % 3];
    uint32_t first = s->g.vertex_count;
    for (int i = 0; i < 4; i++) { /* u, v, -u, -v: counter-clockwise as seen against d */
        float normal[3];
        for (int k = 0; k < 3; k++)
            normal[k] = (i < 2 ? 1.0f : -1.0f) * (i % 2 ? v[k] : u[k]);
        add_vertex(s, a, pa, normal, radius);
        add_vertex(s, b, pb, normal, radius);
    }
    for (uint32_t i = 0; i < 4; i++) {
        uint32_t here = first + 2 * i, next = first + 2 * ((i + 1) % 4);
        add_triangle(s, here, next, here + 1);
        add_triangle(s, next, next + 1, here + 1);
    }
}

#define NEAR_DIAGONALS 32

/* Far from 0 floats are coarser than a point's size: places are made relative to one among them. */
static void count_from_near(struct imp_geometry *g)
{
    double middle[3], away = 0, size = 0;
    for (int k = 0; k < 3; k++) {
        float least = g->positions[0][k], most = least;
        for (uint32_t i = 1; i < g->vertex_count; i++) {
            least = fminf(least, g->positions[i][k]);
            most = fmaxf(most, g->positions[i][k]);
        }
        middle[k] = ((double)least + most) / 2;
        away += middle[k] * middle[k];
        size += ((double)most - least) * ((double)most - least);
    }
    if (!(away > NEAR_DIAGONALS * NEAR_DIAGONALS * size) || !(away > 1))
        return;
    double step = size > 0 ? exp2(floor(log2(sqrt(size)))) : 0; /* keeps differences exact */
    for (int k = 0; k < 3; k++) {
        g->base[k] = (float)(step > 0 ? nearbyint(middle[k] / step) * step : middle[k]);
        for (uint32_t i = 0; i < g->vertex_count; i++)
            g->positions[i][k] -= g->base[k];
    }
}

static float diagonal(const struct imp_geometry *g)
{
    double square = 0;
    for (int k = 0; k < 3; k++) {
        float least = g->positions[0][k], most = least;
        for (uint32_t i = 1; i < g->vertex_count; i++) {
            least = fminf(least, g->positions[i][k]);
            most = fmaxf(most, g->positions[i][k]);
        }
        square += ((double)most - least) * ((double)most - least);
    }
    return (float)sqrt(square);
}

static float radius_of(const struct imp_geometry *g, uint32_t mode)
{
    float size = diagonal(g);
    if (!(size > 0))
        return LONE_RADIUS;
    if (mode != POINTS)
        return LINE_RADIUS * size;
    float radius = POINT_OF_SPACING * size / sqrtf((float)g->vertex_count);
    return fminf(fmaxf(radius, POINT_LEAST * size), POINT_MOST * size);
}

/* The attributes that were given, for every vertex of the solid. */
static void take_attributes(struct solid *s, const struct imp_geometry *given)
{
    uint32_t n = s->g.vertex_count;
    for (int k = 0; k < 2; k++) {
        s->g.uv[k] = given->uv[k] ? pen_alloc_zero(n, sizeof **s->g.uv) : NULL;
        for (uint32_t v = 0; given->uv[k] && v < n; v++)
            memcpy(s->g.uv[k][v], given->uv[k][s->from[v]], sizeof **s->g.uv);
    }
    s->g.colors = given->colors ? pen_alloc_zero(n, sizeof *s->g.colors) : NULL;
    for (uint32_t v = 0; given->colors && v < n; v++)
        memcpy(s->g.colors[v], given->colors[s->from[v]], sizeof *s->g.colors);
    s->g.used = pen_alloc_zero(n, sizeof *s->g.used);
    s->g.used_of = given->used_of;
    for (uint32_t v = 0; v < n; v++)
        s->g.used[v] = given->used[s->from[v]];
}

/* Where a place lies on a curve that passes through all of the box, near places mostly one after the
 * other (Morton 1966): ten bits of each coordinate in turns. */
static uint32_t curve_place(const float p[3], const float low[3], float scale)
{
    uint32_t place = 0;
    for (int k = 0; k < 3; k++) {
        uint32_t at = (uint32_t)fminf(fmaxf((p[k] - low[k]) * scale, 0), 1023);
        for (uint32_t bit = 0; bit < 10; bit++)
            place |= (at >> bit & 1) << (3 * bit + (uint32_t)k);
    }
    return place;
}

static int compare_places(const void *a, const void *b)
{
    const uint64_t *p = a, *q = b;
    return *p < *q ? -1 : *p > *q;
}

/* The numbers 0 .. count - 1 in an order in which neighbours are near; number i is at vertex at[i],
 * or i. */
static uint32_t *order_of_places(
    const struct imp_geometry *g, const uint32_t *at, uint32_t step, uint32_t count)
{
    uint64_t *keys = pen_alloc_zero(count, sizeof *keys);
    uint32_t *order = pen_alloc_zero(count, sizeof *order);
    float low[3], size = 0;
    for (int k = 0; k < 3; k++) {
        float most = low[k] = g->positions[0][k];
        for (uint32_t i = 1; i < g->vertex_count; i++) {
            low[k] = fminf(low[k], g->positions[i][k]);
            most = fmaxf(most, g->positions[i][k]);
        }
        size = fmaxf(size, most - low[k]);
    }
    float scale = size > 0 ? 1024 / size : 0;
    for (uint32_t i = 0; i < count; i++) {
        const float *p = g->positions[at ? at[(size_t)step * i] : i];
        keys[i] = (uint64_t)curve_place(p, low, scale) << 32 | i;
    }
    qsort(keys, count, sizeof *keys, compare_places);
    for (uint32_t i = 0; i < count; i++)
        order[i] = (uint32_t)keys[i];
    free(keys);
    return order;
}

/* Whole solids of `each` triangles to a meshlet, after `first` triangles that have theirs. */
static void add_meshlets(struct imp_geometry *g, uint32_t first, uint32_t each)
{
    uint32_t most = IMP_MESHLET_TRIANGLES / each * each;
    for (uint32_t left = g->index_count / 3 - first; left;) {
        uint32_t triangles = left < most ? left : most;
        g->meshlet_triangles[g->meshlet_count++] = triangles;
        left -= triangles;
    }
}

#define BALL_VERTICES 6
#define PLAIN_BALL_VERTICES 4
#define BAR_VERTICES 8

static uint32_t bars_of(uint32_t mode, uint32_t corners)
{
    return mode == POINTS  ? 0
           : mode == LINES ? corners / 2
                           : corners - (mode != LINE_LOOP && corners);
}

/* Lines have no balls at their ends when they are plain. */
static uint64_t vertices_of(uint32_t mode, bool plain, uint64_t balls, uint64_t bars)
{
    uint64_t of_ball = !plain ? BALL_VERTICES : mode == POINTS ? PLAIN_BALL_VERTICES : 0;
    return of_ball * balls + BAR_VERTICES * bars;
}

void imp_marks_plan(struct imp_context *context)
{
    const struct gltf_model *model = context->model;
    uint64_t need[2] = {0, 0}, corners = 0;
    for (uint32_t i = 0; i < model->primitive_count; i++) {
        const struct gltf_primitive *p = &model->primitives[i];
        int32_t counted = p->indices >= 0 ? p->indices : p->position;
        if (p->mode > MOST_MODE || (uint32_t)counted >= model->accessor_count)
            continue;
        uint64_t count = model->accessors[counted].count;
        corners += count;
        for (int plain = 0; plain < 2; plain++)
            need[plain] += vertices_of(p->mode, plain, count,
                p->mode == LINES ? count / 2
                : p->mode        ? count
                                 : 0);
    }
    context->marks.plain = need[0] > IMP_MAX_MARK_VERTICES;
    uint64_t stride = (need[1] + IMP_MAX_MARK_VERTICES - 1) / IMP_MAX_MARK_VERTICES;
    context->marks.stride = stride < 1 ? 1 : stride > UINT32_MAX ? UINT32_MAX : (uint32_t)stride;
    if (context->marks.stride > 1)
        imp_warn(context,
            "Of %llu points and ends of lines one in %u is drawn: there are too many.",
            (unsigned long long)corners, context->marks.stride);
}

bool imp_marks_thicken(
    struct imp_context *context, struct imp_geometry *g, uint32_t mode, struct pen_error *error)
{
    bool plain = context->marks.plain;
    uint32_t corners = g->index_count, bars = bars_of(mode, corners);
    uint32_t balls = plain && mode != POINTS ? 0 : g->vertex_count;
    uint64_t vertices = vertices_of(mode, plain, balls, bars);
    uint64_t indices = (plain ? 12 : 24) * (uint64_t)balls + 24 * (uint64_t)bars;
    if (vertices > IMP_MAX_VERTICES - context->vertex_count ||
        indices > IMP_MAX_INDICES - context->index_count)
        return pen_fail(error, PEN_TOO_BIG, "",
            "The scene has more points or lines than can be drawn: they take up to 8 triangles of "
            "%llu.",
            IMP_MAX_INDICES / 3);
    context->vertex_count += vertices;
    context->index_count += indices;
    imp_warn(context, "Points and lines are drawn as thin solids.");
    count_from_near(g);
    struct solid s = {.g = {.positions = pen_alloc_zero((size_t)vertices, sizeof *s.g.positions),
                          .normals = pen_alloc_zero((size_t)vertices, sizeof *s.g.normals),
                          .indices = pen_alloc_zero((size_t)indices, sizeof *s.g.indices),
                          .closed = !bars},
        .from = pen_alloc_zero((size_t)vertices, sizeof *s.from)};
    uint64_t meshlets = indices / 3 / (IMP_MESHLET_TRIANGLES / 2) + 2;
    s.g.meshlet_triangles = pen_alloc_zero((size_t)meshlets, sizeof *s.g.meshlet_triangles);
    float radius = radius_of(g, mode);
    uint32_t *order = order_of_places(g, NULL, 1, balls);
    for (uint32_t i = 0; i < balls; i++)
        (plain ? add_tetrahedron : add_octahedron)(&s, order[i], g->positions[order[i]], radius);
    free(order);
    add_meshlets(&s.g, 0, plain ? 4 : 8);
    uint32_t ball_triangles = s.g.index_count / 3, step = mode == LINES ? 2 : 1;
    order = order_of_places(g, g->indices, step, bars);
    for (uint32_t i = 0; i < bars; i++) {
        uint32_t first = step * order[i];
        uint32_t a = g->indices[first], b = g->indices[(first + 1) % corners];
        add_bar(&s, a, b, g->positions[a], g->positions[b], radius);
    }
    free(order);
    add_meshlets(&s.g, ball_triangles, 8);
    take_attributes(&s, g);
    free(s.from);
    memcpy(s.g.base, g->base, sizeof s.g.base);
    s.g.points = g->positions;
    s.g.point_count = g->vertex_count;
    g->positions = NULL;
    imp_geometry_finish(g);
    *g = s.g;
    return true;
}
