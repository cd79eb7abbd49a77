/* Renders generated scenes without a daemon and hands out visibility beside positions, so that a
 * test can compare every pixel with a closed form. */
#pragma once
#include "renderer/generate/generate.h"
#include "renderer/renderer.h"

struct shot {
    uint32_t width, height;
    float *visibility; /* RGBA per pixel: rgb coloured, a mean visibility */
    float *position;   /* RGBA per pixel: world xyz; background: 0 */
    float *normal;     /* RGBA per pixel: world shading normal; background: 0 */
    float *beauty;     /* RGBA per pixel: linear radiance */
    float *classes;    /* RGBA per pixel: r = 0 proved lit, 1 undecided, 2 proved in umbra */
    float *error;      /* RGBA per pixel: r = standard error; NULL when not estimated */
    struct pen_result result;
};

/* One renderer per test program. Exits 77 (skipped) when there is no OpenGL at all. */
struct pen_renderer *harness_renderer(void);

/* Loads a generated scene once per options; `id` is written. Exits on failure. */
void harness_scene(const struct pen_generated_options *options, uint8_t id[PEN_ID_BYTES]);
/* The same of a blob made elsewhere, which is freed; the caller chooses `id`. */
void harness_scene_blob(void *data, size_t bytes, const uint8_t id[PEN_ID_BYTES]);
/* Loads a .pscene file; false when it is not there. */
bool harness_scene_file(const char *path, uint8_t id[PEN_ID_BYTES]);

/* Renders with query-style settings, "key=value" separated by '&' (see pen_request_from_query), all
 * layers in float. Exits on failure: a method that cannot render is a failed test. */
void harness_shot(const uint8_t id[PEN_ID_BYTES], const char *settings, struct shot *shot);
void harness_shot_finish(struct shot *shot);

/* A camera between caster and receiver that looks straight down on [-half, half]^2 of y = 0, and a
 * rect light of side `light` at height 3 facing down; settings to start a query with. */
#define HARNESS_VIEW                                                                               \
    "width=256&height=256&ground=off&camera.eye=0,1,0&camera.target=0,0,0&camera.up=0,0,-1"        \
    "&camera.fov_y_deg=90"
#define HARNESS_RECT                                                                               \
    "&light.type=rect&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1"                     \
    "&light.width=1&light.height=1"
#define HARNESS_DISK                                                                               \
    "&light.type=disk&light.position=0,3,0&light.target=0,0,0&light.up=0,0,-1&light.radius=0.5"

/* Root mean square of visibility alpha against truth(x, z, user) over pixels with |y| < 1 mm. */
struct deviation {
    double rmse, worst, mean; /* mean is signed: ours - truth */
    double rmse_penumbra;     /* where 0.02 < truth < 0.98 */
    uint32_t pixels;
};
typedef double (*truth_function)(double x, double z, const void *user);
struct deviation harness_deviation(const struct shot *shot, truth_function truth, const void *user);

/* T1 (half-plane x <= 0 at height c, rect light of half width a at height h), T2 (square of half
 * size s), T3 (T1 under a disk of radius a): docs/closed-forms.md. */
struct planar_case {
    double c, h, a, s;
};
double truth_half_plane(double x, double z, const void *planar_case);
double truth_square(double x, double z, const void *planar_case);
double truth_half_plane_disk(double x, double z, const void *planar_case);
double truth_one(double x, double z, const void *unused);

/* Width between 10 % and 90 % along x at z = 0, m (bilinear between pixel centres). */
double harness_width_10_90(const struct shot *shot);
/* Pixels that show a surface. */
uint32_t harness_receivers(const struct shot *shot);
/* Pixels whose visibility is NaN or infinite. */
uint32_t harness_not_finite(const struct shot *shot);
