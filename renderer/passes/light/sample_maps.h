/* Depth maps seen from points of the emitter, as layers of an array: parallel frusta through the
 * same plane, each with the window that fits its casters. */
#pragma once
#include "renderer/technique.h"

#define SHARED_ROWS "renderer/shaders/light/sample_map.def"
#include "renderer/shared/rows_c.h"

struct sample_point {
    float at[2]; /* emitter coordinates, m (parallel: tangents) */
    float uv[2]; /* the same in [-1, 1]^2 */
};

/* The point of the face's emitter that (u, v) in [-1, 1]^2 stands for; a disk by the concentric map
 * of Shirley and Chiu 1997, which keeps areas. */
struct sample_point sample_point_at(const struct light_face *face, float u, float v);

/* Points [first, first + count) of a sequence over the face's emitter of which every beginning is
 * well spread: what is there after some of them is a picture, and more only add to them. */
void sample_sequence(
    const struct light_face *face, uint32_t first, uint32_t count, struct sample_point *points);

/* `count` points of the Hammersley set (radical inverse in base 2) over the face's emitter. */
void sample_points(const struct light_face *face, uint32_t count, struct sample_point *points);

struct sample_map sample_map_entry(
    const struct sample_point *point, const float rect[4], uint32_t layer);

/* What sample_lit_box compares: a texel, four, or more. Only that changes the shader. */
static inline const char *sample_map_kernel(uint32_t side)
{
    return side == 1 ? "#define KERNEL_SINGLE\n" : side == 2 ? "#define KERNEL_BILINEAR\n" : "";
}

/* Draws the casters seen from point[0 .. count) through rect[i] into layer[i] of a D32F array. */
struct sample_view {
    struct sample_point point;
    float rect[4];
    uint32_t layer;
};
bool pass_sample_views(struct technique_run *run, const struct sample_view *views, uint32_t count,
    const struct gl_texture *array, struct pen_error *error);

/* The maps of points[0 .. count), count <= SAMPLE_MAP_BATCH, size x size, D32F layers of
 * (*maps)->textures[0]. Kept between requests when `keep`, and found again by their points, else in
 * scratch memory that the next call reuses. Fills table[count]. */
bool pass_sample_maps(struct technique_run *run, const struct sample_point *points, uint32_t count,
    uint32_t size, bool keep, struct sample_map *table, const struct gl_texture **maps,
    struct pen_error *error);

/* A kept array with room for points[0 .. count) that is drawn as it is asked for: after the call
 * the layers whose bit is set in `wanted` are there. Layer i shows points[i]. */
const struct gl_texture *pass_sample_page(struct technique_run *run,
    const struct sample_point *points, uint32_t count, uint32_t size, uint32_t wanted,
    struct pen_error *error);
