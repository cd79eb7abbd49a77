/* Meshes of the Draco library as plain C. No exception leaves. */
#pragma once
#include <stdbool.h>
#include <stddef.h>
#include <stdint.h>
#ifdef __cplusplus
extern "C" {
#endif
#include "protocol/error.h"

struct draco_mesh;

/* NULL with PEN_INVALID (damaged, or no mesh of triangles) or PEN_TOO_BIG (memory). */
struct draco_mesh *draco_mesh_decode(const uint8_t *data, size_t bytes, struct pen_error *error);
void draco_mesh_free(struct draco_mesh *mesh);

uint32_t draco_mesh_points(const struct draco_mesh *mesh);
uint32_t draco_mesh_faces(const struct draco_mesh *mesh);
/* Three point numbers of each face, as stored: they may be out of range. */
void draco_mesh_indices(const struct draco_mesh *mesh, uint32_t *indices);
/* The attribute with this unique id as glTF's component type (5120 to 5126) of 1 to 4 components,
 * tightly packed, for every point. False when there is none that fits. */
bool draco_mesh_attribute(const struct draco_mesh *mesh, uint32_t id, uint32_t component,
    uint32_t components, void *values);

#ifdef __cplusplus
}
#endif
