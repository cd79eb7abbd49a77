#include "renderer/passes/filter/light_samples.h"
#include <math.h>
#include <stdio.h>

#define SHARED_ROWS "renderer/shaders/filter/filter.def"
#include "renderer/shared/rows_c.h"
#define SHARED_ROWS "renderer/shaders/filter/light_samples.def"
#include "renderer/shared/rows_c.h"

static bool look_up(struct technique_run *run, const struct sample_block *block,
    const struct gl_texture *maps, bool sparse, bool emitted, struct pen_error *error)
{
    struct pass_texture textures[] = {{UNIT_SAMPLE_MAPS, maps->name, GL_SAMPLE_NEAREST_BORDER},
        {UNIT_SPREAD, pass_penumbra_target(run, PENUMBRA_SPREAD)->texture.name, GL_SAMPLE_NEAREST}};
    const struct gl_target *target =
        pass_penumbra_target(run, emitted ? PENUMBRA_ALL : PENUMBRA_LIT);
    char defines[64];
    snprintf(defines, sizeof defines, "%s%s", sparse ? "#define SPARSE\n" : "",
        emitted ? "#define EMITTED\n" : "");
    return pass_screen(run,
        &(struct pass_screen){.name = emitted ? "light samples, unshadowed" : "light samples",
            .body = "light_samples.glsl",
            .defines = defines,
            .textures = textures,
            .texture_count = 2,
            .framebuffer = target->framebuffer,
            .add = block->range[1] > 0, /* the first batch replaces what the target starts as */
            .extra = block,
            .extra_bytes = sizeof *block},
        error);
}

bool pass_light_samples(struct technique_run *run, uint32_t maps, uint32_t map_size,
    uint32_t per_pixel, struct pen_error *error)
{
    struct sample_point points[LIGHT_SAMPLES_MOST];
    bool textured = run->face->textured, sparse = per_pixel < maps;
    sample_points(run->face, maps, points);
    uint64_t bytes = (uint64_t)maps * map_size * map_size * 4 * run->light->face_count;
    bool keep = bytes <= run->ctx->shadow_budget;
    if (pass_is_first_face(run))
        pass_penumbra_start(run, false);
    for (uint32_t first = 0; first < maps; first += SAMPLE_MAP_BATCH) {
        uint32_t left = maps - first, count = left < SAMPLE_MAP_BATCH ? left : SAMPLE_MAP_BATCH;
        struct sample_block block = {.range = {(int32_t)count, (int32_t)first, (int32_t)maps},
            .cell = {2 / sqrtf((float)maps), 1.0f / (float)(sparse ? per_pixel : maps)}};
        const struct gl_texture *layers;
        if (!pass_sample_maps(
                run, points + first, count, map_size, keep, block.samples, &layers, error) ||
            !look_up(run, &block, layers, sparse, false, error) ||
            (textured && !look_up(run, &block, layers, sparse, true, error)))
            return false;
    }
    return true;
}
