#include "renderer/trace/casters.h"
#include <stdlib.h>

struct range { /* of 8-bit alpha; low > high: not known yet */
    uint8_t low, high;
};

static void include(struct range *range, uint8_t alpha)
{
    range->low = alpha < range->low ? alpha : range->low;
    range->high = alpha > range->high ? alpha : range->high;
}

static struct range texel_range(
    const struct psc_scene *scene, const struct psc_material *m, struct range *images)
{
    if (m->base.texture < 0)
        return (struct range){255, 255};
    uint32_t number = scene->textures[m->base.texture].image;
    const struct psc_image *image = &scene->images[number];
    const uint8_t *rgba = scene->texels + image->first_byte;
    size_t count = (size_t)image->width * image->height;
    bool known = images[number].low <= images[number].high;
    for (size_t i = 0; !known && i < count; i++)
        include(&images[number], rgba[4 * i + 3]);
    return images[number];
}

static enum trace_caster caster_of(
    const struct psc_scene *scene, const struct psc_primitive *p, struct range *images)
{
    const struct psc_material *m = &scene->materials[p->material];
    struct range vertices = {255, 0};
    if (p->index_count < 3)
        return TRACE_CASTS_NOTHING;
    if (m->alpha_mode == PSC_OPAQUE)
        return TRACE_CASTS;
    for (uint32_t i = 0; i < p->vertex_count; i++)
        include(&vertices, scene->attributes[p->first_vertex + i].color[3]);
    struct range texels = texel_range(scene, m, images);
    float factor = m->base_color[3];
    float low = factor * ((float)vertices.low / 255) * ((float)texels.low / 255);
    float high = factor * ((float)vertices.high / 255) * ((float)texels.high / 255);
    bool blend = m->alpha_mode == PSC_BLEND;
    if (blend ? high <= 0 : high < m->alpha_cutoff)
        return TRACE_CASTS_NOTHING;
    return (blend ? low < 1 : low < m->alpha_cutoff) ? TRACE_CASTS_BY_ALPHA : TRACE_CASTS;
}

uint8_t *trace_casters(const struct psc_scene *scene)
{
    uint8_t *casters = malloc(scene->primitive_count + 1);
    struct range *images = malloc((scene->image_count + 1) * sizeof *images);
    if (!casters || !images) {
        free(casters);
        free(images);
        return NULL;
    }
    for (uint32_t i = 0; i < scene->image_count; i++)
        images[i] = (struct range){255, 0};
    for (uint32_t i = 0; i < scene->primitive_count; i++)
        casters[i] = (uint8_t)caster_of(scene, &scene->primitives[i], images);
    free(images);
    return casters;
}
