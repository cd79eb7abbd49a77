// The camera of the frame.
#include "view.def"

vec2 pixel_to_ndc(ivec2 pixel)
{
    vec2 uv = (vec2(pixel) + 0.5) * view.viewport.zw;
    return vec2(2.0 * uv.x - 1.0, 1.0 - 2.0 * uv.y);
}

vec3 unproject(mat4 matrix, vec2 ndc, float depth)
{
    vec4 p = matrix * vec4(ndc, depth, 1.0);
    return p.xyz / p.w;
}
