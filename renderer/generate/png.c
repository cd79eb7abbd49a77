/* The smallest PNG writer that is still a PNG: stored deflate blocks (RFC 1950, 1951; PNG 1.2). */
#include "protocol/memory.h"
#include "renderer/generate/model.h"
#include <pthread.h>
#include <stdlib.h>
#include <string.h>

static uint32_t crc_table[256];

static void make_crc_table(void)
{
    for (uint32_t i = 0; i < 256; i++) {
        uint32_t c = i;
        for (int k = 0; k < 8; k++)
            c = c & 1 ? 0xedb88320u ^ c >> 1 : c >> 1;
        crc_table[i] = c;
    }
}

static uint32_t crc32_of(const uint8_t *bytes, uint64_t count)
{
    static pthread_once_t once = PTHREAD_ONCE_INIT;
    pthread_once(&once, make_crc_table);
    uint32_t crc = ~0u;
    for (uint64_t i = 0; i < count; i++)
        crc = crc_table[(crc ^ bytes[i]) & 255] ^ crc >> 8;
    return ~crc;
}

static void put32(uint8_t *at, uint32_t x)
{
    at[0] = (uint8_t)(x >> 24);
    at[1] = (uint8_t)(x >> 16);
    at[2] = (uint8_t)(x >> 8);
    at[3] = (uint8_t)x;
}

/* Length, type, (data already in place), checksum; returns what follows. */
static uint8_t *chunk(uint8_t *at, const char type[4], uint32_t bytes)
{
    put32(at, bytes);
    memcpy(at + 4, type, 4);
    put32(at + 8 + bytes, crc32_of(at + 4, bytes + 4ull));
    return at + 12 + bytes;
}

uint8_t *png_write(const uint8_t *rgba, uint32_t width, uint32_t height, uint64_t *bytes)
{
    bool opaque = true;
    for (uint64_t i = 0; i < (uint64_t)width * height; i++)
        opaque &= rgba[4 * i + 3] == 255;
    uint32_t channels = opaque ? 3 : 4;
    uint64_t row = 1 + (uint64_t)width * channels, raw = row * height;
    uint64_t blocks = (raw + 65534) / 65535, packed = 2 + raw + 5 * blocks + 4;
    *bytes = 8 + 25 + 12 + packed + 12;
    uint8_t *file = pen_alloc(*bytes, 1), *scan = pen_alloc(raw, 1), *at = scan;
    for (uint32_t y = 0; y < height; y++) {
        *at++ = 0; /* no filter */
        for (uint32_t x = 0; x < width; x++, at += channels)
            memcpy(at, rgba + 4 * ((uint64_t)y * width + x), channels);
    }

    at = file;
    memcpy(at, "\x89PNG\r\n\x1a\n", 8);
    at += 8;
    put32(at + 8, width);
    put32(at + 12, height);
    memcpy(at + 16, (uint8_t[]){8, opaque ? 2 : 6, 0, 0, 0}, 5);
    at = chunk(at, "IHDR", 13);
    uint8_t *z = at + 8;
    *z++ = 0x78;
    *z++ = 0x01;
    uint32_t a = 1, b = 0; /* Adler-32 */
    for (uint64_t from = 0; from < raw; from += 65535) {
        uint32_t n = (uint32_t)(raw - from < 65535 ? raw - from : 65535);
        const uint8_t head[5] = {
            from + n == raw, (uint8_t)n, (uint8_t)(n >> 8), (uint8_t)~n, (uint8_t)(~n >> 8)};
        memcpy(z, head, 5);
        memcpy(z + 5, scan + from, n);
        z += 5 + n;
        for (uint32_t i = 0; i < n; i++) {
            a = (a + scan[from + i]) % 65521;
            b = (b + a) % 65521;
        }
    }
    put32(z, b << 16 | a);
    at = chunk(at, "IDAT", (uint32_t)packed);
    chunk(at, "IEND", 0);
    free(scan);
    return file;
}
