/* PNG (ISO/IEC 15948) with filter SUB on every row and ISA-L's igzip at level 1: on rendered images
 * that is several times as fast as zlib at its lowest level, for about the same size. */
#include "renderer/encode/png_fast.h"
#include "renderer/encode/pixels.h"
#include <isa-l.h>
#include <stdlib.h>
#include <string.h>

#define ROWS_BYTES (128u << 10) /* filtered bytes per deflate call: stays in the L2 cache */
#define KEYWORD_MAX 79          /* bytes, by the specification */

struct out {
    uint8_t *data;
    size_t size, capacity;
    bool failed; /* out of memory; everything after is ignored */
};

static bool out_reserve(struct out *out, size_t more)
{
    if (out->failed)
        return false;
    if (out->capacity - out->size >= more)
        return true;
    size_t capacity = out->capacity * 2 > out->size + more ? out->capacity * 2 : out->size + more;
    uint8_t *data = realloc(out->data, capacity);
    if (!data) {
        out->failed = true;
        return false;
    }
    out->data = data;
    out->capacity = capacity;
    return true;
}

static void out_bytes(struct out *out, const void *data, size_t size)
{
    if (!out_reserve(out, size))
        return;
    memcpy(out->data + out->size, data, size);
    out->size += size;
}

static void put_u32(uint8_t *to, uint32_t value)
{
    to[0] = (uint8_t)(value >> 24);
    to[1] = (uint8_t)(value >> 16);
    to[2] = (uint8_t)(value >> 8);
    to[3] = (uint8_t)value;
}

/* Starts a chunk whose length is filled in by chunk_end. Returns where it starts. */
static size_t chunk_begin(struct out *out, const char type[4])
{
    size_t start = out->size;
    out_bytes(out, "\0\0\0\0", 4);
    out_bytes(out, type, 4);
    return start;
}

static void chunk_end(struct out *out, size_t start)
{
    if (out->failed)
        return;
    size_t size = out->size - start - 8;
    put_u32(out->data + start, (uint32_t)size);
    uint8_t crc[4];
    put_u32(crc, crc32_gzip_refl(0, out->data + start + 4, size + 4));
    out_bytes(out, crc, 4);
}

static bool is_printable_ascii(const char *text, size_t size)
{
    for (size_t i = 0; i < size; i++)
        if ((text[i] < ' ' || text[i] > '~') && text[i] != '\n')
            return false;
    return true;
}

/* "key=value" as tEXt, or as iTXt when the value is not plain ASCII. An entry without a usable key
 * (none, or not ASCII) is left out: a reader would reject the file. */
static void put_text(struct out *out, const char *attribute)
{
    const char *equals = strchr(attribute, '=');
    size_t key = equals ? (size_t)(equals - attribute) : 0;
    if (key == 0 || key > KEYWORD_MAX || !is_printable_ascii(attribute, key) ||
        memchr(attribute, '\n', key) || attribute[0] == ' ' || attribute[key - 1] == ' ')
        return;
    const char *value = equals + 1;
    bool plain = is_printable_ascii(value, strlen(value));
    size_t chunk = chunk_begin(out, plain ? "tEXt" : "iTXt");
    out_bytes(out, attribute, key);
    out_bytes(out, "\0\0\0\0\0", plain ? 1 : 5); /* iTXt: not compressed, no language, no keyword */
    out_bytes(out, value, strlen(value));
    chunk_end(out, chunk);
}

/* Filter type 1: every byte minus the byte one pixel to the left. */
static void filter_sub(uint8_t *restrict to, const uint8_t *restrict row, size_t size, uint32_t bpp)
{
    *to++ = 1;
    memcpy(to, row, bpp < size ? bpp : size);
    for (size_t i = bpp; i < size; i++)
        to[i] = (uint8_t)(row[i] - row[i - bpp]);
}

static bool deflate_some(struct isal_zstream *stream, struct out *out)
{
    do {
        if (!out_reserve(out, 64 << 10))
            return false;
        size_t room = out->capacity - out->size;
        stream->avail_out = room > (1u << 30) ? 1u << 30 : (uint32_t)room;
        uint32_t before = stream->avail_out;
        stream->next_out = out->data + out->size;
        if (isal_deflate(stream) != COMP_OK)
            return false;
        out->size += before - stream->avail_out;
    } while (stream->avail_out == 0 || stream->avail_in);
    return true;
}

static void swap_to_big_endian(uint8_t *row, size_t bytes)
{
    for (size_t i = 0; i < bytes; i += 2) {
        uint8_t low = row[i];
        row[i] = row[i + 1];
        row[i + 1] = low;
    }
}

/* sRGB (IEC 61966-2-1), and for readers that do not know the name the gamma and the chromaticities
 * that PNG lists for it. Layers that are data say nothing. */
static void put_colour(struct out *out)
{
    static const uint32_t chromaticities[8] = {
        31270, 32900, 64000, 33000, 30000, 60000, 15000, 6000};
    uint8_t numbers[32];
    size_t chunk = chunk_begin(out, "gAMA");
    put_u32(numbers, 45455);
    out_bytes(out, numbers, 4);
    chunk_end(out, chunk);
    chunk = chunk_begin(out, "cHRM");
    for (int i = 0; i < 8; i++)
        put_u32(numbers + 4 * i, chromaticities[i]);
    out_bytes(out, numbers, sizeof numbers);
    chunk_end(out, chunk);
    chunk = chunk_begin(out, "sRGB");
    out_bytes(out, "\0", 1); /* perceptual */
    chunk_end(out, chunk);
}

static bool put_pixels(struct out *out, const struct pen_frame *frame, uint32_t bit_depth)
{
    const struct pen_plane *plane = &frame->planes[0];
    uint32_t bpp = plane->channels * bit_depth / 8;
    size_t row_bytes = (size_t)frame->width * bpp;
    uint32_t rows_per_call = (uint32_t)(ROWS_BYTES / (row_bytes + 1));
    if (rows_per_call == 0)
        rows_per_call = 1;
    uint8_t *row = malloc(row_bytes);
    uint8_t *filtered = malloc((row_bytes + 1) * rows_per_call);
    struct isal_zstream *stream = malloc(sizeof *stream);
    uint8_t *level = calloc(1, ISAL_DEF_LVL1_DEFAULT);
    bool ok = row && filtered && stream && level;
    if (!ok)
        goto done;
    isal_deflate_init(stream);
    stream->level = 1;
    stream->level_buf = level;
    stream->level_buf_size = ISAL_DEF_LVL1_DEFAULT;
    stream->gzip_flag = IGZIP_ZLIB;
    for (uint32_t y = 0; ok && y < frame->height;) {
        uint32_t rows = 0;
        for (; rows < rows_per_call && y < frame->height; rows++, y++) {
            pixels_row(plane, frame->width, y, plane->channels,
                bit_depth == 16 ? PIXELS_U16 : PIXELS_U8, plane->channels, row);
            if (bit_depth == 16)
                swap_to_big_endian(row, row_bytes);
            filter_sub(filtered + rows * (row_bytes + 1), row, row_bytes, bpp);
        }
        stream->next_in = filtered;
        stream->avail_in = (uint32_t)(rows * (row_bytes + 1));
        stream->end_of_stream = y == frame->height;
        ok = deflate_some(stream, out);
    }
done:
    free(row);
    free(filtered);
    free(stream);
    free(level);
    return ok;
}

bool png_fast_encode(const struct pen_frame *frame, uint32_t bit_depth,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error)
{
    static const uint8_t colour_types[5] = {0, 0, 0, 2, 6};
    uint32_t channels = frame->planes[0].channels;
    struct out out = {0};
    /* Rendered images shrink to well under a third. */
    out_reserve(&out, (size_t)frame->width * frame->height * channels * bit_depth / 8 / 3 + 4096);
    out_bytes(&out, "\x89PNG\r\n\x1a\n", 8);
    uint8_t header[13] = {0};
    put_u32(header, frame->width);
    put_u32(header + 4, frame->height);
    header[8] = (uint8_t)bit_depth;
    header[9] = colour_types[channels];
    size_t chunk = chunk_begin(&out, "IHDR");
    out_bytes(&out, header, sizeof header);
    chunk_end(&out, chunk);
    if (!strcmp(frame->planes[0].name, pen_layers[PEN_LAYER_BEAUTY].name))
        put_colour(&out);
    for (uint32_t i = 0; i < attribute_count; i++)
        put_text(&out, attributes[i]);
    chunk = chunk_begin(&out, "IDAT");
    bool ok = put_pixels(&out, frame, bit_depth);
    chunk_end(&out, chunk);
    chunk_end(&out, chunk_begin(&out, "IEND"));
    if (!ok || out.failed) {
        free(out.data);
        return pen_fail(error, PEN_UNAVAILABLE, "", "The PNG could not be encoded: out of memory.");
    }
    *bytes = (struct pen_bytes){out.data, out.size};
    return true;
}
