/* What takes long in pieces, each as long as a turn should last (turn.h): passes over the screen, and
 * memory. */
#pragma once
#include "renderer/technique.h"

struct pass_pieces {
    uint32_t width, height;       /* px, of the pass */
    uint32_t x, y, columns, rows; /* the piece at hand: whole tiles (tiles.h) */
    uint64_t kind;
    struct gl_stopwatch since;
};
/* kind: of passes that take equally long for equal pixels. The first of its kind begins with a small
 * piece; what it was measured to take is kept with the context. */
void pass_pieces_begin(struct technique_ctx *ctx, struct pass_pieces *pieces, uint32_t width,
    uint32_t height, uint64_t kind);
/* Scissors the piece; call before each drawing. */
void pass_pieces_aim(const struct pass_pieces *pieces);
/* After it. *more: there is another piece. False as pass_turn. */
bool pass_pieces_next(
    struct technique_ctx *ctx, struct pass_pieces *pieces, bool *more, struct pen_error *error);

/* Before a texture of so many bytes is made. A software device clears it at once, and pages that are
 * there for the first time can take milliseconds per MiB; here they come a few at a time. */
bool pass_room(struct technique_ctx *ctx, uint64_t bytes, struct pen_error *error);
