/* What moves in a scene blob: nodes, skins, morph targets and the animations that drive them. All
 * of it is empty in a scene without animations; the rest of the blob then is the rest pose, as it
 * always is. renderer/pose computes other poses from it. Variants, too, are kept here: primitives
 * of other materials, whether anything moves or not.
 *
 * Everything that hangs on nodes is placed by them: world(node) = world(parent) * local(node). */
#pragma once
#include <stdint.h>

enum psc_node_flags {
    PSC_NODE_MATRIX = 1, /* `matrix` is its local transform, and no animation moves it */
    PSC_NODE_HIDDEN = 2, /* at rest; hides all below it too */
};

struct psc_node {
    int32_t parent; /* a lower number; -1: none */
    uint32_t flags; /* enum psc_node_flags */
    double translation[3];
    double matrix[12]; /* row-major 3x4 */
    float rotation[4], scale[3];
    uint32_t reserved;
};

enum psc_rider_kind { PSC_RIDER_INSTANCE, PSC_RIDER_LIGHT, PSC_RIDER_CAMERA, PSC_RIDER_KINDS };

/* An instance, light or camera that a node carries. */
struct psc_rider {
    uint32_t kind, item; /* enum psc_rider_kind; number of PSC_INSTANCES, PSC_LIGHTS ... */
    uint32_t node;
    uint32_t flags;  /* enum psc_rider_flags */
    float local[12]; /* instances: between the node and the object */
    float size[2];   /* area lights: height and width before scaling, m. Cameras: from the node to
                        the eye along the axis, from the eye to the target, m */
};

enum psc_rider_flags { PSC_RIDER_SKINNED = 1 }; /* the joints place it; its node only hides it */

/* Joints of a skin: a contiguous run. */
struct psc_skin {
    uint32_t first_joint, joint_count;
};

struct psc_joint {
    uint32_t node;
    float inverse_bind[12]; /* row-major 3x4 */
};

enum psc_deform_flags { PSC_DEFORM_FLAT = 1 }; /* no normals given: those of the posed triangles */

/* A primitive whose vertices move. Its positions, normals and tangents in the blob are those of the
 * rest pose: in the world when it is skinned (its one instance then moves them and, when the joints
 * mirror, mirrors x), else in object space. Its instances ride on nodes. */
struct psc_deform {
    uint32_t primitive;
    int32_t skin;             /* -1: only morphed */
    int32_t instance;         /* of a skinned one; else -1 */
    uint32_t first_bind;      /* PSC_BIND, vertex_count of the primitive */
    uint32_t first_influence; /* PSC_INFLUENCES, vertex by vertex */
    uint32_t influences;      /* per vertex: 0, 4 or 8 */
    uint32_t first_target, target_count;
    uint32_t first_weight; /* PSC_WEIGHTS, one per target; several primitives may share them */
    uint32_t flags;        /* enum psc_deform_flags */
};

struct psc_bind { /* a vertex before morphing and skinning */
    float position[3], normal[3];
    float tangent[4]; /* all 0: none */
};

struct psc_influence {
    uint32_t joint; /* of the skin */
    float weight;   /* those of a vertex add up to 1 */
};

struct psc_target { /* a run of PSC_DELTAS, vertices increasing */
    uint32_t first_delta, delta_count;
};

struct psc_delta {   /* vertices that are not named do not move */
    uint32_t vertex; /* of the primitive, from 0 */
    float position[3], normal[3], tangent[3];
};

enum psc_interpolation { PSC_STEP, PSC_LINEAR, PSC_CUBIC, PSC_INTERPOLATIONS };

struct psc_sampler {
    uint32_t interpolation;           /* enum psc_interpolation */
    uint32_t key_count, components;   /* at least 1 */
    uint32_t first_time, first_value; /* PSC_KEYS: key_count times, not decreasing, and
                                         key_count * components values (cubic: three times that:
                                         in-tangent, value, out-tangent of each key) */
};

/* What a channel writes, and how many components. WEIGHTS takes any. */
#define PSC_CHANNEL_TARGETS(X)                                                                     \
    X(NODE_TRANSLATION, 3)                                                                         \
    X(NODE_ROTATION, 4)                                                                            \
    X(NODE_SCALE, 3)                                                                               \
    X(NODE_VISIBLE, 1)                                                                             \
    X(WEIGHTS, 0)                                                                                  \
    X(MATERIAL_BASE_COLOR, 4)                                                                      \
    X(MATERIAL_METALLIC, 1)                                                                        \
    X(MATERIAL_ROUGHNESS, 1)                                                                       \
    X(MATERIAL_EMISSIVE, 3)                                                                        \
    X(MATERIAL_EMISSIVE_STRENGTH, 1)                                                               \
    X(MATERIAL_ALPHA_CUTOFF, 1)                                                                    \
    X(MATERIAL_NORMAL_SCALE, 1)                                                                    \
    X(MATERIAL_OCCLUSION_STRENGTH, 1)                                                              \
    X(MATERIAL_IOR, 1)                                                                             \
    X(MATERIAL_SPECULAR_STRENGTH, 1)                                                               \
    X(MATERIAL_SPECULAR, 3)                                                                        \
    X(TEXTURE_OFFSET, 2)                                                                           \
    X(TEXTURE_ROTATION, 1)                                                                         \
    X(TEXTURE_SCALE, 2)                                                                            \
    X(LIGHT_COLOR, 3)                                                                              \
    X(LIGHT_INTENSITY, 1)                                                                          \
    X(LIGHT_INNER_CONE, 1)                                                                         \
    X(LIGHT_OUTER_CONE, 1)                                                                         \
    X(CAMERA_FOV, 1)

enum psc_channel_target {
#define X(name, components) PSC_TO_##name,
    PSC_CHANNEL_TARGETS(X)
#undef X
        PSC_CHANNEL_TARGET_COUNT
};

struct psc_channel {
    uint32_t target; /* enum psc_channel_target */
    uint32_t item;   /* PSC_NODES, PSC_WEIGHTS (the first), PSC_MATERIAL_RESTS,
                         PSC_MATERIAL_RESTS * 5 + slot, PSC_LIGHT_RESTS or PSC_CAMERAS */
    uint32_t sampler;
};

struct psc_animation {
    char name[60];
    float duration_s; /* of its last key */
    uint32_t first_channel, channel_count;
};

/* What glTF says of a material that is animated, where the blob keeps a product of it. */
struct psc_material_rest {
    uint32_t material;
    float emissive[3], emissive_strength;
    float ior, specular_strength, specular[3];
    struct psc_map_rest {
        float offset[2], rotation, scale[2];
    } maps[5]; /* base, surface, normal, occlusion, emission */
};

/* What glTF says of an animated light: cd, lux or nits, and radians. */
struct psc_light_rest {
    uint32_t light; /* of PSC_LIGHTS */
    float color[3], intensity, inner_cone, outer_cone;
};

/* KHR_materials_variants: a run of PSC_SWAPS, of which the first counts for a primitive. */
struct psc_variant {
    char name[60]; /* "" when it has none */
    uint32_t first_swap, swap_count;
};

struct psc_swap {
    uint32_t primitive, material; /* what it is made of instead */
};

/* The sections of all this, in the order of the file, behind every other one. */
#define PSC_MOTION_SECTIONS(X)                                                                     \
    X(VARIANTS, variant, struct psc_variant)                                                       \
    X(SWAPS, swap, struct psc_swap)                                                                \
    X(NODES, node, struct psc_node)                                                                \
    X(RIDERS, rider, struct psc_rider)                                                             \
    X(SKINS, skin, struct psc_skin)                                                                \
    X(JOINTS, joint, struct psc_joint)                                                             \
    X(DEFORMS, deform, struct psc_deform)                                                          \
    X(BIND, bind, struct psc_bind)                                                                 \
    X(INFLUENCES, influence, struct psc_influence)                                                 \
    X(MORPH_TARGETS, target, struct psc_target)                                                    \
    X(DELTAS, delta, struct psc_delta)                                                             \
    X(WEIGHTS, weight, float)                                                                      \
    X(ANIMATIONS, animation, struct psc_animation)                                                 \
    X(CHANNELS, channel, struct psc_channel)                                                       \
    X(SAMPLERS, sampler, struct psc_sampler)                                                       \
    X(KEYS, key, float)                                                                            \
    X(MATERIAL_RESTS, material_rest, struct psc_material_rest)                                     \
    X(LIGHT_RESTS, light_rest, struct psc_light_rest)

/* Of a mapped blob; checked: every number below is in range and every float finite. */
struct psc_motion {
#define X(id, name, type)                                                                          \
    const type *name##s;                                                                           \
    uint32_t name##_count;
    PSC_MOTION_SECTIONS(X)
#undef X
};
