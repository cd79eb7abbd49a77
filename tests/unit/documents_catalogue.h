/* A small catalogue with one parameter of every kind, so that the documents are tested
 * without the renderer. */
#pragma once
#include "protocol/request.h"
#include "protocol/technique_info.h"

struct fake_params {
    uint32_t search_taps;
    int32_t offset;
    float bias;
    float tint[3];
    uint32_t mode; /* fake_modes */
    pen_flag rotate;
};
extern const char *const fake_modes[];

/* "none" (no parameters), "hard" (one) and "pcss" (struct fake_params). */
extern const struct pen_catalogue fake_catalogue;
