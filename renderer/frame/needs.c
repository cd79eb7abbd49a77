#include "renderer/frame/needs.h"

bool frame_needs(const struct pen_request *r, enum pen_layer_source source)
{
    return r->output.layer == PEN_LAYER_ALL || pen_layers[r->output.layer].source == source;
}

bool frame_needs_shadows(const struct pen_request *r)
{
    return r->output.layer == PEN_LAYER_ALL ||
           pen_layers[r->output.layer].source != PEN_SOURCE_GBUFFER;
}
