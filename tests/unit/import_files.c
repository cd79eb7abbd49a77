/* Uploads of several files: bundles, zips, and what a URI may name. */
#include "renderer/import/bundle.h"
#include "renderer/import/files/files.h"
#include "tests/unit/import_support.h"
#include <zip.h>

struct entry {
    const char *name;
    const void *data;
    size_t bytes;
};

static const float triangle[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};

static char *scene(const char *uri)
{
    return text("{\"asset\":{\"version\":\"2.0\"},\"nodes\":[{\"mesh\":0}],"
                "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
                "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,"
                "\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
                "\"buffers\":[{\"byteLength\":36,\"uri\":\"%s\"}]}",
        uri);
}

static size_t put(uint8_t *to, size_t at, const void *data, size_t bytes)
{
    memcpy(to + at, data, bytes);
    return at + bytes;
}

static size_t make_bundle(uint8_t *to, const struct entry *entries, uint32_t count)
{
    size_t at = put(to, 0, PEN_BUNDLE_MAGIC, 8);
    at = put(to, at, (uint32_t[]){count, 0}, 8);
    for (uint32_t i = 0; i < count; i++) {
        uint32_t name_bytes = (uint32_t)strlen(entries[i].name);
        uint64_t data_bytes = entries[i].bytes;
        at = put(to, at, (uint32_t[]){name_bytes, 0}, 8);
        at = put(to, at, &data_bytes, 8);
        at = put(to, at, entries[i].name, name_bytes);
        at = put(to, at, entries[i].data, entries[i].bytes);
    }
    return at;
}

static size_t make_zip(uint8_t *to, size_t room, const struct entry *entries, uint32_t count)
{
    zip_error_t e;
    zip_source_t *target = zip_source_buffer_create(NULL, 0, 0, &e);
    zip_source_keep(target);
    zip_t *zip = zip_open_from_source(target, ZIP_TRUNCATE, &e);
    for (uint32_t i = 0; i < count; i++)
        zip_file_add(
            zip, entries[i].name, zip_source_buffer(zip, entries[i].data, entries[i].bytes, 0), 0);
    zip_close(zip);
    zip_source_open(target);
    zip_int64_t n = zip_source_read(target, to, room);
    zip_source_close(target);
    zip_source_free(target);
    return (size_t)n;
}

/* The bundle and the zip of a scene at `name` whose buffer is at `uri`, stored as `stored`. */
static void check(const char *name, const char *uri, const char *stored, enum pen_code code)
{
    uint8_t upload[8192];
    char *json = scene(uri);
    struct entry entries[] = {{name, json, strlen(json)}, {stored, triangle, sizeof triangle},
        {"readme.txt", "hello", 5}};
    for (int kind = 0; kind < 2; kind++) {
        size_t bytes =
            kind ? make_zip(upload, sizeof upload, entries, 3) : make_bundle(upload, entries, 3);
        struct imported r = import_bytes(upload, bytes);
        if (r.error.code != code) {
            fprintf(
                stderr, "%s, %s, %s: %u %s\n", name, uri, stored, r.error.code, r.error.message);
            check_failures++;
        }
        CHECK(code || draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
        imported_free(&r);
    }
    free(json);
}

static void uris(void)
{
    check("scene.gltf", "a.bin", "a.bin", PEN_OK);
    check("scene.gltf", "my%20data.bin", "my data.bin", PEN_OK);
    check("scene.gltf", "./x/../a.bin", "a.bin", PEN_OK);
    check("model/scene.gltf", "data/a.bin", "model/data/a.bin", PEN_OK);
    check("model/scene.gltf", "../a.bin", "a.bin", PEN_OK);
    check("scene.gltf", "data/a.bin", "a.bin", PEN_OK); /* a form dropped the folder */
    check("scene.gltf", "b.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "../a.bin", "a.bin", PEN_INVALID);
    check("model/scene.gltf", "../../a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "/a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "%2e%2e/a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "file:///a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "http://localhost/a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "a.bin%00.png", "a.bin", PEN_INVALID);
    check("scene.gltf", "C:\\\\a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "", "a.bin", PEN_INVALID);
    check("scene.txt", "a.bin", "a.bin", PEN_INVALID);
    check("../scene.gltf", "a.bin", "a.bin", PEN_INVALID);
}

static void bundles(void)
{
    uint8_t upload[8192];
    char *json = scene("a.bin");
    const struct entry entries[] = {{"a.bin", triangle, 36}, {"s.gltf", json, strlen(json)}};
    const struct entry twice[] = {{"a.bin", triangle, 36}, {"a.bin", triangle, 36}};
    const struct entry two[] = {{"a.gltf", json, 5}, {"b.glb", json, 5}};
    size_t bytes = make_bundle(upload, entries, 2);
    for (size_t n = 8; n < bytes; n++) {
        struct imported r = import_bytes(upload, n);
        CHECK(!r.ok && pen_code_blame(r.error.code) == PEN_BLAME_CALLER);
        imported_free(&r);
    }
    struct imported r = import_bytes(upload, bytes + 1);
    CHECK(!r.ok);
    upload[9] = 0xff; /* 65282 entries */
    r = import_bytes(upload, bytes);
    CHECK(r.error.code == PEN_TOO_BIG);
    r = import_bytes(upload, make_bundle(upload, twice, 2));
    CHECK(!r.ok && strstr(r.error.message, "twice"));
    r = import_bytes(upload, make_bundle(upload, two, 2));
    CHECK(!r.ok && strstr(r.error.message, "could be the scene"));
    free(json);
}

static void names(void)
{
    const char *good[] = {"a", "a/b.c", "..a", "a..", "a b", "\xc3\xa9"};
    const char *bad[] = {"", "/a", "a/", "a//b", ".", "..", "a/..", "./a", "a\\b", "c:a", "a\nb"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        CHECK(imp_name_is_safe(good[i], strlen(good[i])));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(!imp_name_is_safe(bad[i], strlen(bad[i])));
    CHECK(!imp_name_is_safe("a\0b", 3));
}

int main(void)
{
    uris();
    bundles();
    names();
    CHECK_DONE();
}
