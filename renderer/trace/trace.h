/* Ray-traced visibility of area lights on the CPU (Embree): the reference that every shadow map
 * method is measured against. No GL. Units are metres, world space; colours are linear RGB.
 *
 * Who casts: every triangle of the scene, under the rules of the shadow maps. A triangle of a
 * single-sided material casts with both sides or, front_only, only when its front faces the light; a
 * MASK texel below the cutoff casts nothing; a BLEND surface stops a share alpha of each ray's light,
 * and so do those behind it of what is left. Textures are read at their finest level. */
#pragma once
#include "renderer/blob/pscene.h"

/* World-space triangles, and the hierarchies that the last few lights needed: one for all of them
 * or, front_only, one per light, because it leaves out the triangles that turn their back to it. One
 * call at a time per scene. */
struct pen_trace_scene;

/* A horizontal square that receives and casts; two-sided. */
struct pen_trace_ground {
    float center[3];
    float half_size;
};

struct pen_trace_scene_options {
    const struct pen_trace_ground *ground; /* NULL: none */
    uint64_t max_bytes; /* of memory for geometry and hierarchy together; 0: 4 GiB */
};

struct pen_trace_scene_info {
    uint64_t triangles;       /* after instancing, without the ground */
    uint64_t single_sided;    /* of them, those whose facing counts */
    uint64_t alpha;           /* of them, those that need a texture look-up */
    uint64_t bytes;           /* geometry and hierarchies at this moment */
    uint32_t native_packet16; /* 1: the CPU runs 16-wide packets in one go */
};

/* Flattens all instances; hierarchies are built when first needed. Keeps nothing of *scene: it may
 * be closed afterwards. `options` may be NULL. Errors: PEN_TOO_BIG over max_bytes, PEN_INTERNAL
 * from Embree. */
struct pen_trace_scene *pen_trace_scene_create(const struct psc_scene *scene,
    const struct pen_trace_scene_options *options, struct pen_error *error);
void pen_trace_scene_destroy(struct pen_trace_scene *scene); /* NULL is fine */
struct pen_trace_scene_info pen_trace_scene_info(const struct pen_trace_scene *scene);

/* enum pen_trace_light_type */
#define SHARED_ROWS "renderer/trace/lights.def"
#include "renderer/shared/rows_c.h"

/* An emitter in its own right-handed frame: x, y, z unit and orthogonal, +z the emission axis. */
struct pen_trace_light {
    uint32_t type; /* enum pen_trace_light_type */
    float origin[3];
    float x[3], y[3], z[3];
    float half[2];
    float cos_cone; /* POINT: cosine of the outer half angle; -1: all directions */
    /* Emission e(u,v), u = x / half[0], v = y / half[1], both in [-1,1]. RGBA32F (a is ignored),
     * `columns` x `rows`, row 0 at v = -1 and column 0 at u = -1 (the order of a GL texture).
     * Piecewise constant per texel, or bilinear with clamped edges. NULL: 1 everywhere. */
    const float *emission;
    uint32_t columns, rows;
    bool bilinear;
};

enum pen_trace_weighting {
    PEN_TRACE_AREA, /* every light point counts alike */
    PEN_TRACE_G,    /* weighted by cos(receiver) cos(light) / distance^2 */
};

/* What the receivers of a job have gathered, for one that is the same but for its number of samples.
 * Only those of at least 64 samples and without target_error leave anything. */
struct pen_trace_kept;
uint32_t pen_trace_kept_samples(const struct pen_trace_kept *kept); /* NULL: 0 */
/* `plain`: weighted by area, without an emission texture. */
uint64_t pen_trace_kept_bytes(size_t receivers, bool plain);
void pen_trace_kept_destroy(struct pen_trace_kept *kept); /* NULL is fine */

/* The other threads of a job end what they are at and wait until they are held no more. */
struct pen_trace_crew {
    void (*hold)(struct pen_trace_crew *crew, bool held);
};

enum pen_trace_step { PEN_TRACE_GO_ON, PEN_TRACE_SHOW, PEN_TRACE_STOP };

/* Receivers as a camera's picture has them: pixel (x, y) shows eye + (first + x right + y down) / depth,
 * and nothing where its depth is 0. */
struct pen_trace_view {
    const float *depths; /* reversed: one over the distance along the view axis, in any unit */
    const uint16_t
        *normals; /* four each: octahedral geometric normal of [0, 65535], two not read */
    float first[3], right[3], down[3];
};

/* Where receiver `pixel` of a picture of that width is, and its geometric normal, of any length; false
 * where there is none. */
bool pen_trace_view_read(const struct pen_trace_view *view, const float eye[3], uint32_t width,
    uint32_t pixel, float position[3], float normal[3]);

/* Receivers, and how they are sampled. Receivers are in rows: neighbours in the image should be
 * neighbours here. A receiver whose normal is (0,0,0) is none: it costs nothing and is lit. */
struct pen_trace_job {
    const float *positions;   /* x, y, z of each receiver, world */
    const float *normals;     /* geometric, towards the side that is seen; any length */
    uint32_t position_stride; /* floats from one receiver to the next; 0: 3 */
    uint32_t normal_stride;
    const struct pen_trace_view *view; /* or NULL; then positions and normals are not read */
    uint32_t width, height;            /* count = width * height; height 1 for a list */
    uint32_t samples;   /* per receiver, at most; rounded up to a power of two, 1 .. 65536 */
    float target_error; /* stop when the standard error is below; 0: always all samples */
    uint32_t weighting; /* enum pen_trace_weighting */
    bool front_only;    /* single-sided triangles cast only to their front */
    bool adaptive;      /* all samples only near receivers whose pre-test is mixed */
    uint32_t dilation;  /* of that neighbourhood, receivers; 0: 4 */
    /* Ray origins are lifted along the normal by the larger of `bias` (m) and 2^-18 of the size of
     * the coordinates (their rounding). Positions from a depth buffer err along the way from `eye`,
     * which is free: they are brought back on it, where no surface that touches theirs can be jumped
     * over, by the larger of distance * depth_error (0x1p-16f when 32-bit floats hold depths of up to
     * 100 near planes) and distance * aim_error / cosine. The latter is by how far, as a tangent, the
     * rasteriser misses the centre of a pixel: beside a seam it shows the other surface's plane. */
    float bias;
    float eye[3];
    float depth_error, aim_error;
    uint32_t seed;
    /* Where what is there already is taken from, if it is not of more samples than these, and what
     * there is in the end is left, complete or stopped; NULL there: nothing. NULL: not wanted. */
    struct pen_trace_kept **kept;
    uint32_t threads;     /* 0: as many as this process may run on */
    uint64_t deadline_ns; /* CLOCK_MONOTONIC; 0: none */
    /* Called on the caller's thread whenever about turn_ms have passed; the other threads end the tile
     * that they are at and wait. False: the job ends with an error. NULL: it is done in one go. */
    bool (*turn)(void *context);
    void *turn_context;
    double turn_ms;
    /* Called likewise, while nobody traces, whenever all receivers have had `done` of the samples. SHOW: the result's arrays
     * are filled with what that gives, and `show` is called; false from it as from `turn`. STOP: that
     * is the result. NULL: nobody asks. */
    enum pen_trace_step (*step)(void *context, uint32_t done, uint32_t total);
    bool (*show)(void *context);
    /* Called after it, for what needs the arrays no more: the other threads trace on, but while they
     * are held. May be NULL. */
    bool (*shown)(void *context, struct pen_trace_crew *crew);
};

struct pen_trace_result { /* each array: width * height, or NULL when not wanted */
    /* rgb: mean over the light of e V, a: mean of V (G: both means weighted by G). V = 0 for light
     * points behind the receiver's plane and for receivers behind a one-sided emitter. */
    float *visibility; /* RGBA */
    /* Estimated standard error of a; 0: all samples agreed, and it is of order 1 / samples. It
     * comes from the difference of the two samples in each half-resolution stratum, which is
     * unbiased for two samples per stratum and so slightly too large for the finer net we use. */
    float *standard_error;
    uint32_t *samples; /* spent on each receiver, pre-test not counted */
};

struct pen_trace_stats {
    uint64_t rays;
    uint64_t receivers;      /* with a normal */
    uint64_t full_receivers; /* of them, those that got more than the pre-test */
    double build_seconds;    /* of the light's hierarchy; 0: it was there */
    uint64_t casters;        /* triangles in it */
    uint64_t filtered;       /* of them, those that need a facing test or a texture */
    double seconds;          /* wall clock, without build_seconds */
    double cpu_seconds;      /* of all threads together */
    double mrays_per_second; /* rays / seconds / 1e6 */
    uint32_t samples;        /* the rounded count */
    uint32_t threads;
};

/* Visibility of one light from every receiver. The same job gives the same bytes for any number of
 * threads on the same kind of CPU.
 * Sampling: one Owen-scrambled Sobol (0,2)-sequence per job; every receiver shifts its low bits by a
 * digital XOR of its own, which keeps the net's stratification, turns bands into noise and lets
 * neighbouring rays of a packet aim at the same part of the light.
 * Errors: PEN_INVALID for a bad job, PEN_DEADLINE, PEN_INTERNAL. `stats` may be NULL. */
bool pen_trace_visibility(struct pen_trace_scene *scene, const struct pen_trace_light *light,
    const struct pen_trace_job *job, const struct pen_trace_result *result,
    struct pen_trace_stats *stats, struct pen_error *error);

/* The half float next to x, which is at least 0. */
static inline uint16_t pen_trace_half(float x)
{
    union {
        float value;
        uint32_t bits;
    } f = {x < 65504.0f ? x : 65504.0f};
    if (f.value < 0x1p-14f) /* subnormal: its unit is 2^-24 */
        return (uint16_t)(f.value * 0x1p24f + 0.5f);
    return (uint16_t)((f.bits - 0x38000000u + 0xfffu + (f.bits >> 13 & 1)) >> 13);
}

/* Share of an emitter's area where middle + x across + y along > 0: x and y in [-1, 1], or on the unit
 * disk when it is round. */
float pen_trace_horizon_share(float middle, float across, float along, bool round);

/* A pinhole camera: unit axes, +forward into the picture. */
struct pen_trace_camera {
    float eye[3], right[3], up[3], forward[3];
    float tan_half_fov_y;
    uint32_t width, height;
    float jitter[2]; /* px, added to the pixel centre (x + 1/2, y + 1/2); y down */
};
/* The axes of a camera at `eye` that looks at `target`. */
struct pen_trace_camera pen_trace_camera_look_at(const float eye[3], const float target[3],
    const float up[3], float fov_y_deg, uint32_t width, uint32_t height);

struct pen_trace_hits {  /* top row first, width * height; each array may be NULL */
    float *positions;    /* xyz */
    float *normals;      /* xyz, unit, geometric, towards the eye; 0: nothing hit */
    uint32_t *instances; /* PEN_TRACE_NONE: nothing, or the ground */
    uint32_t *triangles; /* within the instance's primitive */
};
#define PEN_TRACE_NONE 0xffffffffu

/* What a camera sees, by primary rays: back faces of single-sided materials and cut-out texels are
 * looked through. For tests without GL and to check the rasteriser. */
bool pen_trace_primary(struct pen_trace_scene *scene, const struct pen_trace_camera *camera,
    uint32_t threads, const struct pen_trace_hits *hits, struct pen_error *error);
