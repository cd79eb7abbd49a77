/* The room that a scene takes: what cameras frame, the key light is made for, the ground lies under
 * and exposure is measured on. With an animation it is what all of that takes, whatever the time, so
 * that a sequence of pictures neither breathes nor flickers. */
#pragma once
#include "protocol/request.h"
#include "renderer/scene/outline.h"

struct scene_moment {
    struct outline_samples samples;
    struct pen_light lights[PEN_MAX_LIGHTS]; /* the scene's own */
    uint32_t light_count;
};

struct scene_stage {
    double origin[3];       /* in the file's world, of all that follows */
    float content[2][3];    /* world bounds of what it is about (content.h); min > max: empty */
    float floor;            /* its lowest point; infinite: empty */
    bool apart;             /* other things may lie below the floor */
    struct outline outline; /* of the content */
    struct scene_moment *moments;
    uint32_t moment_count;
};

/* Of one moment: the scene and the world bounds of its instances. */
void stage_make(
    struct scene_stage *stage, const struct psc_scene *scene, const float (*instance_bounds)[2][3]);
/* Of moments spread evenly over an animation; those that move something out of range are left out. */
void stage_make_animated(
    struct scene_stage *stage, const struct psc_scene *file, int32_t animation);
/* A copy of it, relative to another origin, into an unused *to. */
void stage_move(const struct scene_stage *stage, const double origin[3], struct scene_stage *to);
void stage_finish(struct scene_stage *stage); /* a zeroed one is fine */
