#include "clients/cli/upload.h"
#include "clients/cli/gltf_files.h"
#include "protocol/request.h"
#include "renderer/import/names.h"
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>

bool cli_is_id(const char *text)
{
    uint8_t id[PEN_ID_BYTES];
    return strlen(text) == PEN_ID_HEX && pen_id_from_hex(text, id);
}

static bool ends_with(const char *path, const char *ending)
{
    size_t length = strlen(path), tail = strlen(ending);
    return length > tail && !strcasecmp(path + length - tail, ending);
}

static const char *base_name(const char *path)
{
    const char *slash = strrchr(path, '/');
    return slash ? slash + 1 : path;
}

/* SHA-256 and size of an open file; of what the server stores for it when an entry is chosen. */
static bool hash_file(FILE *file, const char *entry, char id[PEN_ID_HEX + 1], uint64_t *bytes)
{
    static unsigned char block[1 << 16];
    uint8_t digest[PEN_ID_BYTES];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    bool ok = hash && EVP_DigestInit_ex(hash, EVP_sha256(), NULL);
    if (ok && entry) {
        uint32_t length = (uint32_t)strlen(entry);
        unsigned char head[16] = PEN_ENTRY_MAGIC;
        for (int i = 0; i < 4; i++)
            head[8 + i] = (unsigned char)(length >> 8 * i);
        ok = EVP_DigestUpdate(hash, head, sizeof head) && EVP_DigestUpdate(hash, entry, length);
    }
    *bytes = 0;
    for (size_t got; ok && (got = fread(block, 1, sizeof block, file)) > 0; *bytes += got)
        ok = EVP_DigestUpdate(hash, block, got);
    ok = ok && !ferror(file) && EVP_DigestFinal_ex(hash, digest, NULL);
    EVP_MD_CTX_free(hash);
    if (ok)
        pen_id_to_hex(digest, id);
    return ok;
}

/* Asks for what is stored under the id; *described stays NULL when nothing is. */
static int describe(
    const struct cli_server *server, const char *folder, const char *id, cJSON **described)
{
    struct cli_answer answer;
    char *path = cli_format("%s/%s", folder, id);
    struct cli_call call = {.method = "GET", .path = path, .missing_is_ok = true};
    int status = cli_call(server, &call, &answer);
    if (status == CLI_OK && answer.status != 404) {
        *described = cli_answer_object(&answer);
        status = *described ? CLI_OK : CLI_SERVER;
    }
    cli_answer_finish(&answer);
    free(path);
    return status;
}

/* Reads the id out of the description that answers an upload. */
static int take_description(
    const struct cli_answer *answer, char id[PEN_ID_HEX + 1], cJSON **described)
{
    cJSON *object = cli_answer_object(answer);
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, "id");
    if (!object)
        return CLI_SERVER;
    if (!cJSON_IsString(item) || !cli_is_id(item->valuestring)) {
        cJSON_Delete(object);
        return cli_fail(CLI_SERVER, "The server's answer to the upload has no id.");
    }
    memcpy(id, item->valuestring, PEN_ID_HEX + 1);
    *described = object;
    return CLI_OK;
}

static int send_upload(const struct cli_server *server, struct cli_call *call, const char *name,
    char id[PEN_ID_HEX + 1], cJSON **described)
{
    struct cli_answer answer;
    char *doing = cli_format("uploading %s", name);
    call->doing = doing;
    int status = cli_call(server, call, &answer);
    if (status == CLI_OK)
        status = take_description(&answer, id, described);
    cli_answer_finish(&answer);
    free(doing);
    return status;
}

/* The entry as a query; "" without one. To be freed. */
static char *entry_query(const char *entry)
{
    char *query =
        cli_format("%s%*s", entry ? "?entry=" : "", entry ? 3 * (int)strlen(entry) : 0, "");
    char *out = query + strcspn(query, " ");
    for (const char *c = entry ? entry : ""; *c; c++)
        out += sprintf(out, "%%%02x", (unsigned char)*c);
    *out = 0;
    return query;
}

static int upload_file(const struct cli_server *server, const char *folder, const char *path,
    const char *entry, const char *type, char id[PEN_ID_HEX + 1], cJSON **described)
{
    uint64_t bytes;
    FILE *file = fopen(path, "rb");
    if (!file || !hash_file(file, entry, id, &bytes)) {
        if (file)
            fclose(file);
        return cli_fail(CLI_FAILED, "%s cannot be read.", path);
    }
    int status = describe(server, folder, id, described);
    if (status == CLI_OK && !*described) {
        char *query = entry_query(entry), *target = cli_format("%s/%s%s", folder, id, query);
        free(query);
        struct cli_call call = {.method = "PUT",
            .path = target,
            .content_type = type,
            .file = file,
            .file_bytes = bytes};
        status = send_upload(server, &call, base_name(path), id, described);
        free(target);
    }
    fclose(file);
    return status;
}

static int upload_gltf(
    const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1], cJSON **described)
{
    struct cli_files files;
    int status = cli_gltf_files(path, &files);
    if (status == CLI_OK && !cli_bundle_id(&files, id))
        status = cli_fail(CLI_FAILED, "The files of %s cannot be read.", path);
    if (status == CLI_OK)
        status = describe(server, "/v1/scenes", id, described);
    if (status == CLI_OK && !*described) {
        struct cli_call call = {.method = "POST",
            .path = "/v1/scenes",
            .parts = files.parts,
            .part_count = files.count};
        status = send_upload(server, &call, base_name(path), id, described);
    }
    cli_files_finish(&files);
    return status;
}

/* "x.zip#folder/model.gltf" */
static int upload_zip_entry(
    const struct cli_server *server, const char *scene, char id[PEN_ID_HEX + 1], cJSON **described)
{
    const char *mark = strstr(scene, ".zip#") + 4;
    char entry[PEN_BUNDLE_MAX_NAME + 1];
    if (!pen_name_tidy(mark + 1, strlen(mark + 1), entry))
        return cli_fail(CLI_USAGE, "\"%s\" cannot be a file in a zip.", mark + 1);
    char *path = cli_format("%.*s", (int)(mark - scene), scene);
    int status = upload_file(server, "/v1/scenes", path, entry, "application/zip", id, described);
    free(path);
    return status;
}

int cli_upload_scene(
    const struct cli_server *server, const char *scene, char id[PEN_ID_HEX + 1], cJSON **described)
{
    cJSON *description = NULL;
    int status = CLI_OK;
    if (cli_is_id(scene))
        memcpy(id, scene, PEN_ID_HEX + 1); /* whether it is there shows when it is used */
    else if (ends_with(scene, ".gltf") && !strstr(scene, ".zip#"))
        status = upload_gltf(server, scene, id, &description);
    else if (ends_with(scene, ".zip") || !strstr(scene, ".zip#"))
        status = upload_file(server, "/v1/scenes", scene, NULL,
            ends_with(scene, ".zip") ? "application/zip" : "model/gltf-binary", id, &description);
    else
        status = upload_zip_entry(server, scene, id, &description);
    if (described)
        *described = description;
    else
        cJSON_Delete(description);
    return status;
}

int cli_upload_image(const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1])
{
    cJSON *description = NULL;
    const char *type = ends_with(path, ".webp")                              ? "image/webp"
                       : ends_with(path, ".jpg") || ends_with(path, ".jpeg") ? "image/jpeg"
                                                                             : "image/png";
    int status = upload_file(server, "/v1/images", path, NULL, type, id, &description);
    cJSON_Delete(description);
    return status;
}
