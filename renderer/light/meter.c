#include "renderer/light/meter.h"
#include <cglm/cglm.h>
#include <math.h>
#include <stdlib.h>

static float luminance(const float c[3])
{
    return 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
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
        value *= emitted > cosf(glm_rad(s->outer_cone_deg));
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

/* What four fifths of the irradiances stay below that are not next to nothing (outside a cone, behind
 * an emitter), and a third more; 0 where no light reaches anything. */
static float level_of(float *found, uint32_t count)
{
    uint32_t dark = 0;
    qsort(found, count, sizeof *found, ascending);
    float most = count ? found[count - 1] : 0;
    if (!(most > 0) || !isfinite(most))
        return 0;
    while (found[dark] < 1e-3f * most)
        dark++;
    return 4.0f / 3 * found[dark + (count - dark - 1) * 4 / 5] / GLM_PIf;
}

/* The sides that turn away from a lamp are not lit, and must not count; but in many files the sign
 * of a normal says little, and sheets are seen from both sides. The brighter reading is taken. */
static float measure(
    const struct light *lights, uint32_t count, const struct outline_samples *samples)
{
    float facing[OUTLINE_SAMPLES], either[OUTLINE_SAMPLES];
    for (uint32_t i = 0; i < samples->count; i++) {
        facing[i] = either[i] = 0;
        for (uint32_t k = 0; k < count; k++) {
            float e = irradiance(&lights[k], samples->at[i].point, samples->at[i].normal);
            facing[i] += fmaxf(e, 0);
            either[i] += fabsf(e);
        }
    }
    return fmaxf(level_of(facing, samples->count), level_of(either, samples->count));
}

float light_meter(
    const struct light *lights, uint32_t count, bool scenes_own, const struct scene *scene)
{
    float level = 0;
    for (uint32_t i = 0; i < scene->stage->moment_count; i++) {
        const struct scene_moment *moment = &scene->stage->moments[i];
        struct light moved[PEN_MAX_LIGHTS];
        for (uint32_t k = 0; scenes_own && k < moment->light_count; k++)
            light_emission(&moved[k], &moment->lights[k], scene);
        level = fmaxf(level, scenes_own ? measure(moved, moment->light_count, &moment->samples)
                                        : measure(lights, count, &moment->samples));
    }
    return level > 0 ? level : 1;
}

/* What own lights leave in the dark is more of the picture than behind a key light. */
#define FILL 1.04f

/* What faces the lights squarely comes out just below white, with the sky's share on top. The key
 * light is made to measure: its level is 1. */
void light_choose_exposure(struct pen_request *r, const struct light *lights, uint32_t count,
    bool scenes_own, const struct scene *scene)
{
    bool key_light = scenes_own && !scene->blob.light_count;
    float level = key_light ? 1 : light_meter(lights, count, scenes_own, scene);
    if (r->exposure_ev == PEN_AUTO)
        r->exposure_ev = glm_clamp(log2f(0.72f / level), -24, 24);
    if (r->sky_level == PEN_AUTO)
        r->sky_level = fminf(key_light ? level : FILL * level, 1e6f);
}
