/* KHR_lights_punctual and EXT_lights_area. */
#include "renderer/import/convert/light.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/base/name.h"
#include "renderer/import/base/text.h"
#include "renderer/pose/place.h"
#include <stdio.h>
#include <string.h>

#define HARDLY_SEEN 1000 /* beside what is so many times as bright, which exposure suits */

/* As enum gltf_light_type; PEN_LIGHT_TYPES: none. */
static const uint32_t types[] = {[GLTF_LIGHT_UNKNOWN] = PEN_LIGHT_TYPES,
    [GLTF_LIGHT_DIRECTIONAL] = PEN_LIGHT_SUN,
    [GLTF_LIGHT_POINT] = PEN_LIGHT_POINT,
    [GLTF_LIGHT_SPOT] = PEN_LIGHT_SPOT,
    [GLTF_LIGHT_RECT] = PEN_LIGHT_RECT,
    [GLTF_LIGHT_DISK] = PEN_LIGHT_DISK};

struct psc_light_rest imp_light_rest(const struct gltf_light *light)
{
    return (struct psc_light_rest){.color = {light->color[0], light->color[1], light->color[2]},
        .intensity = light->intensity,
        .inner_cone = light->inner_cone,
        .outer_cone = light->outer_cone};
}

void imp_light_size(const struct gltf_light *light, float size[2])
{
    size[0] = light->size;
    size[1] = light->size * light->aspect;
}

uint32_t imp_add_light(struct imp_context *context, const struct gltf_light *light,
    const struct gltf_node *node, const double world[12], bool hidden)
{
    struct psc_light to = {0};
    if (context->light_count >= IMP_MAX_LIGHTS) {
        imp_warn(context, "Only the first %u lights are kept.", IMP_MAX_LIGHTS);
        return IMP_SKIPPED;
    }
    if (types[light->type] == PEN_LIGHT_TYPES) {
        imp_warn(context, "A light of an unknown type is left out.");
        return IMP_SKIPPED;
    }
    const struct psc_light_rest rest = imp_light_rest(light);
    float size[2];
    imp_light_size(light, size);
    pen_light_default(&to.light, types[light->type]);
    pose_light_power(&to.light, &rest);
    if (!pose_place_light(&to.light, world, size)) {
        imp_warn(context, "A light farther than a million km from the origin is left out.");
        return IMP_SKIPPED;
    }
    imp_name(to.name, node->name, light->name);
    bool area = light->type == GLTF_LIGHT_RECT || light->type == GLTF_LIGHT_DISK;
    if (!area && light->intensity > context->brightest)
        context->brightest = light->intensity;
    if (!area && light->intensity > 0 &&
        (!context->dimmest.name[0] || light->intensity < context->dimmest.intensity)) {
        context->dimmest.intensity = light->intensity;
        context->dimmest.unit = light->type == GLTF_LIGHT_DIRECTIONAL ? "lux" : "cd";
        snprintf(context->dimmest.name, sizeof context->dimmest.name,
            to.name[0] ? "The light \"%s\"" : "A light", imp_text(to.name).s);
    }
    if (hidden) /* until an animation shows it */
        memset(to.light.color, 0, sizeof to.light.color);
    uint32_t psc = psc_builder_add_light(context->builder, &to);
    if (++context->light_count == PEN_MAX_LIGHTS + 1)
        imp_warn(context, "A request that gives no lights uses only the first %d of the scene's.",
            PEN_MAX_LIGHTS);
    return psc;
}

void imp_lights_close(struct imp_context *context)
{
    if (context->dimmest.name[0] && context->brightest > HARDLY_SEEN * context->dimmest.intensity)
        imp_warn(context,
            "%s has %g %s, read as the unit that glTF prescribes; beside one that is %.0f times as "
            "bright it will hardly be seen.",
            context->dimmest.name, (double)context->dimmest.intensity, context->dimmest.unit,
            (double)(context->brightest / context->dimmest.intensity));
}
