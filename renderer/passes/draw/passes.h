/* What passes keep between their calls: each its own targets, which nobody else can name. */
#pragma once
#include "renderer/technique.h"

struct passes *passes_create(void);
void passes_destroy(struct passes *passes); /* NULL is fine */

/* One static of a pass: its address is the key to that pass's targets. */
struct pass_targets {
    uint32_t count;
};
/* `key->count` targets, zero before the first call, kept as long as the renderer. */
struct gl_target *pass_targets(struct technique_ctx *ctx, const struct pass_targets *key);
