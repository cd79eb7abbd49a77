#include "renderer/import/files/files.h"
#include "protocol/hex.h"
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/bundle.h"
#include "renderer/import/base/text.h"
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <zip.h>

bool imp_name_is_safe(const char *name, size_t bytes)
{
    if (!bytes || bytes > PEN_BUNDLE_MAX_NAME)
        return false;
    size_t part = 0; /* length of the part so far */
    for (size_t i = 0; i <= bytes; i++) {
        unsigned char c = i < bytes ? (unsigned char)name[i] : '/';
        if (c < 0x20 || c == 0x7f || c == '\\' || c == ':')
            return false;
        if (c != '/') {
            part++;
            continue;
        }
        const char *start = name + i - part;
        if (!part || (part == 1 && start[0] == '.') ||
            (part == 2 && start[0] == '.' && start[1] == '.'))
            return false;
        part = 0;
    }
    return true;
}

static char *copy_name(const char *name, size_t bytes)
{
    char *copy = pen_alloc_zero(bytes + 1, 1);
    memcpy(copy, name, bytes);
    return copy;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct imp_file *)a)->name, ((const struct imp_file *)b)->name);
}

static bool sort_unique(struct imp_files *files, struct pen_error *error)
{
    qsort(files->items, files->count, sizeof *files->items, by_name);
    for (uint32_t i = 1; i < files->count; i++)
        if (!strcmp(files->items[i - 1].name, files->items[i].name))
            return pen_fail(error, PEN_INVALID, "", "The upload holds \"%s\" twice.",
                imp_text(files->items[i].name).s);
    return true;
}

static bool bundle_table(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    uint32_t count;
    if (bytes < 16)
        return pen_fail(error, PEN_INVALID, "", "The bundle is truncated.");
    memcpy(&count, data + 8, 4);
    if (!count || count > PEN_BUNDLE_MAX_ENTRIES)
        return pen_fail(error, PEN_TOO_BIG, "", "A bundle holds 1 to %d files, not %u.",
            PEN_BUNDLE_MAX_ENTRIES, count);
    files->items = pen_alloc_zero(count, sizeof *files->items);
    size_t at = 16;
    for (uint32_t i = 0; i < count; i++) {
        uint32_t name_bytes;
        uint64_t data_bytes;
        if (bytes - at < 16)
            return pen_fail(error, PEN_INVALID, "", "The bundle is truncated.");
        memcpy(&name_bytes, data + at, 4);
        memcpy(&data_bytes, data + at + 8, 8);
        at += 16;
        if (name_bytes > bytes - at || data_bytes > bytes - at - name_bytes)
            return pen_fail(error, PEN_INVALID, "", "The bundle is truncated.");
        const char *name = (const char *)data + at;
        if (!imp_name_is_safe(name, name_bytes))
            return pen_fail(error, PEN_INVALID, "", "File %u has an unusable name.", i);
        at += name_bytes;
        files->items[files->count++] = (struct imp_file){
            .name = copy_name(name, name_bytes), .data = data + at, .bytes = (size_t)data_bytes};
        at += (size_t)data_bytes;
    }
    if (at != bytes)
        return pen_fail(error, PEN_INVALID, "", "The bundle is longer than its table says.");
    return sort_unique(files, error);
}

bool imp_files_open_bundle(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    memset(files, 0, sizeof *files);
    if (bundle_table(files, data, bytes, error))
        return true;
    imp_files_finish(files);
    return false;
}

static bool zip_table(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    zip_error_t why;
    zip_error_init(&why);
    zip_source_t *source = zip_source_buffer_create(data, bytes, 0, &why);
    files->zip = source ? zip_open_from_source(source, ZIP_RDONLY, &why) : NULL;
    if (!files->zip) {
        zip_source_free(source);
        zip_error_fini(&why);
        return pen_fail(error, PEN_INVALID, "", "The zip file is damaged or truncated.");
    }
    zip_int64_t count = zip_get_num_entries(files->zip, 0);
    if (count < 1 || count > PEN_BUNDLE_MAX_ENTRIES)
        return pen_fail(error, count < 1 ? PEN_INVALID : PEN_TOO_BIG, "",
            "The zip file holds %lld entries; 1 to %d are allowed.", (long long)count,
            PEN_BUNDLE_MAX_ENTRIES);
    files->items = pen_alloc_zero((size_t)count, sizeof *files->items);
    uint64_t unpacked = 0; /* if the table tells the truth; unpack() allows no more */
    for (zip_int64_t i = 0; i < count; i++) {
        zip_stat_t entry;
        if (zip_stat_index(files->zip, (zip_uint64_t)i, 0, &entry) ||
            !(entry.valid & ZIP_STAT_NAME) || !(entry.valid & ZIP_STAT_SIZE))
            return pen_fail(error, PEN_INVALID, "", "The zip file is damaged.");
        size_t length = strlen(entry.name);
        if (length && entry.name[length - 1] == '/')
            continue; /* a folder */
        if (!imp_name_is_safe(entry.name, length))
            return pen_fail(error, PEN_INVALID, "", "Entry %lld of the zip has an unusable name.",
                (long long)i);
        if ((entry.valid & ZIP_STAT_ENCRYPTION_METHOD) && entry.encryption_method != ZIP_EM_NONE)
            return pen_fail(error, PEN_INVALID, "", "The zip file is encrypted.");
        if (entry.size > IMP_MAX_ZIP_BYTES - unpacked)
            return pen_fail(error, PEN_TOO_BIG, "", "The zip file unpacks to more than %llu bytes.",
                IMP_MAX_ZIP_BYTES);
        unpacked += entry.size;
        files->items[files->count++] = (struct imp_file){.name = copy_name(entry.name, length),
            .bytes = (size_t)entry.size,
            .zip_entry = (uint64_t)i};
    }
    if (unpacked > IMP_ZIP_RATIO_FROM_BYTES && unpacked / IMP_MAX_ZIP_RATIO > bytes)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The zip file is packed more than %d to 1.", IMP_MAX_ZIP_RATIO);
    return sort_unique(files, error);
}

bool imp_files_open_zip(
    struct imp_files *files, const uint8_t *data, size_t bytes, struct pen_error *error)
{
    memset(files, 0, sizeof *files);
    if (zip_table(files, data, bytes, error))
        return true;
    imp_files_finish(files);
    return false;
}

void imp_files_finish(struct imp_files *files)
{
    for (uint32_t i = 0; i < files->count; i++) {
        free(files->items[i].name);
        free(files->items[i].owned);
    }
    free(files->items);
    if (files->zip)
        zip_discard(files->zip);
    memset(files, 0, sizeof *files);
}

static const char *last_part(const char *name)
{
    const char *slash = strrchr(name, '/');
    return slash ? slash + 1 : name;
}

static bool has_suffix(const char *name, const char *suffix)
{
    size_t n = strlen(name), s = strlen(suffix);
    return n > s && !strcasecmp(name + n - s, suffix);
}

const struct imp_file *imp_files_document(struct imp_files *files, struct pen_error *error)
{
    const struct imp_file *best = NULL, *rival = NULL;
    int best_depth = 0;
    for (uint32_t i = 0; i < files->count; i++) {
        const struct imp_file *file = &files->items[i];
        if (!has_suffix(file->name, ".gltf") && !has_suffix(file->name, ".glb"))
            continue;
        if (!strncmp(file->name, "__MACOSX/", 9) || last_part(file->name)[0] == '.')
            continue; /* what archivers leave behind */
        int depth = 0;
        for (const char *c = file->name; *c; c++)
            depth += *c == '/';
        if (best && depth >= best_depth) {
            rival = depth == best_depth ? file : rival;
            continue;
        }
        best = file;
        best_depth = depth;
        rival = NULL;
    }
    if (!best)
        pen_fail(error, PEN_INVALID, "", "There is no .glb or .gltf among the files.");
    else if (rival)
        pen_fail(error, PEN_INVALID, "", "Both \"%s\" and \"%s\" could be the scene; upload one.",
            imp_text(best->name).s, imp_text(rival->name).s);
    return rival ? NULL : best;
}

static bool unpack(struct imp_files *files, struct imp_file *file, struct pen_error *error)
{
    zip_file_t *entry = zip_fopen_index(files->zip, file->zip_entry, 0);
    if (!entry)
        return pen_fail(error, PEN_INVALID, "",
            "\"%s\" cannot be unpacked: its method is not supported or the zip is damaged.",
            imp_text(file->name).s);
    file->owned = pen_alloc_zero(file->bytes + 1, 1);
    /* Reading on to the end, and one byte past the size that was told, is what checks the CRC. */
    uint64_t got = 0;
    zip_int64_t n;
    while ((n = zip_fread(entry, file->owned + got, file->bytes + 1 - got)) > 0)
        got += (uint64_t)n;
    zip_fclose(entry);
    if (n < 0 || got != file->bytes)
        return pen_fail(
            error, PEN_INVALID, "", "\"%s\" is damaged in the zip file.", imp_text(file->name).s);
    file->data = file->owned;
    return true;
}

bool imp_files_load(struct imp_files *files, const struct imp_file *file, struct imp_bytes *found,
    struct pen_error *error)
{
    struct imp_file *own = &files->items[file - files->items];
    if (!own->data && !unpack(files, own, error))
        return false;
    *found = (struct imp_bytes){own->data, own->bytes};
    return true;
}

/* Joins base's folder and the decoded uri, and folds "." and "..", into `name`. False when the
 * result is no safe name. */
static bool join(const char *base, const char *uri, char name[PEN_BUNDLE_MAX_NAME + 1])
{
    char joined[2 * PEN_BUNDLE_MAX_NAME + 2];
    size_t n = (size_t)(last_part(base) - base);
    if (n > PEN_BUNDLE_MAX_NAME)
        return false;
    memcpy(joined, base, n);
    for (const char *c = uri; *c; c++) {
        if (n >= sizeof joined - 1)
            return false;
        int high = c[0] == '%' ? pen_hex_digit(c[1]) : -1;
        int low = high >= 0 ? pen_hex_digit(c[2]) : -1;
        joined[n++] = low >= 0 ? (char)(high << 4 | low) : *c;
        c += low >= 0 ? 2 : 0;
        if (!joined[n - 1])
            return false;
    }
    joined[n] = 0;
    size_t out = 0;
    for (char *part = joined, *next; part; part = next) {
        char *slash = strchr(part, '/');
        next = slash ? slash + 1 : NULL;
        size_t length = slash ? (size_t)(slash - part) : strlen(part);
        if (length == 1 && part[0] == '.')
            continue;
        if (length == 2 && part[0] == '.' && part[1] == '.') {
            if (!out)
                return false; /* above the upload's root */
            while (out && name[--out] != '/')
                ;
            continue;
        }
        if (out + length + 1 > PEN_BUNDLE_MAX_NAME)
            return false;
        if (out)
            name[out++] = '/';
        memcpy(name + out, part, length);
        out += length;
    }
    name[out] = 0;
    return imp_name_is_safe(name, out);
}

static const struct imp_file *find(const struct imp_files *files, char *name)
{
    struct imp_file key = {.name = name};
    const struct imp_file *file =
        files->count ? bsearch(&key, files->items, files->count, sizeof key, by_name) : NULL;
    if (file)
        return file;
    const struct imp_file *only = NULL;
    for (uint32_t i = 0; i < files->count; i++) {
        if (strcmp(last_part(files->items[i].name), last_part(name)))
            continue;
        if (only)
            return NULL;
        only = &files->items[i];
    }
    return only;
}

bool imp_files_resolve(struct imp_files *files, const char *base, const char *uri,
    const char *pointer, struct imp_bytes *found, struct pen_error *error)
{
    char name[PEN_BUNDLE_MAX_NAME + 1];
    const char *colon = strchr(uri, ':'), *slash = strchr(uri, '/');
    if (uri[0] == '/' || uri[0] == '\\' || (colon && (!slash || colon < slash)) ||
        !join(base, uri, name))
        return pen_fail(error, PEN_INVALID, pointer,
            "The glTF refers to \"%s\": only uploaded files, by relative names, can be used.",
            imp_text(uri).s);
    const struct imp_file *file = find(files, name);
    if (!file)
        return pen_fail(error, PEN_INVALID, pointer,
            "The glTF refers to \"%s\", which was not uploaded with it.", imp_text(uri).s);
    return imp_files_load(files, file, found, error);
}
