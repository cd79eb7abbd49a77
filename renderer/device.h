/* Which device to render on. No GL. */
#pragma once
#include <stdbool.h>
#include <stdint.h>

enum pen_device_choice {
    PEN_DEVICE_AUTO,
    PEN_DEVICE_GPU,
    PEN_DEVICE_SURFACELESS,
    PEN_DEVICE_OSMESA
};
extern const char *const pen_device_choice_names[]; /* "auto", "gpu", "surfaceless", "osmesa" */

struct pen_device_config {
    uint32_t choice;  /* enum pen_device_choice */
    uint32_t index;   /* which EGL device, counting GPUs from 0 */
    bool require_gpu; /* fail rather than run in software */
    bool debug;       /* GL debug output to stderr */
};
