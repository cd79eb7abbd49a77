/* Smooth edges on the CPU: what edge_tiles.frag and edges.frag do, of those pixels alone that need
 * it, in rows of a picture that has been read. */
#pragma once
#include "renderer/picture.h"
#include "renderer/edges/cover.h"
#include "renderer/scene/view.h"

#define EDGE_MARGIN 4 /* px, to either side of a row of depths */

/* Of one kind of surface; rows begin above the first one. */
struct edge_surface {
    float *depths;              /* edge_stride() apart, the first one at EDGE_MARGIN */
    uint16_t (*normals)[4];     /* as the G-buffer's, width apart */
    const cover_places *places; /* of each slot's pixels */
};

struct edge_rows {
    const struct view *view;
    float focal;          /* px */
    uint32_t first, rows; /* of the picture; whole tiles, but for the last ones */
    struct edge_surface solid, front;
    float *nearest;        /* depths of both; without surfaces in front, those of what is solid */
    bool layered;          /* there are surfaces in front */
    bool raw;              /* the picture is of radiance */
    const uint8_t *before; /* the picture's rows, from the one above the first on */
    struct pen_plane *plane;
};

uint32_t edge_stride(uint32_t width);
/* After the depths of the picture's rows are there: what lies around them. */
void edge_pad(const struct edge_rows *e, float *depths);
/* Fills the tiles of the rows with what this picture shows edges in or, `all`, any that there is of what was
 * drawn. Returns how many slots they have: one each where places are wanted. */
uint32_t edge_find(const struct edge_rows *e, bool all, struct cover_tile *tiles);
/* Before anything is drawn: at each place, and of each pixel, what has to be nearer. */
void edge_begin(
    const struct edge_rows *e, struct cover_tile *tiles, cover_places *places, float *leasts);
/* Of `all` tiles what this picture shows. */
void edge_choose(const struct edge_rows *e, const struct cover_tile *all, struct cover_tile *tiles);
/* Rows of the picture, whole tiles but for the last ones. */
void edge_blend(const struct edge_rows *e, struct cover_tile *tiles, uint32_t first, uint32_t end);
/* Bytes of a pixel. */
uint32_t edge_pixel_bytes(const struct pen_plane *plane);
