// Lookups in the depth maps of points of the emitter (passes/light/sample_maps.h).
#include "sample_map.def"

// What of the receiver is the same for all samples.
struct SampledReceiver {
    vec3 p, n;
    float depth, bias; // hardware depth
    float ratio, range, np, least;
};

SampledReceiver sampled_receiver(Surface s, float bias)
{
    SampledReceiver r;
    r.p = s.p;
    r.n = s.n;
    r.depth = light_depth(s.p.z);
    r.bias = surface_bias(s, bias) * light_depth_slope(s.p.z);
    r.ratio = light.near_z / s.p.z;
    r.range = light.far_z - light.near_z;
    r.np = dot(s.n, s.p);
    r.least = 0.02 * length(s.p);
    return r;
}

// The receiver as one sample sees it: where its map shows it, and the gradient of the receiver's
// plane in hardware depth over the map plane (F6 with the origin moved to the sample).
struct SampleView {
    vec2 l;        // m on the map plane
    vec2 gradient; // m^-1
    float facing;  // positive: the sample is above the receiver's horizon
};

SampleView sample_view(SampledReceiver r, vec2 at)
{
    SampleView v;
    float slope;
    if (light_parallel) {
        v.l = r.p.xy + at * r.p.z;
        v.facing = -(r.n.z - dot(r.n.xy, at));
        slope = 1.0 / (max(v.facing, 0.02) * r.range);
    } else {
        v.l = at + (r.p.xy - at) * r.ratio;
        v.facing = dot(r.n.xy, at) - r.np;
        slope = light.far_z / (r.range * max(v.facing, r.least));
    }
    v.gradient = slope * r.n.xy;
    return v;
}

// How much the sample counts: not at all below the receiver's horizon. Where it grazes the receiver
// its map cannot tell them apart, and irradiance is next to nothing: it counts where no other does.
float sample_weight(SampledReceiver r, SampleView v)
{
    float least = light_parallel ? 0.02 : r.least;
    return v.facing > least ? 1.0 : v.facing > 0.0 ? 1e-3 : 0.0;
}

// Depth that a map's texel must reach for the receiver to be lit, `offset` metres beside v.l.
float sample_plane(SampledReceiver r, SampleView v, vec2 offset)
{
    return min(r.depth + dot(v.gradient, offset), 1.0) - r.bias;
}

// The texel under v.l + offset: its depth, and the receiver's plane at its centre.
vec2 sample_depths(
    sampler2DArray maps, vec2 size, SampleMap map, SampledReceiver r, SampleView v, vec2 offset)
{
    vec2 uv = (v.l + offset) * map.window.xy + map.window.zw, texel = uv * size;
    vec2 center = offset + (floor(texel) + 0.5 - texel) / (size * map.window.xy);
    return vec2(texture(maps, vec3(uv, map.layer.x)).r, sample_plane(r, v, center));
}

float sample_lit(sampler2DArray maps, vec2 size, SampleMap map, SampledReceiver r, SampleView v)
{
    vec2 d = sample_depths(maps, size, map, r, v, vec2(0.0));
    return d.y <= d.x ? 1.0 : 0.0;
}

// The comparison interpolated between the four texels around v.l + offset.
float sample_lit_bilinear(
    sampler2DArray maps, vec2 size, SampleMap map, SampledReceiver r, SampleView v, vec2 offset)
{
    vec2 texel = ((v.l + offset) * map.window.xy + map.window.zw) * size - 0.5;
    vec2 base = floor(texel), f = texel - base, metres = 1.0 / (size * map.window.xy);
    vec4 z = textureGather(maps, vec3((base + 1.0) / size, map.layer.x)); // (0,1) (1,1) (1,0) (0,0)
    float corner = r.depth + dot(v.gradient, offset - f * metres);
    vec2 step = v.gradient * metres;
    vec4 plane = corner + vec4(step.y, step.x + step.y, step.x, 0.0);
    vec4 lit = vec4(lessThanEqual(min(plane, 1.0) - r.bias, z));
    return mix(mix(lit.w, lit.z, f.x), mix(lit.x, lit.y, f.x), f.y);
}

// Mean of the comparison over a square of kernel - 1 texels around v.l, which kernel^2 texels
// cover: those at the border count for the part inside. 2 is bilinear filtering, 1 a single texel;
// which of the three it is, KERNEL_SINGLE, KERNEL_BILINEAR or neither, is the pass's
// (sample_map_kernel).
float sample_lit_box(
    sampler2DArray maps, vec2 size, SampleMap map, SampledReceiver r, SampleView v, int kernel)
{
#if defined(KERNEL_SINGLE)
    return sample_lit(maps, size, map, r, v);
#elif defined(KERNEL_BILINEAR)
    return sample_lit_bilinear(maps, size, map, r, v, vec2(0.0));
#else
    int last = kernel - 1;
    vec2 low = (v.l * map.window.xy + map.window.zw) * size - 0.5 * float(last);
    vec2 base = floor(low), f = low - base, metres = 1.0 / (size * map.window.xy);
    vec2 first = (base + 0.5 - low - 0.5 * float(last)) * metres;
    float dark = 0.0; // summed instead of light, so that no rounding darkens what is lit
    for (int y = 0; y <= last; y++) {
        float wy = y == 0 ? 1.0 - f.y : y == last ? f.y : 1.0;
        for (int x = 0; x <= last; x++) {
            float wx = x == 0 ? 1.0 - f.x : x == last ? f.x : 1.0;
            vec2 at = vec2(x, y);
            float d = texture(maps, vec3((base + at + 0.5) / size, map.layer.x)).r;
            dark += sample_plane(r, v, first + at * metres) <= d ? 0.0 : wx * wy;
        }
    }
    return max(1.0 - dark / float(last * last), 0.0);
#endif
}
