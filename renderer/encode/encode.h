/* Image files from finished frames. Thread-safe: no state between calls. C++ stays behind it. */
#pragma once
#include "renderer/renderer.h"

struct pen_bytes {
    uint8_t *data; /* freed with pen_bytes_finish */
    size_t size;
};
void pen_bytes_finish(struct pen_bytes *bytes);

/* Encodes `frame` as output->format asks (bit depth 0: the format's default). `attributes` are
 * written as metadata where the format has any: NUL-terminated "key=value" strings, `attribute_count`
 * of them; no time stamps, so that the same request gives the same bytes.
 * Errors: PEN_INTERNAL. */
bool pen_encode(const struct pen_frame *frame, const struct pen_output *output,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error);

/* The pixel type the renderer should deliver for this output. */
enum pen_pixel pen_encode_wants(const struct pen_output *output);
