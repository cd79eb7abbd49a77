// Coloured visibility and the width of its penumbra in pixels, in the four components of a 32-bit
// target: V is at most 1, so the width rides on top of it in even whole numbers.
vec4 interleave_colour(vec4 visibility, float width)
{
    return vec4(visibility.rgb, visibility.a + 2.0 * floor(clamp(width, 0.0, 1000.0)));
}

vec4 interleave_split(vec4 v, out float width)
{
    width = floor(0.5 * v.a);
    return vec4(v.rgb, v.a - 2.0 * width);
}
