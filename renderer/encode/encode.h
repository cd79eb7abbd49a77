/* Image files from finished frames. Thread-safe: no state between calls. C++ stays behind it.
 *
 * What each format takes from a plane (pen_encode_wants says what a renderer should deliver):
 *   PNG, TIFF    8 bit: PEN_PIXEL_RGBA8 as it is. 16 bit: PEN_PIXEL_RGBA32F (or 16F) whose values
 *                are already display-encoded in [0, 1]; they are only quantised, round to nearest
 *   JPEG, WebP   PEN_PIXEL_RGBA8; JPEG drops alpha, WebP at quality 100 is lossless
 *   EXR          PEN_PIXEL_RGBA16F or RGBA32F, scene-linear. Bit depth 16: half, 32: float, 0: each
 *                plane in the precision in which it was delivered
 * The renderer tone-maps and display-encodes; this module never does.
 *
 * All but EXR write planes[0] only. EXR calls the channels of a single plane R G B A (one channel:
 * Y, the depth plane: Z). Several planes are layers of one part: "beauty" keeps R G B A, the others
 * are
 *   <plane>.R .G .B .A
 *   <plane>.X .Y .Z      normal and position
 *   depth.Z
 *   <plane>.Y            one channel
 *
 * PNG of the beauty plane says that it is sRGB, EXR that its primaries are those of BT.709.
 *
 * One channel is written as grey, three as RGB, four as RGBA; alpha is stored unchanged, and colours
 * as they are: a plane for a file of integers holds them not multiplied by alpha, one for EXR
 * multiplied, as each format's readers expect. NaN is written as 0, infinities as the largest finite value of the target. */
#pragma once
#include "renderer/encode/bytes.h"
#include "renderer/picture.h"

/* Encodes `frame` as output->format asks (bit depth 0: the format's default). `attributes` are
 * written as metadata where the format has any: NUL-terminated "key=value" strings,
 * `attribute_count` of them (PNG: text chunks, EXR: string attributes, TIFF and JPEG: one
 * description, WebP: none); no time stamps, so that the same request gives the same bytes. On
 * failure *bytes is zeroed. Errors: PEN_INTERNAL. */
bool pen_encode(const struct pen_frame *frame, const struct pen_output *output,
    const char *const *attributes, uint32_t attribute_count, struct pen_bytes *bytes,
    struct pen_error *error);
