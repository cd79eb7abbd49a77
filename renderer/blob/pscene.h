/* The scene blob (.pscene): one flat, versioned, mmap-able file per scene. The importer writes it
 * once; every reader maps it and checks it with psc_open before touching an offset.
 * All numbers are little-endian; sections start on 64-byte boundaries; all floats are finite. */
#pragma once
#include "protocol/request.h"
#include "renderer/blob/motion.h"
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>

#define PSC_MAGIC "PSCENE\r\n"
#define PSC_VERSION 8u
#define PSC_MESHLET_TRIANGLES 128u /* at most, per meshlet */

enum psc_section_id {
    PSC_POSITIONS,  /* float[3], m, object space */
    PSC_ATTRIBUTES, /* struct psc_attributes, one per position */
    PSC_INDICES,    /* uint32_t, absolute vertex numbers, counter-clockwise front faces */
    PSC_MESHLETS,   /* struct psc_meshlet: contiguous runs of PSC_INDICES */
    PSC_PRIMITIVES, /* struct psc_primitive */
    PSC_INSTANCES,  /* struct psc_instance */
    PSC_MATERIALS,  /* struct psc_material; at least one */
    PSC_TEXTURES,   /* struct psc_texture */
    PSC_IMAGES,     /* struct psc_image */
    PSC_TEXELS,     /* bytes: RGBA8, all levels of all images, top row first */
    PSC_LIGHTS,     /* struct psc_light */
    PSC_CAMERAS,    /* struct psc_camera */
    PSC_WARNINGS,   /* char: import warnings, each ended by NUL */
#define X(id, name, type) PSC_##id, /* motion.h */
    PSC_MOTION_SECTIONS(X)
#undef X
        PSC_SECTIONS
};

struct psc_section {
    uint64_t offset; /* bytes from the start of the file */
    uint64_t bytes;
};

struct psc_header {
    char magic[8];
    uint32_t version;
    uint32_t header_bytes; /* sizeof(struct psc_header) */
    uint64_t file_bytes;
    uint8_t source[PEN_ID_BYTES]; /* SHA-256 of the uploaded bytes */
    double origin[3]; /* of the world that the blob speaks of, in the file's; 0 unless the scene is
                         far from the file's origin. Lights and cameras are in the file's. */
    float bounds_min[3]; /* over all instances; min > max: no geometry */
    float bounds_max[3];
    float extent_min[3]; /* the same of what was uploaded: points and lines without thickness */
    float extent_max[3];
    uint64_t triangles; /* over all instances that are not hidden, as are the bounds */
    uint64_t reserved;
    struct psc_section sections[PSC_SECTIONS];
};

struct psc_attributes {
    int16_t normal[4];  /* snorm xyz, unit; w 0 */
    int16_t tangent[4]; /* snorm xyz, unit or 0, not always across the normal; w = +-32767, the
                           bitangent's sign; all 0: none */
    float uv[2][2];
    uint8_t color[4]; /* unorm, linear RGBA */
};

struct psc_meshlet {
    uint32_t first_index, index_count;
    float center[3], radius; /* bounding sphere, object space */
    /* Normal cone: every triangle faces away from the direction v (unit, eye to centre) when
     * dot(v, axis) >= cutoff; cutoff > 1: never. For a perspective eye add radius / distance to
     * the cutoff. */
    float cone_axis[3], cone_cutoff;
};

enum psc_primitive_flags {
    PSC_WATERTIGHT = 1, /* every edge is shared by exactly two triangles */
    PSC_OUTWARD = 2,    /* watertight, and no connected part has a negative volume */
};

struct psc_primitive {
    uint32_t first_index, index_count;
    uint32_t first_vertex, vertex_count;
    uint32_t first_meshlet, meshlet_count;
    uint32_t material;
    uint32_t flags;
    float bounds_min[3], bounds_max[3]; /* object space */
    /* What was taken off the file's vertices, because they lie far from their origin; instances'
     * matrices have it already. Of what deforms: taken off PSC_BIND; what its positions lack is
     * known to its instances alone. */
    float offset[3];
};

enum psc_instance_flags {
    PSC_MIRRORED = 1, /* negative determinant: winding is flipped */
    PSC_HIDDEN = 2,   /* neither drawn nor casting; an animation may show it */
};

struct psc_instance {
    float world[12]; /* row-major 3x4: world = M * (object, 1) */
    uint32_t primitive;
    uint32_t flags;
};

struct psc_texture {
    uint32_t image;
    uint32_t wrap_s, wrap_t; /* enum psc_wrap */
    uint32_t nearest;        /* bit 0: magnification, bit 1: minification, bit 2: between mips,
                                bit 3: no mips at all */
};

struct psc_image {
    uint32_t width, height, levels; /* levels: complete chain down to 1 x 1 */
    uint32_t srgb;                  /* rgb is sRGB-encoded (alpha never is) */
    uint64_t first_byte;            /* in PSC_TEXELS */
};

struct psc_texture_ref {
    int32_t texture;    /* -1: none */
    uint32_t uv_set;    /* 0 or 1 */
    float transform[6]; /* row-major 2x3: uv' = T * (uv, 1), from KHR_texture_transform */
};

/* enum psc_alpha_mode, enum psc_material_flags, enum psc_wrap */
#define SHARED_ROWS "renderer/blob/materials.def"
#include "renderer/shared/rows_c.h"

struct psc_material {
    float base_color[4]; /* linear; specular-glossiness: diffuse */
    float emissive[3];   /* linear, W m^-2 sr^-1, strength folded in */
    float metallic, roughness;
    float specular[3]; /* specular-glossiness: F0 factor; else F0 of what is no metal, over 0.04 */
    float glossiness;
    float normal_scale, occlusion_strength, alpha_cutoff;
    uint32_t alpha_mode; /* enum psc_alpha_mode */
    uint32_t flags;
    struct psc_texture_ref base, surface, normal, occlusion, emission;
    /* surface: metallic in b, roughness in g, as in glTF */
};

struct psc_light {
    struct pen_light light; /* the file's world space */
    char name[60];
    uint32_t reserved;
};

struct psc_camera {
    double eye[3], target[3]; /* the file's world space */
    float up[3];
    float fov_y_deg;
    char name[60];
    uint32_t reserved;
};

/* A mapped, checked blob. Everything points into the mapping; read-only. */
struct psc_scene {
    const struct psc_header *header;
    const float (*positions)[3];
    const struct psc_attributes *attributes;
    const uint32_t *indices;
    const struct psc_meshlet *meshlets;
    const struct psc_primitive *primitives;
    const struct psc_instance *instances;
    const struct psc_material *materials;
    const struct psc_texture *textures;
    const struct psc_image *images;
    const uint8_t *texels;
    const struct psc_light *lights;
    const struct psc_camera *cameras;
    const char *warnings;
    struct psc_motion motion;
    uint32_t vertex_count, index_count, meshlet_count, primitive_count, instance_count,
        material_count, texture_count, image_count, light_count, camera_count;
    uint64_t texel_bytes, warning_bytes;
    size_t map_bytes;
};

/* Maps the file behind `fd` (which stays the caller's) and checks everything a reader relies on:
 * magic, version, sizes, alignment, every index and offset in range, finite floats, complete mip
 * chains. Errors: PEN_INVALID; *scene is then zeroed. */
bool psc_open(int fd, struct psc_scene *scene, struct pen_error *error);
/* The same over memory that outlives *scene. */
bool psc_open_memory(
    const void *data, size_t bytes, struct psc_scene *scene, struct pen_error *error);
/* Unmaps what psc_open mapped; harmless on a zeroed or psc_open_memory scene. */
void psc_close(struct psc_scene *scene);
/* Gives back the memory that reading what psc_open mapped has taken: it is read again where it is
 * needed. */
void psc_rest(const struct psc_scene *scene);
