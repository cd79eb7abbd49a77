/* KHR_lights_punctual and EXT_lights_area. */
#include "renderer/import/convert/light.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/base/name.h"
#include "renderer/import/base/text.h"
#include "renderer/pose/place.h"
#include <string.h>

#define DIM_CANDELA 5 /* no lamp for a room is this weak: the file must mean something else */
#define DIM_LUX 20

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
    bool sun = light->type == GLTF_LIGHT_DIRECTIONAL;
    pen_light_default(&to.light, types[light->type]);
    pose_light_power(&to.light, &rest);
    if (!pose_place_light(&to.light, world, size)) {
        imp_warn(context, "A light farther than a million km from the origin is left out.");
        return IMP_SKIPPED;
    }
    imp_name(to.name, node->name, light->name);
    bool point = light->type == GLTF_LIGHT_POINT || light->type == GLTF_LIGHT_SPOT;
    if (light->intensity > 0 &&
        ((point && light->intensity < DIM_CANDELA) || (sun && light->intensity < DIM_LUX)))
        imp_warn(context,
            "The light \"%s\" has only %g %s, read as the unit that glTF prescribes; it will look "
            "dark beside lights given in watts.",
            imp_text(to.name).s, (double)light->intensity, sun ? "lux" : "cd");
    if (hidden) /* until an animation shows it */
        memset(to.light.color, 0, sizeof to.light.color);
    uint32_t psc = psc_builder_add_light(context->builder, &to);
    if (++context->light_count == PEN_MAX_LIGHTS + 1)
        imp_warn(context, "A request that gives no lights uses only the first %d of the scene's.",
            PEN_MAX_LIGHTS);
    return psc;
}
