/* What methods that trace rays share. */
#pragma once
#include "renderer/passes/rays/where.h"

/* By enum ray_backend. */
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
