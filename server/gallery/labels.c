#include "server/gallery/labels.h"
#include "protocol/json_scan.h"
#include "protocol/memory.h"
#include "protocol/request.h"
#include "server/base/log.h"
#include "server/gallery/sealed.h"
#include <cjson/cJSON.h>
#include <pthread.h>
#include <stdlib.h>
#include <string.h>
#include <strings.h>
#include <unistd.h>

#define LABEL_FILE "label"
#define MOST_BYTES 16384

struct row {
    uint8_t id[PEN_ID_BYTES];
    char *text; /* as in the file */
};

struct labels {
    struct scene_store *store; /* constant */
    pthread_mutex_t writing;   /* held while a file is written */
    pthread_mutex_t lock;      /* guards what follows */
    struct row *rows;          /* in order of id */
    size_t count, capacity;
};

/* ---- one label ---- */

/* Copies a text of 1 byte or more; false when it is too long or has control characters. */
static bool take_text(const char *text, char *to, size_t room)
{
    size_t bytes = strlen(text);
    while (bytes && text[bytes - 1] == ' ')
        bytes--;
    while (bytes && *text == ' ') {
        text++;
        bytes--;
    }
    for (size_t i = 0; i < bytes; i++)
        if ((unsigned char)text[i] < 0x20 || text[i] == 0x7f)
            return false;
    if (bytes >= room)
        return false;
    memcpy(to, text, bytes);
    to[bytes] = 0;
    return true;
}

static bool change_name(struct label *label, const cJSON *item, struct pen_error *error)
{
    if (cJSON_IsNull(item))
        label->name[0] = 0;
    else if (!cJSON_IsString(item) ||
             !take_text(item->valuestring, label->name, sizeof label->name))
        return pen_fail(error, PEN_INVALID, "/name",
            "name must be a text of at most %d bytes without control characters.",
            PEN_LABEL_NAME_BYTES - 1);
    return true;
}

static bool change_tags(struct label *label, const cJSON *list, struct pen_error *error)
{
    label->tag_count = 0;
    if (cJSON_IsNull(list))
        return true;
    if (!cJSON_IsArray(list))
        return pen_fail(error, PEN_INVALID, "/tags", "tags must be a list of texts.");
    for (const cJSON *item = list->child; item; item = item->next) {
        char tag[PEN_LABEL_TAG_BYTES];
        bool seen = false;
        if (!cJSON_IsString(item) || !take_text(item->valuestring, tag, sizeof tag) || !*tag)
            return pen_fail(error, PEN_INVALID, "/tags",
                "A tag must be a text of 1 to %d bytes without control characters.",
                PEN_LABEL_TAG_BYTES - 1);
        for (uint32_t t = 0; t < label->tag_count; t++)
            seen |= !strcmp(label->tags[t], tag);
        if (seen)
            continue;
        if (label->tag_count == PEN_LABEL_TAGS)
            return pen_fail(
                error, PEN_INVALID, "/tags", "A scene has at most %d tags.", PEN_LABEL_TAGS);
        memcpy(label->tags[label->tag_count++], tag, sizeof tag);
    }
    return true;
}

bool label_change(struct label *label, const char *text, size_t bytes, struct pen_error *error)
{
    if (!pen_json_scan(text, bytes, PEN_MAX_JSON_DEPTH, error))
        return false;
    cJSON *root = cJSON_ParseWithLength(text, bytes);
    bool ok = cJSON_IsObject(root) ||
              pen_fail(error, PEN_INVALID, "", "What is to be changed must be a JSON object.");
    for (const cJSON *item = ok ? root->child : NULL; ok && item; item = item->next) {
        if (!strcmp(item->string, "name"))
            ok = change_name(label, item, error);
        else if (!strcmp(item->string, "tags"))
            ok = change_tags(label, item, error);
        else
            ok = pen_fail(error, PEN_INVALID, "",
                "Of a scene only name and tags can be changed, not \"%.40s\".", item->string);
    }
    cJSON_Delete(root);
    return ok;
}

void label_from_file(const char *path, char name[PEN_LABEL_NAME_BYTES])
{
    static const char *const endings[] = {".glb", ".gltf", ".zip"};
    char text[4 * PEN_LABEL_NAME_BYTES];
    const char *slash = strrchr(path, '/');
    size_t bytes = strnlen(slash ? slash + 1 : path, sizeof text - 1);
    memcpy(text, slash ? slash + 1 : path, bytes);
    for (size_t i = 0; i < sizeof endings / sizeof *endings; i++) {
        size_t tail = strlen(endings[i]);
        if (bytes > tail && !strncasecmp(text + bytes - tail, endings[i], tail)) {
            bytes -= tail;
            break;
        }
    }
    /* Too long is cut where a character ends. */
    if (bytes >= PEN_LABEL_NAME_BYTES)
        for (bytes = PEN_LABEL_NAME_BYTES - 1;
             bytes && ((unsigned char)text[bytes] & 0xc0) == 0x80;)
            bytes--;
    text[bytes] = 0;
    /* Names of files are of any encoding: what JSON cannot say is no name. */
    cJSON *item = cJSON_CreateString(text);
    char *printed = cJSON_PrintUnformatted(item);
    struct pen_error fault = {0};
    if (!printed || !pen_json_scan(printed, strlen(printed), 1, &fault) ||
        !take_text(text, name, PEN_LABEL_NAME_BYTES))
        name[0] = 0;
    free(printed);
    cJSON_Delete(item);
}

bool label_fits(const struct label *label, const char *name, const char *tag)
{
    bool tagged = !*tag;
    for (uint32_t t = 0; t < label->tag_count; t++)
        tagged |= !strcmp(label->tags[t], tag);
    return tagged && (!*name || strcasestr(label->name, name));
}

char *label_json(const struct label *label)
{
    cJSON *root = cJSON_CreateObject();
    cJSON_AddStringToObject(root, "name", label->name);
    cJSON *tags = cJSON_AddArrayToObject(root, "tags");
    for (uint32_t t = 0; t < label->tag_count; t++)
        cJSON_AddItemToArray(tags, cJSON_CreateString(label->tags[t]));
    char *text = cJSON_PrintUnformatted(root);
    cJSON_Delete(root);
    if (!text)
        abort();
    return text;
}

/* ---- those of all scenes ---- */

/* Under the lock: where the id is, or belongs. */
static size_t position(const struct labels *labels, const uint8_t id[PEN_ID_BYTES], bool *found)
{
    size_t low = 0, high = labels->count;
    while (low < high) {
        size_t middle = (low + high) / 2;
        if (memcmp(labels->rows[middle].id, id, PEN_ID_BYTES) < 0)
            low = middle + 1;
        else
            high = middle;
    }
    *found = low < labels->count && !memcmp(labels->rows[low].id, id, PEN_ID_BYTES);
    return low;
}

/* Takes the text; NULL: there is none any more. */
static void put(struct labels *labels, const uint8_t id[PEN_ID_BYTES], char *text)
{
    bool found;
    pthread_mutex_lock(&labels->lock);
    size_t at = position(labels, id, &found);
    if (found)
        free(labels->rows[at].text);
    if (found && !text) {
        memmove(labels->rows + at, labels->rows + at + 1,
            (--labels->count - at) * sizeof *labels->rows);
    } else if (text) {
        if (!found) {
            labels->rows =
                pen_grow(labels->rows, &labels->capacity, labels->count + 1, sizeof *labels->rows);
            memmove(labels->rows + at + 1, labels->rows + at,
                (labels->count++ - at) * sizeof *labels->rows);
            memcpy(labels->rows[at].id, id, PEN_ID_BYTES);
        }
        labels->rows[at].text = text;
    }
    pthread_mutex_unlock(&labels->lock);
}

static void read_one(struct labels *labels, const uint8_t id[PEN_ID_BYTES])
{
    struct label label = {0};
    size_t bytes = 0;
    bool damaged = false;
    int folder = scene_store_open_folder(labels->store, STORE_SCENES, id, NULL);
    char *text = folder < 0 ? NULL : sealed_read(folder, LABEL_FILE, MOST_BYTES, &bytes, &damaged);
    if (folder >= 0)
        close(folder);
    if (text && !label_change(&label, text, bytes, NULL))
        damaged = true;
    if (text && !damaged) {
        put(labels, id, text);
        return;
    }
    free(text);
    if (damaged) {
        char hex[PEN_ID_HEX + 1];
        pen_id_to_hex(id, hex);
        log_event(LOG_ERROR, "scene %s: the label in the store is damaged; it has none now", hex);
    }
}

struct labels *labels_open(struct scene_store *store)
{
    struct labels *labels = pen_alloc_zero(1, sizeof *labels);
    struct store_entry entry;
    uint8_t after[PEN_ID_BYTES];
    pthread_mutex_init(&labels->lock, NULL);
    pthread_mutex_init(&labels->writing, NULL);
    labels->store = store;
    for (bool first = true; scene_store_list(store, STORE_SCENES, first ? NULL : after, &entry, 1);
         first = false) {
        memcpy(after, entry.id, PEN_ID_BYTES);
        read_one(labels, entry.id);
    }
    return labels;
}

void labels_close(struct labels *labels)
{
    if (!labels)
        return;
    for (size_t i = 0; i < labels->count; i++)
        free(labels->rows[i].text);
    free(labels->rows);
    pthread_mutex_destroy(&labels->lock);
    pthread_mutex_destroy(&labels->writing);
    free(labels);
}

bool labels_get(struct labels *labels, const uint8_t id[PEN_ID_BYTES], struct label *label)
{
    bool found;
    memset(label, 0, sizeof *label);
    pthread_mutex_lock(&labels->lock);
    size_t at = position(labels, id, &found);
    char *text = found ? strdup(labels->rows[at].text) : NULL;
    pthread_mutex_unlock(&labels->lock);
    if (text)
        label_change(label, text, strlen(text), NULL);
    free(text);
    return found;
}

bool labels_set(struct labels *labels, const uint8_t id[PEN_ID_BYTES], const struct label *label,
    struct pen_error *error)
{
    char *text = label_json(label);
    pthread_mutex_lock(&labels->writing);
    int folder = scene_store_open_folder(labels->store, STORE_SCENES, id, error);
    bool ok = folder >= 0 && sealed_write(folder, LABEL_FILE, text, strlen(text), true, error);
    if (folder >= 0)
        close(folder);
    if (ok)
        put(labels, id, text);
    else
        free(text);
    pthread_mutex_unlock(&labels->writing);
    return ok;
}

void labels_settle(
    struct labels *labels, const uint8_t id[PEN_ID_BYTES], const char *name, bool stored)
{
    struct label label;
    struct pen_error error = {0};
    bool had = labels_get(labels, id, &label);
    if (had ? !stored : !*name)
        return;
    if (!had)
        memcpy(label.name, name, strnlen(name, sizeof label.name - 1));
    if (!labels_set(labels, id, &label, &error))
        log_event(LOG_ERROR, "the name of a scene could not be kept: %s", error.message);
}

void labels_forget(struct labels *labels, const uint8_t id[PEN_ID_BYTES])
{
    put(labels, id, NULL);
}
