// This frame's samples join those of the frames before: reverse reprojection (Nehab et al. 2007,
// Scherzer et al. 2007) of the last frame's means and counts, from texels of the same surface.
#include "view.glsl"
#include "octahedral.glsl"
#include "temporal.def"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_FRESH) uniform sampler2D fresh_mean;
layout(binding = UNIT_LAST_MEAN) uniform sampler2D last_mean;
layout(binding = UNIT_LAST_STATE) uniform sampler2D last_state;
layout(location = 0) out vec4 mean;
layout(location = 1) out vec4 state;

#define AROUND 2 // pixels

struct Carried {
    vec4 mean;
    float samples, weight;
};

// A texel of the last frame counts when it showed this surface: it lies in the receiver's plane, by
// so many pixels, and faces alike.
void carry(inout Carried c, ivec2 texel, float weight, vec3 world, vec3 n, float away)
{
    if (weight <= 0.0 || any(lessThan(texel, ivec2(0))) ||
        any(greaterThanEqual(texel, ivec2(view.viewport.xy))))
        return;
    vec4 s = texelFetch(last_state, texel, 0);
    if (s.x <= 0.0)
        return;
    vec3 there = unproject(temporal.clip_to_world, pixel_to_ndc(texel), s.y);
    float pixel = max(away, temporal.last.x / s.y) / view.eye.w; // m
    if (abs(dot(n, there - world)) > temporal.limits.x * pixel ||
        dot(n, octahedral_decode(s.zw)) < temporal.limits.y)
        return;
    c.mean += weight * texelFetch(last_mean, texel, 0);
    c.samples += weight * s.x;
    c.weight += weight;
}

Carried carried(ivec2 pixel, vec3 world, vec3 n, float away)
{
    Carried c = Carried(vec4(0.0), 0.0, 0.0);
    if (temporal.last.z == 0.0)
        return c;
    if (temporal.last.y != 0.0) {
        carry(c, pixel, 1.0, world, n, away);
    } else {
        vec4 clip = temporal.world_to_clip * vec4(world, 1.0);
        if (clip.w <= 0.0)
            return c;
        vec2 at = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * view.viewport.xy - 0.5;
        if (!all(lessThan(abs(at), vec2(1e6))))
            return c;
        ivec2 base = ivec2(floor(at));
        vec2 f = at - vec2(base);
        carry(c, base, (1.0 - f.x) * (1.0 - f.y), world, n, away);
        carry(c, base + ivec2(1, 0), f.x * (1.0 - f.y), world, n, away);
        carry(c, base + ivec2(0, 1), (1.0 - f.x) * f.y, world, n, away);
        carry(c, base + ivec2(1, 1), f.x * f.y, world, n, away);
    }
    if (c.weight < 0.01)
        return Carried(vec4(0.0), 0.0, 0.0);
    c.mean /= c.weight;
    c.samples /= c.weight;
    return c;
}

// Of a mean visibility over n samples that are spread well (binomial with Laplace's rule, at most
// what such samples leave).
float standard_error(float v, float n)
{
    v = (clamp(v, 0.0, 1.0) * n + 1.0) / (n + 2.0);
    return min(sqrt(v * (1.0 - v) / n), 0.4 * pow(n, -0.75));
}

float brightness(vec4 m)
{
    return dot(m.rgb, vec3(1.0)) / max(m.a, 1e-20);
}

// All samples of this pixel and of those around it agree: it is outside of every penumbra.
bool is_unanimous(ivec2 pixel, float now)
{
    if (now > 1e-3 && now < 0.999)
        return false;
    for (int y = -AROUND; y <= AROUND; y++)
        for (int x = -AROUND; x <= AROUND; x++) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), ivec2(view.viewport.xy) - 1);
            vec4 other = texelFetch(fresh_mean, at, 0);
            if (other.a > 0.0 && abs(brightness(other) / temporal.last.w - now) > 1e-3)
                return false;
        }
    return true;
}

// Where casters have moved, history is brought as near to the new samples as those and their
// neighbourhood allow (variance clipping, Salvi 2016), and counts as less.
void clip_history(inout Carried c, vec4 fresh, ivec2 pixel)
{
    float open = temporal.last.w;
    float now = brightness(fresh) / open, then = brightness(c.mean) / open;
    float most = temporal.limits.z * standard_error(now, temporal.fresh.x);
    if (is_unanimous(pixel, now))
        most *= 0.1;
    float apart = abs(now - then);
    if (apart <= most)
        return;
    float keep = most / apart;
    c.mean = mix(fresh, c.mean, keep);
    c.samples *= keep * keep;
}

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
    float depth = texelFetch(g_depth, pixel, 0).r;
    mean = state = vec4(0.0);
    if (depth == 0.0)
        return;
    vec3 world = unproject(view.clip_to_world, pixel_to_ndc(pixel), depth);
    vec2 normal = texelFetch(g_normal, pixel, 0).xy;
    vec4 fresh = texelFetch(fresh_mean, pixel, 0);
    Carried c = carried(pixel, world, octahedral_decode(normal), view.forward.w / depth);
    atomicAdd(counters[COUNT_RECEIVERS], 1u);
    if (c.samples > 0.0) {
        atomicAdd(counters[COUNT_CARRIED], 1u);
        c.samples = min(c.samples, temporal.fresh.y);
        if (temporal.limits.z > 0.0)
            clip_history(c, fresh, pixel);
    }
    float samples = c.samples + temporal.fresh.x;
    mean = mix(c.mean, fresh, temporal.fresh.x / samples);
    state = vec4(samples, depth, normal);
}
