/* Accessors: every component type, normalised, strided, sparse, compressed; against numbers worked
 * out from section 3.6.2 of the glTF 2.0 specification. */
#include "tests/unit/import_support.h"
#include <meshoptimizer.h>

#define HEAD                                                                                       \
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"                   \
    "\"nodes\":[{\"mesh\":0}],"

/* One triangle whose POSITION accessor has the given type; `stride` 0: none told. */
static struct imported one_triangle(
    const void *positions, size_t bytes, int component, bool normalized, int stride)
{
    char strides[40] = "";
    if (stride)
        snprintf(strides, sizeof strides, "\"byteStride\":%d,", stride);
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":%d,\"normalized\":%s,\"count\":3,"
        "\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,%s\"byteLength\":%zu}],"
        "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:application/octet-stream;base64,%s\"}]}",
        component, normalized ? "true" : "false", strides, bytes, bytes, base64(positions, bytes));
    struct imported r = import_json(json);
    free(json);
    return r;
}

static void component_types(void)
{
    struct {
        const void *data;
        size_t bytes;
        int component, stride;
        bool normalized;
        float a[3], b[3], c[3];
    } cases[] = {
        {(float[]){0, 0, 0, 1.5f, 0, 0, 0, -2.25f, 0}, 36, 5126, 0, false, {0, 0, 0}, {1.5f, 0, 0},
            {0, -2.25f, 0}},
        {(float[]){0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0, 9}, 48, 5126, 16, false, {0, 0, 0}, {1, 0, 0},
            {0, 1, 0}},
        {(int8_t[]){0, 0, 0, 0, 127, 0, 0, 0, 0, -128, 0, 0}, 12, 5120, 4, true, {0, 0, 0},
            {1, 0, 0}, {0, -1, 0}},
        {(int8_t[]){0, 0, 0, 0, 100, 0, 0, 0, 0, -128, 0, 0}, 12, 5120, 4, false, {0, 0, 0},
            {100, 0, 0}, {0, -128, 0}},
        {(uint8_t[]){0, 0, 0, 0, 51, 0, 0, 0, 0, 255, 0, 0}, 12, 5121, 4, true, {0, 0, 0},
            {0.2f, 0, 0}, {0, 1, 0}},
        {(int16_t[]){0, 0, 0, 0, 32767, 0, 0, 0, 0, -32767, 0, 0}, 24, 5122, 8, true, {0, 0, 0},
            {1, 0, 0}, {0, -1, 0}},
        {(uint16_t[]){0, 0, 0, 0, 13107, 0, 0, 0, 0, 65535, 0, 0}, 24, 5123, 8, true, {0, 0, 0},
            {0.2f, 0, 0}, {0, 1, 0}},
        {(uint16_t[]){0, 0, 0, 0, 40000, 0, 0, 0, 0, 7, 0, 0}, 24, 5123, 8, false, {0, 0, 0},
            {40000, 0, 0}, {0, 7, 0}},
        /* the last element may end where the view ends, before its stride does */
        {(float[]){0, 0, 0, 9, 1, 0, 0, 9, 0, 1, 0}, 44, 5126, 16, false, {0, 0, 0}, {1, 0, 0},
            {0, 1, 0}},
    };
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        struct imported r = one_triangle(cases[i].data, cases[i].bytes, cases[i].component,
            cases[i].normalized, cases[i].stride);
        if (!r.ok || !draws(&r.scene, cases[i].a, cases[i].b, cases[i].c)) {
            fprintf(stderr, "component type case %zu: %s\n", i, r.error.message);
            check_failures++;
        }
        imported_free(&r);
    }
    struct imported r = one_triangle((float[11]){0}, 43, 5126, false, 16);
    CHECK(!r.ok && r.error.code == PEN_INVALID);
    CHECK_STR(r.error.pointer, "/accessors/0");
    imported_free(&r);
}

/* Against the letter of the specification, but only to be read in one way. */
static void odd_strides(void)
{
    const struct {
        const void *data;
        size_t bytes;
        int component, stride;
        float b[3];
    } cases[] = {
        {(int16_t[]){0, 0, 0, 7, 0, 0, 0, 5, 0}, 18, 5122, 6, {7, 0, 0}},
        {(int8_t[]){0, 0, 0, 7, 0, 0, 0, 5, 0}, 9, 5120, 3, {7, 0, 0}},
    };
    for (size_t i = 0; i < 2; i++) {
        struct imported r =
            one_triangle(cases[i].data, cases[i].bytes, cases[i].component, false, cases[i].stride);
        CHECK(r.ok && draws(&r.scene, V(0, 0, 0), cases[i].b, V(0, 5, 0)));
        CHECK(r.ok && has_warning(&r.scene, "byteStride of bufferView 0"));
        imported_free(&r);
    }
    float far_apart[2 * 75 + 3] = {0};
    far_apart[75] = 7, far_apart[151] = 5; /* 300 bytes: more than 252 */
    struct imported r = one_triangle(far_apart, sizeof far_apart, 5126, false, 300);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(7, 0, 0), V(0, 5, 0)));
    CHECK(r.ok && has_warning(&r.scene, "byteStride"));
    imported_free(&r);
    r = one_triangle(far_apart, 36, 5126, false, 8); /* elements would overlap */
    CHECK(!r.ok && strstr(r.error.message, "12 bytes, but byteStride is 8"));
    imported_free(&r);
}

/* Views and accessors that hold nothing, beside good ones. */
static void nothing(void)
{
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}},"
        "{\"attributes\":{\"POSITION\":1}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5126,\"count\":0,\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},{\"buffer\":0,\"byteOffset\":36,"
        "\"byteLength\":0},{\"buffer\":1,\"byteLength\":0}],"
        "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:;base64,%s\"},{\"byteLength\":0}]}",
        base64((float[9]){0, 0, 0, 1, 0, 0, 0, 1, 0}, 36));
    struct imported r = import_json(json);
    CHECK(r.ok && r.scene.primitive_count == 1 &&
          draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
    CHECK(r.ok && has_warning(&r.scene, "BufferView 1 is empty"));
    imported_free(&r);
    free(json);
    json = text(HEAD "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
                     "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,"
                     "\"type\":\"VEC3\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":0}],"
                     "\"buffers\":[{\"byteLength\":0}]}");
    r = import_json(json);
    CHECK(!r.ok && strstr(r.error.message, "beyond its bufferView"));
    imported_free(&r);
    free(json);
}

static void index_types(void)
{
    const float square[12] = {0, 0, 0, 1, 0, 0, 1, 1, 0, 0, 1, 0};
    const uint8_t i8[] = {0, 1, 2, 0, 2, 3};
    const uint16_t i16[] = {0, 1, 2, 0, 2, 3};
    const uint32_t i32[] = {0, 1, 2, 0, 2, 3};
    struct {
        const void *data;
        size_t bytes;
        int component;
    } cases[] = {{i8, 6, 5121}, {i16, 12, 5123}, {i32, 24, 5125}};
    for (size_t i = 0; i < 3; i++) {
        uint8_t buffer[48 + 24];
        memcpy(buffer, square, 48);
        memcpy(buffer + 48, cases[i].data, cases[i].bytes);
        char *json = text(HEAD
            "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
            "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}"
            ","
            "{\"bufferView\":1,\"componentType\":%d,\"count\":6,\"type\":\"SCALAR\"}],"
            "\"bufferViews\":[{\"buffer\":0,\"byteLength\":48},"
            "{\"buffer\":0,\"byteOffset\":48,\"byteLength\":%zu}],"
            "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:;base64,%s\"}]}",
            cases[i].component, cases[i].bytes, 48 + cases[i].bytes,
            base64(buffer, 48 + cases[i].bytes));
        struct imported r = import_json(json);
        free(json);
        CHECK(r.ok && r.scene.header->triangles == 2);
        CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(1, 1, 0)) &&
              draws(&r.scene, V(0, 0, 0), V(1, 1, 0), V(0, 1, 0)));
        CHECK(r.ok && !draws(&r.scene, V(0, 0, 0), V(1, 1, 0), V(1, 0, 0)));
        imported_free(&r);
    }
}

/* Sparse: replaces vertices 1 and 2 of three; once over a view, once over zeros. */
static void sparse(void)
{
    struct {
        float base[9];
        uint16_t indices[2];
        float values[6];
    } buffer = {{5, 5, 5, 6, 6, 6, 7, 7, 7}, {1, 2}, {1, 0, 0, 0, 1, 0}};
    for (int with_base = 0; with_base < 2; with_base++) {
        char *json = text(HEAD
            "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
            "\"accessors\":[{%s\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
            "\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":1,\"componentType\":5123},"
            "\"values\":{\"bufferView\":2}}}],"
            "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
            "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":4},"
            "{\"buffer\":0,\"byteOffset\":40,\"byteLength\":24}],"
            "\"buffers\":[{\"byteLength\":64,\"uri\":\"data:;base64,%s\"}]}",
            with_base ? "\"bufferView\":0," : "", base64(&buffer, sizeof buffer));
        struct imported r = import_json(json);
        CHECK(r.ok && draws(&r.scene, with_base ? V(5, 5, 5) : V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
        imported_free(&r);
        free(json);
    }
    const uint16_t wrong[3][2] = {{2, 1}, {1, 1}, {1, 3}}; /* must increase and exist */
    for (int i = 0; i < 3; i++) {
        memcpy(buffer.indices, wrong[i], sizeof wrong[i]);
        char *json =
            text(HEAD "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
                      "\"accessors\":[{\"componentType\":5126,\"count\":3,\"type\":\"VEC3\","
                      "\"sparse\":{\"count\":2,\"indices\":{\"bufferView\":0,\"byteOffset\":36,"
                      "\"componentType\":5123},\"values\":{\"bufferView\":0,\"byteOffset\":40}}}],"
                      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":64}],"
                      "\"buffers\":[{\"byteLength\":64,\"uri\":\"data:;base64,%s\"}]}",
                base64(&buffer, sizeof buffer));
        struct imported r = import_json(json);
        CHECK(!r.ok && r.error.code == PEN_INVALID);
        imported_free(&r);
        free(json);
    }
}

/* EXT_meshopt_compression with each mode and filter, packed by the library's encoders. */
static void meshopt(void)
{
    const float positions[4][3] = {{0, 0, 0}, {2, 0, 0}, {2, 2, 0}, {0, 2, 0}};
    const float normals[4][4] = {{0, 0, 1, 0}, {0.6f, 0, 0.8f, 0}, {0, 1, 0, 0}, {0, 0, -1, 0}};
    const unsigned indices[6] = {0, 1, 2, 0, 2, 3};
    uint8_t buffer[4096];
    size_t at[5] = {0};
    /* 32 bit of the exponential filter: exponent << 24 | mantissa, so 2 = 1 * 2^1. */
    enum { TWO = 1 << 24 | 1 };
    const uint32_t exponential[4][3] = {{0, 0, 0}, {TWO, 0, 0}, {TWO, TWO, 0}, {0, TWO, 0}};
    int8_t octahedral[4][4];
    meshopt_encodeFilterOct(octahedral, 4, 4, 8, normals[0]);
    at[1] = meshopt_encodeVertexBuffer(buffer, sizeof buffer, exponential, 4, 12);
    at[2] =
        at[1] + meshopt_encodeVertexBuffer(buffer + at[1], sizeof buffer - at[1], octahedral, 4, 4);
    at[3] = at[2] + meshopt_encodeIndexBuffer(buffer + at[2], sizeof buffer - at[2], indices, 6);
    at[4] = at[3] + meshopt_encodeIndexSequence(buffer + at[3], sizeof buffer - at[3], indices, 6);
    for (int round = 0; round < 4; round++) { /* both modes of indices, under both names */
        int sequence = round % 2;
        char *json = text(HEAD
            "\"extensionsRequired\":[\"EXT_meshopt_compression\",\"KHR_mesh_quantization\"],"
            "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1},"
            "\"indices\":2}]}],"
            "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"}"
            ","
            "{\"bufferView\":1,\"componentType\":5120,\"normalized\":true,\"count\":4,"
            "\"type\":\"VEC3\"},"
            "{\"bufferView\":2,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"}],"
            "\"bufferViews\":[{\"buffer\":1,\"byteLength\":48,\"byteStride\":12,\"extensions\":{"
            "\"EXT_meshopt_compression\":{\"buffer\":0,\"byteLength\":%zu,\"byteStride\":12,"
            "\"count\":4,\"mode\":\"ATTRIBUTES\",\"filter\":\"EXPONENTIAL\"}}},"
            "{\"buffer\":1,\"byteOffset\":48,\"byteLength\":16,\"byteStride\":4,\"extensions\":{"
            "\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,"
            "\"byteStride\":4,\"count\":4,\"mode\":\"ATTRIBUTES\",\"filter\":\"OCTAHEDRAL\"}}},"
            "{\"buffer\":1,\"byteOffset\":64,\"byteLength\":12,\"extensions\":{"
            "\"EXT_meshopt_compression\":{\"buffer\":0,\"byteOffset\":%zu,\"byteLength\":%zu,"
            "\"byteStride\":2,\"count\":6,\"mode\":\"%s\"}}}],"
            "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:;base64,%s\"},"
            "{\"byteLength\":76,\"extensions\":{\"EXT_meshopt_compression\":{\"fallback\":true}}}]"
            "}",
            at[1], at[1], at[2] - at[1], at[2 + sequence], at[3 + sequence] - at[2 + sequence],
            sequence ? "INDICES" : "TRIANGLES", at[4], base64(buffer, at[4]));
        for (char *name = json; round >= 2 && (name = strstr(name, "EXT_meshopt"));)
            name[0] = 'K', name[1] = 'H', name[2] = 'R';
        struct imported r = import_json(json);
        free(json);
        CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(2, 0, 0), V(2, 2, 0)) &&
              draws(&r.scene, V(0, 0, 0), V(2, 2, 0), V(0, 2, 0)));
        for (int i = 0; r.ok && i < 4; i++) {
            uint32_t v = vertex_at(&r.scene, positions[i][0], positions[i][1], positions[i][2]);
            CHECK(v != UINT32_MAX);
            for (int k = 0; v != UINT32_MAX && k < 3; k++) /* 8-bit octahedral: about 1/100 */
                CHECK_NEAR(r.scene.attributes[v].normal[k] / 32767.0, normals[i][k], 0.02);
        }
        if (!r.ok)
            fprintf(stderr, "%s\n", r.error.message);
        imported_free(&r);
    }
}

int main(void)
{
    component_types();
    odd_strides();
    nothing();
    index_types();
    sparse();
    meshopt();
    CHECK_DONE();
}
