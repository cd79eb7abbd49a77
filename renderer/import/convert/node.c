#include "renderer/import/convert/node.h"
#include "protocol/memory.h"
#include "renderer/import/geometry/accessor.h"
#include "renderer/blob/affine.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/camera.h"
#include "renderer/import/convert/light.h"
#include "renderer/import/convert/mesh.h"
#include "renderer/import/motion/close.h"
#include "renderer/import/motion/deform.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

#define LARGEST 1e12 /* of a matrix element; with positions up to 1e12 m all stays finite */

static bool node_fail(struct pen_error *error, enum pen_code code, uint32_t node, const char *what)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/nodes/%u", node);
    return pen_fail(error, code, pointer, "glTF %s: %s.", pointer, what);
}

struct roots {
    uint32_t *nodes, count;
};

/* A scene should list only nodes without parents. A node whose parent it draws as well is drawn
 * with it; one whose parent it does not draw is drawn without, as the common viewers do. `listed`
 * is overwritten. */
static void choose_roots(
    struct imp_context *context, const uint32_t *parent, uint32_t *listed, struct roots *roots)
{
    const struct gltf_model *model = context->model;
    memset(listed, 0, model->node_count * sizeof *listed);
    for (uint32_t i = 0; i < model->root_count; i++)
        listed[model->roots[i]]++;
    roots->nodes = pen_alloc_zero(model->root_count, sizeof *roots->nodes);
    uint32_t twice = UINT32_MAX, child = UINT32_MAX, lone = UINT32_MAX;
    for (uint32_t i = 0; i < model->root_count; i++) {
        uint32_t node = (uint32_t)model->roots[i], at = parent[node];
        for (uint32_t up = 0; at && !listed[at - 1] && up < IMP_MAX_NODE_DEPTH; up++)
            at = parent[at - 1];
        bool drawn_above = at && listed[at - 1];
        if (drawn_above && child == UINT32_MAX)
            child = node;
        else if (!drawn_above && parent[node] && lone == UINT32_MAX)
            lone = node;
        else if (listed[node] > 1 && listed[node] != UINT32_MAX && twice == UINT32_MAX)
            twice = node;
        if (!drawn_above && listed[node] != UINT32_MAX)
            roots->nodes[roots->count++] = node;
        listed[node] = UINT32_MAX; /* has been here */
    }
    if (child != UINT32_MAX)
        imp_warn(context,
            "The scene lists node %u beside its parent: it is drawn once, where its parent is.",
            child);
    if (lone != UINT32_MAX)
        imp_warn(context,
            "The scene lists node %u, but not its parent %u: it is drawn without it, as other "
            "viewers do.",
            lone, parent[lone] - 1);
    if (twice != UINT32_MAX)
        imp_warn(context, "The scene lists node %u twice: it is drawn once.", twice);
}

/* Every node has at most one parent and none is its own ancestor: then the walk below ends. */
static bool check_forest(struct imp_context *context, struct roots *roots, struct pen_error *error)
{
    const struct gltf_model *model = context->model;
    uint32_t n = model->node_count;
    uint32_t *parent = pen_alloc_zero(n, sizeof *parent); /* plus 1; 0: none */
    uint32_t *seen = pen_alloc_zero(n, sizeof *seen);     /* by the climb from this node, plus 1 */
    bool done = true;
    for (uint32_t i = 0; done && i < n; i++)
        for (uint32_t k = 0; done && k < model->nodes[i].child_count; k++) {
            uint32_t child = (uint32_t)model->children[model->nodes[i].first_child + k];
            if (child >= n || parent[child])
                done = node_fail(error, PEN_INVALID, child, "it has more than one parent");
            else
                parent[child] = i + 1;
        }
    for (uint32_t i = 0; done && i < model->root_count; i++)
        if ((uint32_t)model->roots[i] >= n)
            done = node_fail(error, PEN_INVALID, (uint32_t)model->roots[i], "it does not exist");
    for (uint32_t i = 0; done && i < n; i++) {
        uint32_t at = i + 1;
        while (at && !seen[at - 1]) {
            seen[at - 1] = i + 1;
            at = parent[at - 1];
        }
        if (at && seen[at - 1] == i + 1)
            done = node_fail(error, PEN_INVALID, at - 1, "it is its own ancestor");
    }
    if (done)
        choose_roots(context, parent, seen, roots);
    free(parent);
    free(seen);
    return done;
}

static void grow_box(const double from_min[3], const double from_max[3], const double world[12],
    double min[3], double max[3])
{
    for (int corner = 0; corner < 8; corner++) {
        double p[3], q[3];
        for (int k = 0; k < 3; k++)
            p[k] = corner >> k & 1 ? from_max[k] : from_min[k];
        psc_affine_point(world, p, q);
        for (int k = 0; k < 3; k++) {
            min[k] = fmin(min[k], q[k]);
            max[k] = fmax(max[k], q[k]);
        }
    }
}

static uint32_t place_deforming(
    struct imp_context *context, const struct imp_deformed_primitive *added, const double world[12])
{
    static const double identity[12] = {1, [5] = 1, [10] = 1};
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    if (added->skinned)
        return psc_builder_place_deforming(
            context->builder, added->psc, identity, added->min, added->max);
    grow_box(added->min, added->max, world, min, max);
    return psc_builder_place_deforming(context->builder, added->psc, world, min, max);
}

/* A primitive whose vertices move. */
static bool add_deforming_at(struct imp_context *context, uint32_t number, uint32_t primitive,
    const double world[12], bool hidden, bool *skinned, uint32_t *instance, struct pen_error *error)
{
    struct imp_deformed_primitive added;
    if (!imp_add_deforming(context, number, primitive, &added, error))
        return false;
    *skinned = added.skinned;
    *instance = IMP_SKIPPED;
    if (added.psc == IMP_SKIPPED)
        return true;
    *instance = place_deforming(context, &added, world);
    if (!added.skinned)
        return true;
    imp_deforming_instance(context->motion, *instance);
    for (int k = 0; !hidden && k < 3; k++) {
        context->bounds_min[k] = fmin(context->bounds_min[k], added.min[k]);
        context->bounds_max[k] = fmax(context->bounds_max[k], added.max[k]);
    }
    return true;
}

/* One primitive of a node's mesh at a place in the world. `local`: between the node and there, or
 * NULL. */
static bool add_primitive_at(struct imp_context *context, uint32_t number, uint32_t primitive,
    const double world[12], const double local[12], bool hidden, struct pen_error *error)
{
    uint32_t psc, instance = IMP_SKIPPED;
    bool skinned = false;
    bool deforms = imp_deforms(context, &context->model->nodes[number], primitive);
    if (deforms) {
        if (!add_deforming_at(
                context, number, primitive, world, hidden, &skinned, &instance, error))
            return false;
    } else {
        if (!imp_primitive(context, primitive, &psc, error))
            return false;
        if (psc != IMP_SKIPPED)
            instance = psc_builder_place_instance(context->builder, psc, world);
    }
    if (instance == IMP_SKIPPED)
        return true;
    const struct primitive_bounds *box = &context->primitive_bounds[primitive];
    if (hidden)
        psc_builder_hide_instance(context->builder, instance);
    else if (!skinned)
        grow_box(box->min, box->max, world, context->bounds_min, context->bounds_max);
    imp_motion_ride_instance(context->motion, number, instance, local, deforms, skinned);
    return true;
}

static bool add_mesh_at(struct imp_context *context, uint32_t number, const double world[12],
    const double local[12], bool hidden, struct pen_error *error)
{
    const struct gltf_node *node = &context->model->nodes[number];
    const struct gltf_mesh *mesh = &context->model->meshes[node->mesh];
    for (int i = 0; i < 12; i++)
        if (!(fabs(world[i]) <= LARGEST))
            return node_fail(
                error, PEN_INVALID, number, "its place or size in the world is beyond 1e12 m");
    if (mesh->primitive_count > IMP_MAX_INSTANCES - context->instance_count)
        return node_fail(
            error, PEN_TOO_BIG, number, "the scene draws too many instances of its meshes");
    context->instance_count += mesh->primitive_count;
    for (uint32_t i = 0; i < mesh->primitive_count; i++)
        if (!add_primitive_at(
                context, number, mesh->first_primitive + i, world, local, hidden, error))
            return false;
    return true;
}

/* EXT_mesh_gpu_instancing: one instance for each element of the node's TRS accessors. */
static bool add_instances(struct imp_context *context, uint32_t number, const double world[12],
    bool hidden, struct pen_error *error)
{
    const struct gltf_node *node = &context->model->nodes[number];
    const int32_t accessors[3] = {
        node->instance_translation, node->instance_rotation, node->instance_scale};
    const uint32_t components[3] = {3, 4, 3};
    struct imp_reader readers[3];
    uint32_t count = 0;
    for (int k = 0; k < 3; k++) {
        if (accessors[k] < 0)
            continue;
        if (!imp_reader_init(&readers[k], context->document, context->model, accessors[k], error))
            return false;
        if (readers[k].components != components[k] || (count && readers[k].count != count))
            return node_fail(error, PEN_INVALID, number,
                "the accessors of EXT_mesh_gpu_instancing do not fit together");
        count = readers[k].count;
    }
    if (count > IMP_MAX_INSTANCES)
        return node_fail(
            error, PEN_TOO_BIG, number, "the scene draws too many instances of its meshes");
    for (uint32_t i = 0; i < count; i++) {
        float t[3] = {0, 0, 0}, q[4] = {0, 0, 0, 1}, s[3] = {1, 1, 1};
        float *out[3] = {t, q, s};
        for (int k = 0; k < 3; k++)
            if (accessors[k] >= 0)
                imp_read_floats(&readers[k], i, out[k], components[k]);
        double local[12], placed[12];
        psc_affine_trs(t, q, s, local);
        psc_affine_multiply(world, local, placed);
        if (!add_mesh_at(context, number, placed, local, hidden, error))
            return false;
    }
    return true;
}

/* `punctual`: its number among those of KHR_lights_punctual, or -1. */
static void add_light(struct imp_context *context, const struct gltf_light *light, int32_t punctual,
    uint32_t number, const double world[12], bool hidden)
{
    float size[2];
    uint32_t psc = imp_add_light(context, light, &context->model->nodes[number], world, hidden);
    if (psc == IMP_SKIPPED)
        return;
    imp_light_size(light, size);
    imp_motion_ride(context->motion, number, PSC_RIDER_LIGHT, psc, size);
    if (punctual >= 0)
        imp_motion_use_light(context->motion, (struct imp_use){(uint32_t)punctual, psc, number});
}

static void add_camera(struct imp_context *context, uint32_t number, const double world[12])
{
    const struct gltf_node *node = &context->model->nodes[number];
    const struct gltf_camera *camera = &context->model->cameras[node->camera];
    float ahead[2];
    uint32_t psc = imp_add_camera(context, camera, node, world, ahead);
    if (psc == IMP_SKIPPED)
        return;
    imp_motion_ride(context->motion, number, PSC_RIDER_CAMERA, psc, ahead);
    if (camera->perspective)
        imp_motion_use_camera(
            context->motion, (struct imp_use){(uint32_t)node->camera, psc, number});
}

/* Cameras wait for the bounds of everything. */
struct waiting {
    uint32_t node;
    double world[12];
};

struct walk {
    struct imp_context *context;
    struct waiting *cameras;
    uint32_t camera_count;
};

static bool visit(struct walk *walk, uint32_t number, const double world[12], bool hidden,
    struct pen_error *error)
{
    struct imp_context *context = walk->context;
    const struct gltf_model *model = context->model;
    const struct gltf_node *node = &model->nodes[number];
    bool instanced = node->instanced && node->skin < 0;
    bool shown = !hidden || context->motion->unveils[number];
    if (node->instanced && node->skin >= 0)
        imp_warn(context, "Skinned meshes are drawn once, not instanced.");
    if (shown && node->mesh >= 0 && (uint32_t)node->mesh < model->mesh_count &&
        !(instanced ? add_instances(context, number, world, hidden, error)
                    : add_mesh_at(context, number, world, NULL, hidden, error)))
        return false;
    if (shown && node->light >= 0 && (uint32_t)node->light < model->light_count)
        add_light(context, &model->lights[node->light], node->light, number, world, hidden);
    if (!hidden && node->area_light >= 0 && (uint32_t)node->area_light < model->area_light_count)
        add_light(context, &model->area_lights[node->area_light], -1, number, world, false);
    if (node->camera >= 0 && (uint32_t)node->camera < model->camera_count &&
        walk->camera_count <= IMP_MAX_LIGHTS) { /* the one too many draws the warning */
        struct waiting *camera = &walk->cameras[walk->camera_count++];
        camera->node = number;
        memcpy(camera->world, world, sizeof camera->world);
    }
    return true;
}

struct frame {
    uint32_t node, next_child;
    bool hidden; /* KHR_node_visibility: it, or a node above; cameras are there nevertheless */
    double world[12];
};

static bool walk_tree(
    struct walk *walk, struct frame *stack, uint32_t root, struct pen_error *error)
{
    const struct gltf_model *model = walk->context->model;
    uint32_t depth = 1;
    stack[0].node = root;
    stack[0].next_child = 0;
    stack[0].hidden = model->nodes[root].hidden;
    imp_local_matrix(&model->nodes[root], stack[0].world);
    if (!visit(walk, root, stack[0].world, stack[0].hidden, error))
        return false;
    while (depth) {
        struct frame *top = &stack[depth - 1];
        const struct gltf_node *node = &model->nodes[top->node];
        if (top->next_child == node->child_count) {
            depth--;
            continue;
        }
        uint32_t child = (uint32_t)model->children[node->first_child + top->next_child++];
        if (depth == IMP_MAX_NODE_DEPTH)
            return node_fail(error, PEN_TOO_BIG, child, "the node hierarchy is too deep");
        struct frame *next = &stack[depth++];
        double local[12];
        next->node = child;
        next->next_child = 0;
        next->hidden = top->hidden || model->nodes[child].hidden;
        imp_local_matrix(&model->nodes[child], local);
        psc_affine_multiply(top->world, local, next->world);
        if (!visit(walk, child, next->world, next->hidden, error))
            return false;
    }
    return true;
}

bool imp_add_nodes(struct imp_context *context, struct pen_error *error)
{
    struct roots roots = {0};
    if (!check_forest(context, &roots, error) ||
        !imp_motion_open(context, roots.nodes, roots.count, error)) {
        free(roots.nodes);
        return false;
    }
    struct walk walk = {
        .context = context, .cameras = pen_alloc_zero(IMP_MAX_LIGHTS + 1, sizeof *walk.cameras)};
    struct frame *stack = pen_alloc_zero(IMP_MAX_NODE_DEPTH, sizeof *stack);
    bool done = true;
    for (uint32_t i = 0; done && i < roots.count; i++)
        done = walk_tree(&walk, stack, roots.nodes[i], error);
    for (uint32_t i = 0; done && i < walk.camera_count; i++)
        add_camera(context, walk.cameras[i].node, walk.cameras[i].world);
    done = done && imp_motion_close(context, error);
    free(roots.nodes);
    free(stack);
    free(walk.cameras);
    return done;
}
