/* The part of OpenImageIO that writes files into memory, as C. No exception passes it. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"
#include "renderer/encode/pixels.h"

#ifdef __cplusplus
extern "C" {
#endif

#define OIIO_MAX_CHANNELS (4 * PEN_LAYERS)

struct oiio_file {
    const char *extension;   /* chooses the format: "exr", "jpg", "tif" */
    const char *compression; /* as OpenImageIO spells it, or NULL */
    uint32_t width, height, channels;
    enum pixels_sample sample;         /* of the rows that are passed: U8, U16, or FLOAT for EXR */
    char names[OIIO_MAX_CHANNELS][32]; /* of the channels; "" in the first: the default names */
    enum pixels_sample stored[OIIO_MAX_CHANNELS]; /* EXR: HALF or FLOAT for each channel */
    const char *const *attributes;                /* "key=value" */
    uint32_t attribute_count;
    bool attributes_as_description; /* one text instead of one attribute each */
    bool bt709;                     /* EXR: says that R, G and B are those of BT.709 */
};

/* Asks for rows [first, first + count): interleaved samples, channels * width per row. */
typedef void oiio_rows(void *user, uint32_t first, uint32_t count, void *out);

/* Writes the whole file. On success the caller owns *bytes. Errors: PEN_INTERNAL. */
bool oiio_write(const struct oiio_file *file, oiio_rows *rows, void *user, struct pen_bytes *bytes,
    struct pen_error *error);

#ifdef __cplusplus
}
#endif
