/* Scenes made by our own code: the demo, the closed-form test scenes and load for benchmarks.
 * Each is available as a blob (no importer needed) and as a .glb (to go through the whole path).
 * The receiver of the closed-form scenes is 8 x 8 m around the origin; casters are double-sided,
 * without thickness, and half-planes reach to the receiver's borders. Each has a camera "main". */
#pragma once
#include "renderer/blob/pscene.h"

enum pen_generated_kind {
    PEN_GENERATED_DEMO,
    PEN_GENERATED_HALF_PLANE,  /* T1, T3, T5: caster x <= 0 at height c over a receiver at y = 0 */
    PEN_GENERATED_SQUARE,      /* T2: one axis-aligned square caster */
    PEN_GENERATED_STACKED,     /* T4: the lower half-plane x <= 0 hides all light where the edge of
                                  the upper one, x <= -0.6, crosses it: V = 0 left of the penumbra */
    PEN_GENERATED_DUPLICATE,   /* two half-planes x <= 0: each hides the same half of a light above
                                  the origin from the origin */
    PEN_GENERATED_PLANAR_MASK, /* T6: a square caster cut by an alpha mask (texture 0, nearest) */
    PEN_GENERATED_PLANE,       /* T7: a receiver alone */
    PEN_GENERATED_EMPTY_ROOM, /* tiles and skirts of a flat convex hill: none can cast on another */
    PEN_GENERATED_HAIRBALL,   /* `triangles` of them */
    PEN_GENERATED_FOLIAGE,    /* `triangles`: alpha-masked and solid leaves */
    PEN_GENERATED_COLUMNS,    /* `triangles` */
    PEN_GENERATED_KINDS
};
extern const char *const pen_generated_names[];

struct pen_generated_options {
    uint32_t kind;      /* enum pen_generated_kind */
    uint32_t triangles; /* hairball, foliage, columns: about this many; 0: 100,000 */
    uint32_t seed;
    float caster_height;    /* m above the receiver at y = 0; 0: 1.2 */
    float caster_half_size; /* m, square caster; 0: 0.4 */
    float second_height;    /* stacked, duplicate: the lower caster; 0: half of caster_height */
};

/* The blob; the caller frees *data. */
bool pen_generate_blob(const struct pen_generated_options *options, void **data, size_t *bytes,
    struct pen_error *error);
/* The same scene as a glTF binary; the caller frees *data. */
bool pen_generate_glb(const struct pen_generated_options *options, void **data, size_t *bytes,
    struct pen_error *error);
