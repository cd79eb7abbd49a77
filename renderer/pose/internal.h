/* What the files of this folder share. */
#pragma once
#include "renderer/pose/pose.h"
#include "renderer/blob/affine.h"

struct pose_deform_state { /* what a primitive was last made of */
    float *weights;
    bool made;
};

struct pose {
    const struct psc_scene *rest;
    struct psc_scene scene; /* as posed: points into the arrays below where they differ */
    struct psc_header header;

    /* Values that channels write, in glTF's terms; put back to rest before each evaluation. */
    struct psc_node *nodes;
    float *weights;
    struct psc_material_rest *material_rests;
    struct psc_light_rest *light_rests;
    float (*alphas)[8];     /* of material_rests: factor, cutoff, the base texture's placement */
    double *channel_values; /* of one channel */

    double (*worlds)[12]; /* of nodes */
    bool *hidden;
    double (*places)[12]; /* of instances that ride or are skinned, in the file's world */
    bool *placed;         /* those */
    double (*offsets)[3]; /* taken off the vertices of primitives: in object space, skinned ones in
                              the file's world */
    double (*joints)[12]; /* of all skins */
    bool *skin_moved;     /* since the last pose */

    float (*positions)[3];
    struct psc_attributes *attributes;
    struct psc_meshlet *meshlets;
    struct psc_primitive *primitives;
    struct psc_instance *instances, *shown; /* all; those that are not hidden */
    struct psc_material *materials;
    struct psc_light *lights;
    struct psc_camera *cameras;
    float (*instance_bounds)[2][3];
    bool *instance_dirty; /* bounds to be found again */
    struct pose_deform_state *deforms;
    int32_t variant; /* -1: none */
    uint32_t *moved;
    uint32_t moved_count;
};

/* evaluate.c: one sampler at a time; `rotation`: as a quaternion. */
void pose_sample(const struct psc_motion *motion, const struct psc_sampler *sampler, float time_s,
    bool rotation, double *out);
/* Writes every channel's value where it belongs, the materials among them. */
void pose_apply_channels(struct pose *pose, const struct psc_animation *animation, float time_s);

/* deform.c: the joints of all skins. */
void pose_place_joints(struct pose *pose);
/* Relative to an offset that suits where they are, which is left with the pose. False when a vertex
 * leaves the range of coordinates. */
bool pose_deform(struct pose *pose, uint32_t number, uint32_t *changes);
