#include "renderer/passes/light/emission_sat.h"
#include "renderer/passes/draw/screen.h"
#include <string.h>

static bool sum(struct technique_run *run, const struct gl_texture *target,
    const struct pass_texture *source, const char *defines, struct pen_error *error)
{
    GLuint framebuffer = gl_framebuffer_create(&target, 1, NULL);
    bool ok = pass_fill(run->ctx,
        &(struct pass_fill){.name = "emission sums",
            .fragment = "emission_sat.frag",
            .defines = defines,
            .stage = PEN_STAGE_SHADOW,
            .textures = source,
            .texture_count = 1,
            .framebuffer = framebuffer,
            .width = target->width,
            .height = target->height},
        error);
    gl.DeleteFramebuffers(1, &framebuffer);
    return ok;
}

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    struct gl_texture rows = gl_texture_create(GL_RGBA32F, key->size, key->size, 0, 1);
    input->textures[0] = gl_texture_create(GL_RGBA32F, key->size, key->size, 0, 1);
    struct pass_texture emission = {UNIT_EMISSION, run->emission->name, GL_SAMPLE_TRILINEAR};
    struct pass_texture from_rows = {UNIT_SOURCE, rows.name, GL_SAMPLE_NEAREST};
    bool ok = sum(run, &rows, &emission, "#define ROWS\n", error) &&
              sum(run, &input->textures[0], &from_rows, NULL, error);
    gl_texture_destroy(&rows);
    return ok;
}

const struct shadow_input *pass_emission_sat(struct technique_run *run, struct pen_error *error)
{
    const struct pen_light *light = run->light->source;
    struct shadow_key key = {.size = EMISSION_SAT_CELLS + 1};
    _Static_assert(sizeof light->image == sizeof key.extra, "an image id is the key");
    if (light->texture == PEN_TEXTURE_IMAGE) {
        key.kind = "emission sums of an image";
        memcpy(key.extra, light->image, sizeof key.extra);
    } else {
        key.kind = "emission sums of a pattern";
        key.extra[0] = light->pattern;
        memcpy(&key.extra[1], &run->request->time_s, 4);
    }
    return shadow_cache_get(run, &key, build, error);
}
