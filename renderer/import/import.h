/* Turns an untrusted upload into a scene blob. Runs in the sandboxed importer (import_process.h)
 * and in tests; touches no file, no socket and no global state. */
#pragma once
#include "protocol/error.h"
#include "protocol/limits.h"
#include <stddef.h>

enum pen_import_mode {
    PEN_IMPORT_SCENE, /* glTF binary, glTF JSON with data URIs, zip, bundle */
    PEN_IMPORT_IMAGE, /* PNG, JPEG or WebP: a blob with one sRGB image, one texture, no geometry */
};

/* `source` is the SHA-256 that the blob will carry. On success *blob (the caller frees it) holds a
 * file that psc_open accepts. Errors: PEN_UNKNOWN_TYPE for bytes of no known kind,
 * PEN_TOO_BIG for more than budget.h allows, PEN_INVALID for everything else that is wrong
 * with the upload; pointer names the place in the glTF document where that is known. */
bool pen_import(const uint8_t *data, size_t bytes, enum pen_import_mode mode,
    const uint8_t source[PEN_ID_BYTES], void **blob, size_t *blob_bytes, struct pen_error *error);
