// Share of the emitter (the square [-1, 1]^2 or the unit disk) inside an axis-aligned rectangle.

// Integral of sqrt(1 - t^2) from 0 to x.
vec2 chord_integral(vec2 x)
{
    return 0.5 * (x * sqrt(max(1.0 - x * x, 0.0)) + asin(x));
}

// Area of the disk between the axis y = 0 and the height y, over x.x .. x.y (negative below); f is
// chord_integral(x). Sums of neighbours cancel whatever the precision of asin: no seams.
float disk_strip(vec2 x, vec2 f, float y)
{
    y = clamp(y, -1.0, 1.0);
    float k = sqrt(max(1.0 - y * y, 0.0)); // beyond +-k the disk is lower than y
    float end = chord_integral(vec2(k)).x;
    vec2 inner = clamp(x, -k, k);
    vec2 outer = mix(f - sign(x) * end, vec2(0.0), lessThanEqual(abs(x), vec2(k)));
    vec2 area = abs(y) * inner + outer;
    return sign(y) * (area.y - area.x);
}

// Negative when one side of the rectangle is turned round.
float emitter_share(vec2 low, vec2 high)
{
    low = clamp(low, -1.0, 1.0);
    high = clamp(high, -1.0, 1.0);
    if (light_shape == SHAPE_DISK) {
        vec2 x = vec2(low.x, high.x), f = chord_integral(x);
        return (disk_strip(x, f, high.y) - disk_strip(x, f, low.y)) * (1.0 / 3.14159265);
    }
    return 0.25 * (high.x - low.x) * (high.y - low.y);
}
