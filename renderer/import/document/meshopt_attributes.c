/* Mode 0 of KHR_meshopt_compression, "attributes", in both versions of its bitstream (Appendix A of
 * the extension): what libraries older than meshoptimizer 0.23 do not know. Elements come in blocks;
 * in a block, one byte of every element after the other, as differences in groups of 16. */
#include "renderer/import/document/meshopt.h"
#include <string.h>

#define GROUP 16
#define MOST_ELEMENTS 256 /* of a block */
#define BLOCK_BYTES 8192

struct stream {
    const uint8_t *at, *end; /* of the blocks */
};

/* One group whose differences have `bits` bits; those with all bits set follow as bytes. */
static bool read_group(struct stream *s, uint32_t bits, uint8_t deltas[GROUP])
{
    size_t packed = (size_t)bits * GROUP / 8;
    if ((size_t)(s->end - s->at) < packed)
        return false;
    const uint8_t *from = s->at;
    s->at += packed;
    if (bits == 8) {
        memcpy(deltas, from, GROUP);
        return true;
    }
    uint32_t sentinel = (1u << bits) - 1;
    for (uint32_t i = 0; i < GROUP; i++) {
        uint32_t bit = i * bits % 8; /* the first is the lowest of single bits, else the highest */
        uint32_t value = bits ? from[i * bits / 8] >> (bits == 1 ? bit : 8 - bits - bit) : 0;
        deltas[i] = (uint8_t)(value & sentinel);
        if (!bits || deltas[i] != sentinel)
            continue;
        if (s->at == s->end)
            return false;
        deltas[i] = *s->at++;
    }
    return true;
}

/* The differences of one byte of all elements of a block. `mode`: the control mode; -1: version 0. */
static bool read_bytes(struct stream *s, int mode, uint32_t elements, uint8_t deltas[MOST_ELEMENTS])
{
    static const uint8_t widths[3][4] = {{0, 2, 4, 8}, {0, 1, 2, 4}, {1, 2, 4, 8}};
    uint32_t groups = (elements + GROUP - 1) / GROUP;
    if (mode == 2) {
        memset(deltas, 0, elements);
        return true;
    }
    if (mode == 3) {
        if ((size_t)(s->end - s->at) < elements)
            return false;
        memcpy(deltas, s->at, elements);
        s->at += elements;
        return true;
    }
    const uint8_t *header = s->at;
    size_t header_bytes = (groups + 3) / 4;
    if ((size_t)(s->end - s->at) < header_bytes)
        return false;
    s->at += header_bytes;
    for (uint32_t g = 0; g < groups; g++)
        if (!read_group(s, widths[mode + 1][header[g / 4] >> g % 4 * 2 & 3], deltas + g * GROUP))
            return false;
    return true;
}

/* Little-endian numbers of `bytes` bytes. */
static uint32_t load(const uint8_t *p, uint32_t bytes)
{
    uint32_t x = 0;
    memcpy(&x, p, bytes);
    return x;
}

static uint32_t unzigzag(uint32_t v)
{
    return v & 1 ? ~(v >> 1) : v >> 1;
}

/* Adds the differences of one channel, four bytes of each element, to what stood before. */
static void undo(uint8_t channel, const uint8_t deltas[4][MOST_ELEMENTS], uint32_t elements,
    uint8_t *out, uint32_t stride, uint8_t before[4])
{
    uint32_t kind = channel & 15, turn = channel >> 4;
    uint32_t bytes = kind == 0 ? 1 : kind == 1 ? 2 : 4;
    for (uint32_t i = 0; i < elements; i++, out += stride)
        for (uint32_t b = 0; b < 4; b += bytes) {
            uint32_t delta = 0, last = load(before + b, bytes);
            for (uint32_t k = 0; k < bytes; k++)
                delta |= (uint32_t)deltas[b + k][i] << 8 * k;
            uint32_t value = kind == 2 ? last ^ (delta >> turn | delta << ((32 - turn) & 31))
                                       : last + unzigzag(delta);
            memcpy(before + b, &value, bytes);
            memcpy(out + b, &value, bytes);
        }
}

bool imp_meshopt_attributes(
    uint8_t *out, uint32_t count, uint32_t stride, const uint8_t *data, size_t bytes)
{
    uint8_t before[256], channels[64] = {0}, deltas[4][MOST_ELEMENTS];
    if (!stride || stride % 4 || stride > 256 || !bytes || (data[0] & 0xfe) != 0xa0)
        return false;
    bool newer = data[0] & 1;
    size_t tail = stride + (newer ? stride / 4 : 0), least = newer ? 24 : 32;
    size_t padded = tail < least ? least : tail;
    if (bytes < 1 + padded)
        return false;
    struct stream s = {data + 1, data + bytes - padded};
    memcpy(before, data + bytes - tail, stride);
    if (newer)
        memcpy(channels, data + bytes - stride / 4, stride / 4);
    for (uint32_t c = 0; c < stride / 4; c++)
        if ((channels[c] & 15) > 2 || ((channels[c] & 15) < 2 && channels[c] >> 4))
            return false;
    uint32_t most = BLOCK_BYTES / stride & ~15u;
    most = most < MOST_ELEMENTS ? most : MOST_ELEMENTS;
    for (uint32_t first = 0; first < count; first += most) {
        uint32_t elements = count - first < most ? count - first : most;
        const uint8_t *control = s.at;
        if (newer && (size_t)(s.end - s.at) < stride / 4)
            return false;
        s.at += newer ? stride / 4 : 0;
        for (uint32_t b = 0; b < stride; b++) {
            int mode = newer ? control[b / 4] >> b % 4 * 2 & 3 : -1;
            if (!read_bytes(&s, mode, elements, deltas[b % 4]))
                return false;
            if (b % 4 == 3)
                undo(channels[b / 4], (const uint8_t(*)[MOST_ELEMENTS])deltas, elements,
                    out + (size_t)first * stride + b - 3, stride, before + b - 3);
        }
    }
    return s.at == s.end;
}

/* ---- Appendix B, filter 4: colours as luma and two differences, in K bits ---- */

static uint32_t scaled(int32_t value, uint32_t most, uint32_t full)
{
    float x = (float)value * ((float)full / (float)most) + 0.5f;
    return x <= 0 ? 0 : x >= (float)full ? full : (uint32_t)x;
}

static int32_t widen(uint32_t value, uint32_t bytes)
{
    return bytes == 1 ? (int8_t)value : (int16_t)value;
}

void imp_meshopt_colors(uint8_t *data, uint32_t count, uint32_t stride)
{
    uint32_t bytes = stride / 4, full = bytes == 1 ? 255 : 65535;
    for (uint32_t i = 0; i < count; i++, data += stride) {
        int32_t y = (int32_t)load(data, bytes), co = widen(load(data + bytes, bytes), bytes);
        int32_t cg = widen(load(data + 2 * bytes, bytes), bytes);
        uint32_t a = load(data + 3 * bytes, bytes), most = 1;
        while (most < a)
            most = most << 1 | 1;
        a &= most >> 1;
        const int32_t rgba[4] = {y + co - cg, y + cg, y - co - cg, (int32_t)(a << 1 | (a & 1))};
        for (int c = 0; c < 4; c++) {
            uint32_t value = scaled(rgba[c], most, full);
            memcpy(data + (uint32_t)c * bytes, &value, bytes);
        }
    }
}
