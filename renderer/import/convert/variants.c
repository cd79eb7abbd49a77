#include "renderer/import/convert/variants.h"
#include "protocol/memory.h"
#include "renderer/import/convert/material.h"
#include "renderer/import/base/name.h"
#include <stdlib.h>

void imp_variants_note(struct imp_context *context, uint32_t primitive, uint32_t psc)
{
    const struct gltf_primitive *from = &context->model->primitives[primitive];
    const struct gltf_mapping *mappings = context->model->mappings + from->first_mapping;
    uint32_t sets[2], others[2];
    imp_material_uv_sets(context, from->material, sets);
    for (uint32_t i = 0; i < from->mapping_count; i++) {
        imp_material_uv_sets(context, mappings[i].material, others);
        if (sets[0] != others[0] || sets[1] != others[1])
            imp_warn(context,
                "A variant's material uses other sets of texture coordinates than the "
                "one it replaces; its textures may lie wrongly.");
        context->swaps = pen_grow(
            context->swaps, &context->swap_room, context->swap_count + 1, sizeof *context->swaps);
        context->swaps[context->swap_count] = (struct imp_swap){mappings[i].variant,
            context->swap_count, {psc, imp_material(context, mappings[i].material)}};
        context->swap_count++;
    }
}

bool imp_variants_normal_map(
    struct imp_context *context, uint32_t primitive, struct psc_texture_ref *map)
{
    const struct gltf_primitive *from = &context->model->primitives[primitive];
    bool found = imp_material_normal_map(context, from->material, map);
    for (uint32_t i = 0; !found && i < from->mapping_count; i++)
        found = imp_material_normal_map(
            context, context->model->mappings[from->first_mapping + i].material, map);
    return found;
}

static int by_variant(const void *a, const void *b)
{
    const struct imp_swap *x = a, *y = b;
    if (x->variant != y->variant)
        return x->variant < y->variant ? -1 : 1;
    return x->order < y->order ? -1 : x->order > y->order;
}

void imp_variants_close(struct imp_context *context)
{
    uint32_t next = 0;
    if (context->swap_count)
        qsort(context->swaps, context->swap_count, sizeof *context->swaps, by_variant);
    for (uint32_t v = 0; v < context->model->variant_count; v++) {
        struct psc_variant variant = {.first_swap = next};
        imp_name(variant.name, context->model->variants[v], "");
        for (; next < context->swap_count && context->swaps[next].variant == v; next++)
            psc_builder_add_motion(context->builder, PSC_SWAPS, &context->swaps[next].swap, 1);
        variant.swap_count = next - variant.first_swap;
        psc_builder_add_motion(context->builder, PSC_VARIANTS, &variant, 1);
    }
}
