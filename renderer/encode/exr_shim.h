/* The part of OpenEXR that writes a file into memory, as C. No exception passes it. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/encode/rows.h"
#include "renderer/picture.h"

#ifdef __cplusplus
extern "C" {
#endif

#define EXR_MAX_CHANNELS (4 * PEN_LAYERS)

struct exr_file {
    uint32_t width, height, channels;
    char names[EXR_MAX_CHANNELS][32];
    bool half[EXR_MAX_CHANNELS];   /* stored as half; else as float */
    const char *const *attributes; /* "key=value" */
    uint32_t attribute_count;
    bool bt709; /* says that R, G and B are those of BT.709 */
};

/* Scan lines of floats, ZIP. `rows` gives floats, one per channel and pixel, finite and within what
 * is stored. On success the caller owns *bytes. Errors: PEN_INTERNAL. */
bool exr_write(const struct exr_file *file, encode_rows *rows, void *user, struct pen_bytes *bytes,
    struct pen_error *error);

#ifdef __cplusplus
}
#endif
