#pragma once
#include "renderer/technique.h"

/* Which blended surfaces are in it. */
enum gbuffer_kind {
    GBUFFER_HASHED, /* each in a share alpha of its pixels */
    GBUFFER_SOLID,  /* none, but where alpha is 1 */
    GBUFFER_LAYER,  /* one layer of them and nothing else; the albedo's alpha is theirs */
};

struct gbuffer_pass {
    enum gbuffer_kind kind;
    bool ground;
    const float *ground_albedo; /* RGB */
    /* Of a layer. It is the nearest behind `before`, in front of `solid`; depths. */
    const struct gl_texture *before, *solid;
    bool last; /* a share alpha of all that lie behind `before`, without alpha */
};

/* The G-buffer of the frame. One that holds the same view of the same scene, but for layers, is taken
 * as it is: then there is no pass "gbuffer". */
bool pass_gbuffer(struct technique_ctx *ctx, struct scene *scene, const struct view *view,
    const struct gbuffer_pass *pass, struct gbuffer *gbuffer, uint64_t *triangles,
    struct pen_error *error);
