/* A multi-file upload as one file: what the front end writes when a client posts a .gltf with its
 * buffers and images, and what penumbra-import reads. The scene's id is the SHA-256 of this file;
 * entries are sorted by name, so that the order of upload does not matter.
 *
 *   char magic[8] = "PENBNDL1"; uint32_t count; uint32_t reserved = 0;
 *   count x { uint32_t name_bytes; uint32_t reserved; uint64_t data_bytes; name; data } (unpadded)
 *
 * Names are relative, '/'-separated, without "." or ".." parts, at most 255 bytes, unique. */
#pragma once
#define PEN_BUNDLE_MAGIC "PENBNDL1"
#define PEN_BUNDLE_MAX_ENTRIES 4096
#define PEN_BUNDLE_MAX_NAME 255

/* One scene of several in an upload: where the client chose it with "entry", what stands above, or
 * the zip, has this in front, so that the id tells which one it is.
 *
 *   char magic[8] = "PENENTR1"; uint32_t name_bytes; uint32_t reserved = 0; name */
#define PEN_ENTRY_MAGIC "PENENTR1"
