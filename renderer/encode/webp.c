#include "renderer/encode/webp.h"
#include "renderer/encode/pixels.h"
#include <stdlib.h>
#include <string.h>
#include <webp/encode.h>

/* 0 (fast) to 6 (small). Lossless: WebP's level 1, at 2 the time grows faster than
 * the file shrinks. */
#define METHOD_LOSSY 2
#define LEVEL_LOSSLESS 1

/* libwebp's writer must be freed by libwebp, our bytes with free(): so an own writer. */
static int append(const uint8_t *data, size_t size, const WebPPicture *picture)
{
    return bytes_file_write(picture->custom_ptr, data, size);
}

/* RGBA rows as the library wants them: grey is repeated, alpha is 255 unless it is meant. */
static uint8_t *to_rgba(const struct pen_frame *frame)
{
    const struct pen_plane *plane = &frame->planes[0];
    uint8_t *rgba = malloc((size_t)frame->width * frame->height * 4);
    for (uint32_t y = 0; rgba && y < frame->height; y++) {
        uint8_t *row = rgba + (size_t)y * frame->width * 4;
        pixels_row(plane, frame->width, y, plane->channels, PIXELS_U8, 4, row);
        for (uint32_t x = 0; x < frame->width && plane->channels != 4; x++) {
            if (plane->channels == 1)
                row[x * 4 + 1] = row[x * 4 + 2] = row[x * 4];
            row[x * 4 + 3] = 255;
        }
    }
    return rgba;
}

bool webp_encode(const struct pen_frame *frame, uint32_t quality, struct pen_bytes *bytes,
    struct pen_error *error)
{
    WebPConfig config;
    WebPPicture picture;
    struct bytes_file file = {0};
    if (!WebPConfigInit(&config) || !WebPPictureInit(&picture))
        return pen_fail(error, PEN_INTERNAL, "", "The installed libwebp does not fit this build.");
    if (quality >= 100) {
        WebPConfigLosslessPreset(&config, LEVEL_LOSSLESS);
        config.exact = 1; /* colours under alpha 0 are data too */
    } else {
        config.quality = (float)quality;
        config.method = METHOD_LOSSY;
    }
    picture.use_argb = config.lossless;
    picture.width = (int)frame->width;
    picture.height = (int)frame->height;
    picture.writer = append;
    picture.custom_ptr = &file;
    uint8_t *rgba = to_rgba(frame);
    bool alpha = frame->planes[0].channels == 4;
    int stride = (int)frame->width * 4;
    bool ok = rgba &&
              (alpha ? WebPPictureImportRGBA(&picture, rgba, stride)
                     : WebPPictureImportRGBX(&picture, rgba, stride)) &&
              WebPEncode(&config, &picture);
    WebPPictureFree(&picture);
    free(rgba);
    if (ok) {
        *bytes = file.bytes;
        return true;
    }
    pen_bytes_finish(&file.bytes);
    return pen_fail(error, PEN_INTERNAL, "",
        "The WebP file could not be encoded (libwebp error %d).", (int)picture.error_code);
}
