/* What the files of this folder share. */
#pragma once
#include "renderer/trace/embree/embree.h"
#include "renderer/trace/parallel.h"
#include "renderer/trace/points.h"
#include "renderer/trace/trace.h"
#include <stdatomic.h>

/* The scene's triangles by what decides whether a hit on them counts. */
enum trace_group {
    TRACE_TWO_SIDED, /* nothing: it does */
    TRACE_FACING,    /* the side that was hit */
    TRACE_ALPHA,     /* a texture or vertex alpha, and the side when single-sided */
    TRACE_GROUPS
};

/* Geometry ids within a hierarchy. */
enum trace_geometry {
    TRACE_GEOMETRY_TWO_SIDED,
    TRACE_GEOMETRY_FRONT, /* of TRACE_FACING, for shadows: those that face the whole light, or all */
    TRACE_GEOMETRY_MIXED, /* those whose plane cuts the light; for primary rays all of them */
    TRACE_GEOMETRY_ALPHA,
    TRACE_GEOMETRY_GROUND,
    TRACE_GEOMETRIES
};

struct trace_range { /* where an instance's triangles went */
    uint32_t first_triangle, instance;
};

struct trace_alpha_material {
    const uint8_t *texels; /* alpha of the finest level; NULL: 1 */
    uint32_t width, height, wrap_s, wrap_t;
    bool nearest, blend, two_sided, prepared;
    float factor, cutoff;
};

struct trace_alpha {
    uint32_t (*indices)[3]; /* those of TRACE_ALPHA */
    float (*uv)[2];         /* base texture coordinates, transform applied; per vertex */
    float *vertex_alpha;    /* per vertex */
    uint32_t *materials;    /* per triangle, into `table` */
    struct trace_alpha_material *table; /* one per blob material; unused ones are zero */
    uint8_t **images;                   /* one per blob image; NULL where unused */
    uint32_t image_count;
    bool blends; /* of some a share alpha casts */
};

/* What decides on which side of a triangle's plane a light lies: its centre (sun: the direction to
 * it) and half axes. BOTH_SIDES: nobody asks, and one hierarchy serves every light. */
struct trace_silhouette {
    enum {
        TRACE_EYE,
        TRACE_BOTH_SIDES,
        TRACE_SQUARE,
        TRACE_ROUND,
        TRACE_BALL,
        TRACE_PARALLEL
    } shape;
    float center[3], a[3], b[3]; /* BALL: the radius in a[0] */
};

/* One of Embree's hierarchies over the scene. Where only fronts cast it leaves out what can never
 * count: the triangles of single-sided materials that turn their back to every point of the light. */
struct trace_hierarchy {
    RTCScene scene;
    RTCGeometry geometries[TRACE_GEOMETRIES];
    uint32_t (*indices[TRACE_GEOMETRIES])[3]; /* own subsets; NULL: all of a group */
    uint32_t *alpha_triangles; /* of the subset's triangles, the number in TRACE_ALPHA */
    struct trace_filter {
        const struct trace_alpha *alpha;
        const uint32_t *triangles; /* alpha_triangles, or NULL: the same */
        bool both_sides;           /* facing does not count */
    } filter;
    struct trace_silhouette light;   /* what it was made for */
    uint64_t last_use;               /* 0: unused slot */
    uint32_t users;                  /* jobs that trace it; several may take turns */
    struct trace_building *building; /* by a thread of its own, while they wait; NULL: it is not */
    struct pen_error error;          /* why it could not be made */
    uint64_t bytes;                  /* of the subsets */
    uint64_t filtered, triangles;
};

#define TRACE_HIERARCHIES (PEN_MAX_LIGHTS + 1) /* kept at most */

struct pen_trace_scene {
    RTCDevice device;
    float (
        *positions[TRACE_GROUPS])[3]; /* world; one more than counted, as Embree reads 16 bytes */
    uint32_t (*indices[TRACE_GROUPS])[3];
    uint32_t vertex_count[TRACE_GROUPS], triangle_count[TRACE_GROUPS];
    struct trace_range *ranges[TRACE_GROUPS];
    uint32_t range_count[TRACE_GROUPS];
    struct trace_alpha alpha;
    bool has_ground;
    float ground[5][3]; /* corners, and one for Embree */
    uint32_t ground_indices[2][3];
    float extent; /* largest absolute coordinate, without the ground */
    struct trace_hierarchy hierarchies[TRACE_HIERARCHIES];
    uint64_t builds;
    uint64_t clock; /* counts uses */
    uint64_t max_bytes;
    _Atomic int64_t bytes; /* everything */
    atomic_bool over_budget;
    struct pen_trace_scene_info info;
    void *scratch; /* room of a job that has ended, for the next */
    size_t scratch_bytes;
};

/* Room for a job to work in, which counts as the scene's. *bytes becomes what it has. NULL: there is
 * none. */
void *trace_scratch_take(struct pen_trace_scene *scene, size_t *bytes);
void trace_scratch_give(struct pen_trace_scene *scene, void *scratch, size_t bytes);

/* The context of a query: Embree's own first, so that filters can cast back. */
struct trace_context {
    embree_context embree;
    /* Of a shadow ray, by its id: what blended surfaces let through of its light, and where the
     * nearest of them is. */
    float share[16], nearest[16];
};

/* Filters: shadow rays run from the receiver to the light, primary rays from the eye. */
void trace_filter_facing_shadow(const struct RTCFilterFunctionNArguments *args);
void trace_filter_facing_primary(const struct RTCFilterFunctionNArguments *args);
void trace_filter_alpha_shadow(const struct RTCFilterFunctionNArguments *args);
void trace_filter_alpha_primary(const struct RTCFilterFunctionNArguments *args);

/* The hierarchy for a light or, TRACE_EYE, for primary rays; made when there is none yet, while which
 * `job` (or NULL) gives way to others, and may give up. It stays until it is released. */
const struct trace_hierarchy *trace_hierarchy_get(struct pen_trace_scene *scene,
    const struct trace_silhouette *light, const struct pen_trace_job *job, struct pen_error *error);
void trace_hierarchy_release(
    struct pen_trace_scene *scene, const struct trace_hierarchy *hierarchy);
void trace_hierarchy_finish(struct pen_trace_scene *scene, struct trace_hierarchy *hierarchy);
/* False, with *error filled, when Embree complains or the budget is spent. */
bool trace_check_device(struct pen_trace_scene *scene, struct pen_error *error);

/* Alpha at a point of triangle `primitive`; u, v as Embree gives them. */
float trace_alpha_at(const struct trace_alpha *alpha, uint32_t primitive, float u, float v);

/* A job's work on the tiles of its picture: what it works on begins with this. */
struct trace_pieces {
    struct pen_trace_scene *scene;
    const struct pen_trace_job *job;
    uint32_t threads;
    double cpu_seconds; /* so far */
    atomic_bool late;   /* there is no more wanted */
    bool owes;          /* job->shown is to be called beside the next work */
};
/* Calls work(pieces, tile) for all tiles; now and then others come in between when they want to. False:
 * it is late. */
bool trace_in_pieces(
    struct trace_pieces *pieces, uint32_t tiles, void (*work)(void *context, uint32_t item));
bool trace_is_late(struct trace_pieces *pieces); /* also by the job's deadline */

static inline float trace_dot(const float a[3], const float b[3])
{
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
}

static inline void trace_cross(const float a[3], const float b[3], float out[3])
{
    out[0] = a[1] * b[2] - a[2] * b[1];
    out[1] = a[2] * b[0] - a[0] * b[2];
    out[2] = a[0] * b[1] - a[1] * b[0];
}
