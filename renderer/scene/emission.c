#include "renderer/scene/emission.h"
#include "protocol/memory.h"
#include "protocol/srgb.h"
#include "renderer/scene/emission_pattern.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define LEAST_SIDE 256u
#define MOST_SIDE 1024u
#define MOST_SOURCE_SIDE 2048u /* larger images are read from a level of their own chain */

struct key {
    uint32_t texture, pattern; /* as in struct pen_light */
    uint8_t image[PEN_ID_BYTES];
    uint32_t frame;
};

struct entry {
    struct entry *next;
    struct key key;
    struct emission emission;
    uint64_t last_use;
};

struct emission_cache {
    struct entry *entries;
    uint64_t bytes, clock;
};

struct emission_cache *emission_cache_create(void)
{
    return pen_alloc_zero(1, sizeof(struct emission_cache));
}

static void remove_entry(struct emission_cache *cache, struct entry **at)
{
    struct entry *e = *at;
    *at = e->next;
    cache->bytes -= e->emission.texture.bytes;
    gl_texture_destroy(&e->emission.texture);
    free(e);
}

void emission_cache_destroy(struct emission_cache *cache)
{
    if (!cache)
        return;
    while (cache->entries)
        remove_entry(cache, &cache->entries);
    free(cache);
}

uint64_t emission_cache_bytes(const struct emission_cache *cache)
{
    return cache->bytes;
}

void emission_cache_trim(struct emission_cache *cache, uint64_t bytes)
{
    while (cache->bytes > bytes) {
        struct entry **oldest = &cache->entries;
        for (struct entry **at = oldest; *at; at = &(*at)->next)
            if ((*at)->last_use < (*oldest)->last_use)
                oldest = at;
        remove_entry(cache, oldest);
    }
}

void emission_cache_drop(struct emission_cache *cache, const uint8_t id[PEN_ID_BYTES])
{
    for (struct entry **at = &cache->entries; *at;) {
        if ((*at)->key.texture == PEN_TEXTURE_IMAGE && !memcmp((*at)->key.image, id, PEN_ID_BYTES))
            remove_entry(cache, at);
        else
            at = &(*at)->next;
    }
}

/* Uploads the chain. texels: side x side, row 0 at y = -1, a to be filled; overwritten. */
static void upload(struct emission *emission, uint32_t side, float (*texels)[4])
{
    emission->texture = gl_texture_create(GL_RGBA16F, side, side, 0, 0);
    gl_texture_release_account(&emission->texture); /* the cache counts it */
    for (size_t i = 0; i < (size_t)side * side; i++) {
        const float *t = texels[i];
        texels[i][3] = (t[0] * t[0] + t[1] * t[1] + t[2] * t[2]) / 3;
    }
    for (uint32_t level = 0; side; level++, side /= 2) {
        gl.TextureSubImage2D(emission->texture.name, (GLint)level, 0, 0, (GLsizei)side,
            (GLsizei)side, GL_RGBA, GL_FLOAT, texels);
        memcpy(emission->mean, texels[0], sizeof emission->mean);
        for (uint32_t y = 0; y < side / 2; y++)
            for (uint32_t x = 0; x < side / 2; x++)
                for (int k = 0; k < 4; k++) {
                    const float *a = texels[2 * y * side + 2 * x];
                    texels[y * (side / 2) + x][k] =
                        0.25f *
                        (a[k] + a[4 + k] + a[4 * (size_t)side + k] + a[4 * (size_t)side + 4 + k]);
                }
    }
}

static void make_pattern(struct emission *emission, uint32_t pattern, uint32_t frame)
{
    const uint32_t side = LEAST_SIDE;
    float(*rgb)[3] = pen_alloc_zero((size_t)side * side, sizeof *rgb);
    float(*texels)[4] = pen_alloc_zero((size_t)side * side, sizeof *texels);
    emission_pattern_draw(pattern, frame, side, rgb);
    for (uint32_t y = 0; y < side; y++)
        for (uint32_t x = 0; x < side; x++)
            memcpy(texels[(side - 1 - y) * side + x], rgb[y * side + x], sizeof *rgb);
    upload(emission, side, texels);
    free(texels);
    free(rgb);
}

/* Share of source texel i that target texel j covers, both as intervals of [0, 1]: walks all pairs
 * that overlap. */
struct overlap {
    uint32_t first, last; /* source texels */
    float scale;          /* source texels per target texel */
    float begin, end;     /* of the target texel, in source texels */
};

static struct overlap overlap_of(uint32_t j, uint32_t target, uint32_t source)
{
    struct overlap o = {.scale = (float)source / (float)target};
    o.begin = (float)((double)j * source / target);
    o.end = (float)((double)(j + 1) * source / target);
    o.first = (uint32_t)o.begin;
    o.last = (uint32_t)ceilf(o.end);
    o.last = o.last > source ? source : o.last > o.first ? o.last : o.first + 1;
    return o;
}

static float overlap_weight(const struct overlap *o, uint32_t i)
{
    float from = fmaxf(o->begin, (float)i), to = fminf(o->end, (float)(i + 1));
    return fmaxf(to - from, 0) / o->scale;
}

/* Mean over each target texel's area, one axis at a time; turned over on the way. */
static void resample(
    const float (*source)[4], uint32_t width, uint32_t height, uint32_t side, float (*texels)[4])
{
    float(*rows)[4] = pen_alloc_zero((size_t)side * height, sizeof *rows);
    for (uint32_t x = 0; x < side; x++) {
        struct overlap o = overlap_of(x, side, width);
        for (uint32_t i = o.first; i < o.last; i++) {
            float w = overlap_weight(&o, i);
            for (uint32_t y = 0; y < height; y++)
                for (int k = 0; k < 3; k++)
                    rows[(size_t)y * side + x][k] += w * source[(size_t)y * width + i][k];
        }
    }
    for (uint32_t y = 0; y < side; y++) {
        struct overlap o = overlap_of(y, side, height);
        for (uint32_t i = o.first; i < o.last; i++) {
            float w = overlap_weight(&o, i);
            for (uint32_t x = 0; x < side; x++)
                for (int k = 0; k < 3; k++)
                    texels[(size_t)(side - 1 - y) * side + x][k] +=
                        w * rows[(size_t)i * side + x][k];
        }
    }
    free(rows);
}

static void make_image(struct emission *emission, const struct psc_scene *blob, uint32_t number)
{
    const struct psc_image *image = &blob->images[number];
    const uint8_t *bytes = blob->texels + image->first_byte;
    uint32_t w = image->width, h = image->height;
    while (w > MOST_SOURCE_SIDE || h > MOST_SOURCE_SIDE) {
        bytes += (size_t)4 * w * h;
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
    float linear[256];
    for (int i = 0; i < 256; i++)
        linear[i] = image->srgb ? pen_srgb_decodef((float)i / 255) : (float)i / 255;
    float(*source)[4] = pen_alloc_zero((size_t)w * h, sizeof *source);
    for (size_t i = 0; i < (size_t)w * h; i++)
        for (int k = 0; k < 3; k++)
            source[i][k] = linear[bytes[4 * i + k]] * (float)bytes[4 * i + 3] / 255;
    uint32_t side = LEAST_SIDE;
    while (side < MOST_SIDE && (side < w || side < h))
        side *= 2;
    float(*texels)[4] = pen_alloc_zero((size_t)side * side, sizeof *texels);
    resample((const float(*)[4])source, w, h, side, texels);
    upload(emission, side, texels);
    free(texels);
    free(source);
}

const struct emission *emission_cache_get(struct emission_cache *cache,
    const struct pen_light *light, const struct scene *image, float time_s, struct pen_error *error)
{
    if (light->texture == PEN_TEXTURE_NONE)
        return NULL;
    bool pattern = light->texture == PEN_TEXTURE_PATTERN;
    if (!pattern && !image) {
        pen_fail(error, PEN_INTERNAL, "", "An emission image is not resident.");
        return NULL;
    }
    uint32_t frames = pattern ? emission_pattern_frames(light->pattern) : image->blob.image_count;
    if (!frames) {
        pen_fail(error, PEN_INVALID, "/lights", "The emission image holds no picture.");
        return NULL;
    }
    struct key key;
    memset(&key, 0, sizeof key);
    key.texture = light->texture;
    key.frame = (uint32_t)((double)time_s * EMISSION_FRAMES_PER_SECOND + 1e-3) % frames;
    if (pattern)
        key.pattern = light->pattern;
    else
        memcpy(key.image, light->image, sizeof key.image);
    for (struct entry *e = cache->entries; e; e = e->next)
        if (!memcmp(&e->key, &key, sizeof key)) {
            e->last_use = ++cache->clock;
            return &e->emission;
        }
    struct entry *e = pen_alloc_zero(1, sizeof *e);
    e->key = key;
    e->last_use = ++cache->clock;
    if (pattern)
        make_pattern(&e->emission, key.pattern, key.frame);
    else
        make_image(&e->emission, &image->blob, key.frame);
    cache->bytes += e->emission.texture.bytes;
    e->next = cache->entries;
    cache->entries = e;
    return &e->emission;
}
