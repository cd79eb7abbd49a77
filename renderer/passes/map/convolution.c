#include "renderer/passes/map/convolution.h"
#include "renderer/passes/map/blur.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/depth_map.h"
#include "renderer/passes/map/sat.h"
#include <math.h>
#include <string.h>

const char *const convolution_format_names[] = {"rgba8", "rgba16", "tables", NULL};
static const GLenum formats[] = {GL_RGBA8, GL_RGBA16, GL_RGBA32UI};

static double series(const struct convolution_block *block, double x)
{
    double f = 0.5;
    for (int k = 0; k < CONVOLUTION_MAX_TERMS; k++)
        f += (double)block->weight[k / 4][k % 4] * sin(M_PI * (2 * k + 1) * x);
    return f;
}

struct convolution_block convolution_constants(const struct convolution_desc *desc)
{
    struct convolution_block block = {.offset = desc->offset / (float)desc->terms};
    for (uint32_t k = 0; k < desc->terms; k++) {
        double part = (double)(k + 1) / desc->terms;
        block.weight[k / 4][k % 4] =
            (float)(2 / (M_PI * (2 * k + 1)) * exp(-desc->damping * part * part));
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

/* A window's sum must fit 32 bits; the widest one is the blocker search at the far plane, or the
 * fixed filter of a method. Fractional corners touch a texel more on either side. */
void convolution_fit(struct convolution_block *block, const struct convolution_desc *desc,
    const struct light_face *face)
{
    const double least = 2 * 256 + 2;
    double texels = 1;
    for (int k = 0; k < 2; k++) {
        double reach = face->far_z - face->near_z;
        double half =
            (double)face->extent[k] * (face->parallel ? reach : reach / (double)face->far_z);
        double texel = (double)(face->rect[2 + k] - face->rect[k]) / desc->size;
        texels *= fmin(fmax(2 * half / texel + 4, least), desc->size);
    }
    block->table_scale = (float)(1 / fmin(floor(4294967295.0 / texels), 1 << 22));
}

#define SHARED_ROWS "renderer/shaders/map/basis.def"
#include "renderer/shared/rows_c.h"

static bool fill(struct technique_run *run, const struct gl_texture *map, struct gl_texture *array,
    const struct convolution_desc *desc, uint32_t series_layers, bool weighted,
    struct pen_error *error)
{
    static const char *const defines[2][2] = {
        {NULL, "#define WEIGHTED\n"}, {"#define TABLES\n", "#define TABLES\n#define WEIGHTED\n"}};
    bool tables = desc->format == CONVOLUTION_TABLES;
    struct pass_texture from = {UNIT_SOURCE, map->name, GL_SAMPLE_NEAREST};
    struct convolution_block constants = convolution_constants(desc);
    convolution_fit(&constants, desc, run->face);
    struct basis_block block = {.range = constants.range,
        .terms = (int32_t)desc->terms,
        .table_scale = constants.table_scale};
    /* Tables are summed one layer at a time, outside the array. */
    struct gl_texture single = {0}, sums = {0};
    if (tables) {
        single = gl_texture_create(GL_RGBA32UI, desc->size, desc->size, 0, 1);
        sums = gl_texture_create(GL_RGBA32UI, desc->size + 1, desc->size + 1, 0, 1);
    }
    GLuint framebuffer;
    bool ok = true;
    gl.CreateFramebuffers(1, &framebuffer);
    for (uint32_t i = 0; ok && i < array->layers; i++) {
        if (tables)
            gl.NamedFramebufferTexture(framebuffer, GL_COLOR_ATTACHMENT0, single.name, 0);
        else
            gl.NamedFramebufferTextureLayer(
                framebuffer, GL_COLOR_ATTACHMENT0, array->name, 0, (GLint)i);
        block.first_term = i < series_layers ? (int32_t)(2 * i) : -1;
        ok = pass_fill(run->ctx,
            &(struct pass_fill){.name = "convolution basis",
                .fragment = "convolution.frag",
                .defines = defines[tables][weighted],
                .stage = PEN_STAGE_SHADOW,
                .textures = &from,
                .texture_count = 1,
                .framebuffer = framebuffer,
                .width = desc->size,
                .height = desc->size,
                .extra = &block,
                .extra_bytes = sizeof block},
            error);
        if (!ok || !tables)
            continue;
        ok = sat_scan(run->ctx, &single, &sums, SAT_AUTO, error);
        gl.CopyImageSubData(sums.name, GL_TEXTURE_2D, 0, 0, 0, 0, array->name, GL_TEXTURE_2D_ARRAY,
            0, 0, 0, (GLint)i, (GLsizei)sums.width, (GLsizei)sums.height, 1);
    }
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_texture_destroy(&single);
    gl_texture_destroy(&sums);
    if (tables)
        return ok;
    return ok && pass_mips(run->ctx, array, "convolution mips", error);
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
    bool tables = desc.format == CONVOLUTION_TABLES;
    uint32_t side = desc.size + tables, levels = tables ? 1 : 0;
    input->textures[0] = gl_texture_create(format, side, side, layers, levels);
    if (!fill(run, &map->textures[0], &input->textures[0], &desc, layers, false, error))
        return false;
    if (!desc.weighted)
        return true;
    input->textures[1] = gl_texture_create(format, side, side, layers + 1, levels);
    return fill(run, &map->textures[0], &input->textures[1], &desc, layers, true, error);
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
