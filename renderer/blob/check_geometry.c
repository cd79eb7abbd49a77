#include "renderer/blob/check.h"

static bool check_vertices(const struct psc_scene *scene, struct pen_error *error)
{
    if (!all_finite(scene->positions, 3 * (size_t)scene->vertex_count))
        return DAMAGED(error, "a position is not finite.");
    uint32_t bad = 0;
    for (uint32_t i = 0; i < scene->vertex_count; i++) {
        const struct psc_attributes *a = &scene->attributes[i];
        uint32_t uv[4];
        memcpy(uv, a->uv, sizeof uv);
        for (int k = 0; k < 4; k++)
            bad |= (uv[k] & 0x7f800000u) == 0x7f800000u;
        bad |= a->normal[3] != 0;
        bad |= a->tangent[3] != 0 && a->tangent[3] != 32767 && a->tangent[3] != -32767;
    }
    return bad ? DAMAGED(error, "a vertex attribute is out of range.") : true;
}

static bool check_meshlet(const struct psc_meshlet *m, struct pen_error *error)
{
    if (!all_finite(m->center, 8))
        return DAMAGED(error, "a meshlet's bounds are not finite.");
    if (m->radius < 0 || !m->index_count || m->index_count % 3 ||
        m->index_count > 3 * PSC_MESHLET_TRIANGLES)
        return DAMAGED(error, "a meshlet's size is out of range.");
    return true;
}

static bool check_primitive(
    const struct psc_scene *scene, const struct psc_primitive *p, struct pen_error *error)
{
    if (p->index_count % 3 || (uint64_t)p->first_index + p->index_count > scene->index_count ||
        (uint64_t)p->first_vertex + p->vertex_count > scene->vertex_count ||
        (uint64_t)p->first_meshlet + p->meshlet_count > scene->meshlet_count)
        return DAMAGED(error, "a primitive's ranges leave their sections.");
    if (p->material >= scene->material_count ||
        p->flags & ~(uint32_t)(PSC_WATERTIGHT | PSC_OUTWARD))
        return DAMAGED(error, "a primitive's material or flags are unknown.");
    if (!all_finite(p->bounds_min, 6))
        return DAMAGED(error, "a primitive's bounds are not finite.");
    for (int k = 0; k < 3; k++)
        if (p->bounds_min[k] > p->bounds_max[k])
            return DAMAGED(error, "a primitive's bounds are reversed.");

    uint32_t highest = 0, lowest = UINT32_MAX;
    const uint32_t *indices = scene->indices + p->first_index;
    for (uint32_t i = 0; i < p->index_count; i++) {
        highest = indices[i] > highest ? indices[i] : highest;
        lowest = indices[i] < lowest ? indices[i] : lowest;
    }
    if (p->index_count &&
        (lowest < p->first_vertex || highest - p->first_vertex >= p->vertex_count))
        return DAMAGED(error, "an index leaves its primitive's vertices.");

    /* The meshlets tile the primitive's triangles, in order, without gap or overlap. */
    uint64_t next = p->first_index;
    for (uint32_t i = 0; i < p->meshlet_count; i++) {
        const struct psc_meshlet *m = &scene->meshlets[p->first_meshlet + i];
        if (m->first_index != next)
            return DAMAGED(error, "a primitive's meshlets do not tile its triangles.");
        next += m->index_count;
    }
    if (next != (uint64_t)p->first_index + p->index_count)
        return DAMAGED(error, "a primitive's meshlets do not tile its triangles.");
    return true;
}

static bool check_instances(const struct psc_scene *scene, struct pen_error *error)
{
    uint64_t triangles = 0;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        const struct psc_instance *instance = &scene->instances[i];
        if (!all_finite(instance->world, 12))
            return DAMAGED(error, "an instance's transform is not finite.");
        if (instance->primitive >= scene->primitive_count ||
            instance->flags & ~(uint32_t)(PSC_MIRRORED | PSC_HIDDEN))
            return DAMAGED(error, "an instance's primitive or flags are unknown.");
        if ((world_determinant(instance->world) < 0) != ((instance->flags & PSC_MIRRORED) != 0))
            return DAMAGED(error, "an instance's mirror flag contradicts its transform.");
        if (!(instance->flags & PSC_HIDDEN))
            triangles += scene->primitives[instance->primitive].index_count / 3;
    }
    const struct psc_header *header = scene->header;
    if (triangles != header->triangles)
        return DAMAGED(error, "the triangle count is wrong.");
    if (!all_finite(header->bounds_min, 12)) /* and the extent behind them */
        return DAMAGED(error, "the bounds are not finite.");
    bool reversed = false;
    for (int k = 0; k < 3; k++)
        reversed |= header->bounds_min[k] > header->bounds_max[k];
    if (reversed != (triangles == 0))
        return DAMAGED(error, "the bounds contradict the geometry.");
    return true;
}

bool psc_check_geometry(const struct psc_scene *scene, struct pen_error *error)
{
    if (!check_vertices(scene, error))
        return false;
    for (uint32_t i = 0; i < scene->meshlet_count; i++)
        if (!check_meshlet(&scene->meshlets[i], error))
            return false;
    /* Every meshlet and every index belongs to exactly one primitive, in order. */
    uint64_t meshlets = 0, indices = 0, vertices = 0;
    for (uint32_t i = 0; i < scene->primitive_count; i++) {
        const struct psc_primitive *p = &scene->primitives[i];
        if (p->first_meshlet != meshlets || p->first_index != indices ||
            p->first_vertex != vertices)
            return DAMAGED(error, "the primitives do not tile their sections.");
        if (!check_primitive(scene, p, error))
            return false;
        meshlets += p->meshlet_count;
        indices += p->index_count;
        vertices += p->vertex_count;
    }
    if (meshlets != scene->meshlet_count || indices != scene->index_count ||
        vertices != scene->vertex_count)
        return DAMAGED(error, "the primitives do not tile their sections.");
    return check_instances(scene, error);
}
