/* What can cast a shadow that the picture shows, and so has to be in a light's maps. */
#pragma once
#include "renderer/scene/view.h"

/* Of a light, world space. */
struct caster_light {
    const float *origin;
    const float *sun; /* NULL, or the direction of its light and two unit axes across */
    const float *across[2];
    float extent; /* of its emitter, m; sun: tangent of half its angle */
};

/* A flat floor or wall on the far side of the bounds has everything else between itself and the
 * light: it receives, but it casts on nothing, and need not widen the map's window. */
bool casters_is_backdrop(const struct scene *scene, const float min[3], const float max[3],
    const struct caster_light *light);

/* World bounds of what casts. They do not depend on the view, so that maps can be kept while it moves, unless
 * what it shows is small beside them. Emitters with an extent are judged by their centre where a
 * backdrop is concerned, which is enough: it lies on the border of all geometry.
 * within: what lies outside of it neither casts nor receives what is seen. */
void casters_bounds(const struct scene *scene, const struct view *view, bool ground,
    const struct caster_light *light, float bounds[2][3], float within[2][3]);
bool casters_overlap(const float a[2][3], const float b[2][3]); /* of two boxes */
