#include "renderer/import/image/image.h"
#include <webp/decode.h>

bool imp_webp_header(struct imp_bytes data, uint32_t *width, uint32_t *height)
{
    WebPBitstreamFeatures features;
    if (WebPGetFeatures(data.data, data.bytes, &features) != VP8_STATUS_OK ||
        features.has_animation || features.width < 1 || features.height < 1)
        return false;
    *width = (uint32_t)features.width;
    *height = (uint32_t)features.height;
    return true;
}

bool imp_webp_decode(struct imp_bytes data, uint8_t *rgba, size_t rgba_bytes, uint32_t width)
{
    return WebPDecodeRGBAInto(data.data, data.bytes, rgba, rgba_bytes, (int)width * 4) != NULL;
}
