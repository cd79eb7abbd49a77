#include "server/workers/worker_measure.h"
#include "protocol/memory.h"
#include "protocol/srgb.h"
#include "renderer/encode/encode.h"
#include "renderer/metrics/metrics.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>
#include <sys/mman.h>
#include <sys/stat.h>

#define DIFFERENCE_FULL 0.25f /* of visibility: where the difference map has its full colour */
#define PLANES_MAGIC 0x32504e50u
#define PLANES_FLOATS 7 /* per pixel */

/* What crosses as the reference: this, then `pixels` mean visibilities, then RGB display values, then
 * coloured visibilities. */
struct planes_header {
    uint32_t magic, width, height, reserved;
};
struct planes {
    uint32_t width, height;
    const float *visibility, *display, *colours; /* 1, 3 and 3 floats per pixel */
};

void worker_measure_output(struct pen_output *output)
{
    *output = (struct pen_output){
        .format = PEN_EXR, .layer = PEN_LAYER_ALL, .bit_depth = 32, .quality = output->quality};
}

static float encode_srgb(float c)
{
    return pen_srgb_encodef(c > 0 ? fminf(c, 1) : 0); /* NaN: 0 */
}

static float tone_curve(uint32_t which, float c, float luminance)
{
#define PEN_TONE_MAP(name, text, curve)                                                            \
    if (which == PEN_TONE_##name)                                                                  \
        return curve;
#include "protocol/tone_maps.def"
#undef PEN_TONE_MAP
    return c;
}

/* Display values in [0, 1] of scene-linear RGB that already has its exposure: tone curve and sRGB
 * (IEC 61966-2-1), as renderer/shaders/frame/display.glsl. */
static void to_display(const float radiance[3], uint32_t tone_map, float display[3])
{
    float c[3];
    for (int i = 0; i < 3; i++)
        c[i] = fmaxf(radiance[i], 0);
    float luminance = 0.2126f * c[0] + 0.7152f * c[1] + 0.0722f * c[2];
    for (int i = 0; i < 3; i++)
        display[i] = encode_srgb(tone_curve(tone_map, c[i], luminance));
}

static const float *find_plane(const struct pen_frame *frame, const char *name)
{
    for (uint32_t i = 0; i < frame->plane_count; i++)
        if (!strcmp(frame->planes[i].name, name) && frame->planes[i].pixel == PEN_PIXEL_RGBA32F)
            return frame->planes[i].data;
    return NULL;
}

/* The frame's planes as one block in the form that crosses; NULL when it lacks some. */
static struct planes_header *make_planes(
    const struct pen_frame *frame, const struct pen_request *request, size_t *bytes)
{
    size_t pixels = (size_t)frame->width * frame->height;
    const float *beauty = find_plane(frame, pen_layer_names[PEN_LAYER_BEAUTY]);
    const float *visibility = find_plane(frame, pen_layer_names[PEN_LAYER_VISIBILITY]);
    *bytes = sizeof(struct planes_header) + pixels * PLANES_FLOATS * sizeof(float);
    struct planes_header *header = beauty && visibility ? malloc(*bytes) : NULL;
    if (!header)
        return NULL;
    *header = (struct planes_header){PLANES_MAGIC, frame->width, frame->height, 0};
    float *to = (float *)(header + 1), *display = to + pixels, *colours = display + 3 * pixels;
    for (size_t i = 0; i < pixels; i++) {
        to[i] = visibility[4 * i + 3];
        memcpy(&colours[3 * i], &visibility[4 * i], 3 * sizeof *colours);
        to_display(&beauty[4 * i], request->tone_map, &display[3 * i]);
    }
    return header;
}

static struct planes read_planes(const struct planes_header *header)
{
    const float *values = (const float *)(header + 1);
    size_t pixels = (size_t)header->width * header->height;
    return (struct planes){
        header->width, header->height, values, values + pixels, values + 4 * pixels};
}

/* ---- pictures ---- */

static uint8_t quantise(float value)
{
    return value > 0 ? (uint8_t)(fminf(value, 1) * 255 + 0.5f) : 0;
}

/* Encodes RGB values as an 8-bit PNG and hands it over. `paint` gives pixel i. */
static bool hand_over_png(const struct planes *size, const void *values,
    void (*paint)(const void *values, size_t i, float rgb[3]), struct channel_fds *fds,
    uint64_t *image_bytes, struct pen_error *error)
{
    static const struct pen_output output = {.format = PEN_PNG, .bit_depth = 8};
    size_t pixels = (size_t)size->width * size->height;
    uint8_t *data = pen_alloc(pixels * 4, 1);
    struct pen_bytes bytes = {0};
    for (size_t i = 0; i < pixels; i++) {
        float rgb[3];
        paint(values, i, rgb);
        for (int c = 0; c < 3; c++)
            data[4 * i + c] = quantise(rgb[c]);
        data[4 * i + 3] = 255;
    }
    struct pen_frame frame = {size->width, size->height, 1,
        {{.name = "beauty", .pixel = PEN_PIXEL_RGBA8, .channels = 3, .data = data}}};
    bool ok = pen_encode(&frame, &output, NULL, 0, &bytes, error) &&
              worker_item_hand_over(&bytes, fds, error);
    if (image_bytes)
        *image_bytes = bytes.size;
    pen_bytes_finish(&bytes);
    free(data);
    return ok;
}

static void paint_display(const void *values, size_t i, float rgb[3])
{
    memcpy(rgb, (const float *)values + 3 * i, 3 * sizeof *rgb);
}

/* White: equal; red: too light; blue: too dark. */
static void paint_difference(const void *values, size_t i, float rgb[3])
{
    float d = ((const float *)values)[i] / DIFFERENCE_FULL;
    rgb[0] = 1 - fmaxf(-d, 0);
    rgb[1] = 1 - fabsf(d);
    rgb[2] = 1 - fmaxf(d, 0);
}

/* White: alike. */
static void paint_grey(const void *values, size_t i, float rgb[3])
{
    rgb[0] = rgb[1] = rgb[2] = ((const float *)values)[i];
}

/* Black through red and yellow to white, as FLIP grows. */
static void paint_heat(const void *values, size_t i, float rgb[3])
{
    float v = 3 * ((const float *)values)[i];
    for (int c = 0; c < 3; c++)
        rgb[c] = fminf(fmaxf(v - (float)c, 0), 1);
}

/* ---- comparing ---- */

static bool compare(const struct planes *test, const struct planes *reference, float *maps[],
    struct pen_comparison *out, struct pen_error *error)
{
    struct pen_metrics_image a = {test->visibility, test->width, test->height, 1};
    struct pen_metrics_image b = {reference->visibility, reference->width, reference->height, 1};
    struct pen_metrics_visibility visibility;
    if (!pen_metrics_visibility(&a, &b, &visibility, error))
        return false;
    *out = (struct pen_comparison){.rmse = visibility.rmse,
        .penumbra_rmse = visibility.penumbra_rmse,
        .mean_error = visibility.mean_error,
        .largest = visibility.largest,
        .penumbra_pixels = visibility.penumbra_pixels};
    if (!maps)
        return true;
    for (int i = 0; i < 3; i++) {
        a = (struct pen_metrics_image){test->colours + i, test->width, test->height, 3};
        b = (struct pen_metrics_image){reference->colours + i, test->width, test->height, 3};
        if (!pen_metrics_rmse(&a, &b, 1, &out->channel_rmse[i], error))
            return false;
    }
    for (size_t i = 0; i < (size_t)test->width * test->height; i++)
        maps[MEASURE_MAP_DIFFERENCE][i] = test->visibility[i] - reference->visibility[i];
    a = (struct pen_metrics_image){test->display, test->width, test->height, 3};
    b = (struct pen_metrics_image){reference->display, reference->width, reference->height, 3};
    struct pen_metrics_similarity similarity = {0};
    bool ok = pen_metrics_rmse(&a, &b, 3, &out->picture_rmse, error) &&
              pen_metrics_ssim(&a, &b, maps[MEASURE_MAP_SSIM], &similarity, error);
    out->ssim = similarity.mean;
    out->ssim_contrast = similarity.contrast;
    return ok && pen_metrics_flip(&a, &b, 0, maps[MEASURE_MAP_FLIP], &out->flip, error);
}

static bool compare_and_paint(const struct worker_item *item, const struct planes *test,
    const struct planes *reference, struct pen_result *result, struct channel_fds *fds)
{
    static void (*const paint[])(const void *, size_t, float[3]) = {
        [MEASURE_MAP_DIFFERENCE] = paint_difference,
        [MEASURE_MAP_SSIM] = paint_grey,
        [MEASURE_MAP_FLIP] = paint_heat};
    size_t pixels = (size_t)test->width * test->height;
    bool wants_maps = item->measure == MEASURE_COMPARED;
    float *values = wants_maps ? malloc(pixels * MEASURE_MAPS * sizeof *values) : NULL;
    float *maps[MEASURE_MAPS];
    for (int m = 0; m < MEASURE_MAPS; m++)
        maps[m] = values ? values + (size_t)m * pixels : NULL;
    bool ok = compare(test, reference, values ? maps : NULL, &result->comparison, &result->error);
    for (int m = 0; ok && values && m < MEASURE_MAPS; m++)
        ok = hand_over_png(test, maps[m], paint[m], fds, NULL, &result->error);
    free(values);
    return ok;
}

bool worker_measure(struct worker_item *item, struct channel_fds *fds)
{
    struct pen_result *result = &item->message.result;
    struct pen_error *error = &result->error;
    const struct planes_header *known = MAP_FAILED;
    size_t bytes;
    struct stat status;
    bool ok = false;
    struct planes_header *header = make_planes(&item->frame, &result->completed, &bytes);
    if (!header)
        return pen_fail(error, PEN_INTERNAL, "", "There is nothing to measure.");
    struct planes test = read_planes(header);
    if (item->measure != MEASURE_NUMBERS &&
        !hand_over_png(&test, test.display, paint_display, fds, &result->image_bytes, error))
        goto done;
    if (item->measure == MEASURE_REFERENCE) {
        struct pen_bytes all = {(uint8_t *)header, bytes};
        ok = worker_item_hand_over(&all, fds, error);
        goto done;
    }
    if (item->reference_fd >= 0 && !fstat(item->reference_fd, &status) &&
        (uint64_t)status.st_size == bytes)
        known = mmap(NULL, bytes, PROT_READ, MAP_SHARED, item->reference_fd, 0);
    if (known == MAP_FAILED || memcmp(known, header, sizeof *header)) {
        pen_fail(error, PEN_INTERNAL, "", "The reference does not fit the picture.");
        goto done;
    }
    struct planes reference = read_planes(known);
    ok = compare_and_paint(item, &test, &reference, result, fds);
done:
    if (known != MAP_FAILED)
        munmap((void *)known, bytes);
    free(header);
    return ok;
}
