/* Tiles in which a method left its answer open by one less than 0, to look again there alone. */
#pragma once
#include "renderer/technique.h"

/* *tiles is for pass_screen, valid until the next call. */
bool pass_open_tiles(
    struct technique_run *run, const struct gl_texture **tiles, struct pen_error *error);
