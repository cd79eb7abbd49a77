// What all shaders of passes/rays/rays_device.c share: the job, its points, receivers and results.
#include "ray_job.def"

const uint LIST_LIT = 0x80000000u;
const uint NO_RECEIVER = 0u, UMBRA = 1u, LIT = 2u, MIXED = 3u;

layout(binding = UNIT_RAY_POSITION) uniform sampler2D receiver_position;
layout(binding = UNIT_RAY_NORMAL) uniform sampler2D receiver_normal;
layout(rgba32f, binding = IMAGE_VISIBILITY) writeonly uniform image2D visibility_image;
layout(r32f, binding = IMAGE_ERROR) writeonly uniform image2D error_image;

void count_rays(uint rays)
{
    if (rays != 0u && atomicAdd(counters.rays_low, rays) > 0xffffffffu - rays)
        atomicAdd(counters.rays_high, 1u);
}

void store(ivec2 pixel, vec4 visibility, float error)
{
    imageStore(visibility_image, pixel, visibility);
    imageStore(error_image, pixel, vec4(error));
}
