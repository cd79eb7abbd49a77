#include "renderer/generate/generate.h"
#include "protocol/memory.h"
#include "renderer/generate/model.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define MOST_TRIANGLES 20000000u

const char *const pen_generated_names[] = {"demo", "half-plane", "square", "stacked", "duplicate",
    "planar-mask", "plane", "empty-room", "hairball", "foliage", "columns", NULL};
_Static_assert(sizeof pen_generated_names / sizeof *pen_generated_names == PEN_GENERATED_KINDS + 1,
    "a name for each kind");

static bool complete(const struct pen_generated_options *given, struct pen_generated_options *o,
    struct pen_error *error)
{
    *o = *given;
    if (o->kind >= PEN_GENERATED_KINDS)
        return pen_fail(error, PEN_INVALID, "/kind", "Unknown kind of scene.");
    if (o->triangles > MOST_TRIANGLES)
        return pen_fail(error, PEN_INVALID, "/triangles", "At most %u triangles.", MOST_TRIANGLES);
    if (!o->triangles)
        o->triangles = 100000;
    if (o->caster_height == 0)
        o->caster_height = 1.2f;
    if (o->caster_half_size == 0)
        o->caster_half_size = 0.4f;
    if (o->second_height == 0)
        o->second_height = o->caster_height / 2;
    const float sizes[] = {o->caster_height, o->caster_half_size, o->second_height};
    const char *const pointers[] = {"/caster_height", "/caster_half_size", "/second_height"};
    for (int i = 0; i < 3; i++)
        if (!(sizes[i] > 0 && sizes[i] <= 100))
            return pen_fail(error, PEN_INVALID, pointers[i], "Must be in 0 to 100 m.");
    return true;
}

static struct model *make(const struct pen_generated_options *given,
    struct pen_generated_options *o, struct pen_error *error)
{
    if (!complete(given, o, error))
        return NULL;
    struct model *model = pen_alloc(1, sizeof *model);
    memset(model, 0, sizeof *model);
    if (o->kind == PEN_GENERATED_DEMO)
        model_demo(model, o);
    else if (o->kind >= PEN_GENERATED_HAIRBALL)
        model_load(model, o);
    else
        model_closed_form(model, o);
    return model;
}

static void discard(struct model *model)
{
    model_finish(model);
    free(model);
}

/* The blob names its source by a digest; a generated scene has no source file, so its options fill
 * that place (a digest of nothing that could be uploaded). */
static void source_of(const struct pen_generated_options *options, uint8_t source[PEN_ID_BYTES])
{
    _Static_assert(sizeof *options <= PEN_ID_BYTES, "options fit the source field");
    memset(source, 0, PEN_ID_BYTES);
    memcpy(source, options, sizeof *options);
}

bool pen_generate_blob(const struct pen_generated_options *options, void **data, size_t *bytes,
    struct pen_error *error)
{
    struct pen_generated_options o;
    struct model *model = make(options, &o, error);
    if (!model)
        return false;
    uint8_t source[PEN_ID_BYTES];
    source_of(&o, source);
    bool ok = model_to_blob(model, source, data, bytes, error);
    discard(model);
    return ok;
}

bool pen_generate_glb(const struct pen_generated_options *options, void **data, size_t *bytes,
    struct pen_error *error)
{
    struct pen_generated_options o;
    struct model *model = make(options, &o, error);
    if (!model)
        return false;
    bool ok = model_to_glb(model, data, bytes, error);
    discard(model);
    return ok;
}
