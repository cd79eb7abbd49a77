// The receiver's horizon cuts the light. Irradiance is clipped there, so visibility is the mean
// over the part above it; where little is left that mean would rest on a few points, while
// irradiance is next to nothing, and visibility fades to 0 instead.
float horizon_weight(float share)
{
    return max(share, 0.25);
}

// The same for a mean over that part alone.
float horizon_fade(float share)
{
    return min(4.0 * share, 1.0);
}

// Share of the emitter's area above the plane of the receiver p with normal n, in closed form. The
// signed height of emitter point (x, y) is linear: c + g.x x + g.y y with x, y in [-1, 1].
float horizon_share(vec3 p, vec3 n)
{
    vec2 g = n.xy * light.extent;
    float c = light_parallel ? -n.z : -dot(n, p);
    if (light_shape == SHAPE_DISK) { // a circular segment
        float u = clamp(c / max(length(g), 1e-20), -1.0, 1.0);
        return 0.5 + (u * sqrt(max(1.0 - u * u, 0.0)) + asin(u)) / 3.14159265;
    }
    // Share of a square above a line: with a >= b >= 0 the trapezoid's integral over one axis of
    // the clamped linear ramp along the other, (F(c + b) - F(c - b)) / (4 a b), F the ramp's
    // integral.
    float a = max(abs(g.x), abs(g.y)), b = max(min(abs(g.x), abs(g.y)), 1e-4 * a);
    // All above or all below; the difference of integrals would cancel to nothing there.
    if (abs(c) >= a + b)
        return c > 0.0 ? 1.0 : 0.0;
    vec2 t = clamp(vec2(c + b, c - b), -a, a);
    // F(x) = integral from -a of clamp(x + a, 0, 2a): quadratic inside, linear beyond.
    vec2 f = 0.5 * (t + a) * (t + a) + 2.0 * a * max(vec2(c + b, c - b) - a, 0.0);
    return clamp((f.x - f.y) / (4.0 * a * b), 0.0, 1.0);
}

// What tells blockers from the receiver's own surface where the receiver turns its back to the
// light's centre: from there its plane is seen from behind, and what may block lies beyond it.
// Otherwise everything is beyond.
struct HorizonBack {
    float depth;   // hardware depth
    vec2 gradient; // per metre on the map plane
};

HorizonBack horizon_back(vec3 p, vec3 n, float bias)
{
    float facing = light_parallel ? -n.z : -dot(n, p), range = light.far_z - light.near_z;
    if (facing > 0.0)
        return HorizonBack(-1e30, vec2(0.0));
    vec2 slope = light_parallel ? n.xy / max(-facing, 0.02)
                                : light.far_z * n.xy / max(-facing, 0.02 * length(p));
    return HorizonBack(light_depth(p.z) + bias, -slope / range);
}

float back_depth(HorizonBack back, vec2 offset)
{
    return back.depth + dot(back.gradient, offset);
}

// The horizon as a line across the emitter: its point e in [-1, 1]^2 is above where the result is
// positive.
float horizon_height(vec3 p, vec3 n, vec2 e)
{
    return (light_parallel ? -n.z : -dot(n, p)) + dot(n.xy, e * light.extent);
}
