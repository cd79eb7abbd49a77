#include "renderer/blob/check.h"

static bool within(uint64_t first, uint64_t count, uint64_t all)
{
    return first <= all && count <= all - first;
}

static bool all_doubles_finite(const double *numbers, size_t count)
{
    bool finite = true;
    for (size_t i = 0; i < count; i++)
        finite &= isfinite(numbers[i]) != 0;
    return finite;
}

static bool check_nodes(const struct psc_motion *m, struct pen_error *error)
{
    for (uint32_t i = 0; i < m->node_count; i++) {
        const struct psc_node *node = &m->nodes[i];
        if (node->parent < -1 || node->parent >= (int64_t)i)
            return DAMAGED(error, "a node does not come after its parent.");
        if (node->flags & ~(uint32_t)(PSC_NODE_MATRIX | PSC_NODE_HIDDEN) ||
            !all_finite(node->rotation, 7) || !all_doubles_finite(node->translation, 15))
            return DAMAGED(error, "a node's transform or flags are out of range.");
    }
    return true;
}

static bool check_riders(const struct psc_scene *scene, struct pen_error *error)
{
    const uint32_t counts[PSC_RIDER_KINDS] = {
        scene->instance_count, scene->light_count, scene->camera_count};
    for (uint32_t i = 0; i < scene->motion.rider_count; i++) {
        const struct psc_rider *rider = &scene->motion.riders[i];
        if (rider->kind >= PSC_RIDER_KINDS || rider->item >= counts[rider->kind] ||
            rider->node >= scene->motion.node_count || rider->flags & ~(uint32_t)PSC_RIDER_SKINNED)
            return DAMAGED(error, "what a node carries is out of range.");
        if (!all_finite(rider->local, 14))
            return DAMAGED(error, "the place of what a node carries is not finite.");
    }
    return true;
}

static bool check_skins(const struct psc_motion *m, struct pen_error *error)
{
    for (uint32_t i = 0; i < m->skin_count; i++)
        if (!m->skins[i].joint_count ||
            !within(m->skins[i].first_joint, m->skins[i].joint_count, m->joint_count))
            return DAMAGED(error, "a skin's joints leave their section.");
    for (uint32_t i = 0; i < m->joint_count; i++)
        if (m->joints[i].node >= m->node_count || !all_finite(m->joints[i].inverse_bind, 12))
            return DAMAGED(error, "a joint is out of range.");
    return true;
}

static bool check_influences(const struct psc_motion *m, const struct psc_deform *d, uint32_t n,
    uint32_t joints, struct pen_error *error)
{
    for (uint64_t i = 0; i < (uint64_t)n * d->influences; i++) {
        const struct psc_influence *influence = &m->influences[d->first_influence + i];
        if (influence->joint >= joints || !(influence->weight >= 0 && influence->weight <= 1))
            return DAMAGED(error, "a vertex hangs on a joint that does not exist.");
    }
    return true;
}

static bool check_targets(
    const struct psc_motion *m, const struct psc_deform *d, uint32_t n, struct pen_error *error)
{
    for (uint32_t t = 0; t < d->target_count; t++) {
        const struct psc_target *target = &m->targets[d->first_target + t];
        uint64_t next = 0;
        if (!within(target->first_delta, target->delta_count, m->delta_count))
            return DAMAGED(error, "a morph target leaves its section.");
        for (uint32_t i = 0; i < target->delta_count; i++) {
            const struct psc_delta *delta = &m->deltas[target->first_delta + i];
            if (delta->vertex < next || delta->vertex >= n || !all_finite(delta->position, 9))
                return DAMAGED(error, "a morph target is out of range.");
            next = (uint64_t)delta->vertex + 1;
        }
    }
    return true;
}

static bool check_deform(
    const struct psc_scene *scene, const struct psc_deform *d, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    if (d->primitive >= scene->primitive_count || d->flags & ~(uint32_t)PSC_DEFORM_FLAT)
        return DAMAGED(error, "what deforms is out of range.");
    uint32_t n = scene->primitives[d->primitive].vertex_count;
    if (!within(d->first_bind, n, m->bind_count) ||
        (d->influences != 0 && d->influences != 4 && d->influences != 8) ||
        !within(d->first_influence, (uint64_t)n * d->influences, m->influence_count) ||
        !within(d->first_target, d->target_count, m->target_count) ||
        !within(d->first_weight, d->target_count, m->weight_count))
        return DAMAGED(error, "what deforms leaves its sections.");
    bool skinned = d->skin >= 0;
    if (d->skin < -1 || (int64_t)d->skin >= m->skin_count || skinned != (d->influences > 0) ||
        skinned != (d->instance >= 0) || d->instance < -1 ||
        (int64_t)d->instance >= scene->instance_count ||
        (skinned && scene->instances[d->instance].primitive != d->primitive))
        return DAMAGED(error, "a skin is out of range.");
    return (!skinned || check_influences(m, d, n, m->skins[d->skin].joint_count, error)) &&
           check_targets(m, d, n, error);
}

static bool check_deforms(const struct psc_scene *scene, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    if (!all_finite(m->binds, 10 * (size_t)m->bind_count) ||
        !all_finite(m->weights, m->weight_count))
        return DAMAGED(error, "a vertex before deforming is not finite.");
    for (uint32_t i = 0; i < m->deform_count; i++)
        if (!check_deform(scene, &m->deforms[i], error))
            return false;
    return true;
}

static bool check_sampler(
    const struct psc_motion *m, const struct psc_sampler *s, struct pen_error *error)
{
    uint64_t values = (uint64_t)s->key_count * (s->interpolation == PSC_CUBIC ? 3 : 1);
    if (s->interpolation >= PSC_INTERPOLATIONS || !s->key_count || !s->components ||
        s->components > UINT16_MAX || !within(s->first_time, s->key_count, m->key_count) ||
        !within(s->first_value, values * s->components, m->key_count))
        return DAMAGED(error, "an animation's keys leave their section.");
    const float *times = m->keys + s->first_time;
    for (uint32_t i = 0; i < s->key_count; i++)
        if (!(times[i] >= times[i ? i - 1 : 0]))
            return DAMAGED(error, "an animation runs backwards.");
    return true;
}

static const uint8_t target_components[] = {
#define X(name, components) components,
    PSC_CHANNEL_TARGETS(X)
#undef X
};

static bool check_channel(
    const struct psc_scene *scene, const struct psc_channel *c, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    if (c->target >= PSC_CHANNEL_TARGET_COUNT || c->sampler >= m->sampler_count)
        return DAMAGED(error, "an animation's channel is out of range.");
    uint32_t components = m->samplers[c->sampler].components;
    uint64_t most;
    if (c->target <= PSC_TO_NODE_VISIBLE)
        most = m->node_count;
    else if (c->target == PSC_TO_WEIGHTS)
        most = m->weight_count >= components ? m->weight_count - components + 1 : 0;
    else if (c->target < PSC_TO_TEXTURE_OFFSET)
        most = m->material_rest_count;
    else if (c->target < PSC_TO_LIGHT_COLOR)
        most = 5 * (uint64_t)m->material_rest_count;
    else
        most = c->target < PSC_TO_CAMERA_FOV ? m->light_rest_count : scene->camera_count;
    if (c->item >= most ||
        (c->target != PSC_TO_WEIGHTS && components != target_components[c->target]))
        return DAMAGED(error, "an animation moves what does not exist.");
    return true;
}

static bool check_animations(const struct psc_scene *scene, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    if (!all_finite(m->keys, m->key_count))
        return DAMAGED(error, "an animation's key is not finite.");
    for (uint32_t i = 0; i < m->sampler_count; i++)
        if (!check_sampler(m, &m->samplers[i], error))
            return false;
    for (uint32_t i = 0; i < m->channel_count; i++)
        if (!check_channel(scene, &m->channels[i], error))
            return false;
    for (uint32_t i = 0; i < m->animation_count; i++) {
        const struct psc_animation *a = &m->animations[i];
        if (!memchr(a->name, 0, sizeof a->name) || !all_finite(&a->duration_s, 1) ||
            !within(a->first_channel, a->channel_count, m->channel_count))
            return DAMAGED(error, "an animation is out of range.");
    }
    return true;
}

static bool check_rests(const struct psc_scene *scene, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    for (uint32_t i = 0; i < m->material_rest_count; i++)
        if (m->material_rests[i].material >= scene->material_count ||
            !all_finite(m->material_rests[i].emissive, 34))
            return DAMAGED(error, "an animated material is out of range.");
    for (uint32_t i = 0; i < m->light_rest_count; i++)
        if (m->light_rests[i].light >= scene->light_count ||
            !all_finite(m->light_rests[i].color, 6))
            return DAMAGED(error, "an animated light is out of range.");
    return true;
}

static bool check_variants(const struct psc_scene *scene, struct pen_error *error)
{
    const struct psc_motion *m = &scene->motion;
    for (uint32_t i = 0; i < m->variant_count; i++)
        if (!memchr(m->variants[i].name, 0, sizeof m->variants[i].name) ||
            !within(m->variants[i].first_swap, m->variants[i].swap_count, m->swap_count))
            return DAMAGED(error, "a variant is out of range.");
    for (uint32_t i = 0; i < m->swap_count; i++)
        if (m->swaps[i].primitive >= scene->primitive_count ||
            m->swaps[i].material >= scene->material_count)
            return DAMAGED(error, "a variant's material is out of range.");
    return true;
}

bool psc_check_motion(const struct psc_scene *scene, struct pen_error *error)
{
    return check_nodes(&scene->motion, error) && check_riders(scene, error) &&
           check_skins(&scene->motion, error) && check_deforms(scene, error) &&
           check_animations(scene, error) && check_rests(scene, error) &&
           check_variants(scene, error);
}
