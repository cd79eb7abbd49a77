// Irradiance at p (normal n) of emitters of unit radiance, all in world space, in closed form.

// Lambert's formula, one edge between unit vectors a and b: its angle times the normal's component.
float edge_integral(vec3 a, vec3 b, vec3 n)
{
    vec3 x = cross(a, b);
    float s = length(x);
    return s > 1e-7 ? dot(x, n) * atan(s, dot(a, b)) / s : 0.0;
}

// Adds the edge a-b clipped at the horizon; remembers where the polygon leaves and enters.
void add_edge(vec3 a, vec3 b, vec3 n, inout float sum, inout vec3 leave, inout vec3 enter)
{
    float da = dot(a, n), db = dot(b, n);
    if (da <= 0.0 && db <= 0.0)
        return;
    if (da < 0.0)
        enter = a = a + (b - a) * (da / (da - db));
    if (db < 0.0)
        leave = b = a + (b - a) * (da / (da - db));
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
    vec3 c = center - p, leave = vec3(0.0), enter = vec3(0.0);
    vec3 a = c - half_x - half_y, b = c + half_x - half_y;
    vec3 d = c + half_x + half_y, e = c - half_x + half_y;
    float sum = 0.0;
    add_edge(a, b, n, sum, leave, enter);
    add_edge(b, d, n, sum, leave, enter);
    add_edge(d, e, n, sum, leave, enter);
    add_edge(e, a, n, sum, leave, enter);
    return close_polygon(sum, leave, enter, n);
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
