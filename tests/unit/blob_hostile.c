/* Damaged files: psc_open either refuses or gives a scene whose every offset and number is usable.
 * A reader that walks everything runs after each success; sanitizers see what it touches. */
#include "tests/unit/blob_shapes.h"
#include "tests/unit/blob_walk.h"

static void *valid_blob(size_t *bytes)
{
    struct psc_builder *b = psc_builder_create();
    struct pen_error error = {0};
    struct psc_material material = psc_material_default();
    material.base.texture = 0;
    psc_builder_add_material(b, &material);
    psc_builder_add_texture(b, &(struct psc_texture){.image = 0});
    uint8_t texels[4 * 6 * 4];
    memset(texels, 77, sizeof texels);
    psc_builder_add_image(b, 6, 4, true, texels);
    psc_builder_add_light(
        b, &(struct psc_light){.light = {.type = PEN_LIGHT_RECT}, .name = "lamp"});
    psc_builder_add_camera(
        b, &(struct psc_camera){.up = {0, 1, 0}, .fov_y_deg = 45, .name = "main"});
    psc_builder_add_warning(b, "careful");
    struct psc_mesh mesh = cube_mesh();
    mesh.meshlet_triangles = (uint32_t[]){5, 7};
    mesh.meshlet_count = 2;
    uint32_t primitive;
    psc_builder_add_mesh(b, &mesh, &primitive, &error);
    psc_builder_add_mesh(b, &mesh, &primitive, &error);
    psc_builder_add_instance(b, 0, identity);
    psc_builder_add_instance(b, 1, identity);
    void *data;
    if (!psc_builder_finish(b, no_source, &data, bytes, &error))
        exit(1);
    psc_builder_destroy(b);
    return data;
}

static double total;

/* A fresh allocation of exactly `bytes`, so that a sanitizer sees one byte too far. */
static bool try_blob(const void *blob, size_t bytes)
{
    void *copy = malloc(bytes ? bytes : 1);
    memcpy(copy, blob, bytes);
    struct psc_scene s;
    struct pen_error error = {0};
    bool ok = psc_open_memory(copy, bytes, &s, &error);
    CHECK(ok || (error.code == PEN_INVALID && error.message[0] && !s.header));
    if (ok)
        CHECK(walk_blob(&s, &total));
    free(copy);
    return ok;
}

/* Each of these single changes must be refused. */
static void named_damage(const char *blob, size_t bytes)
{
    char *d = malloc(bytes);
    const struct psc_section *s = ((const struct psc_header *)blob)->sections;
#define REFUSE(section, type, item, change)                                                        \
    do {                                                                                           \
        memcpy(d, blob, bytes);                                                                    \
        type *x = (type *)(d + s[section].offset) + (item);                                        \
        change;                                                                                    \
        if (try_blob(d, bytes)) {                                                                  \
            fprintf(stderr, "accepted: %s\n", #change);                                            \
            check_failures++;                                                                      \
        }                                                                                          \
    } while (0)
#define REFUSE_HEADER(change)                                                                      \
    do {                                                                                           \
        memcpy(d, blob, bytes);                                                                    \
        struct psc_header *x = (struct psc_header *)d;                                             \
        change;                                                                                    \
        if (try_blob(d, bytes)) {                                                                  \
            fprintf(stderr, "accepted: %s\n", #change);                                            \
            check_failures++;                                                                      \
        }                                                                                          \
    } while (0)
    REFUSE_HEADER(x->magic[0] = 'Q');
    REFUSE_HEADER(x->version = PSC_VERSION + 1);
    REFUSE_HEADER(x->header_bytes--);
    REFUSE_HEADER(x->file_bytes += 64);
    REFUSE_HEADER(x->bounds_max[1] = NAN);
    REFUSE_HEADER(x->bounds_min[1] = 9);
    REFUSE_HEADER(x->triangles++);
    REFUSE_HEADER(x->reserved = 1);
    for (int i = 0; i < PSC_SECTIONS; i++) {
        REFUSE_HEADER(x->sections[i].offset = UINT64_MAX - 63);
        REFUSE_HEADER(x->sections[i].offset += 4);
        REFUSE_HEADER(x->sections[i].bytes = UINT64_MAX - 255);
        REFUSE_HEADER(x->sections[i].bytes = 1ull << 40);
        REFUSE_HEADER(x->sections[i].offset = 0);
        if (i != PSC_WARNINGS)
            REFUSE_HEADER(x->sections[i].bytes -= 1);
    }
    REFUSE(PSC_POSITIONS, float, 5, *x = INFINITY);
    REFUSE(PSC_ATTRIBUTES, struct psc_attributes, 3, x->uv[1][0] = NAN);
    REFUSE(PSC_ATTRIBUTES, struct psc_attributes, 3, x->tangent[3] = 5);
    REFUSE(PSC_INDICES, uint32_t, 7, *x = 1000000);
    REFUSE(PSC_INDICES, uint32_t, 7, *x = 40); /* a vertex of the other primitive */
    REFUSE(PSC_INDICES, uint32_t, 40, *x = 1);
    REFUSE(PSC_MESHLETS, struct psc_meshlet, 0, x->index_count += 3);
    REFUSE(PSC_MESHLETS, struct psc_meshlet, 1, x->first_index = UINT32_MAX - 2);
    REFUSE(PSC_MESHLETS, struct psc_meshlet, 1, x->radius = -1);
    REFUSE(PSC_MESHLETS, struct psc_meshlet, 1, x->cone_cutoff = NAN);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 0, x->index_count = UINT32_MAX);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 1, x->first_vertex = UINT32_MAX);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 1, x->material = 1);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 1, x->meshlet_count = 1);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 1, x->bounds_max[2] = -5);
    REFUSE(PSC_PRIMITIVES, struct psc_primitive, 1, x->flags = 6);
    REFUSE(PSC_INSTANCES, struct psc_instance, 1, x->primitive = 2);
    REFUSE(PSC_INSTANCES, struct psc_instance, 1, x->flags = PSC_MIRRORED);
    REFUSE(PSC_INSTANCES, struct psc_instance, 1, x->world[11] = NAN);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->base.texture = 1);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->normal.texture = -2);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->emission.uv_set = 2);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->surface.transform[5] = NAN);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->alpha_mode = 3);
    REFUSE(PSC_MATERIALS, struct psc_material, 0, x->alpha_cutoff = NAN);
    REFUSE(PSC_TEXTURES, struct psc_texture, 0, x->image = 1);
    REFUSE(PSC_TEXTURES, struct psc_texture, 0, x->wrap_t = 3);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->width = 0);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->width = 7);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->height = UINT32_MAX);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->levels = 2);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->first_byte = UINT64_MAX - 3);
    REFUSE(PSC_IMAGES, struct psc_image, 0, x->first_byte = 4);
    REFUSE(PSC_LIGHTS, struct psc_light, 0, x->light.type = PEN_LIGHT_TYPES);
    REFUSE(PSC_LIGHTS, struct psc_light, 0, x->light.pattern = 99);
    REFUSE(PSC_LIGHTS, struct psc_light, 0, x->light.irradiance = NAN);
    REFUSE(PSC_LIGHTS, struct psc_light, 0, memset(x->name, 'x', sizeof x->name));
    REFUSE(PSC_CAMERAS, struct psc_camera, 0, x->fov_y_deg = 180);
    REFUSE(PSC_CAMERAS, struct psc_camera, 0, x->up[2] = NAN);
    REFUSE(PSC_CAMERAS, struct psc_camera, 0, memset(x->name, 'x', sizeof x->name));
    REFUSE(PSC_WARNINGS, char, 7, *x = 'x');
    free(d);
}

static void random_damage(const char *blob, size_t bytes)
{
    static const uint32_t nasty[] = {0, 1, 2, 3, 127, 0x7f800000, 0x7fc00000, 0x80000000,
        0x7fffffff, 0xffffffff, 0xfffffffd, 0xffffffc0, 0x10000, 0x40000000, 0xff800001};
    uint64_t state = 2024;
    char *d = malloc(bytes);
    uint32_t accepted = 0, tries = 30000;
    for (uint32_t i = 0; i < tries; i++) {
        memcpy(d, blob, bytes);
        uint32_t changes = 1 + next_random(&state) % 3;
        for (uint32_t c = 0; c < changes; c++) {
            /* Half of the changes hit the header, where the offsets are. */
            size_t span = next_random(&state) % 2 ? sizeof(struct psc_header) : bytes - 4;
            size_t at = next_random(&state) % span;
            uint32_t how = next_random(&state) % 3;
            if (how == 0)
                d[at] ^= (char)(1 << next_random(&state) % 8);
            else if (how == 1)
                memcpy(d + at / 4 * 4, &nasty[next_random(&state) % 15], 4);
            else
                d[at] = (char)next_random(&state);
        }
        accepted += try_blob(d, bytes);
    }
    fprintf(stderr, "%u of %u damaged files were still usable\n", accepted, tries);
    CHECK(accepted > 0 && accepted < tries); /* texels, names and uv may change freely */
    free(d);
}

int main(void)
{
    size_t bytes;
    char *blob = valid_blob(&bytes);
    CHECK(try_blob(blob, bytes));
    for (size_t size = 0; size < bytes; size++)
        CHECK(!try_blob(blob, size));
    named_damage(blob, bytes);
    random_damage(blob, bytes);
    fprintf(stderr, "%g\n", total);
    free(blob);
    CHECK_DONE();
}
