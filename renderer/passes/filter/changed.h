/* Where a picture's visibility is no longer what it was. */
#pragma once
#include "renderer/technique.h"

/* Remembers a sum over each tile of `vis`, all of its layers. `again`: *tiles are then, as a classifier's,
 * undecided where the sum is another one than at the last call; else *tiles stays. */
bool pass_changed(struct technique_ctx *ctx, const struct gl_texture *vis, bool again,
    const struct gl_texture **tiles, struct pen_error *error);
