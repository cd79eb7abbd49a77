// What screen-space filters carry per pixel: light that arrives over light that would arrive
// without casters, as sums that are divided after filtering (the ratio estimator of Heitz et al.
// 2018), so that filtering neither needs nor changes the light's own colour. Targets start as a lit
// pixel: 1 and 1.
//   plain light:       ratio_lit.r arrived, ratio_lit.g of
//   TEXTURED:          ratio_lit rgb and a (mean) arrived, ratio_all rgb and a of
//   FROM_HARD:         the hard visibility of penumbra_estimate.glsl
#include "filter.def"
#include "light.glsl"
#ifdef LAST
#include "pixel_horizon.glsl"
#endif
layout(binding = UNIT_SPREAD) uniform sampler2D spread_map; // see penumbra_estimate.glsl
#ifndef FROM_HARD
layout(binding = UNIT_RATIO_LIT) uniform sampler2D ratio_lit;
#ifdef TEXTURED
layout(binding = UNIT_RATIO_ALL) uniform sampler2D ratio_all;
#endif
#endif

bool spread_is_lit(vec4 spread)
{
    return spread.x == 1.0 && spread.w == 0.0;
}

#ifdef TEXTURED
#define RATIO mat2x4
#else
#define RATIO vec2
#endif

RATIO ratio_at(ivec2 pixel)
{
#if defined(FROM_HARD)
    // Receivers that no light can reach count for nothing.
    vec2 e = texelFetch(spread_map, pixel, 0).xw;
    return e == vec2(0.0) ? vec2(0.0) : vec2(e.x, 1.0);
#elif defined(TEXTURED)
    return mat2x4(texelFetch(ratio_lit, pixel, 0), texelFetch(ratio_all, pixel, 0));
#else
    return texelFetch(ratio_lit, pixel, 0).rg;
#endif
}

bool ratio_is_mixed(RATIO r)
{
#ifdef TEXTURED
    return r[0].a > 0.0 && r[0].a < r[1].a;
#else
    return r.x > 0.0 && r.x < r.y;
#endif
}

#ifdef LAST
layout(location = 0) out vec4 vis;
#elif defined(TEXTURED)
layout(location = 0) out vec4 out_lit;
layout(location = 1) out vec4 out_all;
#else
layout(location = 0) out vec2 out_lit;
#endif

#ifdef LAST
// Of the light above the horizon. Seen from a light in all directions the faces of its map have a
// horizon each, and its share is that of the samples.
float ratio_fade(ivec2 pixel, float share)
{
    return light.cube != 0 ? horizon_fade(share) : pixel_horizon_fade(pixel);
}
#endif

void ratio_write(ivec2 pixel, RATIO r)
{
#if defined(LAST) && defined(TEXTURED)
    float mean = clamp(r[0].a / max(r[1].a, 1e-6), 0.0, 1.0);
    // A colour that none of the samples emits has no ratio of its own.
    vec3 share = mix(
        vec3(mean), clamp(r[0].rgb / max(r[1].rgb, 1e-6), 0.0, 1.0), step(1e-3 * r[1].a, r[1].rgb));
    vis = ratio_fade(pixel, r[1].a) * vec4(light.emission_mean.rgb * share, mean);
#elif defined(LAST)
    float mean = clamp(r.x / max(r.y, 1e-6), 0.0, 1.0);
    vis = scalar_visibility(ratio_fade(pixel, r.y) * mean);
#elif defined(TEXTURED)
    out_lit = r[0];
    out_all = r[1];
#else
    out_lit = r;
#endif
}
