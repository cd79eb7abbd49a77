/* A glTF document with everything that it points to outside of itself resolved: buffers, buffer
 * views (meshopt compression unpacked) and the bytes of images. What is left is plain JSON
 * without any URI, for tinygltf. */
#pragma once
#include "renderer/import/files/files.h"

struct cJSON;
struct psc_builder;

struct imp_view {
    const uint8_t *data; /* NULL: zeros, as many as are asked for */
    size_t bytes;
    uint32_t stride; /* 0: tightly packed */
};

struct imp_image {
    struct imp_bytes data;
    const char *mime; /* "" when not told */
};

struct imp_document {
    struct cJSON *root;
    struct imp_bytes *buffers; /* data NULL: a fallback buffer that holds nothing */
    struct imp_view *views;
    struct imp_image *images;
    uint32_t buffer_count, view_count, image_count;
    char *text; /* for tinygltf: without buffers, images, animations, skins */
    size_t text_bytes;
    uint8_t **owned; /* unpacked memory */
    size_t owned_count, owned_capacity;
};

/* `data` is a .glb or .gltf and must outlive *document, as must `files` (the other files of the
 * upload; empty when there are none), in which it is called `name`. Warnings go to `builder`. On
 * failure *document is empty. Errors: PEN_INVALID, PEN_TOO_BIG. */
bool imp_document_open(struct imp_document *document, const uint8_t *data, size_t bytes,
    struct imp_files *files, const char *name, struct psc_builder *builder,
    struct pen_error *error);
void imp_document_finish(struct imp_document *document);

/* memory.c: some that lives as long as the document. */
uint8_t *imp_document_alloc(struct imp_document *document, size_t bytes);

/* meshopt_views.c: what a view says of EXT_ or KHR_meshopt_compression; NULL: nothing. */
const struct cJSON *imp_meshopt_of(const struct cJSON *view);
/* Unpacks the views that carry it into document->views. */
bool imp_document_unpack_views(struct imp_document *document, struct pen_error *error);

/* repair.c: what is plain, though the specification forbids it, with a warning. */
bool imp_repair_version(struct cJSON *root, struct psc_builder *builder, struct pen_error *error);
bool imp_old_version(const char *what, struct pen_error *error); /* fails: `what` is too old */
void imp_repair_views(const struct cJSON *root, struct psc_builder *builder);
void imp_repair_indices(struct imp_document *document, struct psc_builder *builder);

/* draco.c: makes ordinary primitives of those that carry KHR_draco_mesh_compression. */
bool imp_document_unpack_draco(struct imp_document *document, struct pen_error *error);

/* extensions.c: refuses required extensions that the importer lacks, by name, and warns of used
 * ones that change the picture. */
bool imp_extensions_check(
    const struct cJSON *root, struct psc_builder *builder, struct pen_error *error);

/* data_uri.c: decodes the payload of "data:<mime>;base64,<payload>" in place; *mime is the
 * part before ';', cut out of `uri` in place. False when `uri` is something else or damaged. */
bool imp_is_data_uri(const char *uri);
bool imp_data_uri_decode(char *uri, const char **mime, struct imp_bytes *payload);
