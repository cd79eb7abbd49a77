#include "renderer/light.h"
#include <cglm/cglm.h>
#include <string.h>

/* Beyond this slope from the axis a map has no useful resolution, and a Lambertian emitter little
 * light: tan 80 degrees. */
#define MAX_SLOPE 5.67f

static void make_axes(const float direction[3], const float up[3], float x[3], float y[3], float z[3])
{
    glm_vec3_normalize_to((float *)direction, z);
    glm_vec3_cross((float *)up, z, x);
    if (glm_vec3_norm(x) < 1e-4f * fmaxf(glm_vec3_norm((float *)up), 1e-20f)) {
        float other[3] = {0, 0, 0};
        other[fabsf(z[2]) < 0.9f ? 2 : 0] = 1;
        glm_vec3_cross(other, z, x);
    }
    glm_vec3_normalize(x);
    glm_vec3_cross(z, x, y);
}

static void set_axes(struct light_face *f, const float o[3], const float x[3], const float y[3],
    const float z[3])
{
    mat4 m = {{x[0], y[0], z[0], 0}, {x[1], y[1], z[1], 0}, {x[2], y[2], z[2], 0},
        {-glm_vec3_dot((float *)x, (float *)o), -glm_vec3_dot((float *)y, (float *)o),
            -glm_vec3_dot((float *)z, (float *)o), 1}};
    memcpy(f->world_to_light, m, sizeof m);
}

static void bounds_corner(const struct scene *scene, int i, float corner[3])
{
    const struct psc_header *h = scene->blob.header;
    for (int k = 0; k < 3; k++)
        corner[k] = i >> k & 1 ? h->bounds_max[k] : h->bounds_min[k];
}

static void light_corner(const struct light_face *f, const struct scene *scene, int i, float c[3])
{
    float world[3];
    bounds_corner(scene, i, world);
    glm_mat4_mulv3((vec4 *)f->world_to_light, world, 1, c);
}

/* Nearest and farthest z of the meshlets in front of the light: tighter than the bounds' corners,
 * and the only thing that says something when the light is inside the bounds. */
static void meshlet_range(const struct light_face *f, const struct scene *scene, float *near_z,
    float *far_z)
{
    *near_z = INFINITY, *far_z = 0;
    for (uint32_t i = 0; i < scene->blob.instance_count; i++) {
        const struct psc_instance *instance = &scene->blob.instances[i];
        const struct psc_primitive *p = &scene->blob.primitives[instance->primitive];
        mat4 world = GLM_MAT4_IDENTITY_INIT, m;
        for (int row = 0; row < 3; row++)
            for (int column = 0; column < 4; column++)
                world[column][row] = instance->world[4 * row + column];
        glm_mat4_mul((vec4 *)f->world_to_light, world, m);
        float scale = sqrtf(fmaxf(glm_vec3_norm2(world[0]),
            fmaxf(glm_vec3_norm2(world[1]), glm_vec3_norm2(world[2]))));
        /* One direction is enough: the z row of the matrix gives the exact extent along z. */
        float z_scale = sqrtf(m[0][2] * m[0][2] + m[1][2] * m[1][2] + m[2][2] * m[2][2]);
        for (uint32_t k = 0; k < p->meshlet_count; k++) {
            const struct psc_meshlet *meshlet = &scene->blob.meshlets[p->first_meshlet + k];
            float z = m[0][2] * meshlet->center[0] + m[1][2] * meshlet->center[1] +
                m[2][2] * meshlet->center[2] + m[3][2];
            float r = fminf(scale, z_scale) * meshlet->radius;
            if (z + r <= 0)
                continue;
            *near_z = fminf(*near_z, z - r);
            *far_z = fmaxf(*far_z, z + r);
        }
    }
}

static void fit_range(struct light_face *f, const struct scene *scene)
{
    float corner_min = INFINITY, corner_max = -INFINITY, near_z, far_z;
    for (int i = 0; i < 8; i++) {
        float c[3];
        light_corner(f, scene, i, c);
        corner_min = fminf(corner_min, c[2]);
        corner_max = fmaxf(corner_max, c[2]);
    }
    meshlet_range(f, scene, &near_z, &far_z);
    near_z = fmaxf(near_z, corner_min);
    far_z = fminf(far_z, corner_max);
    if (scene_is_empty(scene) || !(far_z > 0))
        near_z = 0.5f, far_z = 1;
    /* Nearer casters are kept by depth clamping, at the near plane's depth. */
    f->far_z = far_z * 1.001f + 1e-6f;
    float least = f->parallel ? -INFINITY : fmaxf(f->far_z * 1e-3f, 1e-5f);
    f->near_z = fminf(fmaxf(near_z * (near_z > 0 ? 0.999f : 1.001f), least), 0.999f * f->far_z);
}

void light_face_window(const struct light_face *f, const struct scene *scene,
    const float sample[2], float rect[4])
{
    float n = f->near_z;
    rect[0] = rect[1] = INFINITY;
    rect[2] = rect[3] = -INFINITY;
    float corners[8][3];
    for (int i = 0; i < 8; i++)
        light_corner(f, scene, i, corners[i]);
    for (int i = 0; i < 8; i++)
        for (int axis = 0; axis < 3; axis++) {
            /* Every edge once, clipped to z >= n, both ends projected. */
            if (i >> axis & 1)
                continue;
            const float *a = corners[i], *b = corners[i | 1 << axis];
            for (int end = 0; end < 2; end++) {
                const float *p = end ? b : a, *q = end ? a : b;
                float c[3] = {p[0], p[1], p[2]};
                if (!f->parallel && c[2] < n) {
                    if (q[2] <= n)
                        continue;
                    float t = (n - c[2]) / (q[2] - c[2]);
                    for (int k = 0; k < 3; k++)
                        c[k] += t * (q[k] - c[k]);
                    c[2] = n;
                }
                for (int k = 0; k < 2; k++) {
                    float at = f->parallel ? c[k] + sample[k] * c[2]
                                           : sample[k] + (c[k] - sample[k]) * n / c[2];
                    rect[k] = fminf(rect[k], at);
                    rect[2 + k] = fmaxf(rect[2 + k], at);
                }
            }
        }
    float slope = f->cube ? 1 : f->cone_cos > 0 ? tanf(acosf(f->cone_cos)) : MAX_SLOPE;
    for (int k = 0; k < 2; k++) {
        if (!(rect[k] < rect[2 + k]))
            rect[k] = -1e-3f, rect[2 + k] = 1e-3f;
        if (!f->parallel) {
            /* A cube face also serves the filter windows that reach over its border. */
            float reach = slope * n + (f->cube ? 1.02f * f->half[k] + 0.02f * n : 0);
            rect[k] = fmaxf(rect[k], sample[k] - reach);
            rect[2 + k] = fminf(rect[2 + k], sample[k] + reach);
            if (!(rect[k] < rect[2 + k]))
                rect[k] = sample[k] - 1e-3f * n, rect[2 + k] = sample[k] + 1e-3f * n;
        }
        /* Two texels of a small map around it, so that no caster touches the border. */
        float margin = (rect[2 + k] - rect[k]) / 256;
        rect[k] -= margin;
        rect[2 + k] += margin;
    }
}

void light_face_clip(
    const struct light_face *f, const float sample[2], const float rect[4], mat4 m)
{
    float n = f->near_z, r = f->far_z;
    float w = rect[2] - rect[0], h = rect[3] - rect[1];
    float cx = rect[0] + rect[2], cy = rect[1] + rect[3];
    glm_mat4_zero(m);
    if (f->parallel) {
        m[0][0] = 2 / w, m[1][1] = 2 / h;
        m[2][0] = 2 * sample[0] / w, m[2][1] = 2 * sample[1] / h;
        m[2][2] = 1 / (r - n);
        m[3][0] = -cx / w, m[3][1] = -cy / h, m[3][2] = -n / (r - n), m[3][3] = 1;
        return;
    }
    /* Map position l = s + (p - s) n / z; ndc = (2 l - (min + max)) / size; depth as usual. */
    m[0][0] = 2 * n / w, m[1][1] = 2 * n / h;
    m[2][0] = (2 * sample[0] - cx) / w, m[2][1] = (2 * sample[1] - cy) / h;
    m[3][0] = -2 * n * sample[0] / w, m[3][1] = -2 * n * sample[1] / h;
    m[2][2] = r / (r - n), m[3][2] = -r * n / (r - n);
    m[2][3] = 1;
}

void light_face_cull(const struct light_face *f, const float sample[2], const float rect[4],
    struct cull_view *cull)
{
    mat4 clip, inverse;
    memset(cull, 0, sizeof *cull);
    light_face_clip(f, sample, rect, clip);
    glm_mat4_mul(clip, (vec4 *)f->world_to_light, cull->world_to_clip);
    /* world_to_light is rigid, so its inverse is exact enough for an eye point. */
    glm_mat4_inv((vec4 *)f->world_to_light, inverse);
    float eye[3] = {sample[0], sample[1], 0};
    if (f->parallel) /* light travels along (-t, 1): see techniques' F2 for a parallel light */
        eye[0] = -sample[0], eye[1] = -sample[1], eye[2] = 1;
    glm_mat4_mulv3(inverse, eye, f->parallel ? 0 : 1, cull->eye);
    if (f->parallel)
        glm_vec3_normalize(cull->eye);
    cull->parallel = f->parallel;
    cull->cull_back = true;
}

static void fit_face(struct light_face *f, const struct scene *scene)
{
    static const float center[2] = {0, 0};
    fit_range(f, scene);
    light_face_window(f, scene, center, f->rect);
}

static void init_face(struct light_face *f, const struct pen_light *source)
{
    memset(f, 0, sizeof *f);
    f->cone_cos = -1;
    f->omni = source->type == PEN_LIGHT_POINT || source->type == PEN_LIGHT_SPHERE;
    for (int i = 0; i < 4; i++)
        f->emission_mean[i] = 1;
    switch (source->type) {
    case PEN_LIGHT_RECT:
        f->half[0] = 0.5f * source->width, f->half[1] = 0.5f * source->height;
        break;
    case PEN_LIGHT_DISK:
    case PEN_LIGHT_SPHERE:
        f->shape = LIGHT_DISK;
        f->half[0] = f->half[1] = source->radius;
        break;
    case PEN_LIGHT_SUN:
        f->shape = LIGHT_DISK;
        f->parallel = 1;
        f->half[0] = f->half[1] = tanf(0.5f * glm_rad(source->angular_diameter_deg));
        break;
    case PEN_LIGHT_SPOT:
        f->cone_cos = cosf(glm_rad(source->outer_cone_deg));
        break;
    default:
        break;
    }
}

/* Radiance of an emitter of Lambertian faces; intensity or irradiance where it has no area. */
static void set_radiance(struct light *light)
{
    const struct pen_light *s = light->source;
    float value = s->radiance;
    if (s->type == PEN_LIGHT_SUN) {
        value = s->irradiance;
    } else if (s->type == PEN_LIGHT_POINT) {
        value = s->power_w / (4 * GLM_PIf);
    } else if (s->type == PEN_LIGHT_SPOT) {
        /* Flux of a cone whose intensity falls off smoothly between the two angles. */
        float mean = 0.5f * (cosf(glm_rad(s->inner_cone_deg)) + cosf(glm_rad(s->outer_cone_deg)));
        value = s->power_w / (2 * GLM_PIf * fmaxf(1 - mean, 1e-4f));
    } else if (s->power_w > 0) {
        float area = s->type == PEN_LIGHT_RECT ? s->width * s->height
            : s->type == PEN_LIGHT_DISK        ? GLM_PIf * s->radius * s->radius
                                               : 4 * GLM_PIf * s->radius * s->radius;
        value = s->power_w / (GLM_PIf * area);
    }
    for (int i = 0; i < 3; i++)
        light->radiance[i] = value * s->color[i];
}

static void make_cube(struct light *light, const struct scene *scene)
{
    static const float axes[6][2][3] = {{{1, 0, 0}, {0, 1, 0}}, {{-1, 0, 0}, {0, 1, 0}},
        {{0, 1, 0}, {0, 0, 1}}, {{0, -1, 0}, {0, 0, 1}}, {{0, 0, 1}, {0, 1, 0}},
        {{0, 0, -1}, {0, 1, 0}}};
    light->face_count = 6;
    for (int i = 0; i < 6; i++) {
        struct light_face *f = &light->faces[i];
        float x[3], y[3], z[3];
        init_face(f, light->source);
        f->cube = 1;
        make_axes(axes[i][0], axes[i][1], x, y, z);
        set_axes(f, light->source->position, x, y, z);
        fit_face(f, scene);
    }
}

static void make_light(struct light *light, const struct pen_light *source, const struct scene *scene)
{
    memset(light, 0, sizeof *light);
    light->source = source;
    set_radiance(light);
    float direction[3], center[3], radius = scene_radius(scene);
    scene_center(scene, center);
    memcpy(light->origin, source->position, sizeof light->origin);
    bool round = source->type == PEN_LIGHT_POINT || source->type == PEN_LIGHT_SPHERE;
    for (int i = 0; i < 3; i++)
        direction[i] = (round ? center[i] : source->target[i]) - source->position[i];
    if (round) {
        /* One map when all casters lie in a cone of 130 degrees, else a cube. */
        float distance = glm_vec3_norm(direction);
        if (distance * sinf(glm_rad(65)) < radius) {
            make_axes((float[]){0, -1, 0}, (float[]){0, 0, 1}, light->x, light->y, light->z);
            make_cube(light, scene);
            return;
        }
    }
    make_axes(direction, source->up, light->x, light->y, light->z);
    if (source->type == PEN_LIGHT_SUN)
        for (int i = 0; i < 3; i++)
            light->origin[i] = center[i] - light->z[i] * 2 * radius;
    light->face_count = 1;
    init_face(&light->faces[0], source);
    set_axes(&light->faces[0], light->origin, light->x, light->y, light->z);
    fit_face(&light->faces[0], scene);
}

/* One rectangle above and beside the bounds, of a power that lights their centre with about
 * 3 W m^-2: a white surface then comes out just below display white. */
static void auto_light(struct pen_light *light, const struct scene *scene)
{
    float center[3], radius = scene_radius(scene);
    pen_light_default(light, PEN_LIGHT_RECT);
    scene_center(scene, center);
    static const float direction[3] = {0.62f, 0.75f, -0.23f};
    float distance = 2.4f * radius;
    for (int i = 0; i < 3; i++) {
        light->target[i] = center[i];
        light->position[i] = center[i] + distance * direction[i];
    }
    light->width = light->height = 0.6f * radius;
    light->power_w = 3.2f * GLM_PIf * distance * distance;
}

uint32_t lights_resolve(struct light lights[PEN_MAX_LIGHTS], struct pen_request *request,
    const struct scene *scene, struct pen_result *result)
{
    if (!request->lights_given) {
        uint32_t n = scene->blob.light_count;
        if (n > PEN_MAX_LIGHTS) {
            pen_result_warn(
                result, "The scene has %u lights; the first %d are used.", n, PEN_MAX_LIGHTS);
            n = PEN_MAX_LIGHTS;
        }
        for (uint32_t i = 0; i < n; i++)
            request->lights[i] = scene->blob.lights[i].light;
        if (!n)
            auto_light(&request->lights[n++], scene);
        request->light_count = n;
        request->lights_given = 1;
    }
    for (uint32_t i = 0; i < request->light_count; i++)
        make_light(&lights[i], &request->lights[i], scene);
    return request->light_count;
}
