/* KHR_lights_punctual and EXT_lights_area. Both are photometric (cd, lux, nits); the renderer is
 * radiometric. 683 lm/W, the efficacy that defines the lumen, converts between them: it is what
 * Blender's exporter multiplies by, so a 100 W lamp comes back as 100 W. */
#include "renderer/import/convert/light.h"
#include "renderer/blob/affine.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/convert/name.h"
#include "renderer/import/base/text.h"
#include <string.h>

#define LUMENS_PER_WATT 683.0
#define DIM_CANDELA 5 /* no lamp for a room is this weak: the file must mean something else */
#define DIM_LUX 20

static double clamp(double x, double low, double high)
{
    return x > low ? fmin(x, high) : low;
}

static double degrees(double radians)
{
    return radians * 180 / M_PI;
}

/* The flux of `candela` over a solid angle. */
static float flux(double candela, double steradians)
{
    return (float)clamp(candela / LUMENS_PER_WATT * steradians, 0, 1e9);
}

static bool fill(struct pen_light *to, const struct gltf_light *from, double scale)
{
    double intensity = from->intensity, mean;
    switch (from->type) {
    case GLTF_LIGHT_DIRECTIONAL:
        pen_light_default(to, PEN_LIGHT_SUN);
        to->irradiance = (float)clamp(intensity / LUMENS_PER_WATT, 0, 1e9);
        return true;
    case GLTF_LIGHT_POINT:
        pen_light_default(to, PEN_LIGHT_POINT);
        to->power_w = flux(intensity, 4 * M_PI);
        return true;
    case GLTF_LIGHT_SPOT:
        pen_light_default(to, PEN_LIGHT_SPOT);
        to->outer_cone_deg = (float)clamp(degrees(from->outer_cone), 0.01, 89);
        to->inner_cone_deg = (float)clamp(degrees(from->inner_cone), 0, 0.999 * to->outer_cone_deg);
        /* The renderer takes a spot's power as the flux inside its cone, full up to the inner angle
         * and falling evenly in the cosine to the outer one; the extension gives the intensity on
         * the axis, which is what this gets back. */
        mean = (cos(to->inner_cone_deg * M_PI / 180) + cos(to->outer_cone_deg * M_PI / 180)) / 2;
        to->power_w = flux(intensity, 2 * M_PI * (1 - mean));
        return true;
    case GLTF_LIGHT_RECT:
    case GLTF_LIGHT_DISK:
        pen_light_default(to, from->type == GLTF_LIGHT_RECT ? PEN_LIGHT_RECT : PEN_LIGHT_DISK);
        to->power_w = 0;
        to->radiance = (float)clamp(intensity / LUMENS_PER_WATT, 0, 1e9);
        to->height = (float)clamp(scale * from->size, 1e-9, PEN_FAR);
        to->width = (float)clamp(scale * from->size * from->aspect, 1e-9, PEN_FAR);
        to->radius = to->height / 2;
        return true;
    case GLTF_LIGHT_UNKNOWN:
        break;
    }
    return false;
}

void imp_add_light(struct imp_context *context, const struct gltf_light *light,
    const struct gltf_node *node, const double world[12])
{
    struct psc_light to = {0};
    double x[3], up[3], axis[3];
    double scale = psc_affine_axis(world, 0, 1, x);
    scale = fmax(scale, psc_affine_axis(world, 1, 1, up));
    scale = fmax(scale, psc_affine_axis(world, 2, -1, axis));
    double position[3] = {world[3], world[7], world[11]};
    if (context->light_count >= IMP_MAX_LIGHTS) {
        imp_warn(context, "Only the first %u lights are kept.", IMP_MAX_LIGHTS);
        return;
    }
    if (!fill(&to.light, light, scale)) {
        imp_warn(context, "A light of an unknown type is left out.");
        return;
    }
    bool sun = light->type == GLTF_LIGHT_DIRECTIONAL;
    for (int i = 0; i < 3; i++) {
        if (sun) /* shines from everywhere along its axis; put it where coordinates are small */
            position[i] = -axis[i];
        if (!(fabs(position[i]) < PEN_FAR)) {
            imp_warn(context, "A light farther than a million km from the origin is left out.");
            return;
        }
        to.light.position[i] = position[i];
        to.light.target[i] = sun ? 0 : position[i] + axis[i];
        to.light.up[i] = (float)up[i];
        to.light.color[i] = (float)clamp(light->color[i], 0, 1e3);
    }
    imp_name(to.name, node->name, light->name);
    bool point = light->type == GLTF_LIGHT_POINT || light->type == GLTF_LIGHT_SPOT;
    if (light->intensity > 0 &&
        ((point && light->intensity < DIM_CANDELA) || (sun && light->intensity < DIM_LUX)))
        imp_warn(context,
            "The light \"%s\" has only %g %s, read as the unit that glTF prescribes; it will look "
            "dark beside lights given in watts.",
            imp_text(to.name).s, (double)light->intensity, sun ? "lux" : "cd");
    psc_builder_add_light(context->builder, &to);
    if (++context->light_count == PEN_MAX_LIGHTS + 1)
        imp_warn(context, "A request that gives no lights uses only the first %d of the scene's.",
            PEN_MAX_LIGHTS);
}
