/* Depths at several places of some pixels, drawn by the CPU. Software rasterisers take longer for
 * each triangle, and for all the pixels of which nobody asks. */
#pragma once
#include "renderer/edges/cover_triangle.h"
#include "renderer/scene/scene.h"

struct cover_scene {
    bool blended;    /* BLEND materials alone */
    float threshold; /* of their alpha: what has more is there */
};

/* One piece of it, as scene_draw() does; `view` may leave out what is not in the rows. */
void cover_scene(struct scene *scene, const struct cull_view *view, const struct cover_scene *what,
    const struct cover *cover, struct cull_piece *piece);
/* A triangle of world space. */
void cover_one_triangle(const float (*corners)[3], const struct cover *cover);
