/* Lights as the shadow methods see them: a light space per face, and the frustum of its map. */
#pragma once
#include "protocol/result.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/view.h"

/* struct light_face, one light space: uploaded as it is. */
#define SHARED_ROWS "renderer/shaders/light/light.def"
#include "renderer/shared/rows_c.h"

struct light {
    const struct pen_light *source;
    struct light_face faces[6];
    uint32_t face_count;
    float within[2][3];  /* what lies outside neither casts nor receives what is seen */
    float casters[2][3]; /* world bounds of what can cast a shadow that is seen */
    /* For shading, world space: */
    float radiance[3]; /* emitted; point, spot: intensity, W sr^-1; sun: irradiance */
    float origin[3], x[3], y[3], z[3];
};

/* Lights of the request, else of the scene, else one that suits the content and the view; writes
 * what it chose back to *request. Returns the number of lights. */
uint32_t lights_resolve(struct light lights[PEN_MAX_LIGHTS], struct pen_request *request,
    const struct scene *scene, const struct view *view, struct pen_result *result);

/* The scene has lights of its own, and one of them gives light at some moment of its stage. */
bool lights_shine(const struct scene *scene);

/* Only `source`, `radiance`, `origin` and, where it has a direction, `z`. */
void light_emission(struct light *light, const struct pen_light *source, const struct scene *scene);

/* Matrix from light space to the clip space of the face's map (0 <= z <= w, near first), seen from
 * the light point `sample` (x, y on the emitter) with window `rect`. */
void light_face_clip(
    const struct light_face *face, const float sample[2], const float rect[4], mat4 light_to_clip);

/* The window of the plane z = near_z through which `sample` sees all of `casters`. */
void light_face_window(
    const struct light_face *face, const float casters[2][3], const float sample[2], float rect[4]);

/* Marks the instances that cannot cast in this light: flat and on the far border of the bounds. */
void light_find_backdrops(const struct light *light, const struct scene *scene, bool *backdrop);

/* The view of a depth pass of this face; which faces it culls is the caller's to say. */
void light_face_cull(const struct light_face *face, const float sample[2], const float rect[4],
    struct cull_view *cull);
