/* What it takes to make one image. */
#pragma once
#include "renderer/frame/targets.h"
#include "renderer/picture.h"
#include "renderer/scene/emission.h"

struct frame_job {
    struct technique_ctx *ctx;
    struct frame_targets *targets;
    struct scene *scene;
    struct pen_request *request; /* completed while rendering */
    const struct technique *technique;
    void *technique_state;
    struct emission_cache *emissions;
    const struct scene *(*find_image)(void *owner, const struct pen_light *light);
    void *owner;
    struct pen_viewer viewer;   /* wants NULL: nobody watches */
    double budget_ms, until_ms; /* see pen_render_limit */
    struct history *history;    /* of the sequence that it goes on with, or NULL */
    struct kept_sums *sums;     /* of what it goes on with, or NULL */
};
