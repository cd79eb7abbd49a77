#include "renderer/scene/pick.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_TILES 256.0f /* in which one triangle is looked for; a larger one is drawn */
#define MARGIN 0.1f       /* tiles: more than a rasteriser rounds positions by */
#define BEHIND 0.998f     /* what is less than this behind something may be part of it */

struct pick_corner {
    float x, y, w; /* tiles; clip space, 0: before the near plane, below 0: not known yet */
};

static struct pick_corner project(
    const struct pick_tiles *tiles, const float world[12], const float at[3])
{
    const vec4 *m = tiles->world_to_clip;
    float p[3], clip[4];
    for (int i = 0; i < 3; i++)
        p[i] = world[4 * i] * at[0] + world[4 * i + 1] * at[1] + world[4 * i + 2] * at[2] +
               world[4 * i + 3];
    for (int i = 0; i < 4; i++)
        clip[i] = m[0][i] * p[0] + m[1][i] * p[1] + m[2][i] * p[2] + m[3][i];
    return (struct pick_corner){(0.5f + 0.5f * clip[0] / clip[3]) * tiles->across,
        (0.5f - 0.5f * clip[1] / clip[3]) * tiles->down, clip[3] > clip[2] ? clip[3] : 0};
}

/* near_z: depth is near_z / w. */
static bool is_wanted(const struct pick_tiles *tiles, const struct pick_corner c[3], float near_z)
{
    if (!(c[0].w > 0 && c[1].w > 0 && c[2].w > 0))
        return true; /* it is clipped */
    float left = fmaxf(fminf(c[0].x, fminf(c[1].x, c[2].x)) - MARGIN, 0);
    float right = fmaxf(c[0].x, fmaxf(c[1].x, c[2].x)) + MARGIN;
    float top = fmaxf(fminf(c[0].y, fminf(c[1].y, c[2].y)) - MARGIN, 0);
    float bottom = fmaxf(c[0].y, fmaxf(c[1].y, c[2].y)) + MARGIN;
    right = fminf(right, (float)tiles->width - 0.5f);
    bottom = fminf(bottom, (float)tiles->height - 0.5f);
    if (left > right || top > bottom)
        return false;
    uint32_t x0 = (uint32_t)left, x1 = (uint32_t)right, y0 = (uint32_t)top, y1 = (uint32_t)bottom;
    if ((right - left) * (bottom - top) > MOST_TILES)
        return true;
    float depth = near_z / fminf(c[0].w, fminf(c[1].w, c[2].w));
    for (uint32_t y = y0; y <= y1; y++)
        for (uint32_t x = x0; x <= x1; x++)
            if (depth >= BEHIND * tiles->farthest[(size_t)y * tiles->width + x])
                return true;
    return false;
}

void pick_triangles(const struct pick_tiles *tiles, const struct psc_scene *blob,
    struct cull_command *commands, uint32_t first, uint32_t *count, struct picked *picked)
{
    if (first == *count)
        return;
    uint32_t instance = commands[first].base_instance;
    const float *world = blob->instances[instance].world;
    const struct psc_primitive *primitive = &blob->primitives[blob->instances[instance].primitive];
    const float(*positions)[3] = blob->positions + primitive->first_vertex;
    size_t before = picked->count;
    picked->corners = pen_grow(
        picked->corners, &picked->corner_room, primitive->vertex_count, sizeof *picked->corners);
    for (uint32_t i = 0; i < primitive->vertex_count; i++)
        picked->corners[i].w = -1;
    for (uint32_t c = first; c < *count; c++) {
        const uint32_t *t = blob->indices + commands[c].first_index;
        picked->indices = pen_grow(picked->indices, &picked->room,
            picked->count + commands[c].count, sizeof *picked->indices);
        for (uint32_t i = 0; i < commands[c].count; i += 3) {
            struct pick_corner corners[3];
            for (int k = 0; k < 3; k++) {
                uint32_t vertex = t[i + k] - primitive->first_vertex;
                if (picked->corners[vertex].w < 0)
                    picked->corners[vertex] = project(tiles, world, positions[vertex]);
                corners[k] = picked->corners[vertex];
            }
            if (!is_wanted(tiles, corners, tiles->world_to_clip[3][2]))
                continue;
            memcpy(picked->indices + picked->count, t + i, 3 * sizeof *t);
            picked->count += 3;
        }
    }
    *count = first;
    if (picked->count > before)
        commands[(*count)++] = (struct cull_command){
            (uint32_t)(picked->count - before), 1, (uint32_t)before, 0, instance};
}

void pick_finish(struct picked *picked)
{
    free(picked->indices);
    free(picked->corners);
    memset(picked, 0, sizeof *picked);
}
