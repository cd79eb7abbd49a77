/* Screen-sized textures that the passes of one light hand to each other. Their contents last until
 * the next method uses the slot; nothing is kept between requests. */
#pragma once
#include "renderer/passes/draw/passes.h"

enum pass_scratch_slot {
    SCRATCH_SPREAD, /* of passes/filter/penumbra.c */
    SCRATCH_LIT,
    SCRATCH_ALL, /* what a filter reads */
    SCRATCH_LIT_NEXT,
    SCRATCH_ALL_NEXT, /* and writes */
    SCRATCH_HARD,
    SCRATCH_AXES,
    SCRATCH_EDGES,
    SCRATCH_LINES, /* of techniques/erosion.c */
    SCRATCH_SLOTS
};
_Static_assert(
    SCRATCH_SLOTS <= sizeof((struct technique_ctx){0}.scratch) / sizeof(struct gl_texture),
    "a texture for each slot");

/* The slot's texture with this format and number of levels (0: the whole chain). */
const struct gl_texture *pass_scratch(
    struct technique_run *run, enum pass_scratch_slot slot, GLenum format, uint32_t levels);
void pass_scratch_clear(const struct gl_texture *texture, const float value[4]); /* level 0 */
void pass_scratch_finish(struct technique_ctx *ctx);

/* Methods that filter over the screen collect the faces of a light first. */
bool pass_is_first_face(const struct technique_run *run);
bool pass_is_last_face(const struct technique_run *run);
