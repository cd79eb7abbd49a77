#include "protocol/memory.h"
#include "renderer/blob/geometry.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

static uint64_t mix(uint64_t x)
{
    x ^= x >> 32;
    x *= 0xd6e8feb86659fd93u;
    x ^= x >> 32;
    x *= 0xd6e8feb86659fd93u;
    return x ^ x >> 32;
}

static void position_bits(const float p[3], uint32_t bits[3])
{
    for (int k = 0; k < 3; k++) {
        float x = p[k] + 0.0f; /* -0 becomes 0 */
        memcpy(&bits[k], &x, 4);
    }
}

static uint64_t position_hash(const float p[3])
{
    uint32_t b[3];
    position_bits(p, b);
    return mix(mix(b[0] | (uint64_t)b[1] << 32) + b[2]);
}

static bool same_position(const float a[3], const float b[3])
{
    return a[0] == b[0] && a[1] == b[1] && a[2] == b[2];
}

/* Power of two with room for `count` at half load. */
static size_t table_size(size_t count)
{
    size_t size = 16;
    while (size < 2 * count)
        size *= 2;
    return size;
}

/* first[v]: the lowest vertex at the same position. */
static void weld(
    const float (*positions)[3], uint32_t vertex_count, const uint64_t *hashes, uint32_t *first)
{
    size_t size = table_size(vertex_count);
    uint32_t *table = pen_alloc(size, sizeof *table);
    memset(table, 0xff, size * sizeof *table);
    for (uint32_t v = 0; v < vertex_count; v++) {
        size_t at = hashes[v] & (size - 1);
        while (table[at] != UINT32_MAX && !same_position(positions[table[at]], positions[v]))
            at = (at + 1) & (size - 1);
        if (table[at] == UINT32_MAX)
            table[at] = v;
        first[v] = table[at];
    }
    free(table);
}

/* Every directed edge once, and its opposite once. */
static bool edges_match(const uint32_t *first, const uint32_t *indices, uint32_t index_count)
{
    size_t size = table_size(index_count);
    uint64_t *table = pen_alloc(size, sizeof *table);
    memset(table, 0xff, size * sizeof *table);
    bool match = true;
    for (int pass = 0; pass < 2 && match; pass++) /* insert all, then look up the opposites */
        for (uint32_t i = 0; i < index_count && match; i += 3) {
            uint32_t v[3] = {first[indices[i]], first[indices[i + 1]], first[indices[i + 2]]};
            if (v[0] == v[1] || v[1] == v[2] || v[2] == v[0])
                continue;
            for (int c = 0; c < 3 && match; c++) {
                uint64_t a = v[pass ? (c + 1) % 3 : c], b = v[pass ? c : (c + 1) % 3];
                uint64_t key = a << 32 | b;
                size_t at = mix(key) & (size - 1);
                while (table[at] != UINT64_MAX && table[at] != key)
                    at = (at + 1) & (size - 1);
                match = (table[at] == key) == pass;
                table[at] = key;
            }
        }
    free(table);
    return match;
}

static uint32_t root_of(uint32_t *parent, uint32_t v)
{
    while (parent[v] != v)
        v = parent[v] = parent[parent[v]];
    return v;
}

/* Whether no connected part of a closed surface has a negative volume (the sum of the tetrahedra
 * under its triangles). A little below zero, for flat parts, is rounding. */
static bool faces_outwards(const float (*positions)[3], uint32_t vertex_count,
    const uint32_t *first, const uint32_t *indices, uint32_t index_count)
{
    uint32_t *parent = pen_alloc(vertex_count, sizeof *parent);
    double(*volume)[2] = pen_alloc_zero(vertex_count, sizeof *volume); /* signed, of amounts */
    for (uint32_t v = 0; v < vertex_count; v++)
        parent[v] = v;
    for (uint32_t i = 0; i < index_count; i += 3)
        for (int c = 1; c < 3; c++) {
            uint32_t a = root_of(parent, first[indices[i]]);
            parent[root_of(parent, first[indices[i + (uint32_t)c]])] = a;
        }
    for (uint32_t i = 0; i < index_count; i += 3) {
        uint32_t root = root_of(parent, first[indices[i]]);
        double p[3][3];
        for (int k = 0; k < 3; k++) /* from a point of the part, so that distance costs nothing */
            for (int c = 0; c < 3; c++)
                p[k][c] =
                    (double)positions[indices[i + (uint32_t)k]][c] - (double)positions[root][c];
        double amount = 0, signed_amount = 0;
        for (int c = 0; c < 3; c++) {
            int d = (c + 1) % 3, e = (c + 2) % 3;
            double minor = p[1][d] * p[2][e] - p[1][e] * p[2][d];
            signed_amount += p[0][c] * minor;
            amount += fabs(p[0][c] * minor);
        }
        volume[root][0] += signed_amount;
        volume[root][1] += amount;
    }
    bool outward = true;
    for (uint32_t v = 0; v < vertex_count; v++)
        outward = outward && volume[v][0] >= -1e-9 * volume[v][1];
    free(parent);
    free(volume);
    return outward;
}

uint32_t psc_surface_flags(const float (*positions)[3], uint32_t vertex_count,
    const uint32_t *indices, uint32_t index_count)
{
    if (!index_count)
        return 0;
    uint64_t *hashes = pen_alloc(vertex_count, sizeof *hashes);
    for (uint32_t v = 0; v < vertex_count; v++)
        hashes[v] = position_hash(positions[v]);

    /* Opposite edges cancel in this sum, so a remainder proves an open edge: most meshes that are
     * not watertight are known as such without a table. */
    uint64_t sum = 0;
    bool any = false;
    for (uint32_t i = 0; i < index_count; i += 3) {
        uint64_t h[3] = {hashes[indices[i]], hashes[indices[i + 1]], hashes[indices[i + 2]]};
        if (h[0] == h[1] || h[1] == h[2] || h[2] == h[0])
            continue;
        any = true;
        for (int c = 0; c < 3; c++)
            sum += mix(h[c] + 3 * h[(c + 1) % 3]) - mix(h[(c + 1) % 3] + 3 * h[c]);
    }
    bool watertight = any && sum == 0, outward = false;
    if (watertight) {
        uint32_t *first = pen_alloc(vertex_count, sizeof *first);
        weld(positions, vertex_count, hashes, first);
        watertight = edges_match(first, indices, index_count);
        outward =
            watertight && faces_outwards(positions, vertex_count, first, indices, index_count);
        free(first);
    }
    free(hashes);
    return (watertight ? PSC_WATERTIGHT : 0u) | (outward ? PSC_OUTWARD : 0u);
}
