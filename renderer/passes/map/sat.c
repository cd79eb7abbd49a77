#include "renderer/passes/map/sat.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/draw/turn.h"
#include "renderer/passes/map/depth_map.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define SHARED_ROWS "renderer/shaders/map/sat_scan.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/map/sat_moments.def"
#include "renderer/shared/rows_c.h"

static uint32_t components(GLenum format)
{
    return format == GL_RGBA32UI ? 4 : 2;
}

static bool scan_on_host(
    const struct gl_texture *from, const struct gl_texture *to, struct pen_error *error)
{
    uint32_t n = components(from->format), side = from->width, stride = (side + 1) * n;
    GLenum layout = n == 4 ? GL_RGBA_INTEGER : GL_RG_INTEGER;
    size_t in_bytes = (size_t)side * side * n * 4, out_bytes = (size_t)stride * (side + 1) * 4;
    uint32_t *in = malloc(in_bytes), *out = malloc(out_bytes);
    bool ok = in && out;
    if (ok) {
        gl.GetTextureImage(from->name, 0, layout, GL_UNSIGNED_INT, (GLsizei)in_bytes, in);
        memset(out, 0, stride * 4);
        for (uint32_t y = 0; y < side; y++) {
            const uint32_t *source = in + (size_t)y * side * n, *above = out + (size_t)y * stride;
            uint32_t *row = out + (size_t)(y + 1) * stride, sum[4] = {0};
            memset(row, 0, n * 4);
            for (uint32_t x = 0; x < side; x++)
                for (uint32_t k = 0; k < n; k++) {
                    sum[k] += source[x * n + k];
                    row[(x + 1) * n + k] = sum[k] + above[(x + 1) * n + k];
                }
        }
        gl.TextureSubImage2D(to->name, 0, 0, 0, (GLsizei)(side + 1), (GLsizei)(side + 1), layout,
            GL_UNSIGNED_INT, out);
    }
    free(in);
    free(out);
    return ok || pen_fail(error, PEN_UNAVAILABLE, "", "Not enough memory for a summed-area table.");
}

static void dispatch(
    GLuint program, const struct gl_texture *from, const struct gl_texture *to, uint32_t lines)
{
    gl.UseProgram(program);
    gl.BindTextureUnit(UNIT_SOURCE, from->name);
    gl.BindImageTexture(IMAGE_SUMS, to->name, 0, GL_FALSE, 0, GL_WRITE_ONLY, to->format);
    gl.DispatchCompute(lines, 1, 1);
    gl.MemoryBarrier(GL_TEXTURE_FETCH_BARRIER_BIT | GL_TEXTURE_UPDATE_BARRIER_BIT |
                     GL_SHADER_IMAGE_ACCESS_BARRIER_BIT);
}

static bool scan_on_device(struct technique_ctx *ctx, const struct gl_texture *from,
    const struct gl_texture *to, struct pen_error *error)
{
    static const char *const defines[2][2] = {
        {"#define FORMAT rg32ui\n#define OFFSET 0\n", "#define FORMAT rg32ui\n#define OFFSET 1\n"},
        {"#define FORMAT rgba32ui\n#define OFFSET 0\n",
            "#define FORMAT rgba32ui\n#define OFFSET 1\n"}};
    GLuint programs[2];
    for (int i = 0; i < 2; i++) {
        struct gl_program_desc desc = {
            .compute = "sat_scan.comp", .defines = defines[components(from->format) == 4][i]};
        if (!(programs[i] = gl_programs_get(ctx->programs, &desc, error)))
            return false;
    }
    static const uint32_t zero[4] = {0};
    GLenum layout = components(to->format) == 4 ? GL_RGBA_INTEGER : GL_RG_INTEGER;
    struct gl_texture rows = gl_texture_create(from->format, from->width, from->width, 0, 1);
    gl.ClearTexImage(to->name, 0, layout, GL_UNSIGNED_INT, zero);
    gl.BindSampler(UNIT_SOURCE, 0);
    dispatch(programs[0], from, &rows, from->width);
    dispatch(programs[1], &rows, to, from->width);
    gl.BindTextureUnit(UNIT_SOURCE, 0);
    gl_texture_destroy(&rows);
    return true;
}

bool sat_scan(struct technique_ctx *ctx, const struct gl_texture *from, const struct gl_texture *to,
    enum sat_path path, struct pen_error *error)
{
    gl_timer_begin(&ctx->timer, PEN_STAGE_SHADOW, "summed-area table");
    bool host = path == SAT_HOST || (path == SAT_AUTO && ctx->software);
    bool ok = host ? scan_on_host(from, to, error) : scan_on_device(ctx, from, to, error);
    gl_timer_end(&ctx->timer);
    return ok && pass_turn(ctx, error);
}

/* Side and widest window. The blocker search is widest at the far plane; smaller lights still need
 * room for the least filter of a method. */
static void fit(const struct light_face *f, const struct sat_table *table, struct sat_block *block)
{
    const float least = 40;
    uint32_t side = table->map_size;
    for (;; side /= 2) {
        float widest = 0;
        for (int k = 0; k < 2; k++) {
            float reach = f->far_z - f->near_z;
            float half = f->extent[k] * (f->parallel ? reach : reach / f->far_z);
            float texel = (f->rect[2 + k] - f->rect[k]) / (float)side;
            block->window[k] = fminf(fmaxf(2 * half / texel, least), (float)side);
            widest = fmaxf(widest, block->window[k]);
        }
        if (widest <= fmaxf((float)table->max_window, least) || side < 2 * 64 || side % 2)
            break;
    }
    block->side = (float)side;
    /* Fractional corners touch one more texel on either side. */
    double texels = (ceil(block->window[0]) + 2) * (ceil(block->window[1]) + 2);
    block->inverse_scale = 1 / (float)fmin(floor(4294967295.0 / texels), 1 << 22);
}

enum { KEY_KIND, KEY_SIDE, KEY_SCALE, KEY_PATH };

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    uint32_t kind = key->extra[KEY_KIND], side = key->extra[KEY_SIDE];
    const struct shadow_input *depth = pass_depth_map(run, key->size, error);
    if (!depth)
        return false;
    GLenum format = kind == SAT_FOUR_MOMENTS ? GL_RGBA32UI : GL_RG32UI;
    struct gl_texture moments = gl_texture_create(format, side, side, 0, 1);
    GLuint framebuffer = gl_framebuffer_create(&(const struct gl_texture *){&moments}, 1, NULL);
    struct pass_texture source = {UNIT_SOURCE, depth->textures[0].name, GL_SAMPLE_NEAREST};
    struct scale_block block = {.scale = {0, (float)(key->size / side)}};
    memcpy(&block.scale[0], &key->extra[KEY_SCALE], 4);
    input->textures[0] = gl_texture_create(format, side + 1, side + 1, 0, 1);
    bool ok = pass_fill(run->ctx,
                  &(struct pass_fill){.name = "moments",
                      .fragment = "sat_moments.frag",
                      .defines = kind == SAT_FOUR_MOMENTS ? "#define FOUR\n" : NULL,
                      .stage = PEN_STAGE_SHADOW,
                      .textures = &source,
                      .texture_count = 1,
                      .framebuffer = framebuffer,
                      .width = side,
                      .height = side,
                      .extra = &block,
                      .extra_bytes = sizeof block},
                  error) &&
              sat_scan(run->ctx, &moments, &input->textures[0], key->extra[KEY_PATH], error);
    gl.DeleteFramebuffers(1, &framebuffer);
    gl_texture_destroy(&moments);
    return ok;
}

const struct shadow_input *pass_sat(struct technique_run *run, const struct sat_table *table,
    struct sat_block *block, struct pen_error *error)
{
    fit(run->face, table, block);
    struct shadow_key key = {.kind = "summed-area table", .size = table->map_size};
    float scale = 1 / block->inverse_scale;
    key.extra[KEY_KIND] = table->kind;
    key.extra[KEY_SIDE] = (uint32_t)block->side;
    memcpy(&key.extra[KEY_SCALE], &scale, 4);
    key.extra[KEY_PATH] = table->path;
    return shadow_cache_get(run, &key, build, error);
}
