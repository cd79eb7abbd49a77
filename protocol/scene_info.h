/* What is told about a stored scene or image, without its geometry. */
#pragma once
#include "protocol/request.h"

struct pen_scene_camera {
    double eye[3], target[3]; /* m, world */
    float up[3];
    float fov_y_deg;
    char name[60];
};

struct pen_scene_light {
    struct pen_light light; /* world space */
    char name[60];
};

struct pen_scene_animation {
    float duration_s;
    char name[PEN_NAME_BYTES]; /* "" when it has none */
};

struct pen_scene_variant {
    char name[PEN_NAME_BYTES]; /* "" when it has none */
};

struct pen_scene_info { /* borrows its arrays */
    uint8_t id[PEN_ID_BYTES];
    uint64_t source_bytes; /* uploaded */
    uint64_t blob_bytes;   /* in the store */
    uint64_t gpu_bytes;    /* in GPU memory when resident */
    int64_t stored_unix_s; /* when it was uploaded; 0: not known */
    uint32_t resident;     /* 1: in GPU memory now */
    uint32_t vertices, primitives, instances, materials, textures, images;
    uint64_t triangles;                  /* over all instances */
    double bounds_min[3], bounds_max[3]; /* m, world; min > max: no geometry */
    uint32_t camera_count, light_count, animation_count, variant_count;
    const struct pen_scene_camera *cameras;
    const struct pen_scene_light *lights;
    const struct pen_scene_animation *animations;
    const struct pen_scene_variant *variants;
    const char *warnings; /* each ended by NUL, one after the other */
    size_t warning_bytes;
};

struct pen_image_info { /* an emission image */
    uint8_t id[PEN_ID_BYTES];
    uint64_t source_bytes, blob_bytes;
    int64_t stored_unix_s;
    uint32_t width, height; /* px */
};
