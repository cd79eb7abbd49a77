#include "renderer/encode/encode.h"
#include "renderer/encode/exr_shim.h"
#include "renderer/encode/jpeg.h"
#include "renderer/encode/pixels.h"
#include "renderer/encode/png_fast.h"
#include "renderer/encode/tiff.h"
#include "renderer/encode/webp.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>

static uint32_t bits_of(const struct pen_output *output)
{
    if (output->bit_depth)
        return output->bit_depth;
    return output->format == PEN_EXR ? 16 : 8;
}

struct source {
    const struct pen_frame *frame;
    enum pixels_sample stored[PEN_LAYERS]; /* HALF or FLOAT of each plane */
    uint32_t total;                        /* channels of the file */
};

static void fill_rows(void *user, uint32_t first, uint32_t count, void *out)
{
    const struct source *source = user;
    uint32_t width = source->frame->width;
    for (uint32_t y = 0; y < count; y++) {
        float *at = (float *)out + (size_t)y * width * source->total;
        for (uint32_t p = 0; p < source->frame->plane_count; p++) {
            const struct pen_plane *plane = &source->frame->planes[p];
            pixels_row(
                plane, width, first + y, plane->channels, source->stored[p], source->total, at);
            at += plane->channels;
        }
    }
}

static const char *letters_of(const struct pen_plane *plane, uint32_t channels, bool several)
{
    const struct pen_layer_info *layer = pen_layer_find(plane->name);
    uint32_t kind = layer ? layer->channels : PEN_CHANNELS_RGBA;
    if (channels == 1)
        return kind == PEN_CHANNELS_Z ? "Z" : "Y";
    return several && kind == PEN_CHANNELS_XYZ ? "XYZW" : "RGBA";
}

static void name_channels(
    const struct pen_plane *plane, uint32_t channels, bool several, char (*names)[32])
{
    const char *letters = letters_of(plane, channels, several);
    bool prefix = several && strcmp(plane->name, pen_layers[PEN_LAYER_BEAUTY].name) != 0;
    for (uint32_t c = 0; c < channels; c++)
        snprintf(names[c], sizeof names[c], "%.*s%s%c", (int)sizeof plane->name,
            prefix ? plane->name : "", prefix ? "." : "", letters[c]);
}

static bool encode_exr(const struct pen_frame *frame, const struct pen_output *output,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error)
{
    struct source source = {.frame = frame};
    struct exr_file file = {.width = frame->width,
        .height = frame->height,
        .attributes = attributes,
        .attribute_count = attribute_count};
    for (uint32_t p = 0; p < frame->plane_count; p++) {
        const struct pen_plane *plane = &frame->planes[p];
        bool wide = output->bit_depth == 32 ||
                    (output->bit_depth == 0 && plane->pixel == PEN_PIXEL_RGBA32F);
        file.bt709 |= !strcmp(plane->name, pen_layers[PEN_LAYER_BEAUTY].name);
        source.stored[p] = wide ? PIXELS_FLOAT : PIXELS_HALF;
        name_channels(plane, plane->channels, frame->plane_count > 1, &file.names[source.total]);
        for (uint32_t c = 0; c < plane->channels; c++)
            file.half[source.total + c] = !wide;
        source.total += plane->channels;
    }
    file.channels = source.total;
    return exr_write(&file, fill_rows, &source, bytes, error);
}

/* The attributes as lines of one text; NULL: no memory. */
static char *describe(const char *const *attributes, uint32_t count)
{
    size_t size = 1;
    for (uint32_t i = 0; i < count; i++)
        size += strlen(attributes[i]) + 1;
    char *text = calloc(1, size), *at = text;
    for (uint32_t i = 0; text && i < count; i++)
        at += sprintf(at, "%s%s", i ? "\n" : "", attributes[i]);
    return text;
}

static bool encode_described(const struct pen_frame *frame, const struct pen_output *output,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error)
{
    char *text = describe(attributes, attribute_count);
    if (!text)
        return pen_fail(
            error, PEN_UNAVAILABLE, "", "The image could not be encoded: out of memory.");
    bool ok = output->format == PEN_TIFF ? tiff_encode(frame, bits_of(output), text, bytes, error)
                                         : jpeg_encode(frame, output->quality, text, bytes, error);
    free(text);
    return ok;
}

static bool is_sound(const struct pen_frame *frame, const struct pen_output *output)
{
    if (!frame->width || !frame->height || !frame->plane_count || frame->plane_count > PEN_LAYERS)
        return false;
    for (uint32_t p = 0; p < frame->plane_count; p++) {
        const struct pen_plane *plane = &frame->planes[p];
        if (!plane->data || plane->pixel > PEN_PIXEL_RGBA32F ||
            (plane->channels != 1 && plane->channels != 3 && plane->channels != 4) ||
            !memchr(plane->name, 0, sizeof plane->name))
            return false;
    }
    uint32_t bits = bits_of(output);
    switch (output->format) {
    case PEN_PNG:
    case PEN_TIFF:
        return bits == 8 || bits == 16;
    case PEN_EXR:
        return bits == 16 || bits == 32;
    default:
        return bits == 8;
    }
}

bool pen_encode(const struct pen_frame *frame, const struct pen_output *output,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error)
{
    *bytes = (struct pen_bytes){0};
    if (output->format >= PEN_FORMATS || !is_sound(frame, output))
        return pen_fail(error, PEN_INTERNAL, "", "A frame of this kind cannot be encoded.");
    if (output->format == PEN_PNG)
        return png_fast_encode(frame, bits_of(output), attributes, attribute_count, bytes, error);
    if (output->format == PEN_WEBP)
        return webp_encode(frame, output->quality, bytes, error);
    if (output->format == PEN_EXR)
        return encode_exr(frame, output, attributes, attribute_count, bytes, error);
    return encode_described(frame, output, attributes, attribute_count, bytes, error);
}
