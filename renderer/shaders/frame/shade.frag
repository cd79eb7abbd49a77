// Direct light of all lights times their visibility, plus ambient and emission. RESOLVE: there is
// one frame only, so the display curve is applied here. TRANSPARENT: alpha is how much of the
// pixel the scene covers; what is summed over frames is multiplied by it. CATCHER: of the ground
// only the shadow is there, as black that covers the more the less light arrives. LAYERED: the
// picture is summed up of layers, and this is what is solid or, LAYER, a blended one, times its
// alpha. BACKGROUND: of the pixels where there is nothing; otherwise there is something. LIGHTS is
// a constant: unrolled, each light's uniforms are read once for all pixels instead of gathered per
// pixel.
#include "view.glsl"
#include "octahedral.glsl"
#include "irradiance.glsl"
#include "display.glsl"
#include "shade.def"
#include "sky.glsl"

layout(binding = UNIT_DEPTH) uniform sampler2D g_depth;
layout(binding = UNIT_NORMAL) uniform sampler2D g_normal;
layout(binding = UNIT_ALBEDO) uniform sampler2D g_albedo;
layout(binding = UNIT_SURFACE) uniform sampler2D g_surface;
#ifdef EMIT
layout(binding = UNIT_EMITTED) uniform sampler2D g_emission;
#endif
layout(binding = UNIT_SOURCE) uniform sampler2DArray visibility_maps;

#ifdef SKY
layout(binding = UNIT_SKY_OPEN) uniform sampler2D sky_open; // of occlusion_blur.frag
#endif

layout(location = 0) out vec4 color;

struct Reflectance {
    vec3 diffuse, f0;
    float alpha; // squared roughness
};

// GGX with height-correlated Smith visibility and Schlick's Fresnel term, as glTF 2.0 appendix B,
// times nl; out of the cosines alone, since |v + l|^2 = 2 + 2 vl. `a` is the squared roughness.
vec3 specular_brdf(vec3 f0, float a, float nv, float nl, float vl)
{
    float h = inversesqrt(max(2.0 + 2.0 * vl, 1e-6));
    float nh = min((nl + nv) * h, 1.0), vh = (1.0 + vl) * h, a2 = a * a;
    float t = nh * nh * (a2 - 1.0) + 1.0;
    float smith = nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2);
    float x = 1.0 - vh, x2 = x * x;
    return (f0 + (1.0 - f0) * (x2 * x2 * x)) * (0.5 * nl * a2 / (3.14159265 * t * t * smith));
}

#if defined(HAS_RECT) || defined(HAS_ROUND)
// Quadrature of the specular part over the emitter, k x k cells. Scenes without glossy materials
// get by with four. All that a point u of the emitter needs is linear in u, or quadratic without
// the mixed term, so nothing but scalars is left inside the loop. It has a constant length: a
// dynamic one costs software rasterisers more than the samples it saves.
vec3 specular_area(Reflectance m, ShadeLight s, vec3 p, vec3 n, vec3 v)
{
    int type = int(s.origin.w);
#ifdef GLOSSY
    const int k = 4;
#else
    const int k = 2;
#endif
    vec3 half_x = s.half_x.xyz, half_y = s.half_y.xyz, axis = s.z.xyz, to = s.origin.xyz - p;
#ifdef HAS_ROUND
    if (type == PEN_LIGHT_SPHERE) { // the disk that faces the receiver
        axis = -normalize(to);
        vec3 up = abs(axis.y) < 0.9 ? vec3(0.0, 1.0, 0.0) : vec3(1.0, 0.0, 0.0);
        half_x = normalize(cross(up, axis)) * s.half_x.w;
        half_y = cross(axis, half_x);
    }
#endif
    vec2 size2 = vec2(dot(half_x, half_x), dot(half_y, half_y));
    float cell =
        (type == PEN_LIGHT_RECT ? 4.0 : 3.14159265) * sqrt(size2.x * size2.y) / float(k * k);
    // The lobe is widened by the solid angle that one cell stands for; a narrow one by more, or it
    // would show the cells.
    float to2 = dot(to, to), widening = mix(0.4, 0.25, min(10.0 * m.alpha, 1.0));
    float a = m.alpha + min(widening * sqrt(cell / to2), 0.5);
    float nv = max(dot(n, v), 1e-3), facing = max(-dot(axis, to), 0.0);
    vec3 n_of = vec3(dot(n, half_x), dot(n, half_y), dot(n, to));
    vec3 v_of = vec3(dot(v, half_x), dot(v, half_y), dot(v, to));
    vec2 to_of = 2.0 * vec2(dot(to, half_x), dot(to, half_y));
    vec3 sum = vec3(0.0);
    for (int i = 0; i < k * k; i++) {
        vec2 u = (vec2(i % k, i / k) + 0.5) * (2.0 / float(k)) - 1.0;
#ifdef HAS_ROUND
        if (type != PEN_LIGHT_RECT) { // concentric map of Shirley and Chiu
            bool wide = abs(u.x) > abs(u.y);
            float r = wide ? u.x : u.y;
            float t = 0.78539816 * (wide ? u.y / u.x : (r == 0.0 ? 0.0 : 2.0 - u.x / u.y));
            u = r * vec2(cos(t), sin(t));
        }
#endif
        float inverse = inversesqrt(to2 + dot(u, to_of) + dot(u * u, size2));
        float nl = max(dot(vec3(u, 1.0), n_of) * inverse, 1e-6);
        float vl = dot(vec3(u, 1.0), v_of) * inverse;
        sum += specular_brdf(m.f0, a, nv, nl, vl) * (inverse * inverse * inverse);
    }
    return sum * (facing * cell);
}

vec3 reflected_area(Reflectance m, ShadeLight s, vec3 p, vec3 n, vec3 v)
{
    int type = int(s.origin.w);
    float e = 0.0;
#ifdef HAS_RECT
    if (type == PEN_LIGHT_RECT)
        e = irradiance_rect(p, n, s.origin.xyz, s.half_x.xyz, s.half_y.xyz);
#endif
#ifdef HAS_ROUND
    if (type == PEN_LIGHT_DISK)
        e = irradiance_disk(p, n, s.origin.xyz, s.half_x.xyz, s.half_y.xyz);
    if (type == PEN_LIGHT_SPHERE)
        e = irradiance_sphere(p, n, s.origin.xyz, s.half_x.w);
#endif
    bool behind = type != PEN_LIGHT_SPHERE && dot(s.origin.xyz - p, s.z.xyz) >= 0.0;
    if (behind || e <= 0.0)
        return vec3(0.0);
    return m.diffuse * (e / 3.14159265) + specular_area(m, s, p, n, v);
}
#endif

#ifdef HAS_PUNCTUAL
vec3 reflected_punctual(Reflectance m, ShadeLight s, vec3 p, vec3 n, vec3 v)
{
    int type = int(s.origin.w);
    vec3 to = s.origin.xyz - p;
    vec3 l = type == PEN_LIGHT_SUN ? -s.z.xyz : normalize(to);
    float nl = dot(n, l);
    if (nl <= 0.0)
        return vec3(0.0);
    float e = type == PEN_LIGHT_SUN ? nl : nl / dot(to, to);
    if (type == PEN_LIGHT_SPOT)
        e *= pow(clamp((dot(-l, s.z.xyz) - s.z.w) / max(s.half_y.w - s.z.w, 1e-4), 0.0, 1.0), 2.0);
    float nv = max(dot(n, v), 1e-3);
    return (m.diffuse * (1.0 / 3.14159265) + specular_brdf(m.f0, m.alpha, nv, nl, dot(v, l)) / nl) *
           e;
}
#endif

vec3 reflected(Reflectance m, ShadeLight s, vec3 p, vec3 n, vec3 v)
{
#if (defined(HAS_RECT) || defined(HAS_ROUND)) && defined(HAS_PUNCTUAL)
    return int(s.origin.w) >= PEN_LIGHT_SUN ? reflected_punctual(m, s, p, n, v)
                                            : reflected_area(m, s, p, n, v);
#elif defined(HAS_PUNCTUAL)
    return reflected_punctual(m, s, p, n, v);
#elif defined(HAS_RECT) || defined(HAS_ROUND)
    return reflected_area(m, s, p, n, v);
#else
    return vec3(0.0);
#endif
}

#ifdef SKY
// How much of the sky the pixel sees: of the four half-size texels around it, those at its depth.
float open_to_sky(ivec2 pixel, float depth)
{
    ivec2 last = textureSize(sky_open, 0) - 1, base = (pixel - 1) >> 1;
    float sum = 0.0, weight = 0.0;
    for (int i = 0; i < 4; i++) {
        vec2 there = texelFetch(sky_open, clamp(base + ivec2(i & 1, i >> 1), ivec2(0), last), 0).rg;
        float w = exp2(-64.0 * abs(there.g - depth) / depth) + 1e-4;
        sum += w * there.r;
        weight += w;
    }
    return sum / weight;
}

vec3 sky_reflected(Reflectance m, vec3 p, vec3 n, vec3 v, float open)
{
    float nv = clamp(dot(n, v), 1e-3, 1.0);
    // Light that bounces between bright surfaces fills their corners (Jimenez et al. 2016, 4).
    vec3 a = 2.0404 * m.diffuse - 0.3324, b = -4.7951 * m.diffuse + 0.6417;
    vec3 c = 2.7552 * m.diffuse + 0.6903;
    vec3 seen = max(vec3(open), ((open * a + b) * open + c) * open);
    // A narrow lobe is hidden less gradually than a hemisphere (Lagarde and de Rousiers 2014).
    float hidden = clamp(pow(nv + open, exp2(-16.0 * sqrt(m.alpha) - 1.0)) - 1.0 + open, 0.0, 1.0);
    vec3 mirrored = sky_specular(p, reflect(-v, n), m.alpha) * hidden;
    return m.diffuse * sky_diffuse(n) * seen + sky_reflectance(m.f0, sqrt(m.alpha), nv) * mirrored;
}
#endif

void main()
{
    ivec2 pixel = ivec2(gl_FragCoord.xy);
#ifdef BACKGROUND
    const bool hit = false;
    const float depth = 0.0;
#else
    const bool hit = true;
    float depth = texelFetch(g_depth, pixel, 0).r;
#endif
    vec3 p = unproject(view.clip_to_world, pixel_to_ndc(pixel), hit ? depth : 1.0);
    vec3 v = normalize(view.eye.xyz - p);
    vec3 n = octahedral_decode(texelFetch(g_normal, pixel, 0).zw);
    vec4 albedo = texelFetch(g_albedo, pixel, 0);
    vec4 surface = texelFetch(g_surface, pixel, 0);
    albedo.rgb *= albedo.rgb;
    Reflectance m;
    m.diffuse = albedo.rgb * (1.0 - surface.g) * (1.0 - 0.08 * surface.a);
    m.f0 = mix(vec3(0.08 * surface.a), albedo.rgb, surface.g);
    m.alpha = max(surface.r * surface.r, 0.002);
#ifdef CATCHER
    bool catches = hit && albedo.a == 0.0;
    if (catches)
        m.diffuse = vec3(1.0);
    vec3 unshadowed = view.ambient.rgb * (m.diffuse + m.f0) * surface.b;
#endif
    vec3 sum = view.ambient.rgb * (m.diffuse + m.f0) * surface.b;
#ifdef SKY
    if (hit)
        sum += surface.b * sky_reflected(m, p, n, v, open_to_sky(pixel, depth));
#ifdef CATCHER
    if (catches)
        unshadowed += surface.b * sky_reflected(m, p, n, v, 1.0);
#endif
#endif
#ifdef EMIT
    sum += texelFetch(g_emission, pixel, 0).rgb;
#endif
    for (int i = 0; i < LIGHTS; i++) {
        vec3 t = texelFetch(visibility_maps, ivec3(pixel, i), 0).rgb;
#ifdef CATCHER
        if (catches) {
            vec3 light = shade.lights[i].radiance.rgb * reflected(m, shade.lights[i], p, n, v);
            sum += t * light;
            unshadowed += shade.lights[i].open.rgb * light;
            continue;
        }
#endif
        if (hit && t != vec3(0.0))
            sum += t * shade.lights[i].radiance.rgb * reflected(m, shade.lights[i], p, n, v);
    }
    float alpha = hit ? 1.0 : 0.0;
    vec3 background = view.background.rgb;
#ifdef SKY
    background += sky_backdrop(-v.y);
#endif
#ifdef LAYER
    bool ground = false;
#else
    bool ground = hit && albedo.a == 0.0;
#endif
    if (ground) { // the ground fades into the background, so that it has no edge
        float d = distance(p.xz, view.ground.xz) / view.ground.w;
        alpha = 1.0 - smoothstep(0.15, 0.6, d);
#ifdef CATCHER
        const vec3 brightness = vec3(0.2126, 0.7152, 0.0722);
        float open = dot(unshadowed, brightness);
        alpha *= open > 0.0 ? clamp(1.0 - dot(sum, brightness) / open, 0.0, 1.0) : 0.0;
        sum = vec3(0.0);
#endif
    }
#ifdef TRANSPARENT
    vec4 covered = alpha > 0.0 ? vec4(sum, alpha) : vec4(0.0);
#else
    vec4 covered = vec4(alpha > 0.0 ? mix(sum, background, 1.0 - alpha) : background, 1.0);
#endif
#ifdef LAYER
    alpha *= albedo.a;
    color = alpha > 0.0 ? vec4(sum * alpha, alpha) : vec4(0.0);
#elif defined(RESOLVE)
    color = vec4(display_encode(covered.rgb), covered.a);
#elif defined(LAYERED)
    color = vec4(covered.rgb * covered.a, covered.a);
#else
    color = vec4(covered.rgb * covered.a, covered.a) * view.display.w;
#endif
}
