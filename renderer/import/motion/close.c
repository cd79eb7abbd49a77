#include "renderer/import/motion/close.h"
#include "protocol/memory.h"
#include "renderer/import/convert/light.h"
#include "renderer/import/convert/material.h"
#include "renderer/import/base/name.h"
#include "renderer/import/motion/aim.h"
#include "renderer/import/motion/keys.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

/* What imp_motion_close works with: the blob's numbers of what channels move. */
struct closing {
    struct imp_context *context;
    uint32_t *nodes;     /* IMP_NOT_YET: not kept */
    uint32_t *materials; /* rests, by glTF's number; IMP_NOT_YET: none yet */
    uint32_t *lights;    /* rests, by the blob's number of the light */
    uint32_t *samplers;  /* by the file's number ... */
    uint32_t *widths;    /* ... and for how many components they were read */
    float *ends;         /* of their last keys; not finite: not looked at */
    struct psc_channel *channels;
    size_t channel_count, channel_room;
};

/* Nodes that carry or shape something, and those above them. */
static void number_nodes(struct closing *c)
{
    const struct gltf_model *model = c->context->model;
    struct imp_motion *motion = c->context->motion;
    bool *kept = pen_alloc_zero(model->node_count, sizeof *kept);
    uint32_t count = 0;
    for (size_t i = 0; i < motion->rider_count; i++)
        kept[motion->riders[i].node] = true;
    for (size_t i = 0; i < motion->joint_count; i++)
        kept[motion->joints[i].node] = true;
    for (uint32_t i = model->node_count; i-- > 0;) {
        uint32_t node = motion->order[i];
        if (kept[node] && motion->parents[node] >= 0)
            kept[motion->parents[node]] = true;
    }
    for (uint32_t i = 0; i < model->node_count; i++) {
        uint32_t node = motion->order[i];
        c->nodes[node] = kept[node] ? count++ : IMP_NOT_YET;
    }
    free(kept);
}

static void add_nodes(struct closing *c)
{
    const struct gltf_model *model = c->context->model;
    const struct imp_motion *motion = c->context->motion;
    for (uint32_t i = 0; i < model->node_count; i++) {
        uint32_t number = motion->order[i];
        const struct gltf_node *from = &model->nodes[number];
        int32_t parent = motion->parents[number];
        if (c->nodes[number] == IMP_NOT_YET)
            continue;
        struct psc_node node = {.parent = parent >= 0 ? (int32_t)c->nodes[parent] : -1,
            .flags =
                (from->has_matrix ? PSC_NODE_MATRIX : 0) | (from->hidden ? PSC_NODE_HIDDEN : 0)};
        memcpy(node.translation, from->translation, sizeof node.translation);
        memcpy(node.rotation, from->rotation, sizeof node.rotation);
        memcpy(node.scale, from->scale, sizeof node.scale);
        for (int k = 0; k < 12; k++)
            node.matrix[k] = from->matrix[4 * (k % 4) + k / 4];
        psc_builder_add_motion(c->context->builder, PSC_NODES, &node, 1);
    }
}

static void add_rest(struct closing *c)
{
    struct imp_motion *motion = c->context->motion;
    struct psc_builder *builder = c->context->builder;
    for (size_t i = 0; i < motion->rider_count; i++)
        motion->riders[i].node = c->nodes[motion->riders[i].node];
    for (size_t i = 0; i < motion->joint_count; i++)
        motion->joints[i].node = c->nodes[motion->joints[i].node];
    psc_builder_add_motion(builder, PSC_RIDERS, motion->riders, (uint32_t)motion->rider_count);
    psc_builder_add_motion(builder, PSC_SKINS, motion->psc_skins, (uint32_t)motion->psc_skin_count);
    psc_builder_add_motion(builder, PSC_JOINTS, motion->joints, (uint32_t)motion->joint_count);
    psc_builder_add_motion(builder, PSC_DEFORMS, motion->deforms, (uint32_t)motion->deform_count);
    psc_builder_add_motion(builder, PSC_WEIGHTS, motion->weights, (uint32_t)motion->weight_count);
}

static void add_channel(struct closing *c, int32_t target, uint32_t item, uint32_t sampler)
{
    c->channels =
        pen_grow(c->channels, &c->channel_room, c->channel_count + 1, sizeof *c->channels);
    c->channels[c->channel_count++] = (struct psc_channel){(uint32_t)target, item, sampler};
}

static uint32_t material_rest(struct closing *c, uint32_t material)
{
    if (c->materials[material] == IMP_NOT_YET) {
        struct psc_material_rest rest = imp_material_rest(&c->context->model->materials[material]);
        rest.material = c->context->materials[material];
        c->materials[material] =
            psc_builder_add_motion(c->context->builder, PSC_MATERIAL_RESTS, &rest, 1);
    }
    return c->materials[material];
}

static uint32_t light_rest(struct closing *c, const struct imp_use *use)
{
    if (c->lights[use->psc] == IMP_NOT_YET) {
        struct psc_light_rest rest = imp_light_rest(&c->context->model->lights[use->from]);
        rest.light = use->psc;
        c->lights[use->psc] =
            psc_builder_add_motion(c->context->builder, PSC_LIGHT_RESTS, &rest, 1);
    }
    return c->lights[use->psc];
}

/* Lights that an animation may hide or show: hidden, they have no colour. */
static void add_veiled_lights(struct closing *c)
{
    const struct imp_motion *motion = c->context->motion;
    for (size_t i = 0; i < motion->light_count; i++)
        if (motion->unveils[motion->lights[i].node])
            light_rest(c, &motion->lights[i]);
}

static const uint8_t components[] = {
#define X(name, count) count,
    PSC_CHANNEL_TARGETS(X)
#undef X
};

/* The slots that a WEIGHTS channel writes; count 0: nothing that is drawn. */
static struct imp_slots aimed_slots(const struct imp_motion *motion, const struct imp_aim *aim)
{
    struct imp_slots slots =
        aim->mesh ? motion->mesh_slots[aim->item] : motion->node_slots[aim->item];
    if (!aim->part)
        return slots;
    bool there = aim->part <= slots.count;
    return (struct imp_slots){slots.first + aim->part - 1, there ? 1 : 0};
}

static bool is_kept(const struct closing *c, const struct imp_aim *aim)
{
    const struct gltf_model *model = c->context->model;
    const struct imp_motion *motion = c->context->motion;
    bool found = false;
    if (aim->target < 0)
        return false;
    if (aim->target <= PSC_TO_NODE_VISIBLE)
        return c->nodes[aim->item] != IMP_NOT_YET &&
               (aim->target == PSC_TO_NODE_VISIBLE || !model->nodes[aim->item].has_matrix);
    if (aim->target == PSC_TO_WEIGHTS)
        return aimed_slots(motion, aim).count > 0;
    if (aim->target < PSC_TO_LIGHT_COLOR)
        return c->context->materials[aim->item] != IMP_NOT_YET;
    for (size_t i = 0; aim->target < PSC_TO_CAMERA_FOV && i < motion->light_count; i++)
        found |= motion->lights[i].from == aim->item;
    for (size_t i = 0; aim->target == PSC_TO_CAMERA_FOV && i < motion->camera_count; i++)
        found |= motion->cameras[i].from == aim->item;
    return found;
}

static void emit(struct closing *c, const struct imp_aim *aim, uint32_t sampler)
{
    const struct imp_motion *motion = c->context->motion;
    if (aim->target <= PSC_TO_NODE_VISIBLE)
        add_channel(c, aim->target, c->nodes[aim->item], sampler);
    else if (aim->target == PSC_TO_WEIGHTS)
        add_channel(c, aim->target, aimed_slots(motion, aim).first, sampler);
    else if (aim->target < PSC_TO_TEXTURE_OFFSET)
        add_channel(c, aim->target, material_rest(c, aim->item), sampler);
    else if (aim->target < PSC_TO_LIGHT_COLOR)
        add_channel(c, aim->target, 5 * material_rest(c, aim->item) + aim->part, sampler);
    for (size_t i = 0; i < motion->light_count; i++)
        if (aim->target >= PSC_TO_LIGHT_COLOR && aim->target < PSC_TO_CAMERA_FOV &&
            motion->lights[i].from == aim->item)
            add_channel(c, aim->target, light_rest(c, &motion->lights[i]), sampler);
    for (size_t i = 0; i < motion->camera_count; i++)
        if (aim->target == PSC_TO_CAMERA_FOV && motion->cameras[i].from == aim->item)
            add_channel(c, aim->target, motion->cameras[i].psc, sampler);
}

static bool add_animated(
    struct closing *c, const struct gltf_channel *channel, float *end, struct pen_error *error)
{
    struct imp_aim aim = imp_aim(c->context, channel);
    struct imp_width width = {0, false};
    uint32_t *sampler = &c->samplers[channel->sampler];
    float *last = &c->ends[channel->sampler];
    bool kept = is_kept(c, &aim), known = isfinite(*last) != 0;
    int32_t input = c->context->motion->source.samplers[channel->sampler].input;
    if (!c->context->model->accessors[input].count) {
        imp_warn(c->context, "Animations have channels without keys, which are left out.");
        return true;
    }
    if (!kept && !known && !imp_sampler(c->context, channel->sampler, width, NULL, last, error))
        return false;
    if (!kept) {
        *end = fmaxf(*end, *last);
        return true;
    }
    width.components = components[aim.target];
    if (aim.target == PSC_TO_WEIGHTS) {
        width.weights = !aim.part;
        width.components = aimed_slots(c->context->motion, &aim).count;
        if (width.components > UINT16_MAX)
            width.components = UINT16_MAX;
    }
    if (*sampler == IMP_NOT_YET || c->widths[channel->sampler] != width.components) {
        if (!imp_sampler(c->context, channel->sampler, width, sampler, last, error))
            return false;
        c->widths[channel->sampler] = width.components;
    }
    *end = fmaxf(*end, *last);
    emit(c, &aim, *sampler);
    return true;
}

static bool add_animations(struct closing *c, struct pen_error *error)
{
    const struct gltf_motion *source = &c->context->motion->source;
    for (uint32_t i = 0; i < source->animation_count; i++) {
        const struct gltf_animation *from = &source->animations[i];
        struct psc_animation to = {.first_channel = (uint32_t)c->channel_count};
        imp_name(to.name, from->name, "");
        for (uint32_t k = 0; k < from->channel_count; k++)
            if (!add_animated(c, &source->channels[from->first_channel + k], &to.duration_s, error))
                return false;
        to.channel_count = (uint32_t)c->channel_count - to.first_channel;
        psc_builder_add_motion(c->context->builder, PSC_ANIMATIONS, &to, 1);
    }
    psc_builder_add_motion(
        c->context->builder, PSC_CHANNELS, c->channels, (uint32_t)c->channel_count);
    return true;
}

static uint32_t *not_yet(size_t count)
{
    uint32_t *numbers = pen_alloc(count, sizeof *numbers);
    for (size_t i = 0; i < count; i++)
        numbers[i] = IMP_NOT_YET;
    return numbers;
}

bool imp_motion_close(struct imp_context *context, struct pen_error *error)
{
    const struct imp_motion *motion = context->motion;
    struct closing c = {.context = context,
        .nodes = not_yet(context->model->node_count),
        .materials = not_yet(context->model->material_count),
        .lights = not_yet(context->light_count),
        .samplers = not_yet(motion->source.sampler_count),
        .widths = not_yet(motion->source.sampler_count),
        .ends = pen_alloc(motion->source.sampler_count, sizeof *c.ends)};
    for (uint32_t i = 0; i < motion->source.sampler_count; i++)
        c.ends[i] = -INFINITY;
    number_nodes(&c);
    add_nodes(&c);
    add_rest(&c);
    add_veiled_lights(&c);
    bool done = add_animations(&c, error);
    free(c.nodes);
    free(c.materials);
    free(c.lights);
    free(c.samplers);
    free(c.widths);
    free(c.ends);
    free(c.channels);
    return done;
}
