/* Small glTF files made in memory, and questions about the blobs they become. */
#pragma once
#include "renderer/blob/pscene.h"
#include "renderer/import/import.h"
#include "tests/unit/check.h"

struct imported {
    bool ok;
    struct pen_error error;
    void *data;
    struct psc_scene scene; /* open when ok */
};

struct imported import_bytes(const void *data, size_t bytes);
/* A glTF JSON text. */
struct imported import_json(const char *json);
void imported_free(struct imported *imported);

/* Static storage, overwritten by the next call but three. */
const char *base64(const void *data, size_t bytes);
/* Formatted text, to be freed. */
char *text(const char *format, ...) __attribute__((format(printf, 1, 2)));

/* True when some instance draws this triangle in world space: same winding, any first corner. A
 * mirrored instance's winding counts as stored. */
bool draws(const struct psc_scene *scene, const float a[3], const float b[3], const float c[3]);
/* The vertex of `scene` at an object-space position, or UINT32_MAX. */
uint32_t vertex_at(const struct psc_scene *scene, float x, float y, float z);
bool has_warning(const struct psc_scene *scene, const char *part);

#define V(...) ((const float[3]){__VA_ARGS__})
