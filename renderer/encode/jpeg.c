#include "renderer/encode/jpeg.h"
#include "renderer/encode/pixels.h"
#include <stdlib.h>
#include <string.h>
#include <turbojpeg.h>

/* Markers of ITU-T T.81, table B.1. */
#define MARKER 0xff
#define APP0 0xe0
#define COMMENT 0xfe
#define MOST_COMMENT 65533u /* what its two bytes of length leave */

/* After the start of the image and JFIF's own segment, which has to be the first. */
static bool write_with_comment(
    const uint8_t *jpeg, size_t size, const char *text, size_t length, struct bytes_file *file)
{
    size_t head = 2;
    if (size >= 6 && jpeg[2] == MARKER && jpeg[3] == APP0)
        head += 2 + (size_t)(jpeg[4] << 8 | jpeg[5]);
    if (head > size)
        head = 2;
    const uint8_t marker[4] = {
        MARKER, COMMENT, (uint8_t)((length + 2) >> 8), (uint8_t)(length + 2)};
    return bytes_file_write(file, jpeg, head) &&
           (!length || (bytes_file_write(file, marker, sizeof marker) &&
                           bytes_file_write(file, text, length))) &&
           bytes_file_write(file, jpeg + head, size - head);
}

static uint8_t *pack(const struct pen_frame *frame, uint32_t channels)
{
    size_t row = (size_t)frame->width * channels;
    uint8_t *pixels = malloc(row * frame->height);
    for (uint32_t y = 0; pixels && y < frame->height; y++)
        pixels_row(
            &frame->planes[0], frame->width, y, channels, PIXELS_U8, channels, pixels + row * y);
    return pixels;
}

bool jpeg_encode(const struct pen_frame *frame, uint32_t quality, const char *description,
    struct pen_bytes *bytes, struct pen_error *error)
{
    uint32_t channels = frame->planes[0].channels == 1 ? 1 : 3;
    size_t length = strlen(description);
    unsigned char *jpeg = NULL;
    unsigned long size = 0;
    struct bytes_file file = {0};
    uint8_t *pixels = pack(frame, channels);
    tjhandle encoder = tjInitCompress();
    bool done =
        pixels && encoder &&
        tjCompress2(encoder, pixels, (int)frame->width, 0, (int)frame->height,
            channels == 1 ? TJPF_GRAY : TJPF_RGB, &jpeg, &size,
            channels == 1 ? TJSAMP_GRAY : TJSAMP_420, (int)quality, TJFLAG_ACCURATEDCT) == 0;
    if (!done)
        pen_fail(error, pixels && encoder ? PEN_INTERNAL : PEN_UNAVAILABLE, "",
            "The JPEG file could not be encoded: %s.",
            pixels && encoder ? tjGetErrorStr2(encoder) : "out of memory");
    else if (!write_with_comment(
                 jpeg, size, description, length < MOST_COMMENT ? length : MOST_COMMENT, &file))
        done =
            pen_fail(error, PEN_UNAVAILABLE, "", "The JPEG file could not be kept: out of memory.");
    tjFree(jpeg);
    if (encoder)
        tjDestroy(encoder);
    free(pixels);
    if (done)
        *bytes = file.bytes;
    else
        pen_bytes_finish(&file.bytes);
    return done;
}
