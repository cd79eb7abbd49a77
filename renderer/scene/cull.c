#include "renderer/scene/cull.h"
#include <cglm/cglm.h>

/* Work, in pixels, beyond those that are covered. */
#define INSTANCE_WORK 16
#define MESHLET_WORK 1
#define TRIANGLE_WORK 32
#define COMMAND_WORK 256
/* So much is worth a closer look at each triangle. */
#define CLOSE_WORK (1u << 16)
#define CLOSE_TRIANGLE_WORK 64

/* Tests run in object space: planes and eye are brought there once per instance, and whether a
 * triangle faces a point does not change under an affine map (a mirroring one swaps it). */
struct object_view {
    vec4 planes[6];
    mat4 clip;     /* rows: a point's coordinates in clip space */
    float w_slope; /* how fast w changes at most */
    vec3 eye;
    bool cone;
};

static void object_matrix(const float world[12], mat4 m)
{
    glm_mat4_identity(m);
    for (int row = 0; row < 3; row++)
        for (int column = 0; column < 4; column++)
            m[column][row] = world[4 * row + column];
}

static void to_object(const struct cull_view *view, const struct psc_instance *instance,
    bool cull_back, struct object_view *out)
{
    mat4 world, clip, inverse;
    object_matrix(instance->world, world);
    glm_mat4_mul((vec4 *)view->world_to_clip, world, clip);
    for (int column = 0; column < 4; column++) {
        float x = clip[column][0], y = clip[column][1], z = clip[column][2], w = clip[column][3];
        out->planes[0][column] = w + x;
        out->planes[1][column] = w - x;
        out->planes[2][column] = w + y;
        out->planes[3][column] = w - y;
        out->planes[4][column] = z;
        out->planes[5][column] = w - z;
        for (int row = 0; row < 4; row++)
            out->clip[row][column] = clip[column][row];
    }
    out->w_slope = glm_vec3_norm(out->clip[3]);
    for (int i = 0; i < 6; i++) {
        float length = glm_vec3_norm(out->planes[i]);
        glm_vec4_scale(out->planes[i], length > 0 ? 1 / length : 1, out->planes[i]);
    }
    out->cone =
        cull_back && !(instance->flags & PSC_MIRRORED) && fabsf(glm_mat4_det(world)) > 1e-30f;
    if (!out->cone)
        return;
    glm_mat4_inv(world, inverse);
    glm_mat4_mulv3(inverse, (float *)view->eye, view->parallel ? 0 : 1, out->eye);
    if (view->parallel)
        glm_vec3_normalize(out->eye);
}

static float distance(const vec4 plane, const float at[3])
{
    return plane[0] * at[0] + plane[1] * at[1] + plane[2] * at[2] + plane[3];
}

static bool is_visible(
    const struct object_view *view, bool parallel, const struct psc_meshlet *meshlet)
{
    const float *c = meshlet->center;
    for (int i = 0; i < 6; i++)
        if (distance(view->planes[i], c) < -meshlet->radius)
            return false;
    if (!view->cone || meshlet->cone_cutoff > 1)
        return true;
    const float *axis = meshlet->cone_axis;
    if (parallel)
        return view->eye[0] * axis[0] + view->eye[1] * axis[1] + view->eye[2] * axis[2] <
               meshlet->cone_cutoff;
    float d[3] = {c[0] - view->eye[0], c[1] - view->eye[1], c[2] - view->eye[2]};
    float length = sqrtf(d[0] * d[0] + d[1] * d[1] + d[2] * d[2]);
    return d[0] * axis[0] + d[1] * axis[1] + d[2] * axis[2] <
           meshlet->cone_cutoff * length + meshlet->radius;
}

static float area_of(const struct psc_scene *blob, const struct psc_meshlet *meshlet)
{
    const uint32_t *t = blob->indices + meshlet->first_index;
    float sum = 0;
    for (uint32_t i = 0; i < meshlet->index_count; i += 3) {
        const float *corners[3] = {
            blob->positions[t[i]], blob->positions[t[i + 1]], blob->positions[t[i + 2]]};
        vec3 edges[2], normal;
        for (int k = 0; k < 3; k++) {
            edges[0][k] = corners[1][k] - corners[0][k];
            edges[1][k] = corners[2][k] - corners[0][k];
        }
        glm_vec3_cross(edges[0], edges[1], normal);
        sum += 0.5f * glm_vec3_norm(normal);
    }
    return sum;
}

/* The share of the view between two opposite planes that a sphere's shadow on it takes. */
static double share(const vec4 a, const vec4 b, const struct psc_meshlet *meshlet)
{
    float from = distance(a, meshlet->center), to = distance(b, meshlet->center);
    double taken = fmin(from, meshlet->radius) + fmin(to, meshlet->radius);
    double all = (double)from + to;
    return taken >= 0 && taken < all ? taken / all : 1;
}

/* The views that a meshlet's triangles cover at most, one over the other. */
static double cover(const struct object_view *view, const struct psc_meshlet *meshlet, float area)
{
    const vec4 *p = view->planes;
    /* No triangle covers more than half of a rectangle around it. */
    double all =
        meshlet->index_count / 6.0 * share(p[0], p[1], meshlet) * share(p[2], p[3], meshlet);
    double w = distance(view->clip[3], meshlet->center);
    double near_w = w - view->w_slope * meshlet->radius;
    if (!(near_w > 0))
        return all;
    const float *c = meshlet->center;
    double width = (double)distance(p[0], c) + distance(p[1], c);
    double height = (double)distance(p[2], c) + distance(p[3], c);
    double flat = area / (width * height) * (w / near_w) * (w / near_w);
    return flat >= 0 && flat < all ? flat : all;
}

/* As cover, of one triangle and more closely. */
static double cover_triangle(
    const struct object_view *view, const struct psc_scene *blob, const uint32_t *corners)
{
    double at[3][2], size = 1;
    for (int i = 0; i < 3; i++) {
        const float *position = blob->positions[corners[i]];
        double w = distance(view->clip[3], position);
        if (!(w > 0))
            return 1;
        for (int k = 0; k < 2; k++)
            at[i][k] = distance(view->clip[k], position) / w;
    }
    for (int k = 0; k < 2; k++) {
        double from = fmin(at[0][k], fmin(at[1][k], at[2][k]));
        double to = fmax(at[0][k], fmax(at[1][k], at[2][k]));
        size *= fmax(fmin(to, 1) - fmax(from, -1), 0);
    }
    double cross = (at[1][0] - at[0][0]) * (at[2][1] - at[0][1]) -
                   (at[1][1] - at[0][1]) * (at[2][0] - at[0][0]);
    return fmin(size, 0.5 * fabs(cross)) / 4;
}

/* Takes of a meshlet what the piece may still cost, one triangle at least; returns the indices. */
static uint32_t take(const struct object_view *view, const struct psc_meshlet *meshlet,
    uint32_t number, struct cull_list *list, struct cull_piece *piece)
{
    if (list->areas[number] < 0)
        list->areas[number] = area_of(list->blob, meshlet);
    double pixels = piece->pixels * list->weight;
    double all = cover(view, meshlet, list->areas[number]) * pixels;
    uint32_t left = meshlet->index_count - piece->index, taken = 0;
    if (all < CLOSE_WORK) {
        piece->work += all + left / 3 * TRIANGLE_WORK;
        return left;
    }
    const uint32_t *corners = &list->blob->indices[meshlet->first_index + piece->index];
    for (; taken < left && (!taken || piece->work < piece->most); taken += 3)
        piece->work +=
            cover_triangle(view, list->blob, corners + taken) * pixels + CLOSE_TRIANGLE_WORK;
    return taken;
}

uint64_t cull_instance(const struct cull_view *view, uint32_t instance, bool cull_back,
    struct cull_list *list, struct cull_piece *piece)
{
    const struct psc_scene *blob = list->blob;
    const struct psc_primitive *primitive = &blob->primitives[blob->instances[instance].primitive];
    struct object_view object;
    piece->more = piece->work >= piece->most;
    if (piece->more)
        return 0;
    to_object(view, &blob->instances[instance], cull_back, &object);
    piece->work += INSTANCE_WORK;
    uint64_t indices = 0;
    struct cull_command *run = NULL;
    for (; piece->meshlet < primitive->meshlet_count; piece->meshlet++, piece->index = 0) {
        uint32_t number = primitive->first_meshlet + piece->meshlet;
        const struct psc_meshlet *meshlet = &blob->meshlets[number];
        piece->more = (indices && piece->work >= piece->most) || list->count == list->room;
        if (piece->more)
            return indices / 3;
        piece->work += MESHLET_WORK;
        if (!is_visible(&object, view->parallel, meshlet))
            continue;
        uint32_t first = meshlet->first_index + piece->index;
        uint32_t n = take(&object, meshlet, number, list, piece);
        indices += n;
        if (run && run->first_index + run->count == first) {
            run->count += n;
        } else {
            run = &list->commands[list->count++];
            *run = (struct cull_command){n, 1, first, 0, instance};
            piece->work += COMMAND_WORK;
        }
        piece->more = n < meshlet->index_count - piece->index;
        if (piece->more) {
            piece->index += n;
            return indices / 3;
        }
    }
    piece->meshlet = 0;
    return indices / 3;
}
