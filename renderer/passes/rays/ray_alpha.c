#include "renderer/passes/rays/ray_alpha.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define NO_TEXELS UINT32_MAX

static const struct psc_material *material_of(const struct psc_scene *scene, uint32_t instance)
{
    return &scene->materials[scene->primitives[scene->instances[instance].primitive].material];
}

static int32_t image_of(const struct psc_scene *scene, const struct psc_material *m)
{
    bool alpha = m->alpha_mode != PSC_OPAQUE && m->base.texture >= 0;
    return alpha ? (int32_t)scene->textures[m->base.texture].image : -1;
}

static uint64_t texel_count(const struct psc_scene *scene, uint32_t image)
{
    return (uint64_t)scene->images[image].width * scene->images[image].height;
}

/* Where each image's alpha starts, in texels from the first word; NO_TEXELS: not needed. */
static uint64_t place_images(const struct psc_scene *scene, uint64_t first, uint64_t *places)
{
    for (uint32_t i = 0; i < scene->image_count; i++)
        places[i] = NO_TEXELS;
    for (uint32_t i = 0; i < scene->material_count; i++) {
        int32_t image = image_of(scene, &scene->materials[i]);
        if (image < 0 || places[image] != NO_TEXELS)
            continue;
        places[image] = first;
        first += texel_count(scene, (uint32_t)image);
    }
    return first;
}

static void copy_texels(const struct psc_scene *scene, const uint64_t *places, uint32_t *words)
{
    for (uint32_t i = 0; i < scene->image_count; i++) {
        if (places[i] == NO_TEXELS)
            continue;
        const uint8_t *rgba = scene->texels + scene->images[i].first_byte;
        uint64_t count = texel_count(scene, i);
        for (uint64_t k = 0; k < count; k++) {
            uint64_t at = places[i] + k;
            words[at / 4] |= (uint32_t)rgba[4 * k + 3] << at % 4 * 8;
        }
    }
}

static void fill_material(const struct psc_scene *scene, const struct psc_material *m,
    const uint64_t *places, uint32_t words[WORDS])
{
    int32_t image = image_of(scene, m);
    memcpy(&words[WORD_FACTOR], &m->base_color[3], 4);
    memcpy(&words[WORD_CUTOFF], &m->alpha_cutoff, 4);
    words[WORD_FIRST] = NO_TEXELS;
    words[WORD_FLAGS] = m->alpha_mode == PSC_BLEND ? FLAG_BLEND : 0;
    if (image < 0)
        return;
    const struct psc_texture *texture = &scene->textures[m->base.texture];
    words[WORD_FIRST] = (uint32_t)places[image];
    words[WORD_WIDTH] = scene->images[image].width;
    words[WORD_HEIGHT] = scene->images[image].height;
    words[WORD_FLAGS] |= (texture->nearest & 1 ? FLAG_NEAREST : 0u) |
                         texture->wrap_s << WRAP_S_SHIFT | texture->wrap_t << WRAP_T_SHIFT;
}

static bool make_words(const struct psc_scene *scene, uint64_t max_bytes, struct ray_alpha *alpha,
    struct pen_error *error)
{
    uint64_t *places = calloc(scene->image_count + 1, sizeof *places);
    if (!places)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    uint64_t texels = place_images(scene, (uint64_t)4 * WORDS * scene->material_count, places);
    alpha->word_count = texels / 4 + 1;
    bool fits = texels < NO_TEXELS && 4 * alpha->word_count <= max_bytes;
    alpha->words = fits ? calloc(alpha->word_count, sizeof *alpha->words) : NULL;
    if (alpha->words) {
        for (uint32_t i = 0; i < scene->material_count; i++)
            fill_material(scene, &scene->materials[i], places, alpha->words + (size_t)WORDS * i);
        copy_texels(scene, places, alpha->words);
    }
    free(places);
    if (!fits)
        return pen_fail(error, PEN_TOO_BIG, "/scene",
            "The scene's alpha textures are too large to be ray traced on this GPU.");
    return alpha->words || pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
}

static void fill_triangle(
    const struct psc_scene *scene, const struct pen_bvh_triangle *t, struct ray_alpha_triangle *out)
{
    const struct psc_texture_ref *ref = &material_of(scene, t->instance)->base;
    const float *m = ref->transform;
    out->material = scene->primitives[scene->instances[t->instance].primitive].material;
    for (uint32_t k = 0; k < 3; k++) {
        uint32_t corner = t->flags & PEN_BVH_SWAPPED && k ? 3 - k : k;
        const struct psc_attributes *a =
            &scene->attributes[scene->indices[t->first_index + corner]];
        const float *uv = a->uv[ref->uv_set & 1];
        for (int c = 0; c < 2; c++) {
            float value = m[3 * c] * uv[0] + m[3 * c + 1] * uv[1] + m[3 * c + 2];
            out->uv[k][c] = isfinite(value) ? value : 0;
        }
        out->a[k] = (float)a->color[3] / 255;
    }
}

/* The number of each instance's first record; returns how many there are. */
static uint32_t number_records(
    const struct psc_scene *scene, const struct pen_bvh *bvh, uint32_t *first)
{
    uint32_t count = 0;
    for (uint32_t i = 0; i < bvh->triangle_count; i++)
        first[bvh->triangles[i].instance] |= bvh->triangles[i].flags & PEN_BVH_ALPHA;
    for (uint32_t i = 0; i < scene->instance_count; i++) {
        bool alpha = first[i] != 0; /* of one triangle, hence of all */
        first[i] = count;
        if (alpha)
            count += scene->primitives[scene->instances[i].primitive].index_count / 3;
    }
    return count;
}

bool ray_alpha_make(const struct psc_scene *scene, struct pen_bvh *bvh, uint64_t max_bytes,
    struct ray_alpha *alpha, struct pen_error *error)
{
    *alpha = (struct ray_alpha){0};
    uint32_t *first = calloc(scene->instance_count + 1, sizeof *first);
    if (!first)
        return pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    alpha->triangle_count = number_records(scene, bvh, first);
    uint64_t bytes = (uint64_t)alpha->triangle_count * sizeof *alpha->triangles;
    bool ok = bytes <= max_bytes ||
              pen_fail(error, PEN_TOO_BIG, "/scene",
                  "The scene has too many triangles with alpha to be ray traced on this GPU.");
    if (ok && alpha->triangle_count) {
        alpha->triangles = malloc(bytes);
        ok = alpha->triangles ? make_words(scene, max_bytes, alpha, error)
                              : pen_fail(error, PEN_UNAVAILABLE, "", "Out of memory.");
    }
    for (uint32_t i = 0; ok && i < bvh->triangle_count; i++) {
        struct pen_bvh_triangle *t = &bvh->triangles[i];
        if (!(t->flags & PEN_BVH_ALPHA))
            continue;
        uint32_t start = scene->primitives[scene->instances[t->instance].primitive].first_index;
        uint32_t record = first[t->instance] + (t->first_index - start) / 3;
        fill_triangle(scene, t, &alpha->triangles[record]);
        t->first_index = record;
    }
    free(first);
    if (!ok)
        ray_alpha_finish(alpha);
    return ok;
}

void ray_alpha_finish(struct ray_alpha *alpha)
{
    free(alpha->triangles);
    free(alpha->words);
    *alpha = (struct ray_alpha){0};
}
