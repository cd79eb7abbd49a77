#include "renderer/light/meter.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdlib.h>

static float luminance(const float c[3])
{
    return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
}

#define BEAM 0.67f /* of its middle: a grey object is not burnt out there */

/* What a spot's cone leaves of it; as shade.frag has it. */
static float in_cone(const struct pen_light *spot, float cosine)
{
    float inner = cosf(glm_rad(spot->inner_cone_deg)), outer = cosf(glm_rad(spot->outer_cone_deg));
    float share = glm_clamp((cosine - outer) / fmaxf(inner - outer, 1e-4f), 0, 1);
    return share * share;
}

/* Irradiance of one light on a surface at p; negative where the normal points away. An emitter with
 * an extent counts as a point of the same flux, kept from growing without bound near itself: a meter
 * needs no more. */
static float irradiance(const struct light *light, const float p[3], const float n[3])
{
    const struct pen_light *s = light->source;
    float to[3], value = luminance(light->radiance), area = 0;
    if (s->type == PEN_LIGHT_SUN)
        return value * -glm_vec3_dot((float *)n, (float *)light->z);
    glm_vec3_sub((float *)light->origin, (float *)p, to);
    float d2 = glm_vec3_norm2(to), d = sqrtf(fmaxf(d2, 1e-20f));
    float emitted = -glm_vec3_dot(to, (float *)light->z) / d; /* cosine on the emitter's side */
    switch (s->type) {
    case PEN_LIGHT_RECT:
        area = s->width * s->height;
        value *= fmaxf(emitted, 0);
        break;
    case PEN_LIGHT_DISK:
        area = GLM_PIf * s->radius * s->radius;
        value *= fmaxf(emitted, 0);
        break;
    case PEN_LIGHT_SPHERE:
        area = GLM_PIf * s->radius * s->radius;
        break;
    case PEN_LIGHT_SPOT:
        value *= in_cone(s, emitted);
        break;
    default:
        break;
    }
    if (area > 0)
        value *= area;
    return value * glm_vec3_dot((float *)n, to) / (d * fmaxf(d2 + area / GLM_PIf, 1e-20f));
}

static int ascending(const void *a, const void *b)
{
    float x = *(const float *)a, y = *(const float *)b;
    return (x > y) - (x < y);
}

/* What half of the surface shines more than, with what it reflects of lights of that level; 0 where
 * half of it does not shine: a lamp in a scene counts for nothing. */
static float glow_level(const struct scene *scene, float level)
{
    float found[OUTLINE_SAMPLES], most = 0;
    for (uint32_t i = 0; i < scene->stage->moment_count; i++) {
        const struct outline_samples *samples = &scene->stage->moments[i].samples;
        for (uint32_t k = 0; k < samples->count; k++)
            found[k] =
                samples->at[k].glow > 0 ? samples->at[k].glow + samples->at[k].albedo * level : 0;
        qsort(found, samples->count, sizeof *found, ascending);
        most = samples->count ? fmaxf(most, found[(samples->count - 1) / 2]) : most;
    }
    return most;
}

struct reading {
    float level; /* radiance of a white surface */
    float lit;   /* the share of the content's surface that faces a light and is reached by it */
};

/* What four fifths of the irradiances stay below that are not next to nothing (outside a cone, behind
 * an emitter), and a third more; 0 where no light reaches anything. *lit: the share of these. */
static float level_of(float *found, uint32_t count, float *lit)
{
    uint32_t dark = 0;
    qsort(found, count, sizeof *found, ascending);
    float most = count ? found[count - 1] : 0;
    *lit = 0;
    if (!(most > 0) || !isfinite(most))
        return 0;
    while (found[dark] < 1e-3f * most)
        dark++;
    *lit = (float)(count - dark) / (float)count;
    return 4.0f / 3 * found[dark + (count - dark - 1) * 4 / 5] / GLM_PIf;
}

/* Irradiance in the middle of a spot's beam, of what faces it, where it passes nearest to the content's
 * middle: few samples or none lie in a narrow one. 0: it passes by. */
static float in_the_beam(
    const struct light *light, const struct outline_samples *samples, vec3 middle, float radius)
{
    vec3 to, at, back;
    if (light->source->type != PEN_LIGHT_SPOT || !samples->count)
        return 0;
    glm_vec3_sub(middle, (float *)light->origin, to);
    float along = glm_vec3_dot(to, (float *)light->z);
    bool ahead = along > 0;
    along = fmaxf(along, radius / 4); /* not the lamp's own rim */
    glm_vec3_scale((float *)light->z, along, at);
    glm_vec3_add((float *)light->origin, at, at);
    glm_vec3_negate_to((float *)light->z, back);
    return ahead && glm_vec3_distance(at, middle) < radius ? irradiance(light, at, back) : 0;
}

/* The middle of the samples; returns how far they are from it. */
static float extent(const struct outline_samples *samples, vec3 middle)
{
    float radius = 0;
    glm_vec3_zero(middle);
    for (uint32_t i = 0; i < samples->count; i++)
        glm_vec3_muladds((float *)samples->at[i].point, 1.0f / (float)samples->count, middle);
    for (uint32_t i = 0; i < samples->count; i++)
        radius = fmaxf(radius, glm_vec3_distance((float *)samples->at[i].point, middle));
    return radius;
}

/* The sides that turn away from a lamp are not lit, and must not count; but in many files the sign
 * of a normal says little, and sheets are seen from both sides. The brighter reading is taken. */
static struct reading measure(
    const struct light *lights, uint32_t count, const struct outline_samples *samples)
{
    float facing[OUTLINE_SAMPLES], either[OUTLINE_SAMPLES], beam = 0;
    vec3 middle;
    float radius = extent(samples, middle);
    for (uint32_t i = 0; i < samples->count; i++) {
        facing[i] = either[i] = 0;
        for (uint32_t k = 0; k < count; k++) {
            float e = irradiance(&lights[k], samples->at[i].point, samples->at[i].normal);
            facing[i] += fmaxf(e, 0);
            either[i] += fabsf(e);
        }
    }
    for (uint32_t k = 0; k < count; k++)
        beam = fmaxf(beam, in_the_beam(&lights[k], samples, middle, radius));
    struct reading r;
    float any;
    r.level = level_of(facing, samples->count, &r.lit);
    r.level = fmaxf(r.level, level_of(either, samples->count, &any));
    r.level = fmaxf(r.level, BEAM * beam / GLM_PIf);
    return r;
}

/* Where the lights reach the content best: a third above what four fifths of all that they reach stay
 * below; level 1 without any light that reaches anything. Independent of the camera and, in an
 * animation, of the time, so that exposure is steady along a sequence: the brightest moment counts. */
static struct reading meter(
    const struct light *lights, uint32_t count, bool scenes_own, const struct scene *scene)
{
    struct reading most = {0, 1};
    for (uint32_t i = 0; i < scene->stage->moment_count; i++) {
        const struct scene_moment *moment = &scene->stage->moments[i];
        struct light moved[PEN_MAX_LIGHTS];
        for (uint32_t k = 0; scenes_own && k < moment->light_count; k++)
            light_emission(&moved[k], &moment->lights[k], scene);
        struct reading r = scenes_own ? measure(moved, moment->light_count, &moment->samples)
                                      : measure(lights, count, &moment->samples);
        if (r.level > most.level)
            most = r;
    }
    most.level = most.level > 0 ? most.level : 1;
    return most;
}

/* What own lights leave in the dark is more of the picture than behind a key light; of a narrow beam
 * it is nearly all, and lit by the sky alone. */
#define FILL 1.04f
#define FILL_OF_BEAMS 1.32f
#define BEAMS_LIGHT 0.3f /* of the content, at most */

static float fill_of(float lit)
{
    float t = glm_clamp(lit / BEAMS_LIGHT, 0, 1);
    return glm_lerp(FILL_OF_BEAMS, FILL, t * t * (3 - 2 * t));
}

#define GLOW 0.9f /* a lamp is whiter than a white wall, but keeps its colour */

/* What faces the lights squarely comes out just below white, with the sky's share on top. The key
 * light is made to measure: its level is 1. */
void light_choose_exposure(struct pen_request *r, const struct light *lights, uint32_t count,
    bool scenes_own, const struct scene *scene)
{
    bool key_light = scenes_own && !lights_shine(scene);
    struct reading found =
        key_light ? (struct reading){1, 1} : meter(lights, count, scenes_own, scene);
    float level = found.level, shown = fmaxf(level, GLOW * glow_level(scene, level));
    if (r->exposure_ev == PEN_AUTO)
        r->exposure_ev = glm_clamp(log2f(0.72f / shown), -32, 32);
    if (r->sky_level == PEN_AUTO)
        r->sky_level = fminf(key_light ? level : fill_of(found.lit) * level, 1e6f);
}
