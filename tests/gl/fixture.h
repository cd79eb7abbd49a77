/* A renderer and generated scenes, for tests that need OpenGL but no daemon. */
#pragma once
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"

/* A renderer, or NULL with *error; `device` as enum pen_device_choice. */
struct pen_renderer *fixture_renderer(
    uint32_t device, uint64_t gpu_memory, struct pen_error *error);
/* A generated scene's blob and its id; the caller closes it. Exits on failure. */
int fixture_blob(uint32_t kind, uint32_t triangles, uint32_t seed, uint8_t id[PEN_ID_BYTES]);
/* Loads a generated scene under an id made of `kind` and `seed`. Exits on failure. */
void fixture_scene(struct pen_renderer *renderer, uint32_t kind, uint32_t triangles, uint32_t seed,
    uint8_t id[PEN_ID_BYTES]);
/* A default request for that scene, 200 x 150. */
void fixture_request(
    struct pen_request *request, const uint8_t id[PEN_ID_BYTES], const char *technique);
/* Renders; returns the pixels of the first plane as a hash. Exits on failure. */
uint64_t fixture_render(
    struct pen_renderer *renderer, const struct pen_request *request, struct pen_result *result);
/* The pixels of the first plane, of four bytes each, as a hash. */
uint64_t fixture_hash(const struct pen_frame *frame);
/* Root of the mean squared difference of the first planes' bytes; both of four channels and one size. */
double fixture_distance(const struct pen_frame *a, const struct pen_frame *b);
/* What of this process is in memory. */
double fixture_resident_mib(void);
