/* The files of one upload: a bundle's or a zip's entries. A glTF document can name these and
 * nothing else; no name ever reaches the file system. */
#pragma once
#include "protocol/error.h"
#include "renderer/import/names.h"
#include <stddef.h>

struct imp_bytes {
    const uint8_t *data;
    size_t bytes;
};

struct zip;

struct imp_file {
    char *name;          /* owned, NUL-terminated, no NUL inside */
    const uint8_t *data; /* NULL: still in the zip */
    size_t bytes;
    uint64_t zip_entry;
    bool doubted;   /* pen_names_doubt() */
    uint8_t *owned; /* unpacked from the zip */
};

struct imp_files {
    struct imp_file *items;
    uint32_t count;
    uint32_t unusable;      /* entries of a zip that are left out for their names */
    struct pen_names names; /* of the items */
    struct zip *zip;
};

/* Reads the table of a bundle (bundle.h) or zip; the data must outlive *files. On failure *files is
 * empty. Errors: PEN_INVALID (damaged, duplicate names, encrypted; in a bundle unsafe names, which a
 * zip's entry is left out for), PEN_TOO_BIG. */
bool imp_files_open_bundle(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error);
bool imp_files_open_zip(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error);
void imp_files_finish(struct imp_files *files);

/* The only zip among files of which none is a scene; NULL: that is not how it is. */
const struct imp_file *imp_files_inner_zip(const struct imp_files *files);
/* The .glb or .gltf to import: what `entry` names; when it is NULL, the one nearest to the root, and
 * *others tells whether there are more. PEN_INVALID when there is none, or more than one there. */
const struct imp_file *imp_files_document(
    struct imp_files *files, const char *entry, bool *others, struct pen_error *error);
/* The file that `uri`, relative to the folder of the file called `base`, means (pen_names_find).
 * Errors, at `pointer`: PEN_INVALID for addresses on a network and files that were not uploaded. */
bool imp_files_resolve(struct imp_files *files, const char *base, const char *uri,
    const char *pointer, struct imp_bytes *found, struct pen_error *error);
/* Unpacks the file when needed. Errors: PEN_INVALID (damaged). */
bool imp_files_load(struct imp_files *files, const struct imp_file *file, struct imp_bytes *found,
    struct pen_error *error);
