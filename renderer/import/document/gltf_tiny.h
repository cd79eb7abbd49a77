/* What tinygltf makes of a glTF document, as plain C. The text has passed imp_schema_check, so
 * numbers are finite and indices in range where the schema names them; everything that depends on
 * two properties together is still for the caller to check. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
#include "protocol/error.h"

struct gltf_accessor {
    int32_t view;        /* -1: zeros */
    uint32_t component;  /* GL's number: 5120 to 5126 */
    uint32_t components; /* 1 to 4; MAT4 16; 0: another matrix */
    bool normalized, sparse;
    uint64_t offset, count;
    uint64_t sparse_count, sparse_index_offset, sparse_value_offset;
    uint32_t sparse_index_component;
    int32_t sparse_index_view, sparse_value_view;
};

#define GLTF_UV_SETS 8

struct gltf_primitive {
    uint32_t mode; /* 0 points to 6 triangle fan */
    int32_t indices, material;
    uint32_t first_mapping, mapping_count;
    int32_t position, normal, tangent, color; /* accessors; -1: none */
    int32_t uv[GLTF_UV_SETS];
    int32_t joints[2], weights[2];
    uint32_t first_target, target_count;
};

struct gltf_target {
    int32_t position, normal, tangent; /* accessors; -1: none */
};

/* KHR_materials_variants: what the primitive is made of in a variant. */
struct gltf_mapping {
    uint32_t variant;
    int32_t material;
};

struct gltf_mesh {
    uint32_t first_primitive, primitive_count;
    uint32_t first_weight, weight_count; /* of morph targets; 0: not told */
};

struct gltf_node {
    bool has_matrix;
    double matrix[16]; /* column-major */
    double translation[3];
    float rotation[4], scale[3];
    int32_t mesh, camera, light, area_light, skin;
    int32_t instance_translation, instance_rotation, instance_scale; /* accessors */
    bool instanced;                                                  /* EXT_mesh_gpu_instancing */
    bool hidden;                                                     /* KHR_node_visibility */
    uint32_t first_child, child_count;
    uint32_t first_weight, weight_count; /* 0: the mesh's */
    const char *name;
};

struct gltf_texture_info {
    int32_t texture; /* -1: none */
    uint32_t uv_set;
    float offset[2], rotation, scale[2];
};

struct gltf_material {
    float base_color[4], emissive[3], emissive_strength, metallic, roughness;
    float specular[3], glossiness; /* F0; else KHR_materials_specular's colour */
    float specular_strength, ior;
    float transmission; /* of all of it: 0 where a texture says where */
    float normal_scale, occlusion_strength, alpha_cutoff;
    const char *alpha_mode; /* a literal: "OPAQUE", "MASK", "BLEND" or "" */
    bool double_sided, unlit, specular_glossiness;
    struct gltf_texture_info base, surface, normal, occlusion, emission;
};

#define GLTF_TEXTURE_SOURCES 5

struct gltf_texture {
    int32_t images[GLTF_TEXTURE_SOURCES]; /* the best first, the plain source last; -1: none */
    int32_t sampler;
};

struct gltf_sampler {
    int32_t mag_filter, min_filter; /* -1: not told */
    int32_t wrap_s, wrap_t;
};

struct gltf_camera {
    bool perspective;
    float fov_y; /* rad */
    float y_mag, z_near, z_far;
    const char *name;
};

enum gltf_light_type {
    GLTF_LIGHT_UNKNOWN,
    GLTF_LIGHT_DIRECTIONAL,
    GLTF_LIGHT_POINT,
    GLTF_LIGHT_SPOT,
    GLTF_LIGHT_RECT,
    GLTF_LIGHT_DISK,
};

struct gltf_light {
    enum gltf_light_type type;
    float color[3], intensity;    /* cd, lux or nits */
    float inner_cone, outer_cone; /* rad */
    float size, aspect;
    const char *name;
};

struct gltf_model {
    const struct gltf_accessor *accessors;
    const struct gltf_primitive *primitives;
    const struct gltf_mesh *meshes;
    const struct gltf_node *nodes;
    const int32_t *children;
    const struct gltf_target *targets;
    const float *weights;
    const struct gltf_material *materials;
    const struct gltf_texture *textures;
    const struct gltf_sampler *samplers;
    const struct gltf_camera *cameras;
    const struct gltf_light *lights, *area_lights;
    uint32_t accessor_count, primitive_count, mesh_count, node_count, material_count, texture_count,
        sampler_count, camera_count, light_count, area_light_count;
    const struct gltf_mapping *mappings;
    const char *const *variants; /* their names */
    uint32_t mapping_count, variant_count;
    const int32_t *roots; /* nodes of the scene that is shown */
    uint32_t root_count, scene_count, scene;
    void *owner;
};

/* Fills *model, to be given back to gltf_tiny_free; on failure it is empty. No exception leaves.
 * Errors: PEN_INVALID with tinygltf's words, PEN_TOO_BIG when memory runs out. */
bool gltf_tiny_parse(
    const char *text, size_t bytes, struct gltf_model *model, struct pen_error *error);
void gltf_tiny_free(struct gltf_model *model);

#ifdef __cplusplus
}
#endif
