/* What methods that trace rays share. */
#pragma once
#include "renderer/passes/rays/rays.h"

/* Without Embree there is no "cpu", and "auto" is "gpu". */
enum { BACKEND_AUTO, BACKEND_GPU, BACKEND_CPU };
static const char *const backend_names[] = {"auto", "gpu",
#ifdef PENUMBRA_HAVE_TRACE
    "cpu",
#endif
    NULL};

/* Errors of several lights must not be alike, or they would not average out. */
#define LIGHT_SEED 0x9e3779b9u

#define SEED_ROW(type)                                                                             \
    PARAM(type, seed, .def = 0, .min = 0, .max = 16777215,                                         \
        .help = "Another number gives another, equally good set of rays.")
#define BACKEND_ROW(type, where)                                                                   \
    PARAM(type, backend, .choices = backend_names,                                                 \
        .help = where "auto takes the GPU unless OpenGL runs on the CPU itself.")

/* The seed of the light and frame at hand. */
static inline uint32_t ray_seed(const struct technique_run *run, uint32_t seed)
{
    return seed + run->frame + LIGHT_SEED * run->light_index;
}

/* Whether Embree traces; there is no other way back from the GPU than `automatic`. */
static inline bool ray_on_host(const struct technique_run *run, uint32_t backend)
{
#ifdef PENUMBRA_HAVE_TRACE
    return backend == BACKEND_CPU || (backend == BACKEND_AUTO && run->ctx->software);
#else
    (void)run, (void)backend;
    return false;
#endif
}
