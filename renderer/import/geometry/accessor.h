/* Reading accessors: every component type, normalised, strided, sparse, or all zeros. */
#pragma once
#include "renderer/import/document/document.h"
#include "renderer/import/document/gltf_tiny.h"

struct imp_reader {
    const uint8_t *data; /* first element; NULL: zeros */
    size_t stride;
    uint32_t component, components;
    bool normalized;
    uint32_t count;
    const uint8_t *sparse_indices, *sparse_values; /* tightly packed; indices strictly increase */
    uint32_t sparse_index_bytes, sparse_count;
};

/* Checks that all of accessor `number` lies inside its views. Errors: PEN_INVALID. */
bool imp_reader_init(struct imp_reader *reader, const struct imp_document *document,
    const struct gltf_model *model, int32_t number, struct pen_error *error);

/* Element i as floats, in glTF's sense of normalised; components beyond those it has are left as
 * they are. */
void imp_read_floats(const struct imp_reader *reader, uint32_t i, float *out, uint32_t components);
/* Element i of a scalar unsigned accessor. */
uint32_t imp_read_index(const struct imp_reader *reader, uint32_t i);
