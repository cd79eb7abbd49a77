#include "renderer/light/light.h"
#include "renderer/light/casters.h"
#include <cglm/cglm.h>
#include <string.h>

/* Beyond this slope from the axis a map has no useful resolution, and a Lambertian emitter little
 * light: tan 80 degrees. */
#define MAX_SLOPE 5.67f
#define MOST_MESHLETS 1000000u

static void make_axes(
    const float direction[3], const float up[3], float x[3], float y[3], float z[3])
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

static void set_axes(
    struct light_face *f, const float o[3], const float x[3], const float y[3], const float z[3])
{
    mat4 m = {{x[0], y[0], z[0], 0}, {x[1], y[1], z[1], 0}, {x[2], y[2], z[2], 0},
        {-glm_vec3_dot((float *)x, (float *)o), -glm_vec3_dot((float *)y, (float *)o),
            -glm_vec3_dot((float *)z, (float *)o), 1}};
    memcpy(f->world_to_light, m, sizeof m);
}

static struct caster_light caster_light(const struct light *light)
{
    const struct pen_light *s = light->source;
    bool sun = s->type == PEN_LIGHT_SUN;
    float extent = s->type == PEN_LIGHT_RECT ? 0.5f * hypotf(s->width, s->height)
                   : sun                     ? tanf(0.5f * glm_rad(s->angular_diameter_deg))
                                             : s->radius;
    return (struct caster_light){
        light->origin, sun ? light->z : NULL, {light->x, light->y}, extent};
}

void light_find_backdrops(const struct light *light, const struct scene *scene, bool *backdrop)
{
    const struct caster_light as = caster_light(light);
    for (uint32_t i = 0; i < scene->blob.instance_count; i++) {
        float min[3], max[3];
        scene_instance_bounds(scene, i, min, max);
        backdrop[i] = casters_is_backdrop(scene, min, max, &as);
    }
}

static void light_corner(const struct light_face *f, const float bounds[2][3], int i, float c[3])
{
    float world[3];
    for (int k = 0; k < 3; k++)
        world[k] = bounds[i >> k & 1][k];
    glm_mat4_mulv3((vec4 *)f->world_to_light, world, 1, c);
}

/* Extent of a world box along one axis of light space. */
static void box_range(
    const struct light_face *f, const float bounds[2][3], int axis, float range[2])
{
    range[0] = INFINITY, range[1] = -INFINITY;
    for (int i = 0; i < 8; i++) {
        float c[3];
        light_corner(f, bounds, i, c);
        range[0] = fminf(range[0], c[axis]);
        range[1] = fmaxf(range[1], c[axis]);
    }
}

/* Row `axis` of world_to_light * world; returns its length: what it makes of a unit sphere. */
static float light_row(
    const struct light_face *f, const struct psc_instance *instance, int axis, float row[4])
{
    for (int k = 0; k < 4; k++)
        row[k] = f->world_to_light[0][axis] * instance->world[k] +
                 f->world_to_light[1][axis] * instance->world[4 + k] +
                 f->world_to_light[2][axis] * instance->world[8 + k] +
                 (k == 3 ? f->world_to_light[3][axis] : 0);
    return sqrtf(row[0] * row[0] + row[1] * row[1] + row[2] * row[2]);
}

static float across(const float row[4], const float p[3])
{
    return row[0] * p[0] + row[1] * p[1] + row[2] * p[2] + row[3];
}

/* The part of a polygon where dot(side, (x, y, z, 1)) >= 0, after Sutherland and Hodgman 1974;
 * `to` has room for one corner more. */
static int cut_polygon(float (*from)[3], int n, const float side[4], float (*to)[3])
{
    int count = 0;
    for (int i = 0; i < n; i++) {
        const float *a = from[i], *b = from[(i + 1) % n];
        float at_a = glm_vec3_dot((float *)a, (float *)side) + side[3];
        float at_b = glm_vec3_dot((float *)b, (float *)side) + side[3];
        if (at_a >= 0)
            memcpy(to[count++], a, sizeof *to);
        if ((at_a >= 0) != (at_b >= 0))
            glm_vec3_lerp((float *)a, (float *)b, at_a / (at_a - at_b), to[count++]);
    }
    return count;
}

/* Narrows `range`, the z of a backdrop, to where shadows can fall on it: within the window through
 * which the light sees the casters, half as large again. A map's depths would else be those of a
 * ground that reaches to the horizon. */
static void narrow_backdrop(
    const struct light_face *f, const float bounds[2][3], const float casters[2][3], float range[2])
{
    float window[2][2] = {{INFINITY, -INFINITY}, {INFINITY, -INFINITY}}; /* parallel: m; else x/z */
    for (int i = 0; i < 8; i++) {
        float c[3];
        light_corner(f, casters, i, c);
        if (!f->parallel && c[2] <= 0)
            return; /* beside the light: seen through no window */
        for (int k = 0; k < 2; k++) {
            float at = f->parallel ? c[k] : c[k] / c[2];
            window[k][0] = fminf(window[k][0], at);
            window[k][1] = fmaxf(window[k][1], at);
        }
    }
    int thin = 0;
    for (int k = 1; k < 3; k++)
        thin = bounds[1][k] - bounds[0][k] < bounds[1][thin] - bounds[0][thin] ? k : thin;
    float least = INFINITY, most = -INFINITY;
    for (int face = 0; face < 2; face++) {
        float corners[2][8][3];
        int n = 4, now = 0;
        for (int i = 0; i < 4; i++) {
            int u = i == 1 || i == 2, v = i >> 1;
            int at = face << thin | u << (thin + 1) % 3 | v << (thin + 2) % 3;
            light_corner(f, bounds, at, corners[0][i]);
        }
        for (int side = 0; side < 4; side++) {
            int k = side >> 1;
            float more = 0.25f * (window[k][1] - window[k][0]), sign = side & 1 ? -1 : 1;
            float edge = window[k][side & 1] - sign * more, plane[4] = {0};
            plane[k] = sign;
            plane[f->parallel ? 3 : 2] = -sign * edge;
            n = cut_polygon(corners[now], n, plane, corners[!now]);
            now = !now;
        }
        for (int i = 0; i < n; i++) {
            least = fminf(least, corners[now][i][2]);
            most = fmaxf(most, corners[now][i][2]);
        }
    }
    range[0] = fmaxf(range[0], least); /* nothing in the window: an empty range */
    range[1] = fminf(range[1], most);
}

/* Of all instances; more would take longer to look at than what they are worth. */
static bool has_few_meshlets(const struct psc_scene *blob)
{
    uint64_t count = 0;
    for (uint32_t i = 0; i < blob->instance_count && count <= MOST_MESHLETS; i++)
        count += blob->primitives[blob->instances[i].primitive].meshlet_count;
    return count <= MOST_MESHLETS;
}

/* Nearest and farthest z of what lies in front of the light: by instance box and by meshlet sphere,
 * whichever is tighter. A near plane that is too close widens every blocker search. A face of a
 * cube only owns receivers with |x|, |y| <= z, so what is nearer than |x| or |y| less the emitter's
 * half extent casts on none of them. */
static void geometry_range(const struct light_face *f, const struct light *light,
    const struct scene *scene, float range[2])
{
    const struct caster_light as = caster_light(light);
    bool alone = true; /* nothing but backdrops */
    for (uint32_t i = 0; i < scene->blob.instance_count && alone; i++) {
        float min[3], max[3];
        scene_instance_bounds(scene, i, min, max);
        alone = casters_is_backdrop(scene, min, max, &as);
    }
    bool few = has_few_meshlets(&scene->blob);
    range[0] = INFINITY, range[1] = 0;
    for (uint32_t i = 0; i < scene->blob.instance_count; i++) {
        const struct psc_instance *instance = &scene->blob.instances[i];
        const struct psc_primitive *p = &scene->blob.primitives[instance->primitive];
        float bounds[2][3], box[3][2], rows[3][4], scales[3];
        scene_instance_bounds(scene, i, bounds[0], bounds[1]);
        if (!casters_overlap((const float(*)[3])bounds, light->within))
            continue;
        for (int axis = 0; axis < 3; axis++) {
            box_range(f, bounds, axis, box[axis]);
            scales[axis] = light_row(f, instance, axis, rows[axis]);
        }
        if (!alone && !f->cube && casters_is_backdrop(scene, bounds[0], bounds[1], &as))
            narrow_backdrop(f, bounds, light->casters, box[2]);
        for (uint32_t k = 0; k < (few || !p->meshlet_count ? p->meshlet_count : 1); k++) {
            const struct psc_meshlet *m = &scene->blob.meshlets[p->first_meshlet + k];
            float z = across(rows[2], m->center);
            float near_z = few ? fmaxf(z - scales[2] * m->radius, box[2][0]) : box[2][0];
            float far_z = few ? fminf(z + scales[2] * m->radius, box[2][1]) : box[2][1];
            if (far_z <= 0 || near_z > far_z)
                continue;
            range[1] = fmaxf(range[1], far_z);
            for (int axis = 0; f->cube && axis < 2; axis++) {
                float beside = fmaxf(box[axis][0], -box[axis][1]);
                if (few)
                    beside = fmaxf(
                        beside, fabsf(across(rows[axis], m->center)) - scales[axis] * m->radius);
                near_z = fmaxf(near_z, beside - f->extent[axis]);
            }
            if (near_z <= far_z)
                range[0] = fminf(range[0], near_z);
        }
    }
    if (range[1] > 0 && range[0] > range[1]) /* geometry, but none that could cast */
        range[0] = 0.5f * range[1];
}

static void fit_range(struct light_face *f, const struct light *light, const struct scene *scene)
{
    float range[2];
    geometry_range(f, light, scene, range);
    if (!(range[1] > 0))
        range[0] = 0.5f, range[1] = 1;
    f->far_z = range[1] * 1.001f + 1e-6f * fminf(scene_radius(scene), 1);
    /* Nearer casters are kept by depth clamping, at the near plane's depth. */
    float least = f->parallel ? -INFINITY : f->far_z * 1e-3f;
    f->near_z = fminf(fmaxf(range[0] * (range[0] > 0 ? 0.999f : 1.001f), least), 0.999f * f->far_z);
}

void light_face_window(
    const struct light_face *f, const float casters[2][3], const float sample[2], float rect[4])
{
    float n = f->near_z;
    rect[0] = rect[1] = INFINITY;
    rect[2] = rect[3] = -INFINITY;
    float corners[8][3];
    for (int i = 0; i < 8; i++)
        light_corner(f, casters, i, corners[i]);
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
            float reach = slope * n + (f->cube ? 1.02f * f->extent[k] + 0.02f * n : 0);
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

void light_face_clip(const struct light_face *f, const float sample[2], const float rect[4], mat4 m)
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

void light_face_cull(
    const struct light_face *f, const float sample[2], const float rect[4], struct cull_view *cull)
{
    mat4 clip, inverse;
    memset(cull, 0, sizeof *cull);
    light_face_clip(f, sample, rect, clip);
    glm_mat4_mul(clip, (vec4 *)f->world_to_light, cull->world_to_clip);
    /* world_to_light is rigid, so its inverse is exact enough for an eye point. */
    glm_mat4_inv((vec4 *)f->world_to_light, inverse);
    float eye[3] = {sample[0], sample[1], 0};
    if (f->parallel) /* light travels along (-t, 1): docs/light-space.md */
        eye[0] = -sample[0], eye[1] = -sample[1], eye[2] = 1;
    glm_mat4_mulv3(inverse, eye, f->parallel ? 0 : 1, cull->eye);
    if (f->parallel)
        glm_vec3_normalize(cull->eye);
    cull->parallel = f->parallel;
}

static void fit_face(struct light_face *f, const struct light *light, const struct scene *scene)
{
    static const float center[2] = {0, 0};
    fit_range(f, light, scene);
    light_face_window(f, light->casters, center, f->rect);
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
        f->extent[0] = 0.5f * source->width, f->extent[1] = 0.5f * source->height;
        break;
    case PEN_LIGHT_DISK:
    case PEN_LIGHT_SPHERE:
        f->shape = SHAPE_DISK;
        f->extent[0] = f->extent[1] = source->radius;
        break;
    case PEN_LIGHT_SUN:
        f->shape = SHAPE_DISK;
        f->parallel = 1;
        f->extent[0] = f->extent[1] = tanf(0.5f * glm_rad(source->angular_diameter_deg));
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
        float area = s->type == PEN_LIGHT_RECT   ? s->width * s->height
                     : s->type == PEN_LIGHT_DISK ? GLM_PIf * s->radius * s->radius
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
        set_axes(f, light->origin, x, y, z);
        fit_face(f, light, scene);
    }
}

void light_emission(struct light *light, const struct pen_light *source, const struct scene *scene)
{
    float direction[3];
    memset(light, 0, sizeof *light);
    light->source = source;
    set_radiance(light);
    scene_point_in(scene, source->position, light->origin);
    scene_direction(source->position, source->target, direction);
    make_axes(direction, source->up, light->x, light->y, light->z);
}

static void find_casters(
    struct light *light, const struct scene *scene, const struct view *view, bool ground)
{
    const struct caster_light as = caster_light(light);
    casters_bounds(scene, view, ground, &as, light->casters, light->within);
}

/* Two radii before what the scene is about or, where that is a wide floor with little on it, before what
 * casts: biases are shares of the distance from there. */
static void place_sun(struct light *light, const float center[3], float radius)
{
    float middle[3], size[3];
    glm_vec3_sub(light->casters[1], light->casters[0], size);
    glm_vec3_center(light->casters[0], light->casters[1], middle);
    float half = 0.5f * glm_vec3_norm(size);
    bool little = half < 0.25f * radius;
    for (int i = 0; i < 3; i++)
        light->origin[i] =
            (little ? middle : center)[i] - light->z[i] * 2 * (little ? half : radius);
}

static void make_light(struct light *light, const struct pen_light *source,
    const struct scene *scene, const struct view *view, bool ground)
{
    float direction[3], center[3], radius = scene_radius(scene);
    light_emission(light, source, scene);
    scene_center(scene, center);
    bool round = source->type == PEN_LIGHT_POINT || source->type == PEN_LIGHT_SPHERE;
    if (round)
        scene_direction((double[3]){light->origin[0], light->origin[1], light->origin[2]},
            (double[3]){center[0], center[1], center[2]}, direction);
    else
        scene_direction(source->position, source->target, direction);
    if (round) {
        /* One map when all casters lie in a cone of 130 degrees, else a cube. */
        float distance = glm_vec3_distance(center, light->origin);
        if (distance * sinf(glm_rad(65)) < radius) {
            make_axes((float[]){0, -1, 0}, (float[]){0, 0, 1}, light->x, light->y, light->z);
            find_casters(light, scene, view, ground);
            make_cube(light, scene);
            return;
        }
    }
    make_axes(direction, source->up, light->x, light->y, light->z);
    find_casters(light, scene, view, ground);
    if (source->type == PEN_LIGHT_SUN)
        place_sun(light, center, radius);
    light->face_count = 1;
    init_face(&light->faces[0], source);
    set_axes(&light->faces[0], light->origin, light->x, light->y, light->z);
    fit_face(&light->faces[0], light, scene);
}

/* The key light of a photograph: in front of the subject as the camera sees it, to the left and
 * above, so that form is modelled and the shadow falls to the right where it is seen. Its power
 * lights the centre with PI W m^-2: a white surface that faces it has radiance 1. */
static void auto_light(struct pen_light *light, const struct scene *scene, const struct view *view)
{
    float center[3], position[3], back[3], right[3], radius = scene_radius(scene);
    pen_light_default(light, PEN_LIGHT_RECT);
    scene_center(scene, center);
    /* On the horizon; looking straight down, what is up in the picture is away from the camera. */
    for (int i = 0; i < 3; i++)
        back[i] = -view->forward[i] - 0.5f * fabsf(view->forward[1]) * view->up[i];
    back[1] = 0;
    glm_vec3_normalize(back);
    glm_vec3_cross((float[]){0, 1, 0}, back, right);
    /* Who looks from under the floor looks at undersides. */
    float side = view->eye[1] < scene_floor(scene) ? -1 : 1;
    const float azimuth = glm_rad(52), elevation = side * glm_rad(46), distance = 6 * radius;
    float across = cosf(elevation);
    for (int i = 0; i < 3; i++) {
        float direction = across * (cosf(azimuth) * back[i] - sinf(azimuth) * right[i]) +
                          (i == 1 ? sinf(elevation) : 0);
        position[i] = center[i] + distance * direction;
    }
    scene_point_out(scene, center, light->target);
    scene_point_out(scene, position, light->position);
    light->width = light->height = 1.2f * radius;
    light->power_w = GLM_PIf * GLM_PIf * distance * distance;
}

bool lights_shine(const struct scene *scene)
{
    for (uint32_t i = 0; i < scene->stage->moment_count; i++)
        for (uint32_t k = 0; k < scene->stage->moments[i].light_count; k++) {
            struct light light;
            light_emission(&light, &scene->stage->moments[i].lights[k], scene);
            if (light.radiance[0] + light.radiance[1] + light.radiance[2] > 0)
                return true;
        }
    return false;
}

uint32_t lights_resolve(struct light lights[PEN_MAX_LIGHTS], struct pen_request *request,
    const struct scene *scene, const struct view *view, struct pen_result *result)
{
    if (!request->lights_given) {
        uint32_t n = scene->blob.light_count;
        if (n > PEN_MAX_LIGHTS) {
            pen_result_warn(
                result, "The scene has %u lights; the first %d are used.", n, PEN_MAX_LIGHTS);
            n = PEN_MAX_LIGHTS;
        }
        if (n && !lights_shine(scene)) {
            pen_result_warn(result, "The scene's lights give no light; a key light does.");
            n = 0;
        }
        for (uint32_t i = 0; i < n; i++)
            request->lights[i] = scene->blob.lights[i].light;
        if (!n)
            auto_light(&request->lights[n++], scene, view);
        request->light_count = n;
        request->lights_given = 1;
    }
    for (uint32_t i = 0; i < request->light_count; i++)
        make_light(&lights[i], &request->lights[i], scene, view, request->ground.on);
    return request->light_count;
}
