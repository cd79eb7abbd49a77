/* Interleaved sampling (Keller and Heidrich 2001): neighbouring pixels use different taps, and a
 * 4 x 4 average over the same surface makes one large kernel of them. */
#pragma once
#include "renderer/passes/draw/screen.h"

/* Runs `pass` with INTERLEAVED defined: its visibility() returns (V, width of the penumbra in
 * pixels, 0, 1). Where the penumbra is narrower than the 4 x 4 block the average fades out, so that
 * contacts stay sharp. Only for methods with a scalar visibility. */
bool pass_interleaved(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error);
/* The same for coloured visibility: the first pass returns interleave_colour(T and V, width). */
bool pass_interleaved_colour(
    struct technique_run *run, const struct pass_screen *pass, struct pen_error *error);
