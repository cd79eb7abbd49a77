/* Scenes made of parallelograms. */
#pragma once
#include "renderer/blob/builder.h"
#include "tests/accuracy/harness.h"
#include <stdlib.h>
#include <string.h>

struct quad {
    float center[3], half_u[3], half_v[3];
    float color[4]; /* alpha below 1: blended */
};

static inline void add_quad(struct psc_builder *builder, const struct quad *q, bool unlit)
{
    static const uint32_t indices[] = {0, 1, 2, 0, 2, 3};
    static const float world[12] = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
    struct pen_error error = {0};
    struct psc_material material = psc_material_default();
    float positions[4][3];
    uint32_t primitive;
    memcpy(material.base_color, q->color, sizeof material.base_color);
    material.alpha_mode = q->color[3] == 1 ? PSC_OPAQUE : PSC_BLEND;
    material.flags = PSC_DOUBLE_SIDED | (unlit ? PSC_UNLIT : 0u);
    for (int i = 0; i < 4; i++)
        for (int k = 0; k < 3; k++)
            positions[i][k] = q->center[k] + (i == 1 || i == 2 ? 1 : -1) * q->half_u[k] +
                              (i >= 2 ? 1 : -1) * q->half_v[k];
    struct psc_mesh mesh = {.positions = (const float(*)[3])positions,
        .vertex_count = 4,
        .indices = indices,
        .index_count = 6,
        .material = psc_builder_add_material(builder, &material)};
    if (!psc_builder_add_mesh(builder, &mesh, &primitive, &error))
        exit(1);
    psc_builder_add_instance(builder, primitive, world);
}

/* Loads them under an id of their own. */
static inline void load_quads(
    const struct quad *quads, uint32_t count, bool unlit, uint8_t id[PEN_ID_BYTES])
{
    static uint32_t number;
    struct pen_error error = {0};
    struct psc_builder *builder = psc_builder_create();
    void *data;
    size_t bytes;
    for (uint32_t i = 0; i < count; i++)
        add_quad(builder, &quads[i], unlit);
    memset(id, 0, PEN_ID_BYTES);
    number++;
    memcpy(id, "quads", sizeof "quads");
    memcpy(id + 8, &number, sizeof number);
    if (!psc_builder_finish(builder, id, &data, &bytes, &error))
        exit(1);
    psc_builder_destroy(builder);
    harness_scene_blob(data, bytes, id);
}
