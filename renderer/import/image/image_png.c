#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/image/image.h"
#include <spng.h>
#include <stdlib.h>
#include <string.h>

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

static uint32_t big_endian(const uint8_t *p)
{
    return (uint32_t)p[0] << 24 | (uint32_t)p[1] << 16 | (uint32_t)p[2] << 8 | p[3];
}

/* A copy without what a palette holds beyond the colours that the pixels can name, which other
 * decoders leave aside and ours refuses; NULL where there is no such thing. The checksum of the
 * chunk is then no longer its own. */
static uint8_t *with_short_palette(struct imp_bytes *data, uint32_t depth)
{
    for (size_t at = 8; data->bytes - at >= 12;) {
        size_t length = big_endian(data->data + at), most = (size_t)3 << depth;
        if (length > data->bytes - at - 12 || !memcmp(data->data + at + 4, "IDAT", 4))
            return NULL;
        if (!memcmp(data->data + at + 4, "PLTE", 4) && length > most && length <= 768) {
            uint8_t *copy = pen_alloc_zero(data->bytes, 1);
            size_t kept = at + 8 + most, from = at + 8 + length;
            memcpy(copy, data->data, kept);
            memcpy(copy + kept, data->data + from, data->bytes - from);
            copy[at + 2] = (uint8_t)(most >> 8);
            copy[at + 3] = (uint8_t)most;
            *data = (struct imp_bytes){copy, data->bytes - (length - most)};
            return copy;
        }
        at += 12 + length;
    }
    return NULL;
}

bool imp_png_decode(struct imp_bytes data, uint8_t *rgba, size_t rgba_bytes, bool *damaged)
{
    struct spng_ihdr header;
    spng_ctx *png = open_png(data, &header);
    uint8_t *copy = NULL;
    if (png && header.color_type == SPNG_COLOR_TYPE_INDEXED &&
        (copy = with_short_palette(&data, header.bit_depth))) {
        spng_ctx_free(png);
        png = open_png(data, &header);
        if (png)
            spng_set_crc_action(png, SPNG_CRC_USE, SPNG_CRC_DISCARD);
    }
    size_t bytes = 0, row_bytes = png ? rgba_bytes / header.height : 0;
    int failed =
        !png || spng_decoded_image_size(png, SPNG_FMT_RGBA8, &bytes) || bytes != rgba_bytes ||
        spng_decode_image(png, NULL, 0, SPNG_FMT_RGBA8, SPNG_DECODE_TRNS | SPNG_DECODE_PROGRESSIVE);
    bool some = false;
    struct spng_row_info row;
    while (!failed && !(failed = spng_get_row_info(png, &row))) {
        failed = spng_decode_row(png, rgba + row.row_num * row_bytes, row_bytes);
        some = some || !failed || failed == SPNG_EOI;
    }
    spng_ctx_free(png);
    free(copy);
    *damaged = failed != SPNG_EOI;
    return some;
}
