#pragma once
#include "renderer/import/convert/context.h"

/* Walks the scene and adds instances, lights and cameras. */
bool imp_add_nodes(struct imp_context *context, struct pen_error *error);
