#include "tests/bench/claims/compare.h"
#include "renderer/encode/encode.h"
#include "renderer/metrics/metrics.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

#define DARK 0.02f /* visibility below: umbra; between it and 1 - it: penumbra */

static float *display_floats(const struct picture *picture)
{
    size_t count = 4 * (size_t)picture->width * picture->height;
    float *values = malloc(count * sizeof *values);
    if (!values)
        abort();
    for (size_t i = 0; i < count; i++)
        values[i] = (float)picture->beauty[i] / 255;
    return values;
}

/* What pen_metrics_visibility does not tell: colours in the penumbra and light in the umbra. */
static void write_regions(struct pen_json *json, const struct picture *t, const struct picture *r)
{
    double colour = 0, leak = 0, leak_most = 0;
    uint64_t penumbra = 0, umbra = 0;
    for (size_t i = 0; i < (size_t)t->width * t->height; i++) {
        const float *a = t->visibility + 4 * i, *b = r->visibility + 4 * i;
        if (b[3] > DARK && b[3] < 1 - DARK) {
            for (int k = 0; k < 3; k++)
                colour += (a[k] - b[k]) * (a[k] - b[k]) / 3;
            penumbra++;
        } else if (b[3] <= DARK) {
            leak += a[3];
            leak_most = fmax(leak_most, a[3]);
            umbra++;
        }
    }
    pen_json_double(json, "colour_penumbra_rmse", penumbra ? sqrt(colour / penumbra) : 0);
    pen_json_double(json, "umbra_mean", umbra ? leak / umbra : 0);
    pen_json_double(json, "umbra_most", leak_most);
    pen_json_uint(json, "umbra_pixels", umbra);
}

void compare_write(struct pen_json *json, const struct plan_group *group,
    const struct picture *pictures, uint32_t test, uint32_t reference, bool flip)
{
    const struct picture *t = &pictures[test], *r = &pictures[reference];
    struct pen_error error = {0};
    if (group->variants[test].status != VARIANT_OK ||
        group->variants[reference].status != VARIANT_OK || t->width != r->width ||
        t->height != r->height)
        return;
    pen_json_object(json, NULL);
    pen_json_string(json, "test", group->variants[test].name);
    pen_json_string(json, "reference", group->variants[reference].name);
    struct pen_metrics_image a = {t->visibility + 3, t->width, t->height, 4},
                             b = {r->visibility + 3, r->width, r->height, 4};
    struct pen_metrics_visibility visibility;
    if (pen_metrics_visibility(&a, &b, &visibility, &error)) {
        pen_json_double(json, "rmse", visibility.rmse);
        pen_json_double(json, "penumbra_rmse", visibility.penumbra_rmse);
        pen_json_double(json, "mean_error", visibility.mean_error);
        pen_json_double(json, "largest", visibility.largest);
        pen_json_uint(json, "penumbra_pixels", visibility.penumbra_pixels);
    }
    write_regions(json, t, r);
    float *shown = display_floats(t), *wanted = display_floats(r);
    a = (struct pen_metrics_image){shown, t->width, t->height, 4};
    b = (struct pen_metrics_image){wanted, r->width, r->height, 4};
    double value;
    if (pen_metrics_rmse(&a, &b, 3, &value, &error))
        pen_json_double(json, "image_rmse", value);
    struct pen_metrics_similarity similarity;
    if (pen_metrics_ssim(&a, &b, NULL, &similarity, &error)) {
        pen_json_double(json, "ssim", similarity.mean);
        pen_json_double(json, "ssim_contrast", similarity.contrast);
    }
    if (flip && pen_metrics_flip(&a, &b, 0, NULL, &value, &error))
        pen_json_double(json, "flip", value);
    free(shown);
    free(wanted);
    pen_json_end(json);
}

static void write_png(const char *path, uint32_t width, uint32_t height, uint8_t *pixels)
{
    struct pen_frame frame = {.width = width,
        .height = height,
        .plane_count = 1,
        .planes = {{.name = "beauty", .channels = 3, .data = pixels}}};
    struct pen_output output = {.format = PEN_PNG, .bit_depth = 8};
    struct pen_error error = {0};
    struct pen_bytes bytes;
    FILE *file = fopen(path, "wb");
    if (!file || !pen_encode(&frame, &output, NULL, 0, &bytes, &error)) {
        fprintf(stderr, "claims: cannot write %s %s\n", path, error.message);
        exit(1);
    }
    fwrite(bytes.data, 1, bytes.size, file);
    fclose(file);
    pen_bytes_finish(&bytes);
}

static uint8_t to_byte(float v)
{
    return (uint8_t)lrintf(255 * (v < 0 ? 0 : v > 1 ? 1 : v));
}

static void paint_visibility(const struct picture *picture, uint8_t *pixels)
{
    for (size_t i = 0; i < (size_t)picture->width * picture->height; i++)
        for (int k = 0; k < 4; k++)
            pixels[4 * i + k] = k < 3 ? to_byte(picture->visibility[4 * i + k]) : 255;
}

static void paint_difference(const struct picture *t, const struct picture *r, uint8_t *pixels)
{
    for (size_t i = 0; i < (size_t)t->width * t->height; i++) {
        float e = 4 * (t->visibility[4 * i + 3] - r->visibility[4 * i + 3]);
        uint8_t *p = pixels + 4 * i;
        p[0] = to_byte(1 - fmaxf(-e, 0));
        p[1] = to_byte(1 - fabsf(e));
        p[2] = to_byte(1 - fmaxf(e, 0));
        p[3] = 255;
    }
}

void compare_pictures(
    const char *folder, const struct plan_group *group, const struct picture *pictures)
{
    char path[1024];
    for (uint32_t i = 0; i < group->variant_count; i++) {
        const struct picture *picture = &pictures[i];
        if (group->variants[i].status != VARIANT_OK)
            continue;
        uint8_t *pixels = malloc(4 * (size_t)picture->width * picture->height);
        if (!pixels)
            abort();
        snprintf(path, sizeof path, "%s/%s--%s.png", folder, group->name, group->variants[i].name);
        if (strchr(group->flags, 'v'))
            paint_visibility(picture, pixels);
        else
            memcpy(pixels, picture->beauty, 4 * (size_t)picture->width * picture->height);
        write_png(path, picture->width, picture->height, pixels);
        bool against_reference = i && !strcmp(group->variants[0].name, "reference") &&
                                 group->variants[0].status == VARIANT_OK;
        if (against_reference) {
            paint_difference(picture, &pictures[0], pixels);
            snprintf(path, sizeof path, "%s/%s--%s--difference.png", folder, group->name,
                group->variants[i].name);
            write_png(path, picture->width, picture->height, pixels);
        }
        free(pixels);
    }
}
