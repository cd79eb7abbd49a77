// What all shaders of passes/rays/rays_device.c share: the job, its points, receivers and results.
layout(std140, binding = 3) uniform RayBlock {
    vec4 origin; // centre of the emitter, world; w: cosine of the cone
    vec4 a, b;   // half axes
    vec4 z;      // axis of emission
    vec4 mean;   // of the emission
    vec4 eye;    // xyz; w: lift of a ray's origin per metre from the eye
    vec4 bias;   // x: least lift, m; y: target error
    uvec4 net;   // hash of the seed, bits a receiver may shift, salt, points in all
    uvec4 pretest;
    uvec4 size;  // width, height, nodes of the hierarchy
} ray;

layout(std430, binding = 2) readonly buffer RayPoints {
    ivec2 points[]; // signed 32-bit fractions of [-1, 1]
};
layout(std430, binding = 4) buffer RayList {
    uint list[]; // pixel y * width + x, with LIST_LIT where no ray is needed
};
layout(std430, binding = 5) buffer RayCounters {
    uint rays_low, rays_high, full_pixels, list_count;
    uint cut; // 1: some sums lack samples
} counters;

const uint LIST_LIT = 0x80000000u;
const uint NO_RECEIVER = 0u, UMBRA = 1u, LIT = 2u, MIXED = 3u;

layout(binding = 7) uniform sampler2D receiver_position;
layout(binding = 8) uniform sampler2D receiver_normal;
layout(rgba32f, binding = 0) writeonly uniform image2D visibility_image;
layout(r32f, binding = 1) writeonly uniform image2D error_image;

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
