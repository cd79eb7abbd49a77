#pragma once
#include "renderer/import/motion/motion.h"

/* How much of each key is wanted: so many components or, of morph weights, at most so many. */
struct imp_width {
    uint32_t components;
    bool weights;
};
/* A sampler's keys into the blob; without `psc` only its times are checked. Raises *end to
 * its last key. */
bool imp_sampler(struct imp_context *context, uint32_t sampler, struct imp_width width,
    uint32_t *psc, float *end, struct pen_error *error);
