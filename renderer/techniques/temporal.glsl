// What the frames of a sequence leave, for the passes that read it: means over light samples, and
// of which surfaces they are.
#include "view.glsl"
#include "octahedral.glsl"
#include "temporal.def"

struct Receiver {
    vec3 world, n;
    float away; // m, from the eye
};

Receiver receiver_at(ivec2 pixel, float depth, vec2 normal)
{
    return Receiver(unproject(view.clip_to_world, pixel_to_ndc(pixel), depth),
        octahedral_decode(normal), view.forward.w / depth);
}

// A texel of a frame of that camera shows the receiver's surface: it lies in its plane, by so many
// pixels, and faces alike.
bool is_same_surface(Receiver r, mat4 clip_to_world, float near_z, ivec2 texel, vec4 s)
{
    if (s.x <= 0.0)
        return false;
    vec3 there = unproject(clip_to_world, pixel_to_ndc(texel), s.y);
    float pixel = max(r.away, near_z / s.y) / view.eye.w; // m
    return abs(dot(r.n, there - r.world)) <= temporal.limits.x * pixel &&
           dot(r.n, octahedral_decode(s.zw)) >= temporal.limits.y;
}

float brightness(vec4 m)
{
    return dot(m.rgb, vec3(1.0)) / max(m.a, 1e-20);
}

// What n samples that are spread well leave at most (measured of Owen-scrambled sets: n times the
// error grows as the fourth root of n).
float samples_error(float n)
{
    return 0.4 * pow(n, -0.75);
}
