// The receiver's horizon cuts the light. Irradiance is clipped there, so visibility is the mean over
// the part above it; where little is left that mean would rest on a few points, while irradiance is
// next to nothing, and visibility fades to 0 instead.
float horizon_weight(float share)
{
    return max(share, 0.25);
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
    // Share of a square above a line: with a >= b >= 0 the trapezoid's integral over one axis of the
    // clamped linear ramp along the other, (F(c + b) - F(c - b)) / (4 a b), F the ramp's integral.
    float a = max(abs(g.x), abs(g.y)), b = max(min(abs(g.x), abs(g.y)), 1e-4 * a);
    // All above or all below; the difference of integrals would cancel to nothing there.
    if (abs(c) >= a + b)
        return c > 0.0 ? 1.0 : 0.0;
    vec2 t = clamp(vec2(c + b, c - b), -a, a);
    // F(x) = integral from -a of clamp(x + a, 0, 2a): quadratic inside, linear beyond.
    vec2 f = 0.5 * (t + a) * (t + a) + 2.0 * a * max(vec2(c + b, c - b) - a, 0.0);
    return clamp((f.x - f.y) / (4.0 * a * b), 0.0, 1.0);
}
