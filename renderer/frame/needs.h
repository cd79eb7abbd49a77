/* What a request needs of a frame. */
#pragma once
#include "protocol/request.h"

/* A layer of the output is made of that. */
bool frame_needs(const struct pen_request *request, enum pen_layer_source source);
/* True when the method has to run at all. */
bool frame_needs_shadows(const struct pen_request *request);
