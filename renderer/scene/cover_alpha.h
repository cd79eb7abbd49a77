/* Alpha of a material on the CPU, as OpenGL's samplers give it. */
#pragma once
#include "renderer/blob/pscene.h"

struct cover_alpha {
    const struct psc_material *material;
    const struct psc_texture *texture; /* NULL: none */
    const struct psc_image *image;
    const uint8_t *texels;
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
bool cover_alpha_is_cut(const struct cover_alpha *alpha, const float at[3], float level);
