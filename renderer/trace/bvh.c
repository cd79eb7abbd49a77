/* Building and walking the hierarchy. */
#include "renderer/trace/bvh.h"
#include "renderer/trace/casters.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define BINS 16
#define NODE_COST 1.0f /* relative to a triangle test */
#define WORN_OUT 1.5   /* so many times the cost as built, and a new tree is worth its time */
#define MAX_DEPTH (PEN_BVH_STACK - 1)

struct box {
    float low[3], high[3];
};

struct item { /* a triangle while it is sorted */
    struct box box;
    uint32_t triangle;
};

struct split {
    int axis; /* -1: none */
    uint32_t bin;
    float low, scale, cost;
};

/* fminf and fmaxf are calls into the mathematics library. Where a is NaN these give b: what grows
 * ignores a triangle whose transform overflowed. */
static inline float lesser(float a, float b)
{
    return a < b ? a : b;
}

static inline float greater(float a, float b)
{
    return a > b ? a : b;
}

static const struct box empty_box = {
    {INFINITY, INFINITY, INFINITY}, {-INFINITY, -INFINITY, -INFINITY}};

static void grow(struct box *box, const struct box *by)
{
    for (int c = 0; c < 3; c++) {
        box->low[c] = lesser(by->low[c], box->low[c]);
        box->high[c] = greater(by->high[c], box->high[c]);
    }
}

static float half_area(const struct box *box)
{
    float d[3];
    for (int c = 0; c < 3; c++)
        d[c] = greater(box->high[c] - box->low[c], 0);
    return d[0] * d[1] + d[1] * d[2] + d[2] * d[0];
}

static float middle(const struct item *item, int axis)
{
    return 0.5f * item->box.low[axis] + 0.5f * item->box.high[axis];
}

static uint32_t bin_of(const struct split *split, const struct item *item)
{
    float at = (middle(item, split->axis) - split->low) * split->scale;
    return at < BINS - 1 ? (uint32_t)greater(at, 0) : BINS - 1;
}

/* The cheapest plane between two bins of one axis. */
static struct split split_axis(
    const struct item *items, uint32_t count, int axis, float low, float high)
{
    struct split best = {.axis = -1, .cost = INFINITY};
    struct split all = {.axis = axis, .low = low, .scale = BINS / (high - low)};
    struct box boxes[BINS], right[BINS];
    uint32_t counts[BINS] = {0};
    if (!(high > low) || !isfinite(all.scale))
        return best;
    for (int b = 0; b < BINS; b++)
        boxes[b] = empty_box;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t b = bin_of(&all, &items[i]);
        grow(&boxes[b], &items[i].box);
        counts[b]++;
    }
    right[BINS - 1] = boxes[BINS - 1];
    for (int b = BINS - 2; b >= 0; b--) {
        right[b] = right[b + 1];
        grow(&right[b], &boxes[b]);
    }
    struct box left = empty_box;
    uint32_t left_count = 0;
    for (uint32_t b = 1; b < BINS; b++) {
        grow(&left, &boxes[b - 1]);
        left_count += counts[b - 1];
        if (left_count == 0 || left_count == count)
            continue;
        float cost = half_area(&left) * (float)left_count +
                     half_area(&right[b]) * (float)(count - left_count);
        if (cost < best.cost) {
            best = all;
            best.bin = b;
            best.cost = cost;
        }
    }
    return best;
}

static int compare_items(const void *a, const void *b, void *axis)
{
    const struct item *p = a, *q = b;
    float x = middle(p, *(int *)axis), y = middle(q, *(int *)axis);
    if (x != y)
        return x < y ? -1 : 1;
    return p->triangle < q->triangle ? -1 : 1;
}

/* Into equal halves along the longest axis; returns the first one's size. */
static uint32_t halve(struct item *items, uint32_t count, const struct box *centres)
{
    int axis = 0;
    for (int c = 1; c < 3; c++)
        if (centres->high[c] - centres->low[c] > centres->high[axis] - centres->low[axis])
            axis = c;
    qsort_r(items, count, sizeof *items, compare_items, &axis);
    return count / 2;
}

/* How many levels halving needs until every leaf is small. */
static uint32_t levels_for(uint32_t count)
{
    uint32_t levels = 0;
    for (; count > PEN_BVH_LEAF; count = (count + 1) / 2)
        levels++;
    return levels;
}

/* Puts a node's items in order; returns how many go left, 0 to make it a leaf. */
static uint32_t divide(struct item *items, uint32_t count, float area, uint32_t depth)
{
    struct split best = {.axis = -1, .cost = INFINITY};
    struct box centres = empty_box;
    for (uint32_t i = 0; i < count; i++)
        for (int c = 0; c < 3; c++) {
            centres.low[c] = lesser(middle(&items[i], c), centres.low[c]);
            centres.high[c] = greater(middle(&items[i], c), centres.high[c]);
        }
    for (int axis = 0; axis < 3; axis++) {
        struct split s = split_axis(items, count, axis, centres.low[axis], centres.high[axis]);
        if (s.cost < best.cost)
            best = s;
    }
    if (count <= PEN_BVH_LEAF &&
        (depth >= MAX_DEPTH || !(best.cost + NODE_COST * area < area * (float)count)))
        return 0; /* a leaf is as cheap */
    if (best.axis < 0)
        return halve(items, count, &centres);
    uint32_t left = 0;
    for (uint32_t i = 0; i < count; i++)
        if (bin_of(&best, &items[i]) < best.bin) {
            struct item swap = items[i];
            items[i] = items[left];
            items[left++] = swap;
        }
    uint32_t most = left > count - left ? left : count - left;
    if (depth + 1 + levels_for(most) > MAX_DEPTH)
        return halve(items, count, &centres); /* so deep that only this stays within the stack */
    return left;
}

static struct box box_of(const struct item *items, uint32_t count)
{
    struct box box = empty_box;
    for (uint32_t i = 0; i < count; i++)
        grow(&box, &items[i].box);
    return box;
}

/* Fills the nodes; the items end in leaf order. */
static void build_nodes(struct item *items, uint32_t count, struct pen_bvh *bvh)
{
    struct {
        uint32_t node, first, count, depth;
    } stack[MAX_DEPTH + 2], job = {0, 0, count, 0};
    uint32_t waiting = 0;
    double cost = 0, root_area = 0;
    stack[waiting++] = job;
    bvh->node_count = 1;
    while (waiting) {
        job = stack[--waiting];
        struct item *own = items + job.first;
        struct box box = box_of(own, job.count);
        struct pen_bvh_node *node = &bvh->nodes[job.node];
        float area = half_area(&box);
        uint32_t left = job.count > 1 ? divide(own, job.count, area, job.depth) : 0;
        memcpy(node->low, box.low, sizeof node->low);
        memcpy(node->high, box.high, sizeof node->high);
        if (job.node == 0)
            root_area = (double)area;
        bvh->depth = job.depth > bvh->depth ? job.depth : bvh->depth;
        cost += (double)area * (left ? (double)NODE_COST : job.count);
        node->first = left ? bvh->node_count : job.first;
        node->count = left ? 0 : job.count;
        if (!left)
            continue;
        for (uint32_t side = 0; side < 2; side++) {
            stack[waiting].node = bvh->node_count + 1 - side; /* the left one is done first */
            stack[waiting].first = side ? job.first : job.first + left;
            stack[waiting].count = side ? left : job.count - left;
            stack[waiting++].depth = job.depth + 1;
        }
        bvh->node_count += 2;
    }
    bvh->cost = root_area > 0 ? (float)(cost / root_area) : (float)count;
}

static struct box box_of_triangle(const struct pen_bvh_triangle *t)
{
    struct box box;
    for (int c = 0; c < 3; c++) {
        float a = t->corner[c], b = a + t->edge1[c], d = a + t->edge2[c];
        box.low[c] = lesser(a, lesser(b, d));
        box.high[c] = greater(a, greater(b, d));
    }
    return box;
}

bool pen_bvh_build(const struct pen_bvh_triangle *triangles, uint32_t count, struct pen_bvh *bvh,
    struct pen_error *error)
{
    *bvh = (struct pen_bvh){.triangle_count = count};
    struct item *items = malloc(((size_t)count + 1) * sizeof *items);
    bvh->nodes = malloc((2 * (size_t)count + 1) * sizeof *bvh->nodes);
    bvh->triangles = malloc(((size_t)count + 1) * sizeof *bvh->triangles);
    if (!items || !bvh->nodes || !bvh->triangles) {
        free(items);
        pen_bvh_finish(bvh);
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    }
    for (uint32_t i = 0; i < count; i++) {
        const struct pen_bvh_triangle *t = &triangles[i];
        items[i] = (struct item){box_of_triangle(t), i};
    }
    build_nodes(items, count, bvh);
    for (uint32_t i = 0; i < count; i++)
        bvh->triangles[i] = triangles[items[i].triangle];
    free(items);
    struct pen_bvh_node *nodes = realloc(bvh->nodes, bvh->node_count * sizeof *nodes);
    bvh->nodes = nodes ? nodes : bvh->nodes;
    return true;
}

void pen_bvh_finish(struct pen_bvh *bvh)
{
    free(bvh->nodes);
    free(bvh->triangles);
    *bvh = (struct pen_bvh){0};
}

/* One world-space triangle of an instance. */
static struct pen_bvh_triangle make_triangle(
    const struct psc_scene *scene, uint32_t number, uint32_t first_index, bool alpha)
{
    const struct psc_instance *instance = &scene->instances[number];
    const struct psc_material *material =
        &scene->materials[scene->primitives[instance->primitive].material];
    struct pen_bvh_triangle t = {.instance = number, .first_index = first_index};
    float corner[3][3];
    for (int k = 0; k < 3; k++) {
        const float *p = scene->positions[scene->indices[first_index + (uint32_t)k]];
        const float *m = instance->world;
        for (int c = 0; c < 3; c++)
            corner[k][c] =
                m[4 * c] * p[0] + m[4 * c + 1] * p[1] + m[4 * c + 2] * p[2] + m[4 * c + 3];
    }
    bool swapped = instance->flags & PSC_MIRRORED;
    for (int c = 0; c < 3; c++) {
        t.corner[c] = corner[0][c];
        t.edge1[c] = corner[swapped ? 2 : 1][c] - corner[0][c];
        t.edge2[c] = corner[swapped ? 1 : 2][c] - corner[0][c];
    }
    t.flags = (swapped ? PEN_BVH_SWAPPED : 0u) |
              (material->flags & PSC_DOUBLE_SIDED ? PEN_BVH_TWO_SIDED : 0u) |
              (alpha ? PEN_BVH_ALPHA : 0u);
    return t;
}

/* All triangles of the instances that cast; `count` of them. NULL when memory is short. */
static struct pen_bvh_triangle *gather_triangles(
    const struct psc_scene *scene, const uint8_t *casters, uint64_t count)
{
    struct pen_bvh_triangle *triangles = malloc((count + 1) * sizeof *triangles);
    uint64_t next = 0;
    for (uint32_t i = 0; triangles && i < scene->instance_count; i++) {
        uint32_t number = scene->instances[i].primitive;
        const struct psc_primitive *p = &scene->primitives[number];
        bool alpha = casters[number] == TRACE_CASTS_BY_ALPHA;
        for (uint32_t k = 0; casters[number] != TRACE_CASTS_NOTHING && k + 2 < p->index_count;
             k += 3)
            triangles[next++] = make_triangle(scene, i, p->first_index + k, alpha);
    }
    return triangles;
}

bool pen_bvh_build_scene(const struct psc_scene *scene, uint64_t max_triangles, struct pen_bvh *bvh,
    struct pen_error *error)
{
    uint64_t count = 0, limit = max_triangles ? max_triangles : 1u << 26;
    uint8_t *casters = trace_casters(scene);
    *bvh = (struct pen_bvh){0};
    if (!casters)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        uint32_t number = scene->instances[i].primitive;
        if (casters[number] != TRACE_CASTS_NOTHING)
            count += scene->primitives[number].index_count / 3;
    }
    bool fits = count <= limit;
    struct pen_bvh_triangle *triangles = fits ? gather_triangles(scene, casters, count) : NULL;
    free(casters);
    if (!fits)
        return pen_fail(error, PEN_TOO_BIG, "/scene",
            "The scene has %llu triangles; %llu can be ray traced.", (unsigned long long)count,
            (unsigned long long)limit);
    if (!triangles)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    bool ok = pen_bvh_build(triangles, (uint32_t)count, bvh, error);
    free(triangles);
    return ok;
}

bool pen_bvh_refit(
    struct pen_bvh *bvh, const struct psc_scene *scene, const uint32_t *first_indices)
{
    double cost = 0;
    for (uint32_t i = 0; i < bvh->triangle_count; i++) {
        struct pen_bvh_triangle *t = &bvh->triangles[i];
        uint32_t first = first_indices ? first_indices[i] : t->first_index, kept = t->first_index;
        *t = make_triangle(scene, t->instance, first, (t->flags & PEN_BVH_ALPHA) != 0);
        t->first_index = kept;
    }
    for (uint32_t i = bvh->node_count; i-- > 0;) { /* children come after their parent */
        struct pen_bvh_node *node = &bvh->nodes[i];
        bool leaf = node->count > 0 || !bvh->triangle_count;
        struct box box = empty_box;
        for (uint32_t k = 0; k < (leaf ? node->count : 2); k++) {
            const struct pen_bvh_node *child = &bvh->nodes[node->first + k];
            struct box part;
            if (leaf)
                part = box_of_triangle(&bvh->triangles[node->first + k]);
            else {
                memcpy(part.low, child->low, sizeof part.low);
                memcpy(part.high, child->high, sizeof part.high);
            }
            grow(&box, &part);
        }
        memcpy(node->low, box.low, sizeof node->low);
        memcpy(node->high, box.high, sizeof node->high);
        cost += (double)half_area(&box) * (leaf ? node->count : (double)NODE_COST);
        if (i == 0 && half_area(&box) > 0)
            cost /= (double)half_area(&box);
    }
    return cost <= WORN_OUT * (double)bvh->cost;
}

/* Where the ray enters the node's box; infinite when it does not before `limit`. */
static float enter(
    const struct pen_bvh_node *node, const float origin[3], const float inverse[3], float limit)
{
    float near = 0, far = limit;
    for (int c = 0; c < 3; c++) {
        float a = (node->low[c] - origin[c]) * inverse[c];
        float b = (node->high[c] - origin[c]) * inverse[c];
        near = greater(near, lesser(a, b));
        far = lesser(far, greater(a, b));
    }
    return near <= far * 1.0000005f ? near : INFINITY; /* rounding must not lose a box */
}

static bool hits(const struct pen_bvh_triangle *t, bool front_only, const float origin[3],
    const float direction[3], float limit)
{
    float p[3], q[3], s[3];
    for (int c = 0; c < 3; c++) {
        int a = (c + 1) % 3, b = (c + 2) % 3;
        p[c] = direction[a] * t->edge2[b] - direction[b] * t->edge2[a];
        s[c] = origin[c] - t->corner[c];
    }
    for (int c = 0; c < 3; c++) {
        int a = (c + 1) % 3, b = (c + 2) % 3;
        q[c] = s[a] * t->edge1[b] - s[b] * t->edge1[a];
    }
    /* Moeller & Trumbore 1997: positive when the ray meets the front. */
    float determinant = t->edge1[0] * p[0] + t->edge1[1] * p[1] + t->edge1[2] * p[2];
    if (determinant == 0 || (front_only && determinant > 0 && !(t->flags & PEN_BVH_TWO_SIDED)))
        return false;
    float u = (s[0] * p[0] + s[1] * p[1] + s[2] * p[2]) / determinant;
    float v = (direction[0] * q[0] + direction[1] * q[1] + direction[2] * q[2]) / determinant;
    float at = (t->edge2[0] * q[0] + t->edge2[1] * q[1] + t->edge2[2] * q[2]) / determinant;
    return u >= 0 && v >= 0 && u + v <= 1 && at > 0 && at < limit;
}

bool pen_bvh_occluded(const struct pen_bvh *bvh, bool front_only, const float origin[3],
    const float direction[3], float limit)
{
    uint32_t stack[PEN_BVH_STACK], waiting = 0, at = 0;
    float inverse[3];
    for (int c = 0; c < 3; c++)
        inverse[c] =
            1 / (fabsf(direction[c]) > 1e-20f ? direction[c] : copysignf(1e-20f, direction[c]));
    if (isinf(enter(&bvh->nodes[0], origin, inverse, limit)))
        return false;
    for (;;) {
        const struct pen_bvh_node *node = &bvh->nodes[at];
        for (uint32_t i = 0; i < node->count; i++)
            if (hits(&bvh->triangles[node->first + i], front_only, origin, direction, limit))
                return true;
        if (node->count == 0 && bvh->triangle_count) {
            float left = enter(&bvh->nodes[node->first], origin, inverse, limit);
            float right = enter(&bvh->nodes[node->first + 1], origin, inverse, limit);
            at = node->first + (right < left);
            if (!isinf(left) && !isinf(right))
                stack[waiting++] = node->first + !(right < left);
            if (!isinf(left) || !isinf(right))
                continue;
        }
        if (waiting == 0)
            return false;
        at = stack[--waiting];
    }
}
