// A receiver and the light as it sees it, computed as in renderer/trace/embree/packet.c. LIGHT_TYPE
// is one of enum pen_trace_light_type.
#include "lights.def"
const float RAY_END = 0.9999; // just before the light, which may be a mesh itself

struct RayReceiver {
    vec3 origin;     // lifted
    vec3 base, a, b; // from there to the light's centre, and its half axes
    float cos_base, cos_a, cos_b, front;
    ivec2 shift;
    bool reachable; // some light point is in front
};

// A frame whose z is the unit vector `to`, turned from the light's own by the smallest rotation
// (Rodrigues), so that a texture stays put as the receiver moves.
void face_receiver(vec3 to, inout vec3 a, inout vec3 b)
{
    float c = dot(ray.z.xyz, to);
    vec3 axis = cross(ray.z.xyz, to);
    if (c > -0.9999) {
        a = c * a + cross(axis, a) + axis * (dot(axis, a) / (1.0 + c));
        b = c * b + cross(axis, b) + axis * (dot(axis, b) / (1.0 + c));
    } else {
        b = -b;
    }
}

float receiver_lift(vec3 p)
{
    float largest = max(max(abs(p.x), abs(p.y)), abs(p.z));
    return max(largest * (1.0 / 262144.0), ray.bias.x);
}

// False when the pixel is no receiver.
bool load_receiver(ivec2 pixel, uvec4 net, out RayReceiver r)
{
    vec3 p = texelFetch(receiver_position, pixel, 0).xyz;
    vec3 n = texelFetch(receiver_normal, pixel, 0).xyz;
    float size = length(n), check = size + p.x + p.y + p.z;
    r.reachable = false;
    if (!(size > 0.0) || isnan(check) || isinf(check))
        return false;
    n /= size;
    vec3 to = ray.eye.xyz - p;
    float cosine = max(abs(dot(n, to)) / max(length(to), 1e-30), 0.1);
    vec3 lift = receiver_lift(p) * n;
    p += min(max(ray.eye.w, ray.bias.z / cosine), 0.5) * to; // see pen_trace_job
    uint hash = trace_hash(uint(pixel.y) * ray.size.x + uint(pixel.x) ^ net.x);
    r.shift = ivec2(hash & net.y, trace_hash(hash ^ 0x68bc21ebu) & net.y);
    r.a = ray.a.xyz;
    r.b = ray.b.xyz;
    r.base = LIGHT_TYPE == PEN_TRACE_SUN ? -ray.z.xyz : ray.origin.xyz - p;
    r.front = LIGHT_TYPE == PEN_TRACE_SUN ? 1.0 : -dot(r.base, ray.z.xyz);
    float away = length(r.base);
    if (LIGHT_TYPE == PEN_TRACE_SPHERE || LIGHT_TYPE == PEN_TRACE_POINT)
        r.front = away;
    if (LIGHT_TYPE == PEN_TRACE_SPHERE)
        face_receiver(-r.base / away, r.a, r.b);
    bool outside = LIGHT_TYPE == PEN_TRACE_POINT && -dot(r.base, ray.z.xyz) / away < ray.origin.w;
    r.cos_base = dot(n, r.base);
    r.cos_a = dot(n, r.a);
    r.cos_b = dot(n, r.b);
    r.reachable =
        away > 0.0 && r.front > 0.0 && !outside && r.cos_base + abs(r.cos_a) + abs(r.cos_b) > 0.0;
    r.origin = p + lift;
    if (LIGHT_TYPE != PEN_TRACE_SUN)
        r.base -= lift;
    return true;
}

// The unit square's point on the unit disk, areas kept (Shirley and Chiu 1997).
vec2 disk_point(vec2 s)
{
    bool tall = abs(s.y) > abs(s.x);
    float radius = tall ? s.y : s.x, other = tall ? s.x : s.y;
    float t = (radius != 0.0 ? other / radius : 0.0) * 0.78539816, t2 = t * t;
    float sine = t * (1.0 + t2 * (-1.0 / 6.0 + t2 * (1.0 / 120.0 - t2 * (1.0 / 5040.0))));
    float cosine = 1.0 + t2 * (-0.5 + t2 * (1.0 / 24.0 + t2 * (-1.0 / 720.0 + t2 / 40320.0)));
    return radius * (tall ? vec2(sine, cosine) : vec2(cosine, sine));
}

// The light's point in [-1, 1]^2 for sample `at` of the unit square.
vec2 light_point(ivec2 at)
{
    vec2 s = vec2(at) * (1.0 / 2147483648.0);
    return LIGHT_TYPE == PEN_TRACE_RECT || LIGHT_TYPE == PEN_TRACE_POINT ? s : disk_point(s);
}

// Above 0 when the receiver faces light point s.
float cosine_to(RayReceiver r, vec2 s)
{
    return r.cos_base + s.x * r.cos_a + s.y * r.cos_b;
}

vec3 direction_to(RayReceiver r, vec2 s)
{
    return r.base + s.x * r.a + s.y * r.b;
}

// V of one sample: 0 or 1, or what blended surfaces let through.
float share_seen(RayReceiver r, vec3 direction)
{
    float limit = LIGHT_TYPE == PEN_TRACE_SUN ? 1e30 : RAY_END;
#ifdef ALPHA
    ray_share = 1.0;
    return bvh_occluded(r.origin, direction, limit, ray.size.z) ? 0.0 : ray_share;
#else
    return bvh_occluded(r.origin, direction, limit, ray.size.z) ? 0.0 : 1.0;
#endif
}
