/* KHR_draco_mesh_compression: a tetrahedron that draco_encoder (Debian's package draco, 1.5.5) packed
 * with each of its two methods: -cl 0 and -cl 7, 11 bits for positions, 10 for coordinates. Its
 * corners are the origin and a metre along each axis, with (0,0), (1,0), (0,1), (1,1) on them. */
#include "tests/unit/import_support.h"

static const uint8_t sequential[] = {0x44, 0x52, 0x41, 0x43, 0x4f, 0x02, 0x02, 0x01, 0x00, 0x00,
    0x00, 0x04, 0x04, 0x01, 0x00, 0x01, 0x02, 0x00, 0x02, 0x03, 0x00, 0x03, 0x01, 0x02, 0x01, 0x03,
    0x01, 0x02, 0x00, 0x09, 0x03, 0x00, 0x00, 0x03, 0x09, 0x02, 0x00, 0x01, 0x02, 0x02, 0x00, 0x01,
    0x01, 0x00, 0x03, 0x03, 0x01, 0x20, 0x01, 0x20, 0x03, 0x00, 0x20, 0x84, 0x50, 0x22, 0x01, 0x00,
    0x00, 0x00, 0x00, 0xff, 0x07, 0x00, 0x00, 0x00, 0x01, 0x01, 0x00, 0x03, 0x03, 0x01, 0x30, 0x01,
    0x10, 0x03, 0x00, 0x28, 0x82, 0x98, 0x02, 0x00, 0x00, 0x00, 0x00, 0xff, 0x03, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x0b,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x0a};
static const uint8_t edgebreaker[] = {0x44, 0x52, 0x41, 0x43, 0x4f, 0x02, 0x02, 0x01, 0x01, 0x00,
    0x00, 0x00, 0x04, 0x04, 0x01, 0x03, 0x00, 0x00, 0x01, 0x2f, 0x01, 0x01, 0x10, 0xff, 0x02, 0x66,
    0x40, 0x02, 0xff, 0x00, 0x00, 0x00, 0x00, 0x00, 0x01, 0x00, 0x09, 0x03, 0x00, 0x00, 0x02, 0x01,
    0x03, 0x09, 0x02, 0x00, 0x01, 0x02, 0x01, 0x01, 0x01, 0x00, 0x03, 0x03, 0x01, 0x10, 0x01, 0x30,
    0x03, 0x00, 0x50, 0x82, 0x24, 0x91, 0x04, 0x00, 0x00, 0x00, 0x00, 0xff, 0x07, 0x00, 0x00, 0x00,
    0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80, 0x3f, 0x0b,
    0x05, 0x01, 0x01, 0x00, 0x0b, 0x03, 0x01, 0x20, 0x01, 0x10, 0x1b, 0x01, 0x10, 0x03, 0x00, 0x30,
    0x90, 0x4b, 0xff, 0xfd, 0x03, 0x02, 0x00, 0x00, 0x00, 0x80, 0x02, 0x00, 0x71, 0x00, 0x00, 0x00,
    0x00, 0xff, 0x03, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x80,
    0x3f, 0x0a};

/* The draco attributes and mode of the primitive, and what accessor 1 is. */
static struct imported tetrahedron(
    const void *data, size_t bytes, const char *attributes, const char *more, const char *uv)
{
    char *json =
        text("{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
             "\"extensionsUsed\":[\"KHR_draco_mesh_compression\"],"
             "\"extensionsRequired\":[\"KHR_draco_mesh_compression\"],\"nodes\":[{\"mesh\":0}],"
             "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"TEXCOORD_0\":1},"
             "\"indices\":2,\"extensions\":{\"KHR_draco_mesh_compression\":{\"bufferView\":0,"
             "\"attributes\":{%s}}}%s}]}],"
             "\"accessors\":[{\"componentType\":5126,\"count\":4,\"type\":\"VEC3\"},"
             "{\"componentType\":5126,\"count\":4,\"type\":\"%s\"},"
             "{\"componentType\":5123,\"count\":12,\"type\":\"SCALAR\"}],"
             "\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu}],"
             "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:;base64,%s\"}]}",
            attributes, more, uv, bytes, bytes, base64(data, bytes));
    struct imported r = import_json(json);
    free(json);
    return r;
}

#define BOTH "\"POSITION\":0,\"TEXCOORD_0\":1"

static void check_whole(const struct imported *r)
{
    CHECK(r->ok && r->scene.header->triangles == 4 && !r->scene.warning_bytes);
    if (!r->ok) {
        fprintf(stderr, "%s\n", r->error.message);
        return;
    }
    const float *o = V(0, 0, 0), *x = V(1, 0, 0), *y = V(0, 1, 0), *z = V(0, 0, 1);
    CHECK(draws(&r->scene, o, y, x) && draws(&r->scene, o, x, z));
    CHECK(draws(&r->scene, o, z, y) && draws(&r->scene, x, y, z));
    CHECK_NEAR(r->scene.attributes[vertex_at(&r->scene, 1, 0, 0)].uv[0][0], 1, 1e-3);
    CHECK_NEAR(r->scene.attributes[vertex_at(&r->scene, 0, 1, 0)].uv[0][0], 0, 1e-3);
    CHECK_NEAR(r->scene.attributes[vertex_at(&r->scene, 0, 0, 1)].uv[0][0], 1, 1e-3);
}

static void methods(const uint8_t *data, size_t bytes)
{
    struct imported r = tetrahedron(data, bytes, BOTH, "", "VEC2");
    check_whole(&r);
    imported_free(&r);
    r = tetrahedron(
        data, bytes, BOTH, ",\"mode\":5", "VEC2"); /* triangles come out of strips, too */
    check_whole(&r);
    imported_free(&r);
    for (size_t n = 0; n < bytes; n++) {
        r = tetrahedron(data, n, BOTH, "", "VEC2");
        CHECK(!r.ok && r.error.code == PEN_INVALID);
        imported_free(&r);
    }
    uint8_t copy[256];
    for (size_t i = 0; i < bytes; i++) { /* damaged: refused or drawn, nothing else */
        memcpy(copy, data, bytes);
        copy[i] ^= (uint8_t)(1 << i % 8);
        r = tetrahedron(copy, bytes, BOTH, "", "VEC2");
        CHECK(r.ok || pen_code_blame(r.error.code) == PEN_BLAME_CALLER);
        imported_free(&r);
    }
}

static void refused(const char *attributes, const char *more, const char *uv, const char *pointer)
{
    struct imported r = tetrahedron(sequential, sizeof sequential, attributes, more, uv);
    CHECK(!r.ok && r.error.code == PEN_INVALID);
    CHECK_STR(r.error.pointer, pointer);
    imported_free(&r);
}

int main(void)
{
    methods(sequential, sizeof sequential);
    methods(edgebreaker, sizeof edgebreaker);
    refused("\"POSITION\":7", "", "VEC2", "/meshes/0/primitives/0");
    refused(BOTH, "", "VEC4", "/meshes/0/primitives/0");
    refused(BOTH, "", "MAT4", "/meshes/0/primitives/0");
    refused("\"POSITION\":-1", "", "VEC2",
        "/meshes/0/primitives/0/extensions/KHR_draco_mesh_compression/attributes/POSITION");
    /* What is not compressed comes from its own accessor: here, zeros. */
    struct imported r = tetrahedron(sequential, sizeof sequential, "\"POSITION\":0", "", "VEC2");
    CHECK(r.ok && r.scene.header->triangles == 4);
    CHECK(r.ok && r.scene.attributes[vertex_at(&r.scene, 1, 0, 0)].uv[0][0] == 0);
    imported_free(&r);
    CHECK_DONE();
}
