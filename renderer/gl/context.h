/* One OpenGL context without a window: EGL on a GPU, EGL surfaceless, or OSMesa. */
#pragma once
#include "protocol/result.h"
#include "renderer/device.h"

struct gl_context;

/* Makes the context current on the calling thread and loads `gl`. Tries the kinds in the order of
 * enum pen_device_choice when config->choice is AUTO. Errors: PEN_UNAVAILABLE. */
struct gl_context *gl_context_create(
    const struct pen_device_config *config, struct pen_device_info *info, struct pen_error *error);
void gl_context_destroy(struct gl_context *context);
