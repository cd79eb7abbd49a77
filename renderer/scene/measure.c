/* Where a scene is, and how large. */
#include "protocol/memory.h"
#include "protocol/number.h"
#include "renderer/blob/bounds.h"
#include "renderer/pose/pose.h"
#include "renderer/scene/scene.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define GROUND 12 /* radii that it reaches */

float scene_floor(const struct scene *s)
{
    double away = s->rest_stage.origin[1] - s->blob.header->origin[1];
    float stage = s->stage->floor, rest = s->rest_stage.floor + (float)away;
    if (stage - rest < GROUND * scene_radius(s)) /* else it is not seen */
        stage = fminf(stage, rest);
    bool alone = scene_is_empty(s) || s->stage->apart;
    return alone ? stage : fminf(stage, s->blob.header->bounds_min[1]);
}

float scene_ground_top(const struct scene *s)
{
    return scene_is_empty(s) ? 0 : scene_floor(s);
}

void scene_ground(const struct scene *s, float ground[4])
{
    float radius = scene_radius(s);
    scene_center(s, ground);
    /* A hair below the bounds, so that a floor of the scene itself hides it. */
    ground[1] = scene_ground_top(s) - 1e-4f * radius;
    ground[3] = GROUND * radius;
}

bool scene_is_empty(const struct scene *s)
{
    return !(s->blob.header->bounds_min[0] <= s->blob.header->bounds_max[0]);
}

static bool has_content(const struct scene *s)
{
    return s->stage->content[0][0] <= s->stage->content[1][0];
}

float scene_radius(const struct scene *s)
{
    float sum = 0;
    for (int i = 0; i < 3 && has_content(s); i++) {
        float d = s->stage->content[1][i] - s->stage->content[0][i];
        sum += d * d;
    }
    return sum > 0 ? fmaxf(0.5f * sqrtf(sum), 1e-9f) : 1; /* of a single point, too */
}

void scene_center(const struct scene *s, float center[3])
{
    for (int i = 0; i < 3; i++)
        center[i] = has_content(s) ? 0.5f * (s->stage->content[0][i] + s->stage->content[1][i]) : 0;
}

void scene_point_in(const struct scene *s, const double world[3], float point[3])
{
    for (int i = 0; i < 3; i++)
        point[i] = (float)(world[i] - s->blob.header->origin[i]);
}

void scene_point_out(const struct scene *s, const float point[3], double world[3])
{
    for (int i = 0; i < 3; i++)
        world[i] = s->blob.header->origin[i] + pen_widen(point[i]);
}

void scene_direction(const double from[3], const double to[3], float direction[3])
{
    double d[3], size = 0;
    for (int i = 0; i < 3; i++) {
        d[i] = to[i] - from[i];
        size = fmax(size, fabs(d[i]));
    }
    for (int i = 0; i < 3; i++)
        direction[i] = size > 0 ? (float)ldexp(d[i], -ilogb(size)) : 0;
}

/* Vertices transformed for tight bounds, per scene: a few milliseconds' worth. */
#define BOUND_BUDGET (8u << 20)

static void bound_instances(struct scene *s)
{
    uint64_t left = BOUND_BUDGET;
    s->nearest_known = false;
    if (!s->instance_bounds)
        s->instance_bounds = pen_alloc_zero(s->file.instance_count, sizeof *s->instance_bounds);
    if (s->poses) { /* it knows what moved */
        pose_instance_bounds(s->poses, s->instance_bounds);
        return;
    }
    for (uint32_t i = 0; i < s->blob.instance_count; i++) {
        uint32_t vertices = s->blob.primitives[s->blob.instances[i].primitive].vertex_count;
        float(*bounds)[3] = s->instance_bounds[i];
        bool tight = vertices <= left;
        left -= tight ? vertices : 0;
        psc_bounds_clear(bounds[0], bounds[1]);
        psc_bounds_grow(&s->blob, i, tight, bounds[0], bounds[1]);
    }
}

void scene_instance_bounds(const struct scene *s, uint32_t instance, float min[3], float max[3])
{
    memcpy(min, s->instance_bounds[instance][0], 12);
    memcpy(max, s->instance_bounds[instance][1], 12);
}

void scene_measure(struct scene *s)
{
    bound_instances(s);
    if (!s->rest_stage.moments) /* the first time, it is at rest */
        stage_make(&s->rest_stage, &s->blob, (const float(*)[2][3])s->instance_bounds);
    if (s->pose.animation >= 0 && s->pose.animation != s->moving_animation) {
        stage_finish(&s->moving_stage);
        stage_make_animated(&s->moving_stage, &s->file, s->pose.animation);
        s->moving_animation = s->pose.animation;
    }
    s->stage = s->pose.animation >= 0 ? &s->moving_stage : &s->rest_stage;
    if (memcmp(s->stage->origin, s->blob.header->origin, sizeof s->stage->origin)) {
        stage_finish(&s->moved_stage);
        stage_move(s->stage, s->blob.header->origin, &s->moved_stage);
        s->stage = &s->moved_stage;
    }
}
