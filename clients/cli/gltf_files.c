#include "clients/cli/gltf_files.h"
#include "clients/cli/output.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "renderer/import/names.h"
#include <errno.h>
#include <dirent.h>
#include <openssl/evp.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
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

/* ---- what lies in the .gltf's folder ---- */

#define MAX_LISTED 65536
#define MAX_DEPTH 8

struct listing {
    const char *folder; /* "" or with a slash at its end */
    char **paths;       /* below the folder, as on disk */
    const char **names; /* the same as an upload has them */
    uint32_t count;
    size_t capacity, name_capacity;
    struct pen_names index;
};

static void list_folder(struct listing *listing, const char *below, int depth)
{
    char *path = cli_format("%s%s", listing->folder, below);
    DIR *folder = opendir(path[0] ? path : ".");
    free(path);
    for (struct dirent *item; folder && (item = readdir(folder)) && listing->count < MAX_LISTED;) {
        struct stat info;
        char tidy[PEN_BUNDLE_MAX_NAME + 1];
        if (!strcmp(item->d_name, ".") || !strcmp(item->d_name, ".."))
            continue;
        char *name = cli_format("%s%s", below, item->d_name);
        char *whole = cli_format("%s%s", listing->folder, name);
        bool known = !lstat(whole, &info);
        if (known && S_ISLNK(info.st_mode))
            known = !stat(whole, &info) && !S_ISDIR(info.st_mode); /* no way round in circles */
        free(whole);
        if (known && S_ISDIR(info.st_mode) && depth < MAX_DEPTH) {
            char *deeper = cli_format("%s/", name);
            list_folder(listing, deeper, depth + 1);
            free(deeper);
        }
        if (!known || !S_ISREG(info.st_mode) || !pen_name_tidy(name, strlen(name), tidy)) {
            free(name);
            continue;
        }
        listing->paths = pen_grow(
            listing->paths, &listing->capacity, listing->count + 1, sizeof *listing->paths);
        listing->names = pen_grow(
            listing->names, &listing->name_capacity, listing->count + 1, sizeof *listing->names);
        listing->names[listing->count] = cli_format("%s", tidy);
        listing->paths[listing->count++] = name;
    }
    if (folder)
        closedir(folder);
}

static void finish_listing(struct listing *listing)
{
    for (uint32_t i = 0; i < listing->count; i++) {
        free(listing->paths[i]);
        free((char *)listing->names[i]);
    }
    free(listing->paths);
    free(listing->names);
    pen_names_finish(&listing->index);
}

/* Adds the files that `array`'s members name with "uri". */
static int add_uris(struct cli_files *files, const cJSON *root, const char *array,
    const char *gltf_path, const struct listing *listing)
{
    const cJSON *items = cJSON_GetObjectItemCaseSensitive(root, array);
    for (const cJSON *item = items ? items->child : NULL; item; item = item->next) {
        const cJSON *uri = cJSON_GetObjectItemCaseSensitive(item, "uri");
        if (!cJSON_IsString(uri) || !strncasecmp(uri->valuestring, "data:", 5))
            continue;
        int64_t found = pen_names_find(&listing->index, "", uri->valuestring, false);
        if (found < 0)
            return cli_fail(CLI_FAILED, "%s names %.200s, %s.", gltf_path, uri->valuestring,
                found == PEN_NAME_ELSEWHERE   ? "which is outside its folder, or no name of a file"
                : found == PEN_NAME_AMBIGUOUS ? "and several files in its folder could be meant"
                                              : "which is not in its folder");
        if (has(files, listing->names[found]))
            continue;
        add(files, cli_format("%s", listing->names[found]),
            cli_format("%s%s", listing->folder, listing->paths[found]), "application/octet-stream");
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
    } else if (file) {
        errno = S_ISDIR(info.st_mode) ? EISDIR : EINVAL;
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
        return cli_output_fail(path, "read");
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    free(text);
    if (!cJSON_IsObject(root)) {
        cJSON_Delete(root);
        return cli_fail(CLI_FAILED, "%s is not JSON.", path);
    }
    char name[PEN_BUNDLE_MAX_NAME + 1];
    const char *given = slash ? slash + 1 : path;
    if (!pen_name_tidy(given, strlen(given), name)) {
        cJSON_Delete(root);
        return cli_fail(CLI_FAILED, "%s has a name that cannot be uploaded.", path);
    }
    char *folder = cli_format("%.*s", (int)(given - path), path);
    struct listing listing = {.folder = folder};
    list_folder(&listing, "", 0);
    pen_names_init(&listing.index, listing.names, listing.count);
    add(files, cli_format("%s", name), cli_format("%s", path), "model/gltf+json");
    int status = add_uris(files, root, "buffers", path, &listing);
    if (status == CLI_OK)
        status = add_uris(files, root, "images", path, &listing);
    finish_listing(&listing);
    free(folder);
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
