/* Alpha of a material on the CPU, as OpenGL's samplers give it. */
#pragma once
#include "renderer/blob/pscene.h"

enum { COVER_PLACES = 4, COVER_LEVELS = 16 };
typedef float cover_places __attribute__((vector_size(4 * COVER_PLACES)));
typedef int32_t cover_bits __attribute__((vector_size(4 * COVER_PLACES))); /* 0 or -1 each */

struct cover_level {
    const uint8_t *texels;
    int32_t width, height;
};

struct cover_alpha {
    const struct psc_material *material;
    const struct psc_texture *texture; /* NULL: none */
    uint32_t last;                     /* level */
    struct cover_level levels[COVER_LEVELS];
    float threshold; /* of blended materials */
};

void cover_alpha_begin(
    struct cover_alpha *alpha, const struct psc_scene *scene, uint32_t material, float threshold);
/* Texture coordinates and alpha of a vertex. */
void cover_alpha_vertex(
    const struct cover_alpha *alpha, const struct psc_attributes *vertex, float at[3]);
/* Level of detail; across, down: how the coordinates change per pixel. */
float cover_alpha_level(
    const struct cover_alpha *alpha, const float across[2], const float down[2]);
/* Leaves of some places those whose alpha is not cut; at: there, as of a vertex. */
cover_bits cover_alpha_cut(
    const struct cover_alpha *alpha, const cover_places at[3], float level, cover_bits which);
