/* KHR_lights_punctual and EXT_lights_area are photometric (cd, lux, nits); the renderer is
 * radiometric. 683 lm/W, the efficacy that defines the lumen, converts between them: it is what
 * Blender's exporter multiplies by, so a 100 W lamp comes back as 100 W. */
#include "renderer/pose/place.h"
#include "renderer/blob/affine.h"
#include <string.h>

#define LUMENS_PER_WATT 683.0

static double clamp(double x, double low, double high)
{
    return x > low ? fmin(x, high) : low;
}

static float degrees(double radians)
{
    return (float)(radians * 180 / M_PI);
}

/* The angle turns counter-clockwise as seen with v pointing down, hence the signs: what the text of
 * the extension says and viewers do. */
void pose_texture_transform(const struct psc_map_rest *map, float transform[6])
{
    float c = cosf(map->rotation), s = sinf(map->rotation);
    const float t[6] = {c * map->scale[0], s * map->scale[1], map->offset[0], -s * map->scale[0],
        c * map->scale[1], map->offset[1]};
    const float identity[6] = {1, 0, 0, 0, 1, 0};
    bool finite = true;
    for (int i = 0; i < 6; i++)
        finite &= isfinite(t[i]) != 0;
    memcpy(transform, finite ? t : identity, sizeof t);
}

/* KHR_materials_ior and KHR_materials_specular: the reflectance at normal incidence, compared with
 * the 0.04 of index 1.5, and 25 where everything is reflected. An index of 0 stands for one that is
 * infinite. */
static float dielectric(const struct psc_material_rest *rest, int channel)
{
    double n = rest->ior, reflectance = n > 0 ? (n - 1) * (n - 1) / ((n + 1) * (n + 1)) : 1;
    double most = clamp(reflectance * rest->specular[channel], 0, 1);
    return (float)clamp(most * rest->specular_strength / 0.04, 0, 25);
}

void pose_finish_material(struct psc_material *m, const struct psc_material_rest *rest)
{
    struct psc_texture_ref *refs[5] = {
        &m->base, &m->surface, &m->normal, &m->occlusion, &m->emission};
    for (int i = 0; i < 4; i++)
        m->base_color[i] = (float)clamp(m->base_color[i], 0, 1);
    m->metallic = (float)clamp(m->metallic, 0, 1);
    m->roughness = (float)clamp(m->roughness, 0, 1);
    m->occlusion_strength = (float)clamp(m->occlusion_strength, 0, 1);
    for (int i = 0; i < 3 && !(m->flags & (uint32_t)PSC_SPECULAR_GLOSSINESS); i++)
        m->specular[i] = dielectric(rest, i);
    for (int i = 0; i < 3; i++)
        m->emissive[i] = (float)clamp((double)rest->emissive[i] * rest->emissive_strength, 0, 1e9);
    for (int i = 0; i < 5; i++)
        if (refs[i]->texture >= 0)
            pose_texture_transform(&rest->maps[i], refs[i]->transform);
}

/* The flux of `candela` over a solid angle. */
static float flux(double candela, double steradians)
{
    return (float)clamp(candela / LUMENS_PER_WATT * steradians, 0, 1e9);
}

void pose_light_power(struct pen_light *to, const struct psc_light_rest *from)
{
    double intensity = from->intensity, mean;
    for (int i = 0; i < 3; i++)
        to->color[i] = (float)clamp(from->color[i], 0, 1e3);
    switch (to->type) {
    case PEN_LIGHT_SUN:
        to->irradiance = (float)clamp(intensity / LUMENS_PER_WATT, 0, 1e9);
        break;
    case PEN_LIGHT_POINT:
        to->power_w = flux(intensity, 4 * M_PI);
        break;
    case PEN_LIGHT_SPOT:
        to->outer_cone_deg = (float)clamp(degrees(from->outer_cone), 0.01, 89);
        to->inner_cone_deg = (float)clamp(degrees(from->inner_cone), 0, 0.999 * to->outer_cone_deg);
        /* The renderer takes a spot's power as the flux inside its cone, full up to the inner angle
         * and falling evenly in the cosine to the outer one; the extension gives the intensity on
         * the axis, which is what this gets back. */
        mean = (cos(to->inner_cone_deg * M_PI / 180) + cos(to->outer_cone_deg * M_PI / 180)) / 2;
        to->power_w = flux(intensity, 2 * M_PI * (1 - mean));
        break;
    default:
        to->power_w = 0;
        to->radiance = (float)clamp(intensity / LUMENS_PER_WATT, 0, 1e9);
    }
}

bool pose_place_light(struct pen_light *to, const double world[12], const float size[2])
{
    double x[3], up[3], axis[3], position[3] = {world[3], world[7], world[11]};
    double scale = psc_affine_axis(world, 0, 1, x);
    scale = fmax(scale, psc_affine_axis(world, 1, 1, up));
    scale = fmax(scale, psc_affine_axis(world, 2, -1, axis));
    bool sun = to->type == PEN_LIGHT_SUN;
    for (int i = 0; i < 3; i++) {
        if (sun) /* shines from everywhere along its axis; put it where coordinates are small */
            position[i] = -axis[i];
        if (!(fabs(position[i]) < PEN_FAR))
            return false;
    }
    for (int i = 0; i < 3; i++) {
        to->position[i] = position[i];
        to->target[i] = sun ? 0 : position[i] + axis[i];
        to->up[i] = (float)up[i];
    }
    if (to->type == PEN_LIGHT_RECT || to->type == PEN_LIGHT_DISK) {
        to->height = (float)clamp(scale * size[0], 1e-9, PEN_FAR);
        to->width = (float)clamp(scale * size[1], 1e-9, PEN_FAR);
        to->radius = to->height / 2;
    }
    return true;
}

bool pose_place_camera(struct psc_camera *to, const double world[12], const float along[2])
{
    double eye[3] = {world[3], world[7], world[11]}, up[3], axis[3];
    psc_affine_axis(world, 1, 1, up);
    psc_affine_axis(world, 2, -1, axis);
    for (int i = 0; i < 3; i++) {
        eye[i] += axis[i] * along[0];
        if (!(fabs(eye[i]) < PEN_FAR))
            return false;
    }
    for (int i = 0; i < 3; i++) {
        to->eye[i] = eye[i];
        to->target[i] = clamp(eye[i] + axis[i] * along[1], -PEN_FAR, PEN_FAR);
        to->up[i] = (float)up[i];
    }
    return true;
}

float pose_fov_y_deg(float radians)
{
    double fov = radians * 180 / M_PI;
    return (float)clamp(fov > 0 ? fov : 45, 1, 170);
}
