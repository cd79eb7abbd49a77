#include "server/auto/calibration.h"
#include "server/base/file.h"
#include "protocol/json_writer.h"
#include "protocol/memory.h"
#include "server/base/hash.h"
#include "server/store/picture.h"
#include <cjson/cJSON.h>
#include <fcntl.h>
#include <stdio.h>
#include <stdlib.h>
#include <string.h>
#include <unistd.h>

#define MAX_FILE_BYTES (1 << 20)

struct calibration {
    uint32_t count; /* newest first */
    struct auto_table tables[CALIBRATION_TABLES];
};

static void hash_key(const struct pen_request *key, uint8_t digest[PEN_ID_BYTES])
{
    struct hash *hash = hash_create();
    hash_add(hash, key, PEN_REQUEST_KEY_BYTES);
    hash_finish(hash, digest);
}

void calibration_setup(
    const struct pen_request *request, uint8_t setup[PEN_ID_BYTES], uint8_t cost[PEN_ID_BYTES])
{
    struct pen_request key = *request;
    memset(key.technique, 0, sizeof key.technique);
    memset(key.technique_params, 0, sizeof key.technique_params);
    memset(key.ambient, 0, sizeof key.ambient);
    memset(key.background, 0, sizeof key.background);
    key.ground.on = key.ground.on != 0; /* a shadow catcher is a ground */
    key.exposure_ev = 0;
    key.tone_map = 0;
    key.width = (16 * request->width + request->height / 2) / request->height; /* its shape */
    key.height = 16;
    hash_key(&key, setup);
    memset(&key.camera, 0, sizeof key.camera);
    key.time_s = 0;
    memset(key.animation, 0, sizeof key.animation);
    for (uint32_t i = 0; i < PEN_MAX_LIGHTS; i++) {
        struct pen_light *light = &key.lights[i];
        memset(light->position, 0, sizeof light->position);
        memset(light->target, 0, sizeof light->target);
        memset(light->up, 0, sizeof light->up);
        memset(light->color, 0, sizeof light->color);
        light->power_w = light->radiance = light->irradiance = 0;
    }
    hash_key(&key, cost);
}

/* Device and build in one word. */
static void name_device(const struct pen_device_info *device, char name[PEN_ID_HEX + 1])
{
    static const struct pen_request nothing;
    picture_tag(&nothing, device, name);
}

static void file_name(const struct pen_device_info *device, char name[48])
{
    struct hash *hash = hash_create();
    uint8_t digest[PEN_ID_BYTES];
    char hex[PEN_ID_HEX + 1];
    hash_add(hash, device, sizeof *device);
    hash_finish(hash, digest);
    pen_id_to_hex(digest, hex);
    snprintf(name, 48, "calibration-%.12s.json", hex);
}

static double number(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsNumber(item) ? item->valuedouble : -1;
}

static const char *text(const cJSON *object, const char *key)
{
    const cJSON *item = cJSON_GetObjectItemCaseSensitive(object, key);
    return cJSON_IsString(item) ? item->valuestring : "";
}

static bool read_table(const cJSON *item, struct auto_table *table)
{
    const cJSON *rows = cJSON_GetObjectItemCaseSensitive(item, "rows");
    double pixels = number(item, "pixels");
    memset(table, 0, sizeof *table);
    if (!pen_id_from_hex(text(item, "setup"), table->setup) ||
        !pen_id_from_hex(text(item, "cost"), table->cost) || !(pixels >= 1 && pixels <= 1e9))
        return false;
    table->pixels = (uint32_t)pixels;
    for (const cJSON *at = rows ? rows->child : NULL; at && table->count < AUTO_MAX_ROWS;
         at = at->next) {
        struct auto_row *row = &table->rows[table->count];
        snprintf(row->key, sizeof row->key, "%.63s", text(at, "candidate"));
        row->rmse = number(at, "rmse");
        row->fixed_ms = number(at, "fixed_ms");
        row->screen_ms = number(at, "screen_ms");
        table->count += row->rmse >= 0 && row->fixed_ms >= 0 && row->screen_ms >= 0;
    }
    return table->count > 0;
}

static int open_folder(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES])
{
    return scene_store_open_folder(store, STORE_SCENES, scene, NULL);
}

/* Everything that is known; nothing when the file is damaged or of another build. */
static void read_all(int folder, const struct pen_device_info *device, struct calibration *all)
{
    char name[48], own[PEN_ID_HEX + 1];
    memset(all, 0, sizeof *all);
    file_name(device, name);
    name_device(device, own);
    int fd = openat(folder, name, O_RDONLY | O_CLOEXEC | O_NOFOLLOW);
    if (fd < 0)
        return;
    size_t bytes;
    char *content = file_read(fd, MAX_FILE_BYTES, &bytes);
    cJSON *root = content ? cJSON_ParseWithLength(content, bytes) : NULL;
    const cJSON *tables = cJSON_GetObjectItemCaseSensitive(root, "tables");
    bool ours = !strcmp(text(root, "measured_by"), own);
    for (const cJSON *at = ours && tables ? tables->child : NULL;
         at && all->count < CALIBRATION_TABLES; at = at->next)
        all->count += read_table(at, &all->tables[all->count]);
    cJSON_Delete(root);
    free(content);
    close(fd);
}

bool calibration_load(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_device_info *device, bool any, struct auto_table *table)
{
    struct calibration *all = pen_alloc(1, sizeof *all);
    const struct auto_table *found = NULL;
    int folder = open_folder(store, scene);
    all->count = 0;
    if (folder >= 0) {
        read_all(folder, device, all);
        close(folder);
    }
    for (uint32_t i = 0; i < all->count && !found; i++)
        if (!memcmp(all->tables[i].setup, table->setup, PEN_ID_BYTES))
            found = &all->tables[i];
    for (uint32_t i = 0; any && i < all->count && !found; i++)
        if (!memcmp(all->tables[i].cost, table->cost, PEN_ID_BYTES))
            found = &all->tables[i];
    if (found) {
        bool borrowed = memcmp(found->setup, table->setup, PEN_ID_BYTES) != 0;
        *table = *found;
        table->borrowed = borrowed;
    }
    free(all);
    return found;
}

static char *write_all(const struct calibration *all, const struct pen_device_info *device)
{
    struct pen_json json = {0};
    char own[PEN_ID_HEX + 1];
    name_device(device, own);
    pen_json_object(&json, NULL);
    pen_json_string(&json, "measured_by", own);
    pen_json_string(&json, "device", device->renderer);
    pen_json_array(&json, "tables");
    for (uint32_t t = 0; t < all->count; t++) {
        const struct auto_table *table = &all->tables[t];
        pen_json_object(&json, NULL);
        pen_json_id(&json, "setup", table->setup);
        pen_json_id(&json, "cost", table->cost);
        pen_json_uint(&json, "pixels", table->pixels);
        pen_json_array(&json, "rows");
        for (uint32_t r = 0; r < table->count; r++) {
            pen_json_object(&json, NULL);
            pen_json_string(&json, "candidate", table->rows[r].key);
            pen_json_float(&json, "rmse", (float)table->rows[r].rmse);
            pen_json_float(&json, "fixed_ms", (float)table->rows[r].fixed_ms);
            pen_json_float(&json, "screen_ms", (float)table->rows[r].screen_ms);
            pen_json_end(&json);
        }
        pen_json_end(&json);
        pen_json_end(&json);
    }
    pen_json_end(&json);
    pen_json_end(&json);
    return pen_json_finish(&json, NULL);
}

bool calibration_save(struct scene_store *store, const uint8_t scene[PEN_ID_BYTES],
    const struct pen_device_info *device, const struct auto_table *table)
{
    static const char part[] = "calibration.part";
    struct calibration *all = pen_alloc(1, sizeof *all);
    char name[48], *content = NULL;
    int folder = open_folder(store, scene), fd = -1;
    bool ok = false;
    if (folder < 0)
        goto done;
    read_all(folder, device, all);
    uint32_t at = 0; /* of the view's old table, else where a new one is made room for */
    while (at < all->count && memcmp(all->tables[at].setup, table->setup, PEN_ID_BYTES))
        at++;
    if (at == all->count && at < CALIBRATION_TABLES)
        all->count++;
    at = at < CALIBRATION_TABLES ? at : CALIBRATION_TABLES - 1;
    memmove(&all->tables[1], &all->tables[0], at * sizeof *all->tables);
    all->tables[0] = *table;
    content = write_all(all, device);
    file_name(device, name);
    size_t bytes = strlen(content);
    fd = openat(folder, part, O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC | O_NOFOLLOW, 0600);
    ok = fd >= 0 && write(fd, content, bytes) == (ssize_t)bytes && !fsync(fd) &&
         file_replace(folder, part, folder, name);
done:
    if (fd >= 0)
        close(fd);
    if (folder >= 0)
        close(folder);
    free(content);
    free(all);
    return ok;
}
