#include "renderer/scene/stage.h"
#include "protocol/memory.h"
#include "renderer/blob/bounds.h"
#include "renderer/pose/pose.h"
#include "renderer/scene/content.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_MOMENTS 24
#define LEAST_MOMENTS 5
#define VERTEX_BUDGET 2000000u /* posed, of all moments: some tenths of a second */

static void merge(float to[2][3], const float box[2][3])
{
    for (int k = 0; k < 3; k++) {
        to[0][k] = fminf(to[0][k], box[0][k]);
        to[1][k] = fmaxf(to[1][k], box[1][k]);
    }
}

static void start(struct scene_stage *stage, uint32_t moments, const double origin[3])
{
    memset(stage, 0, sizeof *stage);
    memcpy(stage->origin, origin, sizeof stage->origin);
    psc_bounds_clear(stage->content[0], stage->content[1]);
    stage->floor = INFINITY;
    stage->moments = pen_alloc_zero(moments, sizeof *stage->moments);
}

static void move_box(float box[2][3], const float shift[3])
{
    for (int k = 0; k < 3; k++) {
        box[0][k] += shift[k];
        box[1][k] += shift[k];
    }
}

/* `ground` is relative to the stage's origin. */
static void add_moment(struct scene_stage *stage, const struct psc_scene *scene,
    const float (*instance_bounds)[2][3], float ground)
{
    const struct psc_header *h = scene->header;
    struct scene_moment *moment = &stage->moments[stage->moment_count++];
    struct content content;
    float shift[3];
    moment->light_count = scene->light_count < PEN_MAX_LIGHTS ? scene->light_count : PEN_MAX_LIGHTS;
    for (uint32_t i = 0; i < moment->light_count; i++)
        moment->lights[i] = scene->lights[i].light;
    if (!(h->bounds_min[0] <= h->bounds_max[0]))
        return;
    for (int k = 0; k < 3; k++)
        shift[k] = (float)(h->origin[k] - stage->origin[k]);
    content_find(scene, instance_bounds, ground - shift[1], &content);
    outline_grow(&stage->outline, scene, (const float(*)[3])content.box, shift);
    outline_sample(&moment->samples, scene, (const float(*)[3])content.box, shift);
    stage->floor = fminf(stage->floor, content.floor + shift[1]);
    stage->apart |= content.apart;
    move_box(content.box, shift);
    merge(stage->content, (const float(*)[3])content.box);
}

void stage_make(
    struct scene_stage *stage, const struct psc_scene *scene, const float (*instance_bounds)[2][3])
{
    start(stage, 1, scene->header->origin);
    add_moment(stage, scene, instance_bounds, -INFINITY);
}

void stage_make_animated(struct scene_stage *stage, const struct psc_scene *file, int32_t animation)
{
    struct pose *pose = pose_create(file);
    float duration = file->motion.animations[animation].duration_s;
    bool empty = !(file->header->bounds_min[1] <= file->header->bounds_max[1]);
    double origin[3];
    float(*bounds)[2][3] = pen_alloc_zero(file->instance_count, sizeof *bounds);
    uint32_t count = VERTEX_BUDGET / (file->vertex_count + 1), changes;
    count = count < LEAST_MOMENTS ? LEAST_MOMENTS : count > MOST_MOMENTS ? MOST_MOMENTS : count;
    memcpy(origin, file->header->origin, sizeof origin);
    if (pose_set(pose, animation, 0, &changes, NULL))
        memcpy(origin, pose_scene(pose)->header->origin, sizeof origin);
    float ground = file->header->bounds_min[1] + (float)(file->header->origin[1] - origin[1]);
    start(stage, count, origin);
    for (uint32_t i = 0; i < count; i++) {
        float time_s = duration * (float)i / (float)(count - 1);
        if (!pose_set(pose, animation, time_s, &changes, NULL))
            continue;
        pose_instance_bounds(pose, bounds);
        add_moment(
            stage, pose_scene(pose), (const float(*)[2][3])bounds, empty ? -INFINITY : ground);
    }
    free(bounds);
    pose_destroy(pose);
}

void stage_move(const struct scene_stage *stage, const double origin[3], struct scene_stage *to)
{
    float shift[3];
    for (int k = 0; k < 3; k++)
        shift[k] = (float)(stage->origin[k] - origin[k]);
    *to = *stage;
    memcpy(to->origin, origin, sizeof to->origin);
    to->moments = pen_alloc(stage->moment_count, sizeof *to->moments);
    memcpy(to->moments, stage->moments, stage->moment_count * sizeof *to->moments);
    move_box(to->content, shift);
    to->floor += shift[1];
    for (uint32_t i = 0; i < to->outline.extreme_count; i++)
        for (int k = 0; k < 3; k++)
            to->outline.extremes[i][k] += shift[k];
    for (uint32_t i = 0; i < to->moment_count; i++)
        for (uint32_t n = 0; n < to->moments[i].samples.count; n++)
            for (int k = 0; k < 3; k++)
                to->moments[i].samples.at[n].point[k] += shift[k];
}

void stage_finish(struct scene_stage *stage)
{
    free(stage->moments);
    memset(stage, 0, sizeof *stage);
}
