/* Small meshes for the blob tests, and a seeded random source. */
#pragma once
#include "renderer/blob/builder.h"
#include "tests/unit/check.h"
#include "tests/unit/random.h"

static const float cube_positions[8][3] = {{-1, -1, -1}, {1, -1, -1}, {1, 1, -1}, {-1, 1, -1},
    {-1, -1, 1}, {1, -1, 1}, {1, 1, 1}, {-1, 1, 1}};
static const uint32_t cube_indices[36] = {0, 2, 1, 0, 3, 2, 4, 5, 6, 4, 6, 7, 0, 1, 5, 0, 5, 4, 2,
    3, 7, 2, 7, 6, 1, 2, 6, 1, 6, 5, 0, 4, 7, 0, 7, 3};
static const float identity[12] __attribute__((unused)) = {1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0};
static const uint8_t no_source[PEN_ID_BYTES] __attribute__((unused));

static inline struct psc_mesh cube_mesh(void)
{
    return (struct psc_mesh){
        .positions = cube_positions, .vertex_count = 8, .indices = cube_indices, .index_count = 36};
}

/* Adds one instance of `mesh`, finishes and opens; aborts the test on failure. */
static inline void *build_one(const struct psc_mesh *mesh, struct psc_scene *scene)
{
    struct pen_error error = {0};
    struct psc_builder *builder = psc_builder_create();
    uint32_t primitive;
    void *data = NULL;
    size_t bytes;
    if (!psc_builder_add_mesh(builder, mesh, &primitive, &error)) {
        fprintf(stderr, "add_mesh: %s\n", error.message);
        exit(1);
    }
    psc_builder_add_instance(builder, primitive, identity);
    if (!psc_builder_finish(builder, no_source, &data, &bytes, &error) ||
        !psc_open_memory(data, bytes, scene, &error)) {
        fprintf(stderr, "finish: %s\n", error.message);
        exit(1);
    }
    psc_builder_destroy(builder);
    return data;
}
