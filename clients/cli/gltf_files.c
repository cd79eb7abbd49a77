#include "clients/cli/gltf_files.h"
#include "protocol/hex.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "renderer/import/bundle.h"
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>
#include <sys/stat.h>

static void add(struct cli_files *files, char *name, char *path, const char *type)
{
    files->parts = pen_realloc_array(files->parts, files->count + 1, sizeof *files->parts);
    files->parts[files->count++] = (struct cli_part){name, path, type};
}

static bool has(const struct cli_files *files, const char *name)
{
    for (uint32_t i = 0; i < files->count; i++)
        if (!strcmp(files->parts[i].name, name))
            return true;
    return false;
}

/* Percent-decodes a URI reference; NULL when it holds a NUL. */
static char *decode(const char *uri)
{
    char *name = cli_format("%s", uri), *out = name;
    for (const char *in = uri; *in; in++) {
        int high = *in == '%' ? pen_hex_digit(in[1]) : -1;
        int low = high >= 0 ? pen_hex_digit(in[2]) : -1;
        *out++ = low >= 0 ? (char)(high * 16 + low) : *in;
        in += low >= 0 ? 2 : 0;
    }
    *out = 0;
    if (strlen(name) == (size_t)(out - name))
        return name;
    free(name);
    return NULL;
}

/* The file name that a URI reference stands for, without "." parts; NULL when it is not a plain
 * name below the folder. */
static char *name_of_uri(const char *uri)
{
    char *name = decode(uri), *out = name;
    for (const char *in = name; in;) {
        size_t bytes = strcspn(in, "/");
        bool last = !in[bytes], dot = bytes == 1 && in[0] == '.';
        bool up = bytes == 2 && in[0] == '.' && in[1] == '.';
        if (!bytes || up || (dot && last) || memchr(in, '\\', bytes))
            goto fail; /* no bytes: "/x", "a//b", "a/" and "https://..." */
        const char *next = last ? NULL : in + bytes + 1;
        if (!dot) {
            memmove(out, in, bytes + !last);
            out += bytes + !last;
        }
        in = next;
    }
    if (!name)
        return NULL;
    *out = 0;
    if (strlen(name) <= PEN_BUNDLE_MAX_NAME)
        return name;
fail:
    free(name);
    return NULL;
}

/* Adds the files that `array`'s members name with "uri". */
static int add_uris(
    struct cli_files *files, const cJSON *root, const char *array, const char *gltf_path)
{
    const char *slash = strrchr(gltf_path, '/');
    int folder_bytes = slash ? (int)(slash - gltf_path) + 1 : 0;
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(root, array);
    for (const cJSON *item = items ? items->child : NULL; item; item = item->next) {
        const cJSON *uri = cJSON_GetObjectItemCaseSensitive(item, "uri");
        if (!cJSON_IsString(uri) || !strncmp(uri->valuestring, "data:", 5))
            continue;
        char *name = name_of_uri(uri->valuestring);
        if (!name)
            return cli_fail(CLI_FAILED, "%s names a file outside its folder: %.100s", gltf_path,
                uri->valuestring);
        if (has(files, name)) {
            free(name);
            continue;
        }
        char *path = cli_format("%.*s%s", folder_bytes, gltf_path, name);
        struct stat info;
        add(files, name, path, "application/octet-stream");
        if (stat(path, &info) || !S_ISREG(info.st_mode))
            return cli_fail(CLI_FAILED, "%s names %s, which is not there.", gltf_path, path);
        if (files->count > PEN_BUNDLE_MAX_ENTRIES)
            return cli_fail(CLI_FAILED, "%s names too many files.", gltf_path);
    }
    return CLI_OK;
}

static char *read_text(const char *path, size_t *bytes)
{
    FILE *file = fopen(path, "rb");
    struct stat info;
    char *text = NULL;
    if (file && !fstat(fileno(file), &info) && S_ISREG(info.st_mode) &&
        (text = malloc((size_t)info.st_size + 1))) {
        *bytes = fread(text, 1, (size_t)info.st_size, file);
        text[*bytes] = 0;
    }
    if (file)
        fclose(file);
    return text;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct cli_part *)a)->name, ((const struct cli_part *)b)->name);
}

int cli_gltf_files(const char *path, struct cli_files *files)
{
    size_t bytes = 0;
    char *text = read_text(path, &bytes);
    const char *slash = strrchr(path, '/');
    *files = (struct cli_files){0};
    if (!text)
        return cli_fail(CLI_FAILED, "%s cannot be read.", path);
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    free(text);
    if (!cJSON_IsObject(root)) {
        cJSON_Delete(root);
        return cli_fail(CLI_FAILED, "%s is not JSON.", path);
    }
    add(files, cli_format("%s", slash ? slash + 1 : path), cli_format("%s", path),
        "model/gltf+json");
    int status = add_uris(files, root, "buffers", path);
    if (status == CLI_OK)
        status = add_uris(files, root, "images", path);
    cJSON_Delete(root);
    qsort(files->parts, files->count, sizeof *files->parts, by_name);
    return status;
}

void cli_files_finish(struct cli_files *files)
{
    for (uint32_t i = 0; i < files->count; i++) {
        free((char *)files->parts[i].name);
        free((char *)files->parts[i].path);
    }
    free(files->parts);
    *files = (struct cli_files){0};
}

static void hash_number(EVP_MD_CTX *hash, uint64_t value, int bytes)
{
    unsigned char little[8];
    for (int i = 0; i < bytes; i++)
        little[i] = (unsigned char)(value >> 8 * i);
    EVP_DigestUpdate(hash, little, (size_t)bytes);
}

static bool hash_part(EVP_MD_CTX *hash, const struct cli_part *part)
{
    size_t bytes = 0;
    char *data = read_text(part->path, &bytes);
    if (!data)
        return false;
    hash_number(hash, strlen(part->name), 4);
    hash_number(hash, 0, 4);
    hash_number(hash, bytes, 8);
    EVP_DigestUpdate(hash, part->name, strlen(part->name));
    EVP_DigestUpdate(hash, data, bytes);
    free(data);
    return true;
}

bool cli_bundle_id(const struct cli_files *files, char id[PEN_ID_HEX + 1])
{
    uint8_t digest[PEN_ID_BYTES];
    EVP_MD_CTX *hash = EVP_MD_CTX_new();
    bool ok = hash && EVP_DigestInit_ex(hash, EVP_sha256(), NULL);
    if (ok) {
        EVP_DigestUpdate(hash, PEN_BUNDLE_MAGIC, 8);
        hash_number(hash, files->count, 4);
        hash_number(hash, 0, 4);
    }
    for (uint32_t i = 0; ok && i < files->count; i++)
        ok = hash_part(hash, &files->parts[i]);
    ok = ok && EVP_DigestFinal_ex(hash, digest, NULL);
    EVP_MD_CTX_free(hash);
    if (ok)
        pen_id_to_hex(digest, id);
    return ok;
}
