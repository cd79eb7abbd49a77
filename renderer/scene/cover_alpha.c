#include "renderer/scene/cover_alpha.h"
#include <math.h>

void cover_alpha_begin(
    struct cover_alpha *alpha, const struct psc_scene *scene, uint32_t material, float threshold)
{
    const struct psc_material *m = &scene->materials[material];
    *alpha = (struct cover_alpha){.material = m, .threshold = threshold};
    if (m->base.texture < 0)
        return;
    alpha->texture = &scene->textures[m->base.texture];
    alpha->image = &scene->images[alpha->texture->image];
    alpha->texels = scene->texels + alpha->image->first_byte;
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
    const float size[2] = {(float)alpha->image->width, (float)alpha->image->height};
    float x[2], y[2];
    for (int i = 0; i < 2; i++)
        x[i] = across[i] * size[i], y[i] = down[i] * size[i];
    float texels = fmaxf(x[0] * x[0] + x[1] * x[1], y[0] * y[0] + y[1] * y[1]); /* squared */
    return texels > 0 ? 0.5f * log2f(texels) : 0;
}

/* Texel number of texel `i` of `size`. */
static int32_t wrap(int32_t i, int32_t size, uint32_t mode)
{
    if (i >= 0 && i < size)
        return i;
    if (mode == PSC_CLAMP)
        return i < 0 ? 0 : size - 1;
    int32_t period = mode == PSC_MIRROR ? 2 * size : size;
    i %= period;
    i += i < 0 ? period : 0;
    return i < size ? i : period - 1 - i;
}

/* Brought near the image, so that it fits an integer; 0 for what is no number. */
static float reduce(float t, uint32_t mode)
{
    float period = mode == PSC_MIRROR ? 2 : 1;
    if (mode != PSC_CLAMP)
        t -= period * floorf(t / period);
    return t > -1 ? fminf(t, 2) : t <= -1 ? -1 : 0;
}

static float sample(
    const struct cover_alpha *alpha, const float at[2], uint32_t level, bool nearest)
{
    const struct psc_image *image = alpha->image;
    const uint8_t *texels = alpha->texels;
    int32_t w = (int32_t)image->width, h = (int32_t)image->height;
    for (; level; level--) {
        texels += (size_t)4 * (uint32_t)w * (uint32_t)h;
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
    uint32_t modes[] = {alpha->texture->wrap_s, alpha->texture->wrap_t};
    float shift = nearest ? 0 : 0.5f;
    float s = reduce(at[0], modes[0]) * (float)w - shift;
    float t = reduce(at[1], modes[1]) * (float)h - shift;
    float left = floorf(s), top = floorf(t);
    int32_t x = wrap((int32_t)left, w, modes[0]), y = wrap((int32_t)top, h, modes[1]);
    const uint8_t *row = texels + (size_t)4 * (uint32_t)(y * w) + 3;
    if (nearest)
        return (float)row[4 * x] / 255;
    int32_t right = wrap((int32_t)left + 1, w, modes[0]);
    const uint8_t *next =
        texels + (size_t)4 * (uint32_t)(wrap((int32_t)top + 1, h, modes[1]) * w) + 3;
    float a = (float)row[4 * x] + (s - left) * (float)(row[4 * right] - row[4 * x]);
    float b = (float)next[4 * x] + (s - left) * (float)(next[4 * right] - next[4 * x]);
    return (a + (t - top) * (b - a)) / 255;
}

static float sample_levels(const struct cover_alpha *alpha, const float at[2], float level)
{
    uint32_t filter = alpha->texture->nearest, last = alpha->image->levels - 1;
    if (!(level > 0))
        return sample(alpha, at, 0, filter & 1);
    bool nearest = filter & 2;
    if (filter & 8 || !last)
        return sample(alpha, at, 0, nearest);
    level = fminf(level, (float)last);
    if (filter & 4)
        return sample(alpha, at, (uint32_t)(level + 0.5f), nearest);
    uint32_t finer = (uint32_t)level < last ? (uint32_t)level : last - 1;
    float a = sample(alpha, at, finer, nearest), b = sample(alpha, at, finer + 1, nearest);
    return a + (level - (float)finer) * (b - a);
}

bool cover_alpha_is_cut(const struct cover_alpha *alpha, const float at[3], float level)
{
    float a = alpha->texture ? at[2] * sample_levels(alpha, at, level) : at[2];
    if (alpha->material->alpha_mode == PSC_MASK)
        return a < alpha->material->alpha_cutoff;
    return alpha->material->alpha_mode == PSC_BLEND && !(a > alpha->threshold);
}
