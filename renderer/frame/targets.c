#include "renderer/frame/targets.h"
#include <string.h>

static void finish_gbuffer(struct gbuffer *g)
{
    struct gl_target *targets[] = {&g->depth, &g->normal, &g->albedo, &g->surface, &g->emission};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        gl_target_destroy(targets[i]);
    gl.DeleteFramebuffers(1, &g->framebuffer);
}

void frame_targets_forget(struct frame_targets *t)
{
    t->gbuffer.shown.known = t->layer.shown.known = 0;
}

void frame_targets_finish(struct frame_targets *t)
{
    struct gl_target *targets[] = {&t->layer_before, &t->front_depth, &t->front_normal,
        &t->front_places, &t->layers, &t->layers_kept, &t->vis, &t->color, &t->beauty,
        &t->visibility, &t->classes, &t->variance, &t->sky_open[0], &t->sky_open[1], &t->stairs,
        &t->places, &t->means[0], &t->means[1], &t->means[2], &t->spread};
    for (size_t i = 0; i < sizeof targets / sizeof *targets; i++)
        gl_target_destroy(targets[i]);
    finish_gbuffer(&t->gbuffer);
    finish_gbuffer(&t->layer);
    memset(t, 0, sizeof *t);
}

void frame_fit_sum(struct gl_target *target, GLenum format, const struct pen_request *r)
{
    static const float zero[4] = {0};
    gl_target_fit(target, format, r->width, r->height, 0, 1);
    gl_target_clear(target, zero);
}
