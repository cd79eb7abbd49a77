#include "clients/cli/upload.h"
#include "clients/cli/gltf_files.h"
#include "clients/cli/output.h"
#include "clients/cli/which.h"
#include "protocol/request.h"
#include "renderer/import/names.h"
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

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

/* Asks for what is stored under the id; stored->description stays NULL when nothing is. */
static int describe(
    const struct cli_server *server, const char *folder, const char *id, struct cli_stored *stored)
{
    struct cli_answer answer;
    char *path = cli_format("%s/%s", folder, id);
    struct cli_call call = {.method = "GET", .path = path, .missing_is_ok = true};
    int status = cli_call(server, &call, &answer);
    if (status == CLI_OK && answer.status != 404) {
        stored->description = cli_answer_object(&answer);
        status = stored->description ? CLI_OK : CLI_SERVER;
    }
    cli_answer_finish(&answer);
    free(path);
    return status;
}

/* Reads the id out of the description that answers an upload. */
static int take_description(
    const struct cli_answer *answer, char id[PEN_ID_HEX + 1], struct cli_stored *stored)
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
    stored->description = object;
    return CLI_OK;
}

static int send_upload(const struct cli_server *server, struct cli_call *call, const char *name,
    char id[PEN_ID_HEX + 1], struct cli_stored *stored)
{
    struct cli_answer answer;
    char *doing = cli_format("uploading %s", name);
    call->doing = doing;
    int status = cli_call(server, call, &answer);
    if (status == CLI_OK)
        status = take_description(&answer, id, stored);
    stored->sent = status == CLI_OK && answer.status == 201;
    cli_answer_finish(&answer);
    free(doing);
    return status;
}

/* "?entry=...", or "?name=..." of what has none, in percent-encoding. To be freed. */
static char *file_query(const char *entry, const char *name)
{
    const char *value = entry ? entry : name;
    char *query = cli_format("?%s=%*s", entry ? "entry" : "name", 3 * (int)strlen(value), "");
    char *out = strchr(query, '=') + 1;
    for (const char *c = value; *c; c++)
        out += sprintf(out, "%%%02x", (unsigned char)*c);
    *out = 0;
    return query;
}

static int upload_file(const struct cli_server *server, const char *folder, const char *path,
    const char *entry, const char *type, char id[PEN_ID_HEX + 1], struct cli_stored *stored)
{
    uint64_t bytes;
    FILE *file = fopen(path, "rb");
    if (!file || !hash_file(file, entry, id, &bytes)) {
        int status = cli_output_fail(path, "read");
        if (file)
            fclose(file);
        return status;
    }
    int status = describe(server, folder, id, stored);
    if (status == CLI_OK && !stored->description) {
        bool names = !strcmp(folder, "/v1/scenes");
        char *query = names ? file_query(entry, base_name(path)) : cli_format("%s", "");
        char *target = cli_format("%s/%s%s", folder, id, query);
        free(query);
        struct cli_call call = {.method = "PUT",
            .path = target,
            .content_type = type,
            .file = file,
            .file_bytes = bytes};
        status = send_upload(server, &call, base_name(path), id, stored);
        free(target);
    }
    fclose(file);
    return status;
}

static int upload_gltf(const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1],
    struct cli_stored *stored)
{
    struct cli_files files;
    int status = cli_gltf_files(path, &files);
    if (status == CLI_OK && !cli_bundle_id(&files, id))
        status = cli_fail(CLI_FAILED, "The files of %s cannot be read.", path);
    if (status == CLI_OK)
        status = describe(server, "/v1/scenes", id, stored);
    if (status == CLI_OK && !stored->description) {
        struct cli_call call = {.method = "POST",
            .path = "/v1/scenes",
            .parts = files.parts,
            .part_count = files.count};
        status = send_upload(server, &call, base_name(path), id, stored);
    }
    cli_files_finish(&files);
    return status;
}

/* "x.zip#folder/model.gltf" */
static int upload_zip_entry(const struct cli_server *server, const char *scene,
    char id[PEN_ID_HEX + 1], struct cli_stored *stored)
{
    const char *mark = strstr(scene, ".zip#") + 4;
    char entry[PEN_BUNDLE_MAX_NAME + 1];
    if (!pen_name_tidy(mark + 1, strlen(mark + 1), entry))
        return cli_fail(CLI_USAGE, "\"%s\" cannot be a file in a zip.", mark + 1);
    char *path = cli_format("%.*s", (int)(mark - scene), scene);
    int status = upload_file(server, "/v1/scenes", path, entry, "application/zip", id, stored);
    free(path);
    return status;
}

/* Whether a word can only be meant as a file. */
static bool is_path(const char *scene)
{
    static const char *const endings[] = {".glb", ".gltf", ".vrm", ".zip"};
    bool path = strchr(scene, '/') || strstr(scene, ".zip#") || !access(scene, F_OK);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++)
        path = path || ends_with(scene, endings[i]);
    return path;
}

int cli_upload_scene(const struct cli_server *server, const char *scene, char id[PEN_ID_HEX + 1],
    struct cli_stored *stored)
{
    struct cli_stored found = {0};
    int status = CLI_OK;
    if (cli_is_id(scene) || !is_path(scene))
        status = cli_find_scene(server, scene, id);
    else if (ends_with(scene, ".gltf") && !strstr(scene, ".zip#"))
        status = upload_gltf(server, scene, id, &found);
    else if (ends_with(scene, ".zip") || !strstr(scene, ".zip#"))
        status = upload_file(server, "/v1/scenes", scene, NULL,
            ends_with(scene, ".zip") ? "application/zip" : "model/gltf-binary", id, &found);
    else
        status = upload_zip_entry(server, scene, id, &found);
    if (stored)
        *stored = found;
    else
        cJSON_Delete(found.description);
    return status;
}

int cli_upload_image(const struct cli_server *server, const char *path, char id[PEN_ID_HEX + 1])
{
    struct cli_stored found = {0};
    const char *type = ends_with(path, ".webp")                              ? "image/webp"
                       : ends_with(path, ".jpg") || ends_with(path, ".jpeg") ? "image/jpeg"
                                                                             : "image/png";
    int status = upload_file(server, "/v1/images", path, NULL, type, id, &found);
    cJSON_Delete(found.description);
    return status;
}
