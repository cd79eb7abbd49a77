/* What goes into the builder comes out of psc_open; limits are refused; mip chains are right. */
#include "tests/unit/blob_shapes.h"
#include <sys/mman.h>
#include <unistd.h>

static void round_trip(void)
{
    struct psc_builder *b = psc_builder_create();
    struct pen_error error = {0};
    uint8_t source[PEN_ID_BYTES] = {1, 2, 3};
    struct psc_material material = psc_material_default();
    material.alpha_mode = PSC_MASK;
    material.base.texture = 0;
    CHECK(psc_builder_add_material(b, &material) == 0);
    material.flags = PSC_DOUBLE_SIDED;
    CHECK(psc_builder_add_material(b, &material) == 1);
    uint8_t texels[4 * 5 * 3];
    for (size_t i = 0; i < sizeof texels; i++)
        texels[i] = (uint8_t)(i * 7);
    CHECK(psc_builder_add_image(b, 5, 3, true, texels) == 0);
    CHECK(psc_builder_add_image(b, 1, 1, false, texels) == 1);
    struct psc_texture texture = {.image = 1, .wrap_s = PSC_CLAMP, .nearest = 5};
    CHECK(psc_builder_add_texture(b, &texture) == 0);
    struct psc_light light = {.light = {.type = PEN_LIGHT_DISK, .radius = 2}};
    memset(light.name, 'x', sizeof light.name); /* too long: cut, not trusted */
    CHECK(psc_builder_add_light(b, &light) == 0);
    struct psc_camera camera = {.eye = {0, 0, 5}, .up = {0, 1, 0}, .fov_y_deg = 40, .name = "main"};
    CHECK(psc_builder_add_camera(b, &camera) == 0);
    psc_builder_add_warning(b, "%d things", 3);
    psc_builder_add_warning(b, "more");

    uint32_t first, second;
    struct psc_mesh mesh = cube_mesh();
    CHECK(psc_builder_add_mesh(b, &mesh, &first, &error));
    const float triangle[4][3] = {{9, 9, 9}, {0, 0, 0}, {3, 0, 0}, {0, 2, 0}};
    const float normals[4][3] = {{0, 0, 1}, {0, 0, 3}, {0, 0, 0}, {NAN, 0, 1}};
    const float uv1[4][2] = {{0, 0}, {0.25f, -7}, {INFINITY, 1}, {1, 1}};
    const float colors[4][4] = {{0}, {0, 0.5f, 1, 2}, {-1, 0, 0, 0}, {NAN, 0, 0, 1}};
    const uint32_t indices[3] = {1, 2, 3};
    mesh = (struct psc_mesh){.positions = triangle,
        .normals = normals,
        .uv1 = uv1,
        .colors = colors,
        .vertex_count = 4,
        .indices = indices,
        .index_count = 3,
        .material = 1};
    CHECK(psc_builder_add_mesh(b, &mesh, &second, &error));
    CHECK(first == 0 && second == 1);
    const float placed[12] = {2, 0, 0, 10, 0, 2, 0, 0, 0, 0, 2, 0};
    const float mirror[12] = {-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -20};
    psc_builder_add_instance(b, 0, identity);
    psc_builder_add_instance(b, 0, placed);
    psc_builder_add_instance(b, 1, mirror);
    void *data;
    size_t bytes;
    CHECK(psc_builder_finish(b, source, &data, &bytes, &error));
    psc_builder_destroy(b);

    struct psc_scene s;
    int fd = memfd_create("blob", 0);
    CHECK(write(fd, data, bytes) == (ssize_t)bytes);
    CHECK(psc_open(fd, &s, &error));
    close(fd);
    if (error.code) {
        fprintf(stderr, "%s\n", error.message);
        exit(1);
    }
    CHECK(memcmp(s.header, data, bytes) == 0 && memcmp(s.header->source, source, 32) == 0);
    CHECK(s.header->triangles == 25);
    CHECK(s.primitive_count == 2 && s.instance_count == 3 && s.material_count == 2);
    CHECK(s.vertex_count == 39); /* 36 corners of the cube, 3 of 4 vertices of the triangle */
    CHECK(s.instances[2].flags == PSC_MIRRORED && s.instances[1].flags == 0);
    CHECK(s.primitives[1].material == 1 && s.primitives[1].first_vertex == 36);
    CHECK(s.indices[36] == 36 && s.indices[38] == 38);
    const float low[3] = {-3, -2, -20}, high[3] = {12, 2, 2};
    CHECK(!memcmp(s.header->bounds_min, low, 12) && !memcmp(s.header->bounds_max, high, 12));
    CHECK(s.primitives[1].bounds_max[0] == 3 && s.primitives[1].bounds_min[2] == 0);

    for (int i = 36; i < 39; i++) /* unusable normals are replaced by the triangle's */
        CHECK(s.attributes[i].normal[2] == 32767 && s.attributes[i].normal[0] == 0);
    CHECK(s.attributes[36].uv[1][1] == -7 && s.attributes[37].uv[1][0] == 0);
    CHECK(!memcmp(s.attributes[36].color, (uint8_t[]){0, 128, 255, 255}, 4));
    CHECK(!memcmp(s.attributes[37].color, (uint8_t[]){0, 0, 0, 0}, 4));

    CHECK(s.materials[1].flags == PSC_DOUBLE_SIDED && s.materials[1].base.texture == 0);
    CHECK(s.image_count == 2 && s.images[0].levels == 3 && s.images[1].levels == 1);
    CHECK(!memcmp(s.texels, texels, sizeof texels));
    CHECK(s.images[1].first_byte == 4 * (15 + 2 + 1) && s.texel_bytes == 4 * (15 + 2 + 1 + 1));
    CHECK(s.textures[0].wrap_s == PSC_CLAMP && s.textures[0].nearest == 5);
    CHECK(s.lights[0].light.radius == 2 && strlen(s.lights[0].name) == sizeof light.name - 1);
    CHECK_STR(s.cameras[0].name, "main");
    CHECK(s.warning_bytes == 14 && !memcmp(s.warnings, "3 things\0more", 14));
    psc_close(&s);
    CHECK(!s.header);
    psc_close(&s);
    free(data);
}

static void nothing_at_all(void)
{
    struct psc_builder *b = psc_builder_create();
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    struct psc_scene s;
    CHECK(psc_builder_finish(b, no_source, &data, &bytes, &error));
    CHECK(psc_open_memory(data, bytes, &s, &error));
    CHECK(s.header->triangles == 0 && s.material_count == 1 && s.instance_count == 0);
    CHECK(s.header->bounds_min[0] > s.header->bounds_max[0]);
    psc_builder_destroy(b);
    free(data);
}

static void refused(const struct psc_mesh *mesh)
{
    struct psc_builder *b = psc_builder_create();
    struct pen_error error = {0};
    uint32_t primitive;
    CHECK(!psc_builder_add_mesh(b, mesh, &primitive, &error));
    CHECK(error.code == PEN_INVALID && error.message[0]);
    psc_builder_destroy(b);
}

static void refusals(void)
{
    struct psc_mesh mesh = cube_mesh();
    mesh.index_count = 35;
    refused(&mesh);
    mesh = cube_mesh();
    mesh.vertex_count = 7;
    refused(&mesh);
    mesh.indices = NULL;
    refused(&mesh);
    float positions[8][3];
    for (int i = 0; i < 3; i++) {
        memcpy(positions, cube_positions, sizeof positions);
        positions[5][1] = i == 0 ? NAN : i == 1 ? -INFINITY : 1e30f;
        mesh = cube_mesh();
        mesh.positions = (const float(*)[3])positions;
        refused(&mesh);
    }
    mesh = cube_mesh();
    mesh.meshlet_triangles = (uint32_t[]){5, 6};
    mesh.meshlet_count = 2;
    refused(&mesh);
    mesh.meshlet_triangles = (uint32_t[]){12, 0};
    refused(&mesh);

    /* What add cannot report, finish does. */
    for (int i = 0; i < 3; i++) {
        struct psc_builder *b = psc_builder_create();
        struct pen_error error = {0};
        uint32_t primitive;
        mesh = cube_mesh();
        mesh.material = i == 2; /* there is only one */
        CHECK(psc_builder_add_mesh(b, &mesh, &primitive, &error));
        float world[12];
        memcpy(world, identity, sizeof world);
        if (i == 0)
            world[3] = NAN;
        psc_builder_add_instance(b, i == 1 ? 9 : primitive, world);
        void *data;
        size_t bytes;
        CHECK(!psc_builder_finish(b, no_source, &data, &bytes, &error));
        CHECK(error.code == PEN_INVALID && !data);
        psc_builder_destroy(b);
    }
}

static double to_linear(double s)
{
    return s <= 0.04045 ? s / 12.92 : pow((s + 0.055) / 1.055, 2.4);
}

static double to_srgb(double l)
{
    return l <= 0.0031308 ? 12.92 * l : 1.055 * pow(l, 1 / 2.4) - 0.055;
}

/* Every texel of every level against the mean over the exact area of level 0 that it covers, which
 * repeated exact box filters give too. */
static void mips(uint32_t width, uint32_t height, bool srgb)
{
    uint64_t state = width * 31 + height + srgb;
    uint8_t *texels = malloc(4 * width * height);
    for (uint32_t i = 0; i < 4 * width * height; i++)
        texels[i] = (uint8_t)next_random(&state);
    struct psc_builder *b = psc_builder_create();
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    struct psc_scene s;
    psc_builder_add_image(b, width, height, srgb, texels);
    CHECK(psc_builder_finish(b, no_source, &data, &bytes, &error));
    CHECK(psc_open_memory(data, bytes, &s, &error));
    const uint8_t *level = s.texels;
    uint32_t w = width, h = height;
    double worst = 0;
    for (uint32_t l = 0; l < s.images[0].levels; l++) {
        for (uint32_t y = 0; y < h; y++)
            for (uint32_t x = 0; x < w; x++)
                for (int k = 0; k < 4; k++) {
                    bool curve = srgb && k < 3;
                    double x0 = (double)x * width / w, x1 = (x + 1.0) * width / w;
                    double y0 = (double)y * height / h, y1 = (y + 1.0) * height / h;
                    double sum = 0, area = 0;
                    for (uint32_t j = 0; j < height; j++)
                        for (uint32_t i = 0; i < width; i++) {
                            double wx = fmin(x1, i + 1.0) - fmax(x0, i);
                            double wy = fmin(y1, j + 1.0) - fmax(y0, j);
                            if (wx <= 0 || wy <= 0)
                                continue;
                            double v = texels[4 * (j * width + i) + k] / 255.0;
                            sum += wx * wy * (curve ? to_linear(v) : v);
                            area += wx * wy;
                        }
                    double v = sum / area;
                    v = 255 * (curve ? to_srgb(v) : v);
                    worst = fmax(worst, fabs(v - level[4 * (y * w + x) + k]));
                }
        level += 4 * w * h;
        w = w > 1 ? w / 2 : 1;
        h = h > 1 ? h / 2 : 1;
    }
    CHECK(worst < 1.6); /* 8-bit rounding at each level */
    CHECK(level == s.texels + s.texel_bytes);
    psc_builder_destroy(b);
    free(data);
    free(texels);
}

int main(void)
{
    round_trip();
    nothing_at_all();
    refusals();
    mips(8, 8, true);
    mips(16, 4, false);
    mips(7, 5, true);
    mips(1, 9, false);
    mips(13, 6, true);
    CHECK_DONE();
}
