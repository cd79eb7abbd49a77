// Irradiance at p (normal n) of emitters of unit radiance, all in world space, in closed form.

// Angle over sine of an edge whose ends have this cosine: least-squares polynomial, error 1.6e-4 of
// the factor, and exact relative to 2e-4 for lights of any size since it multiplies every edge.
float angle_over_sine(float cosine)
{
    float x = abs(cosine);
    float f = 1.5706395 + x * (-0.9914837 + x * (0.7078825 + x * (-0.3954492 + x * 0.1085248)));
    return cosine >= 0.0 ? f : 3.14159265 * inversesqrt(max(1.0 - x * x, 1e-7)) - f;
}

// Lambert's formula, one edge between unit vectors a and b: its angle times the component of its
// plane's normal along n.
float edge_integral(vec3 a, vec3 b, vec3 n)
{
    return dot(cross(a, b), n) * angle_over_sine(clamp(dot(a, b), -1.0, 1.0));
}

// Adds the edge a-b clipped at the horizon; remembers where the polygon leaves and enters.
void add_edge(vec3 a, vec3 b, vec3 n, inout float sum, inout vec3 leave, inout vec3 enter)
{
    float da = dot(a, n), db = dot(b, n);
    if (da <= 0.0 && db <= 0.0)
        return;
    vec3 cut = a + (b - a) * (da / (da - db));
    if (da < 0.0)
        enter = a = cut;
    if (db < 0.0)
        leave = b = cut;
    sum += edge_integral(normalize(a), normalize(b), n);
}

float close_polygon(float sum, vec3 leave, vec3 enter, vec3 n)
{
    if (leave != vec3(0.0) && enter != vec3(0.0))
        sum += edge_integral(normalize(leave), normalize(enter), n);
    return 0.5 * abs(sum);
}

float irradiance_rect(vec3 p, vec3 n, vec3 center, vec3 half_x, vec3 half_y)
{
    vec3 to = center - p;
    vec3 a = to - half_x - half_y, b = to + half_x - half_y;
    vec3 c = to + half_x + half_y, d = to - half_x + half_y;
    float low = min(min(dot(a, n), dot(b, n)), min(dot(c, n), dot(d, n)));
    vec3 ua = normalize(a), ub = normalize(b), uc = normalize(c), ud = normalize(d);
    float e = 0.5 * abs(edge_integral(ua, ub, n) + edge_integral(ub, uc, n) +
        edge_integral(uc, ud, n) + edge_integral(ud, ua, n));
    // Clipping runs as a loop of dynamic length: software rasterisers skip it where no lane needs it.
    int clipped = low < 0.0 ? 1 : 0;
    for (int i = 0; i < clipped; i++) {
        vec3 leave = vec3(0.0), enter = vec3(0.0);
        float sum = 0.0;
        add_edge(a, b, n, sum, leave, enter);
        add_edge(b, c, n, sum, leave, enter);
        add_edge(c, d, n, sum, leave, enter);
        add_edge(d, a, n, sum, leave, enter);
        e = close_polygon(sum, leave, enter, n);
    }
    return e;
}

// A disk as the regular polygon of the same area.
float irradiance_disk(vec3 p, vec3 n, vec3 center, vec3 half_x, vec3 half_y)
{
    const int sides = 12;
    const float widen = sqrt(3.14159265 / (0.5 * float(sides) * sin(6.2831853 / float(sides))));
    vec3 c = center - p, leave = vec3(0.0), enter = vec3(0.0), from = c + widen * half_x;
    float sum = 0.0;
    for (int i = 1; i <= sides; i++) {
        float t = 6.2831853 * float(i) / float(sides);
        vec3 to = c + widen * (cos(t) * half_x + sin(t) * half_y);
        add_edge(from, to, n, sum, leave, enter);
        from = to;
    }
    return close_polygon(sum, leave, enter, n);
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
