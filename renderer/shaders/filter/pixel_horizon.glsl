// The fade of horizon.glsl for passes that have no Surface; needs surface_plane.glsl and
// light.glsl.
#include "horizon.glsl"

float pixel_horizon_fade(ivec2 pixel)
{
    vec4 normals = texelFetch(g_normal, pixel, 0);
    float depth = texelFetch(g_depth, pixel, 0).r;
    vec3 p = unproject(light.clip_to_light, pixel_to_ndc(pixel), depth);
    vec3 n = mat3(light.world_to_light) * octahedral_decode(normals.xy);
    if (!light_is_above_horizon(p, n)) // as screen.frag
        n = mat3(light.world_to_light) * octahedral_decode(normals.zw);
    return horizon_fade(horizon_share(p, n));
}
