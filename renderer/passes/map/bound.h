/* An upper bound of what every method that looks things up in depth maps may answer, from the exact
 * depths seen from the light's centre: see shaders/screen/bound.glsl. */
#pragma once
#include "renderer/technique.h"

#define SHARED_ROWS "renderer/shaders/screen/bound.def"
#include "renderer/shared/rows_c.h"

/* Lowers vis to the bound that run->bound describes; does nothing without one. */
bool pass_bound(struct technique_run *run, struct pen_error *error);
