#include "tone_maps.def"

// From scene radiance to display values. sRGB (IEC 61966-2-1) by a least-squares sum of roots
// instead of a power: error below 6e-5, a quarter of a 14-bit step.
vec3 srgb_encode(vec3 c)
{
    c = clamp(c, 0.0, 1.0);
    vec3 r2 = sqrt(c), r4 = sqrt(r2), r8 = sqrt(r4);
    vec3 curve = 0.64800620 * r2 + 0.70277689 * r4 - 0.33038199 * r8 - 0.01919822 * c - 0.00124568;
    return mix(min(curve, 1.0), 12.92 * c, lessThanEqual(c, vec3(0.0031308)));
}

// Back: a polynomial through the curve at Chebyshev nodes, error below 4e-5.
vec3 srgb_decode(vec3 c)
{
    vec3 low = 0.00105850 + c * (0.02904625 + c * 0.54574016);
    vec3 high = 0.59446851 + c * (-0.22331859 + c * 0.05301672);
    return mix(low + c * c * c * high, c * (1.0 / 12.92), lessThanEqual(c, vec3(0.04045)));
}

// view.display.y: enum pen_tone_map.
vec3 display_encode(vec3 radiance)
{
    vec3 c = max(radiance * view.display.x, 0.0);
    float luminance = dot(c, vec3(0.2126, 0.7152, 0.0722));
    return srgb_encode(tone_curve(int(view.display.y), c, luminance));
}
