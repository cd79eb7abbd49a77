#include "renderer/import/motion/motion.h"
#include "protocol/memory.h"
#include "renderer/blob/affine.h"
#include "renderer/import/motion/aim.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

void imp_local_matrix(const struct gltf_node *node, double out[12])
{
    if (!node->has_matrix) {
        psc_affine_trs((const float[3]){0, 0, 0}, node->rotation, node->scale, out);
        for (int i = 0; i < 3; i++) /* in full: far from the origin a float is coarse */
            out[4 * i + 3] = node->translation[i];
        return;
    }
    for (int r = 0; r < 3; r++)
        for (int c = 0; c < 4; c++)
            out[4 * r + c] = node->matrix[4 * c + r];
}

/* Parents and an order in which they come first; the nodes are a forest. */
static void order_nodes(const struct gltf_model *model, const uint32_t *roots, uint32_t root_count,
    struct imp_motion *motion)
{
    uint32_t n = model->node_count, next = 0, end = 0;
    motion->parents = pen_alloc(n, sizeof *motion->parents);
    motion->order = pen_alloc(n, sizeof *motion->order);
    for (uint32_t i = 0; i < n; i++)
        motion->parents[i] = -1;
    for (uint32_t i = 0; i < n; i++)
        for (uint32_t k = 0; k < model->nodes[i].child_count; k++)
            motion->parents[model->children[model->nodes[i].first_child + k]] = (int32_t)i;
    for (uint32_t i = 0; i < root_count; i++)
        motion->parents[roots[i]] = -1;
    for (uint32_t i = 0; i < n; i++)
        if (motion->parents[i] < 0)
            motion->order[end++] = i;
    for (; next < end; next++) {
        const struct gltf_node *node = &model->nodes[motion->order[next]];
        for (uint32_t k = 0; k < node->child_count; k++) {
            uint32_t child = (uint32_t)model->children[node->first_child + k];
            if (motion->parents[child] >= 0)
                motion->order[end++] = child;
        }
    }
}

static void find_worlds(const struct gltf_model *model, struct imp_motion *motion)
{
    motion->worlds = pen_alloc(model->node_count, sizeof *motion->worlds);
    for (uint32_t i = 0; i < model->node_count; i++) {
        uint32_t node = motion->order[i];
        double local[12];
        imp_local_matrix(&model->nodes[node], local);
        if (motion->parents[node] < 0)
            memcpy(motion->worlds[node], local, sizeof local);
        else
            psc_affine_multiply(motion->worlds[motion->parents[node]], local, motion->worlds[node]);
    }
}

static void mark(struct imp_context *context)
{
    struct imp_motion *motion = context->motion;
    uint32_t n = context->model->node_count;
    for (uint32_t i = 0; i < motion->source.channel_count; i++) {
        struct imp_aim aim = imp_aim(context, &motion->source.channels[i]);
        if (aim.target >= 0 && aim.target <= PSC_TO_NODE_VISIBLE)
            motion->moves[aim.item] = true;
        if (aim.target == PSC_TO_NODE_VISIBLE)
            motion->unveils[aim.item] = true;
        if (aim.target == PSC_TO_WEIGHTS && !aim.mesh)
            motion->weighted[aim.item] = true;
    }
    for (uint32_t i = 0; i < n; i++) {
        uint32_t node = motion->order[i];
        if (motion->parents[node] < 0)
            continue;
        motion->moves[node] |= motion->moves[motion->parents[node]];
        motion->unveils[node] |= motion->unveils[motion->parents[node]];
    }
}

bool imp_motion_open(struct imp_context *context, const uint32_t *roots, uint32_t root_count,
    struct pen_error *error)
{
    const struct gltf_model *model = context->model;
    struct imp_motion *motion = context->motion = pen_alloc_zero(1, sizeof *motion);
    if (!gltf_motion_read(&motion->source, context->document, error))
        return false;
    motion->moves = pen_alloc_zero(model->node_count, sizeof *motion->moves);
    motion->unveils = pen_alloc_zero(model->node_count, sizeof *motion->unveils);
    motion->weighted = pen_alloc_zero(model->node_count, sizeof *motion->weighted);
    motion->node_slots = pen_alloc_zero(model->node_count, sizeof *motion->node_slots);
    motion->mesh_slots = pen_alloc_zero(model->mesh_count, sizeof *motion->mesh_slots);
    motion->deformed = pen_alloc_zero(model->primitive_count, sizeof *motion->deformed);
    for (uint32_t i = 0; i < model->primitive_count; i++)
        motion->deformed[i].owner = -2;
    motion->skins = pen_alloc(motion->source.skin_count, sizeof *motion->skins);
    for (uint32_t i = 0; i < motion->source.skin_count; i++)
        motion->skins[i] = IMP_NOT_YET;
    motion->skin_matrices =
        pen_alloc_zero(motion->source.skin_count, sizeof *motion->skin_matrices);
    order_nodes(model, roots, root_count, motion);
    if (motion->source.skin_count)
        find_worlds(model, motion);
    mark(context);
    return true;
}

void imp_motion_free(struct imp_motion *motion)
{
    if (!motion)
        return;
    for (uint32_t i = 0; motion->skin_matrices && i < motion->source.skin_count; i++)
        free(motion->skin_matrices[i]);
    gltf_motion_finish(&motion->source);
    void *const owned[] = {motion->parents, motion->order, motion->moves, motion->unveils,
        motion->weighted, motion->worlds, motion->node_slots, motion->mesh_slots, motion->deformed,
        motion->skins, motion->skin_matrices, motion->psc_skins, motion->joints, motion->deforms,
        motion->riders, motion->weights, motion->lights, motion->cameras};
    for (size_t i = 0; i < sizeof owned / sizeof *owned; i++)
        free(owned[i]);
    free(motion);
}

static void add_rider(struct imp_motion *motion, const struct psc_rider *rider)
{
    motion->riders =
        pen_grow(motion->riders, &motion->rider_room, motion->rider_count + 1, sizeof *rider);
    motion->riders[motion->rider_count++] = *rider;
}

void imp_motion_ride_instance(struct imp_motion *motion, uint32_t node, uint32_t item,
    const double local[12], bool deforms, bool skinned)
{
    if (!motion->moves[node] && (!deforms || skinned))
        return;
    struct psc_rider rider = {.kind = PSC_RIDER_INSTANCE,
        .item = item,
        .node = node,
        .flags = skinned ? PSC_RIDER_SKINNED : 0,
        .local = {1, [5] = 1, [10] = 1}};
    for (int i = 0; local && i < 12; i++)
        rider.local[i] = (float)local[i];
    add_rider(motion, &rider);
}

void imp_motion_ride(struct imp_motion *motion, uint32_t node, enum psc_rider_kind kind,
    uint32_t item, const float size[2])
{
    if (!motion->moves[node])
        return;
    struct psc_rider rider = {.kind = kind,
        .item = item,
        .node = node,
        .local = {1, [5] = 1, [10] = 1},
        .size = {size[0], size[1]}};
    add_rider(motion, &rider);
}

static void use(struct imp_use **list, size_t *count, size_t *room, struct imp_use item)
{
    *list = pen_grow(*list, room, *count + 1, sizeof **list);
    (*list)[(*count)++] = item;
}

void imp_motion_use_light(struct imp_motion *motion, struct imp_use item)
{
    use(&motion->lights, &motion->light_count, &motion->light_room, item);
}

void imp_motion_use_camera(struct imp_motion *motion, struct imp_use item)
{
    use(&motion->cameras, &motion->camera_count, &motion->camera_room, item);
}
