// The penumbra of a receiver in pixels. A blocker's depth gives the light's image on the map plane
// (F3); the receiver's own plane carries it over to the screen, whatever its tilt to camera or
// light.

// Columns: change of the pixel position per metre along x and y of the map plane, on the surface.
mat2 pixels_per_map(Surface s)
{
    mat4 m = light.clip_to_light;
    vec2 ndc = pixel_to_ndc(s.pixel), step = vec2(2.0, -2.0) * view.viewport.zw;
    // On a plane depth is linear over the screen. Seen edge-on, the slope is bounded.
    vec4 h = vec4(s.n, -dot(s.n, s.p)) * m;
    vec2 most = vec2(0.2 * s.depth);
    vec2 slope = clamp(-h.xy * step / (abs(h.z) > 1e-20 ? h.z : 1e-20), -most, most);
    float w = m[0].w * ndc.x + m[1].w * ndc.y + m[2].w * s.depth + m[3].w;
    vec4 cx = m[0] * step.x + m[2] * slope.x, cy = m[1] * step.y + m[2] * slope.y;
    vec3 dx = (cx.xyz - s.p * cx.w) / w, dy = (cy.xyz - s.p * cy.w) / w; // m per pixel
    if (light.parallel == 0) {
        float ratio = light.near_z / s.p.z;
        vec2 ray = s.p.xy / s.p.z;
        dx.xy = (dx.xy - ray * dx.z) * ratio;
        dy.xy = (dy.xy - ray * dy.z) * ratio;
    }
    float det = dx.x * dy.y - dy.x * dx.y, least = max(0.01 * length(dx.xy) * length(dy.xy), 1e-30);
    det = det < 0.0 ? min(det, -least) : max(det, least);
    return mat2(dy.y, -dx.y, -dy.x, dx.x) / det;
}

// The covariance of a Gaussian with deviations `sigma` along the map's axes, as two filters along a
// line: deviation s1 along (1, 0), then s2 along (skew, 1) (Geusebroek et al. 2003). Returns
// (s1, skew, s2) in pixels, shrunk to deviations of at most `most`.
vec3 screen_spread(mat2 pixels, vec2 sigma, float most)
{
    vec2 u = pixels[0] * sigma.x, v = pixels[1] * sigma.y;
    float xx = u.x * u.x + v.x * v.x, xy = u.x * u.y + v.x * v.y, yy = u.y * u.y + v.y * v.y;
    float shrink = min(1.0, most * most / max(max(xx, yy), 1e-20));
    float skew = yy > 1e-12 ? clamp(xy / yy, -1000.0, 1000.0) : 0.0;
    return vec3(sqrt(max(xx - skew * xy, 0.0) * shrink), skew, sqrt(yy * shrink));
}
