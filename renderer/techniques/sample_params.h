/* Rows and glue that the methods share which average the answers of maps seen from light samples. */
#pragma once
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/light/sample_maps.h"
#include "renderer/techniques/map_params.h"

static const char *const weighting_names[] = {"area", "g", NULL};

#define WEIGHTING_ROW(aggregate)                                                                   \
    PARAM(aggregate, weighting, .choices = weighting_names, .specialise = 1,                       \
        .help = "Mean over the light's area, or weighted by each point's irradiance.")

#define SHARED_ROWS "renderer/techniques/multisample.def"
#include "renderer/shared/rows_c.h"

struct sample_batch {
    const char *name;                  /* of the pass */
    const struct sample_point *points; /* [count] */
    uint32_t count, map_size;
    bool keep;
    uint32_t total;                  /* samples that the sum will be the mean of; 1: it is a sum */
    const struct gl_texture *counts; /* NULL: all pixels; else those whose x is less than `below` */
    float below;
};

/* Adds what the receivers see of the batch's points to *sum, as shares of `total`. */
static inline bool sample_batch_add(struct technique_run *run, const struct sample_batch *b,
    const struct gl_target *sum, struct pen_error *error)
{
    struct lookup_block block = {
        .count = {(int32_t)b->count}, .weight = {1.0f / (float)b->total, b->below}};
    const struct gl_texture *maps;
    if (!pass_sample_maps(
            run, b->points, b->count, b->map_size, b->keep, block.samples, &maps, error))
        return false;
    struct pass_texture textures[] = {{UNIT_SAMPLE_MAPS, maps->name, GL_SAMPLE_NEAREST_BORDER},
        {UNIT_SOURCE, b->counts ? b->counts->name : 0, GL_SAMPLE_NEAREST}};
    return pass_screen(run,
        &(struct pass_screen){.name = b->name,
            .body = "multisample.glsl",
            .defines = b->counts ? "#define SOME\n" : NULL,
            .textures = textures,
            .texture_count = b->counts ? 2 : 1,
            .framebuffer = sum->framebuffer,
            .add = true,
            .extra = &block,
            .extra_bytes = sizeof block},
        error);
}
