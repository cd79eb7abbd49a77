/* One image: the list of passes from geometry to finished pixels. */
#pragma once
#include "renderer/scene/emission.h"
#include "renderer/renderer.h"
#include "renderer/technique.h"

#define FRAME_VIS_LIGHTS PEN_MAX_LIGHTS

/* An accumulator over lights and jittered frames. */
struct frame_layer {
    struct gl_texture sum;
    GLuint framebuffer;
};

struct frame_targets {
    struct gbuffer gbuffer;
    struct gl_texture vis; /* RGBA16F array, a layer per light */
    GLuint vis_framebuffers[FRAME_VIS_LIGHTS];
    struct gl_texture color, beauty_sum, vis_sum;
    GLuint color_framebuffer, beauty_framebuffer, vis_sum_framebuffer;
    struct frame_layer classes;  /* RG16F: times proved lit, in umbra */
    struct frame_layer variance; /* R32F: sum of the squared standard errors */
};
void frame_targets_finish(struct frame_targets *targets);

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
};

/* Fills *frame (planes allocated) and the counters of *result. */
bool frame_render(const struct frame_job *job, struct pen_frame *frame, struct pen_result *result,
    struct pen_error *error);
