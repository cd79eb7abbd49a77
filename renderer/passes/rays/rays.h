/* Shadow rays from every receiver of the G-buffer to one light: on the CPU by renderer/trace, or on
 * the device by compute shaders. Both take the same samples under the same rules (trace.h). */
#pragma once
#include "renderer/technique.h"
#include "renderer/trace/trace.h"

/* See pen_trace_job. */
#define RAY_DEPTH_ERROR 0x1p-16f
#define RAY_AIM_ERROR                                                                              \
    0x1p-7f /* px: corners lie on a grid of 1/256, so edges miss by a step or two */

/* Few rays and a filter, where the host traces: see renderer/trace/denoise/denoised.h. */
struct ray_denoising {
    uint32_t samples, refine;
    float budget;
};

struct ray_job {
    uint32_t samples;   /* per receiver, at most; rounded up to a power of two */
    float target_error; /* stop when the standard error is below; 0: all samples */
    uint32_t weighting; /* enum pen_trace_weighting */
    bool adaptive;      /* all samples only near receivers whose pre-test is mixed */
    uint32_t seed;
    const struct ray_denoising *denoising; /* instead of all these rays; NULL: no */
    /* Turns targets into vis, for an estimate that is to be seen (passes/draw/show.h). */
    bool (*settle)(struct technique_run *run, struct pen_error *error);
};

/* What a light's rays leave, and room to work in; kept between frames. Zero to start. */
struct ray_targets {
    struct gl_target visibility;       /* RGBA32F: rgb mean of e V, a mean of V */
    struct gl_target standard_error;   /* R32F, of a */
    struct gl_target receivers[2];     /* RGBA32F: world position, geometric normal; 0: none */
    GLuint receivers_framebuffer;      /* of both */
    struct gl_target verdicts, spread; /* of the device */
    GLuint points, state, list, counters, job; /* of the device: buffers */
};
void ray_targets_finish(struct ray_targets *targets);

/* The light of run->face in the tracer's terms, without its emission. */
struct pen_trace_light ray_light(const struct technique_run *run);
/* RAY_AIM_ERROR as a tangent. */
float ray_aim_error(const struct technique_run *run);
/* Fills targets->receivers from the G-buffer. */
bool ray_receivers(struct technique_run *run, struct ray_targets *targets, struct pen_error *error);

/* Fill targets->visibility and, the host where somebody asks, standard_error, and count rays and
 * receivers into run->result. The host fills vis instead where ray_host_settles. */
bool pass_rays_device(struct technique_run *run, const struct ray_job *job,
    struct ray_targets *targets, struct pen_error *error);
#ifdef PENUMBRA_HAVE_TRACE
bool pass_rays_host(struct technique_run *run, const struct ray_job *job,
    struct ray_targets *targets, struct pen_error *error);
bool ray_host_settles(const struct technique_run *run, const struct ray_job *job);
#endif
