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
    check("scene.gltf", "http://localhost/a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "https:a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "a.bin%00.png", "a.bin", PEN_INVALID);
    check("scene.gltf", "", "a.bin", PEN_INVALID);
    check("scene.gltf", "..", "a.bin", PEN_INVALID);
    /* Outside the upload there is nothing to be found, but the last part may be in it. */
    check("scene.gltf", "../a.bin", "a.bin", PEN_OK);
    check("model/scene.gltf", "../../x/a.bin", "model/a.bin", PEN_OK);
    check("scene.gltf", "/somewhere/else/a.bin", "data/a.bin", PEN_OK);
    check("scene.gltf", "file:///somewhere/else/a.bin", "a.bin", PEN_OK);
    check("scene.gltf", "C:\\\\Users\\\\me\\\\a.bin", "a.bin", PEN_OK);
    check("scene.gltf", "../../../../etc/passwd", "a.bin", PEN_INVALID);
    check("scene.gltf", "/etc/passwd", "a.bin", PEN_INVALID);
    check("scene.txt", "a.bin", "a.bin", PEN_INVALID);
    check("../scene.gltf", "a.bin", "a.bin", PEN_INVALID);
}

/* Names as people, archivers and exporters write them. */
static void spellings(void)
{
#define COMPOSED "Sch\xc3\xb6n \xc3\xa9t\xc3\xa9"      /* normal form C */
#define DECOMPOSED "Scho\xcc\x88n e\xcc\x81te\xcc\x81" /* normal form D, as macOS writes it */
    check("scene.gltf", "textures\\\\a.bin", "textures/a.bin", PEN_OK); /* JSON: one backslash */
    check("scene.gltf", "textures/a.bin", "textures\\a.bin", PEN_OK);
    check("model/scene.gltf", "..\\\\data\\\\a.bin", "data/a.bin", PEN_OK);
    check("model\\scene.gltf", "data/a.bin", "model\\data\\a.bin", PEN_OK);
    check("scene.gltf", "a.bin?v=3", "a.bin", PEN_OK);
    check("scene.gltf", "a.bin#part", "a.bin", PEN_OK);
    check("scene.gltf", "a%23b.bin?x#y", "a#b.bin", PEN_OK);
    check("scene.gltf", "a#b.bin", "a#b.bin", PEN_OK);     /* not encoded, as it should be */
    check("scene.gltf", "50%.bin", "50%.bin", PEN_OK);     /* likewise */
    check("scene.gltf", "a%20b.bin", "a%20b.bin", PEN_OK); /* a name made from a URI */
    check("scene.gltf", "./data//a.bin", "data/a.bin", PEN_OK);
    check("scene.gltf", COMPOSED ".bin", DECOMPOSED ".bin", PEN_OK);
    check("scene.gltf", DECOMPOSED ".bin", COMPOSED ".bin", PEN_OK);
    check("scene.gltf", "Scho%CC%88n%20%C3%A9t%C3%A9.bin", COMPOSED ".bin", PEN_OK);
    check("scene.gltf", "\xce\x86\xcf\x8e.bin", "\xce\x91\xcc\x81\xcf\x89\xcc\x81.bin", PEN_OK);
    check("scene.gltf", "\xea\xb0\x80.bin", "\xe1\x84\x80\xe1\x85\xa1.bin", PEN_OK); /* Hangul */
    check("scene.gltf", "Textures/Wood.BIN", "textures/wood.bin", PEN_OK);
    check("scene.gltf", "\xc3\x84.bin", "a\xcc\x88.BIN", PEN_OK); /* both at once */
    check("C:\\fakepath\\scene.gltf", "a.bin", "C:\\fakepath\\a.bin", PEN_OK);
    check("D:\\work\\scene.gltf", "tex/a.bin", "D:\\work\\tex\\a.bin", PEN_OK);
    check("./scene.gltf", "a.bin", "./a.bin", PEN_OK);
    check("scene.gltf", " a.bin\\t", "a.bin", PEN_OK); /* JSON: a tab */
    check("scene.gltf", " a.bin", " a.bin", PEN_OK);
    check("scene.gltf", "file:///C:/Users/me/a.bin", "a.bin", PEN_OK);
    check("scene.gltf", "file://C:\\\\Users\\\\me\\\\a.bin", "a.bin", PEN_OK);
    check("C:\\..\\scene.gltf", "a.bin", "a.bin", PEN_INVALID);
    check("scene.gltf", "a.bin", "..\\a.bin", PEN_INVALID);
}

/* One name must not stand for two files, and the closest spelling wins. */
static void several_fit(void)
{
    const char *const names[] = {"A.png", "a.png", "x/b.png", "y/b.png", "x/B.PNG", "c.png"};
    struct pen_names index;
    pen_names_init(&index, names, 6);
    CHECK(pen_names_find(&index, "", "A.png", true) == 0 &&
          pen_names_find(&index, "", "a.png", true) == 1);
    CHECK(pen_names_find(&index, "", "a.PNG", true) == PEN_NAME_AMBIGUOUS);
    CHECK(pen_names_find(&index, "", "b.png", true) == PEN_NAME_AMBIGUOUS);
    CHECK(pen_names_find(&index, "y/s.gltf", "b.png", true) == 3);
    CHECK(
        pen_names_find(&index, "z/s.gltf", "B.PNG", true) == 4); /* the only one of this spelling */
    CHECK(pen_names_find(&index, "", "C.Png?1", true) == 5);
    CHECK(pen_names_find(&index, "", "d.png", true) == PEN_NAME_UNKNOWN);
    CHECK(pen_names_find(&index, "", "../c.png", true) == 5);
    CHECK(pen_names_find(&index, "", "../c.png", false) == PEN_NAME_ELSEWHERE);
    CHECK(pen_names_find(&index, "", "z/c.png", false) == PEN_NAME_UNKNOWN);
    CHECK(pen_names_find(&index, "", "ftp://h/c.png", true) == PEN_NAME_ELSEWHERE);
    char *longest = text("%01200d.png", 7);
    CHECK(pen_names_find(&index, longest, longest, true) == PEN_NAME_ELSEWHERE);
    free(longest);
    pen_names_finish(&index);
}

/* The upload with a choice in front. */
static struct imported import_entry(const char *entry, const uint8_t *data, size_t bytes)
{
    uint8_t upload[16384];
    size_t at = put(upload, 0, PEN_ENTRY_MAGIC, 8);
    at = put(upload, at, (uint32_t[]){(uint32_t)strlen(entry), 0}, 8);
    at = put(upload, at, entry, strlen(entry));
    return import_bytes(upload, put(upload, at, data, bytes));
}

static void entries(void)
{
    uint8_t upload[8192];
    char *json = scene("../a.bin");
    const struct entry files[] = {{"glTF/m.gltf", json, strlen(json)},
        {"glTF-Embedded/m.gltf", json, strlen(json)}, {"deep/in/m.gltf", json, strlen(json)},
        {"a.bin", triangle, 36}, {"__MACOSX/m.gltf", "x", 1}};
    for (int kind = 0; kind < 2; kind++) {
        size_t bytes =
            kind ? make_zip(upload, sizeof upload, files, 5) : make_bundle(upload, files, 5);
        struct imported r = import_bytes(upload, bytes);
        CHECK(r.error.code == PEN_INVALID && strstr(r.error.message, "\"glTF/m.gltf\"") &&
              strstr(r.error.message, "\"glTF-Embedded/m.gltf\"") &&
              !strstr(r.error.message, "deep") && !strstr(r.error.message, "MACOSX"));
        imported_free(&r);
        const char *const good[] = {"glTF/m.gltf", "gltf-embedded\\m.gltf"};
        for (int i = 0; i < 2; i++) {
            r = import_entry(good[i], upload, bytes);
            CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
            CHECK(r.ok && !has_warning(&r.scene, "several"));
            imported_free(&r);
        }
        const char *const bad[] = {"a.bin", "nothing.gltf", "m.gltf", "../glTF/x"};
        for (int i = 0; i < 4; i++) {
            r = import_entry(bad[i], upload, bytes);
            CHECK(r.error.code == PEN_INVALID && strstr(r.error.message, "deep/in/m.gltf"));
            CHECK_STR(r.error.pointer, "/entry");
            imported_free(&r);
        }
    }
    struct imported r = import_entry("m.gltf", (const uint8_t *)json, strlen(json));
    CHECK(r.error.code == PEN_INVALID && strstr(r.error.message, "single file"));
    imported_free(&r);
    for (size_t bytes = 8; bytes < 20; bytes++) {
        uint8_t cut[20] = PEN_ENTRY_MAGIC;
        memcpy(cut + 8, (uint32_t[]){0xffffffff, 0}, 8);
        r = import_bytes(cut, bytes);
        CHECK(r.error.code == PEN_INVALID && strstr(r.error.message, "truncated"));
        imported_free(&r);
    }
    const struct entry nested[] = {{"a.bin", triangle, 36}, {"m.gltf", json, strlen(json)},
        {"other/m.gltf", json, strlen(json)}};
    r = import_bytes(upload, make_bundle(upload, nested, 3));
    CHECK(r.ok && has_warning(&r.scene, "several")); /* the one nearest to the root */
    imported_free(&r);
    free(json);
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
    CHECK(!r.ok && strstr(r.error.message, "\"a.gltf\", \"b.glb\""));
    free(json);
}

static void names(void)
{
    const char *good[] = {"a", "a/b.c", "..a", "a..", "a b", "\xc3\xa9"};
    const char *bad[] = {"", "/a", "a/", "a//b", ".", "..", "a/..", "./a", "a\\b", "c:a", "a\nb"};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++)
        CHECK(pen_name_is_safe(good[i], strlen(good[i])));
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++)
        CHECK(!pen_name_is_safe(bad[i], strlen(bad[i])));
    CHECK(!pen_name_is_safe("a\0b", 3));
}

int main(void)
{
    uris();
    spellings();
    several_fit();
    entries();
    bundles();
    names();
    CHECK_DONE();
}
