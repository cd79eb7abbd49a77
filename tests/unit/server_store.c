/* The store: complete or not there, across openings, damage and leftovers. */
#include "protocol/request.h"
#include "renderer/blob/builder.h"
#include "server/base/file.h"
#include "server/base/hash.h"
#include "server/store/scene_store.h"
#include "server/uploads/upload.h"
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

/* Five sources of six bytes, and their ids in order. */
static char sources[5][8];
static uint8_t ids[5][PEN_ID_BYTES];

static int by_id(const void *a, const void *b)
{
    uint8_t x[PEN_ID_BYTES], y[PEN_ID_BYTES];
    struct hash *hash[2] = {hash_create(), hash_create()};
    hash_add(hash[0], a, 6);
    hash_add(hash[1], b, 6);
    hash_finish(hash[0], x);
    hash_finish(hash[1], y);
    return memcmp(x, y, PEN_ID_BYTES);
}

static void make_sources(void)
{
    for (int i = 0; i < 5; i++)
        snprintf(sources[i], sizeof sources[i], "six %02d", i);
    qsort(sources, 5, sizeof *sources, by_id);
    for (int i = 0; i < 5; i++) {
        struct hash *hash = hash_create();
        hash_add(hash, sources[i], 6);
        hash_finish(hash, ids[i]);
    }
}

/* A folder as the importer leaves it. */
static void fill(const struct store_staging *staging, int which)
{
    const uint8_t *id = ids[which];
    struct psc_builder *builder = psc_builder_create();
    struct psc_material material = psc_material_default();
    void *data;
    size_t bytes;
    psc_builder_add_material(builder, &material);
    CHECK(psc_builder_finish(builder, id, &data, &bytes, NULL));
    psc_builder_destroy(builder);
    write_file(staging->folder, STORE_SOURCE, sources[which], 6);
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
    struct scene_store *store = scene_store_open(root, 0, NULL);
    struct pen_error error = {0};
    struct store_staging staging;
    struct store_entry entry;
    bool added;
    CHECK(store != NULL);
    CHECK(!scene_store_open(root, 0, &error) && error.code == PEN_UNAVAILABLE); /* one at a time */
    for (int i = 4; i >= 0; i--) {
        CHECK(scene_store_stage(store, &staging, NULL));
        fill(&staging, i);
        CHECK(scene_store_commit(store, STORE_SCENES, &staging, ids[i], &added, NULL) && added);
    }
    const uint8_t *twenty = ids[1];
    uint8_t after[PEN_ID_BYTES]; /* between the second and the third */
    memcpy(after, ids[1], sizeof after);
    after[PEN_ID_BYTES - 1]++;
    CHECK(scene_store_stage(store, &staging, NULL));
    fill(&staging, 1);
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, twenty, &added, NULL) && !added);
    CHECK(count_files("tmp") == 0);
    struct store_entry list[8];
    CHECK(scene_store_list(store, STORE_SCENES, NULL, list, 8) == 5);
    for (int i = 0; i < 5; i++)
        CHECK(!memcmp(list[i].id, ids[i], PEN_ID_BYTES) && list[i].source_bytes == 6 &&
              !list[i].stale);
    CHECK(scene_store_list(store, STORE_SCENES, twenty, list, 2) == 2 &&
          !memcmp(list[0].id, ids[2], PEN_ID_BYTES));
    CHECK(scene_store_list(store, STORE_SCENES, after, list, 8) == 3 &&
          !memcmp(list[0].id, ids[2], PEN_ID_BYTES));
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
    fill(&staging, 1);
    close(staging.folder);
    scene_store_close(store);
}

static void test_reopening(void)
{
    char path[256], hex[PEN_ID_HEX + 1];
    const uint8_t *ten = ids[0], *thirty = ids[2], *forty = ids[3];
    CHECK(count_files("tmp") == 1);
    pen_id_to_hex(ten, hex); /* a blob that was cut */
    snprintf(path, sizeof path, "%s/scenes/%s/scene.pscene", root, hex);
    CHECK(truncate(path, 100) == 0);
    pen_id_to_hex(thirty, hex); /* a source that is lost */
    snprintf(path, sizeof path, "%s/scenes/%s/source", root, hex);
    CHECK(unlink(path) == 0);
    pen_id_to_hex(ids[4], hex); /* both */
    snprintf(path, sizeof path, "%s/scenes/%s/source", root, hex);
    CHECK(unlink(path) == 0);
    snprintf(path, sizeof path, "%s/scenes/%s/scene.pscene", root, hex);
    CHECK(unlink(path) == 0);
    snprintf(path, sizeof path, "%s/scenes/not-a-scene", root);
    CHECK(mkdir(path, 0700) == 0);
    struct scene_store *store = scene_store_open(root, 0, NULL);
    struct store_entry entry;
    struct pen_error error = {0};
    CHECK(store && count_files("tmp") == 0);
    CHECK(scene_store_count(store, STORE_SCENES) == 3);
    CHECK(scene_store_find(store, STORE_SCENES, ten, &entry) && entry.stale);
    /* A blob without its source is drawn, but not sound; without both, it is not listed. */
    CHECK(scene_store_find(store, STORE_SCENES, thirty, &entry) && !entry.stale);
    CHECK(!scene_store_is_sound(store, STORE_SCENES, thirty));
    CHECK(!scene_store_find(store, STORE_SCENES, ids[4], &entry) && count_files("damaged") == 1);
    CHECK(scene_store_find(store, STORE_SCENES, forty, &entry) && !entry.stale);
    CHECK(scene_store_open_blob(store, STORE_SCENES, ten, &error) < 0 &&
          error.code == PEN_UNAVAILABLE);
    struct store_staging staging;
    CHECK(scene_store_stage(store, &staging, NULL));
    fill(&staging, 0);
    CHECK(scene_store_refresh(store, STORE_SCENES, &staging, ten, NULL));
    CHECK(scene_store_find(store, STORE_SCENES, ten, &entry) && !entry.stale);
    CHECK(scene_store_is_sound(store, STORE_SCENES, ten));
    bool added; /* what is not sound is replaced */
    CHECK(scene_store_stage(store, &staging, NULL));
    fill(&staging, 2);
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, thirty, &added, NULL) && added);
    CHECK(scene_store_is_sound(store, STORE_SCENES, thirty));
    CHECK(count_files("tmp") == 0);
    scene_store_close(store);
}

static void test_uploads(void)
{
    static const uint8_t abc[PEN_ID_BYTES] = {0xba, 0x78, 0x16, 0xbf, 0x8f, 0x01, 0xcf, 0xea, 0x41,
        0x41, 0x40, 0xde, 0x5d, 0xae, 0x22, 0x23, 0xb0, 0x03, 0x61, 0xa3, 0x96, 0x17, 0x7a, 0x9c,
        0xb4, 0x10, 0xff, 0x61, 0xf2, 0x00, 0x15, 0xad}; /* FIPS 180-2, appendix B.1 */
    struct scene_store *store = scene_store_open(root, 0, NULL);
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

static uint64_t asked;

static void reclaim_hundred(void *context, uint64_t bytes)
{
    struct store_quota *quota = context;
    asked = bytes;
    store_quota_settle(quota, 100, 0);
    store_quota_spare(quota, 100, 0);
}

static void test_quota(void)
{
    struct store_quota *quota = store_quota_create(1000);
    struct pen_error error = {0};
    CHECK(store_quota_claim(quota, 600, NULL) && store_quota_left(quota) == 400);
    CHECK(!store_quota_claim(quota, 401, &error) && error.code == PEN_FULL);
    CHECK(store_quota_claim(quota, 400, NULL) && store_quota_left(quota) == 0);
    CHECK(store_quota_claim(quota, 0, NULL));
    store_quota_spare(quota, 0, 100);
    CHECK(store_quota_left(quota) == 100 && store_quota_used(quota) == 1000);
    CHECK(!store_quota_claim(quota, 30, NULL)); /* nobody frees it */
    store_quota_on_need(quota, reclaim_hundred, quota);
    CHECK(store_quota_claim(quota, 30, NULL) && asked == 30);
    CHECK(store_quota_used(quota) == 930 && store_quota_left(quota) == 70);
    store_quota_settle(quota, 900, 5000); /* more was found there than is allowed */
    CHECK(store_quota_left(quota) == 0 && !store_quota_fits(quota, 1, NULL));
    CHECK(!store_quota_claim(quota, UINT64_MAX, NULL));
    store_quota_destroy(quota);
    quota = store_quota_create(0);
    CHECK(store_quota_left(quota) == UINT64_MAX && store_quota_claim(quota, 1ull << 50, NULL));
    store_quota_destroy(quota);
}

/* Every way in and out of the store leaves the sum as the entries have it. */
static void test_limit(void)
{
    char folder[] = "/tmp/penumbra-limit-XXXXXX";
    CHECK(mkdtemp(folder) != NULL);
    struct scene_store *store = scene_store_open(folder, 3 * STORE_ENTRY_BYTES, NULL);
    struct store_quota *quota = scene_store_quota(store);
    struct store_staging staging;
    struct store_entry entry;
    struct pen_error error = {0};
    bool added;
    CHECK(store_quota_used(quota) == 0);
    CHECK(scene_store_stage(store, &staging, NULL));
    CHECK(scene_store_claim(store, &staging, 2 * STORE_ENTRY_BYTES, NULL));
    CHECK(!scene_store_claim(store, &staging, 2 * STORE_ENTRY_BYTES, &error));
    CHECK(error.code == PEN_FULL && store_quota_used(quota) == 2 * STORE_ENTRY_BYTES);
    scene_store_give_back(store, &staging, 100);
    CHECK(store_quota_used(quota) == 2 * STORE_ENTRY_BYTES - 100);
    fill(&staging, 0);
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, ids[0], &added, NULL) && added);
    CHECK(scene_store_find(store, STORE_SCENES, ids[0], &entry));
    uint64_t one = store_entry_size(&entry);
    CHECK(one > STORE_ENTRY_BYTES && store_quota_used(quota) == one);
    CHECK(scene_store_stage(store, &staging, NULL) && scene_store_claim(store, &staging, 77, NULL));
    fill(&staging, 0); /* the same again */
    CHECK(scene_store_commit(store, STORE_SCENES, &staging, ids[0], &added, NULL) && !added);
    CHECK(store_quota_used(quota) == one);
    CHECK(scene_store_stage(store, &staging, NULL) && scene_store_claim(store, &staging, 77, NULL));
    fill(&staging, 0);
    CHECK(scene_store_refresh(store, STORE_SCENES, &staging, ids[0], NULL));
    CHECK(store_quota_used(quota) == one);
    CHECK(scene_store_stage(store, &staging, NULL) && scene_store_claim(store, &staging, 77, NULL));
    scene_store_discard(store, &staging);
    CHECK(store_quota_used(quota) == one);
    scene_store_close(store);
    store = scene_store_open(folder, 1, NULL); /* less than is there */
    CHECK(store && store_quota_used(scene_store_quota(store)) == one);
    CHECK(scene_store_remove(store, STORE_SCENES, ids[0], NULL));
    CHECK(store_quota_used(scene_store_quota(store)) == 0);
    scene_store_close(store);
    file_remove_all(AT_FDCWD, folder);
}

/* The check values of CRC-64 of ECMA-182 as xz has it, from its specification. */
static void test_sums(void)
{
    char path[] = "/tmp/penumbra-sums-XXXXXX", text[80];
    CHECK(mkdtemp(path) != NULL);
    int folder = open(path, O_RDONLY | O_DIRECTORY);
    write_file(folder, "nine", "123456789", 9);
    const char *const names[] = {"nine"};
    CHECK(sums_write(folder, names, 1));
    int fd = openat(folder, STORE_SUMS, O_RDONLY);
    ssize_t n = read(fd, text, sizeof text - 1);
    close(fd);
    text[n > 0 ? n : 0] = 0;
    CHECK(!strcmp(text, "995dc9bbdf1939fa 9 nine\n"));
    struct sums_mark mark = {0};
    fd = openat(folder, "nine", O_RDWR);
    CHECK(sums_are_right(folder, "nine", fd, &mark) && mark.bytes == 9);
    CHECK(!sums_are_right(folder, "ten", fd, NULL));
    CHECK(pwrite(fd, "0", 1, 4) == 1);
    CHECK(!sums_are_right(folder, "nine", fd, NULL));
    CHECK(pwrite(fd, "5", 1, 4) == 1);
    CHECK(sums_are_right(folder, "nine", fd, &mark));
    CHECK(ftruncate(fd, 8) == 0);
    CHECK(!sums_are_right(folder, "nine", fd, &mark));
    close(fd);
    unlinkat(folder, "nine", 0);
    unlinkat(folder, STORE_SUMS, 0);
    close(folder);
    rmdir(path);
}

int main(void)
{
    make_sources();
    test_sums();
    CHECK(mkdtemp(root) != NULL);
    test_life();
    test_reopening();
    test_uploads();
    test_quota();
    test_limit();
    char command[64];
    snprintf(command, sizeof command, "rm -rf %s", root);
    CHECK(system(command) == 0);
    CHECK_DONE();
}
