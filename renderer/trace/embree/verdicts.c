#include "renderer/trace/embree/verdicts.h"
#include <stdlib.h>
#include <string.h>

/* Lit beside umbra: a contact, or a silhouette whose penumbra is thinner than a receiver. */
static bool is_edge(uint8_t a, uint8_t b)
{
    return (a == LIT && b == UMBRA) || (a == UMBRA && b == LIT);
}

/* In x and then in y. */
bool trace_verdicts_spread(
    const uint8_t *verdicts, uint32_t w, uint32_t h, uint32_t radius, uint8_t *full)
{
    uint8_t *rows = calloc((size_t)w * h, 1);
    if (!rows)
        return false;
    for (uint32_t pixel = 0; pixel < w * h; pixel++) {
        uint8_t own = verdicts[pixel], left = pixel % w ? verdicts[pixel - 1] : own;
        uint8_t above = pixel >= w ? verdicts[pixel - w] : own;
        if (own != MIXED && !is_edge(own, left) && !is_edge(own, above))
            continue;
        uint32_t x = pixel % w, low = x > radius ? x - radius : 0;
        uint32_t high = x + radius < w ? x + radius : w - 1;
        memset(rows + pixel - x + low, 1, high - low + 1);
    }
    for (uint32_t y = 0; y < h; y++) {
        uint32_t low = y > radius ? y - radius : 0, high = y + radius < h ? y + radius : h - 1;
        for (uint32_t from = low; from <= high; from++)
            for (uint32_t x = 0; x < w; x++)
                full[(size_t)y * w + x] |= rows[(size_t)from * w + x];
    }
    free(rows);
    return true;
}
