#include "renderer/pose/pose.h"
#include "protocol/memory.h"
#include "renderer/blob/bounds.h"
#include "renderer/pose/internal.h"
#include "renderer/pose/place.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define BOUND_BUDGET (64u << 20) /* vertices transformed for tight world bounds */
#define FARTHEST 1e12            /* of a matrix element */

static void *copy(const void *from, size_t count, size_t item_bytes)
{
    void *to = pen_alloc_zero(count, item_bytes);
    if (from)
        memcpy(to, from, count * item_bytes);
    return to;
}

static uint32_t most_components(const struct psc_motion *m)
{
    uint32_t most = 4;
    for (uint32_t i = 0; i < m->sampler_count; i++)
        most = m->samplers[i].components > most ? m->samplers[i].components : most;
    return most;
}

static void create_deforms(struct pose *pose)
{
    const struct psc_motion *m = &pose->rest->motion;
    pose->deforms = copy(NULL, m->deform_count, sizeof *pose->deforms);
    pose->moved = copy(NULL, m->deform_count, sizeof *pose->moved);
    for (uint32_t i = 0; i < m->deform_count; i++) {
        const struct psc_deform *d = &m->deforms[i];
        pose->deforms[i].weights = copy(NULL, d->target_count, sizeof *pose->deforms[i].weights);
    }
}

/* What channels write goes back to what the file says. */
static void reset(struct pose *pose)
{
    const struct psc_scene *rest = pose->rest;
    const struct psc_motion *m = &rest->motion;
    memcpy(pose->nodes, m->nodes, m->node_count * sizeof *pose->nodes);
    memcpy(pose->weights, m->weights, m->weight_count * sizeof *pose->weights);
    memcpy(pose->material_rests, m->material_rests,
        m->material_rest_count * sizeof *pose->material_rests);
    memcpy(pose->light_rests, m->light_rests, m->light_rest_count * sizeof *pose->light_rests);
    memcpy(pose->materials, rest->materials, rest->material_count * sizeof *pose->materials);
    memcpy(pose->lights, rest->lights, rest->light_count * sizeof *pose->lights);
    memcpy(pose->cameras, rest->cameras, rest->camera_count * sizeof *pose->cameras);
}

struct pose *pose_create(const struct psc_scene *rest)
{
    const struct psc_motion *m = &rest->motion;
    struct pose *pose = copy(NULL, 1, sizeof *pose);
    pose->rest = rest;
    pose->scene = *rest;
    pose->header = *rest->header;
    pose->nodes = copy(m->nodes, m->node_count, sizeof *pose->nodes);
    pose->weights = copy(m->weights, m->weight_count, sizeof *pose->weights);
    pose->material_rests =
        copy(m->material_rests, m->material_rest_count, sizeof *pose->material_rests);
    pose->light_rests = copy(m->light_rests, m->light_rest_count, sizeof *pose->light_rests);
    pose->alphas = copy(NULL, m->material_rest_count, sizeof *pose->alphas);
    pose->channel_values = copy(NULL, most_components(m), sizeof *pose->channel_values);
    pose->worlds = copy(NULL, m->node_count, sizeof *pose->worlds);
    pose->hidden = copy(NULL, m->node_count, sizeof *pose->hidden);
    pose->places = copy(NULL, rest->instance_count, sizeof *pose->places);
    pose->placed = copy(NULL, rest->instance_count, sizeof *pose->placed);
    pose->offsets = copy(NULL, rest->primitive_count, sizeof *pose->offsets);
    for (uint32_t i = 0; i < rest->primitive_count; i++)
        for (int k = 0; k < 3; k++)
            pose->offsets[i][k] = rest->primitives[i].offset[k];
    pose->joints = copy(NULL, m->joint_count, sizeof *pose->joints);
    pose->skin_moved = copy(NULL, m->skin_count, sizeof *pose->skin_moved);
    if (m->deform_count) { /* else no vertex moves */
        pose->positions = copy(rest->positions, rest->vertex_count, sizeof *pose->positions);
        pose->attributes = copy(rest->attributes, rest->vertex_count, sizeof *pose->attributes);
        pose->meshlets = copy(rest->meshlets, rest->meshlet_count, sizeof *pose->meshlets);
        pose->scene.positions = (const float(*)[3])pose->positions;
        pose->scene.attributes = pose->attributes;
        pose->scene.meshlets = pose->meshlets;
    }
    if (m->deform_count || m->variant_count) {
        pose->primitives = copy(rest->primitives, rest->primitive_count, sizeof *pose->primitives);
        pose->scene.primitives = pose->primitives;
    }
    pose->variant = -1;
    pose->instances = copy(rest->instances, rest->instance_count, sizeof *pose->instances);
    pose->materials = copy(rest->materials, rest->material_count, sizeof *pose->materials);
    pose->lights = copy(rest->lights, rest->light_count, sizeof *pose->lights);
    pose->cameras = copy(rest->cameras, rest->camera_count, sizeof *pose->cameras);
    pose->instance_bounds = copy(NULL, rest->instance_count, sizeof *pose->instance_bounds);
    pose->instance_dirty = copy(NULL, rest->instance_count, sizeof *pose->instance_dirty);
    memset(pose->instance_dirty, 1, rest->instance_count * sizeof *pose->instance_dirty);
    pose->scene.header = &pose->header;
    pose->shown = copy(NULL, rest->instance_count, sizeof *pose->shown);
    pose->scene.instances = pose->shown;
    pose->scene.materials = pose->materials;
    pose->scene.lights = pose->lights;
    pose->scene.cameras = pose->cameras;
    pose->scene.map_bytes = 0; /* the mapping is not ours */
    create_deforms(pose);
    return pose;
}

void pose_destroy(struct pose *pose)
{
    if (!pose)
        return;
    for (uint32_t i = 0; i < pose->rest->motion.deform_count; i++)
        free(pose->deforms[i].weights);
    void *const owned[] = {pose->nodes, pose->weights, pose->material_rests, pose->light_rests,
        pose->alphas, pose->channel_values, pose->worlds, pose->hidden, pose->places, pose->placed,
        pose->offsets, pose->joints, pose->skin_moved, pose->positions, pose->attributes,
        pose->meshlets, pose->primitives, pose->instances, pose->shown, pose->materials,
        pose->lights, pose->cameras, pose->instance_bounds, pose->instance_dirty, pose->deforms,
        pose->moved};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        free(owned[i]);
    free(pose);
}

/* What a request names: `count` items of `bytes` each that begin with a name. */
static bool find_named(const void *items, uint32_t count, size_t bytes, const char *text,
    const char *what, int32_t *found, struct pen_error *error)
{
    char *end, list[200] = "", pointer[16];
    const char *first = items;
    *found = -1;
    if (!*text)
        return true;
    for (uint32_t i = 0; i < count; i++)
        if (!strcmp(first + i * bytes, text)) {
            *found = (int32_t)i;
            return true;
        }
    unsigned long number = strtoul(text, &end, 10);
    if (*text >= '0' && *text <= '9' && !*end && number < count) {
        *found = (int32_t)number;
        return true;
    }
    snprintf(pointer, sizeof pointer, "/%s", what);
    if (!count)
        return pen_fail(error, PEN_INVALID, pointer, "The scene has no %ss.", what);
    for (size_t i = 0, at = 0; i < count && at < sizeof list; i++) {
        const char *name = first + i * bytes;
        at += (size_t)(*name ? snprintf(list + at, sizeof list - at, i ? ", %s" : "%s", name)
                             : snprintf(list + at, sizeof list - at, i ? ", %zu" : "%zu", i));
    }
    return pen_fail(error, PEN_INVALID, pointer, "The scene has the %ss %s; there is no \"%.60s\".",
        what, list, text);
}

bool pose_find(
    const struct psc_scene *scene, const char *text, int32_t *animation, struct pen_error *error)
{
    return find_named(scene->motion.animations, scene->motion.animation_count,
        sizeof *scene->motion.animations, text, "animation", animation, error);
}

bool pose_find_variant(
    const struct psc_scene *scene, const char *text, int32_t *variant, struct pen_error *error)
{
    return find_named(scene->motion.variants, scene->motion.variant_count,
        sizeof *scene->motion.variants, text, "variant", variant, error);
}

float pose_clamp(const struct psc_scene *scene, int32_t animation, float time_s)
{
    if (animation < 0 || !(time_s > 0))
        return 0;
    return fminf(time_s, scene->motion.animations[animation].duration_s);
}

static bool find_worlds(struct pose *pose)
{
    for (uint32_t i = 0; i < pose->rest->motion.node_count; i++) {
        const struct psc_node *node = &pose->nodes[i];
        double local[12];
        if (node->flags & PSC_NODE_MATRIX)
            memcpy(local, node->matrix, sizeof local);
        else {
            psc_affine_trs((const float[3]){0, 0, 0}, node->rotation, node->scale, local);
            for (int k = 0; k < 3; k++)
                local[4 * k + 3] = node->translation[k];
        }
        pose->hidden[i] = (node->flags & PSC_NODE_HIDDEN) != 0;
        if (node->parent >= 0) {
            psc_affine_multiply(pose->worlds[node->parent], local, pose->worlds[i]);
            pose->hidden[i] |= pose->hidden[node->parent];
        } else
            memcpy(pose->worlds[i], local, sizeof local);
        for (int k = 0; k < 12; k++)
            if (!(fabs(pose->worlds[i][k]) <= FARTHEST))
                return false;
    }
    return true;
}

static double determinant(const float m[12])
{
    return (double)m[0] * ((double)m[5] * (double)m[10] - (double)m[6] * (double)m[9]) -
           (double)m[1] * ((double)m[4] * (double)m[10] - (double)m[6] * (double)m[8]) +
           (double)m[2] * ((double)m[4] * (double)m[9] - (double)m[5] * (double)m[8]);
}

/* Where a node carries an instance, for the vertices as they are kept. */
static bool ride(struct pose *pose, const struct psc_rider *rider, uint32_t *changes)
{
    struct psc_instance *instance = &pose->instances[rider->item];
    uint32_t hidden = pose->hidden[rider->node] ? PSC_HIDDEN : 0;
    uint32_t flags = (instance->flags & (uint32_t)PSC_MIRRORED) | hidden;
    if (!(rider->flags & PSC_RIDER_SKINNED)) {
        double local[12], at[3], *world = pose->places[rider->item];
        float linear[12];
        for (int k = 0; k < 12; k++)
            local[k] = rider->local[k];
        psc_affine_multiply(pose->worlds[rider->node], local, world);
        psc_affine_point(world, pose->offsets[instance->primitive], at);
        for (int k = 0; k < 12; k++) {
            if (k % 4 == 3)
                world[k] = at[k / 4];
            if (!(fabs(world[k]) <= FARTHEST))
                return false;
            linear[k] = (float)world[k];
        }
        pose->placed[rider->item] = true;
        flags = hidden | (determinant(linear) < 0 ? PSC_MIRRORED : 0);
    }
    if (flags != instance->flags)
        *changes |= POSE_STATE;
    instance->flags = flags;
    return true;
}

/* All matrices, relative to an origin of the file's world. */
static void place_instances(struct pose *pose, const double origin[3], uint32_t *changes)
{
    const struct psc_header *rest = pose->rest->header;
    memcpy(pose->header.origin, origin, sizeof pose->header.origin);
    for (uint32_t i = 0; i < pose->rest->instance_count; i++) {
        float world[12];
        memcpy(world, pose->rest->instances[i].world, sizeof world);
        for (int k = 0; pose->placed[i] && k < 12; k++)
            world[k] = (float)(pose->places[i][k] - (k % 4 == 3 ? origin[k / 4] : 0));
        for (int k = 0; !pose->placed[i] && k < 3; k++)
            world[4 * k + 3] = (float)(world[4 * k + 3] + (rest->origin[k] - origin[k]));
        if (!memcmp(world, pose->instances[i].world, sizeof world))
            continue;
        memcpy(pose->instances[i].world, world, sizeof world);
        pose->instance_dirty[i] = true;
        *changes |= POSE_INSTANCES;
    }
}

static bool place_riders(struct pose *pose, uint32_t *changes)
{
    const struct psc_motion *m = &pose->rest->motion;
    for (uint32_t i = 0; i < m->rider_count; i++) {
        const struct psc_rider *rider = &m->riders[i];
        const double *world = pose->worlds[rider->node];
        if (rider->kind == PSC_RIDER_INSTANCE) {
            if (!ride(pose, rider, changes))
                return false;
        } else if (rider->kind == PSC_RIDER_LIGHT) {
            struct pen_light *light = &pose->lights[rider->item].light;
            if (!pose_place_light(light, world, rider->size))
                return false;
            if (pose->hidden[rider->node])
                memset(light->color, 0, sizeof light->color);
        } else if (!pose_place_camera(&pose->cameras[rider->item], world, rider->size))
            return false;
    }
    return true;
}

static void find_bounds(struct pose *pose)
{
    struct psc_scene all = pose->scene;
    struct psc_header *h = &pose->header;
    uint64_t budget = BOUND_BUDGET;
    all.instances = pose->instances;
    psc_bounds_clear(h->bounds_min, h->bounds_max);
    h->triangles = 0;
    for (uint32_t i = 0; i < pose->rest->instance_count; i++) {
        const struct psc_primitive *p = &all.primitives[all.instances[i].primitive];
        float(*box)[3] = pose->instance_bounds[i];
        if (!p->index_count || all.instances[i].flags & PSC_HIDDEN)
            continue;
        h->triangles += p->index_count / 3;
        if (pose->instance_dirty[i]) {
            bool tight = p->vertex_count <= budget;
            budget -= tight ? p->vertex_count : 0;
            psc_bounds_clear(box[0], box[1]);
            psc_bounds_grow(&all, i, tight, box[0], box[1]);
            pose->instance_dirty[i] = false;
        }
        for (int k = 0; k < 3; k++) {
            h->bounds_min[k] = fminf(h->bounds_min[k], box[0][k]);
            h->bounds_max[k] = fmaxf(h->bounds_max[k], box[1][k]);
        }
    }
}

static bool is_finite_scene(const struct pose *pose)
{
    const struct psc_header *h = &pose->header;
    for (int k = 0; k < 3; k++)
        if (!isfinite(h->bounds_min[k]) || !isfinite(h->bounds_max[k]))
            return false;
    return true;
}

/* Matrices and bounds, relative to the blob's origin or, when the pose is far from that, to one of its
 * own. */
static bool settle(struct pose *pose, uint32_t *changes)
{
    const struct psc_header *h = &pose->header;
    double min[3], max[3], away[3], origin[3];
    place_instances(pose, pose->rest->header->origin, changes);
    find_bounds(pose);
    for (int k = 0; k < 3; k++)
        min[k] = h->bounds_min[k], max[k] = h->bounds_max[k];
    if (!is_finite_scene(pose) || !(min[0] <= max[0]))
        return is_finite_scene(pose);
    psc_choose_origin(min, max, away);
    if (away[0] == 0 && away[1] == 0 && away[2] == 0)
        return true;
    for (int k = 0; k < 3; k++)
        origin[k] = pose->rest->header->origin[k] + away[k];
    place_instances(pose, origin, changes);
    find_bounds(pose);
    return true;
}

static void show_instances(struct pose *pose)
{
    pose->scene.instance_count = 0;
    for (uint32_t i = 0; i < pose->rest->instance_count; i++)
        if (!(pose->instances[i].flags & PSC_HIDDEN))
            pose->shown[pose->scene.instance_count++] = pose->instances[i];
}

static void mark_moved(struct pose *pose)
{
    const struct psc_scene *scene = &pose->scene;
    if (!pose->moved_count)
        return;
    bool *moved = copy(NULL, scene->primitive_count, sizeof *moved);
    for (uint32_t i = 0; i < pose->moved_count; i++)
        moved[pose->moved[i]] = true;
    for (uint32_t i = 0; i < pose->rest->instance_count; i++)
        pose->instance_dirty[i] |= moved[pose->instances[i].primitive];
    free(moved);
}

static void finish_materials(struct pose *pose, uint32_t *changes)
{
    for (uint32_t i = 0; i < pose->rest->motion.material_rest_count; i++) {
        struct psc_material *m = &pose->materials[pose->material_rests[i].material];
        float alpha[8] = {m->base_color[3], m->alpha_cutoff};
        pose_finish_material(m, &pose->material_rests[i]);
        memcpy(alpha + 2, m->base.transform, sizeof m->base.transform);
        if (m->alpha_mode != PSC_OPAQUE && memcmp(alpha, pose->alphas[i], sizeof alpha))
            *changes |= POSE_ALPHA;
        memcpy(pose->alphas[i], alpha, sizeof alpha);
        *changes |= POSE_MATERIALS;
    }
}

bool pose_set(
    struct pose *pose, int32_t animation, float time_s, uint32_t *changes, struct pen_error *error)
{
    const struct psc_motion *m = &pose->rest->motion;
    const struct psc_animation *a = animation >= 0 ? &m->animations[animation] : NULL;
    bool fits;
    *changes = 0;
    pose->moved_count = 0;
    reset(pose);
    if (a)
        pose_apply_channels(pose, a, time_s);
    finish_materials(pose, changes);
    for (uint32_t i = 0; i < m->light_rest_count; i++)
        pose_light_power(&pose->lights[pose->light_rests[i].light].light, &pose->light_rests[i]);
    fits = find_worlds(pose);
    if (fits)
        pose_place_joints(pose);
    for (uint32_t i = 0; fits && i < m->deform_count; i++)
        fits = pose_deform(pose, i, changes);
    for (uint32_t i = 0; !fits && i < m->deform_count; i++)
        pose->deforms[i].made = false; /* nobody knows of which pose */
    *changes |= POSE_LIGHTS;
    mark_moved(pose);
    fits = fits && place_riders(pose, changes) && settle(pose, changes);
    show_instances(pose);
    if (!fits)
        return pen_fail(error, PEN_INVALID, "/time_s",
            "At this moment the animation moves something beyond 1e12 m.");
    return true;
}

uint32_t pose_dress(struct pose *pose, int32_t variant)
{
    const struct psc_motion *m = &pose->rest->motion;
    if (variant == pose->variant)
        return 0;
    pose->variant = variant;
    for (uint32_t i = 0; i < pose->rest->primitive_count; i++)
        pose->primitives[i].material = pose->rest->primitives[i].material;
    uint32_t count = variant >= 0 ? m->variants[variant].swap_count : 0;
    for (uint32_t i = count; i-- > 0;) {
        const struct psc_swap *swap = &m->swaps[m->variants[variant].first_swap + i];
        pose->primitives[swap->primitive].material = swap->material;
    }
    return POSE_SURFACES;
}

const struct psc_scene *pose_scene(const struct pose *pose)
{
    return &pose->scene;
}

const uint32_t *pose_moved(const struct pose *pose, uint32_t *count)
{
    *count = pose->moved_count;
    return pose->moved;
}

const struct psc_instance *pose_instances(const struct pose *pose)
{
    return pose->instances;
}

void pose_instance_bounds(const struct pose *pose, float (*bounds)[2][3])
{
    for (uint32_t i = 0; i < pose->rest->instance_count; i++)
        if (!(pose->instances[i].flags & PSC_HIDDEN))
            memcpy(bounds++, pose->instance_bounds[i], sizeof *bounds);
}
