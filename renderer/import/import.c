#include "renderer/import/import.h"
#include "renderer/import/base/text.h"
#include "renderer/import/bundle.h"
#include "renderer/import/convert/convert.h"
#include "renderer/import/files/foreign.h"
#include "renderer/import/image/image.h"
#include "renderer/pose/bake.h"
#include <stdlib.h>
#include <string.h>

/* One .glb or .gltf, called `name` among `files`. */
static bool import_document(struct psc_builder *builder, struct imp_bytes data,
    struct imp_files *files, const char *name, struct pen_error *error)
{
    struct imp_document document;
    struct gltf_model model;
    if (!imp_document_open(&document, data.data, data.bytes, files, name, builder, error))
        return false;
    bool done = gltf_tiny_parse(document.text, document.text_bytes, &model, error);
    if (done) {
        done = imp_convert(&document, &model, builder, error);
        gltf_tiny_free(&model);
    }
    imp_document_finish(&document);
    return done;
}

static bool import_files(struct psc_builder *builder, struct imp_files *files, const char *entry,
    struct pen_error *error)
{
    bool others;
    const struct imp_file *file = imp_files_document(files, entry, &others, error);
    struct imp_bytes data;
    if (!file || !imp_files_load(files, file, &data, error))
        return false;
    if (others)
        psc_builder_add_warning(builder,
            "The upload holds several scenes; \"%s\" is taken, and ?entry= would take another.",
            imp_text(file->name).s);
    return import_document(builder, data, files, file->name, error);
}

/* A zip that holds nothing but another one, as sites pack what was packed. */
static bool import_packed(struct psc_builder *builder, struct imp_files *files, const char *entry,
    struct pen_error *error)
{
    const struct imp_file *zip = imp_files_inner_zip(files);
    struct imp_files inner;
    struct imp_bytes data;
    if (!zip)
        return import_files(builder, files, entry, error);
    if (!imp_files_load(files, zip, &data, error) ||
        !imp_files_open_zip(&inner, data.data, data.bytes, error))
        return false;
    bool done = import_files(builder, &inner, entry, error);
    imp_files_finish(&inner);
    return done;
}

static bool is_json(const uint8_t *data, size_t bytes)
{
    size_t i = bytes >= 3 && !memcmp(data, "\xef\xbb\xbf", 3) ? 3 : 0; /* byte order mark */
    while (i < bytes && i < 4096 && strchr(" \t\r\n", data[i]) && data[i])
        i++;
    bool comment = bytes - i > 1 && data[i] == '/' && (data[i + 1] == '/' || data[i + 1] == '*');
    return i < bytes && (data[i] == '{' || comment); /* which JSON has none of: it is told so */
}

/* Cuts the choice of an entry off the front of the upload. False when it is damaged. */
static bool take_entry(struct imp_bytes *upload, char entry[PEN_BUNDLE_MAX_NAME + 1])
{
    uint32_t bytes;
    if (upload->bytes < 16)
        return false;
    memcpy(&bytes, upload->data + 8, 4);
    if (!bytes || bytes > PEN_BUNDLE_MAX_NAME || bytes > upload->bytes - 16)
        return false;
    memcpy(entry, upload->data + 16, bytes);
    entry[bytes] = 0;
    *upload = (struct imp_bytes){upload->data + 16 + bytes, upload->bytes - 16 - bytes};
    return true;
}

static bool begins(struct imp_bytes upload, const char *magic)
{
    size_t bytes = strlen(magic);
    return upload.bytes >= bytes && !memcmp(upload.data, magic, bytes);
}

static bool import_scene(
    struct psc_builder *builder, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    struct imp_bytes upload = {data, bytes};
    struct imp_files files = {0};
    char name[PEN_BUNDLE_MAX_NAME + 1], *entry = NULL;
    bool done = false;
    if (begins(upload, PEN_ENTRY_MAGIC) && !take_entry(&upload, entry = name))
        return pen_fail(error, PEN_INVALID, "", "The upload is truncated.");
    if (!upload.bytes)
        return pen_fail(error, PEN_INVALID, "", "The upload is empty.");
    const char *foreign = imp_foreign_bytes(upload.data, upload.bytes);
    bool is_zip = begins(upload, "PK\3\4") || begins(upload, "PK\5\6");
    if (begins(upload, PEN_BUNDLE_MAGIC) || is_zip)
        done = (is_zip ? imp_files_open_zip : imp_files_open_bundle)(
                   &files, upload.data, upload.bytes, error) &&
               import_packed(builder, &files, entry, error);
    else if (!begins(upload, "glTF") && !is_json(upload.data, upload.bytes))
        pen_fail(error, PEN_UNKNOWN_TYPE, "",
            "The upload is neither glTF binary nor glTF JSON nor a zip of them.%s%s",
            foreign ? " " : "", foreign ? foreign : "");
    else if (entry)
        pen_fail(error, PEN_INVALID, "/entry",
            "entry chooses among the files of an upload; this one is a single file.");
    else
        done = import_document(builder, upload, &files, "", error);
    imp_files_finish(&files);
    return done;
}

static bool import_image(
    struct psc_builder *builder, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    uint32_t width, height;
    uint8_t *rgba;
    bool damaged;
    struct imp_bytes file = {data, bytes};
    if (!bytes)
        return pen_fail(error, PEN_INVALID, "", "The upload is empty.");
    if (!imp_image_header(file, &width, &height, error) ||
        !imp_image_decode(file, width, height, &rgba, &damaged, error))
        return false;
    if (!damaged) {
        struct psc_material material = psc_material_default();
        psc_builder_add_material(builder, &material);
        uint32_t image = psc_builder_add_image(builder, width, height, true, rgba);
        const struct psc_texture texture = {image, PSC_CLAMP, PSC_CLAMP, 0};
        psc_builder_add_texture(builder, &texture);
    }
    free(rgba);
    if (damaged)
        return pen_fail(error, PEN_INVALID, "", "The image is damaged or truncated.");
    return true;
}

bool pen_import(const uint8_t *data, size_t bytes, enum pen_import_mode mode,
    const uint8_t source[PEN_ID_BYTES], void **blob, size_t *blob_bytes, struct pen_error *error)
{
    struct psc_builder *builder = psc_builder_create();
    bool done =
        (mode == PEN_IMPORT_IMAGE ? import_image : import_scene)(builder, data, bytes, error) &&
        psc_builder_finish(builder, source, blob, blob_bytes, error);
    psc_builder_destroy(builder);
    if (!done || pose_bake(*blob, blob_bytes, error))
        return done;
    free(*blob);
    *blob = NULL;
    return false;
}
