/* What a picture of a scene is about, where nobody says it: all but the setting that it stands in. */
#pragma once
#include "renderer/blob/pscene.h"

struct content {
    float box[2][3]; /* world bounds; min > max: there is nothing */
    float floor;     /* what it stands on, m */
    bool apart;      /* not everything lies above the floor, and does not count */
};

/* Left out are floors (what lies flat at the bottom, or below `ground`, where others stand at other
 * moments; slabs that are wide beside what stands on them), skies (shells around all the rest that are
 * seen from inside) and, where a scene consists of specks far apart, all but those around the largest.
 * `instance_bounds`: world. */
void content_find(const struct psc_scene *scene, const float (*instance_bounds)[2][3], float ground,
    struct content *content);
