#include "renderer/import/geometry/accessor.h"
#include <stdio.h>
#include <string.h>

enum { I8 = 5120, U8 = 5121, I16 = 5122, U16 = 5123, U32 = 5125, F32 = 5126 };

static uint32_t component_bytes(uint32_t component)
{
    switch (component) {
    case I8:
    case U8:
        return 1;
    case I16:
    case U16:
        return 2;
    case U32:
    case F32:
        return 4;
    }
    return 0;
}

/* count elements, `stride` apart, from `offset` on: inside the view? No product can overflow: each
 * factor is below 2^32 by the schema. */
static bool fits(const struct imp_view *view, uint64_t offset, uint64_t count, uint64_t stride,
    uint64_t element_bytes)
{
    if (count > UINT32_MAX || stride > UINT32_MAX || offset > view->bytes)
        return false;
    return count == 0 || (count - 1) * stride + element_bytes <= view->bytes - offset;
}

static bool init_sparse(struct imp_reader *reader, const struct imp_document *document,
    const struct gltf_accessor *accessor, uint32_t element_bytes)
{
    uint32_t bytes = component_bytes(accessor->sparse_index_component);
    uint32_t component = accessor->sparse_index_component;
    uint64_t count = accessor->sparse_count;
    if ((component != U8 && component != U16 && component != U32) || count > accessor->count ||
        (uint32_t)accessor->sparse_index_view >= document->view_count ||
        (uint32_t)accessor->sparse_value_view >= document->view_count)
        return false;
    const struct imp_view *indices = &document->views[accessor->sparse_index_view];
    const struct imp_view *values = &document->views[accessor->sparse_value_view];
    if (!fits(indices, accessor->sparse_index_offset, count, bytes, bytes) ||
        !fits(values, accessor->sparse_value_offset, count, element_bytes, element_bytes))
        return false;
    reader->sparse_indices = indices->data + accessor->sparse_index_offset;
    reader->sparse_values = values->data + accessor->sparse_value_offset;
    reader->sparse_index_bytes = bytes;
    reader->sparse_count = (uint32_t)count;
    return true;
}

static uint32_t load_unsigned(const uint8_t *p, uint32_t bytes)
{
    uint32_t x = 0;
    memcpy(&x, p, bytes); /* little-endian, as is everything here */
    return x;
}

static bool sparse_increases(const struct imp_reader *reader)
{
    uint64_t next = 0; /* the least that the next index may be */
    for (uint32_t i = 0; i < reader->sparse_count; i++) {
        uint32_t bytes = reader->sparse_index_bytes;
        uint32_t index = load_unsigned(reader->sparse_indices + (size_t)i * bytes, bytes);
        if (index < next || index >= reader->count)
            return false;
        next = (uint64_t)index + 1;
    }
    return true;
}

bool imp_reader_init(struct imp_reader *reader, const struct imp_document *document,
    const struct gltf_model *model, int32_t number, struct pen_error *error)
{
    char pointer[64];
    snprintf(pointer, sizeof pointer, "/accessors/%d", number);
    memset(reader, 0, sizeof *reader);
    if ((uint32_t)number >= model->accessor_count)
        return pen_fail(error, PEN_INVALID, pointer, "glTF %s: it does not exist.", pointer);
    const struct gltf_accessor *accessor = &model->accessors[number];
    uint32_t element_bytes = accessor->components * component_bytes(accessor->component);
    if (!element_bytes)
        return pen_fail(error, PEN_INVALID, pointer,
            "glTF %s: its type or componentType does not suit its use.", pointer);
    if (accessor->count > UINT32_MAX - 1)
        return pen_fail(error, PEN_TOO_BIG, pointer, "glTF %s: it is too large.", pointer);
    reader->component = accessor->component;
    reader->components = accessor->components;
    reader->normalized = accessor->normalized;
    reader->count = (uint32_t)accessor->count;
    reader->stride = element_bytes;
    if (accessor->view >= 0) {
        if ((uint32_t)accessor->view >= document->view_count)
            return pen_fail(
                error, PEN_INVALID, pointer, "glTF %s: its bufferView does not exist.", pointer);
        const struct imp_view *view = &document->views[accessor->view];
        if (view->data && view->stride)
            reader->stride = view->stride;
        if (reader->stride < element_bytes)
            return pen_fail(error, PEN_INVALID, pointer,
                "glTF %s: its elements have %u bytes, but byteStride is %zu.", pointer,
                element_bytes, reader->stride);
        if (view->data &&
            !fits(view, accessor->offset, accessor->count, reader->stride, element_bytes))
            return pen_fail(
                error, PEN_INVALID, pointer, "glTF %s: it reaches beyond its bufferView.", pointer);
        reader->data = view->data ? view->data + accessor->offset : NULL;
    }
    if (accessor->sparse &&
        (!init_sparse(reader, document, accessor, element_bytes) || !sparse_increases(reader)))
        return pen_fail(error, PEN_INVALID, pointer,
            "glTF %s: its sparse part does not fit, or its indices do not increase.", pointer);
    return true;
}

/* Where element i is stored; NULL: it is zero. */
static const uint8_t *element(const struct imp_reader *reader, uint32_t i)
{
    uint32_t low = 0, high = reader->sparse_count, bytes = reader->sparse_index_bytes;
    while (low < high) {
        uint32_t middle = low + (high - low) / 2;
        uint32_t index = load_unsigned(reader->sparse_indices + (size_t)middle * bytes, bytes);
        if (index == i)
            return reader->sparse_values +
                   (size_t)middle * reader->components * component_bytes(reader->component);
        if (index < i)
            low = middle + 1;
        else
            high = middle;
    }
    return reader->data ? reader->data + (size_t)i * reader->stride : NULL;
}

static float load_float(const uint8_t *p, uint32_t component, bool normalized)
{
    int32_t x;
    float f, scale;
    switch (component) {
    case I8:
        x = (int8_t)*p;
        scale = 127;
        break;
    case U8:
        x = *p;
        scale = 255;
        break;
    case I16:
        x = (int16_t)load_unsigned(p, 2);
        scale = 32767;
        break;
    case U16:
        x = (int32_t)load_unsigned(p, 2);
        scale = 65535;
        break;
    case U32:
        return (float)load_unsigned(p, 4); /* glTF does not allow it normalised */
    default:
        memcpy(&f, p, 4);
        return f;
    }
    if (!normalized)
        return (float)x;
    f = (float)x / scale;
    return f < -1 ? -1 : f; /* the most negative integer stands for -1 too */
}

void imp_read_floats(const struct imp_reader *reader, uint32_t i, float *out, uint32_t components)
{
    const uint8_t *p = element(reader, i);
    uint32_t n = components < reader->components ? components : reader->components;
    uint32_t bytes = component_bytes(reader->component);
    for (uint32_t k = 0; k < n; k++)
        out[k] = p ? load_float(p + (size_t)k * bytes, reader->component, reader->normalized) : 0;
}

uint32_t imp_read_index(const struct imp_reader *reader, uint32_t i)
{
    const uint8_t *p = element(reader, i);
    return p ? load_unsigned(p, component_bytes(reader->component)) : 0;
}
