/* Convolution shadow maps (Annen et al. 2007, 2008): the depth test as a Fourier series whose
 * receiver and caster parts separate, so that the caster part can be filtered before the test. */
#pragma once
#include "renderer/passes/map/shadow_cache.h"

/* struct convolution_block */
#define SHARED_ROWS "renderer/shaders/lookup/convolution.def"
#include "renderer/shared/rows_c.h"

/* How the maps are stored and filtered: with mips, or as modular summed-area tables of 32-bit
 * integers (passes/map/sat.h), whose windows are exact boxes. */
extern const char *const convolution_format_names[]; /* "rgba8", "rgba16", "tables" */
enum convolution_format { CONVOLUTION_RGBA8, CONVOLUTION_RGBA16, CONVOLUTION_TABLES };

struct convolution_desc {
    uint32_t size;   /* texels per side of the depth map */
    uint32_t terms;  /* M, 1 to CONVOLUTION_MAX_TERMS */
    uint32_t format; /* enum convolution_format */
    float damping;   /* alpha of exp(-alpha (k / M)^2) */
    float offset;    /* of the receiver towards the light, in 1/M of the scaled depth */
    bool weighted;   /* also the series times depth, for the blocker average */
    bool contact;    /* lookups are measured against their nearest caster; not the maps' */
};

struct convolution_block convolution_constants(const struct convolution_desc *desc);

/* Fills in what depends on the light. */
void convolution_fit(struct convolution_block *block, const struct convolution_desc *desc,
    const struct light_face *face);

/* textures[0]: array of (sin c_k z, cos c_k z) pairs, two terms per RGBA layer, stored as v/2 +
 * 1/2, with mips; textures[1], when weighted: the same times z, and a last layer with z in r.
 * Tables: the integers of those, summed over [0, x) x [0, y) in texel (x, y). Kept
 * between requests. */
const struct shadow_input *pass_convolution(
    struct technique_run *run, const struct convolution_desc *desc, struct pen_error *error);
