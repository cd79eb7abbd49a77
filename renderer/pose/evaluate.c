/* Samplers (glTF 2.0, appendix C) and what channels write. */
#include "renderer/pose/internal.h"
#include "renderer/pose/place.h"
#include <math.h>
#include <string.h>

/* The last key that is not later than the time; at least one key is not. */
static uint32_t find_key(const float *times, uint32_t count, float time_s)
{
    uint32_t low = 0, high = count; /* times[low] <= time_s < times[high] */
    while (high - low > 1) {
        uint32_t middle = low + (high - low) / 2;
        if (times[middle] <= time_s)
            low = middle;
        else
            high = middle;
    }
    return low;
}

static void normalize(double *q)
{
    double square = 0;
    for (int i = 0; i < 4; i++)
        square += q[i] * q[i];
    for (int i = 0; i < 4 && square > 0; i++)
        q[i] /= sqrt(square);
}

/* Appendix C.4; nearly equal rotations are mixed linearly, which differs by less than rounding. */
static void slerp(const float *from, const float *to, double t, double *out)
{
    double a[4], b[4], dot = 0, sum_a = 0, sum_b = 0;
    for (int i = 0; i < 4; i++) {
        sum_a += (double)from[i] * from[i];
        sum_b += (double)to[i] * to[i];
    }
    for (int i = 0; i < 4; i++) {
        a[i] = sum_a > 0 ? from[i] / sqrt(sum_a) : i == 3;
        b[i] = sum_b > 0 ? to[i] / sqrt(sum_b) : i == 3;
        dot += a[i] * b[i];
    }
    double side = dot < 0 ? -1 : 1, angle = acos(fmin(fabs(dot), 1)), sine = sin(angle);
    double u = 1 - t, v = t;
    if (sine > 1e-6) {
        u = sin(angle * (1 - t)) / sine;
        v = sin(angle * t) / sine;
    }
    for (int i = 0; i < 4; i++)
        out[i] = u * a[i] + side * v * b[i];
    normalize(out);
}

/* Appendix C.5. `values`: of the key before; 3 * components for each key. */
static void cubic(const float *values, uint32_t components, double t, double span, double *out)
{
    const float *value = values + components, *leave = values + 2 * (size_t)components;
    const float *arrive = values + 3 * (size_t)components, *next = arrive + components;
    double t2 = t * t, t3 = t2 * t;
    for (uint32_t i = 0; i < components; i++)
        out[i] = (2 * t3 - 3 * t2 + 1) * value[i] + span * (t3 - 2 * t2 + t) * leave[i] +
                 (-2 * t3 + 3 * t2) * next[i] + span * (t3 - t2) * arrive[i];
}

void pose_sample(const struct psc_motion *motion, const struct psc_sampler *s, float time_s,
    bool rotation, double *out)
{
    const float *times = motion->keys + s->first_time;
    uint32_t key = time_s <= times[0] ? 0 : find_key(times, s->key_count, time_s);
    size_t stride = (size_t)s->components * (s->interpolation == PSC_CUBIC ? 3 : 1);
    const float *values = motion->keys + s->first_value + key * stride;
    bool held = time_s <= times[0] || key + 1 == s->key_count;
    double span = held ? 1 : (double)times[key + 1] - times[key];
    double t = held ? 0 : ((double)time_s - times[key]) / span;
    bool cubic_held = held && s->interpolation == PSC_CUBIC;
    if (held || s->interpolation == PSC_STEP)
        for (uint32_t i = 0; i < s->components; i++)
            out[i] = values[i + (cubic_held ? s->components : 0)];
    else if (s->interpolation == PSC_CUBIC)
        cubic(values, s->components, t, span, out);
    else if (rotation)
        slerp(values, values + 4, t, out);
    else
        for (uint32_t i = 0; i < s->components; i++)
            out[i] = (1 - t) * values[i] + t * values[s->components + i];
    if (rotation)
        normalize(out);
}

/* Where a channel writes; NULL: not one float after the other. Translations stay in full: far from
 * the origin a float is coarse. */
static float *place_of(struct pose *pose, const struct psc_channel *c)
{
    uint32_t i = c->item;
#define NODE pose->nodes[i]
#define REST pose->material_rests[i]
#define MATERIAL pose->materials[REST.material]
#define MAP pose->material_rests[i / 5].maps[i % 5]
#define LIGHT pose->light_rests[i]
    switch ((enum psc_channel_target)c->target) {
    case PSC_TO_NODE_ROTATION:
        return NODE.rotation;
    case PSC_TO_NODE_SCALE:
        return NODE.scale;
    case PSC_TO_WEIGHTS:
        return pose->weights + i;
    case PSC_TO_MATERIAL_BASE_COLOR:
        return MATERIAL.base_color;
    case PSC_TO_MATERIAL_METALLIC:
        return &MATERIAL.metallic;
    case PSC_TO_MATERIAL_ROUGHNESS:
        return &MATERIAL.roughness;
    case PSC_TO_MATERIAL_EMISSIVE:
        return REST.emissive;
    case PSC_TO_MATERIAL_EMISSIVE_STRENGTH:
        return &REST.emissive_strength;
    case PSC_TO_MATERIAL_ALPHA_CUTOFF:
        return &MATERIAL.alpha_cutoff;
    case PSC_TO_MATERIAL_NORMAL_SCALE:
        return &MATERIAL.normal_scale;
    case PSC_TO_MATERIAL_OCCLUSION_STRENGTH:
        return &MATERIAL.occlusion_strength;
    case PSC_TO_MATERIAL_IOR:
        return &REST.ior;
    case PSC_TO_MATERIAL_SPECULAR_STRENGTH:
        return &REST.specular_strength;
    case PSC_TO_MATERIAL_SPECULAR:
        return REST.specular;
    case PSC_TO_TEXTURE_OFFSET:
        return MAP.offset;
    case PSC_TO_TEXTURE_ROTATION:
        return &MAP.rotation;
    case PSC_TO_TEXTURE_SCALE:
        return MAP.scale;
    case PSC_TO_LIGHT_COLOR:
        return LIGHT.color;
    case PSC_TO_LIGHT_INTENSITY:
        return &LIGHT.intensity;
    case PSC_TO_LIGHT_INNER_CONE:
        return &LIGHT.inner_cone;
    case PSC_TO_LIGHT_OUTER_CONE:
        return &LIGHT.outer_cone;
    case PSC_TO_NODE_TRANSLATION:
    case PSC_TO_NODE_VISIBLE:
    case PSC_TO_CAMERA_FOV:
    case PSC_CHANNEL_TARGET_COUNT:
        break;
    }
#undef NODE
#undef REST
#undef MATERIAL
#undef MAP
#undef LIGHT
    return NULL;
}

void pose_apply_channels(struct pose *pose, const struct psc_animation *animation, float time_s)
{
    const struct psc_motion *m = &pose->rest->motion;
    for (uint32_t i = 0; i < animation->channel_count; i++) {
        const struct psc_channel *c = &m->channels[animation->first_channel + i];
        const struct psc_sampler *s = &m->samplers[c->sampler];
        pose_sample(m, s, time_s, c->target == PSC_TO_NODE_ROTATION, pose->channel_values);
        float *place = place_of(pose, c);
        const double *values = pose->channel_values;
        if (place)
            for (uint32_t k = 0; k < s->components; k++)
                place[k] = (float)values[k];
        else if (c->target == PSC_TO_NODE_TRANSLATION)
            for (int k = 0; k < 3; k++)
                pose->nodes[c->item].translation[k] = values[k];
        else if (c->target == PSC_TO_CAMERA_FOV)
            pose->cameras[c->item].fov_y_deg = pose_fov_y_deg((float)values[0]);
        else if (values[0] > 0.5)
            pose->nodes[c->item].flags &= ~(uint32_t)PSC_NODE_HIDDEN;
        else
            pose->nodes[c->item].flags |= PSC_NODE_HIDDEN;
    }
}
