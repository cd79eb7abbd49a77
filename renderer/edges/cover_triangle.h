/* One triangle, into the places of tiles. The depths that are left do not depend on the order of
 * triangles. */
#pragma once
#include "renderer/edges/cover_alpha.h"
#include <cglm/types.h>
#include <stddef.h>

enum { COVER_TILE = 4, COVER_PIXELS = COVER_TILE * COVER_TILE };

/* Of the places, from a pixel's centre, px: as standard multisampling has them. */
extern const cover_places cover_across, cover_down;

/* COVER_TILE x COVER_TILE pixels. */
struct cover_tile {
    float farthest;  /* what is wanted there is nearer */
    uint32_t pixels; /* that are: a bit each, row by row */
    uint32_t slot;   /* where its places are */
};

struct cover {
    mat4 world_to_clip;
    uint32_t width, height;   /* of the picture */
    uint32_t first, rows;     /* that are drawn */
    struct cover_tile *tiles; /* of the whole picture */
    /* COVER_PIXELS per slot. To begin with what is wanted must be nearer than; what is not may stay. */
    cover_places *depths;
    float *least; /* COVER_PIXELS per slot: the farthest of each pixel's depths */
};

struct cover_corner {
    float x, y, z; /* px, of the picture; depth. Not known yet: z is below 0; to be clipped: 2 */
    float at[3];   /* cover_alpha_vertex() */
};

struct cover_drawing {
    const struct cover_alpha *alpha; /* NULL: no holes */
    bool cull_back, mirrored;
};

/* The pixels that a triangle may touch, of those that are drawn. */
struct cover_box {
    uint32_t x0, x1, y0, y1;
    float nearest;
};

/* Whether any of them is wanted and not hidden yet; else *box need not be filled. */
bool cover_may_show(
    const struct cover *cover, const struct cover_corner c[3], struct cover_box *box);
/* Only in rows that no other thread draws in; `box` as of all that may show it. */
void cover_draw(const struct cover *cover, const struct cover_drawing *d,
    const struct cover_corner c[3], const struct cover_box *box);
