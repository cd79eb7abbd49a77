// A few rays from every receiver: what they agree on, rows from `first_row`.
#include "rays.def"
layout(local_size_x = RAY_TILE, local_size_y = RAY_TILE) in;
#include "ray_trace.glsl"
layout(r8ui, binding = IMAGE_MARKS) writeonly uniform uimage2D verdicts;
layout(location = LOCATION_FIRST_ROW) uniform uint first_row;

void main()
{
    ivec2 pixel = ivec2(gl_GlobalInvocationID.xy) + ivec2(0, first_row);
    if (any(greaterThanEqual(pixel, ivec2(ray.size.xy))))
        return;
    RayReceiver r;
    uint verdict = NO_RECEIVER, rays = 0u, taken = 0u;
    float seen = 0.0, all = 0.0;
    if (load_receiver(pixel, ray.pretest, r)) {
        for (; r.reachable && taken < PRETEST_NET + PRETEST_RIM; taken++) {
            ivec2 shift = taken < PRETEST_NET ? r.shift : ivec2(0);
            vec2 s = light_point(points[ray.net.z + taken] ^ shift);
            if (cosine_to(r, s) > 0.0) {
                rays++;
                float share = share_seen(r, direction_to(r, s));
                seen += share;
                all += share == 1.0 ? 1.0 : 0.0;
            }
        }
        bool cut = bvh_cut || (r.reachable && taken < PRETEST_NET + PRETEST_RIM);
        bool all_seen = all == float(PRETEST_NET + PRETEST_RIM);
        verdict = cut || (seen > 0.0 && !all_seen) ? MIXED : all_seen ? LIT : UMBRA;
        count_rays(rays);
    }
    imageStore(verdicts, pixel, uvec4(verdict));
}
