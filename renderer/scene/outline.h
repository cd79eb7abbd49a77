/* A few points that stand for a scene where all of its vertices would be too many: to frame it, and
 * to measure the light that falls on it. */
#pragma once
#include "renderer/blob/pscene.h"

#define OUTLINE_DIRECTIONS 146
#define OUTLINE_SAMPLES 192

/* World: the vertices farthest along as many directions. */
struct outline {
    float extremes[OUTLINE_DIRECTIONS][3], along[OUTLINE_DIRECTIONS];
    uint32_t extreme_count; /* all, or 0 */
};

/* Spread evenly over the area; normals are unit length, towards the front. */
struct outline_samples {
    struct {
        float point[3], normal[3];
        /* In the brightest channel, of a texture the mean: radiance of its own, base colour. */
        float glow, albedo;
        bool one_sided; /* not seen from behind */
    } at[OUTLINE_SAMPLES];
    uint32_t count;
};

/* By what of the scene lies inside the world bounds `content`, moved by `shift`; a zeroed outline is
 * empty. */
void outline_grow(struct outline *outline, const struct psc_scene *scene, const float (*content)[3],
    const float shift[3]);
void outline_sample(struct outline_samples *samples, const struct psc_scene *scene,
    const float (*content)[3], const float shift[3]);
