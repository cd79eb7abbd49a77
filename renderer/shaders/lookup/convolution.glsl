// Filtered depth tests from the series of passes/map/convolution.h.
#include "receiver.glsl"
#include "window.glsl"

#ifdef TABLES
#define SERIES_SAMPLER usampler2DArray
#else
#define SERIES_SAMPLER sampler2DArray
#endif
#include "convolution.def"
layout(binding = UNIT_BASIS) uniform SERIES_SAMPLER basis;
layout(binding = UNIT_BASIS_WEIGHTED) uniform SERIES_SAMPLER basis_weighted;

#define LAYERS (int(P(terms) + 1u) / 2)

vec2 turned(vec2 a, vec2 b) // product of complex numbers
{
    return vec2(a.x * b.x - a.y * b.y, a.x * b.y + a.y * b.x);
}

#ifdef TABLES
// A box of whole and cut texels [low, high]: sums to fractional corners are bilinear in those to
// whole ones, and are taken relative to one corner while they are integers (see sat.glsl).
struct Kernel {
    ivec4 xs, ys;
    vec4 wx, wy;
};

Kernel kernel_of(vec2 low, vec2 high, vec2 map_size)
{
    vec2 center = clamp(0.5 * (low + high), vec2(0.5), map_size - 0.5);
    vec2 reach = max(0.5 * (high - low), vec2(0.5));
    low = clamp(center - reach, vec2(0.0), map_size - 1.0);
    high = clamp(center + reach, low + 1.0, map_size);
    ivec2 last = ivec2(map_size), a = ivec2(low), b = ivec2(high);
    vec2 fa = low - vec2(a), fb = high - vec2(b), size = high - low;
    Kernel k;
    k.xs = ivec4(a.x, min(a.x + 1, last.x), b.x, min(b.x + 1, last.x));
    k.ys = ivec4(a.y, min(a.y + 1, last.y), b.y, min(b.y + 1, last.y));
    k.wx = vec4(fa.x - 1.0, -fa.x, 1.0 - fb.x, fb.x) / size.x;
    k.wy = vec4(fa.y - 1.0, -fa.y, 1.0 - fb.y, fb.y) * series.table_scale / size.y;
    return k;
}

vec4 kernel_mean(usampler2DArray table, int layer, Kernel k)
{
    uvec4 base[4];
    for (int i = 0; i < 4; i++)
        base[i] = texelFetch(table, ivec3(k.xs[i], k.ys.x, layer), 0);
    vec4 sum = vec4(0.0);
    for (int j = 1; j < 4; j++) {
        uvec4 first = texelFetch(table, ivec3(k.xs.x, k.ys[j], layer), 0) - base[0];
        vec4 row = vec4(0.0);
        for (int i = 1; i < 4; i++)
            row += k.wx[i] *
                   vec4(texelFetch(table, ivec3(k.xs[i], k.ys[j], layer), 0) - base[i] - first);
        sum += k.wy[j] * row;
    }
    return sum;
}
#else
// One trilinear lookup. Its kernel has the variance of a box that is sqrt(3) of its texels wide,
// which picks the level.
struct Kernel {
    vec2 uv;
    float level;
};

Kernel kernel_of(vec2 low, vec2 high, vec2 map_size)
{
    vec2 size = high - low;
    return Kernel(0.5 * (low + high) / map_size, log2(max(0.57735 * max(size.x, size.y), 1.0)));
}

vec4 kernel_mean(sampler2DArray map, int layer, Kernel k)
{
    return textureLod(map, vec3(k.uv, float(layer)), k.level);
}
#endif

// Means over the kernel of one lookup: x of 1 - f, the blocked share; when `weighted`, a constant,
// y of (1 - f) z. `depth` is the receiver's, scaled and offset.
vec2 series_lookup(float depth, Kernel kernel, bool weighted)
{
    float angle = 3.14159265 * depth;
    vec2 phase = vec2(cos(angle), sin(angle)), turn = turned(phase, phase);
    vec2 sum = vec2(0.5, 0.0);
    if (weighted)
        sum.y = 0.5 * kernel_mean(basis_weighted, LAYERS, kernel).r;
    for (int i = 0; i < LAYERS; i++) {
        vec2 next = turned(phase, turn);
        vec4 weight = series.weight[i >> 1];
        vec2 w = (i & 1) == 0 ? weight.xy : weight.zw;
        vec4 phases = vec4(phase.x, -phase.y, next.x, -next.y) * w.xxyy;
        sum.x -= dot(phases, 2.0 * kernel_mean(basis, i, kernel) - 1.0);
        if (weighted)
            sum.y -= dot(phases, 2.0 * kernel_mean(basis_weighted, i, kernel) - 1.0);
        phase = turned(next, turn);
    }
    return sum;
}

// f for a caster x of scaled depth behind the receiver.
float series_step(float x)
{
    float angle = 3.14159265 * x, sum = 0.5;
    vec2 phase = vec2(cos(angle), sin(angle)), turn = turned(phase, phase);
    for (int i = 0; i < LAYERS; i++) {
        vec4 weight = series.weight[i >> 1];
        vec2 w = (i & 1) == 0 ? weight.xy : weight.zw;
        vec2 next = turned(phase, turn);
        sum += w.x * phase.y + w.y * next.y;
        phase = turned(next, turn);
    }
    return sum;
}

Receiver series_receiver(Surface s)
{
#ifdef TABLES
    return receiver_of(s, vec2(textureSize(basis, 0).xy - 1));
#else
    return receiver_of(s, vec2(textureSize(basis, 0).xy));
#endif
}

// What is proven of the window q +- extent. Blocked only where the series says so too, past its
// step, twice the offset before the receiver: else proven pixels stand out as spots.
int receiver_window(Receiver r, vec2 extent)
{
    float margin = 2.0 * series.offset / series.range * (light.far_z - light.near_z);
    return window_class(r.q, extent, r.plane, r.bias, margin, r.map_size);
}

// The receiver's scaled depth for a cell of the window: that of its plane, a little towards the
// cell's near corner, so that a tilted receiver blocks itself less. The whole way would hide more
// near blockers than it saves: errors on the bunny and the demo are least at about a quarter.
float cell_depth(Receiver r, vec2 offset, vec2 extent)
{
    float d =
        r.plane.depth + dot(r.plane.gradient, offset) - 0.25 * dot(abs(r.plane.gradient), extent);
    float z = light_linear(clamp(d - r.bias, 0.0, 1.0));
    return (z - light.near_z) / (light.far_z - light.near_z) * series.range;
}

// One lookup over the cell q + offset +- extent, and the share of the cell that the map covers;
// outside the map nothing blocks.
vec3 cell_lookup(Receiver r, vec2 offset, vec2 extent, bool weighted, out float depth)
{
    vec2 at = (r.q + offset - light.rect.xy) / r.metres, reach = extent / r.metres;
    vec2 low = clamp(at - reach, vec2(0.0), r.map_size),
         high = clamp(at + reach, vec2(0.0), r.map_size);
    vec2 cover = reach.x > 0.0 && reach.y > 0.0 ? (high - low) / (2.0 * reach) : vec2(1.0);
    depth = cell_depth(r, offset, extent);
#ifndef TABLES
    // A kernel with mips keeps its width at the border of the map.
    vec2 center = 0.5 * (low + high);
    low = center - reach;
    high = center + reach;
#endif
    Kernel kernel = kernel_of(low, high, r.map_size);
    return vec3(series_lookup(depth - series.offset, kernel, weighted), cover.x * cover.y);
}

// How a window of the light's shape is cut into about taps^2 cells that are nearly square.
ivec2 window_cells(int taps)
{
    float aspect = light.extent.y > 0.0 ? sqrt(light.extent.x / light.extent.y) : 1.0;
    int across = max(min(int(float(taps) * aspect + 0.5), taps * taps), 1);
    return ivec2(across, (taps * taps) / across);
}

// Centre of cell i in [-1, 1]^2, and the cell's half extents: a grid, or its image on the disk
// (Shirley and Chiu 1997), where all cells have the same area.
vec2 cell_center(int i, ivec2 cells, out vec2 half_cell)
{
    vec2 u = (vec2(i % cells.x, i / cells.x) + 0.5) * 2.0 / vec2(cells) - 1.0;
    half_cell = 1.0 / vec2(cells);
    if (light.shape != SHAPE_DISK)
        return u;
    half_cell *= 0.886;
    bool wide = abs(u.x) > abs(u.y);
    float radius = wide ? u.x : u.y;
    float other = wide ? u.y : u.x;
    float angle = radius == 0.0 ? 0.0 : 0.78539816 * other / radius;
    return radius * (wide ? vec2(cos(angle), sin(angle)) : vec2(sin(angle), cos(angle)));
}

// Visible share behind one lookup: f rescaled so that the ripple reaches 0 and 1. With CONTACT
// also so that a cell full of its nearest caster reaches 0, even when that caster is so near to the
// receiver that it lies on the step: two planes are then told apart at most distances. Nearer still
// the step is kept, or receivers that shadow themselves come out in specks.
float cell_visibility(Receiver r, float f, float depth, vec2 offset, vec2 extent)
{
#ifdef RAW
    return f;
#else
    float low = series.low, high = series.low + 1.0 / series.scale;
#ifdef CONTACT
    float nearest = min(min_max_window(r.q + offset, extent).x, light.far_z);
    float z = (nearest - light.near_z) / (light.far_z - light.near_z) * series.range;
    float x = z - depth + series.offset;
    if (x > -series.offset)
        low = max(low, min(series_step(x), high - 0.5));
#endif
    return clamp((f - low) / (high - low), 0.0, 1.0);
#endif
}

// Visible share of the light through the window q + offset +- extent.
float window_visibility(Receiver r, vec2 offset, vec2 extent, int taps)
{
    ivec2 cells = window_cells(taps);
    int count = cells.x * cells.y;
    float sum = 0.0;
    for (int i = 0; i < count; i++) {
        vec2 half_cell;
        vec2 center = cell_center(i, cells, half_cell);
        float depth;
        vec3 blocked = cell_lookup(r, offset + center * extent, half_cell * extent, false, depth);
        float v = cell_visibility(
            r, 1.0 - blocked.x, depth, offset + center * extent, half_cell * extent);
        sum += (1.0 - v) * blocked.z;
    }
    return clamp(1.0 - sum / max(float(count), 1.0), 0.0, 1.0);
}

// Depth, m, behind which blockers in a window of the receiver are not told from the receiver: half
// the step of the series before the near corner of a cell.
float hidden_depth(Receiver r, vec2 extent, int taps)
{
    float depth = cell_depth(r, vec2(0.0), extent / vec2(window_cells(taps))) - series.offset;
    return light.near_z + depth / series.range * (light.far_z - light.near_z);
}

// Mean depth of the blockers in the window q +- extent, m (Annen et al. 2008): the same series with
// 1 - f for f, times z. The offset keeps lit texels from counting as half a blocker each; what is
// left of them, `low`, is taken off. 0 where there are none.
float window_blockers(Receiver r, vec2 extent, int taps)
{
    ivec2 cells = window_cells(taps);
    int count = cells.x * cells.y;
    vec2 sum = vec2(0.0);
    for (int i = 0; i < count; i++) {
        vec2 half_cell;
        vec2 center = cell_center(i, cells, half_cell);
        float depth;
        vec3 blocked = cell_lookup(r, center * extent, half_cell * extent, true, depth);
        if (blocked.x > series.low)
            sum += (blocked.xy - series.low * vec2(1.0, depth)) * blocked.z;
    }
    if (sum.x <= 1e-4 * float(count))
        return 0.0;
    return light.near_z + sum.y / (sum.x * series.range) * (light.far_z - light.near_z);
}

// The depth that sizes the filter, m. Where a search sees nothing, though the pyramid could not
// prove the window lit, only blockers behind hidden_depth are left, and these cannot cast through
// more than the window of that depth (F3): it is searched next, in smaller cells.
float blocker_depth(Receiver r, vec2 extent, int taps, float nearest_z, float receiver_z)
{
    float z = 0.0, hidden = receiver_z;
    for (int round = 0; round < 3 && taps > 0 && z == 0.0; round++) {
        z = window_blockers(r, extent, taps);
        hidden = min(hidden_depth(r, extent, taps), receiver_z);
        extent = min(extent, light_filter_extent(hidden, receiver_z));
        extent = max(extent, r.metres);
    }
    return clamp(z == 0.0 ? hidden : z, min(nearest_z, receiver_z), receiver_z);
}
