// What moments of depth say about the share of blockers. Pure algebra: no light, no texture.

// Chebyshev's one-sided inequality (Donnelly and Lauritzen 2006): an upper bound of the share of
// depths >= t, exact when the depths are those of two planes of which t is the farther. m: mean and
// mean square.
float chebyshev(vec2 m, float t, float least_variance)
{
    float variance = max(m.y - m.x * m.x, least_variance), d = t - m.x;
    return d <= 0.0 ? 1.0 : variance / (variance + d * d);
}

// Cuts the share of light that a bound lets through wrongly (light bleeding).
float reduce_bleeding(float v, float k)
{
    return clamp((v - k) / (1.0 - k), 0.0, 1.0);
}

// The exponential warps of Lauritzen's EVSM of depth z in [-1, 1].
vec2 exponential_warp(float z, vec2 exponents)
{
    return vec2(exp(exponents.x * z), -exp(-exponents.y * z));
}

// Four moments of z in [-1, 1] to four numbers in [0, 1] of similar spread, linear in the moments,
// so that few bits are lost when they are stored as integers (Peters 2017).
vec4 moments_pack(vec4 b)
{
    return vec4(1.5 * b.x - 2.0 * b.z + 0.5, 4.0 * (b.y - b.w),
        0.8660254 * b.x - 0.38490018 * b.z + 0.5, 0.5 * (b.y + b.w));
}

vec4 moments_unpack(vec4 p)
{
    vec2 odd = p.xz - 0.5;
    return vec4(-0.33333333 * odd.x + 1.7320508 * odd.y, 0.125 * p.y + p.w,
        -0.75 * odd.x + 1.2990381 * odd.y, -0.125 * p.y + p.w);
}

// Moves the moments towards those of a spread-out distribution, so that rounding does not make them
// moments of nothing at all.
vec4 moments_bias(vec4 b, float share)
{
    return mix(b, vec4(0.0, 0.375, 0.0, 0.375), share);
}

// The distribution on three depths, one of them t, that has the moments b: the Hamburger problem of
// Peters and Klein 2015. Its share of depths < t is the least that these moments allow.
struct ThreeDepths {
    vec2 z, weight; // besides t itself, ascending
};

ThreeDepths three_depths(vec4 b, float t)
{
    // Cholesky factors L D L^T of the Hankel matrix (1 b1 b2; b1 b2 b3; b2 b3 b4), then
    // c = B^-1 (1, t, t^2).
    float l21 = b.x, l31 = b.y;
    float d2 = max(b.y - b.x * b.x, 1e-12);
    float l32d2 = b.z - b.x * b.y, l32 = l32d2 / d2;
    float d3 = max(b.w - b.y * b.y - l32d2 * l32, 1e-12);
    vec3 c = vec3(1.0, t, t * t);
    c.y -= l21 * c.x;
    c.z -= l31 * c.x + l32 * c.y;
    c.y /= d2;
    c.z /= d3;
    c.y -= l32 * c.z;
    c.x -= l21 * c.y + l31 * c.z;
    // The other depths are the roots of c0 + c1 z + c2 z^2.
    float p = 0.5 * c.y, root = sqrt(max(p * p - c.x * c.z, 0.0));
    float q = -(p + (p < 0.0 ? -root : root));
    float z1 = abs(c.z) > 1e-20 ? q / c.z : 1e6;
    float z2 = abs(q) > 1e-20 ? c.x / q : 1e6;
    ThreeDepths r;
    r.z = vec2(min(z1, z2), max(z1, z2));
    // Lagrange's polynomial that is 1 at one depth and 0 at the other two, its mean under b.
    r.weight = vec2((b.y - (t + r.z.y) * b.x + t * r.z.y) / ((r.z.x - t) * (r.z.x - r.z.y)),
        (b.y - (t + r.z.x) * b.x + t * r.z.x) / ((r.z.y - t) * (r.z.y - r.z.x)));
    r.weight = clamp(r.weight, 0.0, 1.0);
    return r;
}

// Share of depths < t, at least; exact for up to two depths besides t.
float moment_shadow(vec4 b, float t)
{
    ThreeDepths r = three_depths(b, t);
    return clamp(dot(r.weight, vec2(lessThan(r.z, vec2(t)))), 0.0, 1.0);
}

// x: the same share; y: mean depth of what lies before t, pulled to t by `pull` where little does.
vec2 moment_blockers(vec4 b, float t, float pull)
{
    ThreeDepths r = three_depths(b, t);
    vec2 w = r.weight * vec2(lessThan(r.z, vec2(t)));
    float sum = w.x + w.y;
    return vec2(min(sum, 1.0), (dot(w, r.z) + pull * t) / (sum + pull));
}
