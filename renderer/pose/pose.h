/* A scene at a moment of one of its animations: nodes, skins and morph targets evaluated on the CPU
 * (glTF 2.0, 3.7.2.2, 3.7.3.3 and 3.11). What comes out is a scene like any other. No GL. */
#pragma once
#include "renderer/blob/pscene.h"

struct pose;

enum pose_change {
    POSE_VERTICES = 1,  /* positions, normals, tangents and meshlets of pose_moved */
    POSE_INSTANCES = 2, /* their transforms */
    POSE_STATE = 4,     /* which instances are mirrored, or hidden: those are left out */
    POSE_MATERIALS = 8, /* their factors and texture transforms */
    POSE_ALPHA = 16,    /* of materials, what says where their surfaces are */
    POSE_LIGHTS = 32,   /* or cameras */
    POSE_SURFACES = 64, /* which material a primitive has */
};

/* Over a scene that outlives it, with memory of its own for all that moves; at rest. */
struct pose *pose_create(const struct psc_scene *rest);
void pose_destroy(struct pose *pose);

/* The number of the animation with that name or, when none has it, that number in decimal; -1 for
 * "". Errors: PEN_INVALID at /animation, with what there is. */
bool pose_find(
    const struct psc_scene *scene, const char *text, int32_t *animation, struct pen_error *error);

/* The same of a variant, at /variant; -1 for "": as the file is. */
bool pose_find_variant(
    const struct psc_scene *scene, const char *text, int32_t *variant, struct pen_error *error);

/* The time that an animation is held at: before its first key as at it, after its last as there. */
float pose_clamp(const struct psc_scene *scene, int32_t animation, float time_s);

/* Evaluates. animation -1: the rest pose. *changes: enum pose_change since the last call. Errors:
 * PEN_INVALID when something moves out of range; the pose then has to be set again. */
bool pose_set(
    struct pose *pose, int32_t animation, float time_s, uint32_t *changes, struct pen_error *error);

/* Gives primitives the materials of a variant, whatever the pose; -1: their own. Returns
 * POSE_SURFACES when something changed. */
uint32_t pose_dress(struct pose *pose, int32_t variant);

/* The scene as posed, without what is hidden: owned by the pose, in place until it is destroyed. */
const struct psc_scene *pose_scene(const struct pose *pose);

/* Numbers of the primitives whose vertices the last pose_set moved. */
const uint32_t *pose_moved(const struct pose *pose, uint32_t *count);

/* All instances, as the blob counts them, hidden ones flagged. */
const struct psc_instance *pose_instances(const struct pose *pose);

/* World bounds of the instances of pose_scene. */
void pose_instance_bounds(const struct pose *pose, float (*bounds)[2][3]);
