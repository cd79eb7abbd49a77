/* The document before any vertex: containers, JSON, schema, extensions, data URIs; and that each
 * refusal comes from the check that is meant to make it. */
#include "renderer/import/document/document.h"
#include "tests/unit/import_support.h"

#define ASSET "{\"asset\":{\"version\":\"2.0\"}"

static void refused(const char *json, enum pen_code code, const char *pointer, const char *part)
{
    struct imported r = import_json(json);
    if (r.ok || r.error.code != code || strcmp(r.error.pointer, pointer) ||
        !strstr(r.error.message, part)) {
        fprintf(stderr, "%.80s: %u %s %s\n", json, r.error.code, r.error.pointer, r.error.message);
        check_failures++;
    }
    imported_free(&r);
}

static void depth(void)
{
    for (int levels = 63; levels <= 64; levels++) { /* and the document itself is one */
        char open[65] = "", shut[65] = "";
        memset(open, '[', (size_t)levels);
        memset(shut, ']', (size_t)levels);
        char *json = text(ASSET ",\"extras\":%s%s}", open, shut);
        if (levels == 64)
            refused(json, PEN_INVALID, "", "nested more than 64 deep");
        struct imported r = import_json(json);
        CHECK(r.ok == (levels == 63));
        imported_free(&r);
        free(json);
    }
    struct imported r = import_json(ASSET ",\"extras\":\"[[[[{{{{\\\"[\"}"); /* not in strings */
    CHECK(r.ok && has_warning(&r.scene, "draws nothing"));
    imported_free(&r);
}

static void schema(void)
{
    refused(ASSET ",\"nodes\":[],\"nodes\":[]}", PEN_INVALID, "/nodes", "twice");
    refused(ASSET ",\"nodes\":[{},{\"mesh\":1,\"mesh\":1}],\"meshes\":[{\"primitives\":[]},"
                  "{\"primitives\":[]}]}",
        PEN_INVALID, "/nodes/1/mesh", "twice");
    refused(ASSET ",\"nodes\":[{\"mesh\":0}]}", PEN_INVALID, "/nodes/0/mesh", "does not exist");
    refused(ASSET ",\"nodes\":[{\"rotation\":[0,0,1]}]}", PEN_INVALID, "/nodes/0/rotation",
        "components");
    refused(ASSET ",\"nodes\":[{\"rotation\":[0,0,1,1e39]}]}", PEN_INVALID, "/nodes/0/rotation/3",
        "finite");
    refused(ASSET ",\"meshes\":[{}]}", PEN_INVALID, "/meshes/0/primitives", "required");
    refused(ASSET ",\"materials\":[{\"doubleSided\":1}]}", PEN_INVALID, "/materials/0/doubleSided",
        "true or false");
    refused(ASSET ",\"bufferViews\":[{\"buffer\":0,\"byteLength\":-1}],\"buffers\":[{"
                  "\"byteLength\":1,\"uri\":\"data:;base64,AA==\"}]}",
        PEN_INVALID, "/bufferViews/0/byteLength", "integer");
    refused("{\"asset\":{\"version\":\"1.0\"}}", PEN_INVALID, "/asset/version", "1.0");
    refused("{\"asset\":{\"version\":\"1.0\"}}", PEN_INVALID, "/asset/version", "gltf-pipeline -i");
    refused(ASSET "} {}", PEN_INVALID, "", "followed by");
    refused(ASSET ",}", PEN_INVALID, "", "cannot be parsed");
    struct imported r = import_json("\xef\xbb\xbf \n" ASSET "}\r\n"); /* byte order mark, blanks */
    CHECK(r.ok);
    imported_free(&r);
}

static void extensions(void)
{
    refused(ASSET ",\"extensionsRequired\":[\"KHR_mesh_quantization\",\"ACME_magic\"]}",
        PEN_INVALID, "/extensionsRequired", "ACME_magic");
    struct imported r = import_json(ASSET ",\"extensionsUsed\":[\"KHR_materials_clearcoat\",\"KHR_"
                                          "texture_transform\",\"A\\u00e9\"]}");
    CHECK(r.ok && has_warning(&r.scene, "KHR_materials_clearcoat is drawn without its coat"));
    CHECK(r.ok && !has_warning(&r.scene, "KHR_texture_transform") &&
          has_warning(&r.scene, "A\u00e9 "));
    imported_free(&r);
}

/* What is only missing in the shading does not refuse a scene that requires it. */
static void required_materials(void)
{
    const char *const names[] = {"anisotropy", "clearcoat", "diffuse_transmission", "dispersion",
        "iridescence", "sheen", "transmission", "volume"};
    for (size_t i = 0; i < sizeof names / sizeof *names; i++) {
        char *name = text("KHR_materials_%s", names[i]);
        char *json =
            text(ASSET ",\"extensionsUsed\":[\"%s\"],\"extensionsRequired\":[\"%s\"]}", name, name);
        struct imported r = import_json(json);
        CHECK(r.ok && has_warning(&r.scene, name));
        imported_free(&r);
        free(json);
        free(name);
    }
    struct imported r = import_json(ASSET ",\"extensionsRequired\":[\"KHR_materials_ior\","
                                          "\"KHR_materials_specular\",\"KHR_texture_basisu\"]}");
    CHECK(r.ok && !has_warning(&r.scene, "materials") && has_warning(&r.scene, "basisu"));
    imported_free(&r);
}

static void containers(void)
{
    const char json[] = ASSET ",\"buffers\":[{\"byteLength\":36}],\"bufferViews\":[{\"buffer\":0,"
                              "\"byteLength\":36}],\"accessors\":[{\"bufferView\":0,"
                              "\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"}],\"meshes\":[{"
                              "\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],\"nodes\":[{"
                              "\"mesh\":0}]}";
    const float positions[9] = {0, 0, 0, 1, 0, 0, 0, 1, 0};
    uint8_t glb[1024] = "glTF";
    uint32_t n = (sizeof json - 1 + 3) / 4 * 4, at = 20;
    memset(glb + at, ' ', n);
    memcpy(glb + at, json, sizeof json - 1);
    at += n;
    memcpy(glb + at, (uint32_t[]){36, 0x004e4942}, 8);
    memcpy(glb + at + 8, positions, 36);
    at += 8 + 36;
    memcpy(glb + at, (uint32_t[]){4, 0x12345678, 7}, 12); /* a chunk nobody knows */
    at += 12;
    memcpy(glb + 4, (uint32_t[]){2, at, n, 0x4e4f534a}, 16);
    struct imported r = import_bytes(glb, at);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
    imported_free(&r);
    for (uint32_t length = 0; length < at; length++) {
        r = import_bytes(glb, length);
        CHECK(!r.ok && pen_code_blame(r.error.code) == PEN_BLAME_CALLER);
        imported_free(&r);
    }
    memset(glb + 20 + sizeof json - 1, 0, n - (sizeof json - 1)); /* zeros for padding */
    r = import_bytes(glb, at);
    CHECK(r.ok);
    imported_free(&r);
}

static void data_uris(void)
{
    const struct {
        const char *uri, *mime, *payload;
        size_t bytes;
    } good[] = {{"data:;base64,", "", "", 0}, {"data:image/png;base64,TQ==", "image/png", "M", 1},
        {"data:a/b;charset=x;base64,TWE=", "a/b", "Ma", 2}, {"DATA:;BASE64,TWFu", "", "Man", 3},
        {"data:;base64,TWFuTQ", "", "ManM", 4}, {"data:;base64,-_8=", "", "\xfb\xff", 2},
        {"data:;base64,%2B%2f8%3D", "", "\xfb\xff", 2},
        {"data:;base64,TW\r\n\tFu TQ%0A=\n=\n", "", "ManM", 4},
        {"Data:image/PNG ; Base64 ,TQ==", "image/PNG", "M", 1},
        {"data:a/b,he%6clo%00%2", "a/b", "hello\0%2", 8}, {"data:,", "", "", 0},
        {" \ndata: image/png;base64,TQ==", "image/png", "M", 1},
        {"data:image%2Fpng%3Bbase64,TQ%3D%3D", "image/png", "M", 1}};
    const char *bad[] = {"data:;base64", "data:;base64,T",
        "data:;base64,T*==", "data:;base64,TQ==TQ==", "http://x/;base64,TQ==", ""};
    for (size_t i = 0; i < sizeof good / sizeof *good; i++) {
        char copy[64];
        const char *mime = NULL;
        struct imp_bytes payload = {0};
        strcpy(copy, good[i].uri);
        CHECK(imp_data_uri_decode(copy, &mime, &payload));
        CHECK(payload.bytes == good[i].bytes &&
              !memcmp(payload.data, good[i].payload, payload.bytes));
        CHECK_STR(mime ? mime : "?", good[i].mime);
    }
    for (size_t i = 0; i < sizeof bad / sizeof *bad; i++) {
        char copy[64];
        const char *mime;
        struct imp_bytes payload;
        strcpy(copy, bad[i]);
        CHECK(!imp_data_uri_decode(copy, &mime, &payload));
    }
}

/* PNG headers without pixels: the budget must refuse them before anything is decoded. */
static void pixel_budgets(void)
{
    uint8_t png[33 + 12 + 12] =
        "\x89PNG\r\n\x1a\n\0\0\0\rIHDR\0\1\0\0\0\1\0\0\1\0\0\0\0"
        "\x44\xff\x0d\x4e\0\0\0\0IDAT\x35\xaf\x06\x1e\0\0\0\0IEND\xae\x42\x60\x82";
    const uint8_t source[PEN_ID_BYTES] = {0};
    struct pen_error error = {0};
    void *blob;
    size_t bytes;
    /* 65536 x 65536: their product is 0 in 32 bits */
    CHECK(!pen_import(png, sizeof png, PEN_IMPORT_IMAGE, source, &blob, &bytes, &error));
    CHECK(error.code == PEN_TOO_BIG && strstr(error.message, "65536 x 65536"));
}

int main(void)
{
    depth();
    schema();
    extensions();
    required_materials();
    containers();
    data_uris();
    pixel_budgets();
    CHECK_DONE();
}
