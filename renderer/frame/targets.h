/* What the passes of a frame draw into; kept from frame to frame. */
#pragma once
#include "renderer/technique.h"

#define FRAME_MEANS 3

struct frame_edges;

struct frame_targets {
    struct gbuffer gbuffer;
    struct gl_target vis;    /* RGBA16F array, a layer per light; aimed at the light at work */
    struct gl_target color;  /* what is read back */
    struct gl_target stairs; /* the same before its edges are smooth */
    struct gl_target places; /* D32F, EDGE_PLACES samples, of some rows of the picture */
    /* Of scenes with blended surfaces (blended.h); `gbuffer` is then of what is solid: */
    struct gbuffer layer;          /* of one layer of them; at last what data layers say */
    struct gl_target layer_before; /* D32F */
    struct gl_target front_depth;  /* D32F: the first layer's */
    struct gl_target front_normal; /* RGBA16; for smooth edges, as the next */
    struct gl_target front_places; /* as places */
    struct gl_target layers;       /* RGBA32F: sum over the layers of one jittered frame */
    struct gl_target layers_kept;  /* the same, while a picture is shown */
    /* Sums over lights and jittered frames: */
    struct gl_target beauty, visibility; /* RGBA32F */
    struct gl_target classes;            /* RG16F: times proved lit, in umbra */
    struct gl_target variance;           /* R32F: of the squared standard errors */
    /* Of a picture that is seen before it is complete: R32F, mean visibilities; RG32F, how far they
     * are apart, by tiles. */
    struct gl_target means[FRAME_MEANS], spread;
    struct frame_edges *edges; /* edges.h; of the frame in progress, or NULL */
    struct gl_target
        sky_open[2]; /* RG32F, half size: how much of the sky is seen, depth; raw, smooth */
    const struct gbuffer *sky_of; /* whose sky that is, or NULL, */
    uint32_t sky_drawn;           /* as it was drawn for the so many-th time */
};
/* Makes a sum fit the request's picture and start at 0. */
void frame_fit_sum(struct gl_target *target, GLenum format, const struct pen_request *request);
void frame_targets_forget(struct frame_targets *targets); /* what was seen is drawn anew */
void frame_targets_finish(struct frame_targets *targets); /* zeroed: nothing happens */
