#include "renderer/passes/convolution.h"
#include <math.h>
#include <string.h>

const char *const convolution_format_names[] = {"rgba8", "rgba16", NULL};
static const GLenum formats[] = {GL_RGBA8, GL_RGBA16};

static double series(const struct convolution_block *block, double x)
{
    double f = 0.5;
    for (int k = 0; k < CONVOLUTION_MAX_TERMS; k++)
        f += (double)block->weight[k] * sin(M_PI * (2 * k + 1) * x);
    return f;
}

struct convolution_block convolution_constants(const struct convolution_desc *desc)
{
    struct convolution_block block = {.offset = desc->offset / (float)desc->terms};
    for (uint32_t k = 0; k < desc->terms; k++) {
        double part = (double)(k + 1) / desc->terms;
        block.weight[k] = (float)(2 / (M_PI * (2 * k + 1)) * exp(-desc->damping * part * part));
    }
    /* The series has period 2: a gap of 1 - x looks like one of x. Gaps plus offset stay below
     * 1 - offset, so the lit side is seen between the offset and its mirror image only. */
    block.range = 1 - 2 * block.offset;
    double lit = 1;
    for (int i = 0; i <= 512; i++)
        lit = fmin(lit, series(&block, (double)block.offset + i * (double)block.range / 512));
    /* The series is odd around 1/2: what casters leave at most is what lit texels lack at most.
     * Without an offset a lit texel gives 1/2, which the scale alone brings to 1. */
    block.low = lit > 0.75 ? (float)(1 - lit) : 0;
    block.scale = (float)(1 / (lit - (double)block.low));
    return block;
}

struct basis_block {
    float range;
    int32_t first_term, terms, pad;
};

static bool fill(struct technique_run *run, const struct gl_texture *map, struct gl_texture *array,
    const struct convolution_desc *desc, uint32_t series_layers, const char *define,
    struct pen_error *error)
{
    struct pass_texture from = {UNIT_FREE, map->name, GL_SAMPLE_NEAREST};
    struct basis_block block = {
        .range = convolution_constants(desc).range, .terms = (int32_t)desc->terms};
    GLuint framebuffer;
    bool ok = true;
    gl.CreateFramebuffers(1, &framebuffer);
    for (uint32_t i = 0; ok && i < array->layers; i++) {
        gl.NamedFramebufferTextureLayer(
            framebuffer, GL_COLOR_ATTACHMENT0, array->name, 0, (GLint)i);
        block.first_term = i < series_layers ? (int32_t)(2 * i) : -1;
        ok = pass_fill(run->ctx,
            &(struct pass_fill){.name = "convolution basis",
                .fragment = "convolution.frag",
                .defines = define,
                .stage = PEN_STAGE_SHADOW,
                .textures = &from,
                .texture_count = 1,
                .framebuffer = framebuffer,
                .width = desc->size,
                .height = desc->size,
                .extra = &block,
                .extra_bytes = sizeof block},
            error);
    }
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_timer_begin(&run->ctx->timer, PEN_STAGE_SHADOW, "convolution mips");
    gl.GenerateTextureMipmap(array->name);
    gl_timer_end(&run->ctx->timer);
    return ok;
}

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    struct convolution_desc desc = {.size = key->size,
        .terms = key->extra[0],
        .format = key->extra[1],
        .weighted = key->extra[2]};
    memcpy(&desc.offset, &key->extra[3], 4);
    const struct shadow_input *map = pass_caster_map(run, desc.size, error);
    if (!map)
        return false;
    uint32_t layers = (desc.terms + 1) / 2;
    GLenum format = formats[desc.format];
    input->textures[0] = gl_texture_create(format, desc.size, desc.size, layers, 0);
    if (!fill(run, &map->textures[0], &input->textures[0], &desc, layers, NULL, error))
        return false;
    if (!desc.weighted)
        return true;
    input->textures[1] = gl_texture_create(format, desc.size, desc.size, layers + 1, 0);
    return fill(
        run, &map->textures[0], &input->textures[1], &desc, layers, "#define WEIGHTED\n", error);
}

const struct shadow_input *pass_convolution(
    struct technique_run *run, const struct convolution_desc *desc, struct pen_error *error)
{
    struct shadow_key key = {.kind = "convolution",
        .size = desc->size,
        .extra = {desc->terms, desc->format, desc->weighted}};
    memcpy(&key.extra[3], &desc->offset, 4);
    return shadow_cache_get(run, &key, build, error);
}
