#include "renderer/import/image/image.h"
#include "protocol/memory.h"
#include "protocol/srgb.h"
#include "renderer/import/base/budget.h"
#include <math.h>
#include <stdlib.h>
#include <string.h>

enum imp_image_kind imp_image_sniff(struct imp_bytes data)
{
    const uint8_t *p = data.data;
    if (data.bytes >= 8 && !memcmp(p, "\x89PNG\r\n\x1a\n", 8))
        return IMP_PNG;
    if (data.bytes >= 3 && !memcmp(p, "\xff\xd8\xff", 3))
        return IMP_JPEG;
    if (data.bytes >= 12 && !memcmp(p, "RIFF", 4) && !memcmp(p + 8, "WEBP", 4))
        return IMP_WEBP;
    return IMP_UNKNOWN_IMAGE;
}

const char *imp_image_mime(enum imp_image_kind kind)
{
    switch (kind) {
    case IMP_PNG:
        return "image/png";
    case IMP_JPEG:
        return "image/jpeg";
    case IMP_WEBP:
        return "image/webp";
    case IMP_UNKNOWN_IMAGE:
        break;
    }
    return "";
}

/* What bytes that we do not decode are, as far as their first ones say. */
static const char *foreign(struct imp_bytes data)
{
    static const struct {
        const char *name, *magic;
        size_t at, bytes;
    } kinds[] = {{"KTX2 (Basis)", "\xabKTX 20\xbb", 0, 8}, {"KTX", "\xabKTX 11\xbb", 0, 8},
        {"DDS", "DDS ", 0, 4}, {"AVIF", "ftypavif", 4, 8}, {"GIF", "GIF8", 0, 4},
        {"BMP", "BM", 0, 2}, {"TIFF", "II*", 0, 4}, {"TIFF", "MM\0*", 0, 4},
        {"Photoshop's", "8BPS", 0, 4}, {"OpenEXR", "v/1\1", 0, 4}, {"HDR", "#?", 0, 2},
        {"JPEG XL", "\xff\x0a", 0, 2}, {"JPEG XL", "JXL ", 4, 4}, {"JPEG 2000", "jP  ", 4, 4},
        {"HEIF", "ftyphei", 4, 7}, {"HEIF", "ftypmif1", 4, 8}, {"Basis", "sB", 0, 2},
        {"SVG", "<svg", 0, 4}};
    for (size_t i = 0; i < sizeof kinds / sizeof *kinds; i++)
        if (data.bytes >= kinds[i].at + kinds[i].bytes &&
            !memcmp(data.data + kinds[i].at, kinds[i].magic, kinds[i].bytes))
            return kinds[i].name;
    return data.bytes ? "of an unknown kind" : "empty";
}

bool imp_image_header(
    struct imp_bytes data, uint32_t *width, uint32_t *height, struct pen_error *error)
{
    bool read = false;
    switch (imp_image_sniff(data)) {
    case IMP_PNG:
        read = imp_png_header(data, width, height);
        break;
    case IMP_JPEG:
        read = imp_jpeg_header(data, width, height);
        break;
    case IMP_WEBP:
        read = imp_webp_header(data, width, height);
        break;
    case IMP_UNKNOWN_IMAGE:
        return pen_fail(error, PEN_UNKNOWN_TYPE, "",
            "The image is %s; PNG, JPEG and WebP can be read.", foreign(data));
    }
    if (!read || !*width || !*height)
        return pen_fail(error, PEN_INVALID, "", "The image's header is damaged.");
    if ((uint64_t)*width * *height > IMP_MAX_IMAGE_PIXELS)
        return pen_fail(error, PEN_TOO_BIG, "",
            "The image has %u x %u pixels; %llu million are allowed.", *width, *height,
            IMP_MAX_IMAGE_PIXELS >> 20);
    return true;
}

bool imp_image_decode(struct imp_bytes data, uint32_t width, uint32_t height, uint8_t **rgba,
    bool *damaged, struct pen_error *error)
{
    size_t bytes = 4 * (size_t)width * height;
    bool done = false;
    *damaged = false;
    *rgba = pen_alloc_zero(bytes, 1);
    switch (imp_image_sniff(data)) {
    case IMP_PNG:
        done = imp_png_decode(data, *rgba, bytes, damaged);
        break;
    case IMP_JPEG:
        done = imp_jpeg_decode(data, width, height, *rgba, damaged);
        break;
    case IMP_WEBP:
        done = imp_webp_decode(data, *rgba, bytes, width);
        break;
    case IMP_UNKNOWN_IMAGE:
        break;
    }
    if (done)
        return true;
    free(*rgba);
    *rgba = NULL;
    *damaged = false;
    return pen_fail(error, PEN_INVALID, "", "The image is damaged or truncated.");
}

static float to_linear(uint8_t x)
{
    return pen_srgb_decodef((float)x / 255);
}

static uint8_t to_srgb(float x)
{
    return (uint8_t)lrintf(pen_srgb_encodef(x) * 255);
}

void imp_image_halve(uint8_t *rgba, uint32_t *width, uint32_t *height, bool srgb)
{
    float linear[256];
    uint8_t back[4097]; /* indexed by linear value; 12 bits tell every sRGB code but the darkest */
    for (int i = 0; i < 256; i++)
        linear[i] = to_linear((uint8_t)i);
    for (int i = 0; i <= 4096; i++)
        back[i] = to_srgb((float)i / 4096);
    uint32_t w = *width > 1 ? *width / 2 : 1, h = *height > 1 ? *height / 2 : 1;
    size_t dx = *width > 1 ? 4 : 0, dy = *height > 1 ? 4 * (size_t)*width : 0;
    for (uint32_t y = 0; y < h; y++)
        for (uint32_t x = 0; x < w; x++) {
            const uint8_t *from = rgba + (size_t)y * (dy ? 2 * dy : 0) + (size_t)x * 2 * dx;
            uint8_t *to = rgba + 4 * ((size_t)y * w + x); /* never ahead of `from` */
            for (int c = 0; c < 4; c++) {
                uint8_t p[4] = {from[c], from[dx + c], from[dy + c], from[dx + dy + c]};
                if (srgb && c < 3)
                    to[c] = back[lrintf(
                        1024 * (linear[p[0]] + linear[p[1]] + linear[p[2]] + linear[p[3]]))];
                else
                    to[c] = (uint8_t)((p[0] + p[1] + p[2] + p[3] + 2) / 4);
            }
        }
    *width = w;
    *height = h;
}
