#include "renderer/passes/draw/passes.h"
#include "protocol/memory.h"
#include <stdlib.h>

struct kept {
    struct kept *next;
    const struct pass_targets *key;
    struct gl_target targets[];
};

struct passes {
    struct kept *first; /* a handful, so a list will do */
};

struct passes *passes_create(void)
{
    return pen_alloc_zero(1, sizeof(struct passes));
}

void passes_destroy(struct passes *passes)
{
    if (!passes)
        return;
    while (passes->first) {
        struct kept *kept = passes->first;
        passes->first = kept->next;
        for (uint32_t i = 0; i < kept->key->count; i++)
            gl_target_destroy(&kept->targets[i]);
        free(kept);
    }
    free(passes);
}

struct gl_target *pass_targets(struct technique_ctx *ctx, const struct pass_targets *key)
{
    for (struct kept *k = ctx->passes->first; k; k = k->next)
        if (k->key == key)
            return k->targets;
    struct kept *kept = pen_alloc_zero(1, sizeof *kept + key->count * sizeof *kept->targets);
    kept->key = key;
    kept->next = ctx->passes->first;
    ctx->passes->first = kept;
    return kept->targets;
}
