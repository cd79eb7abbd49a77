/* A reader that touches all that the blob format promises; for the tests of damaged files. */
#pragma once
#include "renderer/blob/pscene.h"
#include <math.h>
#include <string.h>

/* False when something out of range or not finite is met. Adds to *sum, so that no read is
 * optimised away. */
static inline bool walk_blob(const struct psc_scene *s, double *sum)
{
    bool ok = true;
    for (uint32_t i = 0; i < s->instance_count; i++) {
        const struct psc_primitive *p = &s->primitives[s->instances[i].primitive];
        for (uint32_t m = 0; m < p->meshlet_count; m++) {
            const struct psc_meshlet *let = &s->meshlets[p->first_meshlet + m];
            for (uint32_t k = 0; k < let->index_count; k++) {
                uint32_t v = s->indices[let->first_index + k];
                ok &= v - p->first_vertex < p->vertex_count;
                *sum += s->positions[v][2] + s->attributes[v].uv[0][1] * 1e-30;
                ok &= isfinite(s->positions[v][0]) && isfinite(s->attributes[v].uv[1][1]);
            }
        }
        const struct psc_material *m = &s->materials[p->material];
        if (m->base.texture >= 0) {
            const struct psc_image *image = &s->images[s->textures[m->base.texture].image];
            uint64_t at = image->first_byte;
            uint32_t w = image->width, h = image->height;
            for (uint32_t l = 0; l < image->levels; l++) {
                *sum += s->texels[at] + s->texels[at + 4 * ((uint64_t)w * h - 1)];
                at += 4ull * w * h;
                w = w > 1 ? w / 2 : 1;
                h = h > 1 ? h / 2 : 1;
            }
            ok &= at <= s->texel_bytes;
        }
        ok &= isfinite(m->roughness) && m->alpha_mode <= PSC_BLEND;
    }
    for (uint32_t i = 0; i < s->light_count; i++)
        *sum += (double)strlen(s->lights[i].name) + s->lights[i].light.type;
    for (uint32_t i = 0; i < s->camera_count; i++)
        *sum += (double)strlen(s->cameras[i].name) + s->cameras[i].fov_y_deg;
    for (const char *w = s->warnings; w < s->warnings + s->warning_bytes; w += strlen(w) + 1)
        *sum += *w;
    return ok;
}
