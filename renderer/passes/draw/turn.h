/* A frame is made in turns: between two pieces of it other frames may be drawn, or it is given up. */
#pragma once
#include "renderer/technique.h"

/* Called by every pass when a piece of work is done and nothing of it is bound any more. When the
 * turn has lasted long enough this comes back only with the next one; ctx->turns.number then
 * differs, and of GL's state only the blocks of frame, light and parameters are as before. False,
 * with the error filled, when the frame is not wanted any more. */
bool pass_turn(struct technique_ctx *ctx, struct pen_error *error);
/* Before anything is drawn into a new texture, and by pass_turn: false, with PEN_TOO_BIG, when there
 * was no room for it. */
bool pass_fits(const struct technique_ctx *ctx, struct pen_error *error);
/* As pass_turn, within a pass that is being timed: waits for what was drawn so far. */
bool pass_turn_inside(struct technique_ctx *ctx, struct pen_error *error);
/* Nobody comes in between now: nothing need be cut. */
bool pass_turn_is_whole(const struct technique_ctx *ctx);
/* Binds a method's counters, for all of its passes. */
void pass_bind_counts(struct technique_ctx *ctx, GLuint buffer);

/* What was measured of a kind of work; of one that is not known yet 0, in place of another. */
struct technique_speed *pass_speed(struct technique_ctx *ctx, uint64_t kind);

/* In software several pieces are under way at a time, so that nobody waits for who hands them over, and each is
 * to last so much of a turn. */
#define PASS_PIECE_SHARE 0.5
/* Hands over what was drawn since, `units` of a kind, or < 0 when that tells nothing of others, and
 * waits until fewer than TECHNIQUE_PIECES are under way, or, `wait`, none; learns from those that are done.
 * Returns what the last of them took, ms; 0: not known. Elsewhere than in software it is nothing. */
double pass_hand_over(struct technique_ctx *ctx, uint64_t kind, double units,
    const struct gl_stopwatch *since, bool wait);

/* A large drawing of triangles is cut into bands of rows, and what triangles there are in one into pieces, each as
 * long as a turn should last. */
struct pass_bands {
    uint32_t y, rows, height, width; /* px; the band at hand: y to y + rows */
    uint64_t kind;
    struct gl_stopwatch since;
    /* Of a drawing of triangles (scene_draw), that of the band which is at hand. */
    struct cull_piece piece;
    double slowest_ms; /* of the band's pieces so far */
    bool by_hand;      /* not by the device: what is drawn is done */
};
/* first_pixels: of the first band; what there is to a pixel is only known then. kind: of drawings whose
 * triangles take equally long. */
void pass_bands_begin(struct technique_ctx *ctx, struct pass_bands *bands, uint32_t width,
    uint32_t height, uint32_t first_pixels, uint64_t kind);
/* What outside the band need not be drawn: narrows a matrix to clip space, in which row 0 of `height` is
 * at y = `top` (-1 or 1); the drawing begins in row `first`. */
void pass_bands_crop(
    const struct pass_bands *bands, float top, uint32_t first, uint32_t height, mat4 to_clip);
/* Scissors the band; call before each drawing. */
void pass_bands_aim(const struct pass_bands *bands);
/* After it. *more: there is another piece or band. False as pass_turn. */
bool pass_bands_next(
    struct technique_ctx *ctx, struct pass_bands *bands, bool *more, struct pen_error *error);
