#include "renderer/import/base/budget.h"
#include "renderer/import/image/image.h"
#include <spng.h>

#define CHUNK_BYTES (4u << 20) /* of an ancillary chunk (ICC profile, text) */

static spng_ctx *open_png(struct imp_bytes data, struct spng_ihdr *header)
{
    spng_ctx *png = spng_ctx_new(0);
    if (png && !spng_set_image_limits(png, INT32_MAX, INT32_MAX) &&
        !spng_set_chunk_limits(png, CHUNK_BYTES, 4 * CHUNK_BYTES) &&
        !spng_set_png_buffer(png, data.data, data.bytes) && !spng_get_ihdr(png, header))
        return png;
    spng_ctx_free(png);
    return NULL;
}

bool imp_png_header(struct imp_bytes data, uint32_t *width, uint32_t *height)
{
    struct spng_ihdr header;
    spng_ctx *png = open_png(data, &header);
    if (!png)
        return false;
    *width = header.width;
    *height = header.height;
    spng_ctx_free(png);
    return true;
}

bool imp_png_decode(struct imp_bytes data, uint8_t *rgba, size_t rgba_bytes)
{
    struct spng_ihdr header;
    spng_ctx *png = open_png(data, &header);
    size_t bytes = 0;
    bool done = png && !spng_decoded_image_size(png, SPNG_FMT_RGBA8, &bytes) &&
                bytes == rgba_bytes &&
                !spng_decode_image(png, rgba, rgba_bytes, SPNG_FMT_RGBA8, SPNG_DECODE_TRNS);
    spng_ctx_free(png);
    return done;
}
