#include "renderer/passes/map/moments.h"
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/blur.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/depth_map.h"
#include <string.h>

#define SHARED_ROWS "renderer/shaders/map/moments.def"
#include "renderer/shared/rows_c.h"

enum { KEY_KIND, KEY_BLUR, KEY_EXPONENTS };

static bool build(struct technique_run *run, const struct shadow_key *key,
    struct shadow_input *input, struct pen_error *error)
{
    static const GLenum formats[] = {GL_RG32F, GL_RGBA32F, GL_RGBA32F, GL_RGBA16};
    static const char *const defines[] = {
        "#define VARIANCE\n", "#define EXPONENTIAL\n", NULL, NULL};
    uint32_t kind = key->extra[KEY_KIND], margin = key->extra[KEY_BLUR] + 2;
    uint32_t side = key->size + 2 * margin;
    const struct shadow_input *depth = pass_depth_map(run, key->size, error);
    if (!depth)
        return false;
    struct gl_texture *map = &input->textures[0];
    *map = gl_texture_create(formats[kind], side, side, 0, 0);
    GLuint framebuffer = gl_framebuffer_create(&(const struct gl_texture *){map}, 1, NULL);
    struct moment_block block = {.exponents = {0, 0, (float)margin}};
    memcpy(block.exponents, &key->extra[KEY_EXPONENTS], 8);
    struct pass_texture source = {UNIT_SOURCE, depth->textures[0].name, GL_SAMPLE_NEAREST};
    bool ok = pass_fill(run->ctx,
        &(struct pass_fill){.name = "moments",
            .fragment = "moments.frag",
            .defines = defines[kind],
            .stage = PEN_STAGE_SHADOW,
            .textures = &source,
            .texture_count = 1,
            .framebuffer = framebuffer,
            .width = side,
            .height = side,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
    gl.DeleteFramebuffers(1, &framebuffer);
    return ok && pass_blur(run->ctx, map, key->extra[KEY_BLUR], error);
}

const struct shadow_input *pass_moments(
    struct technique_run *run, const struct moment_map *map, struct pen_error *error)
{
    struct shadow_key key = {.kind = "moments", .size = map->size};
    key.extra[KEY_KIND] = map->kind;
    key.extra[KEY_BLUR] = map->blur;
    memcpy(&key.extra[KEY_EXPONENTS], map->exponents, sizeof map->exponents);
    return shadow_cache_get(run, &key, build, error);
}

bool pass_moment_tiles(struct technique_run *run, const struct moment_map *map,
    const struct gl_texture **tiles, struct pen_error *error)
{
    /* The kernel, and one and a half texels of the coarser level, which are at most twice as large
     * as the pixel. */
    return pass_classify(run,
        &(struct classify_desc){.map_size = map->size,
            .margin_texels = (float)map->blur + 1.5f,
            .margin_pixels = 3,
            .one_window = true,
            .bound = BOUND_KERNEL},
        tiles, error);
}
