// Aszodi and Szirmay-Kalos 2006: every map texel is a small caster whose shadow on the emitter is
// added up. Mode paper takes K x K points as printed (with c_z < r_z added and the sum divided by
// the light's area), clipped clips the texels' rectangles against the emitter. LAYERED, with more
// than one layer, the sum becomes the paper's occlusion bits.
#define PATCHES_APART
#include "caster_patches.glsl"
#include "emitter_area.glsl"
#ifdef LAYERED
#define LIGHT_BITS 256
#include "light_bits.glsl"
#endif

float hidden_share;

void add_patch(vec2 low, vec2 high, float share)
{
#ifdef LAYERED
    vec2 cut = 0.5 * (high - low) * (1.0 - sqrt(share));
    bits_add(low + cut, high - cut);
#else
    if (P(mode) == MODE_CLIPPED) {
        hidden_share += share * emitter_share(low, high);
        return;
    }
    // The whole caster counts when its centre lies before the light.
    vec2 at = 0.5 * (low + high), size = high - low;
    bool before = light_shape == SHAPE_DISK ? dot(at, at) < 1.0 : max(abs(at.x), abs(at.y)) < 1.0;
    if (before)
        hidden_share += size.x * size.y * (light_shape == SHAPE_DISK ? 1.0 / 3.14159265 : 0.25);
#endif
}

void walk_points(PatchWindow w, float receiver_z)
{
    // The light as the receiver sees it on the map plane (F4), or the part of it that casters of
    // this window can reach (F3).
    vec2 reach = w.reach;
    if (P(window) == WINDOW_LIGHT)
        reach = max(reach, light_search_extent(receiver_z));
    ivec2 size = textureSize(caster_maps, 0).xy;
    vec2 to_texels = vec2(size) / (light.rect.zw - light.rect.xy);
    vec2 to_e = to_texels * w.texel; // per metre
    vec2 pitch = 2.0 * reach / float(P(kernel));
    int k = w.answer == LIT ? 0 : int(P(kernel));
    for (int layer = 0; layer < int(P(layers)); layer++)
        for (int y = 0; y < k; y++)
            for (int x = 0; x < k; x++) {
                vec2 low = vec2(x, y) * pitch - reach, middle = low + 0.5 * pitch;
                vec2 at = (w.q + middle - light.rect.xy) * to_texels;
                float d = min(at.x, at.y) < 0.0 ? 1.0 : caster_depth(ivec2(max(at, 0.0)), layer);
                // The texel's depth is that of its centre.
                vec2 e = middle * to_e + (floor(at) + 0.5 - at) * w.texel;
                float plane = min(w.depth + dot(w.gradient, e), 1.0) - w.bias;
                vec2 scale = to_e / max(w.depth - d, 1e-20);
                if (d < min(plane, w.depth) && d > back_depth(w.back, e))
                    add_patch(low * scale, (low + pitch) * scale, 1.0);
            }
}

vec4 visibility(Surface s)
{
    PatchWindow w = patch_window(s);
    hidden_share = 0.0;
#ifdef LAYERED
    bits_begin(0);
#endif
    if (P(mode) == MODE_PAPER) {
        walk_points(w, s.p.z);
    } else {
        walk_patches(w);
        if (w.answer == UMBRA)
            return vec4(0.0);
    }
#ifdef LAYERED
    hidden_share = 1.0 - bits_lit_share();
#endif
    return scalar_visibility(clamp(1.0 - hidden_share / w.above, 0.0, 1.0));
}
