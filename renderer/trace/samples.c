/* Owen-scrambled Sobol points, the first two dimensions. Sobol 1967; nested scrambling by hashing
 * after Laine & Karras 2011. */
#include "renderer/trace/points.h"
#include <stdlib.h>
#include <string.h>

static uint32_t reverse_bits(uint32_t x)
{
    x = (x >> 16) | (x << 16);
    x = ((x & 0x00ff00ffu) << 8) | ((x >> 8) & 0x00ff00ffu);
    x = ((x & 0x0f0f0f0fu) << 4) | ((x >> 4) & 0x0f0f0f0fu);
    x = ((x & 0x33333333u) << 2) | ((x >> 2) & 0x33333333u);
    return ((x & 0x55555555u) << 1) | ((x >> 1) & 0x55555555u);
}

/* Each bit is flipped by a function of the bits above it, hence elementary intervals stay whole. */
static uint32_t scramble(uint32_t x, uint32_t seed)
{
    x = reverse_bits(x);
    x += seed;
    x ^= x * 0x6c50b47cu;
    x ^= x * 0xb82f1e52u;
    x ^= x * 0xc7afe638u;
    x ^= x * 0x8d22f6e6u;
    return reverse_bits(x);
}

static uint32_t sobol_second(uint32_t index)
{
    uint32_t x = 0;
    for (uint32_t direction = 1u << 31; index; index >>= 1, direction ^= direction >> 1)
        if (index & 1)
            x ^= direction;
    return x;
}

void trace_sample_at(uint32_t index, uint32_t seed, uint32_t *x, uint32_t *y)
{
    *x = scramble(reverse_bits(index), trace_hash(seed));
    *y = scramble(sobol_second(index), trace_hash(seed ^ 0x9e3779b9u));
}

struct point {
    uint64_t key;
    uint32_t x, y;
};

static int compare_points(const void *a, const void *b)
{
    const struct point *p = a, *q = b;
    return p->key < q->key ? -1 : p->key > q->key;
}

bool trace_samples_net(uint32_t first, uint32_t count, uint32_t seed, uint32_t *xs, uint32_t *ys)
{
    struct point *points = malloc(count * sizeof *points);
    if (!points)
        return false;
    uint32_t bits = 0; /* of the cell number: log2(count) - 1, x gets the odd one */
    while ((2u << bits) < count)
        bits++;
    uint32_t x_bits = (bits + 1) / 2, y_bits = bits / 2;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t x, y;
        trace_sample_at(first + i, seed, &x, &y);
        uint64_t cell_x = (uint64_t)x >> (32 - x_bits), cell_y = (uint64_t)y >> (32 - y_bits);
        if (cell_x & 1) /* serpentine, so that consecutive cells touch */
            cell_y = ((uint64_t)1 << y_bits) - 1 - cell_y;
        /* x below the cell number makes the order unique: no two points of a net share it. */
        points[i] = (struct point){(cell_x << y_bits | cell_y) << 32 | x, x, y};
    }
    qsort(points, count, sizeof *points, compare_points);
    for (uint32_t i = 0; i < count; i++) {
        xs[i] = points[i].x;
        ys[i] = points[i].y;
    }
    free(points);
    return true;
}
