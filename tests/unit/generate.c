/* Every generated scene opens, is complete and reproducible, and has the asked size. */
#include "renderer/generate/generate.h"
#include "tests/unit/check.h"
#include <time.h>

static double seconds(void)
{
    struct timespec t;
    clock_gettime(CLOCK_MONOTONIC, &t);
    return (double)t.tv_sec + (double)t.tv_nsec * 1e-9;
}

/* The scene's triangle count; checks that every triangle is in exactly one meshlet. */
static uint64_t check_blob(const void *data, size_t bytes)
{
    struct psc_scene s;
    struct pen_error error = {0};
    if (!psc_open_memory(data, bytes, &s, &error)) {
        fprintf(stderr, "%s\n", error.message);
        check_failures++;
        return 0;
    }
    uint8_t *covered = calloc(s.index_count / 3 + 1, 1);
    for (uint32_t i = 0; i < s.meshlet_count; i++)
        for (uint32_t k = 0; k < s.meshlets[i].index_count; k += 3)
            covered[(s.meshlets[i].first_index + k) / 3]++;
    uint32_t wrong = 0;
    for (uint32_t i = 0; i < s.index_count / 3; i++)
        wrong += covered[i] != 1;
    CHECK(wrong == 0);
    free(covered);

    for (int k = 0; k < 3; k++) {
        CHECK(s.header->bounds_max[k] - s.header->bounds_min[k] < 20);
        CHECK(s.header->bounds_min[k] <= s.header->bounds_max[k]);
    }
    /* Unit normals, and on the front side of their triangles. */
    uint32_t bent = 0, inverted = 0;
    for (uint32_t i = 0; i < s.vertex_count; i++) {
        const int16_t *n = s.attributes[i].normal;
        double length = sqrt((double)n[0] * n[0] + (double)n[1] * n[1] + (double)n[2] * n[2]);
        bent += fabs(length / 32767 - 1) > 1e-3;
    }
    for (uint32_t i = 0; i < s.index_count; i += 3) {
        const float *a = s.positions[s.indices[i]], *b = s.positions[s.indices[i + 1]],
                    *c = s.positions[s.indices[i + 2]];
        double e[3], f[3], side = 0;
        for (int k = 0; k < 3; k++) {
            e[k] = (double)b[k] - a[k];
            f[k] = (double)c[k] - a[k];
        }
        const double face[3] = {
            e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]};
        for (int corner = 0; corner < 3; corner++)
            for (int k = 0; k < 3; k++)
                side += face[k] * s.attributes[s.indices[i + corner]].normal[k];
        inverted += side < 0;
    }
    CHECK(bent == 0);
    CHECK(inverted <= s.index_count / 3 / 500); /* kinks of hairs and branches fold a few over */
    CHECK(s.camera_count == 1 && !strcmp(s.cameras[0].name, "main"));
    return s.header->triangles;
}

static uint64_t check_kind(uint32_t kind, uint32_t triangles, uint32_t seed)
{
    struct pen_generated_options options = {.kind = kind, .triangles = triangles, .seed = seed};
    struct pen_error error = {0};
    void *first, *second;
    size_t first_bytes, second_bytes;
    CHECK(pen_generate_blob(&options, &first, &first_bytes, &error));
    CHECK(pen_generate_blob(&options, &second, &second_bytes, &error));
    CHECK(first_bytes == second_bytes && !memcmp(first, second, first_bytes));
    free(second);
    uint64_t count = check_blob(first, first_bytes);
    free(first);
    CHECK(pen_generate_glb(&options, &first, &first_bytes, &error));
    CHECK(pen_generate_glb(&options, &second, &second_bytes, &error));
    CHECK(first_bytes == second_bytes && !memcmp(first, second, first_bytes));
    free(second);
    free(first);
    if (check_failures)
        fprintf(stderr, "in scene %s of %u triangles\n", pen_generated_names[kind], triangles);
    return count;
}

static void check_count(uint32_t kind, uint32_t asked, double tolerance)
{
    uint64_t count = check_kind(kind, asked, 1);
    if (fabs((double)count - asked) > tolerance * asked) {
        fprintf(stderr, "%s: %llu triangles, asked for %u\n", pen_generated_names[kind],
            (unsigned long long)count, asked);
        check_failures++;
    }
}

static void seeds_differ(uint32_t kind)
{
    struct pen_generated_options options = {.kind = kind, .triangles = 5000, .seed = 1};
    struct pen_error error = {0};
    void *first, *second;
    size_t first_bytes, second_bytes;
    CHECK(pen_generate_blob(&options, &first, &first_bytes, &error));
    options.seed = 2;
    CHECK(pen_generate_blob(&options, &second, &second_bytes, &error));
    struct psc_scene a, b;
    CHECK(psc_open_memory(first, first_bytes, &a, &error));
    CHECK(psc_open_memory(second, second_bytes, &b, &error));
    CHECK(a.vertex_count != b.vertex_count ||
          memcmp(a.positions, b.positions, 12 * (size_t)a.vertex_count));
    free(first);
    free(second);
}

static void refused(struct pen_generated_options options, const char *pointer)
{
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    CHECK(!pen_generate_blob(&options, &data, &bytes, &error));
    CHECK(error.code == PEN_INVALID);
    CHECK_STR(error.pointer, pointer);
}

int main(void)
{
    for (uint32_t kind = 0; kind < PEN_GENERATED_KINDS; kind++)
        CHECK(check_kind(kind, 0, 0) > 0);
    CHECK(!pen_generated_names[PEN_GENERATED_KINDS]);
    uint64_t demo = check_kind(PEN_GENERATED_DEMO, 0, 0);
    CHECK(demo > 60000 && demo < 150000);

    check_count(PEN_GENERATED_HAIRBALL, 3000, 0.05);
    check_count(PEN_GENERATED_HAIRBALL, 100000, 0.05);
    check_count(PEN_GENERATED_FOLIAGE, 20000, 0.05);
    check_count(PEN_GENERATED_FOLIAGE, 300000, 0.05);
    check_count(PEN_GENERATED_COLUMNS, 20000, 0.15);
    check_count(PEN_GENERATED_COLUMNS, 1000000, 0.10);

    struct pen_generated_options most = {.kind = PEN_GENERATED_HAIRBALL, .triangles = 3000000};
    struct pen_error error = {0};
    void *data;
    size_t bytes;
    double begin = seconds();
    CHECK(pen_generate_blob(&most, &data, &bytes, &error));
    fprintf(stderr, "hairball of 3,000,000: %.2f s\n", seconds() - begin);
    CHECK_NEAR((double)check_blob(data, bytes), 3e6, 0.05 * 3e6);
    free(data);

    seeds_differ(PEN_GENERATED_HAIRBALL);
    seeds_differ(PEN_GENERATED_FOLIAGE);

    refused((struct pen_generated_options){.kind = PEN_GENERATED_KINDS}, "/kind");
    refused((struct pen_generated_options){.triangles = 0xffffffff}, "/triangles");
    refused((struct pen_generated_options){.caster_height = NAN}, "/caster_height");
    refused((struct pen_generated_options){.caster_height = -1}, "/caster_height");
    refused((struct pen_generated_options){.caster_half_size = INFINITY}, "/caster_half_size");
    refused((struct pen_generated_options){.second_height = 1e9f}, "/second_height");
    CHECK_DONE();
}
