// This frame's samples join those of the frames before: reverse reprojection (Nehab et al. 2007,
// Scherzer et al. 2007) of the last frame's means and counts, from texels of the same surface.
#include "temporal.glsl"
layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_FRESH) uniform sampler2D fresh_mean;
layout(binding = UNIT_LAST_MEAN) uniform sampler2D last_mean;
layout(binding = UNIT_LAST_STATE) uniform sampler2D last_state;
layout(location = 0) out vec4 mean;
layout(location = 1) out vec4 state;

#define AROUND 2      // pixels
#define FINE 0.5      // differences between neighbours that reprojection does not follow
#define RESAMPLED 1.0 // of what two filters differ by, the error of the better one
#define FLAT 0.004    // differences that resampling does not show

struct Carried {
    vec4 mean, low, high; // over the texels that count
    float samples, found; // found: their share of the weights
    int texels;
};

vec4 state_at(ivec2 texel)
{
    bool inside =
        all(greaterThanEqual(texel, ivec2(0))) && all(lessThan(texel, ivec2(view.viewport.xy)));
    return inside ? texelFetch(last_state, texel, 0) : vec4(0.0);
}

// Catmull-Rom's weights of four texels in a row (Keys 1981, a = -1/2).
vec4 cubic_weights(float f)
{
    return vec4(f * (-0.5 + f * (1.0 - 0.5 * f)), 1.0 + f * f * (1.5 * f - 2.5),
        f * (0.5 + f * (2.0 - 1.5 * f)), f * f * (0.5 * f - 0.5));
}

void carry(inout Carried c, Receiver r, ivec2 texel, float weight)
{
    vec4 s = state_at(texel);
    if (weight <= 0.0 || !is_same_surface(r, temporal.clip_to_world, temporal.last.x, texel, s))
        return;
    vec4 value = texelFetch(last_mean, texel, 0);
    c.mean += weight * value;
    c.low = min(c.low, value);
    c.high = max(c.high, value);
    c.samples += weight * s.x;
    c.found += weight;
    c.texels++;
}

// Bilinear filters, frame after frame, wear every edge away: where the four texels differ, twelve
// more around them keep it, within their range. What both filters differ by tells how sharp the
// edge is, and how little the past then knows of it.
void sharpen(inout Carried c, Receiver r, ivec2 base, vec2 f)
{
    bool even = brightness(c.high) - brightness(c.low) < FLAT * temporal.last.w;
    int taps = c.texels < 4 || even ? 0 : 16;
    vec4 wx = cubic_weights(f.x), wy = cubic_weights(f.y), sum = vec4(0.0);
    for (int i = 0; i < taps; i++) {
        ivec2 at = ivec2(i & 3, i >> 2), texel = base + at - 1;
        // One of another surface is taken for what lies beside it.
        if (!is_same_surface(r, temporal.clip_to_world, temporal.last.x, texel, state_at(texel)))
            texel = base + clamp(at - 1, 0, 1);
        sum += wx[at.x] * wy[at.y] * texelFetch(last_mean, texel, 0);
    }
    if (taps == 0)
        return;
    float before = brightness(c.mean);
    c.mean = clamp(sum, c.low, c.high);
    float off = RESAMPLED * (brightness(c.mean) - before) / temporal.last.w;
    float known = samples_error(c.samples);
    c.samples *= pow(1.0 + off * off / (known * known), -0.6667);
}

Carried carried(ivec2 pixel, Receiver r)
{
    Carried c = Carried(vec4(0.0), vec4(1e30), vec4(-1e30), 0.0, 0.0, 0);
    if (temporal.last.z == 0.0)
        return c;
    ivec2 base = pixel;
    vec2 f = vec2(0.0);
    if (temporal.last.y == 0.0) {
        vec4 clip = temporal.world_to_clip * vec4(r.world, 1.0);
        if (clip.w <= 0.0)
            return c;
        vec2 at = (clip.xy / clip.w * vec2(0.5, -0.5) + 0.5) * view.viewport.xy - 0.5;
        if (!all(lessThan(abs(at), vec2(1e6))))
            return c;
        base = ivec2(floor(at));
        f = at - vec2(base);
    }
    carry(c, r, base, (1.0 - f.x) * (1.0 - f.y));
    carry(c, r, base + ivec2(1, 0), f.x * (1.0 - f.y));
    carry(c, r, base + ivec2(0, 1), (1.0 - f.x) * f.y);
    carry(c, r, base + ivec2(1, 1), f.x * f.y);
    if (c.found < 0.01)
        return Carried(vec4(0.0), vec4(0.0), vec4(0.0), 0.0, 0.0, 0);
    c.mean /= c.found;
    c.samples = min(c.samples / c.found, temporal.fresh.y);
    sharpen(c, r, base, f);
    return c;
}

// Of a mean visibility over n samples that are spread well (binomial with Laplace's rule, at most
// what such samples leave).
float standard_error(float v, float n)
{
    v = (clamp(v, 0.0, 1.0) * n + 1.0) / (n + 2.0);
    return min(sqrt(v * (1.0 - v) / n), samples_error(n));
}

// How far this frame's answers around a pixel are apart.
float variation(ivec2 pixel, int around)
{
    float low = 1e30, high = -1e30;
    for (int y = -around; y <= around; y++)
        for (int x = -around; x <= around; x++) {
            ivec2 at = clamp(pixel + ivec2(x, y), ivec2(0), ivec2(view.viewport.xy) - 1);
            vec4 other = texelFetch(fresh_mean, at, 0);
            float value = brightness(other) / temporal.last.w;
            low = other.a > 0.0 ? min(low, value) : low;
            high = other.a > 0.0 ? max(high, value) : high;
        }
    return high - low;
}

// Where casters have moved, history is brought as near to the new samples as those and their
// neighbourhood allow (variance clipping, Salvi 2016), and counts as less.
void clip_history(inout Carried c, vec4 fresh, ivec2 pixel)
{
    float open = temporal.last.w;
    float now = brightness(fresh) / open, then = brightness(c.mean) / open;
    float most = temporal.limits.z * standard_error(now, temporal.fresh.x);
    // All samples here and around agree: it is outside of every penumbra.
    if ((now < 1e-3 || now > 0.999) && variation(pixel, AROUND) < 1e-3)
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
    vec2 normal = texelFetch(g_normal, pixel, 0).xy;
    vec4 fresh = texelFetch(fresh_mean, pixel, 0);
    Carried c = carried(pixel, receiver_at(pixel, depth, normal));
    atomicAdd(counters[COUNT_RECEIVERS], 1u);
    if (c.samples > 0.0) {
        atomicAdd(counters[COUNT_CARRIED], 1u);
        c.samples = min(c.samples, temporal.fresh.y);
        if (temporal.limits.z > 0.0)
            clip_history(c, fresh, pixel);
        if (temporal.limits.w > 0.0 && variation(pixel, 1) > FINE)
            c.samples = 0.0;
    }
    float samples = c.samples + temporal.fresh.x;
    mean = mix(c.mean, fresh, temporal.fresh.x / samples);
    state = vec4(samples, depth, normal);
}
