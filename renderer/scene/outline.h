/* A few points that stand for a scene where all of its vertices would be too many: to frame it, and
 * to measure the light that falls on it. */
#pragma once
#include "renderer/blob/pscene.h"

#define OUTLINE_DIRECTIONS 146
#define OUTLINE_SAMPLES 192

struct outline {
    float extremes[OUTLINE_DIRECTIONS]
                  [3]; /* world: the vertices farthest along as many directions */
    uint32_t extreme_count;
    struct {
        float point[3],
            normal[3];          /* world; the normal is unit length, its sign that of the winding */
    } samples[OUTLINE_SAMPLES]; /* spread evenly over the area */
    uint32_t sample_count;
};

/* Of what of the scene lies inside the world bounds `content`. */
void outline_make(
    struct outline *outline, const struct psc_scene *scene, const float (*content)[3]);
