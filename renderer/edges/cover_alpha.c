#include "renderer/edges/cover_alpha.h"
#include <math.h>

void cover_alpha_begin(
    struct cover_alpha *alpha, const struct psc_scene *scene, uint32_t material, float threshold)
{
    const struct psc_material *m = &scene->materials[material];
    *alpha = (struct cover_alpha){.material = m, .threshold = threshold};
    if (m->base.texture < 0)
        return;
    alpha->texture = &scene->textures[m->base.texture];
    const struct psc_image *image = &scene->images[alpha->texture->image];
    const uint8_t *texels = scene->texels + image->first_byte;
    int32_t w = (int32_t)image->width, h = (int32_t)image->height;
    alpha->last = image->levels - 1;
    for (uint32_t i = 0; i < image->levels; i++) {
        alpha->levels[i] = (struct cover_level){texels, w, h};
        texels += (size_t)4 * (uint32_t)w * (uint32_t)h;
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
}

void cover_alpha_vertex(
    const struct cover_alpha *alpha, const struct psc_attributes *vertex, float at[3])
{
    const struct psc_texture_ref *base = &alpha->material->base;
    const float *uv = vertex->uv[base->uv_set & 1], *t = base->transform;
    at[0] = alpha->texture ? t[0] * uv[0] + t[1] * uv[1] + t[2] : 0;
    at[1] = alpha->texture ? t[3] * uv[0] + t[4] * uv[1] + t[5] : 0;
    at[2] = alpha->material->base_color[3] * (float)vertex->color[3] / 255;
}

float cover_alpha_level(const struct cover_alpha *alpha, const float across[2], const float down[2])
{
    if (!alpha->texture)
        return 0;
    const float size[2] = {(float)alpha->levels[0].width, (float)alpha->levels[0].height};
    float x[2], y[2];
    for (int i = 0; i < 2; i++)
        x[i] = across[i] * size[i], y[i] = down[i] * size[i];
    float texels = fmaxf(x[0] * x[0] + x[1] * x[1], y[0] * y[0] + y[1] * y[1]); /* squared */
    return texels > 0 ? 0.5f * log2f(texels) : 0;
}

static cover_places all(float value)
{
    return (cover_places){value, value, value, value};
}

static cover_bits choose(cover_bits which, cover_bits a, cover_bits b)
{
    return (which & a) | (~which & b);
}

static cover_bits clamp(cover_bits i, int32_t most)
{
    i &= i > 0;
    return choose(i > most, most + (cover_bits){0}, i);
}

/* Texel number of texels that are at most a period of `size` away. */
static cover_bits wrap(cover_bits i, int32_t size, uint32_t mode)
{
    if (mode == PSC_CLAMP)
        return clamp(i, size - 1);
    if (mode == PSC_REPEAT)
        return i + ((i < 0) & size) - ((i >= size) & size);
    i -= (i >= 2 * size) & (2 * size);
    i = choose(i < 0, -1 - i, i);
    return choose(i >= size, 2 * size - 1 - i, i);
}

static cover_places whole(cover_places t)
{
    cover_places towards_0 =
        __builtin_convertvector(__builtin_convertvector(t, cover_bits), cover_places);
    return towards_0 + __builtin_convertvector(t < towards_0, cover_places);
}

/* Brought near the image, so that it fits an integer; 0 for what is no number or has no fraction. */
static cover_places reduce(cover_places t, uint32_t mode)
{
    float period = mode == PSC_MIRROR ? 2 : 1;
    if (mode != PSC_CLAMP) {
        t = (cover_places)((cover_bits)t & (t > -0x1p23f) & (t < 0x1p23f));
        return t - period * whole(t / period);
    }
    t = (cover_places)choose(t > -1.0f, (cover_bits)t, (cover_bits)all(-1) & (t <= -1.0f));
    return (cover_places)choose(t > 2.0f, (cover_bits)all(2), (cover_bits)t);
}

static cover_places fetch(const struct cover_level *level, cover_bits x, cover_bits y)
{
    const uint8_t *at[COVER_PLACES];
    for (int i = 0; i < COVER_PLACES; i++)
        at[i] = level->texels + 4 * ((size_t)y[i] * (size_t)level->width + (size_t)x[i]) + 3;
    return __builtin_convertvector(((cover_bits){*at[0], *at[1], *at[2], *at[3]}), cover_places);
}

static cover_places sample(
    const struct cover_alpha *alpha, const cover_places at[2], uint32_t number, bool nearest)
{
    const struct cover_level *level = &alpha->levels[number];
    int32_t w = level->width, h = level->height;
    uint32_t across = alpha->texture->wrap_s, down = alpha->texture->wrap_t;
    float shift = nearest ? 0 : 0.5f;
    cover_places s = reduce(at[0], across) * (float)w - shift;
    cover_places t = reduce(at[1], down) * (float)h - shift;
    cover_places left = whole(s), top = whole(t);
    cover_bits column = __builtin_convertvector(left, cover_bits);
    cover_bits row = __builtin_convertvector(top, cover_bits);
    cover_bits x = wrap(column, w, across), y = wrap(row, h, down);
    cover_places first = fetch(level, x, y);
    if (nearest)
        return first / 255.0f;
    cover_bits right = wrap(column + 1, w, across), below = wrap(row + 1, h, down);
    cover_places third = fetch(level, x, below);
    cover_places a = first + (s - left) * (fetch(level, right, y) - first);
    cover_places b = third + (s - left) * (fetch(level, right, below) - third);
    return (a + (t - top) * (b - a)) / 255.0f;
}

static bool any(cover_bits bits)
{
    return bits[0] | bits[1] | bits[2] | bits[3];
}

/* Which places are there when their alpha is a. */
static cover_bits kept(const struct cover_alpha *alpha, cover_places a)
{
    if (alpha->material->alpha_mode == PSC_MASK)
        return ~(a < alpha->material->alpha_cutoff);
    return alpha->material->alpha_mode == PSC_BLEND ? a > alpha->threshold : ~(cover_bits){0};
}

/* Of a texture between two levels: mostly the one that has the larger share decides alone. */
static cover_bits cut_between(const struct cover_alpha *alpha, const cover_places at[3],
    uint32_t finer, float share, cover_bits which)
{
    bool coarse = share > 0.5f;
    cover_places first = sample(alpha, at, finer + coarse, alpha->texture->nearest & 2);
    float own = coarse ? share : 1 - share;
    cover_bits surely = kept(alpha, at[2] * own * first);
    cover_bits perhaps = kept(alpha, at[2] * (own * first + (1 - own)));
    if (!any(which & (surely ^ perhaps)))
        return which & surely;
    cover_places second = sample(alpha, at, finer + !coarse, alpha->texture->nearest & 2);
    return which & kept(alpha, at[2] * (own * first + (1 - own) * second));
}

static cover_bits cut_textured(
    const struct cover_alpha *alpha, const cover_places at[3], float level, cover_bits which)
{
    uint32_t filter = alpha->texture->nearest, last = alpha->last;
    uint32_t number = 0;
    bool minified = level > 0, nearest = filter & (minified ? 2 : 1);
    level = fminf(level, (float)last);
    if (minified && last && !(filter & 8)) {
        uint32_t finer = (uint32_t)level < last ? (uint32_t)level : last - 1;
        if (!(filter & 4))
            return cut_between(alpha, at, finer, level - (float)finer, which);
        number = (uint32_t)(level + 0.5f);
    }
    return which & kept(alpha, at[2] * sample(alpha, at, number, nearest));
}

cover_bits cover_alpha_cut(
    const struct cover_alpha *alpha, const cover_places at[3], float level, cover_bits which)
{
    return alpha->texture ? cut_textured(alpha, at, level, which) : which & kept(alpha, at[2]);
}
