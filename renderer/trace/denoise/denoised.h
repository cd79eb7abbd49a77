/* Visibility from few shadow rays, smoothed on the screen: a pre-test finds where the light is partly
 * hidden, a few rays per pixel go there, more where the penumbra is narrow, and a filter as wide as the
 * blockers make the penumbra averages what is left over each pixel's own surface. */
#pragma once
#include "renderer/trace/trace.h"

struct pen_trace_denoising {
    uint32_t refine; /* more rays where the filter is too wide for the penumbra; 0: none */
    float budget; /* of those, per pixel of the picture at most: `refine` is lowered to keep it */
};

/* Of a job with a view and `samples` rays per pixel (rounded up to a power of two, DENOISED_SAMPLES at
 * most); weighting, adaptive, target_error, kept and step are not read. `halves`: four per receiver, as
 * the visibility buffer has them, the horizon counted; others are lit. Errors and `stats` as of
 * pen_trace_visibility; full receivers are those near a penumbra. */
#define DENOISED_SAMPLES 64
#define DENOISED_REFINE 1024
bool pen_trace_denoised(struct pen_trace_scene *scene, const struct pen_trace_light *light,
    const struct pen_trace_job *job, const struct pen_trace_denoising *how, uint16_t *halves,
    struct pen_trace_stats *stats, struct pen_error *error);
