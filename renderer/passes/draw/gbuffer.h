#pragma once
#include "renderer/technique.h"

/* The G-buffer of the frame. */
bool pass_gbuffer(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    bool ground, struct gbuffer *gbuffer, uint64_t *triangles, struct pen_error *error);
