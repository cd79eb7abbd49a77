// Marks what lies within DILATION receivers in x of a mixed verdict, or of lit beside umbra: a
// contact or a silhouette whose penumbra is thinner than a receiver. ray_select.comp spreads it in
// y.
#include "rays.def"
layout(local_size_x = RAY_TILE, local_size_y = RAY_TILE) in;
#include "ray_job.glsl"
layout(r8ui, binding = IMAGE_MARKS) writeonly uniform uimage2D spread;
layout(binding = UNIT_RAY_VERDICTS) uniform usampler2D verdicts;

bool is_edge(uint a, uint b)
{
    return (a == LIT && b == UMBRA) || (a == UMBRA && b == LIT);
}

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy);
    if (any(greaterThanEqual(pixel, ivec2(ray.size.xy))))
        return;
    int low = max(pixel.x - DILATION, 0), high = min(pixel.x + DILATION, int(ray.size.x) - 1);
    uint left = texelFetch(verdicts, ivec2(max(low - 1, 0), pixel.y), 0).r;
    bool marked = false;
    for (int x = low; x <= high; x++) {
        uint own = texelFetch(verdicts, ivec2(x, pixel.y), 0).r;
        uint above = texelFetch(verdicts, ivec2(x, max(pixel.y - 1, 0)), 0).r;
        marked = marked || own == MIXED || is_edge(own, left) || is_edge(own, above);
        left = own;
    }
    imageStore(spread, pixel, uvec4(marked ? 1u : 0u));
}
