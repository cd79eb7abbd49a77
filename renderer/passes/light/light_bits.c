#include "renderer/passes/light/light_bits.h"
#include "protocol/memory.h"
#include "renderer/light/light.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint32_t reversed(uint32_t value, uint32_t bits)
{
    uint32_t out = 0;
    for (uint32_t i = 0; i < bits; i++)
        out |= (value >> i & 1) << (bits - 1 - i);
    return out;
}

/* Equal areas of the square go to equal areas of the disk. */
static void to_disk(float p[2])
{
    float x = p[0], y = p[1];
    if (x == 0 && y == 0)
        return;
    bool wide = fabsf(x) > fabsf(y);
    float radius = wide ? x : y;
    float angle = (float)M_PI_4 * (wide ? y / x : 2 - x / y);
    p[0] = radius * cosf(angle);
    p[1] = radius * sinf(angle);
}

static void make_point(
    const struct light_bits *bits, uint32_t pattern, uint32_t index, float point[2])
{
    uint32_t n = bits->count, log2n = n == 64 ? 6 : 8, side = n == 64 ? 8 : 16;
    if (bits->jittered) {
        /* Flipping digits keeps the net: one point per row, per column and per cell. */
        uint32_t sx = pattern * 0x9e3779b9u >> 16, sy = pattern * 0x85ebca6bu >> 16;
        uint32_t x = (index ^ sx) & (n - 1), y = (reversed(index, log2n) ^ sy) & (n - 1);
        point[0] = (2 * (float)x + 1) / (float)n - 1;
        point[1] = (2 * (float)y + 1) / (float)n - 1;
    } else {
        point[0] = (2 * (float)(index % side) + 1) / (float)side - 1;
        point[1] = (2 * (float)(index / side) + 1) / (float)side - 1;
    }
    if (bits->shape == SHAPE_DISK)
        to_disk(point);
}

/* Row `row` of the table: words[step][word]. */
static void fill_row(const struct light_bits *bits, const float *points, uint32_t row,
    uint32_t *table, uint32_t words)
{
    uint32_t axis = row & 1, stored = words > 4 ? 4 : words;
    for (uint32_t i = 0; i < bits->count; i++) {
        float at = points[2 * (bits->count * (row >> 1) + i) + axis];
        /* The first step that lies beyond the point. */
        uint32_t first = (uint32_t)floorf((at * 0.5f + 0.5f) * LIGHT_BITS_STEPS) + 1;
        uint32_t word = i / 32, layer = word / stored;
        for (uint32_t step = first; step <= LIGHT_BITS_STEPS; step++) {
            size_t texel = ((size_t)layer * bits->below.height + row) * bits->below.width + step;
            table[texel * stored + word % stored] |= 1u << (i & 31);
        }
    }
}

void light_bits_fit(struct light_bits *bits, uint32_t count, uint32_t shape, bool jittered)
{
    if (bits->below.name && bits->count == count && bits->shape == shape &&
        bits->jittered == jittered)
        return;
    light_bits_finish(bits);
    bits->count = count, bits->shape = shape, bits->jittered = jittered;
    uint32_t patterns = jittered ? LIGHT_BITS_PATTERNS : 1, words = count / 32;
    uint32_t width = LIGHT_BITS_STEPS + 1, height = 2 * patterns;
    bits->below = gl_texture_create(
        words > 4 ? GL_RGBA32UI : GL_RG32UI, width, height, words > 4 ? words / 4 : 1, 1);
    bits->at = gl_texture_create(GL_RG32F, count, patterns, 0, 1);
    float *points = pen_alloc(2 * count * patterns, sizeof *points);
    uint32_t *table = pen_alloc_zero((size_t)width * height * words, sizeof *table);
    for (uint32_t i = 0; i < count * patterns; i++)
        make_point(bits, i / count, i % count, points + 2 * i);
    for (uint32_t row = 0; row < height; row++)
        fill_row(bits, points, row, table, words);
    gl.TextureSubImage3D(bits->below.name, 0, 0, 0, 0, (GLsizei)width, (GLsizei)height,
        (GLsizei)bits->below.layers, words > 4 ? GL_RGBA_INTEGER : GL_RG_INTEGER, GL_UNSIGNED_INT,
        table);
    gl.TextureSubImage2D(
        bits->at.name, 0, 0, 0, (GLsizei)count, (GLsizei)patterns, GL_RG, GL_FLOAT, points);
    free(points);
    free(table);
}

void light_bits_finish(struct light_bits *bits)
{
    gl_texture_destroy(&bits->below);
    gl_texture_destroy(&bits->at);
    memset(bits, 0, sizeof *bits);
}
