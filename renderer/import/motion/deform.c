/* Primitives with a skin or morph targets: added as they are before deforming, together with how
 * they deform; renderer/pose makes the rest pose of them. */
#include "protocol/memory.h"
#include "renderer/blob/affine.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/geometry/accessor.h"
#include "renderer/import/convert/mesh.h"
#include "renderer/import/convert/variants.h"
#include "renderer/import/motion/deform.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

/* A primitive on its way: how its vertices deform, beside the geometry. */
struct deforming {
    struct imp_geometry geometry;
    struct psc_influence *influences;
    uint32_t influence_count;
    struct psc_delta **targets;
    uint32_t *delta_counts;
    uint32_t target_count;
    int32_t skin; /* -1: none */
};

static void finish(struct deforming *d)
{
    imp_geometry_finish(&d->geometry);
    free(d->influences);
    for (uint32_t t = 0; t < d->target_count; t++)
        free(d->targets[t]);
    free(d->targets);
    free(d->delta_counts);
}

static bool refuse(
    enum pen_code code, const char *array, int64_t item, const char *what, struct pen_error *error)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/%s/%lld", array, (long long)item);
    return pen_fail(error, code, pointer, "glTF %s: %s.", pointer, what);
}

static bool is_skinned(const struct gltf_node *node, const struct gltf_primitive *primitive)
{
    return node->skin >= 0 && primitive->joints[0] >= 0 && primitive->weights[0] >= 0;
}

/* The morph weights that a node starts with. */
static void first_weights(const struct imp_context *context, const struct gltf_node *node,
    uint32_t *first, uint32_t *count)
{
    const struct gltf_mesh *mesh = &context->model->meshes[node->mesh];
    bool own = node->weight_count > 0;
    *first = own ? node->first_weight : mesh->first_weight;
    *count = own ? node->weight_count : mesh->weight_count;
}

bool imp_deforms(const struct imp_context *context, const struct gltf_node *node, uint32_t number)
{
    const struct gltf_primitive *primitive = &context->model->primitives[number];
    uint32_t first, count;
    if (is_skinned(node, primitive))
        return true;
    if (!primitive->target_count)
        return false;
    first_weights(context, node, &first, &count);
    bool moved = context->motion->source.animation_count > 0;
    for (uint32_t i = 0; i < count; i++)
        moved |= context->model->weights[first + i] != 0;
    return moved;
}

/* The weights' places in the blob; the primitives of a mesh share them. */
static struct imp_slots *slots_of(struct imp_context *context, uint32_t node, uint32_t targets)
{
    struct imp_motion *motion = context->motion;
    const struct gltf_node *from = &context->model->nodes[node];
    bool own = from->weight_count || motion->weighted[node];
    struct imp_slots *slots = own ? &motion->node_slots[node] : &motion->mesh_slots[from->mesh];
    uint32_t first, count;
    if (slots->count)
        return slots;
    const struct gltf_mesh *mesh = &context->model->meshes[from->mesh];
    for (uint32_t i = 0; i < mesh->primitive_count; i++) {
        uint32_t n = context->model->primitives[mesh->first_primitive + i].target_count;
        targets = n > targets ? n : targets;
    }
    *slots = (struct imp_slots){(uint32_t)motion->weight_count, targets};
    motion->weights = pen_grow(motion->weights, &motion->weight_room,
        motion->weight_count + targets, sizeof *motion->weights);
    first_weights(context, from, &first, &count);
    for (uint32_t i = 0; i < targets; i++)
        motion->weights[motion->weight_count++] =
            i < count ? context->model->weights[first + i] : 0;
    return slots;
}

static bool read_matrices(
    struct imp_context *context, int32_t number, double (**out)[12], struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    const struct gltf_skin *skin = &motion->source.skins[number];
    struct imp_reader reader;
    if (skin->inverse_bind >= 0) {
        if (!imp_reader_init(&reader, context->document, context->model, skin->inverse_bind, error))
            return false;
        if (reader.components != 16 || reader.component != 5126)
            return refuse(
                PEN_INVALID, "skins", number, "its matrices must be of type MAT4 and float", error);
        if (reader.count < skin->joint_count)
            return refuse(PEN_INVALID, "skins", number, "it has fewer matrices than joints", error);
    }
    motion->joints = pen_grow(motion->joints, &motion->joint_room,
        motion->joint_count + skin->joint_count, sizeof *motion->joints);
    *out = pen_alloc_zero(skin->joint_count, sizeof **out);
    for (uint32_t i = 0; i < skin->joint_count; i++) {
        struct psc_joint *joint = &motion->joints[motion->joint_count + i];
        float m[16] = {1, [5] = 1, [10] = 1};
        double inverse[12];
        joint->node = motion->source.joints[skin->first_joint + i];
        if (skin->inverse_bind >= 0)
            imp_read_floats(&reader, i, m, 16);
        for (int k = 0; k < 12; k++) {
            joint->inverse_bind[k] = m[4 * (k % 4) + k / 4];
            inverse[k] = joint->inverse_bind[k];
            if (!(fabs(inverse[k]) <= 1e12))
                return refuse(
                    PEN_INVALID, "skins", number, "a matrix is not finite or beyond 1e12", error);
        }
        psc_affine_multiply(motion->worlds[joint->node], inverse, (*out)[i]);
    }
    return true;
}

/* The blob's number of a skin; its joints follow each other there. */
static bool add_skin(
    struct imp_context *context, int32_t number, uint32_t *psc, struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    *psc = motion->skins[number];
    if (*psc != IMP_NOT_YET)
        return true;
    uint32_t count = motion->source.skins[number].joint_count;
    if (!read_matrices(context, number, &motion->skin_matrices[number], error))
        return false;
    motion->psc_skins = pen_grow(motion->psc_skins, &motion->psc_skin_room,
        motion->psc_skin_count + 1, sizeof *motion->psc_skins);
    motion->psc_skins[motion->psc_skin_count] =
        (struct psc_skin){(uint32_t)motion->joint_count, count};
    motion->joint_count += count;
    *psc = motion->skins[number] = (uint32_t)motion->psc_skin_count++;
    return true;
}

/* Weights are made to add up to 1; a vertex without any hangs on its first joint. */
static bool complete_influences(struct psc_influence *influences, uint32_t count, uint32_t joints)
{
    double sum = 0;
    for (uint32_t i = 0; i < count; i++)
        sum += influences[i].weight;
    if (!(sum > 0)) {
        influences[0].weight = 1;
        sum = 1;
    }
    for (uint32_t i = 0; i < count; i++) {
        influences[i].weight = (float)(influences[i].weight / sum);
        if (influences[i].weight > 0 && influences[i].joint >= joints)
            return false;
        if (influences[i].joint >= joints)
            influences[i].joint = 0;
    }
    return true;
}

static bool read_influences(struct imp_context *context, struct deforming *d,
    const struct gltf_primitive *from, struct pen_error *error)
{
    const struct imp_geometry *g = &d->geometry;
    uint32_t joint_count = context->motion->source.skins[d->skin].joint_count;
    uint32_t sets = from->joints[1] >= 0 && from->weights[1] >= 0 ? 2 : 1;
    struct imp_reader joints[2], weights[2];
    for (uint32_t s = 0; s < sets; s++) {
        if (!imp_reader_init(
                &joints[s], context->document, context->model, from->joints[s], error) ||
            !imp_reader_init(
                &weights[s], context->document, context->model, from->weights[s], error))
            return false;
        if (joints[s].components != 4 || weights[s].components != 4 ||
            joints[s].count < g->used_of || weights[s].count < g->used_of)
            return refuse(PEN_INVALID, "accessors", from->joints[s],
                "the joints or weights of a skin do not suit their use", error);
        if (joints[s].component != 5121 && joints[s].component != 5123 &&
            joints[s].component != 5125)
            return refuse(PEN_INVALID, "accessors", from->joints[s],
                "the joints of a vertex must be unsigned integers", error);
        joints[s].normalized = false;
    }
    d->influence_count = 4 * sets;
    d->influences =
        pen_alloc_zero((size_t)g->vertex_count * d->influence_count, sizeof *d->influences);
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        struct psc_influence *to = d->influences + (size_t)i * d->influence_count;
        for (uint32_t s = 0; s < sets; s++) {
            float number[4], weight[4];
            imp_read_floats(&joints[s], g->used[i], number, 4);
            imp_read_floats(&weights[s], g->used[i], weight, 4);
            for (uint32_t k = 0; k < 4; k++) {
                if (!isfinite(weight[k]) || !(number[k] >= 0 && number[k] < 4e9f))
                    return refuse(PEN_INVALID, "accessors", from->weights[s],
                        "a joint or weight is not a number", error);
                to[4 * s + k].weight = fmaxf(weight[k], 0);
                to[4 * s + k].joint = (uint32_t)number[k];
            }
        }
        if (!complete_influences(to, d->influence_count, joint_count))
            return refuse(PEN_INVALID, "accessors", from->joints[0],
                "a vertex hangs on a joint that its skin does not have", error);
    }
    return true;
}

static bool read_target(struct imp_context *context, struct deforming *d, uint32_t t,
    const struct gltf_target *from, struct pen_error *error)
{
    const struct imp_geometry *g = &d->geometry;
    struct imp_motion *motion = context->motion;
    bool surface = !g->points; /* else the normals are those of solids around points */
    const int32_t accessors[3] = {from->position, surface && g->normals ? from->normal : -1,
        surface && g->tangents ? from->tangent : -1};
    float(*values[3])[3] = {NULL, NULL, NULL};
    bool done = true;
    uint32_t count = 0;
    for (int k = 0; done && k < 3; k++)
        done = imp_gather(context, g, accessors[k], 3, 3, &values[k], error);
    struct psc_delta *deltas = pen_alloc_zero(done ? g->vertex_count : 0, sizeof *deltas);
    for (uint32_t i = 0; done && i < g->vertex_count; i++) {
        struct psc_delta delta = {.vertex = i};
        float *parts[3] = {delta.position, delta.normal, delta.tangent};
        bool moves = false;
        for (int k = 0; k < 3; k++)
            for (int c = 0; values[k] && c < 3; c++) {
                parts[k][c] = values[k][i][c];
                moves |= parts[k][c] != 0;
                if (!(fabsf(parts[k][c]) <= 1e12f))
                    done = refuse(PEN_INVALID, "accessors", accessors[k],
                        "a morph target is not finite or beyond 1e12 m", error);
            }
        if (moves)
            deltas[count++] = delta;
    }
    for (int k = 0; k < 3; k++)
        free(values[k]);
    d->targets[t] = pen_realloc_array(deltas, count, sizeof *deltas);
    d->delta_counts[t] = count;
    motion->delta_count += count;
    return done &&
           (motion->delta_count <= IMP_MAX_DELTAS ||
               pen_fail(error, PEN_TOO_BIG, "",
                   "The scene's morph targets move more than %llu vertices.", IMP_MAX_DELTAS));
}

static bool read_targets(struct imp_context *context, struct deforming *d,
    const struct gltf_primitive *from, struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    uint32_t n = from->target_count;
    motion->target_count += n;
    motion->morph_values += (uint64_t)n * d->geometry.vertex_count;
    motion->vertex_count += d->geometry.vertex_count;
    if (motion->vertex_count > IMP_MAX_DEFORMING)
        return pen_fail(error, PEN_TOO_BIG, "",
            "The scene has more than %llu vertices with a skin or morph targets.",
            IMP_MAX_DEFORMING);
    if (motion->target_count > IMP_MAX_MORPH_TARGETS || motion->morph_values > IMP_MAX_MORPH_VALUES)
        return pen_fail(error, PEN_TOO_BIG, "",
            "The scene has more than %u morph targets, or more than %llu vertices in all of them.",
            IMP_MAX_MORPH_TARGETS, IMP_MAX_MORPH_VALUES);
    d->targets = pen_alloc_zero(n, sizeof *d->targets);
    d->delta_counts = pen_alloc_zero(n, sizeof *d->delta_counts);
    for (; d->target_count < n; d->target_count++) {
        uint32_t t = d->target_count;
        if (!read_target(context, d, t, &context->model->targets[from->first_target + t], error)) {
            d->target_count++; /* it owns what was read */
            return false;
        }
    }
    return true;
}

static void grow(double min[3], double max[3], const double p[3])
{
    for (int k = 0; k < 3; k++) {
        min[k] = fmin(min[k], p[k]);
        max[k] = fmax(max[k], p[k]);
    }
}

/* Cameras look at the middle of the scene at rest, and are made before its pose is. Of what joints
 * place in the world, of what only morphs as the primitive's. */
static void find_bounds(struct imp_context *context, const struct deforming *d,
    const struct imp_slots *slots, uint32_t number, struct imp_deformed_primitive *added)
{
    const struct imp_geometry *g = &d->geometry;
    double *min = added->min, *max = added->max;
    double(*points)[3] = pen_alloc(g->vertex_count, sizeof *points);
    for (int k = 0; k < 3; k++)
        min[k] = INFINITY, max[k] = -INFINITY;
    for (uint32_t i = 0; i < g->vertex_count; i++)
        for (int k = 0; k < 3; k++)
            points[i][k] = g->positions[i][k];
    for (uint32_t t = 0; t < d->target_count; t++)
        for (uint32_t i = 0; i < d->delta_counts[t]; i++)
            for (int k = 0; k < 3; k++)
                points[d->targets[t][i].vertex][k] +=
                    (double)context->motion->weights[slots->first + t] *
                    d->targets[t][i].position[k];
    for (uint32_t i = 0; i < g->vertex_count; i++) {
        double m[12] = {0}, p[3];
        for (uint32_t k = 0; k < d->influence_count; k++) {
            const struct psc_influence *f = &d->influences[(size_t)i * d->influence_count + k];
            const double *joint = context->motion->skin_matrices[d->skin][f->joint];
            for (int j = 0; j < 12; j++)
                m[j] += (double)f->weight * joint[j];
        }
        psc_affine_point(m, points[i], p);
        grow(min, max, d->skin >= 0 ? p : points[i]);
    }
    free(points);
    memcpy(context->primitive_bounds[number].min, min, sizeof added->min);
    memcpy(context->primitive_bounds[number].max, max, sizeof added->max);
}

static bool add(struct imp_context *context, struct deforming *d, uint32_t node, uint32_t number,
    struct imp_deformed_primitive *added, struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    const struct imp_slots none = {0, 0}, *slots = &none;
    struct psc_deform deform;
    uint32_t skin = 0;
    if (d->skin >= 0 && !add_skin(context, d->skin, &skin, error))
        return false;
    if (d->target_count)
        slots = slots_of(context, node, d->target_count);
    find_bounds(context, d, slots, number, added);
    const struct psc_mesh mesh = imp_geometry_mesh(context, number, &d->geometry);
    const struct psc_mesh_deform how = {.influences = d->influences,
        .influence_count = d->influence_count,
        .targets = (const struct psc_delta *const *)d->targets,
        .delta_counts = d->delta_counts,
        .target_count = d->target_count};
    if (!psc_builder_add_deforming(context->builder, &mesh, &how, &deform, error))
        return false;
    imp_variants_note(context, number, deform.primitive);
    deform.skin = d->skin >= 0 ? (int32_t)skin : -1;
    deform.first_weight = slots->first;
    motion->deforms =
        pen_grow(motion->deforms, &motion->deform_room, motion->deform_count + 1, sizeof deform);
    motion->deforms[motion->deform_count++] = deform;
    added->psc = deform.primitive;
    return true;
}

bool imp_add_deforming(struct imp_context *context, uint32_t node, uint32_t number,
    struct imp_deformed_primitive *added, struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    const struct gltf_node *from = &context->model->nodes[node];
    const struct gltf_primitive *primitive = &context->model->primitives[number];
    struct deforming d = {.skin = is_skinned(from, primitive) ? from->skin : -1};
    bool own = from->weight_count || motion->weighted[node];
    struct imp_deformed *known = &motion->deformed[number];
    int64_t owner = own ? (int64_t)node : -1;
    *added = (struct imp_deformed_primitive){.psc = IMP_SKIPPED, .skinned = d.skin >= 0};
    if (!added->skinned && known->owner == owner) {
        const struct primitive_bounds *box = &context->primitive_bounds[number];
        added->psc = known->psc;
        memcpy(added->min, box->min, sizeof added->min);
        memcpy(added->max, box->max, sizeof added->max);
        return true;
    }
    bool done = imp_geometry_read(context, number, &d.geometry, error);
    if (done && d.geometry.index_count) {
        imp_geometry_from_zero(&d.geometry);
        imp_geometry_optimise(&d.geometry, &context->optimiser_work);
        done = (!added->skinned || read_influences(context, &d, primitive, error)) &&
               read_targets(context, &d, primitive, error) &&
               add(context, &d, node, number, added, error);
    }
    finish(&d);
    if (done && !added->skinned)
        *known = (struct imp_deformed){owner, added->psc};
    return done;
}

void imp_deforming_instance(struct imp_motion *motion, uint32_t instance)
{
    motion->deforms[motion->deform_count - 1].instance = (int32_t)instance;
}
