#include "renderer/import/convert/convert.h"
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/light.h"
#include "renderer/import/convert/marks.h"
#include "renderer/import/convert/material.h"
#include "renderer/import/convert/mesh.h"
#include "renderer/import/convert/node.h"
#include "renderer/import/convert/texture.h"
#include "renderer/import/convert/variants.h"
#include "renderer/import/motion/motion.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t *not_yet(size_t count)
{
    uint32_t *numbers = pen_alloc_zero(count, sizeof *numbers);
    memset(numbers, 0xff, count * sizeof *numbers);
    return numbers;
}

bool imp_convert(struct imp_document *document, struct gltf_model *model,
    struct psc_builder *builder, struct pen_error *error)
{
    struct imp_context context = {.document = document,
        .model = model,
        .builder = builder,
        .optimiser_work = IMP_MAX_OPTIMISER_WORK,
        .primitives = not_yet(model->primitive_count),
        .materials = not_yet((size_t)model->material_count + 1),
        .textures = not_yet(IMP_ROLES * (size_t)model->texture_count),
        .image_slots = pen_alloc_zero(
            IMP_ROLES * ((size_t)document->image_count + 1), sizeof(struct imp_image_slot)),
        .bounds_min = {INFINITY, INFINITY, INFINITY},
        .bounds_max = {-INFINITY, -INFINITY, -INFINITY},
        .primitive_bounds = pen_alloc_zero(model->primitive_count, sizeof(struct primitive_bounds)),
        .warned = pen_alloc_zero(IMP_MAX_WARNINGS, sizeof(uint64_t))};
    bool done = false;
    if (model->primitive_count > IMP_MAX_PRIMITIVES) {
        pen_fail(error, PEN_TOO_BIG, "", "The glTF has %u primitives; %u are allowed.",
            model->primitive_count, IMP_MAX_PRIMITIVES);
        goto fail;
    }
    if (model->scene_count > 1)
        imp_warn(&context, "The glTF has %u scenes; scene %u is used.", model->scene_count,
            model->scene);
    imp_marks_plan(&context);
    if (!imp_primitives_fit(model, error) || !imp_add_nodes(&context, error))
        goto fail;
    imp_material(&context, -1); /* a blob has at least one material */
    if (!context.instance_count)
        imp_warn(&context, "The scene draws nothing.");
    imp_variants_close(&context);
    imp_lights_close(&context);
    done = imp_add_images(&context, error);
fail:
    free(context.primitives);
    free(context.materials);
    free(context.textures);
    free(context.image_slots);
    free(context.primitive_bounds);
    imp_motion_free(context.motion);
    free(context.swaps);
    free(context.stamps);
    free(context.stamped);
    free(context.warned);
    return done;
}
