/* Rows and glue that the methods on convolution shadow maps share. */
#pragma once
#include "renderer/passes/draw/screen.h"
#include "renderer/passes/map/classify.h"
#include "renderer/passes/map/convolution.h"
#include "renderer/passes/map/min_max.h"
#include "renderer/techniques/map_params.h"
#include <stdio.h>

#define CONVOLUTION_ROWS(aggregate, default_terms, default_storage)                                \
    PARAM(aggregate, terms, .def = default_terms, .min = 1, .max = CONVOLUTION_MAX_TERMS,          \
        .help = "Terms of the series; more make contacts sharper and the maps larger."),           \
        PARAM(aggregate, damping, .def = 0.1, .min = 0, .max = 4,                                  \
            .help = "Damps high terms against ringing; 0 keeps the bare series."),                 \
        PARAM(aggregate, offset, .def = 0.3, .min = 0, .max = 1,                                   \
            .unit = "1/terms of the depth range",                                                  \
            .help = "Moves receivers towards the light, so that they do not block themselves; 0 "  \
                    "doubles the visibility instead."),                                            \
        PARAM(aggregate, contact, .def = 1,                                                        \
            .help =                                                                                \
                "Measures each lookup against its nearest caster, which keeps contacts dark."),    \
        PARAM(aggregate, storage, .def = default_storage, .choices = convolution_format_names,     \
            .help =                                                                                \
                "Maps with mips of 8 or 16 bits, or summed-area tables: exact boxes, more reads.")
#define RAW_ROW(aggregate)                                                                         \
    PARAM(aggregate, raw, .def = 0,                                                                \
        .help = "Shows the bare series: not rescaled to reach 0 and 1, nothing proven lit.")

#define CONVOLUTION_DESC(params, with_depth)                                                       \
    {                                                                                              \
        .size = (params)->map_size, .terms = (params)->terms, .format = (params)->storage,         \
        .damping = (params)->damping, .offset = (params)->offset, .weighted = (with_depth),        \
        .contact = (params)->contact.on                                                            \
    }

/* Prepares the maps and runs the pass, whose body includes convolution.glsl, over the receivers.
 * `margin`: texels that it looks at beyond the light's windows; negative: every pixel is drawn. */
static inline bool convolution_screen(struct technique_run *run,
    const struct convolution_desc *desc, struct pass_screen pass, float margin,
    struct pen_error *error)
{
    const struct shadow_input *series = pass_convolution(run, desc, error);
    const struct shadow_input *min_max =
        series ? pass_caster_min_max(run, desc->size, error) : NULL;
    struct classify_desc classes = {.map_size = desc->size,
        .margin_texels = margin,
        .one_window = true,
        .bound = desc->weighted ? BOUND_LIGHT : BOUND_KERNEL};
    if (!min_max || (margin >= 0 && !pass_classify(run, &classes, &pass.tiles, error)))
        return false;
    bool tables = desc->format == CONVOLUTION_TABLES;
    enum gl_sampler_kind sampler = tables ? GL_SAMPLE_NEAREST : GL_SAMPLE_TRILINEAR;
    struct convolution_block block = convolution_constants(desc);
    convolution_fit(&block, desc, run->face);
    struct pass_texture textures[] = {{UNIT_BASIS, series->textures[0].name, sampler},
        {UNIT_BASIS_WEIGHTED, series->textures[desc->weighted].name, sampler},
        {UNIT_MIN_MAX, min_max->textures[0].name, GL_SAMPLE_NEAREST}};
    pass.textures = textures;
    pass.texture_count = 3;
    pass.extra = &block;
    pass.extra_bytes = sizeof block;
    char defines[96];
    snprintf(defines, sizeof defines, "%s%s%s", tables ? "#define TABLES\n" : "",
        desc->contact ? "#define CONTACT\n" : "", pass.defines ? pass.defines : "");
    pass.defines = defines;
    return pass_screen(run, &pass, error);
}
