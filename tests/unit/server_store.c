/* The store: complete or not there, across openings, damage and leftovers. */
#include "protocol/request.h"
#include "renderer/blob/builder.h"
#include "server/store/scene_store.h"
#include "server/store/upload.h"
#include "tests/unit/check.h"
#include <dirent.h>
#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

static char root[] = "/tmp/penumbra-store-XXXXXX";

static void write_file(int folder, const char *name, const void *data, size_t bytes)
{
    int fd = openat(folder, name, O_WRONLY | O_CREAT | O_TRUNC, 0600);
    CHECK(fd >= 0 && write(fd, data, bytes) == (ssize_t)bytes);
    close(fd);
}

/* A folder as the importer leaves it. */
static void fill(const struct store_staging *staging, const uint8_t id[PEN_ID_BYTES])
{
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    void *data;
    size_t bytes;
    psc_builder_add_material(builder, &material);
    CHECK(psc_builder_finish(builder, id, &data, &bytes, NULL));
    psc_builder_destroy(builder);
    write_file(staging->folder, STORE_SOURCE, "source", 6);
    write_file(staging->folder, "scene.pscene", data, bytes);
    write_file(staging->folder, STORE_META, "{}", 2);
    free(data);
}

static int count_files(const char *folder)
{
    char path[256];
    int count = 0;
    snprintf(path, sizeof path, "%s/%s", root, folder);
    DIR *dir = opendir(path);
    while (dir && readdir(dir))
        count++;
    closedir(dir);
    return count - 2;
}

static void test_life(void)
{
    struct scene_store *store = scene_store_open(root, NULL);
    struct pen_error error = {0};
    struct store_staging staging;
    struct store_entry entry;
    bool added;
    CHECK(store != NULL);
    CHECK(!scene_store_open(root, &error) && error.code == PEN_UNAVAILABLE); /* one at a time */
    for (uint8_t i = 1; i <= 5; i++) {
        uint8_t id[PEN_ID_BYTES] = {(uint8_t)(10 * (6 - i))};
        CHECK(scene_store_stage(store, &staging, NULL));
        fill(&staging, id);
        CHECK(scene_store_commit(store, STORE_SCENES, &staging, id, &added, NULL) && added);
    }
    uint8_t twenty[PEN_ID_BYTES] = {20}, after[PEN_ID_BYTES] = {25};
    CHECK(scene_store_stage(store, &staging, NULL));
    fill(&staging, twenty);
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, twenty, &added, NULL) && !added);
    CHECK(count_files("tmp") == 0);
    struct store_entry list[8];
    CHECK(scene_store_list(store, STORE_SCENES, NULL, list, 8) == 5);
    for (int i = 0; i < 5; i++)
        CHECK(list[i].id[0] == 10 * (i + 1) && list[i].source_bytes == 6 && !list[i].stale);
    CHECK(scene_store_list(store, STORE_SCENES, twenty, list, 2) == 2 && list[0].id[0] == 30);
    CHECK(scene_store_list(store, STORE_SCENES, after, list, 8) == 3 && list[0].id[0] == 30);
    CHECK(scene_store_list(store, STORE_IMAGES, NULL, list, 8) == 0);
    int fd = scene_store_open_blob(store, STORE_SCENES, twenty, NULL);
    struct psc_scene scene;
    CHECK(fd >= 0 && psc_open(fd, &scene, NULL) && scene.material_count == 1);
    CHECK(scene_store_remove(store, STORE_SCENES, twenty, NULL));
    CHECK(psc_open(fd, &scene, NULL)); /* whoever has it open keeps it */
    psc_close(&scene);
    close(fd);
    error.code = 0;
    CHECK(!scene_store_remove(store, STORE_SCENES, twenty, &error) && error.code == PEN_NOT_FOUND);
    CHECK(scene_store_open_blob(store, STORE_SCENES, twenty, NULL) < 0);
    CHECK(!scene_store_find(store, STORE_SCENES, twenty, &entry));
    CHECK(scene_store_count(store, STORE_SCENES) == 4 && count_files("tmp") == 0);
    CHECK(scene_store_stage(store, &staging, NULL)); /* and then the machine goes down */
    fill(&staging, twenty);
    close(staging.folder);
    scene_store_close(store);
}

static void test_reopening(void)
{
    char path[256], hex[PEN_ID_HEX + 1];
    uint8_t ten[PEN_ID_BYTES] = {10}, thirty[PEN_ID_BYTES] = {30}, forty[PEN_ID_BYTES] = {40};
    CHECK(count_files("tmp") == 1);
    pen_id_to_hex(ten, hex); /* a blob that was cut */
    snprintf(path, sizeof path, "%s/scenes/%s/scene.pscene", root, hex);
    CHECK(truncate(path, 100) == 0);
    pen_id_to_hex(thirty, hex); /* a source that is lost */
    snprintf(path, sizeof path, "%s/scenes/%s/source", root, hex);
    CHECK(unlink(path) == 0);
    snprintf(path, sizeof path, "%s/scenes/not-a-scene", root);
    CHECK(mkdir(path, 0700) == 0);
    struct scene_store *store = scene_store_open(root, NULL);
    struct store_entry entry;
    struct pen_error error = {0};
    CHECK(store && count_files("tmp") == 0);
    CHECK(scene_store_count(store, STORE_SCENES) == 3);
    CHECK(scene_store_find(store, STORE_SCENES, ten, &entry) && entry.stale);
    CHECK(!scene_store_find(store, STORE_SCENES, thirty, &entry));
    CHECK(scene_store_find(store, STORE_SCENES, forty, &entry) && !entry.stale);
    CHECK(scene_store_open_blob(store, STORE_SCENES, ten, &error) < 0 &&
          error.code == PEN_UNAVAILABLE);
    struct store_staging staging;
    CHECK(scene_store_stage(store, &staging, NULL));
    fill(&staging, ten);
    CHECK(scene_store_refresh(store, STORE_SCENES, &staging, ten, NULL));
    CHECK(scene_store_find(store, STORE_SCENES, ten, &entry) && !entry.stale);
    CHECK(count_files("tmp") == 0);
    scene_store_close(store);
}

static void test_uploads(void)
{
    static const uint8_t abc[PEN_ID_BYTES] = {0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea, 0x41,
        0x41, 0x40, 0xde, 0x5d, 0xae, 0x22, 0x23, 0xb0, 0x03, 0x61, 0xa3, 0x96, 0x17, 0x7a, 0x9c,
        0xb4, 0x10, 0xff, 0x61, 0xf2, 0x00, 0x15, 0xad}; /* FIPS 180-2, appendix B.1 */
    struct scene_store *store = scene_store_open(root, NULL);
    uint8_t id[PEN_ID_BYTES];
    struct upload *upload = upload_create(store, "model/gltf-binary", "", 3, NULL);
    CHECK(upload_add(upload, "a", 1, NULL) && upload_add(upload, "bc", 2, NULL));
    CHECK(upload_finish(upload, id, NULL));
    CHECK(!memcmp(id, abc, PEN_ID_BYTES));
    CHECK(count_files("tmp") == 1);
    upload_destroy(upload);
    CHECK(count_files("tmp") == 0);
    struct pen_error error = {0};
    upload = upload_create(store, "model/gltf-binary", "", 3, NULL);
    CHECK(!upload_add(upload, "abcd", 4, &error) && error.code == PEN_TOO_BIG);
    upload_destroy(upload);
    CHECK(count_files("tmp") == 0);
    scene_store_close(store);
}

int main(void)
{
    CHECK(mkdtemp(root) != NULL);
    test_life();
    test_reopening();
    test_uploads();
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", root);
    CHECK(system(command) == 0);
    CHECK_DONE();
}
