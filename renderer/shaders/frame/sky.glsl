// A photographer's studio around the scene, in closed form: a gradient that is quadratic in the
// height of the direction, and soft boxes (spherical Gaussians) that metals and lacquer show. All
// of it scales with shade.sky_level, which follows the radiance that the lights give to what they
// reach.
const float sky_sharpness[SKY_BOXES] = float[](9.0, 26.0);

// Mean over the cosine-weighted hemisphere around n. The factors of the zonal bands are Ramamoorthi
// and Hanrahan's (2001): 1, 2/3 and 1/4. A soft box adds its flux times its cosine.
vec3 sky_diffuse(vec3 n)
{
    float e = shade.sky_gradient.x + shade.sky_gradient.z / 3.0 +
              (2.0 / 3.0) * shade.sky_gradient.y * n.y +
              0.25 * shade.sky_gradient.z * (n.y * n.y - 1.0 / 3.0);
    for (int i = 0; i < SKY_BOXES; i++) {
        float cosine = 0.5 + 0.5 * dot(n, shade.sky_box[i].xyz);
        e += shade.sky_box[i].w * (2.0 / sky_sharpness[i]) * cosine * cosine;
    }
    return vec3(max(e, 0.0) * shade.sky_level.x);
}

// What is mirrored is brighter than what lights: a studio's walls are lit for metals to show, and
// kept off the rest.
const float sky_mirrored = 2.0;

// What a mirror at p shows in direction r: a floor that is lit around the subject, a dark horizon,
// and walls that are lit upwards. Where on the floor a reflection ends gives flat faces a gradient.
float sky_mirror(vec3 p, vec3 r, float blur)
{
    float reach = max(view.ground.w, 1e-9) / 12.0; // the radius of what stands there
    float far = max(p.y - view.ground.y, 0.0) / max(-r.y, 1e-3);
    vec2 q = p.xz - view.ground.xz + r.xz * far;
    float floor_light = mix(0.22, 0.7, exp(-dot(q, q) / (9.0 * reach * reach)));
    float wall_light = mix(0.16, 0.95, smoothstep(0.0, 0.6, r.y));
    return mix(floor_light, wall_light, smoothstep(-blur, blur, r.y));
}

// Mean over the lobe of a surface of squared roughness a at p, around its mirror direction r. The
// lobe is a spherical Gaussian of this sharpness (Wang et al. 2009), and the product of two is one
// again.
vec3 sky_specular(vec3 p, vec3 r, float a)
{
    float lobe = 0.5 / (a * a + 1e-4), narrow = lobe / (1.0 + lobe);
    float e = shade.sky_gradient.x + shade.sky_gradient.z / 3.0 +
              narrow * shade.sky_gradient.y * r.y +
              narrow * narrow * narrow * shade.sky_gradient.z * (r.y * r.y - 1.0 / 3.0);
    e *= sky_mirrored;
    if (a < 0.5)
        e = mix(sky_mirror(p, r, 0.02 + a), e, smoothstep(0.0, 0.5, a));
    for (int i = 0; i < SKY_BOXES; i++) {
        float share = lobe / (lobe + sky_sharpness[i]);
        e += shade.sky_box[i].w * share *
             exp(sky_sharpness[i] * share * (dot(r, shade.sky_box[i].xyz) - 1.0));
    }
    return vec3(max(e, 0.0) * shade.sky_level.x);
}

// What a surface of this roughness reflects of a uniform unit environment: Karis' fit (2014) of the
// split sum's second factor.
vec3 sky_reflectance(vec3 f0, float roughness, float nv)
{
    vec4 r = roughness * vec4(-1.0, -0.0275, -0.572, 0.022) + vec4(1.0, 0.0425, 1.04, -0.04);
    float x = min(r.x * r.x, exp2(-9.28 * nv)) * r.x + r.y;
    vec2 scale = vec2(-1.04, 1.04) * x + r.zw;
    return f0 * scale.x + scale.y;
}

// What lies behind everything: a sweep of paper that darkens upwards.
vec3 sky_backdrop(float height)
{
    return vec3(mix(0.44, 0.22, smoothstep(-0.1, 0.75, height)) * shade.sky_level.y);
}
