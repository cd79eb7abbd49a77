/* Decoding of uploaded images: the header first, then the pixels into a buffer whose size was
 * agreed to. Nothing here believes a file name or a MIME type. */
#pragma once
#include "protocol/error.h"
#include "renderer/import/files/files.h"

enum imp_image_kind { IMP_UNKNOWN_IMAGE, IMP_PNG, IMP_JPEG, IMP_WEBP };

enum imp_image_kind imp_image_sniff(struct imp_bytes data);
const char *imp_image_mime(enum imp_image_kind kind);

/* Reads only the header. Errors: PEN_UNKNOWN_TYPE (no known kind), PEN_INVALID
 * (damaged), PEN_TOO_BIG (more than IMP_MAX_IMAGE_PIXELS). */
bool imp_image_header(
    struct imp_bytes data, uint32_t *width, uint32_t *height, struct pen_error *error);

/* The pixels as RGBA8, top row first; the caller frees *rgba. `width` and `height`
 * are what imp_image_header gave. *damaged tells that some pixels are missing (PNG
 * and JPEG). Errors: PEN_INVALID. */
bool imp_image_decode(struct imp_bytes data, uint32_t width, uint32_t height, uint8_t **rgba,
    bool *damaged, struct pen_error *error);

/* Halves RGBA8 in place (box filter, in linear light when srgb); an odd last row or column is
 * dropped. Sides of 1 stay. */
void imp_image_halve(uint8_t *rgba, uint32_t *width, uint32_t *height, bool srgb);

/* image_png.c, image_jpeg.c, image_webp.c: what the functions above dispatch to. */
bool imp_png_header(struct imp_bytes data, uint32_t *width, uint32_t *height);
bool imp_png_decode(struct imp_bytes data, uint8_t *rgba, size_t rgba_bytes, bool *damaged);
bool imp_jpeg_header(struct imp_bytes data, uint32_t *width, uint32_t *height);
bool imp_jpeg_decode(
    struct imp_bytes data, uint32_t width, uint32_t height, uint8_t *rgba, bool *damaged);
bool imp_webp_header(struct imp_bytes data, uint32_t *width, uint32_t *height);
bool imp_webp_decode(struct imp_bytes data, uint8_t *rgba, size_t rgba_bytes, uint32_t width);
