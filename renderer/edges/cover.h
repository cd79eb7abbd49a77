/* Depths at several places of some pixels, drawn by the CPU. Software rasterisers take longer for
 * each triangle, and for all the pixels of which nobody asks. */
#pragma once
#include "renderer/edges/cover_alpha.h"
#include "renderer/scene/scene.h"

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
    uint32_t width, height;         /* of the picture */
    uint32_t first, rows;           /* that are drawn */
    const struct cover_tile *tiles; /* of the whole picture */
    /* COVER_PIXELS per slot. To begin with what is wanted must be nearer than; what is not may stay. */
    cover_places *depths;
};

struct cover_scene {
    bool blended;    /* BLEND materials alone */
    float threshold; /* of their alpha: what has more is there */
};

/* One piece of it, as scene_draw() does; `view` may leave out what is not in the rows. */
void cover_scene(struct scene *scene, const struct cull_view *view, const struct cover_scene *what,
    const struct cover *cover, struct cull_piece *piece);
/* A triangle of world space. */
void cover_one_triangle(const float (*corners)[3], const struct cover *cover);
