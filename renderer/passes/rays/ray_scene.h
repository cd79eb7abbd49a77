/* A scene as shaders trace it: storage buffers with the hierarchy and the alpha textures, built
 * when first needed and kept with the scene until it leaves the GPU. */
#pragma once
#include "renderer/technique.h"
#include "renderer/trace/bvh.h"

/* Binding points of all that is about rays. */
#define SHARED_ROWS "renderer/shaders/rays/rays.def"
#include "renderer/shared/rows_c.h"

struct ray_scene {
    struct scene_attachment attachment;
    GLuint nodes, triangles;             /* ray_bvh.glsl */
    GLuint alpha_triangles, alpha_words; /* ray_alpha.glsl; 0 without alpha */
    uint32_t node_count;                 /* 0: nothing casts */
    float extent;                        /* largest absolute coordinate, m */
    uint32_t moved, remade;              /* the scene's, when it was last made to fit */
    struct pen_bvh bvh;                  /* of a scene that moves, to be refitted; else empty */
    uint32_t *first_indices;             /* of its triangles in PSC_INDICES */
};

/* Its memory counts as the scene's. Errors: PEN_TOO_BIG when it does not fit the budget or a
 * storage buffer of this device, PEN_INTERNAL. */
const struct ray_scene *ray_scene_get(struct technique_run *run, struct pen_error *error);
void ray_scene_bind(const struct ray_scene *scene);
