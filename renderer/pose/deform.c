/* Morph targets, then skins (glTF 2.0, 3.7.2.2 and 3.7.3.3), into the posed arrays. */
#include "protocol/memory.h"
#include "renderer/blob/bounds.h"
#include "renderer/pose/internal.h"
#include <stdlib.h>
#include <string.h>

#define FARTHEST 1e12 /* m, as in the blob */

/* A vertex while it is worked on. */
struct vertex {
    double position[3], normal[3], tangent[3];
};

/* The cofactor matrix of m's linear part turns normals; the sign keeps them on their side when m
 * mirrors. Returns the determinant. */
static double turn_normal(const double m[12], const double n[3], double out[3])
{
    double cofactors[9];
    for (int r = 0; r < 3; r++) {
        const double *a = m + 4 * ((r + 1) % 3), *b = m + 4 * ((r + 2) % 3);
        for (int c = 0; c < 3; c++)
            cofactors[3 * r + c] =
                a[(c + 1) % 3] * b[(c + 2) % 3] - a[(c + 2) % 3] * b[(c + 1) % 3];
    }
    double determinant = m[0] * cofactors[0] + m[1] * cofactors[1] + m[2] * cofactors[2];
    double side = determinant < 0 ? -1 : 1;
    for (int r = 0; r < 3; r++)
        out[r] = side * (cofactors[3 * r] * n[0] + cofactors[3 * r + 1] * n[1] +
                            cofactors[3 * r + 2] * n[2]);
    return determinant;
}

static void skin_vertex(const double (*joints)[12], const struct psc_influence *influences,
    uint32_t count, struct vertex *v, int *sides)
{
    double m[12] = {0}, sum = 0;
    struct vertex out;
    for (uint32_t i = 0; i < count; i++)
        sum += influences[i].weight; /* not quite 1, which far from the origin is seen */
    for (uint32_t i = 0; i < count; i++) {
        const double *joint = joints[influences[i].joint], weight = influences[i].weight / sum;
        for (int k = 0; weight > 0 && k < 12; k++)
            m[k] += weight * joint[k];
    }
    psc_affine_point(m, v->position, out.position);
    *sides += turn_normal(m, v->normal, out.normal) < 0 ? -1 : 1;
    for (int r = 0; r < 3; r++)
        out.tangent[r] =
            m[4 * r] * v->tangent[0] + m[4 * r + 1] * v->tangent[1] + m[4 * r + 2] * v->tangent[2];
    *v = out;
}

static bool store_direction(const double v[3], bool mirrored, int16_t out[4])
{
    double length = sqrt(v[0] * v[0] + v[1] * v[1] + v[2] * v[2]);
    if (!(length > 1e-30 && length < 1e300))
        return false; /* what stands there stays */
    for (int k = 0; k < 3; k++)
        out[k] = (int16_t)lrint((mirrored && k == 0 ? -1 : 1) * v[k] / length * 32767);
    return true;
}

static void load(struct vertex *v, const struct psc_bind *bind, const float offset[3])
{
    for (int k = 0; k < 3; k++) {
        v->position[k] = (double)bind->position[k] + offset[k];
        v->normal[k] = bind->normal[k];
        v->tangent[k] = bind->tangent[k];
    }
}

static void morph(struct vertex *vertices, const struct psc_motion *m, const struct psc_deform *d,
    const float *weights)
{
    for (uint32_t t = 0; t < d->target_count; t++) {
        const struct psc_target *target = &m->targets[d->first_target + t];
        double w = weights[d->first_weight + t];
        for (uint32_t i = 0; w != 0 && i < target->delta_count; i++) {
            const struct psc_delta *delta = &m->deltas[target->first_delta + i];
            struct vertex *v = &vertices[delta->vertex];
            for (int k = 0; k < 3; k++) {
                v->position[k] += w * delta->position[k];
                v->normal[k] += w * delta->normal[k];
                v->tangent[k] += w * delta->tangent[k];
            }
        }
    }
}

static void flat_normals(struct pose *pose, const struct psc_primitive *p)
{
    const uint32_t *indices = pose->rest->indices + p->first_index;
    for (uint32_t i = 0; i < p->index_count; i += 3) {
        double n[3];
        if (!psc_triangle_normal(pose->positions[indices[i]], pose->positions[indices[i + 1]],
                pose->positions[indices[i + 2]], n))
            continue;
        for (int c = 0; c < 3; c++)
            store_direction(n, false, pose->attributes[indices[i + (uint32_t)c]].normal);
    }
}

static void find_bounds(struct pose *pose, struct psc_primitive *p)
{
    for (uint32_t i = 0; i < p->vertex_count; i++)
        for (int k = 0; k < 3; k++) {
            float x = pose->positions[p->first_vertex + i][k];
            p->bounds_min[k] = !i || x < p->bounds_min[k] ? x : p->bounds_min[k];
            p->bounds_max[k] = !i || x > p->bounds_max[k] ? x : p->bounds_max[k];
        }
    for (uint32_t i = 0; i < p->meshlet_count; i++) {
        struct psc_meshlet *m = &pose->meshlets[p->first_meshlet + i];
        psc_meshlet_bound(
            m, (const float(*)[3])pose->positions, pose->rest->indices + m->first_index);
    }
}

void pose_place_joints(struct pose *pose)
{
    const struct psc_motion *m = &pose->rest->motion;
    for (uint32_t s = 0; s < m->skin_count; s++) {
        pose->skin_moved[s] = false;
        for (uint32_t i = 0; i < m->skins[s].joint_count; i++) {
            uint32_t number = m->skins[s].first_joint + i;
            double inverse[12], placed[12];
            for (int k = 0; k < 12; k++)
                inverse[k] = m->joints[number].inverse_bind[k];
            psc_affine_multiply(pose->worlds[m->joints[number].node], inverse, placed);
            pose->skin_moved[s] |= memcmp(placed, pose->joints[number], sizeof placed) != 0;
            memcpy(pose->joints[number], placed, sizeof placed);
        }
    }
}

/* Whether joints or weights are not those of last time. */
static bool inputs_changed(struct pose *pose, uint32_t number)
{
    const struct psc_deform *d = &pose->rest->motion.deforms[number];
    struct pose_deform_state *state = &pose->deforms[number];
    const float *weights = pose->weights + d->first_weight;
    size_t weight_bytes = d->target_count * sizeof *weights;
    if (state->made && !(d->skin >= 0 && pose->skin_moved[d->skin]) &&
        !memcmp(state->weights, weights, weight_bytes))
        return false;
    memcpy(state->weights, weights, weight_bytes);
    state->made = true;
    return true;
}

/* Skinned vertices lie in the file's world already. Joints that mirror turn the winding round, as a
 * mirroring node does; the instance then mirrors x, and its vertices the other way. */
static void place_skinned(
    struct pose *pose, const struct psc_deform *d, bool mirrored, uint32_t *changes)
{
    struct psc_instance *instance = &pose->instances[d->instance];
    const double *at = pose->offsets[d->primitive];
    const double place[12] = {
        mirrored ? -1 : 1, [3] = at[0], [5] = 1, [7] = at[1], [10] = 1, [11] = at[2]};
    uint32_t flags = (instance->flags & (uint32_t)PSC_HIDDEN) | (mirrored ? PSC_MIRRORED : 0);
    if (instance->flags != flags)
        *changes |= POSE_STATE;
    instance->flags = flags;
    memcpy(pose->places[d->instance], place, sizeof place);
    pose->placed[d->instance] = true;
}

/* Where to count the vertices from: as at rest, unless they are far from that. False when one leaves
 * the range of coordinates. */
static bool choose_offset(struct pose *pose, const struct psc_deform *d,
    const struct psc_primitive *p, const struct vertex *vertices)
{
    double min[3] = {INFINITY, INFINITY, INFINITY}, max[3] = {-INFINITY, -INFINITY, -INFINITY};
    double rest[3], away[3] = {0};
    for (int k = 0; k < 3; k++) {
        rest[k] = d->skin >= 0 ? pose->rest->header->origin[k] : (double)p->offset[k];
        for (uint32_t i = 0; i < p->vertex_count; i++) {
            if (!(fabs(vertices[i].position[k]) <= FARTHEST))
                return false;
            min[k] = fmin(min[k], vertices[i].position[k] - rest[k]);
            max[k] = fmax(max[k], vertices[i].position[k] - rest[k]);
        }
    }
    if (p->vertex_count)
        psc_choose_origin(min, max, away);
    for (int k = 0; k < 3; k++)
        pose->offsets[d->primitive][k] = rest[k] + away[k];
    return true;
}

static void store(struct pose *pose, const struct psc_deform *d, const struct psc_primitive *p,
    const struct vertex *vertices, bool mirrored)
{
    const struct psc_bind *binds = pose->rest->motion.binds + d->first_bind;
    const double *offset = pose->offsets[d->primitive];
    for (uint32_t i = 0; i < p->vertex_count; i++) {
        const struct vertex *v = &vertices[i];
        struct psc_attributes *a = &pose->attributes[p->first_vertex + i];
        for (int k = 0; k < 3; k++) {
            float x = (float)(v->position[k] - offset[k]);
            pose->positions[p->first_vertex + i][k] = mirrored && k == 0 ? -x : x;
        }
        store_direction(v->normal, mirrored, a->normal);
        if (binds[i].tangent[3] != 0)
            store_direction(v->tangent, mirrored, a->tangent);
    }
}

bool pose_deform(struct pose *pose, uint32_t number, uint32_t *changes)
{
    const struct psc_motion *m = &pose->rest->motion;
    const struct psc_deform *d = &m->deforms[number];
    struct psc_primitive *p = &pose->primitives[d->primitive];
    int sides = 0;
    if (!inputs_changed(pose, number))
        return true;
    struct vertex *vertices = pen_alloc(p->vertex_count, sizeof *vertices);
    for (uint32_t i = 0; i < p->vertex_count; i++)
        load(&vertices[i], &m->binds[d->first_bind + i], p->offset);
    morph(vertices, m, d, pose->weights);
    for (uint32_t i = 0; d->skin >= 0 && i < p->vertex_count; i++)
        skin_vertex((const double(*)[12])pose->joints + m->skins[d->skin].first_joint,
            m->influences + d->first_influence + (size_t)i * d->influences, d->influences,
            &vertices[i], &sides);
    bool fits = choose_offset(pose, d, p, vertices);
    if (fits)
        store(pose, d, p, vertices, sides < 0);
    free(vertices);
    if (!fits)
        return false;
    if (d->skin >= 0)
        place_skinned(pose, d, sides < 0, changes);
    if (d->flags & PSC_DEFORM_FLAT)
        flat_normals(pose, p);
    find_bounds(pose, p);
    pose->moved[pose->moved_count++] = d->primitive;
    *changes |= POSE_VERTICES;
    return true;
}
