// Irradiance at p (normal n) of emitters of unit radiance, all in world space, in closed form.

// Angle over sine of an edge whose ends have this cosine, for angles up to 90 degrees:
// least-squares polynomial, error 1.6e-4 of the factor, and exact relative to 2e-4 for lights of
// any size since it multiplies every edge.
float angle_over_sine_acute(float x)
{
    return 1.5706395 + x * (-0.9914837 + x * (0.7078825 + x * (-0.3954492 + x * 0.1085248)));
}

float angle_over_sine(float cosine)
{
    float x = abs(cosine), f = angle_over_sine_acute(x);
    return cosine >= 0.0 ? f : 3.14159265 * inversesqrt(max(1.0 - x * x, 1e-7)) - f;
}

// Lambert's formula, one edge from a to b: its angle times the component of its plane's normal
// along n. One root serves both ends.
float edge_integral(vec3 a, vec3 b, vec3 n)
{
    float r = inversesqrt(max(dot(a, a) * dot(b, b), 1e-30));
    return dot(cross(a, b), n) * r * angle_over_sine(clamp(dot(a, b) * r, -1.0, 1.0));
}

// The edge a-b without its part below the horizon; remembers where the polygon leaves and enters.
// Selections instead of branches: software rasterisers run both sides of a branch anyway.
float clipped_edge(vec3 a, vec3 b, float da, float db, vec3 n, inout vec3 leave, inout vec3 enter)
{
    float across = da - db;
    vec3 cut = a + (b - a) * (da / (abs(across) > 1e-20 ? across : 1e-20));
    leave = da >= 0.0 && db < 0.0 ? cut : leave;
    enter = da < 0.0 && db >= 0.0 ? cut : enter;
    float e = edge_integral(da < 0.0 ? cut : a, db < 0.0 ? cut : b, n);
    return max(da, db) < 0.0 ? 0.0 : e;
}

// Most receivers see the whole rectangle above their horizon and its edges under less than 90
// degrees. Opposite edges then share their plane's normal, all dot products are linear in the
// corner's signs, and Lambert's formula needs four roots. The rest goes edge by edge: software
// rasterisers run the first round of a loop, like both sides of a branch, for all pixels, but no
// more than that where none needs it. The fifth edge closes the cut along the horizon.
float irradiance_rect(vec3 p, vec3 n, vec3 center, vec3 half_x, vec3 half_y)
{
    vec3 to = center - p, nx = cross(half_x, n), ny = cross(half_y, n);
    vec2 size2 = vec2(dot(half_x, half_x), dot(half_y, half_y));
    vec4 length2 = dot(to, to) + size2.x + size2.y +
                   2.0 * dot(to, half_x) * vec4(-1.0, 1.0, 1.0, -1.0) +
                   2.0 * dot(to, half_y) * vec4(-1.0, -1.0, 1.0, 1.0); // of corners a, b, c, d
    vec4 inverse = inversesqrt(max(length2, 1e-30));
    // Cosines of the edges ab, bc, cd, da, times both lengths.
    vec4 products = 0.5 * (length2 + length2.yzwx) - 2.0 * size2.xyxy;
    float turn = dot(cross(half_x, half_y), n);
    vec4 moments = 2.0 * (vec4(1.0, 1.0, -1.0, -1.0) * vec2(dot(to, nx), dot(to, ny)).xyxy + turn);
    vec4 roots = inverse * inverse.yzwx, sum = vec4(0.0);
    for (int i = 0; i < 4; i++)
        sum[i] = moments[i] * roots[i] * angle_over_sine_acute(min(products[i] * roots[i], 1.0));
    float e = 0.5 * abs(sum.x + sum.y + sum.z + sum.w);
    float height = dot(to, n), reach = abs(dot(half_x, n)) + abs(dot(half_y, n));
    bool above = height > -reach;
    int edges = above && (height < reach || any(lessThan(products, vec4(0.0)))) ? 5 : 0;
    vec3 leave = vec3(0.0), enter = vec3(0.0);
    float clipped = 0.0;
    vec2 from = vec2(-1.0);
    for (int i = 0; i < edges; i++) {
        vec2 next = vec2(-from.y, from.x);
        vec3 a = i == 4 ? leave : to + from.x * half_x + from.y * half_y;
        vec3 b = i == 4 ? enter : to + next.x * half_x + next.y * half_y;
        float above_a = i == 4 ? 0.0 : dot(a, n), above_b = i == 4 ? 0.0 : dot(b, n);
        clipped += clipped_edge(a, b, above_a, above_b, n, leave, enter);
        from = next;
    }
    return !above ? 0.0 : edges > 0 ? 0.5 * abs(clipped) : e;
}

// A disk as the regular polygon of the same area.
float irradiance_disk(vec3 p, vec3 n, vec3 center, vec3 half_x, vec3 half_y)
{
    const int sides = 12;
    const float widen = sqrt(3.14159265 / (0.5 * float(sides) * sin(6.2831853 / float(sides))));
    vec3 c = center - p, leave = vec3(0.0), enter = vec3(0.0), from = c + widen * half_x;
    float sum = 0.0, below = dot(from, n);
    for (int i = 1; i <= sides; i++) {
        float t = 6.2831853 * float(i) / float(sides);
        vec3 to = c + widen * (cos(t) * half_x + sin(t) * half_y);
        float above = dot(to, n);
        sum += clipped_edge(from, to, below, above, n, leave, enter);
        from = to;
        below = above;
    }
    return 0.5 * abs(sum + edge_integral(leave, enter, n));
}

// A sphere, with the part below the horizon cut (Snyder 1996, area light sources).
float irradiance_sphere(vec3 p, vec3 n, vec3 center, float radius)
{
    vec3 c = center - p;
    float distance = length(c), cosine = dot(n, c) / distance;
    float h = max(distance / radius, 1.0001), h2 = h * h, k = 1.0 - h2 * cosine * cosine;
    if (k <= 0.0)
        return 3.14159265 * max(cosine, 0.0) / h2;
    float sine2 = max(1.0 - cosine * cosine, 1e-6);
    float inner = clamp(-cosine * sqrt((h2 - 1.0) / sine2), -1.0, 1.0);
    float partial = (cosine * acos(inner) - sqrt(k * (h2 - 1.0))) / h2 + atan(sqrt(k / (h2 - 1.0)));
    return max(partial, 0.0);
}
