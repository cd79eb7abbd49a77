#include "renderer/import/base/budget.h"
#include "renderer/import/geometry/accessor.h"
#include "renderer/import/motion/keys.h"
#include "protocol/memory.h"
#include <math.h>
#include <stdio.h>
#include <stdlib.h>

static bool refuse(int32_t accessor, const char *what, struct pen_error *error)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/accessors/%d", accessor);
    return pen_fail(error, PEN_INVALID, pointer, "glTF %s: %s.", pointer, what);
}

static bool read_times(struct imp_context *context, int32_t accessor, float **times,
    uint32_t *count, struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    struct imp_reader reader;
    if (!imp_reader_init(&reader, context->document, context->model, accessor, error))
        return false;
    if (reader.components != 1 || reader.component != 5126)
        return refuse(accessor, "an animation's times must be floats", error);
    if (reader.count > IMP_MAX_KEYS - motion->key_count)
        return pen_fail(error, PEN_TOO_BIG, "/animations",
            "The glTF's animations have more than %llu numbers in their keys.", IMP_MAX_KEYS);
    motion->key_count += reader.count;
    *count = reader.count;
    *times = pen_alloc_zero(reader.count, sizeof **times);
    bool twice = false;
    for (uint32_t i = 0; i < reader.count; i++) {
        imp_read_floats(&reader, i, &(*times)[i], 1);
        if (!isfinite((*times)[i]))
            return refuse(accessor, "an animation's time is not finite", error);
        if (i && (*times)[i] < (*times)[i - 1])
            return refuse(accessor, "an animation's times must increase", error);
        twice |= i && (*times)[i] == (*times)[i - 1];
    }
    if (reader.count && (*times)[0] < 0)
        imp_warn(context, "Animations have keys before 0 s, which are never reached.");
    if (twice)
        imp_warn(context, "Animations have two keys at one time; the later one counts.");
    return true;
}

/* `first`: values of one key that the accessor has; `components`: those that are kept. */
static bool read_values(struct imp_context *context, int32_t accessor,
    const struct imp_reader *reader, uint64_t keys, uint32_t per_key, uint32_t components,
    uint32_t *first, struct pen_error *error)
{
    float *values = pen_alloc_zero(keys * components, sizeof *values);
    bool finite = true;
    for (uint64_t key = 0; key < keys; key++) {
        float *to = values + key * components;
        if (reader->components > 1)
            imp_read_floats(reader, (uint32_t)key, to, components);
        for (uint32_t i = 0; reader->components == 1 && i < components; i++)
            imp_read_floats(reader, (uint32_t)(key * per_key + i), to + i, 1);
        for (uint32_t i = 0; i < components; i++)
            finite &= isfinite(to[i]) != 0;
    }
    if (finite)
        *first = psc_builder_add_motion(
            context->builder, PSC_KEYS, values, (uint32_t)(keys * components));
    free(values);
    return finite || refuse(accessor, "an animation's key is not finite", error);
}

static bool read_keys(struct imp_context *context, const struct gltf_animation_sampler *from,
    const float *times, uint32_t count, struct imp_width width, uint32_t *psc,
    struct pen_error *error)
{
    struct imp_motion *motion = context->motion;
    struct imp_reader reader;
    if (!imp_reader_init(&reader, context->document, context->model, from->output, error))
        return false;
    uint64_t keys = (uint64_t)count * (from->interpolation == PSC_CUBIC ? 3 : 1);
    uint32_t per_key = 1, components = width.components, each = components;
    if (width.weights) { /* scalars, key by key */
        per_key = (uint32_t)(reader.count / keys);
        components = per_key < width.components ? per_key : width.components;
        each = 1;
    }
    if (reader.components != each || !components || reader.count < keys * per_key)
        return refuse(from->output, "it does not suit what the animation moves", error);
    if (keys * components > IMP_MAX_KEYS - motion->key_count)
        return pen_fail(error, PEN_TOO_BIG, "/animations",
            "The glTF's animations have more than %llu numbers in their keys.", IMP_MAX_KEYS);
    motion->key_count += keys * components;
    struct psc_sampler sampler = {
        .interpolation = from->interpolation, .key_count = count, .components = components};
    sampler.first_time = psc_builder_add_motion(context->builder, PSC_KEYS, times, count);
    if (!read_values(
            context, from->output, &reader, keys, per_key, components, &sampler.first_value, error))
        return false;
    *psc = psc_builder_add_motion(context->builder, PSC_SAMPLERS, &sampler, 1);
    return true;
}

bool imp_sampler(struct imp_context *context, uint32_t number, struct imp_width width,
    uint32_t *psc, float *end, struct pen_error *error)
{
    const struct gltf_animation_sampler *from = &context->motion->source.samplers[number];
    float *times = NULL;
    uint32_t count = 0;
    bool done = read_times(context, from->input, &times, &count, error);
    if (done) {
        *end = fmaxf(*end, times[count - 1]);
        done = !psc || read_keys(context, from, times, count, width, psc, error);
    }
    free(times);
    return done;
}
