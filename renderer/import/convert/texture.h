#pragma once
#include "renderer/import/convert/context.h"

/* The psc texture of a glTF texture; -1 when there is no such texture. One without an
 * image that can be decoded becomes plain, so that the material's other values show. */
int32_t imp_texture(struct imp_context *context, int32_t texture, enum imp_role role);
/* Decodes every image that a texture asked for, in the order of their slots. */
bool imp_add_images(struct imp_context *context, struct pen_error *error);
