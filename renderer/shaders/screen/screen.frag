// A method's visibility() for every receiver of this face; drawn where there is one. The target
// starts at 1. LIGHT_HAS_MORE: not every receiver belongs to this face. Without, nothing is
// discarded, which software rasterisers pay for in every pixel.
#include "surface.glsl"
#include "BODY"
#ifdef HORIZON_FADE // the target is the method's visibility
#include "horizon.glsl"
#endif

layout(location = 0) out vec4 vis;

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(g_depth, pixel, 0).r;
    Surface s = surface_at(pixel, depth);
#ifdef LIGHT_HAS_MORE
    float border = 1.0;
#ifdef WITH_BORDER // also what the map of a cube's face shows beyond the face
    border = 1.02 + 1.02 * light.extent.x / light.near_z;
#endif
    if (light.cube != 0 && max(abs(s.p.x), abs(s.p.y)) > border * s.p.z)
        discard;
    if (light.omni != 0 && s.p.z <= light.near_z)
        discard;
#endif
    if (s.p.z <= 0.0 && !light_parallel)
        vis = vec4(0.0);
    else {
        // Coarse facets turn away from the light before the smooth surface that they stand for
        // does: there its normal is the receiver's plane, or the terminator would show the facets.
        if (!light_is_above_horizon(s.p, s.n))
            s.n = surface_shading_normal(pixel);
        vis = light_is_above_horizon(s.p, s.n) ? visibility(s) : vec4(0.0);
#ifdef HORIZON_FADE
        vis *= horizon_fade(horizon_share(s.p, s.n));
#endif
    }
}
