#include "renderer/import/files/files.h"
#include "renderer/import/files/foreign.h"
#include "protocol/memory.h"
#include "renderer/import/base/budget.h"
#include "renderer/import/base/text.h"
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <utf8proc.h>
#include <zip.h>

/* A copy of the tidy name; NULL when it cannot be used. */
static char *copy_name(const char *given, size_t bytes)
{
    char name[PEN_BUNDLE_MAX_NAME + 1];
    return pen_name_tidy(given, bytes, name) ? strdup(name) : NULL;
}

static int by_name(const void *a, const void *b)
{
    return strcmp(((const struct imp_file *)a)->name, ((const struct imp_file *)b)->name);
}

/* Once all names are known. */
static bool index_names(struct imp_files *files, struct pen_error *error)
{
    qsort(files->items, files->count, sizeof *files->items, by_name);
    for (uint32_t i = 1; i < files->count; i++)
        if (!strcmp(files->items[i - 1].name, files->items[i].name))
            return pen_fail(error, PEN_INVALID, "", "The upload holds \"%s\" twice.",
                imp_text(files->items[i].name).s);
    const char **names = pen_alloc_zero(files->count, sizeof *names);
    for (uint32_t i = 0; i < files->count; i++)
        names[i] = files->items[i].name;
    pen_names_init(&files->names, names, files->count);
    free(names);
    for (uint32_t i = 0; i < files->count; i++)
        if (files->items[i].doubted)
            pen_names_doubt(&files->names, i);
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
        char *name = copy_name((const char *)data + at, name_bytes);
        if (!name)
            return pen_fail(error, PEN_INVALID, "", "File %u has an unusable name.", i);
        at += name_bytes;
        files->items[files->count++] =
            (struct imp_file){.name = name, .data = data + at, .bytes = (size_t)data_bytes};
        at += (size_t)data_bytes;
    }
    if (at != bytes)
        return pen_fail(error, PEN_INVALID, "", "The bundle is longer than its table says.");
    return index_names(files, error);
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

/* libzip reads what is no UTF-8 in the first PC's code page, 437; archivers write the system's. */
static bool is_doubted(zip_t *zip, uint64_t number)
{
    const char *raw = zip_get_name(zip, number, ZIP_FL_ENC_RAW);
    for (utf8proc_int32_t letter; raw && *raw;) {
        utf8proc_ssize_t bytes = utf8proc_iterate((const utf8proc_uint8_t *)raw, -1, &letter);
        if (bytes < 1)
            return true;
        raw += bytes;
    }
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
        if (length && (entry.name[length - 1] == '/' || entry.name[length - 1] == '\\'))
            continue; /* a folder */
        if ((entry.valid & ZIP_STAT_ENCRYPTION_METHOD) && entry.encryption_method != ZIP_EM_NONE)
            return pen_fail(error, PEN_INVALID, "", "The zip file is encrypted.");
        if (entry.size > IMP_MAX_ZIP_BYTES - unpacked)
            return pen_fail(error, PEN_TOO_BIG, "", "The zip file unpacks to more than %llu bytes.",
                IMP_MAX_ZIP_BYTES);
        unpacked += entry.size;
        char *name = copy_name(entry.name, length);
        if (!name) { /* no glTF can mean it: a folder's icon, a path that leads outside */
            files->unusable++;
            continue;
        }
        files->items[files->count++] = (struct imp_file){.name = name,
            .bytes = (size_t)entry.size,
            .zip_entry = (uint64_t)i,
            .doubted = is_doubted(files->zip, (zip_uint64_t)i)};
    }
    if (unpacked > IMP_ZIP_RATIO_FROM_BYTES && unpacked / IMP_MAX_ZIP_RATIO > bytes)
        return pen_fail(
            error, PEN_TOO_BIG, "", "The zip file is packed more than %d to 1.", IMP_MAX_ZIP_RATIO);
    return index_names(files, error);
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
    pen_names_finish(&files->names);
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

/* What archivers leave behind. */
static bool is_litter(const char *name)
{
    return !strncmp(name, "__MACOSX/", 9) || last_part(name)[0] == '.';
}

static bool is_scene(const struct imp_file *file)
{
    static const char *const suffixes[] = {".gltf", ".glb", ".vrm"};
    bool any = false;
    for (size_t i = 0; i < sizeof suffixes / sizeof *suffixes; i++)
        any |= has_suffix(file->name, suffixes[i]);
    return any && !is_litter(file->name);
}

const struct imp_file *imp_files_inner_zip(const struct imp_files *files)
{
    const struct imp_file *found = NULL;
    for (uint32_t i = 0; i < files->count; i++) {
        const struct imp_file *file = &files->items[i];
        bool zip = has_suffix(file->name, ".zip") && !is_litter(file->name);
        if (is_scene(file) || (zip && found))
            return NULL;
        found = zip ? file : found;
    }
    return found;
}

static uint32_t depth_of(const char *name)
{
    uint32_t depth = 0;
    for (; *name; name++)
        depth += *name == '/';
    return depth;
}

/* Those of the scenes that lie at `depth`, or all of them, as text. */
static void list_scenes(
    const struct imp_files *files, uint32_t depth, bool all, char *list, size_t room)
{
    size_t at = 0;
    uint32_t left = 0;
    list[0] = 0;
    for (uint32_t i = 0; i < files->count; i++) {
        const struct imp_file *file = &files->items[i];
        if (!is_scene(file) || (!all && depth_of(file->name) != depth))
            continue;
        struct imp_text name = imp_text(file->name);
        if (at + strlen(name.s) + 32 > room)
            left++;
        else
            at += (size_t)snprintf(list + at, room - at, "%s\"%s\"", at ? ", " : "", name.s);
    }
    if (left)
        snprintf(list + at, room - at, " and %u more", left);
}

static const struct imp_file *named_document(
    struct imp_files *files, const char *entry, struct pen_error *error)
{
    char list[400];
    int64_t number = pen_names_find(&files->names, "", entry, false);
    if (number >= 0 && is_scene(&files->items[number]))
        return &files->items[number];
    list_scenes(files, 0, true, list, sizeof list);
    pen_fail(error, PEN_INVALID, "/entry", "entry must name one scene of the upload: %s.", list);
    return NULL;
}

/* Says what is there instead, when it is something else that has a shape. */
static const struct imp_file *no_document(const struct imp_files *files, struct pen_error *error)
{
    const char *why = NULL;
    uint32_t i = 0;
    while (i < files->count &&
           !(why = is_litter(files->items[i].name) ? NULL : imp_foreign_name(files->items[i].name)))
        i++;
    if (why)
        pen_fail(error, PEN_INVALID, "",
            "There is no .glb or .gltf among the files, but there is \"%s\". %s",
            imp_text(files->items[i].name).s, why);
    else
        pen_fail(error, PEN_INVALID, "", "There is no .glb or .gltf among the files.%s",
            files->unusable ? " Entries of the zip with unusable names, such as absolute ones, are "
                              "left out."
                            : "");
    return NULL;
}

const struct imp_file *imp_files_document(
    struct imp_files *files, const char *entry, bool *others, struct pen_error *error)
{
    const struct imp_file *best = NULL;
    uint32_t best_depth = 0, count = 0, level = 0;
    *others = false;
    if (entry)
        return named_document(files, entry, error);
    for (uint32_t i = 0; i < files->count; i++) {
        const struct imp_file *file = &files->items[i];
        uint32_t depth = depth_of(file->name);
        if (!is_scene(file))
            continue;
        count++;
        if (!best || depth < best_depth) {
            best = file;
            best_depth = depth;
            level = 0;
        }
        level += depth == best_depth;
    }
    char list[400];
    *others = count > 1;
    if (!best)
        return no_document(files, error);
    if (level < 2)
        return best;
    list_scenes(files, best_depth, false, list, sizeof list);
    pen_fail(error, PEN_INVALID, "/entry",
        "The upload holds several scenes; ?entry= says which to take: %s.", list);
    return NULL;
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

bool imp_files_resolve(struct imp_files *files, const char *base, const char *uri,
    const char *pointer, struct imp_bytes *found, struct pen_error *error)
{
    int64_t number = pen_names_find(&files->names, base, uri, true);
    if (number >= 0)
        return imp_files_load(files, &files->items[number], found, error);
    const char *why = number == PEN_NAME_ELSEWHERE ? ": only files that are uploaded with it, by "
                                                     "relative names, can be used"
                      : number == PEN_NAME_AMBIGUOUS
                          ? ", and several of the uploaded files could be meant"
                          : ", which was not uploaded with it";
    return pen_fail(
        error, PEN_INVALID, pointer, "The glTF refers to \"%s\"%s.", imp_text(uri).s, why);
}
