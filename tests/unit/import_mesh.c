/* Primitive modes, winding, attributes, shared vertex buffers, welding and meshlets. */
#include "tests/unit/import_support.h"

#define HEAD                                                                                       \
    "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"                   \
    "\"nodes\":[{\"mesh\":0}],"

/* Five points p0 .. p4 of a zigzag, drawn unindexed in one mode. */
static struct imported zigzag(int mode)
{
    const float p[5][3] = {{0, 0, 0}, {0, 1, 0}, {1, 0, 0}, {1, 1, 0}, {2, 0, 0}};
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"mode\":%d,\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":5,\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":60}],"
        "\"buffers\":[{\"byteLength\":60,\"uri\":\"data:;base64,%s\"}]}",
        mode, base64(p, sizeof p));
    struct imported r = import_json(json);
    free(json);
    return r;
}

static void modes(void)
{
    struct imported r = zigzag(4); /* the two points left over make no triangle */
    CHECK(r.ok && r.scene.header->triangles == 1);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(0, 1, 0), V(1, 0, 0)));
    imported_free(&r);

    r = zigzag(5); /* every other triangle turned, so that all face the same way */
    CHECK(r.ok && r.scene.header->triangles == 3);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(0, 1, 0), V(1, 0, 0)));
    CHECK(r.ok && draws(&r.scene, V(0, 1, 0), V(1, 1, 0), V(1, 0, 0)));
    CHECK(r.ok && draws(&r.scene, V(1, 0, 0), V(1, 1, 0), V(2, 0, 0)));
    for (uint32_t v = 0; r.ok && v < r.scene.vertex_count; v++) /* flat normals: all the same */
        CHECK(r.scene.attributes[v].normal[2] == -32767);
    imported_free(&r);

    r = zigzag(6);
    CHECK(r.ok && r.scene.header->triangles == 3);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(0, 1, 0), V(1, 0, 0)));
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(1, 1, 0)));
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 1, 0), V(2, 0, 0)));
    imported_free(&r);
}

/* Twice the area of the triangle that starts at `index`, as a vector along its front. */
static void front(const struct psc_scene *scene, uint32_t index, float normal[3])
{
    const float *p[3];
    for (int i = 0; i < 3; i++)
        p[i] = scene->positions[scene->indices[index + i]];
    for (int k = 0; k < 3; k++) {
        int a = (k + 1) % 3, b = (k + 2) % 3;
        normal[k] =
            (p[1][a] - p[0][a]) * (p[2][b] - p[0][b]) - (p[1][b] - p[0][b]) * (p[2][a] - p[0][a]);
    }
}

/* Points and lines are solids: 8 triangles for each point used and for each line, all facing
 * outwards; what is told of the scene's size has no thickness. */
static void marks(void)
{
    const uint32_t lines[4] = {0, 2, 5, 4}; /* of five points, in modes 0 to 3 */
    for (int mode = 0; mode < 4; mode++) {
        struct imported r = zigzag(mode);
        uint32_t points = mode == 1 ? 4 : 5; /* the last of five begins no pair */
        CHECK(r.ok && has_warning(&r.scene, "thin solids"));
        CHECK(r.ok && r.scene.header->triangles == 8 * (points + lines[mode]));
        if (!r.ok)
            continue;
        for (uint32_t i = 0; i < r.scene.index_count; i += 3) {
            float n[3], dot = 0;
            front(&r.scene, i, n);
            for (int k = 0; k < 3; k++)
                for (int corner = 0; corner < 3; corner++)
                    dot += n[k] * r.scene.attributes[r.scene.indices[i + corner]].normal[k];
            CHECK(dot > 0);
        }
        const struct psc_header *h = r.scene.header;
        const float most[3] = {mode == 1 ? 1 : 2, 1, 0};
        float thickness = h->bounds_max[2];
        CHECK(thickness > 0.002f && thickness < 0.03f);
        for (int k = 0; k < 3; k++) {
            CHECK_NEAR(h->extent_min[k], 0, 0);
            CHECK_NEAR(h->extent_max[k], most[k], 0);
            CHECK(h->bounds_min[k] <= -0.9f * thickness &&
                  h->bounds_max[k] >= most[k] + 0.9f * thickness);
        }
        imported_free(&r);
    }
}

/* The octahedra of points are closed: by the divergence theorem each encloses 4/3 r^3. Colours go
 * with them, and a node that turns and scales moves the extent as it moves the points. */
static void point_solids(void)
{
    const float p[3][3] = {{0, 0, 0}, {3, 0, 0}, {0, 4, 0}}; /* the diagonal is 5 */
    const uint8_t colors[12] = {255, 0, 0, 255, 0, 255, 0, 255, 0, 0, 255, 255};
    uint8_t data[48];
    memcpy(data, p, 36);
    memcpy(data + 36, colors, 12);
    char *json = text(
        "{\"asset\":{\"version\":\"2.0\"},\"scene\":0,\"scenes\":[{\"nodes\":[0]}],"
        "\"nodes\":[{\"mesh\":0,\"rotation\":[0,0,0.3826834324,0.9238795325],\"scale\":[2,2,2]}],"
        "\"meshes\":[{\"primitives\":[{\"mode\":0,\"attributes\":{\"POSITION\":0,\"COLOR_0\":1}}]}]"
        ","
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5121,\"normalized\":true,\"count\":3,"
        "\"type\":\"VEC4\"}],\"bufferViews\":[{\"buffer\":0,\"byteLength\":36},"
        "{\"buffer\":0,\"byteOffset\":36,\"byteLength\":12}],"
        "\"buffers\":[{\"byteLength\":48,\"uri\":\"data:;base64,%s\"}]}",
        base64(data, sizeof data));
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok && r.scene.vertex_count == 18);
    if (!r.ok)
        return;
    double volume = 0, radius = 0.01 * 5; /* three points far apart: the largest */
    for (uint32_t i = 0; i < r.scene.index_count; i += 3) {
        float n[3];
        front(&r.scene, i, n);
        for (int k = 0; k < 3; k++)
            volume += n[k] * r.scene.positions[r.scene.indices[i]][k] / 6;
    }
    CHECK_NEAR(volume, 3 * 4 / 3.0 * radius * radius * radius, 1e-5);
    for (int i = 0; i < 3; i++) {
        uint32_t v = vertex_at(&r.scene, p[i][0], p[i][1], (float)radius);
        CHECK(v != UINT32_MAX && !memcmp(r.scene.attributes[v].color, colors + 4 * i, 4));
    }
    /* An eighth of a turn, twice as large: (3,0) to (6,6)/sqrt 2, (0,4) to (-8,8)/sqrt 2. */
    const struct psc_header *h = r.scene.header;
    CHECK_NEAR(h->extent_min[0], -8 / sqrt(2), 1e-5);
    CHECK_NEAR(h->extent_max[0], 6 / sqrt(2), 1e-5);
    CHECK_NEAR(h->extent_max[1], 8 / sqrt(2), 1e-5);
    CHECK_NEAR(h->extent_max[2], 0, 1e-7);
    CHECK_NEAR(h->bounds_max[2], 2 * radius, 1e-6);
    imported_free(&r);
}

/* Zeros, so many that not all are drawn: by the budget 4 vertices for each point, or 8 for each line. */
static struct imported crowd(int mode, uint32_t count)
{
    struct {
        uint32_t at[2];
        float to[6];
    } ends = {{0, count - 1}, {0, 0, 0, 3, 4, 0}};
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"mode\":%d,\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"componentType\":5126,\"count\":%u,\"type\":\"VEC3\",\"sparse\":{"
        "\"count\":2,\"indices\":{\"bufferView\":0,\"componentType\":5125},"
        "\"values\":{\"bufferView\":1}}}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":8},"
        "{\"buffer\":0,\"byteOffset\":8,\"byteLength\":24}],"
        "\"buffers\":[{\"byteLength\":32,\"uri\":\"data:;base64,%s\"}]}",
        mode, count, base64(&ends, sizeof ends));
    struct imported r = import_json(json);
    free(json);
    return r;
}

static void too_many(void)
{
    struct imported r = crowd(0, 1200000); /* 7.2 million vertices of octahedra: too many */
    CHECK(r.ok && has_warning(&r.scene, "thin solids") && !has_warning(&r.scene, "too many"));
    CHECK(r.ok && r.scene.header->triangles == 4 * 1200000);
    double volume = 0, radius = 0.001 * 5; /* so many on so little: the least */
    for (uint32_t i = 0; r.ok && i < r.scene.index_count; i += 3) {
        float n[3];
        front(&r.scene, i, n);
        for (int k = 0; k < 3; k++)
            volume += n[k] * r.scene.positions[r.scene.indices[i]][k] / 6;
    }
    CHECK_NEAR(volume, 1200000 * 8 / (9 * sqrt(3)) * pow(radius, 3), 1e-3 * volume);
    imported_free(&r);
    r = crowd(0, 4000000); /* 16 million of tetrahedra: every third point */
    CHECK(r.ok && has_warning(&r.scene, "Of 4000000 points and ends of lines one in 3 is drawn"));
    CHECK(r.ok && r.scene.header->triangles == 4 * 1333334u);
    imported_free(&r);
    r = crowd(3, 1000001); /* a strip of lines of no length, but for the last */
    CHECK(r.ok && has_warning(&r.scene, "one in 2 is drawn"));
    CHECK(r.ok && r.scene.header->triangles == 8);
    CHECK(r.ok && r.scene.header->extent_max[1] == 4);
    imported_free(&r);
    r = crowd(0, 96000001); /* of which not even the count is believed */
    CHECK(r.error.code == PEN_TOO_BIG);
    imported_free(&r);
}

/* Attributes that do not suit their primitive are left out; the shape does not need them. */
static void unsuitable(void)
{
    const struct {
        const char *name, *type;
        int count;
    } cases[] = {{"NORMAL", "VEC4", 3}, {"NORMAL", "VEC3", 2}, {"TEXCOORD_0", "VEC3", 3},
        {"TEXCOORD_1", "VEC2", 0}, {"COLOR_0", "SCALAR", 3}, {"COLOR_0", "VEC4", 1}};
    for (size_t i = 0; i < sizeof cases / sizeof *cases; i++) {
        char *json =
            text(HEAD "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"%s\":1}}]}],"
                      "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":3,"
                      "\"type\":\"VEC3\"},{\"componentType\":5126,\"count\":%d,\"type\":\"%s\"}],"
                      "\"bufferViews\":[{\"buffer\":0,\"byteLength\":36}],"
                      "\"buffers\":[{\"byteLength\":36,\"uri\":\"data:;base64,%s\"}]}",
                cases[i].name, cases[i].count, cases[i].type,
                base64((const float[9]){[3] = 1, [7] = 1}, 36));
        struct imported r = import_json(json);
        free(json);
        CHECK(r.ok && has_warning(&r.scene, "An attribute is left out. glTF /accessors/1"));
        CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(1, 0, 0), V(0, 1, 0)));
        CHECK(r.ok && r.scene.attributes[0].normal[2] == 32767); /* of the triangle */
        CHECK(r.ok && r.scene.attributes[0].color[0] == 255);
        imported_free(&r);
    }
}

/* One vertex of a triangle with every attribute; colours as vec3 of bytes, uv
 * as normalised shorts. */
static void attributes(void)
{
    struct {
        float positions[9], normals[9], tangents[12];
        uint16_t uv0[6];
        float uv1[6];
        uint8_t colors[12];
    } buffer = {.positions = {0, 0, 0, 1, 0, 0, 0, 1, 0},
        .normals = {0, 0, 1, 0, 0, 2, 0, 0, 0.5f},
        .tangents = {1, 0, 0, -1, 1, 0, 0, -1, 1, 0, 0, -1},
        .uv0 = {0, 0, 65535, 13107, 0, 65535},
        .uv1 = {3, -4, 5, 6, 7, 8},
        .colors = {255, 0, 51, 0, 0, 255, 0, 0, 1, 2, 3, 0}};
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0,\"NORMAL\":1,\"TANGENT\":2,"
        "\"TEXCOORD_0\":3,\"TEXCOORD_1\":4,\"COLOR_0\":5,\"JOINTS_0\":5}}]}],"
        "\"accessors\":["
        "{\"bufferView\":0,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":36,\"componentType\":5126,\"count\":3,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":72,\"componentType\":5126,\"count\":3,\"type\":\"VEC4\"},"
        "{\"bufferView\":0,\"byteOffset\":120,\"componentType\":5123,\"normalized\":true,"
        "\"count\":3,\"type\":\"VEC2\"},"
        "{\"bufferView\":0,\"byteOffset\":132,\"componentType\":5126,\"count\":3,\"type\":\"VEC2\"}"
        ","
        "{\"bufferView\":1,\"componentType\":5121,\"normalized\":true,\"count\":3,"
        "\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":156},"
        "{\"buffer\":0,\"byteOffset\":156,\"byteLength\":12,\"byteStride\":4}],"
        "\"buffers\":[{\"byteLength\":168,\"uri\":\"data:;base64,%s\"}]}",
        base64(&buffer, sizeof buffer));
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok);
    if (r.ok) {
        uint32_t a = vertex_at(&r.scene, 0, 0, 0), b = vertex_at(&r.scene, 1, 0, 0);
        const struct psc_attributes *at_a = &r.scene.attributes[a], *at_b = &r.scene.attributes[b];
        CHECK(at_a->normal[2] == 32767 && at_b->normal[2] == 32767);
        CHECK(at_a->tangent[0] == 32767 && at_a->tangent[3] == -32767);
        CHECK_NEAR(at_b->uv[0][0], 1, 1e-6);
        CHECK_NEAR(at_b->uv[0][1], 0.2, 1e-6);
        CHECK_NEAR(at_a->uv[1][0], 3, 0);
        CHECK_NEAR(at_a->uv[1][1], -4, 0);
        CHECK(at_a->color[0] == 255 && at_a->color[1] == 0 && at_a->color[2] == 51 &&
              at_a->color[3] == 255);
        CHECK(at_b->color[1] == 255 && at_b->color[0] == 0);
    }
    imported_free(&r);
}

/* Two primitives share a vertex buffer, each using its own half: each keeps only what it uses, and
 * three equal vertices become one. */
static void sharing_and_welding(void)
{
    struct {
        float p[8][3];
        uint16_t i[2][6];
    } buffer = {
        {{0, 0, 0}, {1, 0, 0}, {0, 1, 0}, {0, 0, 0}, {5, 0, 0}, {6, 0, 0}, {5, 1, 0}, {6, 1, 0}},
        {{0, 1, 2, 3, 2, 1}, {4, 5, 6, 6, 5, 7}}};
    const float normals[8][3] = {
        {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}, {0, 0, 1}};
    char bytes[sizeof buffer + sizeof normals];
    memcpy(bytes, &buffer, sizeof buffer);
    memcpy(bytes + sizeof buffer, normals, sizeof normals);
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":["
        "{\"attributes\":{\"POSITION\":0,\"NORMAL\":3},\"indices\":1},"
        "{\"attributes\":{\"POSITION\":0,\"NORMAL\":3},\"indices\":2}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"},"
        "{\"bufferView\":1,\"componentType\":5123,\"count\":6,\"type\":\"SCALAR\"},"
        "{\"bufferView\":1,\"byteOffset\":12,\"componentType\":5123,\"count\":6,"
        "\"type\":\"SCALAR\"},"
        "{\"bufferView\":2,\"componentType\":5126,\"count\":8,\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":96},"
        "{\"buffer\":0,\"byteOffset\":96,\"byteLength\":24},"
        "{\"buffer\":0,\"byteOffset\":120,\"byteLength\":96}],"
        "\"buffers\":[{\"byteLength\":216,\"uri\":\"data:;base64,%s\"}]}",
        base64(bytes, sizeof bytes));
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok && r.scene.primitive_count == 2);
    CHECK(r.ok && r.scene.primitives[0].vertex_count == 3); /* vertex 3 was vertex 0 */
    CHECK(r.ok && r.scene.primitives[1].vertex_count == 4);
    CHECK(r.ok && draws(&r.scene, V(0, 0, 0), V(0, 1, 0), V(1, 0, 0)));
    CHECK(r.ok && draws(&r.scene, V(5, 1, 0), V(6, 0, 0), V(6, 1, 0)));
    imported_free(&r);
}

#define SIDE 40 /* quads along a side of the sheet: 3200 triangles */

static void meshlets(void)
{
    static struct {
        float p[SIDE + 1][SIDE + 1][3];
        uint16_t i[SIDE][SIDE][6];
    } sheet;
    for (int y = 0; y <= SIDE; y++)
        for (int x = 0; x <= SIDE; x++) {
            const float p[3] = {(float)x, (float)y, (float)((x * 7 + y * 3) % 5)};
            memcpy(sheet.p[y][x], p, sizeof p);
        }
    for (int y = 0; y < SIDE; y++)
        for (int x = 0; x < SIDE; x++) {
            uint16_t a = (uint16_t)(y * (SIDE + 1) + x), b = (uint16_t)(a + SIDE + 1);
            const uint16_t i[6] = {
                a, (uint16_t)(a + 1), b, b, (uint16_t)(a + 1), (uint16_t)(b + 1)};
            memcpy(sheet.i[y][x], i, sizeof i);
        }
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0},\"indices\":1}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":%zu,\"type\":\"VEC3\"},"
        "{\"bufferView\":0,\"byteOffset\":%zu,\"componentType\":5123,\"count\":%zu,"
        "\"type\":\"SCALAR\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":%zu}],"
        "\"buffers\":[{\"byteLength\":%zu,\"uri\":\"data:;base64,%s\"}]}",
        sizeof sheet.p / 12, sizeof sheet.p, sizeof sheet.i / 2, sizeof sheet, sizeof sheet,
        base64(&sheet, sizeof sheet));
    struct imported r = import_json(json);
    free(json);
    CHECK(r.ok && r.scene.header->triangles == 2 * SIDE * SIDE);
    if (!r.ok)
        return;
    uint32_t covered = 0;
    for (uint32_t i = 0; i < r.scene.meshlet_count; i++) {
        const struct psc_meshlet *m = &r.scene.meshlets[i];
        CHECK(m->first_index == covered && m->index_count <= 3 * 124);
        CHECK(m->radius < 16); /* compact: the sheet itself has radius 28 */
        covered += m->index_count;
    }
    CHECK(covered == 6 * SIDE * SIDE);
    CHECK(r.scene.meshlet_count <= 2 * SIDE * SIDE / 80);
    int missing = 0; /* every triangle of the sheet is still there */
    for (int y = 0; y < SIDE; y += 3)
        for (int x = 0; x < SIDE; x += 3) {
            missing += !draws(&r.scene, sheet.p[y][x], sheet.p[y][x + 1], sheet.p[y + 1][x]);
            missing +=
                !draws(&r.scene, sheet.p[y + 1][x], sheet.p[y][x + 1], sheet.p[y + 1][x + 1]);
        }
    CHECK(missing == 0);
    imported_free(&r);
}

/* Coordinates whose areas overflow single precision: the meshlet builder gives up, we must not. */
static void huge(void)
{
    const float p[6][3] = {{1e12f, 0, 0}, {0, 1e12f, 0}, {0, 0, 1e12f}, {-1e12f, 0, 0},
        {0, -1e12f, 0}, {0, 0, -1e12f}};
    char *json = text(HEAD
        "\"meshes\":[{\"primitives\":[{\"attributes\":{\"POSITION\":0}}]}],"
        "\"accessors\":[{\"bufferView\":0,\"componentType\":5126,\"count\":6,\"type\":\"VEC3\"}],"
        "\"bufferViews\":[{\"buffer\":0,\"byteLength\":72}],"
        "\"buffers\":[{\"byteLength\":72,\"uri\":\"data:;base64,%s\"}]}",
        base64(p, sizeof p));
    struct imported r = import_json(json);
    CHECK(r.ok && r.scene.header->triangles == 2 && draws(&r.scene, p[0], p[1], p[2]));
    imported_free(&r);
    free(json);
}

int main(void)
{
    modes();
    marks();
    point_solids();
    too_many();
    unsuitable();
    attributes();
    sharing_and_welding();
    meshlets();
    huge();
    CHECK_DONE();
}
