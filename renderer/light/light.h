/* Lights as the shadow methods see them: a light space per face, and the frustum of its map. */
#pragma once
#include "protocol/result.h"
#include "renderer/scene/scene.h"
#include "renderer/scene/view.h"

enum light_shape { LIGHT_RECT = 0, LIGHT_DISK = 1 };

/* One light space (docs/light-space.md): right-handed, origin in the centre of the emitter, +z
 * along the emission. The shadow map is the window `rect` of the plane z = near_z, in metres; for a
 * parallel light x and y of the map are x and y of light space. std140: uploaded as it is. */
struct light_face {
    mat4 world_to_light;
    mat4 clip_to_light; /* of the current view; set per frame */
    float rect[4];      /* xmin, ymin, xmax, ymax */
    float half[2];      /* half extents of the emitter, m; parallel: tan of half the diameter */
    float near_z, far_z;
    float emission_mean[4]; /* mean of the emission texture; white without one */
    int32_t shape;          /* enum light_shape: half is (radius, radius) for a disk */
    int32_t parallel;
    int32_t cube;     /* 1: a face of six, which only owns receivers with |x|, |y| <= z */
    int32_t textured; /* 1: an emission texture is bound */
    float cone_cos;   /* spot: cosine of the outer half angle; else -1 */
    int32_t omni;     /* 1: emits to all sides, so a receiver behind the plane z = 0 is lit too */
    float pad[2];
};

struct light {
    const struct pen_light *source;
    struct light_face faces[6];
    uint32_t face_count;
    float casters[2][3]; /* world bounds of what can cast a shadow in this light */
    /* For shading, world space: */
    float radiance[3]; /* emitted; point, spot: intensity, W sr^-1; sun: irradiance */
    float origin[3], x[3], y[3], z[3];
};

/* Lights of the request, else of the scene, else one that suits the bounds; writes what it chose
 * back to *request. Returns the number of lights. */
uint32_t lights_resolve(struct light lights[PEN_MAX_LIGHTS], struct pen_request *request,
    const struct scene *scene, struct pen_result *result);

/* Matrix from light space to the clip space of the face's map (0 <= z <= w, near first), seen from
 * the light point `sample` (x, y on the emitter) with window `rect`. */
void light_face_clip(
    const struct light_face *face, const float sample[2], const float rect[4], mat4 light_to_clip);

/* The window of the plane z = near_z through which `sample` sees all of `casters`. */
void light_face_window(
    const struct light_face *face, const float casters[2][3], const float sample[2], float rect[4]);

/* Marks the instances that cannot cast in this light: flat and on the far border of the bounds. */
void light_find_backdrops(const struct light *light, const struct scene *scene, bool *backdrop);

/* What a depth pass of this face culls with. */
void light_face_cull(const struct light_face *face, const float sample[2], const float rect[4],
    struct cull_view *cull);
