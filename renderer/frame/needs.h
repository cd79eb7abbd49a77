/* What a request needs of a frame. */
#pragma once
#include "renderer/frame/job.h"

/* A layer of the output is made of that. */
static inline bool frame_needs(const struct pen_request *r, enum pen_layer_source source)
{
    return r->output.layer == PEN_LAYER_ALL || pen_layers[r->output.layer].source == source;
}

/* True when the method has to run at all. */
static inline bool frame_needs_shadows(const struct pen_request *r)
{
    return r->output.layer == PEN_LAYER_ALL ||
           pen_layers[r->output.layer].source != PEN_SOURCE_GBUFFER;
}

/* It can be shown before it is complete; layers that count the work cannot. */
static inline bool frame_can_show(const struct pen_request *r)
{
    return r->output.layer != PEN_LAYER_ALL &&
           (frame_needs(r, PEN_SOURCE_BEAUTY) || frame_needs(r, PEN_SOURCE_VISIBILITY));
}

/* The picture is made of layers: see blended.h. */
static inline bool frame_is_layered(const struct frame_job *job)
{
    return job->scene->has_blend && frame_needs(job->request, PEN_SOURCE_BEAUTY);
}
