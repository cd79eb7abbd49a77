#include "renderer/import/image/image.h"
#include <stdlib.h>
#include <turbojpeg.h>

bool imp_jpeg_header(struct imp_bytes data, uint32_t *width, uint32_t *height)
{
    tjhandle jpeg = tjInitDecompress();
    int w = 0, h = 0, sampling, space;
    bool done =
        jpeg && !tjDecompressHeader3(jpeg, data.data, data.bytes, &w, &h, &sampling, &space);
    if (jpeg)
        tjDestroy(jpeg);
    *width = (uint32_t)w;
    *height = (uint32_t)h;
    return done && w > 0 && h > 0;
}

/* CMYK as Adobe's programs write it: inverted. */
static void cmyk_to_rgba(uint8_t *pixels, size_t count)
{
    for (size_t i = 0; i < count; i++) {
        uint8_t *p = pixels + 4 * i;
        unsigned k = p[3];
        for (int c = 0; c < 3; c++)
            p[c] = (uint8_t)((p[c] * k + 127) / 255);
        p[3] = 255;
    }
}

bool imp_jpeg_decode(
    struct imp_bytes data, uint32_t width, uint32_t height, uint8_t *rgba, bool *damaged)
{
    tjhandle jpeg = tjInitDecompress();
    int w, h, sampling, space;
    if (!jpeg || tjDecompressHeader3(jpeg, data.data, data.bytes, &w, &h, &sampling, &space) ||
        (uint32_t)w != width || (uint32_t)h != height) {
        if (jpeg)
            tjDestroy(jpeg);
        return false;
    }
    bool cmyk = space == TJCS_CMYK || space == TJCS_YCCK;
    int failed = tjDecompress2(jpeg, data.data, data.bytes, rgba, w, 0, h,
        cmyk ? TJPF_CMYK : TJPF_RGBA, TJFLAG_LIMITSCANS);
    *damaged = failed && tjGetErrorCode(jpeg) == TJERR_WARNING;
    tjDestroy(jpeg);
    if (cmyk)
        cmyk_to_rgba(rgba, (size_t)width * height);
    return !failed || *damaged;
}
