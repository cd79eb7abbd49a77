#include "renderer/import/import.h"
#include "renderer/import/bundle.h"
#include "renderer/import/convert/context.h"
#include "renderer/import/image/image.h"
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

static bool import_files(
    struct psc_builder *builder, struct imp_files *files, struct pen_error *error)
{
    const struct imp_file *file = imp_files_document(files, error);
    struct imp_bytes data;
    return file && imp_files_load(files, file, &data, error) &&
           import_document(builder, data, files, file->name, error);
}

static bool is_json(const uint8_t *data, size_t bytes)
{
    size_t i = bytes >= 3 && !memcmp(data, "\xef\xbb\xbf", 3) ? 3 : 0; /* byte order mark */
    while (i < bytes && i < 4096 && strchr(" \t\r\n", data[i]) && data[i])
        i++;
    return i < bytes && data[i] == '{';
}

static bool import_scene(
    struct psc_builder *builder, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    struct imp_files files = {0};
    bool done = false;
    if (!bytes)
        return pen_fail(error, PEN_INVALID, "", "The upload is empty.");
    if (bytes >= 8 && !memcmp(data, PEN_BUNDLE_MAGIC, 8))
        done = imp_files_open_bundle(&files, data, bytes, error) &&
               import_files(builder, &files, error);
    else if (bytes >= 4 && (!memcmp(data, "PK\3\4", 4) || !memcmp(data, "PK\5\6", 4)))
        done =
            imp_files_open_zip(&files, data, bytes, error) && import_files(builder, &files, error);
    else if ((bytes >= 4 && !memcmp(data, "glTF", 4)) || is_json(data, bytes))
        done = import_document(builder, (struct imp_bytes){data, bytes}, &files, "", error);
    else
        pen_fail(error, PEN_UNKNOWN_TYPE, "",
            "The upload is neither glTF binary nor glTF JSON nor a zip of them.");
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
    return done;
}
