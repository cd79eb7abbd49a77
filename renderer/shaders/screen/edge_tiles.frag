// One fragment per tile of 4 x 4 pixels: which of them may show more than the plane at their
// centre? LAYERED: or more than the plane of the blended surface in front.
#include "view.glsl"
#include "tile_class.def"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
#ifdef LAYERED
layout(binding = UNIT_BEFORE) uniform sampler2D front_depth; // of the first blended layer
#endif

// Class / 255; nothing; a bit for each pixel, row by row.
layout(location = 0) out vec4 tile_class;

// Depths of four pixels in a row, and of those beside them.
struct Row {
    float left;
    vec4 own;
    float right;
};

// Of four depths in a square, in textureGather's order, three times.
Row upper_row(vec4 a, vec4 b, vec4 c)
{
    return Row(a.w, vec4(a.z, b.w, b.z, c.w), c.z);
}

Row lower_row(vec4 a, vec4 b, vec4 c)
{
    return Row(a.x, vec4(a.y, b.x, b.y, c.x), c.y);
}

// Of four pixels, and of those beside them: along a plane a depth is the mean of those on either
// side.
bvec4 are_bent(vec4 left, vec4 right, vec4 above, vec4 below, vec4 depth)
{
    vec4 bend = max(abs(left + right - 2.0 * depth), abs(above + below - 2.0 * depth));
    vec4 rise = abs(left - right) + abs(above - below) + 1e-2 * depth;
    return greaterThan(bend, 0.03 * rise);
}

int bits_of_row(Row above, Row row, Row below)
{
    bvec4 bent = are_bent(
        vec4(row.left, row.own.xyz), vec4(row.own.yzw, row.right), above.own, below.own, row.own);
    return int(dot(vec4(bent), vec4(1.0, 2.0, 4.0, 8.0)));
}

// A bit for each pixel.
int bent_pixels(ivec2 first, bool front)
{
    vec4 d[9];
    for (int i = 0; i < 9; i++) {
        vec2 corner = vec2(first + 2 * ivec2(i % 3, i / 3)) * view.viewport.zw;
        d[i] = textureGather(g_depth, corner);
#ifdef LAYERED
        d[i] = front ? max(d[i], textureGather(front_depth, corner)) : d[i];
#endif
    }
    Row above = upper_row(d[0], d[1], d[2]), r0 = lower_row(d[0], d[1], d[2]),
        r1 = upper_row(d[3], d[4], d[5]), r2 = lower_row(d[3], d[4], d[5]),
        r3 = upper_row(d[6], d[7], d[8]), below = lower_row(d[6], d[7], d[8]);
    return bits_of_row(above, r0, r1) + (bits_of_row(r0, r1, r2) << 4) +
           (bits_of_row(r1, r2, r3) << 8) + (bits_of_row(r2, r3, below) << 12);
}

void main()
{
    ivec2 first = ivec2(gl_FragCoord.xy) * 4;
    int bent = bent_pixels(first, false);
#ifdef LAYERED
    bent |= bent_pixels(first, true);
#endif
    tile_class = vec4(float(bent != 0 ? TILE_UNDECIDED : TILE_LIT) / 255.0, 0.0, float(bent), 0.0);
}
