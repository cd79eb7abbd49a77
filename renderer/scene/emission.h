/* Emission textures of rect lights: images and built-in patterns as linear RGBA16F with mips, in
 * the light's own axes, kept between requests.
 *
 * Pictures are drawn as seen from the scene, upright: their left edge is the light's -x side (light
 * space is right-handed with +z towards the viewer, so nothing is mirrored), their top edge +y.
 * Rows are stored from y = -1, so they are turned over once, here. */
#pragma once
#include "renderer/gl/texture.h"
#include "renderer/scene/scene.h"

struct emission {
    /* Square, the side a power of two, so that every texel of a level is an exact mean over a cell
     * of the light. rgb: emission, alpha folded in; a: mean of the squares of the three channels,
     * from which a cell's variance follows. */
    struct gl_texture texture;
    float mean[3];
};

struct emission_cache;
struct emission_cache *emission_cache_create(void);
void emission_cache_destroy(struct emission_cache *cache);

/* What `light` emits at `time_s`, made on first use; NULL without an error when it has no texture.
 * `image`: the resident scene that holds the image of a PEN_TEXTURE_IMAGE light, else NULL; several
 * images in it are frames at 24 per second. Valid until the next emission_cache_trim.
 * Errors: PEN_INVALID when the scene holds no image, PEN_INTERNAL when it is not resident. */
const struct emission *emission_cache_get(struct emission_cache *cache,
    const struct pen_light *light, const struct scene *image, float time_s,
    struct pen_error *error);

uint64_t emission_cache_bytes(const struct emission_cache *cache);
/* Drops the least recently used until `bytes` or less are held. */
void emission_cache_trim(struct emission_cache *cache, uint64_t bytes);
/* Drops what was made from the image `id`. */
void emission_cache_drop(struct emission_cache *cache, const uint8_t id[PEN_ID_BYTES]);
